"""Stability of states with waves around the axis, against perturbations with the same waves.

Those that are even in the mirror of the state and those that are odd do not mix. An odd one is the turn of the waves about the axis, which
costs nothing: it is taken out. With n = 1 these are all perturbations up to K waves. With more waves those are missing that are not the
same after a turn by one wave.
"""

from __future__ import annotations

import numpy as np

from ..discretization.harmonics import harmonics_of
from ..potential import Array
from ..potential.tipped import TippedEvaluation, TippedPotential
from ..results.tipped import TippedEquilibrium
from ..results.verdict import Verdict
from ..solve.banded import band_product
from ..solve.tipped import compressed
from ..threads import one_thread
from .spectrum import Pencil, SmallestEigenvalue, smallest_of
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
    harmonics = tipped.harmonics
    where = compressed(tipped, equilibrium.state)
    if where is not None:
        return short_wave_verdict(f"{where}, and the spectrum has no lower bound under refinement", True, control, equilibrium.waves)
    constraint = evaluation.volume_gradient if control == "volume" else None
    even = smallest_of(Pencil(evaluation.band, tipped.mass, harmonics.half_bandwidth, constraint, 0.0))
    odd = _odd(tipped, evaluation, equilibrium.state)
    lowest = min((even, odd), key=lambda found: found.value)
    found = SmallestEigenvalue(lowest.value, lowest.mode, even.negative + odd.negative, lowest.error)
    held = against(control, 0, equilibrium.scene.electricity).removeprefix("axisymmetric ")
    n, K = equilibrium.waves, equilibrium.harmonics
    among = f"{held} with up to {K} waves around the axis"
    if n > 1:
        among = f"{held} with 0, {n}, ... {K * n} waves around the axis (others were not tested)"
    return verdict_from(found, among, control, n, _no_shape, 0.0)


def _odd(tipped: TippedPotential, evaluation: TippedEvaluation, x: Array) -> SmallestEigenvalue:
    """Of the perturbations that are odd in the mirror of a state, less the turn about the axis; they do not change the volume."""
    odd = harmonics_of(tipped.space, tipped.waves, tipped.order, odd=True)
    mass = odd.mass(tipped.axisymmetric.bulk)
    turn = tipped.harmonics.turned(x, odd)
    size = float(np.abs(turn).max(initial=0.0))
    held = band_product(mass, odd.half_bandwidth, turn / size) if size else None
    return smallest_of(Pencil(evaluation.odd_band(odd), mass, odd.half_bandwidth, held, 0.0))


def _no_shape(_: Array) -> dict[str, Array]:
    return {"r": np.zeros(0)}
