# SPDX-License-Identifier: MIT
"""Work on several processes of this machine, or on a Dask cluster."""

from __future__ import annotations

import contextlib
import itertools
import logging
import signal
import socket
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from typing import Any
from urllib.parse import urlsplit

from symkin.errors import SymkinError
from symkin.version import version

_AHEAD = 3  # chunks that every core has or waits for
_CONNECT, _WORKERS = 15, 60  # s
_RESOLVED = 5  # s, within which a name is
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


def begun(calls: Sequence[tuple[Any, ...]], client: Any) -> Callable[[], list[Any]]:
    """Have workers call functions, each first of its arguments, beside what else they compute.

    What is returned waits for the calls, and returns their results in order.
    """
    futures = [_submitted(client, *call) for call in calls]
    return lambda: list(client.gather(futures))


@contextlib.contextmanager
def dask_client(workers: int, scheduler: str | None = None) -> Iterator[Any]:
    """Connect to a scheduler, or start so many processes of one thread on this machine."""
    try:
        import asyncio

        import dask
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise SymkinError(
            "more than one process needs Dask: pip install 'symkin[cluster]', or leave out "
            "--workers and --scheduler"
        ) from error
    with contextlib.ExitStack() as opened:
        address: Any = scheduler
        if scheduler is not None:
            _require_known_host(scheduler)
        else:
            # Any free port, since the usual one may be another's, and no dashboard, which needs
            # packages that nobody asked for. Nor does anybody see what is found by interrupting the
            # work for it. What a worker logs, such as that its scheduler has closed before it, is
            # not for the user: a call that fails raises its exception here.
            opened.enter_context(dask.config.set(_UNDISTURBED))
            with _interrupts_put_off():
                cluster = LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=":0",
                    scheduler_kwargs={"dashboard": False},
                    memory_limit=0,
                    silence_logs=logging.CRITICAL,
                )
                address = opened.enter_context(cluster)
        try:
            if scheduler is not None:
                # Beside a loop that runs here, as in a notebook.
                with ThreadPoolExecutor(1) as beside:
                    beside.submit(asyncio.run, _answer_of(scheduler)).result()
            client = opened.enter_context(Client(address, timeout=_CONNECT))
        except TypeError as error:
            raise SymkinError(
                f"{scheduler}: TLS needs certificates; name them in the configuration of Dask "
                "(distributed.comm.tls)"
            ) from error
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


@contextlib.contextmanager
def _interrupts_put_off() -> Iterator[None]:
    """Have Ctrl-C wait for what is done here, and pass over processes that it starts.

    Workers that are interrupted before they have begun, and a cluster that is, print tracebacks.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: received.append(number))
    # Threads and processes begin with what is blocked where they are started, unless Python starts
    # its tracker beside them, which unblocks. There is no such thing in Windows.
    mask = getattr(signal, "pthread_sigmask", None)
    if mask:
        from multiprocessing import resource_tracker

        resource_tracker.ensure_running()
    blocked = mask(signal.SIG_BLOCK, [signal.SIGINT]) if mask else None
    try:
        yield
    finally:
        if mask:
            mask(signal.SIG_SETMASK, blocked)
        signal.signal(signal.SIGINT, before)
    if received:
        raise KeyboardInterrupt


def _require_known_host(scheduler: str) -> None:
    """Refuse a host that nobody knows: a client would go on asking, and may wait for ever.

    Beside it, since whoever asks a resolver that is silent cannot stop.
    """
    host = urlsplit(scheduler if "://" in scheduler else f"tcp://{scheduler}").hostname
    if not host:
        return
    failed: list[str] = []

    def ask() -> None:
        try:
            socket.getaddrinfo(host, None)
        except OSError as error:
            failed.append(error.strerror or str(error))
        except UnicodeError:
            failed.append("no name of a host")
        else:
            failed.append("")

    asking = threading.Thread(target=ask, daemon=True)
    asking.start()
    asking.join(_RESOLVED)
    why = failed[0] if failed else f"no answer within {_RESOLVED} s"
    if why:
        raise SymkinError(
            f"{scheduler}: {host} cannot be resolved ({why}); expected the address that "
            "`dask scheduler` prints, such as tcp://10.0.0.1:8786"
        )


async def _answer_of(scheduler: str) -> None:
    """Ask a scheduler what it is: a client would wait for ever where nobody speaks."""
    import asyncio

    from distributed.core import rpc
    from distributed.security import Security

    arguments = Security().get_connection_args("client")
    asked = rpc(scheduler, timeout=_CONNECT, connection_args=arguments)
    try:
        await asyncio.wait_for(asked.identity(), _CONNECT)
    finally:
        await asked.close_rpc()


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
            _submitted(client, function, *call)
            for call in itertools.islice(left, max(_AHEAD * cores - waiting, 0))
        ]

    ready: Any = as_completed(submitted(0))
    for future in ready:
        try:
            result = future.result()
        except CancelledError as error:
            raise SymkinError(
                "the scheduler has gone; what was written is kept, and the same command goes on "
                "from there"
            ) from error
        future.release()
        ready.update(submitted(ready.count()))
        yield result


def require_version(wanted: str) -> None:
    """Refuse to work for another version of symkin."""
    if version() != wanted:
        raise SymkinError(
            f"a worker has symkin {version()}; expected {wanted}, as where it was started"
        )


def _submitted(client: Any, function: Callable[..., Any], *arguments: Any) -> Any:
    """Have a worker call a function, if it has the same symkin."""
    return client.submit(_called, version(), function, *arguments, pure=False)


def _called(wanted: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """What a worker does."""
    require_version(wanted)
    return function(*arguments)
