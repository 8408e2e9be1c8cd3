"""Ctrl-C during a computation and while its results are written."""

from __future__ import annotations

import os
import signal
import threading
from contextlib import suppress
from types import FrameType, TracebackType
from typing import Any, Self


class Interrupts:
    """Ctrl-C that is never lost and leaves no broken file.

    Compiled solvers may swallow the exception that an interrupt raises, so it is also noted, and raised again at the next :meth:`check`.
    While ``hold`` is set the first interrupt is only noted, so that a step is finished, or the results are. A second one gets through.
    Once ``over`` is set none does: the command only says how it ended.
    """

    def __init__(self) -> None:
        self.caught = False
        self.hold = False
        self.over = False
        self._previous: Any = None

    def __enter__(self) -> Self:
        # outside the main thread, or where the caller handles (or ignores) interrupts, they are left to it
        if threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            self._previous = signal.signal(signal.SIGINT, self._handle)
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        if self._previous is not None:
            signal.signal(signal.SIGINT, self._previous)

    def check(self) -> None:
        if self.caught:
            raise KeyboardInterrupt

    def _handle(self, number: int, frame: FrameType | None) -> None:
        first, self.caught = not self.caught, True
        if self.over:
            return
        if not (first and self.hold):
            raise KeyboardInterrupt
        with suppress(OSError):  # of the system alone: a handler may run in the middle of a write
            os.write(2, b"femmembrane: interrupted; what is being computed or written is finished first; Ctrl-C again drops it\n")


def ignore_further() -> None:
    """From now on Ctrl-C does nothing: the process ends by itself, and would only print where it was interrupted."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)
