"""A magnetic field known at the points of a grid.

Where no current flows and no magnet is, the field is the gradient of a harmonic function. The table is fitted by solid harmonics about its
middle (0, z_c), in units of its half diagonal, ::

    h = grad sum_l c_l Q_l,    Q_0 = 1,  Q_1 = z,  (l + 1) Q_(l+1) = (2 l + 1) z Q_l - l (rho^2 + z^2) Q_(l-1)

This field has no divergence, no curl and derivatives of every order. It costs a few operations a term whatever the size of the table, and
it averages noise out. The degree is the smallest that meets the tolerance. A table is refused if no degree meets it: it holds no such
field.

The recurrence is Bonnet's for Legendre polynomials (NIST Digital Library of Mathematical Functions, 18.9; F. W. J. Olver et al. 2010).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from os import PathLike
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..checks import LARGEST, between, store
from ..errors import InputError
from .magnetics import Source, check_source, root

_MAX_DEGREE = 40

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tabulated(Source):
    """An axisymmetric field, free of currents and magnets inside the table, from its values on a grid of radii and heights.

    Outside the table the field is not a number, and a membrane cannot leave it.

    Parameters
    ----------
    rho, z : sequence of float, shapes (n,) and (m,)
        Increasing radii >= 0 and heights in units of R0, three or more of each.
    h_rho, h_z : array_like, shape (n, m)
        The field at these points, in units of sqrt(mu/mu0). A flux density is in units of sqrt(mu mu0).
    strength : float
        Factor >= 0 on |h|^2.
    tolerance : float
        Largest error of the fit over the largest field, 1e-10 to 0.1.

    Raises
    ------
    InputError
        For radii, heights, arrays or numbers that are not of this kind, and for a table that no such field fits.
    """

    rho: tuple[float, ...]
    z: tuple[float, ...]
    h_rho: tuple[tuple[float, ...], ...]
    h_z: tuple[tuple[float, ...], ...]
    strength: float = 1.0
    tolerance: float = 1e-6

    refusal = ("rho", "the table must cover the undeformed membrane and what it may become")

    def __post_init__(self) -> None:
        check_source(self)
        store(self, tolerance=between("source.tolerance", self.tolerance, 1e-10, 0.1))
        for name in ("rho", "z"):
            values = _array(name, getattr(self, name), 1)
            if values.size < 3 or not (np.diff(values) > 0).all() or (name == "rho" and values[0] < 0):
                raise InputError(f"source.{name}", getattr(self, name), "three or more increasing numbers are allowed (radii >= 0)")
            object.__setattr__(self, name, tuple(values.tolist()))
        shape = len(self.rho), len(self.z)
        for name in ("h_rho", "h_z"):
            values = _array(name, getattr(self, name), 2)
            if values.shape != shape:
                raise InputError(f"source.{name}", f"shape {values.shape}", f"one row for each radius, one column for each height: {shape}")
            object.__setattr__(self, name, tuple(map(tuple, values.tolist())))
        object.__setattr__(self, "_fit", self._fitted())

    @classmethod
    def from_csv(cls, path: str | PathLike[str], **more: Any) -> Self:
        """Read a CSV file: a line of names, and four columns rho, z, h_rho, h_z with all points of a grid, in any order.

        Parameters
        ----------
        path : path
        **more
            ``strength`` and ``tolerance`` of the source.

        Raises
        ------
        InputError
            When the file cannot be read, or its points are no grid.
        """
        from ..files import read_bytes

        try:
            lines = [line for line in read_bytes(path).decode("utf-8-sig").splitlines() if line.strip()]
            if len(lines) < 2:
                raise ValueError("there are no points in it")
            columns = np.genfromtxt(lines, delimiter=",", names=True, dtype=float, ndmin=1)
            rho, z, h_rho, h_z = (columns[name] for name in ("rho", "z", "h_rho", "h_z"))
        except (OSError, ValueError, IndexError) as error:
            raise InputError("source", str(path), f"a CSV file with columns rho, z, h_rho, h_z is allowed ({error})") from None
        order = np.lexsort((z, rho))
        radii, heights = np.unique(rho), np.unique(z)
        grid = np.stack([a.ravel() for a in np.meshgrid(radii, heights, indexing="ij")])
        if grid.shape[1] != rho.size or not np.array_equal(grid, np.stack([rho, z])[:, order]):
            raise InputError("source", str(path), f"every radius with every height is needed, once: {radii.size} x {heights.size} points")
        shape = radii.size, heights.size
        return cls(radii.tolist(), heights.tolist(), h_rho[order].reshape(shape), h_z[order].reshape(shape), **more)  # type: ignore[arg-type]

    @property
    def degree(self) -> int:
        """Degree of the solid harmonics that was needed."""
        return len(self._coefficients)

    def field(self, rho: Any, eta: Any) -> tuple[Any, Any, Any]:
        inside = (rho <= self.rho[-1]) * (eta >= self.z[0]) * (eta <= self.z[-1])
        if self.rho[0] > 0:
            inside = inside * (rho >= self.rho[0])
        with np.errstate(invalid="ignore"):
            amplitude = root(self.strength) * np.sqrt(2.0 * inside - 1)  # NaN outside
        rho = rho / self._size
        radial, axial = _harmonics(rho, (eta - self._middle) / self._size, self.degree)
        # the series is summed from its smallest terms on
        terms = list(zip(self._coefficients, radial, axial, strict=True))[::-1]
        return amplitude * rho * sum(c * a for c, a, _ in terms), amplitude * sum(c * b for c, _, b in terms), 0.0

    @property
    def _coefficients(self) -> tuple[float, ...]:
        found: tuple[float, ...] = self.__dict__["_fit"]
        return found

    @property
    def _middle(self) -> float:
        return (self.z[0] + self.z[-1]) / 2

    @property
    def _size(self) -> float:
        return math.hypot(self.rho[-1], (self.z[-1] - self.z[0]) / 2)

    def _fitted(self) -> tuple[float, ...]:
        rho, z = (a.ravel() for a in np.meshgrid(np.array(self.rho), np.array(self.z), indexing="ij"))
        wanted = np.concatenate([np.ravel(self.h_rho), np.ravel(self.h_z)])
        size, misfit = float(np.abs(wanted).max()), math.inf
        if size == 0:
            return (0.0,)
        degrees = range(1, min(_MAX_DEGREE, rho.size // 2) + 1)
        rho = rho / self._size
        radial, axial = _harmonics(rho, (z - self._middle) / self._size, degrees[-1])
        columns = np.array([np.concatenate([rho * a, b + 0 * z]) for a, b in zip(radial, axial, strict=True)]).T
        columns, scale = columns / np.linalg.norm(columns, axis=0), np.linalg.norm(columns, axis=0)
        for degree in degrees:
            found = np.linalg.lstsq(columns[:, :degree], wanted)[0]
            misfit = min(misfit, float(np.abs(columns[:, :degree] @ found - wanted).max()) / size)
            if misfit <= self.tolerance:
                return tuple((found / scale[:degree]).tolist())
        advice = "raise source.tolerance to the noise of the table, or leave out the neighbourhood of magnets and currents"
        raise InputError(
            "source.h_rho", f"{wanted.size // 2} points", f"no field in free space is closer to them than {misfit:.2g}; {advice}"
        )


def _harmonics(rho: Any, z: Any, degree: int) -> tuple[list[Any], list[Any]]:
    """Derivatives of Q_1, ..., Q_degree along rho, over rho, and along z."""
    square = rho**2 + z**2
    before, now, slope_before, slope = 1.0, z, 0.0, 0.0  # Q and dQ/drho over rho
    radial, axial = [], []
    for k in range(1, degree + 1):
        radial.append(slope)
        axial.append(k * before)
        after = ((2 * k + 1) * z * now - k * square * before) / (k + 1)
        slope_after = ((2 * k + 1) * z * slope - k * (2 * before + square * slope_before)) / (k + 1)
        before, now, slope_before, slope = now, after, slope, slope_after
    return radial, axial


def _array(name: str, values: Any, dimensions: int) -> Array:
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError, OverflowError):
        array = np.full((), np.nan)
    if array.ndim != dimensions or not (np.abs(array) <= LARGEST).all():
        kind = "a list of finite numbers" if dimensions == 1 else "lists of finite numbers, one for each radius and all of one length,"
        raise InputError(f"source.{name}", values, f"{kind} {'is' if dimensions == 1 else 'are'} allowed")
    return array
