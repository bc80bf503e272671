# SPDX-License-Identifier: MIT
"""Where chunks of robots are computed: here, on the cores of this machine, or on a Dask cluster."""

from __future__ import annotations

import contextlib
import functools
import itertools
import pickle
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from symkin.errors import SymkinError
from symkin.mechanism import Mechanism
from symkin.planning import Plan
from symkin.study.definition import Cell, StudyDefinition
from symkin.study.robots import Job, planned

__all__ = [
    "Chunk",
    "begun",
    "compute",
    "dask_client",
    "make_plans",
    "opened_client",
    "require_version",
    "spread",
]

Array = NDArray[np.float64]
PlanKey = tuple[Any, ...]

Chunk = tuple[int, int]  # first robot, and the one behind the last
Columns = dict[str, NDArray[Any]]

_AHEAD = 3  # chunks that every core has or waits for
_CONNECT, _WORKERS = 15, 60  # s

# By default a worker is profiled a hundred times a second and its event loop measured fifty times,
# and memory that an array frees goes back to the system at once.
_UNDISTURBED = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "2s",
    "distributed.nanny.pre-spawn-environ": dict.fromkeys(
        ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), 1
    ),
}


@contextlib.contextmanager
def opened_client(workers: int, scheduler: str | None, tasks: int) -> Iterator[Any]:
    """A client of Dask where one is asked for, else None: the work is then done in this process."""
    if workers == 1 and scheduler is None:
        yield None
        return
    with dask_client(min(workers, tasks), scheduler) as client:
        yield client


def compute(job: Job, chunks: Sequence[Chunk], client: Any) -> Iterator[tuple[Chunk, Columns]]:
    """Compute chunks of robots, in whatever order they become ready.

    Parameters
    ----------
    job : Job
        What to compute.
    chunks : sequence of (int, int)
        First robot, and the one behind the last.
    client : distributed.Client or None
        Whose workers compute; None computes here.
    """
    if client is None:
        for chunk in chunks:
            yield chunk, job.chunk(*chunk)
        return
    import symkin

    # The job goes with every chunk: data of its own would be lost with its worker.
    parcel = pickle.dumps(job.light())
    calls = ((symkin.__version__, _chunk, parcel, chunk) for chunk in chunks)
    yield from spread(client, _called, calls)


def begun(calls: Sequence[tuple[Any, ...]], client: Any) -> Callable[[], list[Any]]:
    """Have workers make calls of functions beside what else they compute.

    Parameters
    ----------
    calls : sequence of (callable, argument, ...)
        What to call.
    client : distributed.Client
        Whose workers call.

    Returns
    -------
    callable
        Waits for the calls, and returns their results in order.
    """
    import symkin

    futures = [client.submit(_called, symkin.__version__, *call, pure=False) for call in calls]
    return lambda: list(client.gather(futures))


def make_plans(
    definition: StudyDefinition, candidates: Mapping[str, Array], client: Any
) -> Iterator[tuple[PlanKey, Plan | str]]:
    """Make the plans of a study, in whatever order they become ready.

    Parameters
    ----------
    definition : StudyDefinition
        The study.
    candidates : mapping
        Poses to choose from, by the mechanism's name.
    client : distributed.Client or None
        Whose workers choose; None chooses here.
    """
    cells = {cell.plan_key: cell for cell in definition.cells}
    # Those that take longest first, so that no process has one left when the others are done.
    cells = dict(sorted(cells.items(), key=lambda item: -_cost(definition, item[1])))
    calls = (
        (key, definition.loaded[cell.mechanism], cell, candidates[cell.mechanism], definition.seed)
        for key, cell in cells.items()
    )
    if client is None:
        for call in calls:
            yield _plan(*call)
        return
    import symkin

    yield from spread(client, _called, ((symkin.__version__, _plan, *call) for call in calls))


@contextlib.contextmanager
def dask_client(workers: int, scheduler: str | None = None) -> Iterator[Any]:
    """Connect to a scheduler, or start so many processes of one thread on this machine."""
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise SymkinError(
            "more than one process needs Dask: pip install 'symkin[cluster]', or leave out "
            "--workers and --scheduler"
        ) from error
    with contextlib.ExitStack() as opened:
        address: Any = scheduler
        if scheduler is None:
            # Any free port, since the usual one may be another's, and no dashboard, which needs
            # packages that nobody asked for. Nor does anybody see what is found by interrupting the
            # work for it.
            opened.enter_context(dask.config.set(_UNDISTURBED))
            address = opened.enter_context(
                LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=":0",
                    scheduler_kwargs={"dashboard": False},
                    memory_limit=0,
                )
            )
        try:
            client = opened.enter_context(Client(address, timeout=_CONNECT))
        except (OSError, ValueError) as error:
            raise SymkinError(
                f"{scheduler}: no Dask scheduler answers; expected the address that "
                "`dask scheduler` prints, such as tcp://10.0.0.1:8786"
            ) from error
        try:
            client.wait_for_workers(1, timeout=_WORKERS)
        except TimeoutError as error:
            raise SymkinError(
                f"{scheduler}: the scheduler has no workers; start some: dask worker {scheduler}"
            ) from error
        yield client


def spread(
    client: Any, function: Callable[..., Any], calls: Iterable[tuple[Any, ...]]
) -> Iterator[Any]:
    """Results of calls of a function, in whatever order they are ready.

    Keeps all workers busy; Dask gives the calls of one that dies to others.
    """
    from distributed import as_completed

    left = iter(calls)

    def submitted(waiting: int) -> list[Any]:
        """More calls, so many as the cores that there are now can do soon."""
        cores = max(sum(client.nthreads().values()), 1)
        return [
            client.submit(function, *call, pure=False)
            for call in itertools.islice(left, max(_AHEAD * cores - waiting, 0))
        ]

    ready: Any = as_completed(submitted(0))
    for future in ready:
        result = future.result()
        future.release()
        ready.update(submitted(ready.count()))
        yield result


def require_version(version: str) -> None:
    """Refuse to work for another version of symkin."""
    import symkin

    if symkin.__version__ != version:
        raise SymkinError(
            f"a worker has symkin {symkin.__version__}; expected {version}, as where it was started"
        )


def _cost(definition: StudyDefinition, cell: Cell) -> int:
    """How long a plan takes, in a unit of its own: some criteria take the time of six others."""
    counts = [len(leg.parameters) for leg in definition.loaded[cell.mechanism].legs]
    unknowns = sum(counts) if cell.design == "mechanism" else max(counts)
    return unknowns**2 * (1 if cell.criterion == "O1" else 6)


def _plan(
    key: PlanKey, mechanism: Mechanism, cell: Cell, candidates: Array, seed: int
) -> tuple[PlanKey, Plan | str]:
    return key, planned(mechanism, cell, candidates, seed)


def _called(version: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """What a worker does."""
    require_version(version)
    return function(*arguments)


def _chunk(parcel: bytes, chunk: Chunk) -> tuple[Chunk, Columns]:
    return chunk, _unpacked(parcel).chunk(*chunk)


@functools.lru_cache(maxsize=2)
def _unpacked(parcel: bytes) -> Job:
    job: Job = pickle.loads(parcel)
    return job
