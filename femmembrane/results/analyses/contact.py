"""Contact with bodies: asked of every scene that has some."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .base import Cell, Curves, EquilibriumAnalysis, Remark, Section, Table

if TYPE_CHECKING:
    from ...scene import Scene
    from ..branch import Branch
    from ..equilibrium import Equilibrium

_COLUMNS = ("contact_radius", "contact_reference_radius", "contact_force", "contact_area", "least_gap")


class ContactWithBodies(EquilibriumAnalysis):
    """Where the membrane lies on bodies, and with what force."""

    def asked(self, scene: Scene) -> bool:
        return bool(scene.bodies)

    def columns(self, scene: Scene) -> Sequence[str]:
        return _COLUMNS

    def value(self, equilibrium: Equilibrium, column: str) -> Cell:
        contact = equilibrium.contact
        if contact is None:
            return float("nan")
        return float(getattr(contact, column.removeprefix("contact_")))

    def at_nodes(self, equilibrium: Equilibrium) -> Mapping[str, NDArray[Any]]:
        contact = equilibrium.contact
        return {} if contact is None else {"gap": contact.gap(), "contact_pressure": contact.pressure()}

    def remarks(self, equilibrium: Equilibrium) -> Iterator[Remark]:
        contact = equilibrium.contact
        if contact is not None and contact.touching:
            text = f"up to the radius {contact.radius:.6g}, with a force of {contact.force:.6g}"
            yield Remark("contact", text, terminal=f"contact to {contact.radius:.4g}", caption=f"contact to {contact.radius:.4g}")

    def section(self, branch: Branch) -> Section:
        found = [eq.contact.zones for eq in branch if eq.contact is not None]
        rows = []
        for k, body in enumerate(branch.scene.bodies):
            forces = [sum(zone.normal_force for zone in zones if zone.body == k) for zones in found if any(z.body == k for z in zones)]
            rows.append([body.label(), len(forces), f"{max(forces, default=0.0):.6g}"])
        names = {"deformed": "contact_radius", "reference": "contact_reference_radius"}
        curves = {label: np.nan_to_num(branch.column(name)) for label, name in names.items()}
        figure = Curves("Radius of contact along the branch", "radius of contact", curves)
        table = Table(["body", "equilibria in contact", "largest force"], rows, "Bodies in the way of the membrane")
        return Section("Contact", figure, table, list(self.remarks(branch[-1])))
