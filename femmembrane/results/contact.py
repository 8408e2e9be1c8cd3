"""Contact of a membrane with rigid bodies in one equilibrium: where, with what force, and with what pressure."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..solve.active_set import zones_of

if TYPE_CHECKING:
    from ..potential.contact import ContactEvaluation, ContactPotential

Array = NDArray[np.float64]

#: relative difference of curvatures of a body that is round-off
_SAME_CURVATURE = 1e-6


@dataclass(frozen=True, eq=False)
class ContactZone:
    """A part of the meridian on a body.

    Attributes
    ----------
    body : int
        Number of the body among the obstacles of the scene; behind them come the bodies of sources.
    start, stop : float
        Its ends along the reference meridian, over R0.
    reference_radii, radii : (float, float)
        Reference and deformed radii of the ends, over R0.
    force : float
        Axial force of the membrane on the body, positive upwards, in units of mu T R0.
    normal_force, area : float
        Integral of the pressure of contact over the deformed area, and this area over R0^2.
    followed : bool
        Whether ends of elements stand at its borders. A zone shorter than two elements has its ends at nodes.
    smooth : bool
        Whether the curvature of the body under it does not jump, as it does where a flat face goes over into a rounded edge.
    """

    body: int
    start: float
    stop: float
    reference_radii: tuple[float, float]
    radii: tuple[float, float]
    force: float
    normal_force: float
    area: float
    followed: bool
    smooth: bool = True


@dataclass(frozen=True, eq=False)
class Contact:
    """All contact of an equilibrium with bodies. Nothing is touched where there are no zones: sums are 0 then, and radii NaN.

    Attributes
    ----------
    zones : tuple of ContactZone
        Along the meridian.
    least_gap : float
        The least distance between a node and a body, over R0; round-off where one is touched.

    Examples
    --------
    >>> import femmembrane as fm
    >>> scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(32), obstacles=[fm.Plane(height=0.5)])
    >>> contact = fm.equilibrium(scene, pressure=1.309893716).contact
    >>> print(f"{contact.radius:.5f} {contact.reference_radius:.5f} {contact.force:.5f} {float(contact.pressure(0.1)[0]):.4f}")
    0.30000 0.24596 0.37037 1.3099
    """

    zones: tuple[ContactZone, ...]
    least_gap: float
    _evaluation: ContactEvaluation = field(repr=False)
    _pressures: Array = field(repr=False)

    @property
    def touching(self) -> bool:
        """Whether a body is touched."""
        return bool(self.zones)

    @property
    def radius(self) -> float:
        """Largest deformed radius of contact, over R0."""
        return max((r for zone in self.zones for r in zone.radii), default=float("nan"))

    @property
    def reference_radius(self) -> float:
        """Reference radius, over R0, of the point of the membrane at :attr:`radius`."""
        found = [(r, reference) for zone in self.zones for r, reference in zip(zone.radii, zone.reference_radii, strict=True)]
        return max(found, default=(0.0, float("nan")))[1]

    @property
    def force(self) -> float:
        """Axial force of the membrane on the bodies, positive upwards, in units of mu T R0."""
        return sum(zone.force for zone in self.zones)

    @property
    def normal_force(self) -> float:
        """Integral of the pressure of contact over the deformed area, in units of mu T R0."""
        return sum(zone.normal_force for zone in self.zones)

    @property
    def area(self) -> float:
        """Deformed area in contact, over R0^2."""
        return sum(zone.area for zone in self.zones)

    def pressure(self, r: ArrayLike | None = None) -> Array:
        """Pressure between membrane and bodies in units of mu T/R0, 0 where there is no contact.

        Parameters
        ----------
        r : array_like, optional
            Reference radii, for a meridian that does not run along the radius arc lengths. Default: the nodes.
        """
        potential = cast("ContactPotential", self._evaluation.potential)
        s = potential.root.space.node_parameters() if r is None else np.atleast_1d(np.asarray(r, dtype=float))
        space = potential.space
        element, xi = space.locate(s)
        values = self._pressures[element * space.degree + np.arange(space.degree + 1)[:, None]]
        found: Array = np.einsum("qa,aq->q", space.shape_functions(xi)[0], values)
        touched = np.zeros(s.shape, dtype=bool)
        for zone in self.zones:
            touched |= (s >= zone.start) & (s <= zone.stop)
        return np.where(touched, np.maximum(found, 0.0), 0.0)

    def gap(self, r: ArrayLike | None = None) -> Array:
        """Distance from the nearest body over R0, 0 in contact.

        Parameters
        ----------
        r : array_like, optional
            As for :meth:`pressure`.
        """
        potential = cast("ContactPotential", self._evaluation.potential)
        space = potential.space
        s = potential.root.space.node_parameters() if r is None else np.atleast_1d(np.asarray(r, dtype=float))
        (R, Z), (u, _, w, _) = space.mesh.position(s), space.displacement(self._evaluation.x, s)
        found: Array = np.min([body.gap(R + u, Z + w) for body in potential.obstacles], axis=0)
        for zone in self.zones:
            found = np.where((s >= zone.start) & (s <= zone.stop), 0.0, found)
        return found


def contact_of(evaluation: Any) -> Contact:
    """The contact of a state from its evaluation."""
    own: ContactEvaluation = evaluation
    potential = cast("ContactPotential", own.potential)
    space = potential.space
    pressures = np.zeros(space.degree * space.n_elements + 1)
    u, u_x, _, w_x = space.displacement_at_quadrature(own.x)
    area = space.weights * (space.R + u) * np.hypot(space.R_x + u_x, space.Z_x + w_x)  # with the 2 pi
    ends, n_eta, curvature = {end for end, _ in potential.borders}, own.gaps.n_eta, own.gaps.curvature
    parameters = space.node_parameters()
    place = {int(node): k for k, node in enumerate(potential.nodes)}
    zones = []
    for first, last in zones_of(potential, own.held):
        held = [place[node] for node in range(first, last + 1) if node in place]
        # next to an end that is held on the body contact goes on to that end
        first, last = (
            end if abs(node - end) == 1 and end not in place else node for node, end in ((first, 0), (last, parameters.size - 1))
        )
        body = int(own.gaps.body[held[len(held) // 2]])
        start, stop = -(-first // space.degree), last // space.degree  # elements from end to end
        first_s, last_s = float(parameters[first]), float(parameters[last])
        covered = 0.0
        if stop > start:
            covered = float(area[:, start:stop].sum())
            pressures[start * space.degree : stop * space.degree + 1] = _pressures(potential, own, area, start, stop, place)
        s = np.array([first_s, last_s])
        (R, _), displaced = space.mesh.position(s), space.displacement(own.x, s)[0]
        radii = np.where(np.isin([first, last], [0, parameters.size - 1]) & (np.abs(R) < 1e-12), 0.0, R + displaced)
        at_ends = {0, parameters.size - 1, *(end * space.degree for end in ends)}
        forces = own.forces[held]
        zones.append(
            ContactZone(
                body,
                first_s,
                last_s,
                (float(R[0]), float(R[1])),
                (float(radii[0]), float(radii[1])),
                -float((forces * n_eta[held]).sum()) + 0.0,
                float(forces.sum()),
                covered,
                {first, last} <= at_ends,
                bool(np.ptp(curvature[held]) <= _SAME_CURVATURE * np.abs(curvature[held]).max()),
            )
        )
    return Contact(tuple(zones), float(np.abs(own.gaps.gap).min()) if zones else float(own.gaps.gap.min()), own, pressures)


def _pressures(
    potential: ContactPotential, evaluation: ContactEvaluation, area: Array, start: int, stop: int, place: dict[int, int]
) -> Array:
    """Nodal values of the pressure that has the forces on the nodes of a zone: the mass of its deformed area takes them apart."""
    space = potential.space
    value = space.shape_functions(space.points)[0]
    degree, n = space.degree, (stop - start) * space.degree + 1
    mass, right = np.zeros((n, n)), np.zeros(n)
    for element in range(start, stop):
        k = (element - start) * degree
        mass[k : k + degree + 1, k : k + degree + 1] += value.T @ (area[:, element, None] * value)
    for j in range(n):
        known = place.get(start * degree + j)
        right[j] = 0.0 if known is None else evaluation.forces[known]
    missing = [j for j in range(n) if start * degree + j not in place]  # an end that is held takes forces that nobody tells apart
    kept = [j for j in range(n) if j not in missing]
    found = np.zeros(n)
    found[kept] = np.linalg.solve(mass[np.ix_(kept, kept)], right[kept])
    for j in missing:
        found[j] = found[j + 1] if j == 0 else found[j - 1]
    return found
