"""Errors against degree and number of elements: their orders, their floor, and values extrapolated to infinitely many elements.

An error is known only as well as what it is measured against. The reference of a study is a fine discretisation, whose own error is
estimated as the distance to other fine discretisations. Errors that do not clear this floor are not resolved, and no order follows from
them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import unknown_name
from ..files import write_csv
from ..quantities import heading
from . import door

if TYPE_CHECKING:
    import pandas

    from ..scene import Scene

Array = NDArray[np.float64]

#: an error counts as resolved from this many times the floor: the reference then spoils it by a tenth at most
RESOLVED = 10.0
#: round-off of a converged quantity, relative to its size
ROUND_OFF = 16 * np.finfo(float).eps

PROFILES = ("profile_l2", "profile_h1")
#: what is compared, in the order of the table
COMPARED = (
    *("pressure", "volume", "center_height", "elastic_energy", "magnetic_energy", "energy", "lambda_pressure", "lambda_volume"),
    *PROFILES,
    *("limit_pressure", "limit_volume"),
)
COLUMNS = (
    *("degree", "elements", "unknowns", "element_size", "quantity", "value", "reference", "error", "floor", "resolved", "order"),
    *("extrapolated", "extrapolated_error"),
)


@dataclass(frozen=True, eq=False)
class Convergence:
    """One equilibrium on meshes of several degrees and sizes; arrays have the shape (degrees, elements).

    Attributes
    ----------
    scene : Scene
    control : {"volume", "pressure", "center_height"}
        What is held.
    load : float
        Its value.
    degrees, elements : tuple of int
    unknowns : ndarray of int
    element_size : ndarray, shape (elements,)
        Largest element of each mesh, over R0.
    values : mapping of str to ndarray
        What was found: P, V, pole height, energies (units of mu T R0^2), smallest eigenvalues (units of mu/(rho_m R0^2)), and the first
        limit point if it was asked for. NaN where a solve failed or an eigenvalue has no meaning.
    reference : mapping of str to float
        The same on the reference mesh.
    errors : mapping of str to ndarray
        |value - reference| over ``scale``. ``profile_l2`` and ``profile_h1`` are norms of the difference d of (rho, eta), over the same
        norm of the reference. Their squares are Int |d|^2 2 pi R dS, and for H1 Int |dd/dS|^2 2 pi R dS in addition.
    floors : mapping of str to float
        Error of the reference in the same measure: the distance to other fine meshes, at least round-off.
    scale : mapping of str to float
        Size of the reference, or 1 where the reference is zero within its own error.
    meshes : str
        The reference mesh and what its error rests on, in words.
    messages : tuple of str
        Meshes on which no equilibrium was found, and why.
    """

    scene: Scene
    control: str
    load: float
    degrees: tuple[int, ...]
    elements: tuple[int, ...]
    unknowns: NDArray[np.int64] = field(repr=False)
    element_size: Array = field(repr=False)
    values: Mapping[str, Array] = field(repr=False)
    reference: Mapping[str, float] = field(repr=False)
    errors: Mapping[str, Array] = field(repr=False)
    floors: Mapping[str, float] = field(repr=False)
    scale: Mapping[str, float] = field(repr=False)
    meshes: str = field(repr=False)
    messages: tuple[str, ...] = ()

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of what is compared; what is held is not."""
        return tuple(self.errors)

    def resolved(self, quantity: str) -> NDArray[np.bool_]:
        """Which errors stand clear of the floor of the reference.

        Parameters
        ----------
        quantity : str
            One of :attr:`quantities`.
        """
        return self._of(self.errors, quantity) > RESOLVED * self.floors[quantity]

    def orders(self, quantity: str) -> Array:
        """Observed orders between a mesh and the next coarser one of the list; NaN where an error is not resolved.

        Parameters
        ----------
        quantity : str
            One of :attr:`quantities`.

        Raises
        ------
        InputError
            For an unknown quantity.
        """
        return observed_orders(np.where(self.resolved(quantity), self.errors[quantity], np.nan), self.elements)

    def extrapolated(self, quantity: str) -> tuple[Array, Array]:
        """Values for infinitely many elements and their estimated errors, each of shape (degrees,), without use of the reference.

        Parameters
        ----------
        quantity : str
            One of :attr:`quantities`.

        Raises
        ------
        InputError
            For an unknown quantity or a profile.
        """
        pairs = [richardson(row, self.elements, degree) for row, degree in zip(self._of(self.values, quantity), self.degrees, strict=True)]
        return np.array([value for value, _ in pairs]), np.array([error for _, error in pairs])

    def rows(self) -> Iterator[list[Any]]:
        """One row for each degree, mesh and quantity, in the order of :data:`COLUMNS`."""
        orders, resolved = ({q: ask(q) for q in self.errors} for ask in (self.orders, self.resolved))
        limits = {q: self.extrapolated(q) for q in self.errors if q not in PROFILES}
        nothing = np.full(len(self.degrees), np.nan)
        for i, k in np.ndindex(self.unknowns.shape):
            for q in self.errors:
                profile = q in PROFILES
                value, reference = (np.nan, np.nan) if profile else (float(self.values[q][i, k]), self.reference[q])
                limit, uncertainty = (float(x[i]) for x in limits.get(q, (nothing, nothing)))
                yield [
                    *(self.degrees[i], self.elements[k], int(self.unknowns[i, k]), float(self.element_size[k]), q, value, reference),
                    *(float(self.errors[q][i, k]), self.floors[q], bool(resolved[q][i, k]), float(orders[q][i, k]), limit, uncertainty),
                ]

    def to_dataframe(self) -> pandas.DataFrame:
        """:meth:`rows` as a pandas data frame: ``error`` and ``floor`` relative, NaN where there is nothing to say."""
        import pandas

        return pandas.DataFrame(list(self.rows()), columns=list(COLUMNS))

    def write_csv(self, path: str | PathLike[str]) -> None:
        """Write :meth:`rows` as a CSV file under a header line, whole or not at all.

        Parameters
        ----------
        path : path

        Raises
        ------
        InputError
            When the file cannot be written.
        """
        write_csv(path, COLUMNS, self.rows())

    def plot(
        self,
        path: str | PathLike[str] | None = None,
        *,
        ax: Any = None,
        quantities: Sequence[str] | None = None,
        against: str = "unknowns",
    ) -> Any:
        """Errors against unknowns or element size, one line a degree, one panel a quantity; a Matplotlib figure.

        Parameters
        ----------
        path : path, optional
            Where the figure is also written.
        ax : matplotlib Axes, optional
            Where to draw one quantity, the first of ``quantities``; the answer is then these axes.
        quantities : sequence of str, optional
            Panels to draw. Default: the pressure (or the volume, where the pressure is held), the eigenvalue at a held volume, and the
            profile in both norms.
        against : {"unknowns", "element_size"}

        Raises
        ------
        InputError
            For an unknown quantity, or a file that cannot be written.
        """
        return door.plot_convergence(self, path, ax, quantities=quantities, against=against)

    def _repr_html_(self) -> str:
        """The picture and the table, for notebooks."""
        return door.study_html(self, "Errors over cost")

    def __str__(self) -> str:
        names = [q for q in self.errors if q not in ("elastic_energy", "magnetic_energy")]
        lines = [self.scene.title] if self.scene.title else []
        lines += [f"{heading(self.control)} = {self.load:.9g}; relative errors and observed orders", _line("deg", "elem", "unkn.", names)]
        for i, degree in enumerate(self.degrees):
            for k, n in enumerate(self.elements):
                lines.append(f"{degree:>3} {n:>5} {self.unknowns[i, k]:>6}" + "".join(self._cell(q, i, k) for q in names))
        lines.append(f"reference: {self.meshes}; <: not resolved, within {RESOLVED:g} times the error of the reference")
        heads = "".join(f"  {f'extrapolated, degree {degree}':<26}" for degree in self.degrees)
        lines += [f"{'':<13}{'reference':<28}{heads}", *(self._summary(q) for q in self.errors if q not in PROFILES)]
        return "\n".join(line.rstrip() for line in [*lines, *self.messages])

    def _cell(self, quantity: str, i: int, k: int) -> str:
        error, order = self.errors[quantity][i, k], self.orders(quantity)[i, k]
        if np.isnan(error):
            return f"{'-':>9}{'':>5}"
        if not self.resolved(quantity)[i, k]:
            return f"{f'<{RESOLVED * self.floors[quantity]:.0e}':>9}{'':>5}"
        return f"{error:>9.1e}" + ("     " if np.isnan(order) else f"{order:>5.1f}")

    def _summary(self, quantity: str) -> str:
        shown = [_with_error(self.reference[quantity], self.floors[quantity] * self.scale[quantity])]
        shown += [_with_error(value, error) for value, error in zip(*self.extrapolated(quantity), strict=True)]
        return f"{heading(quantity):<12} {shown[0]:<28}" + "".join(f"  {text:<26}" for text in shown[1:])

    def _of(self, table: Mapping[str, Array], quantity: str) -> Array:
        if quantity not in table:
            raise unknown_name("quantity", str(quantity), table)
        return table[quantity]


def _with_error(value: float, error: float) -> str:
    """A value to the digit that its error reaches."""
    if not np.isfinite([value, error]).all():
        return "-"
    decimals = int(np.clip(1 - np.floor(np.log10(max(error, 1e-300))), 0, 16))
    return f"{value: .{decimals}f} +- {error:.0e}"


def _line(degree: str, elements: str, unknowns: str, names: Sequence[str]) -> str:
    return f"{degree:>3} {elements:>5} {unknowns:>6}" + "".join(f"{heading(q):>13} " for q in names)


def observed_orders(errors: Array, elements: Sequence[int]) -> Array:
    """log(e_k-1/e_k)/log(n_k/n_k-1) along the last axis, NaN in the first place and beside a NaN or a zero."""
    errors = np.where(errors > 0, errors, np.nan)
    orders = np.full(errors.shape, np.nan)
    orders[..., 1:] = np.log(errors[..., :-1] / errors[..., 1:]) / np.diff(np.log(np.asarray(elements, dtype=float)))
    return orders


def richardson(values: Array, elements: Sequence[int], degree: int) -> tuple[float, float]:
    """The limit of values that converge like (1/n)^q, from the three finest with q fitted to them, and its estimated error.

    The error is the distance to the limit of the three meshes before. Three meshes alone cannot confirm their q: then the error is the last
    change. Where no q between 1/2 and 2 degree + 1/2 fits (round-off, too coarse a mesh), the finest value stands, with the last change.

    Parameters
    ----------
    values : ndarray, shape (meshes,)
    elements : sequence of int, increasing
    degree : int

    Source: L. F. Richardson, Phil. Trans. R. Soc. A 210 (1911); fitted order: P. J. Roache, J. Fluids Eng. 116 (1994).
    """
    known = np.isfinite(values)
    v, n = values[known], np.asarray(elements, dtype=float)[known]
    if v.size < 2:
        return (float(v[0]) if v.size else np.nan), np.nan
    floor = ROUND_OFF * abs(float(v[-1]))
    change = max(abs(float(v[-1] - v[-2])), floor)
    limit = _limit(v[-3:], n[-3:], degree)
    if limit is None:
        return float(v[-1]), change
    before = _limit(v[-4:-1], n[-4:-1], degree) if v.size > 3 else None
    return limit, change if before is None else max(abs(limit - before), floor)


def _limit(v: Array, n: Array, degree: int) -> float | None:
    from scipy.optimize import brentq

    if v.size < 3 or min(abs(v[1] - v[0]), abs(v[2] - v[1])) <= ROUND_OFF * abs(v[2]):
        return None
    ratio = (v[1] - v[0]) / (v[2] - v[1])

    def excess(q: float) -> float:
        h = (n / n[2]) ** -q
        return float((h[0] - h[1]) / (h[1] - h[2]) - ratio)

    lowest, highest = 0.5, 2.0 * degree + 0.5
    if excess(lowest) * excess(highest) > 0:
        return None
    h = (n / n[2]) ** -brentq(excess, lowest, highest)
    return float(v[2] + (v[2] - v[1]) * h[2] / (h[1] - h[2]))
