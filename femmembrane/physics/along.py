"""Factors that vary along a meridian: the thickness and the modulus of an uneven sheet.

A factor is given as one of

* a number, the same everywhere;
* a text, an expression in the reference radius ``R`` (or ``r``), the reference height ``Z`` (or ``z``) and the place ``s`` along the
  meridian, such as ``"1 - 0.4*R**2"``;
* a table of pairs (s, factor), linear between them; two pairs with one s are a jump;
* a function of three arrays (R, Z, s).

The place s is the reference radius of a flat shape and the arc length over R0 from the first end of any other. Membranes of varying
thickness as a model of dip-moulded balloons and reinforced rims: Green and Adkins (1960), chapter 4.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..checks import is_number, sequence
from ..errors import InputError

Array = NDArray[np.float64]

#: what an expression may call
FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    name: getattr(np, name) for name in ("sqrt", "exp", "log", "sin", "cos", "tan", "tanh", "abs", "minimum", "maximum", "where")
}
#: what an expression may name besides
VARIABLES = ("R", "r", "Z", "z", "s")
_CONSTANTS = {"pi": np.pi}
_ALLOWED = "a number, an expression such as '1 - 0.4*R**2', a table of (s, factor), or a function of (R, Z, s) is allowed"
_NODES = (
    *(ast.Expression, ast.BinOp, ast.UnaryOp, ast.Compare, ast.Call, ast.Name, ast.Load, ast.Constant),
    *(ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow, ast.USub, ast.UAdd, ast.Lt, ast.LtE, ast.Gt, ast.GtE),
)
#: characters of an expression, and pairs of a table
_MAX_TEXT, _MAX_PAIRS = 500, 10**4


@dataclass(frozen=True)
class Along:
    """A factor along a meridian.

    Parameters
    ----------
    given : float, str, tuple of (float, float), or callable
        What the user gave, see the top of this module.

    Examples
    --------
    >>> import numpy as np
    >>> Along.of("membrane.thickness", "1 - 0.4*R**2").at(np.array([0.0, 1.0]), np.zeros(2), np.array([0.0, 1.0]))
    array([1. , 0.6])
    """

    given: Any
    _function: Callable[[Array, Array, Array], Any] = field(repr=False, compare=False)

    @classmethod
    def of(cls, key: str, given: Any) -> Self | None:
        """A factor from what the user gave; None for nothing, and for 1, which changes nothing.

        Parameters
        ----------
        key : str
            Its name, for errors.
        given : object

        Raises
        ------
        InputError
            For what is none of the four kinds, an expression with other names or functions, and a table whose places do not increase.
        """
        if isinstance(given, cls):
            return given
        if given is None or (is_number(given) and given == 1):
            return None
        if is_number(given):
            value = float(given)
            return cls(value, lambda R, Z, s: np.full_like(s, value))
        if isinstance(given, str):
            return cls(given, _parsed(key, given))
        if callable(given):
            return cls(given, given)
        return cls(*_tabulated(key, given))

    def __reduce__(self) -> tuple[Any, ...]:
        return _remade, (self.given,)

    @property
    def ends(self) -> tuple[float, ...]:
        """Places where the factor has a jump or a kink, at which elements should end: the inner places of a table."""
        if not isinstance(self.given, tuple):
            return ()
        places = sorted({s for s, _ in self.given})
        return tuple(places[1:-1])

    def at(self, R: Array, Z: Array, s: Array) -> Array:
        """The factor at points of the meridian, all of one shape."""
        with np.errstate(all="ignore"):
            found = self._function(R, Z, s)
        return np.broadcast_to(np.asarray(found, dtype=float), np.shape(s))

    def checked(self, key: str, R: Array, Z: Array, s: Array) -> None:
        """Raise InputError unless the factor is a positive number at all of these points."""
        try:
            values = self.at(R, Z, s)
        except InputError:
            raise
        except Exception as error:  # whatever a stranger's function raises
            raise InputError(key, self.given, f"it must answer arrays (R, Z, s) with one number a point ({error})") from error
        bad = ~(np.isfinite(values) & (values > 0))
        if bad.any():
            where = float(s[bad][0])
            raise InputError(key, self.given, f"a factor > 0 everywhere is allowed; at s = {where:.4g} it is {float(values[bad][0]):.4g}")


def _remade(given: Any) -> Along | None:
    return Along.of("along", given)


def _parsed(key: str, text: str) -> Callable[[Array, Array, Array], Any]:
    """An expression as a function of (R, Z, s): arithmetic, comparisons and the functions of this module, nothing else."""
    if len(text) > _MAX_TEXT:
        raise InputError(key, text[:40] + "...", f"an expression of up to {_MAX_TEXT} characters is allowed")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise InputError(key, text, _ALLOWED) from None
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    for node in ast.walk(tree):
        if not isinstance(node, _NODES) or (isinstance(node, ast.Call) and node.keywords):
            raise InputError(key, text, _ALLOWED)
        if isinstance(node, ast.Constant) and not is_number(node.value):
            raise InputError(key, text, _ALLOWED)
        if isinstance(node, ast.Name):
            known = (*FUNCTIONS,) if id(node) in called else (*VARIABLES, *_CONSTANTS)
            if node.id not in known:
                raise InputError(key, text, f"{node.id} is not known; known: " + ", ".join((*VARIABLES, *_CONSTANTS, *FUNCTIONS)))
    # whole numbers as floats: a power of two of them must not grow without end
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant):
            node.value = float(node.value)  # type: ignore[arg-type]  # a number, by the check above
    code = compile(tree, "<factor>", "eval")
    names = {"__builtins__": {}, **FUNCTIONS, **_CONSTANTS}

    def function(R: Array, Z: Array, s: Array) -> Any:
        try:
            return eval(code, names, {"R": R, "r": R, "Z": Z, "z": Z, "s": s})
        except (ArithmeticError, TypeError, ValueError) as error:
            raise InputError(key, text, f"it is no number ({error})") from error

    return function


def _tabulated(key: str, given: Any) -> tuple[tuple[tuple[float, float], ...], Callable[[Array, Array, Array], Any]]:
    rows = sequence(key, given, _ALLOWED, _MAX_PAIRS)
    pairs = []
    for k, row in enumerate(rows):
        entry = sequence(f"{key}[{k}]", row, "a pair (s, factor) is allowed")
        if len(entry) != 2 or not all(is_number(v) for v in entry):
            raise InputError(f"{key}[{k}]", row, "a pair (s, factor) of finite numbers is allowed")
        pairs.append((float(entry[0]), float(entry[1])))
    places, values = np.array(pairs, dtype=float).reshape(-1, 2).T
    steps = np.diff(places)
    if len(pairs) < 2 or (steps < 0).any() or (len(pairs) > 2 and ((steps[1:] == 0) & (steps[:-1] == 0)).any()):
        raise InputError(key, given, "two or more pairs (s, factor) whose places increase are allowed, or one place twice for a jump")

    def function(R: Array, Z: Array, s: Array) -> Array:
        right = np.clip(np.searchsorted(places, s, side="right"), 1, places.size - 1)  # beyond a jump at the jump itself
        left = right - 1
        width = places[right] - places[left]
        share = np.clip((s - places[left]) / np.where(width > 0, width, 1.0), 0.0, 1.0)
        return np.asarray(values[left] + share * (values[right] - values[left]))

    return tuple(pairs), function
