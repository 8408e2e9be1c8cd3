"""A remark on sources that the membrane enters in a computation, though their walls or cores are in the way in a laboratory."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..physics.magnetics import Source

if TYPE_CHECKING:
    from .branch import Branch


def remarks_on_entered(branch: Branch) -> tuple[str, ...]:
    """One remark for each source that has nodes of some equilibrium inside."""
    remarks = []
    for k, source in enumerate(branch.scene.sources):
        if getattr(type(source), "inside", Source.inside) is Source.inside:
            continue
        counts = []
        for equilibrium in branch:
            profile = equilibrium.profile()
            counts.append(int(np.sum(equilibrium.scene.sources[k].inside(profile["rho"], profile["eta"]))))
        if any(counts):
            name, most = type(source).__name__.lower(), int(np.argmax(counts))
            where = f"{sum(map(bool, counts))} of {len(branch)} equilibria, with {counts[most]} nodes in step {most}"
            cure = "only a Magnet with body = true and an obstacle, such as a cylinder, are in the way of a membrane"
            remarks.append(f"the membrane is inside source {k}, a {name}, in {where}: {cure}")
    return tuple(remarks)
