"""What can go wrong, in words that say what to do next.

There are two families: :class:`InputError` for a scene that cannot be built, and :class:`SolveError` for an equilibrium that was not found.
Nothing in the library raises a bare exception for either.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable
from enum import StrEnum
from typing import Any

#: control characters except tabs and line ends, Unicode's own line separators, and halves of characters
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]")


class Status(StrEnum):
    """How a solve ended; :attr:`advice` says what to do about it.

    A status is also its text: ``branch.status == "converged"``.
    """

    CONVERGED = "converged"
    NOT_CONVERGED = "not converged"
    STEP_UNDERFLOW = "step underflow"
    NO_EQUILIBRIUM = "no equilibrium"
    DIPOLE_CONTACT = "dipole contact"
    NOT_A_MINIMUM = "not a minimum"
    LEGENDRE_FAILURE = "Legendre condition fails"
    SLACK = "slack"
    PULLED_IN = "pulled in"
    NOT_RESOLVED = "not resolved"
    STEP_LIMIT = "step limit"
    UNEXPLAINED_INERTIA = "unexplained change of inertia"
    ACCURACY_NOT_MET = "accuracy not met"
    INTERRUPTED = "interrupted"
    CLOSED = "closed branch"
    INTERPOLATED = "interpolated"

    @property
    def advice(self) -> str:
        return _ADVICE[self]

    @property
    def ill_posed(self) -> bool:
        """Whether the state depends on the mesh: compressed along the meridian, slack in a tension field, or pulled in."""
        return self in (Status.LEGENDRE_FAILURE, Status.SLACK, Status.PULLED_IN)


_ADVICE = {
    Status.CONVERGED: "residual and constraint were recomputed and are at round-off",
    Status.NOT_CONVERGED: "start nearer (smaller load steps, or start= an equilibrium close by)",
    Status.STEP_UNDERFLOW: "no step beyond this point converges; where the branch turns back, fm.trace follows it round",
    Status.NO_EQUILIBRIUM: "start from a neighbour (start= an equilibrium close by), or see with fm.trace which loads a branch passes",
    Status.DIPOLE_CONTACT: "the membrane runs into a source, into its singular field or its body; lower the strength or the load",
    Status.NOT_A_MINIMUM: 'forces balance there, but a minimiser cannot hold it; solver="newton" accepts such states',
    Status.STEP_LIMIT: "raise max_steps, or continue from here (fm.trace with start= this branch)",
    Status.UNEXPLAINED_INERTIA: "a special point lies there that was not located; trace that stretch with smaller steps",
    Status.ACCURACY_NOT_MET: "ask for less (mesh.accuracy), or give mesh.elements and mesh.degree",
    Status.INTERRUPTED: "what was computed is kept; continue from there",
    Status.CLOSED: "the branch came back to the branch point where it set out: going on would trace it once more",
    Status.INTERPOLATED: "it lies on the cubic between two equilibria; branch.at(..., refine=True) finds the equilibrium itself",
    Status.NOT_RESOLVED: "the mesh makes this state: make elements smaller where it says (towards a pole with mesh.ratio or mesh.radii), "
    "take more of them or a higher degree; a state that finer meshes lose does not exist",
    Status.LEGENDRE_FAILURE: "a membrane cannot carry compression: where it is compressed the plain energy is ill-posed and its states "
    "depend on the mesh; a tension field (effects.tension_field = true) wrinkles instead",
    Status.SLACK: "where no tension is left along the meridian the membrane folds onto itself, and its tension field ends; "
    "a finer mesh comes closer to such a fold, not past it",
    Status.PULLED_IN: "nothing there resists being stretched further; lower the voltage or weaken the sources, or hold the charge",
}


class FemmembraneError(Exception):
    """Base of every error that the package raises on purpose."""


class InputError(FemmembraneError, ValueError):
    """A value in a scene or a call that cannot be used.

    Parameters
    ----------
    key : str
        The argument, as the user wrote it (``mesh.elements``).
    value : object
        What was given.
    allowed : str
        What would be accepted, in words.
    """

    def __init__(self, key: str, value: Any, allowed: str) -> None:
        if (meant := as_meant(value)) and "comma" not in allowed and (meant != _QUOTED or "number" in allowed):
            allowed = f"{allowed}; {meant}"
        self.key, self.value, self.allowed = key, value, allowed
        super().__init__(printable(f"{_cut(key)} = {_cut(_shown(value))}: {allowed}"))


class SolveError(FemmembraneError, RuntimeError):
    """An equilibrium that could not be found; carries what was reached.

    Parameters
    ----------
    message : str
    status : Status
    result : object or None
        The last good result (an equilibrium, or the branch up to the failure).
    """

    def __init__(self, message: str, *, status: Status, result: Any = None) -> None:
        self.status, self.result = status, result
        super().__init__(message)


class NotWrittenError(FemmembraneError, OSError):
    """Results that could not be written: the disk is full, or files may not grow that large.

    Attributes
    ----------
    files : tuple of str
        Names of the files that are missing; the others were written whole.
    """

    def __init__(self, reason: str, files: Iterable[str]) -> None:
        self.files = tuple(files)
        super().__init__(f"{reason}; not written: {', '.join(self.files)}")


def unknown_name(key: str, name: str, known: Iterable[str]) -> InputError:
    """The error for a name outside a closed set, with the nearest valid one."""
    known = sorted(known)
    near = difflib.get_close_matches(str(name)[:80], known, n=1, cutoff=0.5)
    hint = f"unknown; did you mean {near[0]!r}? " if near else "unknown; "
    return InputError(key, name, hint + "known: " + ", ".join(known))


def printable(text: str) -> str:
    """A text that may be written to a terminal: control characters, which could move its cursor, are spelled out (\\x1b)."""
    return _CONTROL.sub(lambda found: found[0].encode("unicode_escape").decode(), text)


#: a text that a person reads as a number, perhaps with a unit behind it: sign, digits with their marks, exponent, unit
_READ = re.compile(
    r"\s*([+\-\N{MINUS SIGN}]?)((?:\d[\d.,'_\N{RIGHT SINGLE QUOTATION MARK}\N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE} ]*)?\d)"
    r"((?:[eE][+-]?\d{1,3})?)\s*([^\s\d.,'_].{0,20})?",
    re.ASCII,
)
#: digits with marks between thousands
_GROUPED = re.compile(r"[1-9]\d{0,2}(?:[^\d]\d{3})+")
_QUOTED = "a text in quotes is no number: leave the quotes out, or write its unit behind it"
#: characters of a text that is looked at
_LONGEST_NUMBER = 60


def as_meant(value: Any) -> str:
    """How a number would be written that a text was meant as: one with a decimal comma, with marks between thousands, or in quotes.

    Parameters
    ----------
    value : object
        Whatever was refused; the answer is empty unless it is a text that looks like a number.
    """
    if not isinstance(value, str) or len(value) > _LONGEST_NUMBER or (found := _READ.fullmatch(value)) is None:
        return ""
    sign, digits, exponent, unit = found.groups(default="")
    behind = f"{exponent} {unit.strip()}".rstrip()
    sign = "-" if sign == "\N{MINUS SIGN}" else sign
    if digits.isdigit() or re.fullmatch(r"\d*\.\d*", digits):
        if found[1] == "\N{MINUS SIGN}":
            return f"write {sign}{digits}{behind} (its minus is another character)"
        return "" if unit else _QUOTED
    texts = _without_marks(digits)
    if not texts:
        return ""
    numbers = " or ".join(f"{sign}{text}{behind}" for text in texts)
    return f"write {numbers}: decimals stand behind a point, and nothing stands between thousands, no comma either"


def _without_marks(digits: str) -> list[str]:
    """The numbers that digits with marks between them may be."""
    marks = re.sub(r"\d", "", digits)
    whole, last = digits[: digits.rfind(marks[-1])], digits[digits.rfind(marks[-1]) + 1 :]
    alone = marks[-1] in ".," and marks.count(marks[-1]) == 1
    found = []
    grouped = whole.isdigit() or (len(set(marks[:-1])) == 1 and _GROUPED.fullmatch(whole) is not None)
    if alone and grouped and (marks[-1] == "," or len(marks) > 1):
        found.append(f"{re.sub(r'[^0-9]', '', whole)}.{last}")
    if len(set(marks)) == 1 and marks[-1] != "." and _GROUPED.fullmatch(digits):
        found.append(re.sub(r"[^0-9]", "", digits))
    return found


#: items of a list that a message may show
_SHOWN = 80


def _shown(value: Any) -> str:
    if isinstance(value, (list, tuple)) and len(value) > _SHOWN:
        value = value[:_SHOWN]  # the rest is cut off anyway
    try:
        return repr(value)
    except RecursionError:
        return "tables or lists in each other, too many to show"
    except ValueError:  # Python does not print whole numbers of more than 4300 digits
        return "a number of thousands of digits"


def _cut(text: str) -> str:
    return text if len(text) <= 80 else text[:77] + "..."
