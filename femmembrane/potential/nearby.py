"""Fields whose derivatives are written out, under derivatives by CasADi."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from ..physics.magnetics import Source


class Nearby:
    """Sources at one point, for energies that are differentiated up to twice.

    The field of a source with a :meth:`.Source.jet` is replaced by its Taylor polynomial of degree two about a symbolic point. CasADi
    differentiates the polynomial; then the point is put in its place, and the field itself was never differentiated. Other sources stay as
    they are.

    Parameters
    ----------
    sources : sequence of Source
    rho, eta : CasADi expression
        The point, as the energy has it.
    """

    def __init__(self, sources: Sequence[Source], rho: Any, eta: Any) -> None:
        self._point, self._at = ca.SX.sym("point", 2), ca.vertcat(rho, eta)
        self._symbols: list[Any] = []
        self._jets: list[Any] = []
        self.sources = [self._polynomial(source, source.jet(rho, eta)) for source in sources]

    def _polynomial(self, source: Source, jet: Any) -> Source:
        if jet is None:
            return source
        symbols = [ca.SX.sym(name) for name in jet._fields]
        self._symbols += symbols
        self._jets += jet
        return _Polynomial(type(jet)(*symbols), self._point)

    def placed(self, *derivatives: ca.SX) -> list[ca.SX]:
        """Derivatives of an energy of :attr:`sources`, at the point itself."""
        if not self._jets:
            return list(derivatives)
        found = ca.substitute(list(derivatives), [self._point], [self._at])
        return list(ca.substitute(found, self._symbols, self._jets))


class _Polynomial(Source):
    """The Taylor polynomial of a field about a point."""

    def __init__(self, jet: Any, point: ca.SX) -> None:
        self._jet, self._about = jet, point

    def field(self, rho: Any, eta: Any) -> tuple[Any, Any, Any]:
        j, r, z = self._jet, rho - self._about[0], eta - self._about[1]
        h_r = j.h_r + r * j.h_r_r + z * j.h_r_z + (r**2 * j.h_r_rr + z**2 * j.h_r_zz) / 2 + r * z * j.h_r_rz
        h_z = j.h_z + r * j.h_r_z + z * j.h_z_z + (r**2 * j.h_r_rz + z**2 * j.h_z_zz) / 2 + r * z * j.h_r_zz
        return h_r, h_z, 0.0
