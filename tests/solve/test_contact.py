"""Contact with rigid bodies: references, orders, solvers, branches, and hard cases.

References for the neo-Hookean disc under a frictionless plate: tests/contact_shooting.py, and nine digits of another shooting code.
"""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.potential import potential_of
from femmembrane.potential.contact import ContactPotential
from femmembrane.potential.potential import Potential
from femmembrane.results.analyses.contact import ContactWithBodies
from femmembrane.solve import active_set
from femmembrane.solve.controls import PressureControl, VolumeControl
from femmembrane.solve.minimize import minimize
from femmembrane.solve.newton import correct
from femmembrane.solve.start import _with_fields

from ..contact_shooting import under_plate

NH = fm.NeoHookean()
#: (P, V, deformed radius of contact) with the plate at 0.5
AT_03, AT_05 = (1.309893716, 1.054478791, 0.3), (1.987275565, 1.248855708, 0.5)


def plate(height=0.5, elements=64, degree=2, **more):
    return fm.Scene(material=NH, mesh=fm.disc(elements), degree=degree, obstacles=[fm.Plane(height=height)], **more)


def test_the_shooting_code_agrees_with_the_nine_digits_of_another():
    found = under_plate(0.5, 0.3, (1.3, 1.2))
    assert found.pressure == pytest.approx(AT_03[0], abs=1e-9)
    assert found.volume == pytest.approx(AT_03[1], abs=1e-9)
    assert found.stretch == pytest.approx(1.219705477, abs=1e-9)
    assert found.reference_radius == pytest.approx(0.245961017, abs=1e-9)
    assert under_plate(0.5, 0.5, (2.0, 1.3)).pressure == pytest.approx(AT_05[0], abs=3e-9)


@pytest.mark.parametrize(("degree", "elements", "within"), [(2, 64, 2e-7), (4, 24, 2e-9)])
def test_disc_under_a_plate(degree, elements, within):
    """P, V, radii and stretch of two states, and the force pi a^2 P."""
    scene = plate(elements=elements, degree=degree)
    for pressure, volume, radius in (AT_03, AT_05):
        eq = fm.equilibrium(scene, volume=volume)
        contact = eq.contact
        assert eq.pressure == pytest.approx(pressure, abs=within + 2e-9)
        assert contact.radius == pytest.approx(radius, abs=within + 2e-9)
        assert contact.force == pytest.approx(np.pi * contact.radius**2 * eq.pressure, rel=1e-9)
        assert contact.pressure([0.0, 0.1, 0.2]) == pytest.approx([eq.pressure] * 3, rel=1e-8)
        known = under_plate(0.5, radius, (pressure, 1.3))
        assert contact.reference_radius == pytest.approx(known.reference_radius, abs=within + 2e-9)
        assert eq.profile([0.1])["stretch_1"] == pytest.approx(known.stretch, abs=within + 2e-9)
        assert eq.profile([0.1])["stretch_2"] == pytest.approx(known.stretch, abs=within + 2e-9)


def errors_of(elements):
    return [fm.equilibrium(plate(elements=n), volume=AT_05[1]).pressure - AT_05[0] for n in elements]


def test_ends_of_elements_that_follow_the_border_keep_the_order(monkeypatch):
    """Order 4 with elements of degree 2. On a mesh that stays the error falls as the square at best, and is a thousand times larger."""
    followed = errors_of((8, 16, 32))
    orders = np.log2(np.abs(followed[:-1])) - np.log2(np.abs(followed[1:]))
    assert (orders > 3.6).all()
    assert (orders < 4.4).all()
    monkeypatch.setattr(active_set, "_with_borders", lambda *given: None)
    stays = errors_of((32, 64))
    assert min(abs(e) for e in stays) > 20 * abs(followed[-1])


def test_first_touch_is_located():
    """P and V of the touch by another shooting code; afterwards the branch goes on in contact."""
    branch = fm.trace(plate(elements=32, degree=3), start=0.6, until={"volume": 1.0})
    touch = next(p for p in branch.special_points if p.kind == "touch")
    assert touch.pressure == pytest.approx(0.900638437, abs=2e-8)
    assert touch.volume == pytest.approx(0.888015530, abs=2e-8)
    assert touch.equilibrium.center_height == pytest.approx(0.5, abs=1e-12)
    assert branch[-1].contact.touching
    assert not branch[0].contact.touching


def test_the_limit_point_moves_in_contact():
    """With the plate at 1 it is touched at P = 1.839932401, before the limit point of the bare disc at 1.879, which moves to about 2.54."""
    branch = fm.trace(plate(1.0), start=2.0, until={"volume": 6.5})
    kinds = {p.kind: p for p in branch.special_points}
    assert [p.kind for p in branch.special_points] == ["touch", "limit_point"]
    assert kinds["touch"].pressure == pytest.approx(1.839932401, abs=1e-7)
    assert kinds["touch"].volume == pytest.approx(2.188132842, abs=1e-6)
    fold = kinds["limit_point"].equilibrium
    radius = fold.contact.radius
    known = [under_plate(1.0, radius + d, (fold.pressure, 2.0)).pressure for d in (-0.01, 0.0, 0.01)]
    assert kinds["limit_point"].pressure == pytest.approx(known[1], abs=1e-6)
    assert fold.pressure == pytest.approx(2.5769, abs=1e-3)  # recorded on 2026-11-28, and by the shooting above


def test_release_under_falling_pressure():
    """Back down the same branch: released where it was touched."""
    down = fm.trace(plate(elements=32), start=1.0, direction=-1, until={"volume": 0.6})
    up = fm.trace(plate(elements=32), start=0.6, until={"volume": 1.0})
    release, touch = (next(p for p in b.special_points if p.kind == k) for b, k in ((down, "release"), (up, "touch")))
    assert release.pressure == pytest.approx(touch.pressure, abs=1e-9)
    assert [p.kind for p in down.special_points] == ["release"]
    loads = fm.pressurize(plate(elements=32), pressures=[0.8, 1.2, 0.8])
    assert loads[0].volume == pytest.approx(loads[2].volume, rel=1e-11)


BODIES = {
    "plane": fm.Plane(0.5),
    "ball": fm.Ball(height=1.0, radius=0.5),
    "cylinder": fm.Cylinder(height=0.6, radius=0.4, length=0.4, rounding=0.12),
    "mould": fm.Mould([(1.3, -0.2), (1.3, 0.4), (0.2, 0.7), (0.0, 0.7)], rounding=0.1),
}


@pytest.mark.parametrize("name", BODIES)
def test_minimiser_and_corrector_agree(name):
    """IPOPT with inequalities on the mesh of the scene finds what the sets of held nodes end with, under both controls."""
    scene = fm.Scene(material=NH, mesh=fm.disc(24), obstacles=[BODIES[name]])
    eq = fm.equilibrium(scene, volume=1.5)
    assert eq.contact.touching
    potential = potential_of(scene)
    for control in (VolumeControl(1.5), PressureControl(eq.pressure)):
        found, pressure, _, status = minimize(potential, control, eq.potential.carried(eq.state), eq.pressure)
        assert status == "Solve_Succeeded"
        on_mesh = active_set._on_mesh
        result = on_mesh(once(control), control, potential, eq.potential.carried(eq.state), eq.pressure, 1.0)
        energy = potential.evaluate(found, pressure).energy - pressure * potential.evaluate(found, pressure).volume
        own = result.evaluation.energy - result.pressure * result.evaluation.volume
        assert energy == pytest.approx(own, rel=1e-9)
        assert pressure == pytest.approx(result.pressure, rel=1e-7)
        assert np.abs(found - result.x).max() < 1e-6
    by = {solver: fm.equilibrium(scene, volume=1.5, solver=solver) for solver in ("ipopt", "newton")}
    assert by["ipopt"].pressure == pytest.approx(by["newton"].pressure, rel=1e-9)
    assert by["ipopt"].contact.radius == pytest.approx(by["newton"].contact.radius, rel=1e-9)


def once(control):
    from functools import partial

    from femmembrane.solve.newton import _corrected

    return partial(_corrected, magnetic=1.0, damped=False, tolerance=1e-10, max_iterations=20)


@pytest.mark.parametrize("name", BODIES)
def test_a_state_in_contact_is_one(name):
    """Forces balance, bodies push and never pull, no point is inside one, and the energy is stationary: dE = P dV."""
    scene = fm.Scene(material=NH, mesh=fm.disc(48), obstacles=[BODIES[name]])
    eq = fm.equilibrium(scene, volume=1.5)
    contact = eq.contact
    assert eq.residual < 1e-9
    assert contact.gap().min() >= -1e-9
    assert contact.pressure().min() >= 0
    before, after = (fm.equilibrium(scene, volume=1.5 + d, start=eq) for d in (-1e-4, 1e-4))
    assert (after.energy - before.energy) / 2e-4 == pytest.approx(eq.pressure, rel=1e-5)


def test_the_force_is_that_of_moving_the_body():
    """-dE/dH at a volume: the force with which the plate holds the membrane."""
    low, eq, high = (fm.equilibrium(plate(h, elements=32), volume=1.1) for h in (0.4999, 0.5, 0.5001))
    assert -(high.energy - low.energy) / 2e-4 == pytest.approx(eq.contact.force, rel=1e-5)


def test_verdicts_are_those_of_the_membrane_beyond_the_contact():
    """A disc in contact is stiffer; n >= 1 waves leave the plate alone. Eigenvalues converge, and frequencies are their roots."""
    coarse, fine = (fm.equilibrium(plate(elements=n), volume=1.1) for n in (32, 64))
    bare = fm.equilibrium(fm.Scene(material=NH, mesh=fm.disc(32)), volume=1.1)
    for ask in ({"control": "pressure"}, {"control": "volume"}, {"azimuthal": 1}, {"azimuthal": 2}):
        one, other = (eq.verdict(**ask).smallest_eigenvalue for eq in (coarse, fine))
        assert one == pytest.approx(other, rel=1e-3)
        assert one > bare.verdict(**ask).smallest_eigenvalue * (1 if "control" in ask else 0.9)
    assert coarse.frequencies(count=1)[0].eigenvalue == pytest.approx(coarse.verdict("pressure").smallest_eigenvalue, rel=1e-8)
    assert coarse.verdict("pressure").stable
    mode = coarse.verdict("pressure").mode
    assert np.abs(mode["w"][mode["r"] < coarse.contact.reference_radius - 0.05]).max() < 1e-12


def test_a_branch_in_contact_comes_back_from_a_file(tmp_path):
    branch = fm.trace(plate(elements=16), start=0.7, until={"volume": 1.1})
    branch.save(tmp_path / "branch.nc")
    again = fm.load(tmp_path / "branch.nc")
    for name in ("pressure", "contact_radius", "contact_force", "least_gap"):
        np.testing.assert_array_equal(again.column(name), branch.column(name))
    assert again.special_points[0].kind == "touch"
    assert again[-1].verdict("pressure").smallest_eigenvalue == branch[-1].verdict("pressure").smallest_eigenvalue
    further = fm.trace(branch.scene, start=branch, until={"volume": 1.2})
    assert further[-1].pressure == pytest.approx(fm.equilibrium(branch.scene, volume=1.2).pressure, rel=1e-9)


def test_without_a_body_nothing_is_built():
    bare = fm.Scene(material=NH, mesh=fm.disc(8))
    potential = potential_of(bare)
    assert type(potential) is Potential
    eq = fm.equilibrium(bare, volume=1.0)
    assert eq.contact is None
    assert not {"gap", "contact_pressure"} & set(eq.profile())
    branch = fm.inflate(bare, volumes=[0.5, 1.0])
    assert not [name for name in branch.to_dataframe().columns if "contact" in name or "gap" in name]
    assert potential_of(plate(elements=8)).operations == potential.operations


def test_between_two_equilibria_of_a_branch():
    """With a body every state between two others is solved for."""
    branch = fm.inflate(plate(elements=24), volumes=[0.7, 0.95, 1.1, 1.3])
    for volume in (0.8, 1.0, 1.2):
        between = branch.at(volume=volume)
        assert between.pressure == pytest.approx(fm.equilibrium(branch.scene, volume=volume).pressure, rel=1e-9)
    assert len(branch.resample(9)) == 9


@pytest.mark.parametrize(
    ("key", "make"),
    [
        ("obstacle", lambda: plate(-0.1, elements=4).replace(obstacles=[fm.Plane(-0.1), fm.Plane(0.0)])),
        ("obstacle", lambda: plate(0.0, elements=4)),
        ("obstacle", lambda: plate(elements=4).replace(obstacles=[fm.Ball(height=0.2, radius=0.3)])),
        ("obstacle.radius", lambda: fm.Ball(height=1.0, radius=0.0)),
        ("obstacle.length", lambda: fm.Cylinder(height=1.0, radius=0.5, length=0.0)),
        ("obstacle.rounding", lambda: fm.Cylinder(height=1.0, radius=0.5, length=1.0, rounding=0.6)),
        ("obstacle.points", lambda: fm.Mould([(0.0, 1.0), (0.0, 1.0)])),
        ("obstacle.points", lambda: fm.Mould([(0.0, 1.0)])),
        ("obstacle.side", lambda: fm.Plane(0.5, side="left")),
        ("obstacle", lambda: plate(elements=4).replace(obstacles=[fm.Plane(0.5), fm.Ball(height=0.7, radius=0.3)])),
        ("obstacle", lambda: plate(elements=4).replace(obstacles=3)),
        ("obstacle", lambda: plate(elements=4).replace(obstacles=[3])),
        ("over", lambda: fm.vary(plate(elements=4), "material.alpha", [1.0], hold={"pressure": 0.0})),
    ],
)
def test_bad_input(key, make):
    with pytest.raises(fm.InputError) as error:
        make()
    assert error.value.key.startswith(key)


def test_scene_files(tmp_path):
    """Obstacles go to a file and back; a mould may have its points in a file of its own, and finds its side."""
    (tmp_path / "bottle.txt").write_text("# rho z\n1.3, -0.2\n1.3; 0.4\n0.2 0.7\n0 0.7\n", encoding="utf-8")
    text = """
[material]
model = "neo-hookean"
[mesh]
elements = 8
[[obstacle]]
kind = "mould"
file = "bottle.txt"
rounding = 0.1
[[obstacle]]
kind = "plane"
height = -2.0
side = "above"
"""
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
    scene = fm.Scene.from_toml(tmp_path / "scene.toml")
    assert scene.obstacles[0] == fm.Mould([(1.3, -0.2), (1.3, 0.4), (0.2, 0.7), (0.0, 0.7)], rounding=0.1, side="left")
    scene.to_toml(tmp_path / "again.toml")
    assert fm.Scene.from_toml(tmp_path / "again.toml") == scene


# --- hard cases


def test_touch_at_the_pole_exactly():
    """At the volume of the first touch: held by no force, or away by round-off."""
    branch = fm.trace(plate(elements=32), start=0.6, until={"volume": 1.0})
    touch = next(p for p in branch.special_points if p.kind == "touch")
    eq = fm.equilibrium(plate(elements=32), volume=touch.volume)
    assert eq.pressure == pytest.approx(touch.pressure, rel=1e-8)
    assert abs(eq.contact.force) < 1e-8


def test_contact_everywhere():
    """A sphere blown into a mould that is a sphere: every node is held, the border is none, and the pressure is what the stretch leaves."""
    half, edges = np.pi / 16, np.arange(8)
    corners = [(1.2 / np.cos(half) * np.sin(half + 2 * half * k), 1.2 / np.cos(half) * np.cos(half + 2 * half * k)) for k in edges]
    mould = fm.Mould([(0.0, 1.2), *corners, (0.0, -1.2)], rounding=1.2)  # straight pieces without length: a round mould
    scene = fm.Scene(material=NH, mesh=fm.sphere(24), obstacles=[mould])
    eq = fm.equilibrium(scene, pressure=3.0)
    stretch = np.median(eq.profile()["stretch_1"])
    assert stretch == pytest.approx(1.2, abs=1e-3)
    assert eq.contact.area == pytest.approx(4 * np.pi * 1.2**2, rel=1e-3)
    free = 2 * (1 / 1.2 - 1.2**-7)
    assert np.median(eq.contact.pressure()) == pytest.approx(3.0 - free, rel=2e-2)


def test_obstacle_at_the_height_of_the_limit_point():
    """The pole of the bare disc at its limit point touches the plate just there: a fold in a corner of the branch."""
    bare = fm.trace(fm.Scene(material=NH, mesh=fm.disc(32)), start=1.0, until={"volume": 4.0})
    fold = next(p for p in bare.special_points if p.kind == "limit_point")
    branch = fm.trace(plate(fold.center_height, elements=32), start=1.0, until={"volume": 6.0})
    kinds = [p.kind for p in branch.special_points]
    assert "touch" in kinds
    touch = branch.special_points[kinds.index("touch")]
    assert touch.pressure == pytest.approx(fold.pressure, rel=1e-9)
    assert branch.status is fm.Status.CONVERGED


def test_a_limit_point_and_a_touch_within_one_step():
    """The plate just above the pole at the limit point: the pressure falls from there to the touch, where it turns in a corner."""
    bare = fm.trace(fm.Scene(material=NH, mesh=fm.disc(16)), start=1.0, until={"volume": 4.0})
    fold = next(p for p in bare.special_points if p.kind == "limit_point")
    branch = fm.trace(plate(fold.center_height + 2e-3, elements=16), start=2.0, until={"volume": 4.0})
    assert [p.kind for p in branch.special_points] == ["limit_point", "limit_point", "touch"]
    first, second, touch = branch.special_points
    assert first.pressure == pytest.approx(fold.pressure, rel=1e-12)
    assert second.volume == pytest.approx(touch.volume, rel=1e-9)
    assert fold.volume < second.volume < fold.volume + 0.02


def test_a_plate_next_to_a_membrane_at_rest():
    """At 1e-12 the law of a nearly flat disc holds until it touches: P = 3.3367 V^3, and w(0) is in proportion to V."""
    near = plate(1e-12, elements=16)
    branch = fm.trace(near, start=1e-12, until={"volume": 2.2e-12})
    touch = next(p for p in branch.special_points if p.kind == "touch")
    assert touch.pressure == pytest.approx(3.3367 * touch.volume**3, rel=1e-3)
    assert touch.equilibrium.center_height == pytest.approx(1e-12, rel=1e-9)
    scaled = fm.trace(plate(1e-6, elements=16), start=1e-6, until={"volume": 2.2e-6})
    assert branch[-1].contact.radius == pytest.approx(scaled[-1].contact.radius, rel=1e-6)


def test_contact_and_dipole_together():
    """A dipole behind the plate pulls the membrane against it; without a pressure the force is the dipole's alone."""
    dipole = {"sources": [fm.Dipole(strength=2.0, height=2.0)], "susceptibility": 1.0}
    free = fm.equilibrium(fm.Scene(material=NH, mesh=fm.disc(32), **dipole), pressure=0.3)
    eq = fm.equilibrium(plate(0.25, elements=32, **dipole), pressure=0.3)
    assert free.center_height > 0.3
    assert eq.center_height == pytest.approx(0.25, abs=1e-12)
    stretch = eq.profile([0.0])["stretch_1"][0]
    # at the pole of a flat membrane the field alone presses beside P: -d/dz (-chi/2 |h|^2) with |h|^2 = 4 M/(z - h)^6, over stretch^2
    field = 12 * 2.0 / (2.0 - 0.25) ** 7 / stretch**2
    assert eq.contact.pressure([0.0])[0] == pytest.approx(0.3 + field, rel=1e-3)


@pytest.mark.parametrize("elements", [10, pytest.param(10_000, marks=pytest.mark.slow), 100])
def test_few_and_many_elements(elements):
    result = fm.equilibrium(plate(elements=elements), volume=AT_03[1])
    assert result.pressure == pytest.approx(AT_03[0], abs=2.0 / elements**4 + 5e-9)


def test_a_membrane_deflated_away_from_a_plate_does_not_feel_it():
    bare = fm.equilibrium(fm.Scene(material=NH, mesh=fm.disc(16)), volume=-1.0)
    assert fm.equilibrium(plate(elements=16), volume=-1.0).pressure == pytest.approx(bare.pressure, rel=1e-9)


def test_no_pole_is_inside_a_body():
    with pytest.raises(fm.SolveError, match="inside a body"):
        fm.equilibrium(plate(elements=8), center_height=0.6)


def test_between_two_plates():
    """A sphere between two plates is flattened on both sides alike, with opposite forces."""
    plates = [fm.Plane(1.2), fm.Plane(-1.2, side="above")]
    eq = fm.equilibrium(fm.Scene(material=NH, mesh=fm.sphere(32), obstacles=plates), volume=11.0)
    top, bottom = (next(z for z in eq.contact.zones if z.body == k) for k in (0, 1))
    assert top.force == pytest.approx(-bottom.force, rel=1e-9)
    assert top.force == pytest.approx(np.pi * max(top.radii) ** 2 * eq.pressure, rel=1e-6)


def test_correct_takes_a_guess_on_a_mesh_that_follows_a_border():
    eq = fm.equilibrium(plate(elements=16), volume=1.1)
    result = correct(eq.potential, VolumeControl(1.1), eq.state, eq.pressure)
    assert result.pressure == pytest.approx(eq.pressure, rel=1e-12)


def test_a_verdict_at_the_touch_says_both_bounds():
    """Held by no force: between the eigenvalues with the pole free and with the pole held."""
    branch = fm.trace(plate(elements=16), start=0.6, until={"volume": 1.0})
    touch = next(p for p in branch.special_points if p.kind == "touch").equilibrium
    bare = fm.equilibrium(fm.Scene(material=NH, mesh=fm.disc(16)), volume=touch.volume)
    verdict = touch.verdict("pressure")
    assert verdict.stable
    assert verdict.smallest_eigenvalue == pytest.approx(bare.verdict("pressure").smallest_eigenvalue, rel=1e-6)
    if touch.contact.touching:
        assert "between" in verdict.reason
    assert "between" not in branch[-1].verdict("pressure").reason


def test_a_verdict_at_the_touch_of_a_circle_says_both_bounds_for_waves():
    """A tube at the wall of a pipe: the membrane with nothing in its way, and the one that the wall holds just after the touch."""
    pipe = fm.Scene(material=NH, mesh=fm.cylinder(length=2.0, elements=12), obstacles=[fm.Mould([(1.3, -2.0), (1.3, 2.0)])])
    branch = fm.trace(pipe, start=8.5, until={"volume": 9.6})
    touch = next(p for p in branch.special_points if p.kind == "touch").equilibrium
    bare = fm.equilibrium(pipe.replace(obstacles=()), volume=touch.volume)
    after = fm.equilibrium(pipe, volume=touch.volume + 1e-6, start=touch, solver="newton")
    for n in (1, 2):
        free, held = (eq.verdict(azimuthal=n).smallest_eigenvalue for eq in (bare, after))
        verdict = touch.verdict(azimuthal=n)
        assert verdict.stable
        assert verdict.smallest_eigenvalue == pytest.approx(free, rel=1e-6)
        lower, upper = (float(number) for number in verdict.reason.rpartition("between ")[2].split(" and "))
        assert (lower, upper) == pytest.approx((free, held), rel=1e-5)
        assert upper > 1.5 * lower
        assert "between" not in after.verdict(azimuthal=n).reason
    assert touch.verdict(azimuthal="all").azimuthal == 1


def test_contact_is_told_in_si_units_of_a_scene_with_scales():
    """R0 = 20 mm, T = 0.3 mm, mu = 0.4 MPa: a force has the unit mu T R0 = 2.4 N, an area 4 cm^2, a pressure 6 kPa.

    On the plate the flat part carries the pressure alone: the force is p pi r^2.
    """
    scales = fm.Scales(radius=0.02, thickness=3e-4, shear_modulus=4e5)
    branch = fm.inflate(plate(elements=16, scales=scales), volumes=[0.4, 1.2])
    row = branch.to_dataframe().iloc[-1]
    units = {"radius": ("m", 0.02), "reference_radius": ("m", 0.02), "force": ("n", 2.4), "area": ("m2", 4e-4)}
    for name, (unit, size) in units.items():
        assert row[f"contact_{name}_{unit}"] == pytest.approx(size * row[f"contact_{name}"], rel=1e-14)
    assert row.contact_force_n == pytest.approx(row.pressure_pa * np.pi * row.contact_radius_m**2, rel=1e-6)
    assert branch.column("least_gap_m")[0] == pytest.approx(0.02 * (0.5 - branch[0].center_height), rel=1e-9)
    shape = branch[-1].profile([0.1])
    assert shape["contact_pressure_pa"] == pytest.approx(6000 * shape["contact_pressure"], rel=1e-14)
    assert shape["gap_m"] == pytest.approx(0.02 * shape["gap"])
    assert not [name for name in fm.inflate(plate(elements=8), volumes=[0.4]).to_dataframe() if name.endswith(("_m", "_n", "_m2"))]
    said = f"a force of {row.contact_force_n * 1e3:.4g} mN" if row.contact_force_n < 1 else f"a force of {row.contact_force_n:.4g} N"
    assert any(said in remark.text for remark in ContactWithBodies().remarks(branch[-1]))


def test_an_onset_in_contact_is_refused_for_the_contact():
    """It is a special point of a branch of its scene, though the mesh there follows the border of contact."""
    scene = plate(elements=16, analysis=fm.Analysis(azimuthal_modes=(1,)))
    branch = fm.trace(scene, start=1.8, until={"volume": 2.6})
    onset = next(p for p in branch.special_points if p.kind == "azimuthal_onset")
    assert onset.equilibrium.contact.touching
    with pytest.raises(fm.InputError, match="the states beyond it are not computed: the membrane may touch an obstacle"):
        fm.trace(branch.scene, start=onset, until={"volume": 2.4})


@pytest.mark.parametrize(
    ("body", "said"),
    [
        (fm.Plane(0.5, side="above"), "lies inside it; move it off, or take its other side"),
        (fm.Ball(0.0, 3.0), "lies inside it; move it off"),
        (fm.Ball(0.2, 0.3), "cuts the membrane at rest (at r = 0, z = 0, over R0)"),
    ],
)
def test_a_body_on_the_wrong_side_is_not_said_to_cut(body, said):
    with pytest.raises(fm.InputError) as error:
        fm.Scene(material=NH, mesh=fm.disc(4), obstacles=[body])
    assert said in str(error.value)
    assert str(error.value).endswith("other side") is said.endswith("other side")


def test_a_mesh_that_stays_loses_the_order_of_its_elements():
    """With the plate at 0.5 errors of P then fall as the square at the best; by default ends of elements follow the border."""
    scene = fm.Scene(material=NH, mesh=fm.disc(32), obstacles=[fm.Plane(height=0.5)])
    eq, stays = (fm.equilibrium(each, volume=1.2489) for each in (scene, scene.replace(follow_borders=False)))
    fine = fm.equilibrium(scene.replace(mesh=fm.disc(64), degree=4), volume=1.2489)
    assert eq.scene.borders
    assert not stays.scene.borders
    assert abs(stays.pressure - fine.pressure) > 10 * abs(eq.pressure - fine.pressure)
    assert scene.replace(follow_borders=False).to_dict()["mesh"]["follow_borders"] is False


def test_the_curve_of_a_branch_has_its_corner_where_contact_begins():
    """Cubics on either side of the touch of a ball have the directions of their own side."""
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16), prestretch=1.2, obstacles=[fm.Ball(0.8, 0.5)])
    branch = fm.trace(scene, start=0.3, until={"pressure": 1.2})
    (touch,) = branch.special_points
    pieces = [piece for run in branch.curve.runs for piece in run]
    before, after = (next(piece for piece in pieces if end(piece).special is touch) for end in (lambda p: p.b, lambda p: p.a))
    for piece, away in ((before, -1), (after, 1)):  # dP/dV on either side, from states next to the touch
        near = fm.equilibrium(scene, volume=touch.volume * (1 + away * 1e-6), start=touch.equilibrium)
        rates = piece.arc.rates[1 if away < 0 else 0]
        assert rates[1] / rates[0] == pytest.approx((near.pressure - touch.pressure) / (near.volume - touch.volume), rel=1e-3)
    assert before.arc.rates[1][1] / before.arc.rates[1][0] != pytest.approx(after.arc.rates[0][1] / after.arc.rates[0][0], rel=0.01)


def test_a_drawn_force_is_a_curve_on_each_side_of_the_touch():
    """The line between equilibria is that of the states there, and no cubic swings below zero before the touch."""
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16), prestretch=1.2, obstacles=[fm.Ball(0.8, 0.5)])
    branch = fm.trace(scene, start=0.3, until={"pressure": 1.6})
    lines = branch.curve.lines(["pressure", "contact_force", "contact_radius"])
    line = np.concatenate([lines[id(piece)] for run in branch.curve.runs for piece in run])
    pressure, force, radius = line.T
    touch = branch.special_points[0].pressure
    assert np.abs(force[pressure <= touch]).max() < 1e-12
    assert (np.diff(force[pressure >= touch]) >= -1e-12).all()
    assert (np.diff(radius[pressure > touch]) >= -1e-12).all()
    middle = (branch[-2].pressure + branch[-1].pressure) / 2
    exact = fm.equilibrium(scene, pressure=middle).contact.force
    assert np.interp(middle, pressure, force) == pytest.approx(exact, rel=2e-3)


def before_a_magnet(height, elements=10):
    magnet = fm.Magnet(height, 0.5, 0.5, strength=(3.0 * 0.5**2 * 0.5 / 4) ** 2, body=True)
    return fm.Scene(material=NH, mesh=fm.disc(elements), prestretch=1.35, susceptibility=1.0, sources=[magnet])


def test_a_cold_start_beyond_pull_in_lands_on_the_body():
    """Without a body no equilibrium is near; the energy of the state in contact is the least."""
    found = fm.equilibrium(before_a_magnet(0.58), pressure=0.0)
    face = 0.58 - found.scene.sources[0].obstacle.length / 2
    assert found.contact.touching
    assert found.center_height == pytest.approx(face, abs=1e-12)
    assert found.verdict("pressure").stable


@pytest.mark.slow
def test_a_membrane_snaps_onto_a_magnet_and_lets_go_farther_away():
    heights = [0.7, 0.62, 0.58, 0.62, 0.75]
    loop = fm.vary(before_a_magnet(heights[0], elements=24), "source.0.height", heights, hold={"pressure": 0.0}, at_limit="jump")
    assert [eq.contact.touching for eq in loop] == [False, False, True, True, False]
    assert [jump.index for jump in loop.jumps] == [2, 4]
    assert loop[3].center_height > 2 * loop[1].center_height  # two states at one distance


def test_a_mesh_too_coarse_for_an_edge_is_said_to_be_so():
    scene = fm.Scene(material=NH, mesh=fm.disc(16), prestretch=1.1, obstacles=[fm.Cylinder(0.5, 0.3, 0.6, 0.01)])
    branch = fm.trace(scene, start=0.45, until={"pressure": 3.0}, max_steps=60)
    assert branch.status is fm.Status.NOT_RESOLVED
    assert "obstacle.rounding = 0.01" in branch.message
    needed = int(branch.message.partition(" even ones are shorter")[0].split()[-1])
    assert 16 * 8 * (1 / 16) / 0.01 < needed < 16 * 8 * (4 / 16) / 0.01  # elements of 1/16, stretched up to four times
    fine = fm.Scene(material=NH, mesh=fm.disc(16), prestretch=1.1, obstacles=[fm.Cylinder(0.5, 0.3, 0.6, 0.3)])
    assert fm.trace(fine, start=0.45, until={"pressure": 1.0}).status is fm.Status.CONVERGED


def test_no_edge_is_blamed_that_the_membrane_is_not_on():
    """A dipole in a ball pulls so much that no start arrives; whether elements are too long for the ball nobody knows."""
    ball = fm.Scene(material=NH, mesh=fm.disc(8), susceptibility=1.0, sources=[fm.Dipole(400.0, 0.3)], obstacles=[fm.Ball(0.3, 0.2)])
    with pytest.raises(fm.SolveError) as caught:
        _with_fields(potential_of(ball), 0.3)
    assert caught.value.status is fm.Status.DIPOLE_CONTACT  # on 128 elements as well
    assert "nodes jump around the edge" not in str(caught.value)
    assert "elements may be too long for the edge of the ball" in str(caught.value)


@pytest.mark.slow
def test_as_many_elements_as_are_said_to_follow_an_edge_do():
    """A rounding of 0.03 stops 240 elements at V = 1.20; as many as are asked for there lead on."""

    def pressed(elements, steps):
        scene = fm.Scene(material=NH, mesh=fm.disc(elements), prestretch=1.1, obstacles=[fm.Cylinder(0.5, 0.3, 0.6, 0.03)])
        return fm.trace(scene, start=0.45, until={"volume": 1.3}, max_steps=steps)

    coarse = pressed(240, 150)
    assert coarse.status is fm.Status.NOT_RESOLVED
    needed = int(coarse.message.partition(" even ones are shorter")[0].split()[-1])
    assert 300 < needed < 600
    assert pressed(needed, 200).status is fm.Status.CONVERGED


def test_sets_of_held_nodes_are_few_on_any_mesh(monkeypatch):
    """A border that lies too far out pulls at its last node alone: let go one by one they would be as many as the mesh has."""
    made = []

    def counted(self, held, holding=ContactPotential.holding):
        made.append(held)
        return holding(self, held)

    monkeypatch.setattr(ContactPotential, "holding", counted)
    numbers = []
    for elements in (200, 1600):
        made.clear()
        eq = fm.equilibrium(plate(elements=elements), volume=AT_03[1])
        assert eq.pressure == pytest.approx(AT_03[0], abs=5e-9)
        numbers.append(len(made))
    assert numbers[1] < 2 * numbers[0]
    assert numbers[1] < 100


def test_contact_across_the_seam_of_a_closed_meridian_is_one_zone():
    """A torus between two plates: the zone at its top, where the meridian begins and ends, is the mirror image of that at its bottom."""
    scene = fm.Scene(
        material=fm.Gent(30.0), mesh=fm.torus(aspect=20, elements=32), obstacles=[fm.Plane(1.02), fm.Plane(-1.02, side="above")]
    )
    volume = 2.0 * potential_of(scene).space.reference_volume
    contact = fm.equilibrium(scene, volume=volume).contact
    low, top = sorted(contact.zones, key=lambda zone: zone.force)
    assert top.start < 2 * np.pi < top.stop
    assert top.followed
    assert low.followed
    assert (2 * np.pi - top.start, top.stop - 2 * np.pi) == pytest.approx((low.stop - np.pi, np.pi - low.start)[::1], abs=1e-7)
    assert (top.force, top.area) == pytest.approx((-low.force, low.area), rel=1e-8)
    s = np.linspace(top.start, top.stop, 21)[1:-1]
    assert contact.pressure(s % (2 * np.pi)) == pytest.approx(contact.pressure(3 * np.pi - s), rel=1e-5)
    assert np.abs(contact.gap(s % (2 * np.pi))).max() == 0
