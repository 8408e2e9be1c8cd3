"""What a stranger tries first: flat states, sources in the way, high degrees, wrong arguments. Each ends in a number or in advice."""

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.potential import potential_of
from femmembrane.solve.controls import VolumeControl
from femmembrane.solve.start import start_at_volume
from femmembrane.solve.stepping import march
from tests.cases import OGDEN, disc_scene


def below(elements: int = 16, strength: float = 200.0, degree: int = 2) -> fm.Scene:
    return disc_scene(OGDEN, (strength, 6.5), elements=elements, degree=degree)


PLAIN = disc_scene(OGDEN, elements=16)


@pytest.mark.parametrize("elements", [16, 64])
def test_no_branch_goes_through_a_source(elements):
    """The dipole sits at height 6.5, where the energy has no lower bound: a pole height of 7 is on the other side of it."""
    scene = below(elements)
    with pytest.raises(fm.SolveError) as raised:
        fm.equilibrium(scene, center_height=7.0)
    assert raised.value.status in (fm.Status.DIPOLE_CONTACT, fm.Status.STEP_UNDERFLOW)
    branch = fm.trace(scene, start=0.5, until={"center_height": 7.0}, max_steps=1500, throw=False)
    assert branch.status is fm.Status.DIPOLE_CONTACT
    assert branch[-1].center_height < 6.5


@pytest.mark.parametrize(("degree", "volume"), [(8, 1.0), (7, 2.0), (8, 10.0)])
def test_high_degrees_have_verdicts(degree, volume):
    """Condensed in one go, the second variation of these loses digits next to its smallest eigenvalue; the verdict may not be lost."""
    verdict = fm.equilibrium(below(16, degree=degree), volume=volume).verdict("volume")
    assert verdict.stable is True
    fine = fm.equilibrium(below(32, degree=4), volume=volume).verdict("volume")
    assert verdict.smallest_eigenvalue == pytest.approx(fine.smallest_eigenvalue, rel=1e-6)


def test_one_linear_element_has_nothing_to_perturb_at_constant_volume():
    verdict = fm.equilibrium(disc_scene(OGDEN, elements=1, degree=1), volume=1.0).verdict("volume")
    assert verdict.stable is None
    assert np.isnan(verdict.smallest_eigenvalue)
    assert "not decided" in verdict.reason


def test_the_flat_state_can_be_started_from_and_passed():
    """Without sources V = 0 is flat and has no stiffness; P(-V) = -P(V)."""
    for solver in ("ipopt", "newton"):
        branch = fm.inflate(PLAIN, volumes=[-1.0, 0.0, 1.0], solver=solver)
        assert branch.column("pressure") == pytest.approx([-branch[2].pressure, 0.0, branch[2].pressure], rel=1e-8)
        assert fm.pressurize(PLAIN, pressures=[0.0, 1.0], solver=solver)[1].volume == pytest.approx(0.9323, rel=1e-3)
    assert fm.equilibrium(PLAIN, center_height=0.0).volume == 0.0
    assert [eq.volume for eq in fm.equilibria(PLAIN, volume=0.0)] == pytest.approx([0.0], abs=1e-12)
    with pytest.raises(fm.InputError, match="flat"):
        fm.trace(PLAIN, start=0.0)


def test_a_source_without_strength_is_none():
    """Strength 0 builds nothing: the flat state and the number of operations are those without a source."""
    scene = below(strength=0.0)
    assert fm.equilibrium(scene, volume=0.0).pressure == 0.0
    assert fm.equilibrium(scene, volume=0.0).potential.operations == fm.equilibrium(PLAIN, volume=0.0).potential.operations


def test_a_nearly_vanishing_source_on_a_nearly_flat_disc():
    weak, none = (fm.equilibrium(s, volume=1e-3) for s in (below(strength=1e-12), PLAIN))
    assert weak.pressure == pytest.approx(none.pressure, abs=1e-12)


def test_a_dipole_in_the_way_is_named():
    """At V = 1 the dome spans over a dipole at height 0.05, which cannot be turned on there: the message says what to change."""
    with pytest.raises(fm.SolveError, match="full strength at V = 1; try another volume or a lower strength"):
        fm.equilibrium(disc_scene(OGDEN, (1.0, 0.05), elements=16), volume=1.0)


def test_absurd_strengths_warn_of_nothing():
    with pytest.raises(fm.SolveError):
        fm.equilibrium(below(strength=1e99), volume=1.0)


def test_a_branch_is_continued_in_its_own_scene_only():
    branch = fm.trace(below(), start=0.5, until={"volume": 1.0})
    with pytest.raises(fm.InputError, match="this scene"):
        fm.trace(below(strength=201.0), start=branch, until={"volume": 1.2})
    with pytest.raises(fm.InputError, match="direction"):
        fm.trace(below(), start=branch, until={"volume": 0.6}, direction=-1)


@pytest.mark.parametrize(
    ("call", "key"),
    [
        (lambda eq: fm.trace(eq.scene, until=3), "until"),
        (lambda eq: fm.equilibrium(eq.scene, volume=1, start=1.0), "start"),
        (lambda eq: fm.equilibrium(eq.scene, center_height=float("nan")), "center_height"),
        (lambda eq: fm.equilibrium(eq.scene, volume=[1.0]), "volume"),
        (lambda eq: fm.equilibria(eq.scene, pressure=1.0, max_steps=-1), "max_steps"),
        (lambda eq: eq.verdict(["volume"]), "control"),
        (lambda eq: eq.verdict(azimuthal=[1]), "azimuthal"),
        (lambda eq: eq.verdict("volume", gas=fm.Gas(amount=1.0, chamber=1.0)), "gas"),
        (lambda eq: fm.inflate(eq.scene, volumes=[1.0]).plot("picture.xyz"), "path"),
    ],
)
def test_wrong_arguments_are_named(call, key, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(fm.InputError) as raised:
        call(fm.equilibrium(PLAIN, volume=1.0))
    assert raised.value.key == key
    assert list(tmp_path.iterdir()) == []


def test_inflating_without_the_source_may_pass_where_it_will_be():
    """Cold starts inflate first and turn sources on afterwards: a source is no obstacle while it is off."""
    potential = potential_of(disc_scene(fm.NeoHookean(), (1e-3, 3.0), elements=16))
    small = start_at_volume(potential_of(disc_scene(fm.NeoHookean(), elements=16)), 10.0)
    last = march(potential, small, VolumeControl, 10.0, 60.0, magnetic=0.0)[-1]
    assert potential.space.center_height(last.x) > 3.0


@pytest.mark.parametrize("control", ["volume", "pressure", "center_height"])
def test_an_equilibrium_of_another_scene_is_a_start(control):
    """Corrected in the new scene it has another load than it had: the load asked for is reached all the same, from either."""
    other = fm.equilibrium(below(strength=200.0), volume=1.5)
    load = getattr(other, control)
    scene = below(strength=300.0)
    found = fm.equilibrium(scene, start=other, **{control: load})
    assert getattr(found, control) == pytest.approx(load, rel=1e-9)
    assert found.pressure != pytest.approx(other.pressure, rel=1e-6) or found.volume != pytest.approx(other.volume, rel=1e-6)
    assert found.pressure == pytest.approx(fm.equilibrium(scene, **{control: load}).pressure, rel=1e-8)
