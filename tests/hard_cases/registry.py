"""One registry of hard cases: what is run, why it is hard, what must come out, and how it is judged.

A family is a module of this package with a ``FAMILY``; its cases are functions under ``@FAMILY.case(...)``, which may be stacked with
other ``arguments``. A case that expects a :class:`Number` returns a number (or several); one that expects a :class:`Stop` raises a
SolveError or an InputError, or returns the Branch that carries the status; one that expects an :class:`Exit` returns the :class:`Done` of a
command.

Whatever the outcome, :func:`outcome` fails a case that prints, warns, takes longer than its limit, or raises anything else. An equilibrium
that a case believes goes through :func:`settled`, which recomputes what "converged" promises.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import pkgutil
import re
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

import femmembrane as fm

#: seconds after which a fast case counts as hanging (it takes a small part of that on a free machine), and a slow one
LIMIT, SLOW_LIMIT = 60.0, 1200.0


@dataclass(frozen=True)
class Number:
    """One number, or a tuple of numbers, each within the larger of ``rel`` times its size and ``abs``."""

    value: float | tuple[float, ...]
    rel: float = 0.0
    abs: float = 0.0

    def fault(self, got: Any) -> str:
        """What is wrong with an outcome; empty when nothing is. NaN is never within a tolerance."""
        if isinstance(got, Stopped):
            return f"{got.status}, {got.message!r}, in place of a number"
        wanted, found = np.atleast_1d(self.value), np.atleast_1d(np.asarray(got, dtype=float))
        if found.shape != wanted.shape:
            return f"{found.size} number(s) in place of {wanted.size}"
        bad = ~(np.abs(found - wanted) <= np.maximum(self.rel * np.abs(wanted), self.abs))
        return ", ".join(f"{f!r} in place of {w!r}" for f, w in zip(found[bad].tolist(), wanted[bad].tolist(), strict=True))

    def shown(self, got: Any) -> str:
        """The outcome with as many digits as the tolerance vouches for."""
        size = float(np.max(np.abs(np.atleast_1d(self.value))))
        off = max(self.rel, self.abs / size if size else 0.0)
        digits = int(np.clip(np.floor(-np.log10(off)), 1, 10)) if off else 10
        clean = [0.0 if abs(x) <= self.abs else x for x in np.atleast_1d(np.asarray(got, dtype=float)).tolist()]
        return ", ".join(f"{x:.{digits}g}" for x in clean)

    def __str__(self) -> str:
        values = ", ".join(f"{x:.10g}" for x in np.atleast_1d(self.value).tolist())
        within = [f"{self.rel:g} of it" if self.rel else "", f"{self.abs:g}" if self.abs else ""]
        return values + (f" within {' or '.join(w for w in within if w)}" if any(within) else ", exactly")


@dataclass(frozen=True)
class Stop:
    """The one status with which a solve ends, or the key that an InputError names, and words of its message (a regular expression)."""

    status: fm.Status | str
    words: str = ""

    def fault(self, got: Any) -> str:
        return _wrong(self.status, got.status, self.words, got.message) if isinstance(got, Stopped) else f"{got!r} in place of a stop"

    def shown(self, got: Any) -> str:
        return _short(got.message)

    def __str__(self) -> str:
        return f"status {self.status}" if isinstance(self.status, fm.Status) else f"bad input: {self.status}"


#: what is said as soon as an interrupt arrives
_ACKNOWLEDGED = "femmembrane: interrupted; what is being computed or written is finished first; Ctrl-C again drops it\n"


@dataclass(frozen=True)
class Exit:
    """The exit code of a command, and words of the one line that it writes to stderr. With 0 there is none, and one of success on stdout.

    An interrupt is acknowledged at once, in a line of its own.
    """

    code: int
    words: str = ""

    def fault(self, got: Any) -> str:
        if not isinstance(got, Done):
            return f"{got!r} in place of a command that ended"
        err = got.err.replace(_ACKNOWLEDGED, "", 1)
        line = self.code == 0 and got.out.count("\n") == 1 and "written: " in got.out
        if (got.out and not line) or err.count("\n") != (0 if self.code == 0 else 1):
            return f"printed {got.out!r} and {got.err!r}"
        return _wrong(self.code, got.code, self.words, err)

    def shown(self, got: Any) -> str:
        err = got.err.replace(_ACKNOWLEDGED, "", 1)
        return f"{got.code}" + (f": {_short(err)}" if err else "")

    def __str__(self) -> str:
        return f"exit code {self.code}"


@dataclass(frozen=True)
class Stopped:
    """How a solve ended that did not reach what was asked for."""

    status: fm.Status | str
    message: str


@dataclass(frozen=True)
class Done:
    """How a command ended."""

    code: int
    out: str = ""
    err: str = ""

    @property
    def succeeded(self) -> bool:
        """Whether it ended well and had nothing to complain of; what it computed and wrote is said on its output."""
        return self.code == 0 and not self.err


Expected = Number | Stop | Exit


@dataclass(frozen=True, eq=False)
class Case:
    """One hard case; ``why`` says in a few words what breaks a code that is not careful."""

    family: Family
    name: str
    why: str
    expected: Expected
    run: Callable[..., Any]
    arguments: tuple[Any, ...] = ()
    slow: bool = False

    @property
    def id(self) -> str:
        return f"{self.family.name}: {self.name}"


@dataclass(frozen=True, eq=False)
class Family:
    """Cases of one kind, numbered for the order in which they are listed."""

    number: int
    name: str
    cases: list[Case] = field(default_factory=list)

    def case(
        self, name: str, why: str, expected: Expected, *arguments: Any, slow: bool = False
    ) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
        """Register a function of ``arguments`` as a case; the function itself is left as it is, so that decorators stack."""

        def register(function: Callable[..., Any]) -> Callable[..., Any]:
            # decorators are applied from below: of a stack the upper ones come first
            place = next((k for k, known in enumerate(self.cases) if known.run is function), len(self.cases))
            self.cases.insert(place, Case(self, name, why, expected, function, arguments, slow))
            return function

        return register


@dataclass(frozen=True)
class Outcome:
    """What came out of a case; ``fault`` is empty when that is what must come out."""

    shown: str
    fault: str
    seconds: float


@cache
def families() -> tuple[Family, ...]:
    """All families, by number: every module of this package that has a FAMILY."""
    names = [module.name for module in pkgutil.iter_modules(_folder()) if not module.name.startswith(("test_", "registry", "_"))]
    modules = [importlib.import_module(f"{__package__}.{name}") for name in names]
    return tuple(sorted((m.FAMILY for m in modules if hasattr(m, "FAMILY")), key=lambda f: f.number))


def cases() -> tuple[Case, ...]:
    """All cases, family by family, in the order of the modules."""
    return tuple(case for family in families() for case in family.cases)


@cache
def outcome(case: Case) -> Outcome:
    """Run a case once, and judge it."""
    clock = time.perf_counter()
    printed: list[str] = []
    try:
        with _silence(printed), _limited(SLOW_LIMIT if case.slow else LIMIT):
            got = _plain(case.run(*case.arguments))
    except _Refused as refused:
        got = Stopped(refused.status, refused.message)
    except Exception as error:  # a traceback is never what must come out
        return Outcome("", f"{type(error).__name__}: {error}\n{traceback.format_exc(limit=-4)}", time.perf_counter() - clock)
    seconds = time.perf_counter() - clock
    fault = case.expected.fault(got) or (f"printed {printed[0]!r}" if printed else "")
    return Outcome("" if fault else case.expected.shown(got), fault, seconds)


def settled(eq: fm.Equilibrium) -> fm.Equilibrium:
    """The equilibrium itself, after a look at what its status promises, recomputed from its unknowns alone."""
    if eq.status is not fm.Status.CONVERGED:
        raise AssertionError(f"status {eq.status}")
    evaluation = eq.potential.evaluate(eq.state, eq.pressure)
    force = evaluation.gradient - eq.pressure * evaluation.volume_gradient
    numbers = [eq.pressure, eq.volume, eq.center_height, eq.elastic_energy, eq.magnetic_energy, eq.residual]
    if not (np.isfinite(eq.state).all() and np.isfinite(force).all() and np.isfinite(numbers).all()):
        raise AssertionError("not finite")
    scales = eq.potential.force_scale(evaluation, eq.pressure)
    round_off = float(np.finfo(float).eps) * max(scales)  # along a component without forces lies the round-off of the other one
    for scale, index in zip((max(scale, round_off) for scale in scales), eq.potential.space.fields, strict=True):
        if np.abs(force[index]).max(initial=0.0) > 1e-9 * scale:
            raise AssertionError(f"forces are out of balance by {np.abs(force[index]).max() / scale:.2g}")
    if evaluation.volume != eq.volume or eq.residual > 1e-9:
        raise AssertionError("what is recorded is not what is recomputed")
    return eq


def reached(branch: fm.Branch) -> fm.Branch:
    """A branch that came to its end, each of whose states is settled; one that did not stops the case with its status."""
    if branch.message or branch.status is not fm.Status.CONVERGED:
        raise _Refused(branch.status, branch.message)
    for eq in branch:
        settled(eq)
    return branch


def stop_of(branch: fm.Branch) -> fm.Branch:
    """A branch whose end is the outcome; what it found before is settled."""
    for eq in branch[:-1]:
        settled(eq)
    raise _Refused(branch.status, branch.message)


def command(*words: str) -> Done:
    """``femmembrane`` with these words, in this process."""
    from femmembrane.cli import main

    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(list(words))
    return Done(code, out.getvalue(), err.getvalue())


def run_file(text: str) -> Done:
    """``femmembrane run`` on a scene file with this text, its results thrown away."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "scene.toml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        done = command("run", path, "--out", os.path.join(folder, "out"))
        return Done(done.code, done.out, done.err.replace(folder + os.sep, ""))


class _Refused(Exception):  # noqa: N818  # not an error: it is what the case is about
    def __init__(self, status: fm.Status | str, message: str) -> None:
        self.status, self.message = status, message
        super().__init__(f"{status}: {message}")


def _plain(got: Any) -> Any:
    if isinstance(got, fm.Branch):
        stop_of(got)
    return got


@contextlib.contextmanager
def _silence(printed: list[str]) -> Iterator[None]:
    """Errors that the package raises on purpose become refusals; whatever is printed, by C++ as well, is kept; warnings are errors."""
    out, err = io.StringIO(), io.StringIO()
    with tempfile.TemporaryFile() as file:
        sys.stdout.flush()
        sys.stderr.flush()
        saved = [os.dup(1), os.dup(2)]
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
        try:
            with warnings.catch_warnings(), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
                warnings.simplefilter("error")
                yield
        except fm.SolveError as error:
            raise _Refused(error.status, str(error)) from error
        except fm.InputError as error:
            raise _Refused(error.key, str(error)) from error
        finally:
            for fd, copy in zip((1, 2), saved, strict=True):
                os.dup2(copy, fd)
                os.close(copy)
            file.seek(0)
            text = out.getvalue() + err.getvalue() + file.read().decode(errors="replace")
            if text:
                printed.append(text)


@contextlib.contextmanager
def _limited(seconds: float) -> Iterator[None]:
    """TimeoutError in whatever takes longer, so that a hang is a failure like any other (where the system has alarms)."""
    if not hasattr(signal, "setitimer"):
        yield
        return

    def late(number: int, frame: FrameType | None) -> None:
        raise TimeoutError(f"not done after {seconds:g} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _wrong(wanted: Any, found: Any, words: str, message: str) -> str:
    if found != wanted:
        return f"{found} in place of {wanted}: {message}"
    return "" if re.search(words, message) else f"{words!r} is not in {message!r}"


def _short(message: str, length: int = 150) -> str:
    line = " ".join(message.split())
    return line if len(line) <= length else line[:length].rsplit(" ", 1)[0] + " ..."


def _folder() -> list[str]:
    return [str(Path(__file__).parent)]
