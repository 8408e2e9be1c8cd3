"""Threads: one for the linear algebra of a meridian, and what several threads and forked processes may share.

The matrices of a meridian are narrow bands and batches of tiny products: handing them to several BLAS threads costs more than the work
itself, and the order of summation would depend on their number. Every public computation runs under :func:`one_thread`, so that results are
the same to the last bit however many threads a machine has. Parallelism belongs a level higher, to whole scenes.

A forked process has one thread. Copies of locks that other threads held would never be released in it. So a fork waits until nobody holds a
lock.
"""

from __future__ import annotations

import functools
import os
import threading
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any, Generic, ParamSpec, Self, TypeVar, overload

from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
T = TypeVar("T")


class _Gate:
    """Counts the threads that are inside a section that must not be copied half-way. A fork waits for them, and they wait for the fork. The
    solver libraries have locks of their own, which nobody could open in a forked process.
    """

    def __init__(self) -> None:
        self._own = threading.local()
        self.anew()

    def anew(self) -> None:
        """In a process that was just forked, where the forking thread alone is left."""
        self._changed = threading.Condition(threading.Lock())
        self._inside = int(getattr(self._own, "depth", 0) > 0)
        self._forking = False

    def __enter__(self) -> None:
        depth = getattr(self._own, "depth", 0)
        if not depth:
            with self._changed:
                while self._forking:
                    self._changed.wait()
                self._inside += 1
        self._own.depth = depth + 1

    def __exit__(self, *error: object) -> None:
        self._own.depth -= 1
        if not self._own.depth:
            with self._changed:
                self._inside -= 1
                self._changed.notify_all()

    def close(self) -> None:
        """Before a fork: wait until nobody else is inside, and let nobody enter."""
        with self._changed:
            while self._forking:  # another thread forks
                self._changed.wait()
            self._forking = True
            while self._inside > int(getattr(self._own, "depth", 0) > 0):
                self._changed.wait()

    def open(self) -> None:
        """After it."""
        with self._changed:
            self._forking = False
            self._changed.notify_all()


#: what must not be copied half-way by a fork
WHOLE = _Gate()


class Guard:
    """A lock for a ``with`` block or a whole function, open to the thread that holds it; no process is forked meanwhile."""

    def __init__(self) -> None:
        self._lock = threading.RLock()

    def __enter__(self) -> None:
        WHOLE.__enter__()
        self._lock.acquire()

    def __exit__(self, *error: object) -> None:
        self._lock.release()
        WHOLE.__exit__()

    def __call__(self, function: Callable[P, T]) -> Callable[P, T]:
        @functools.wraps(function)
        def guarded(*args: P.args, **kwargs: P.kwargs) -> T:
            with self:
                return function(*args, **kwargs)

        return guarded


class cached_property(Generic[T]):  # noqa: N801  # in place of functools', whose lock before Python 3.12 a forked process waits for
    """A value computed once for an object and kept in it; threads that ask at the same time may each compute it."""

    def __init__(self, function: Callable[[Any], T]) -> None:
        self._function = function
        self.__doc__ = function.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...

    @overload
    def __get__(self, instance: object, owner: type) -> T: ...

    def __get__(self, instance: object | None, owner: type) -> Self | T:
        if instance is None:
            return self
        value: T = instance.__dict__.setdefault(self._name, self._function(instance))
        return value


@functools.cache
def _controller() -> ThreadpoolController:
    # looked up once, after the numerical libraries are loaded: finding them takes milliseconds, limiting them microseconds
    return ThreadpoolController()


def one_thread(function: Callable[P, T]) -> Callable[P, T]:
    """Run a function with BLAS limited to one thread; the caller's setting is restored afterwards."""

    @functools.wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> T:
        with ExitStack() as stack:
            with WHOLE:
                stack.enter_context(_controller().limit(limits=1, user_api="blas"))
            return function(*args, **kwargs)

    return limited


if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=WHOLE.close, after_in_parent=WHOLE.open, after_in_child=WHOLE.anew)
