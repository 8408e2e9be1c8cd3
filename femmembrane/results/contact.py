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
        Its ends along the reference meridian, over R0. On a closed meridian the second is beyond the length of it where a zone goes across
        the seam.
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
        return np.where(self._touched(s), np.maximum(found, 0.0), 0.0)

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
        return np.where(self._touched(s), 0.0, found)

    def _touched(self, s: Array) -> Array:
        """Whether there is contact at parameters of the meridian, which of a closed one come again after its length."""
        space = self._evaluation.potential.space
        again = float(space.ends[-1] - space.ends[0]) if space.closed else 0.0
        found = np.zeros(s.shape, dtype=bool)
        for zone in self.zones:
            found |= ((s >= zone.start) & (s <= zone.stop)) | ((s + again >= zone.start) & (s + again <= zone.stop))
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
    count = space.degree * space.n_elements  # of places for nodes, after which those of a closed meridian come again
    for first, last in _across_the_seam(potential, zones_of(potential, own.held), count):
        held = [place[node % (count + 1 - space.closed)] for node in range(first, last + 1) if node in place or node >= count]
        if not space.closed:
            # next to an end that is held on the body contact goes on to that end
            first, last = (end if abs(node - end) == 1 and end not in place else node for node, end in ((first, 0), (last, count)))
        body = int(own.gaps.body[held[len(held) // 2]])
        start, stop = -(-first // space.degree), last // space.degree  # elements from end to end
        round_trips, own_last = divmod(last, count) if space.closed else (0, last)
        first_s, last_s = float(parameters[first]), float(parameters[own_last])
        covered = 0.0
        if stop > start:
            elements = np.arange(start, stop) % space.n_elements
            covered = float(area[:, elements].sum())
            values = _pressures(potential, own, area, elements, place)
            for k, element in enumerate(elements):
                pressures[element * space.degree : (element + 1) * space.degree + 1] = values[k * space.degree : (k + 1) * space.degree + 1]
        s = np.array([first_s, last_s])
        last_s += round_trips * float(parameters[-1] - parameters[0])
        (R, _), displaced = space.mesh.position(s), space.displacement(own.x, s)[0]
        radii = np.where(np.isin([first, last], [0, count]) & (np.abs(R) < 1e-12), 0.0, R + displaced)
        at_ends = {*(end * space.degree for end in ends)} if space.closed else {0, count, *(end * space.degree for end in ends)}
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
                {first, own_last} <= at_ends,
                bool(np.ptp(curvature[held]) <= _SAME_CURVATURE * np.abs(curvature[held]).max()),
            )
        )
    return Contact(tuple(zones), float(np.abs(own.gaps.gap).min()) if zones else float(own.gaps.gap.min()), own, pressures)


def _across_the_seam(potential: ContactPotential, zones: list[tuple[int, int]], count: int) -> list[tuple[int, int]]:
    """First and last nodes of zones. Those on both sides of the seam of a closed meridian are one, whose last node is beyond the count."""
    known = potential.nodes
    if not (potential.space.closed and len(zones) > 1 and zones[0][0] == known[0] and zones[-1][1] == known[-1]):
        return zones
    return [*zones[1:-1], (zones[-1][0], zones[0][1] + count)]


def _pressures(
    potential: ContactPotential, evaluation: ContactEvaluation, area: Array, elements: NDArray[np.int64], place: dict[int, int]
) -> Array:
    """Pressures at the nodes of neighbouring elements that have the forces there: the mass of their deformed area takes these apart."""
    space = potential.space
    value = space.shape_functions(space.points)[0]
    degree, n = space.degree, len(elements) * space.degree + 1
    mass, right = np.zeros((n, n)), np.zeros(n)
    for number, element in enumerate(elements):
        k = number * degree
        mass[k : k + degree + 1, k : k + degree + 1] += value.T @ (area[:, element, None] * value)
    count = degree * space.n_elements
    nodes = [(int(elements[0]) * degree + j) % (count if space.closed else count + 1) for j in range(n)]
    for j, node in enumerate(nodes):
        known = place.get(node)
        right[j] = 0.0 if known is None else evaluation.forces[known]
    missing = [j for j, node in enumerate(nodes) if node not in place]  # an end that is held takes forces that nobody tells apart
    kept = [j for j in range(n) if j not in missing]
    found = np.zeros(n)
    found[kept] = np.linalg.solve(mass[np.ix_(kept, kept)], right[kept])
    for j in missing:
        found[j] = found[j + 1] if j == 0 else found[j - 1]
    return found
