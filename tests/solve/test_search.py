"""All equilibria at a load, and runs that meet a limit."""

from types import SimpleNamespace

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.solve.segment import Segment
from tests.cases import OGDEN, disc_scene


def test_four_equilibria_below_the_last_limit_point():
    """P = 1.8 with M = 200, h = 6.5: the paper's figure 10 shows four. Values recorded on 2026-11-22, checked by their residuals."""
    found = fm.equilibria(disc_scene(OGDEN, (200.0, 6.5)), pressure=1.8)
    assert len(found) == 4
    assert sorted(eq.center_height for eq in found) == pytest.approx([0.873736, 1.41555, 4.24426, 5.0363], rel=1e-5)
    words = {round(eq.center_height, 1): (eq.verdict("pressure").word, eq.verdict("volume").word) for eq in found}
    assert words == {
        0.9: ("stable", "stable"),
        1.4: ("unstable", "stable"),
        4.2: ("stable", "stable"),
        5.0: ("unstable", "unstable"),
    }
    assert list(found.energies) == sorted(found.energies)
    for eq, energy in zip(found, found.energies, strict=True):
        assert eq.pressure == 1.8
        assert eq.residual < 1e-10
        assert energy == pytest.approx(eq.energy - 1.8 * eq.volume)
    assert "searched" in str(found)


def test_all_equilibria_below_a_strong_dipole():
    """P = 1.85 with M = 600, h = -3.5 (figure 10, left): both sides of the first limit point and of the second, and one far out."""
    found = fm.equilibria(disc_scene(OGDEN, (600.0, -3.5), elements=32), pressure=1.85)
    heights = sorted(eq.center_height for eq in found)
    assert heights == pytest.approx([0.307397, 0.453064, 1.4443, 4.1884], rel=1e-4)


@pytest.mark.parametrize("elements", [16, 64])
def test_folded_shapes_of_a_mesh_are_no_equilibria(elements):
    """Without a dipole the disc at P = 1.7 has three equilibria. On some meshes deflation also finds shapes folded within one element, in
    compression. The continuous problem does not have them: they are left out, and counted.
    """
    found = fm.equilibria(disc_scene(OGDEN, elements=elements), pressure=1.7)
    assert sorted(eq.volume for eq in found) == pytest.approx([1.57034, 5.3143, 54.055], rel=1e-4)
    assert all(eq.status is fm.Status.CONVERGED for eq in found)


def test_equilibria_at_a_volume():
    """V = 82.5 lies between the limit point and the volume fold at 82.748: one state on either side of the fold."""
    found = fm.equilibria(disc_scene(OGDEN, (200.0, 6.5), elements=32), volume=82.5)
    assert [eq.verdict("volume").word for eq in found] == ["stable", "unstable"]


def test_limit_point_stops_a_pressure_run_and_says_where_it_would_jump():
    """The limit point of the Ogden disc is P = 1.899084863 (tests/data/disc.json)."""
    scene = disc_scene(OGDEN)
    with pytest.raises(fm.SolveError, match=r"limit point is P = 1\.8990848.* would jump to V = 74\.63") as raised:
        fm.pressurize(scene, pressures=[1.8, 1.9, 2.0])
    assert raised.value.status is fm.Status.NO_EQUILIBRIUM
    assert len(raised.value.result) == 1
    quiet = fm.pressurize(scene, pressures=[1.8, 1.9, 2.0], throw=False)
    assert len(quiet) == 1
    assert quiet.jumps == ()


@pytest.mark.parametrize("first", [-0.0167, -0.011813])
def test_a_load_that_only_arc_length_reaches_is_reached(first):
    """Under a weak dipole the nearly flat membrane has two limit points whose pressures differ by 7e-7. Steps of pressure that came past
    or between them end in tiny steps; the branch itself goes on to P = 0 without a turn, where the cold start finds the same state."""
    scene = disc_scene(OGDEN, (200.0, 6.5), elements=16)
    reached = fm.pressurize(scene, pressures=[first, 0.0], solver="newton")[-1]
    assert reached.volume == pytest.approx(fm.equilibrium(scene, pressure=0.0).volume, rel=1e-9)
    assert reached.verdict("pressure").stable is True


def test_hysteresis_loop():
    """Up, the disc snaps at P = 1.899085; down, at 1.490989; in between both branches are held."""
    rising = np.linspace(1.4, 2.0, 13)
    branch = fm.pressurize(disc_scene(OGDEN), pressures=[*rising, *rising[::-1]], at_limit="jump")
    assert len(branch) == 26
    assert [jump.limit.pressure for jump in branch.jumps] == pytest.approx([1.899084863, 1.490989189], rel=1e-6)
    up, down = branch.jumps
    assert (branch[up.index].pressure, branch[up.index - 1].pressure) == pytest.approx((1.9, 1.85))
    assert (branch[down.index].pressure, branch[down.index - 1].pressure) == pytest.approx((1.45, 1.5))
    assert up.landing.energy - up.landing.pressure * up.landing.volume < up.limit.equilibrium.energy - 1.9 * up.limit.volume
    assert all(eq.verdict("pressure").stable for eq in branch)
    assert branch[0].volume == pytest.approx(branch[-1].volume, rel=1e-9)


def test_beyond_the_last_volume_fold():
    """V = 83 with M = 200, h = 6.5 lies beyond the fold at V = 82.74807 (tests/data/disc.json): no equilibrium, from near or from afar."""
    scene = disc_scene(OGDEN, (200.0, 6.5))
    for seek in (lambda: fm.inflate(scene, volumes=[82.0, 83.0]), lambda: fm.equilibrium(scene, volume=83.0)):
        with pytest.raises(fm.SolveError, match=r"volume fold is P = 1\.93089.*V = 82\.748") as raised:
            seek()
        assert raised.value.status is fm.Status.NO_EQUILIBRIUM


def test_height_control_passes_a_volume_fold():
    scene = disc_scene(OGDEN, (200.0, 6.5), elements=32).replace(
        run=fm.Run(control="height", values=(4.7, 4.8, 4.9)), analysis=fm.Analysis(stability=("volume",))
    )
    branch = fm.run(scene)
    assert branch.column("center_height") == pytest.approx([4.7, 4.8, 4.9], rel=1e-12)
    assert branch.column("verdict_volume").tolist() == ["stable", "stable", "unstable"]


@pytest.mark.parametrize("arguments", [{}, {"pressure": 1.0, "volume": 1.0}, {"pressure": float("inf")}, {"volume": "1"}])
def test_bad_loads_are_named(arguments):
    with pytest.raises(fm.InputError):
        fm.equilibria(disc_scene(OGDEN, elements=4), **arguments)


def test_a_rate_that_hardly_changes_sign_is_no_failure():
    """Beside a contact a rate is flat around its zero, as (s - c)^9 is: what is found after bounded work is the answer, with its error."""
    place = 0.3141592653589793
    still = SimpleNamespace(correction=0.0)
    flat = SimpleNamespace(
        at=lambda s: SimpleNamespace(sigma=s, state=still, rate=lambda q: 1.0, value=lambda q: 0.0),
        problem=SimpleNamespace(units={"pressure": 1.0}),
        length=1.0,
    )
    share, located = Segment._root(flat, "limit_point", lambda point: (point.sigma - place) ** 9, 0.0, 1.0)
    assert share == pytest.approx(place, abs=1e-3)
    assert located.kind == "limit_point"
