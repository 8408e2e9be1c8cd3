"""Many scenes at once: in this process, on this machine's cores, or on a Dask cluster.

Each way takes the tasks one by one as there is room for them, and yields their rows as they are done, in any order. Every scene is computed
on its own, so that its row does not depend on the process or the time.
"""

from __future__ import annotations

import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context, parent_process, resource_tracker
from multiprocessing.process import BaseProcess
from typing import Any

import numpy as np

from ..errors import InputError
from ..scene import Scene
from .sweep_rows import UNEXPECTED, Options, Row, compute

#: key, scene, quantity, options
Task = tuple[str, Scene, str, Options]
#: seconds in which a worker must have come
_PATIENCE = 120.0
#: processes of one sweep: as many as large machines have cores (Windows waits for no more than 61)
MAX_WORKERS = 61 if os.name == "nt" else 1024
#: what a process takes before it computes anything
WORKER_BYTES = 100 * 2**20


def cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def sendable(scene: Scene) -> bool:
    """Whether other processes can get a scene: not with a function that no module holds."""
    try:
        pickle.dumps(scene)
    except Exception:  # whatever an object of somebody's own raises
        return False
    return True


def here(tasks: Iterator[Task]) -> Iterator[tuple[str, Row]]:
    """One after the other, in this process."""
    for key, scene, quantity, options in tasks:
        yield key, compute(scene, quantity, options)


def on_cores(tasks: Iterator[Task], workers: int) -> Iterator[tuple[str, Row]]:
    """In processes of this machine. When a process dies, the scenes that were under way are tried again one by one. A scene whose process
    dies again has a row that says so.

    Raises
    ------
    InputError
        When processes cannot be started.
    """
    while True:
        under_way: dict[str, Task] = {}
        try:
            with _processes(workers) as executor:
                _try_out(executor, workers)
                yield from _drive(executor, tasks, under_way, lambda: workers + 2)
            return
        except BrokenProcessPool:
            pass
        yield from _one_by_one(list(under_way.values()))


def on_cluster(tasks: Iterator[Task], address: str) -> Iterator[tuple[str, Row]]:
    """On the workers of a Dask cluster. Its scheduler hands the scenes of lost workers to others.

    Raises
    ------
    InputError
        Without the package distributed, when no scheduler answers at the address, or when its workers lack this package.
    """
    try:
        from distributed import Client
    except ImportError:
        raise InputError("scheduler", address, 'it needs the package distributed: pip install "femmembrane[dask]"') from None
    try:
        client = Client(address, timeout=10, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError("scheduler", address, f"the address of a running Dask scheduler is allowed ({error})") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=_PATIENCE)
            found = set(client.run(_version).values())
        except TimeoutError:
            raise InputError("scheduler", address, f"it has no worker, and none came in {_PATIENCE:g} s") from None
        except ImportError as error:
            raise InputError("scheduler", address, f"its workers need femmembrane {_version()} ({error})") from None
        if found != {_version()}:
            allowed = f"its workers have femmembrane {'; '.join(sorted(found))}: all need {_version()}, so that all compute the same rows"
            raise InputError("scheduler", address, allowed)
        with client.get_executor(pure=False) as executor:
            yield from _drive(executor, tasks, {}, lambda: max(16, 4 * sum(client.nthreads().values())))


@contextmanager
def _processes(workers: int) -> Iterator[Executor]:
    # spawned, not forked: a fork copies locks that threads of the numerical libraries may hold
    executor = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_begin)
    try:
        yield executor
    except BaseException:
        running = list((executor._processes or {}).values())
        executor.shutdown(wait=False, cancel_futures=True)
        for process in running:  # what they compute is lost in any case, and Python would wait for it when it ends
            process.terminate()
        raise
    executor.shutdown()


def _submit(executor: Executor, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
    """Hand a task to an executor, which may start a process for it. Ctrl-C waits meanwhile: the process is born with it blocked, so that it
    does not complain about an interrupt before :func:`_begin`.
    """
    if not hasattr(signal, "pthread_sigmask"):
        return executor.submit(function, *arguments)
    resource_tracker.ensure_running()  # to start it later would unblock the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        return executor.submit(function, *arguments)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin() -> None:
    """Set up a new process: Ctrl-C ends it without a word, and it ends with its parent, even if the parent is killed."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    parent = parent_process()
    if parent is not None:
        threading.Thread(target=_follow, args=(parent,), daemon=True).start()


def _follow(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)


def _try_out(executor: Executor, workers: int) -> None:
    """Make one trivial call, so that processes that cannot start are not taken for a fault of the scenes."""
    try:
        _submit(executor, os.getpid).result(_PATIENCE)
    except BrokenProcessPool:
        advice = 'a script must call this below if __name__ == "__main__":, for each process reads it; or give workers=1'
        raise InputError("workers", workers, f"no process could be started; {advice}") from None


def _version() -> str:
    """All that decides the last bits: the version, the half that computes, NumPy, SciPy and the kind of processor."""
    import platform

    import scipy

    from .. import __version__
    from ..kernels import kernels

    half = f"{kernels().name} kernels"
    return f"{__version__} ({half}, NumPy {np.__version__}, SciPy {scipy.__version__}, {platform.machine()})"


def _drive(executor: Executor, tasks: Iterator[Task], under_way: dict[str, Task], room: Callable[[], int]) -> Iterator[tuple[str, Row]]:
    """Keep an executor busy with no more tasks than there is room for. ``under_way`` holds the tasks that have not come back."""
    futures: dict[Future[Row], str] = {}
    for task in tasks:
        key, scene, quantity, options = task
        under_way[key] = task
        futures[_submit(executor, compute, scene, quantity, options)] = key
        if len(futures) >= room():
            yield from _finished(futures, under_way)
    while futures:
        yield from _finished(futures, under_way)


def _finished(futures: dict[Future[Row], str], under_way: dict[str, Task]) -> Iterator[tuple[str, Row]]:
    for future in wait(futures, return_when=FIRST_COMPLETED).done:
        try:
            row = future.result()
        except BrokenProcessPool:
            raise
        except Exception as error:  # a cluster gives up a scene that killed several workers
            row = Row(UNEXPECTED, f"{type(error).__name__}: {error}", {})
        key = futures.pop(future)
        under_way.pop(key)
        yield key, row


def _one_by_one(left: list[Task]) -> Iterator[tuple[str, Row]]:
    """Suspicious scenes, one by one in a process of their own; a new one is started whenever it dies."""
    while left:
        try:
            with _processes(1) as executor:
                while left:
                    key, scene, quantity, options = left[0]
                    row = _submit(executor, compute, scene, quantity, options).result()
                    left.pop(0)
                    yield key, row
        except BrokenProcessPool:
            yield left.pop(0)[0], Row(UNEXPECTED, "the process that computed it died (out of memory, or killed)", {})
