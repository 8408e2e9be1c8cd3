"""Stability of states with waves around the axis, against perturbations of the same symmetry."""

from __future__ import annotations

import numpy as np

from ..potential import Array
from ..potential.tipped import TippedPotential
from ..results.tipped import TippedEquilibrium
from ..results.verdict import Verdict
from ..solve.tipped import compressed
from ..threads import one_thread
from .spectrum import Pencil, smallest_of
from .verdict import against, short_wave_verdict, verdict_from


@one_thread
def tipped_verdict(equilibrium: TippedEquilibrium, control: str) -> Verdict:
    """Verdict at a held volume or pressure: the smallest eigenvalue of the second variation in the harmonics of the state.

    Parameters
    ----------
    equilibrium : TippedEquilibrium
    control : {"volume", "pressure"}
    """
    tipped: TippedPotential = equilibrium.tipped
    evaluation = tipped.evaluate(equilibrium.state, equilibrium.pressure)
    where = compressed(tipped, equilibrium.state)
    if where is not None:
        return short_wave_verdict(f"{where}, and the spectrum has no lower bound under refinement", True, control, equilibrium.waves)
    constraint = evaluation.volume_gradient if control == "volume" else None
    found = smallest_of(Pencil(evaluation.band, tipped.mass, tipped.harmonics.half_bandwidth, constraint, 0.0))
    held = against(control, 0, equilibrium.scene.electricity).removeprefix("axisymmetric ")
    n, K = equilibrium.waves, equilibrium.harmonics
    among = f"{held} with harmonics 0 to {K} of {n} wave{'s' if n > 1 else ''}, mirrored in the plane theta = 0 (others were not tested)"
    return verdict_from(found, among, control, n, _no_shape, 0.0)


def _no_shape(_: Array) -> dict[str, Array]:
    return {"r": np.zeros(0)}
