# SPDX-License-Identifier: MIT
"""Where chunks of robots are computed: here, on the cores of this machine, or on a Dask cluster."""

from __future__ import annotations

import contextlib
import functools
import itertools
import pickle
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from numpy.typing import NDArray

from symkin.errors import SymkinError
from symkin.study.robots import Job

__all__ = ["Chunk", "compute", "dask_client", "require_version", "spread"]

Chunk = tuple[int, int]  # first robot, and the one behind the last
Columns = dict[str, NDArray[Any]]

_AHEAD = 3  # chunks that every core has or waits for
_CONNECT, _WORKERS = 15, 60  # s


def compute(
    job: Job, chunks: Sequence[Chunk], workers: int = 1, scheduler: str | None = None
) -> Iterator[tuple[Chunk, Columns]]:
    """Compute chunks of robots, in whatever order they become ready.

    Parameters
    ----------
    job : Job
        What to compute.
    chunks : sequence of (int, int)
        First robot, and the one behind the last.
    workers : int
        Processes on this machine; 1 computes in this one.
    scheduler : str, optional
        Address of a running Dask scheduler, whose workers compute instead.

    Raises
    ------
    SymkinError
        Without Dask, or a scheduler or workers that answer.
    """
    if not chunks:
        return
    if workers == 1 and scheduler is None:
        for chunk in chunks:
            yield chunk, job.chunk(*chunk)
        return
    with dask_client(min(workers, len(chunks)), scheduler) as client:
        import symkin

        # The job goes with every chunk: data of its own would be lost with its worker.
        parcel = pickle.dumps(job.light())
        yield from spread(client, _chunk, ((symkin.__version__, parcel, chunk) for chunk in chunks))


@contextlib.contextmanager
def dask_client(workers: int, scheduler: str | None = None) -> Iterator[Any]:
    """Connect to a scheduler, or start so many processes of one thread on this machine."""
    try:
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise SymkinError(
            "more than one process needs Dask: pip install 'symkin[cluster]', or leave out "
            "--workers and --scheduler"
        ) from error
    with contextlib.ExitStack() as opened:
        address: Any = scheduler
        if scheduler is None:
            # No dashboard: its port may be another's, and it needs packages that nobody asked for.
            address = opened.enter_context(
                LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=None,
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


def _chunk(version: str, parcel: bytes, chunk: Chunk) -> tuple[Chunk, Columns]:
    """What a worker does."""
    require_version(version)
    return chunk, _unpacked(parcel).chunk(*chunk)


@functools.lru_cache(maxsize=2)
def _unpacked(parcel: bytes) -> Job:
    job: Job = pickle.loads(parcel)
    return job
