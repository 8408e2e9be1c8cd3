"""Contact with bodies: asked of every scene that has some."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...quantities import in_si, quantity, readable, si_values
from .base import Cell, Curves, EquilibriumAnalysis, Remark, Section, Table

if TYPE_CHECKING:
    from ...scene import Scene
    from ..branch import Branch
    from ..equilibrium import Equilibrium

_COLUMNS = ("contact_radius", "contact_reference_radius", "contact_force", "contact_area", "least_gap")
#: the same in SI units, of a scene with scales
_IN_SI = {in_si(name): name for name in _COLUMNS}


class ContactWithBodies(EquilibriumAnalysis):
    """Where the membrane lies on bodies, and with what force."""

    def asked(self, scene: Scene) -> bool:
        return bool(scene.bodies)

    def columns(self, scene: Scene) -> Sequence[str]:
        return _COLUMNS if scene.scales is None else (*_COLUMNS, *_IN_SI)

    def value(self, equilibrium: Equilibrium, column: str) -> Cell:
        contact, scales, name = equilibrium.contact, equilibrium.scene.scales, _IN_SI.get(column, column)
        if contact is None or (name != column and scales is None):
            return float("nan")
        found = float(getattr(contact, name.removeprefix("contact_")))
        return found if name == column or scales is None else float(scales.to_si(quantity(name).si, found))

    def at_nodes(self, equilibrium: Equilibrium) -> Mapping[str, NDArray[Any]]:
        contact, scales = equilibrium.contact, equilibrium.scene.scales
        if contact is None:
            return {}
        found = {"gap": contact.gap(), "contact_pressure": contact.pressure()}
        return found if scales is None else found | si_values(found, scales)

    def remarks(self, equilibrium: Equilibrium) -> Iterator[Remark]:
        contact = equilibrium.contact
        if contact is not None and contact.touching:
            scales = equilibrium.scene.scales
            radius, force, short = f"{contact.radius:.6g}", f"{contact.force:.6g}", f"{contact.radius:.4g}"
            if scales is not None:
                radius = short = readable("contact_radius", contact.radius, scales)
                force = readable("contact_force", contact.force, scales)
            yield Remark("contact", f"up to the radius {radius}, with a force of {force}", f"contact to {short}", f"contact to {short}")

    def section(self, branch: Branch) -> Section:
        scales = branch.scene.scales
        found = [eq.contact.zones for eq in branch if eq.contact is not None]
        rows = []
        for k, body in enumerate(branch.scene.bodies):
            forces = [sum(zone.normal_force for zone in zones if zone.body == k) for zones in found if any(z.body == k for z in zones)]
            largest = max(forces, default=0.0)
            rows.append([body.label(), len(forces), f"{largest:.6g}" if scales is None else readable("contact_force", largest, scales)])
        names = {"deformed": "contact_radius", "reference": "contact_reference_radius"}
        curves = {label: np.nan_to_num(branch.column(name)) for label, name in names.items()}
        figure = Curves("Radius of contact along the branch", "radius of contact over R₀", curves)
        table = Table(["body", "equilibria in contact", "largest force"], rows, "Bodies in the way of the membrane")
        return Section("Contact", figure, table, list(self.remarks(branch[-1])))
