"""Requests and runs: what is asked is checked once, and a run is one object whoever steps it."""

import dataclasses

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.solve.controls import CONTROLS
from femmembrane.verbs.load_run import LoadRequest
from femmembrane.verbs.meshing import on_chosen_mesh
from femmembrane.verbs.running import carry_out
from femmembrane.verbs.trace_run import TraceRequest

BARE = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(elements=8))
ABOVE = BARE.replace(sources=[fm.Dipole(strength=5, height=3.0)], susceptibility=2.5)
VOLUMES = np.array([0.5, 1.0, 2.0])


def bits(branch):
    return [(eq.state.tobytes(), eq.pressure) for eq in branch]


def test_a_run_stepped_by_hand_is_that_of_the_verb():
    run = LoadRequest(CONTROLS["volume"], VOLUMES).begin(ABOVE)
    for count in range(1, len(VOLUMES) + 1):
        assert run.step() is None
        assert len(run.found) == count
    assert run.step() == (fm.Status.CONVERGED, "")
    assert bits(run.found) == bits(fm.inflate(ABOVE, volumes=VOLUMES))


def test_a_trace_stepped_by_hand_is_that_of_the_verb():
    run = TraceRequest(0.5, {"volume": 1.0}).begin(ABOVE)
    while (end := run.step()) is None:
        pass
    assert end == (fm.Status.CONVERGED, "")
    assert bits(run.found) == bits(fm.trace(ABOVE, start=0.5, until={"volume": 1.0}))


def test_a_request_is_frozen():
    for request in (LoadRequest(CONTROLS["volume"], VOLUMES), TraceRequest(0.5)):
        with pytest.raises(dataclasses.FrozenInstanceError):
            request.start = None


def test_the_mesh_is_chosen_before_the_run():
    """The scene, the loads and the start that the run begins with lie on the mesh; a scene that has one keeps it."""
    request = LoadRequest(CONTROLS["volume"], VOLUMES, start=fm.equilibrium(BARE, volume=0.5))
    kept = on_chosen_mesh(BARE, request)
    assert kept.scene is BARE
    assert kept.request is request
    chosen = on_chosen_mesh(BARE.replace(mesh=fm.disc(accuracy=1e-3)), request)
    assert not chosen.scene.open
    assert chosen.request.start.state.shape == (chosen.request.start.potential.space.n_free,)
    assert chosen.request.start.scene is chosen.scene
    assert "mesh" in carry_out(chosen).timings


def test_amounts_of_gas_are_loads_like_others():
    """Every equilibrium of a run obeys P = amount/(V + chamber) - atmosphere, and knows its gas."""
    gas, amounts = fm.Gas(amount=1.0, chamber=1.0, atmosphere=0.5), np.array([1.0, 2.0, 3.0])
    branch = carry_out(on_chosen_mesh(ABOVE, LoadRequest(gas, amounts)))
    assert branch.status is fm.Status.CONVERGED
    for eq, amount in zip(branch, amounts, strict=True):
        assert eq.pressure == pytest.approx(amount / (eq.volume + 1.0) - 0.5, rel=1e-9)
        assert eq.gas == gas.at(amount)
    alone = fm.equilibrium(ABOVE, gas=gas.at(3.0))
    assert (branch[-1].volume, branch[-1].pressure) == pytest.approx((alone.volume, alone.pressure), rel=1e-9)


def test_a_gas_at_the_pressure_of_the_atmosphere_leaves_the_membrane_flat():
    assert not fm.equilibrium(BARE, gas=fm.Gas(amount=0.6, chamber=1.2, atmosphere=0.5)).state.any()


def test_a_gas_that_is_not_reached_says_so_as_other_loads_do():
    start = fm.equilibrium(ABOVE, volume=0.5)
    with pytest.raises(fm.SolveError, match=r"^amount of gas 1000000 was not reached: ") as error:
        fm.equilibrium(ABOVE, gas=fm.Gas(amount=1e6, chamber=1.0), start=start)
    assert error.value.result is not None
    with pytest.raises(fm.SolveError, match="does not compress the gas") as refused:
        fm.equilibrium(BARE, gas=fm.Gas(amount=1.0, chamber=0.5), start=fm.equilibrium(BARE, volume=-1.0))
    assert refused.value.status is fm.Status.NO_EQUILIBRIUM
    with pytest.raises(fm.InputError, match="solver"):
        fm.equilibrium(BARE, gas=fm.Gas(amount=1.0, chamber=0.5), solver="Newton")


def test_a_height_beyond_a_source_is_not_said_to_lie_beyond_a_fold():
    """Under height control nobody looks for a fold, so that none is spoken of."""
    run = fm.Run(control="height", values=(0.5, 1.0, 4.0))
    branch = fm.run(ABOVE.replace(run=run))
    assert branch.status is fm.Status.DIPOLE_CONTACT
    assert branch.message.startswith("center height 4 was not reached: the pole would have to pass through a source")
