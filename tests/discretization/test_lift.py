"""Ends that are held where they do not rest: states of others, closed forms, and what the membrane is without load."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.accuracy.collocation import collocate
from femmembrane.accuracy.shooting import shoot
from femmembrane.accuracy.strong_form import Guess
from femmembrane.errors import InputError, SolveError, Status
from tests.cases import OGDEN, effect

NH = fm.NeoHookean()
SOLVERS = ("newton", "ipopt")
CONTROLS = ("pressure", "volume", "center_height")


def stretched(p: float, elements: int = 32, **options: Any) -> fm.Scene:
    return fm.Scene(material=NH, mesh=fm.disc(elements=elements), prestretch=p, **options)


def clamped(**place: float) -> dict[str, Any]:
    return {"kind": "clamped", **place}


@pytest.mark.parametrize(
    ("name", "scene"),
    [
        ("prestretch_1.5_neo", fm.Scene(material=NH, prestretch=1.5)),
        ("prestretch_1.3_dipole_above", fm.Scene(material=OGDEN, prestretch=1.3, sources=[fm.Dipole(200, 6.5)], susceptibility=2.5)),
    ],
)
def test_states_of_another_solver(name: str, scene: fm.Scene) -> None:
    """A spectral solver of others (data/effects.json), at given heights of the pole."""
    scene = scene.replace(mesh=fm.disc(elements=24), degree=6)
    for point in effect(name):
        eq = fm.equilibrium(scene, center_height=point["center_height"])
        for quantity in ("pressure", "volume"):
            assert getattr(eq, quantity) == pytest.approx(point[quantity], rel=1e-8)


@pytest.mark.parametrize("p", [1 + 1e-9, 1.01, 1.5, 1e3])
@pytest.mark.parametrize("n", [0, 1])
def test_a_stretched_disc_rings_as_a_drum(p: float, n: int) -> None:
    """Closed form: omega^2 = j^2 (1 - p^-6) across its plane, with j the first zero of the Bessel function J_n."""
    eq = fm.equilibrium(stretched(p).replace(degree=4), pressure=0.0)
    tension = -np.expm1(-6 * np.log1p(1e-9)) if p == 1 + 1e-9 else 1 - p**-6
    wanted = (2.404825557695773, 3.831705970207512)[n] ** 2 * tension
    found = [f.eigenvalue for f in eq.frequencies(azimuthal=n, count=4)]
    assert min(abs(value / wanted - 1) for value in found) < (1e-6 if p < 1.001 else 1e-9)


def test_a_drum_of_stretch_three_halves() -> None:
    eq = fm.equilibrium(stretched(1.5).replace(degree=4), pressure=0.0)
    assert eq.frequencies(count=1)[0].eigenvalue == pytest.approx(5.275471420, rel=1e-9)
    across = [f.eigenvalue for f in eq.frequencies(azimuthal=1, count=2)]
    assert across[1] == pytest.approx(13.393018487, rel=1e-9)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("held", CONTROLS)
@pytest.mark.parametrize("p", [1 + 1e-9, 1.5, 1e3])
def test_flat_under_tension_is_a_state_with_stiffness(p: float, held: str, solver: str) -> None:
    eq = fm.equilibrium(stretched(p), **{held: 0.0}, solver=solver)
    assert eq.status is Status.CONVERGED
    assert max(abs(eq.volume) / p**3, abs(eq.pressure) * p, abs(eq.center_height) / p) < 1e-14
    assert [eq.verdict(c).stable for c in ("pressure", "volume")] == [True, True]
    assert eq.verdict(azimuthal=1).stable is True
    # closed form: W = (2 p^2 + p^-4 - 3)/2 times the area pi; next to p = 1 it is 6 pi (p - 1)^2
    wanted = np.pi / 2 * (2 * p**2 + p**-4 - 3) if p > 1.1 else 6 * np.pi * (p - 1) ** 2
    assert eq.energy == pytest.approx(wanted, rel=1e-12 if p > 1.1 else 1e-6)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("verb", [(fm.inflate, "volumes"), (fm.pressurize, "pressures")])
def test_a_run_passes_the_flat_state(verb: tuple[Any, str], solver: str) -> None:
    run, loads = verb
    branch = run(stretched(1.5), **{loads: [0.0, 0.4, 0.0, -0.4]}, solver=solver)
    assert [eq.status for eq in branch] == [Status.CONVERGED] * 4
    flat, up, again, down = branch
    assert abs(flat.volume) + abs(again.volume) + abs(flat.pressure) + abs(again.pressure) < 1e-12
    assert (down.volume, down.pressure) == pytest.approx((-up.volume, -up.pressure), rel=1e-10)


@pytest.mark.parametrize("start", [-2.0, 0.0])
def test_a_trace_passes_the_flat_state(start: float) -> None:
    branch = fm.trace(stretched(1.5), start=start, until={"volume": 2.0})
    assert branch[-1].volume == pytest.approx(2.0, rel=1e-12)
    assert branch.special_points == ()
    assert branch[0].volume == pytest.approx(start, abs=1e-14)
    assert len(branch) < 20


def test_a_trace_starts_from_the_tension_without_load() -> None:
    assert fm.trace(stretched(1.5), max_steps=1)[0].volume == 0
    assert fm.trace(stretched(0.8), max_steps=1)[0].volume == pytest.approx(0.5)  # a dome: flat it is compressed


def test_each_state_is_found_once() -> None:
    found = fm.equilibria(stretched(1.5), pressure=0.0)
    assert [eq.volume for eq in found] == pytest.approx([0.0], abs=1e-12)


def test_a_small_load_lifts_in_proportion() -> None:
    """Closed form of a drum: V = P pi/(8 T) with the tension T = (1 - p^-6) per reference length, at the pole w = P p^2/(4 T)."""
    p, load = 1.5, 1e-7
    eq = fm.equilibrium(stretched(p), pressure=load)
    tension = 1 - p**-6
    assert eq.center_height == pytest.approx(load * p**2 / (4 * tension), rel=1e-8)
    assert eq.volume == pytest.approx(load * np.pi * p**4 / (8 * tension), rel=1e-8)


@pytest.mark.parametrize("ends", ["mirror", "radial"])
@pytest.mark.parametrize("pressure", [0.0, 0.3])
def test_a_uniform_tube(ends: str, pressure: float) -> None:
    """Closed form: l1 = p, and W2 = P l1 l2 is l2 - 1/(p^2 l2^3) = P p l2. No displacement is left beside the stretch along the axis."""
    p = 1.5
    scene = fm.Scene(material=NH, mesh=fm.cylinder(2.0, elements=16, top=ends, bottom=ends), prestretch=p)
    eq = fm.equilibrium(scene, pressure=pressure)
    l2 = (p**2 * (1 - pressure * p)) ** -0.25
    assert eq.volume == pytest.approx(np.pi * l2**2 * 2 * p, rel=1e-12)
    assert (eq.status, eq.verdict("pressure").stable, eq.verdict(azimuthal=1).stable) == (Status.CONVERGED, True, True)
    profile = eq.profile()
    np.testing.assert_allclose(profile["stretch_1"], p, rtol=1e-12)
    np.testing.assert_allclose(profile["stretch_2"], l2, rtol=1e-12)


def test_an_annulus_stretched_flat() -> None:
    """With both edges held it is stretched evenly; a free inner edge carries no stress, and the energy falls."""
    held = fm.Scene(material=NH, mesh=fm.annulus(0.4, elements=32, inner="clamped"), prestretch=1.5)
    even = fm.equilibrium(held, pressure=0.0)
    assert even.energy == pytest.approx(np.pi * (1 - 0.4**2) / 2 * (2 * 1.5**2 + 1.5**-4 - 3), rel=1e-12)
    free = fm.equilibrium(held.replace(mesh=fm.annulus(0.4, elements=32, inner="free"), degree=4), pressure=0.0)
    l1, l2 = (free.profile()[name][0] for name in ("stretch_1", "stretch_2"))
    assert l1 == pytest.approx(l2**-0.5, rel=1e-6)  # simple tension around the edge
    assert free.energy < even.energy
    for eq in (even, free):
        assert abs(eq.profile()["eta"]).max() == 0
        assert (eq.status, eq.verdict("volume").stable, eq.verdict(azimuthal=2).stable) == (Status.CONVERGED, True, True)


@pytest.mark.parametrize(
    "mesh",
    [
        fm.disc(elements=32, rim=clamped(radius=1.2, height=0.3)),
        fm.annulus(0.4, elements=32, inner=clamped(height=1.0)),
        fm.annulus(0.4, elements=32, inner=clamped(height=1e-4)),
        fm.cylinder(2.0, elements=32, top=clamped(radius=2.0, height=3.0)),
        fm.cylinder(2.0, elements=32, top=clamped(height=9.0)),
        fm.cap(0.5, elements=32, rim=clamped(radius=1.3)),
    ],
)
def test_any_shape_starts_from_its_tension(mesh: Any) -> None:
    scene = fm.Scene(material=NH, mesh=mesh)
    eq = fm.equilibrium(scene, pressure=0.0)
    assert (eq.status, eq.pressure, eq.verdict("pressure").stable) == (Status.CONVERGED, 0.0, True)
    more = fm.equilibrium(scene, volume=eq.volume + 0.05)
    assert more.pressure > 0
    assert fm.equilibrium(scene, pressure=more.pressure).volume == pytest.approx(more.volume, rel=1e-8)


@pytest.mark.parametrize("height", [0.3, -2.0])
def test_a_raised_rim_raises_the_membrane(height: float) -> None:
    """Without stretch it is the ordinary disc at another height, without stiffness when flat; runs pass that state to the other side."""
    low, high = (fm.Scene(material=NH, mesh=fm.disc(elements=32, rim=rim)) for rim in ("clamped", clamped(height=height)))
    for held in ({"volume": 0.5}, {"pressure": 1.0}, {"volume": 1e-9}):
        below, above = fm.equilibrium(low, **held), fm.equilibrium(high, **held)
        assert (above.volume, above.pressure) == pytest.approx((below.volume, below.pressure), rel=1e-9)
        assert above.center_height - height == pytest.approx(below.center_height, rel=1e-9, abs=1e-15)
    branch = fm.run(high.replace(run=fm.Run(control="height", values=[height + 0.5, height, height - 0.5])))
    assert [eq.volume for eq in branch] == pytest.approx([branch[0].volume, 0.0, -branch[0].volume], rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("held", CONTROLS)
def test_flat_and_pushed_together_it_is_compressed(held: str) -> None:
    scene = stretched(0.8)
    eq = fm.equilibrium(scene, **{held: 0.0}, solver="newton")
    assert (eq.status, eq.volume, eq.center_height) == (Status.LEGENDRE_FAILURE, 0.0, 0.0)
    relaxed = fm.equilibrium(scene.replace(tension_field=True), **{held: 0.0}, solver="newton")
    assert relaxed.status is Status.SLACK


def test_the_minimiser_says_that_it_is_compressed() -> None:
    with pytest.raises(SolveError, match="meridional stress is compressive") as error:
        fm.equilibrium(stretched(0.8), volume=0.0, solver="ipopt")
    assert error.value.status is Status.LEGENDRE_FAILURE


@pytest.mark.parametrize(
    ("scene", "volume"),
    [
        (stretched(1.5).replace(degree=6), 1.0),
        (stretched(0.8).replace(degree=6), 1.0),
        (
            fm.Scene(
                material=OGDEN,
                degree=6,
                mesh=fm.disc(elements=32, rim=clamped(radius=1.2, height=0.3)),
                sources=[fm.Dipole(200, 6.5)],
                susceptibility=2.5,
            ),
            1.0,
        ),
    ],
)
def test_shooting_and_collocation_meet_the_rim_where_it_is(scene: fm.Scene, volume: float) -> None:
    eq = fm.equilibrium(scene, volume=volume)
    near = Guess(eq.pressure * 1.01, eq.center_height * 1.01, Guess.of(eq).stretch, eq.profile())
    for solve, within in ((shoot, 1e-10), (collocate, 1e-8)):
        found = solve(scene, guess=near, volume=volume)
        assert found.converged
        assert (found.pressure, found.center_height) == pytest.approx((eq.pressure, eq.center_height), rel=within)
        assert found.elastic_energy == pytest.approx(eq.elastic_energy, rel=within)


@pytest.mark.parametrize(("volume", "count"), [(1.0, 0), (30.0, 1)])
def test_jacobi_counts_with_the_rim_where_it_is(volume: float, count: int) -> None:
    for mesh, p in ((fm.disc(elements=32), 1.5), (fm.disc(elements=32, rim=clamped(radius=1.5)), 1.0)):
        eq = fm.equilibrium(fm.Scene(material=NH, mesh=mesh, prestretch=p), volume=volume)
        assert len(fm.jacobi_test(eq).conjugate_points) == count
        assert eq.verdict("pressure").stable is (count == 0)


def test_a_mesh_chosen_for_an_accuracy() -> None:
    fine = fm.equilibrium(stretched(1.5, elements=64).replace(degree=6), pressure=0.5)
    eq = fm.equilibrium(fm.Scene(material=NH, mesh=fm.disc(accuracy=1e-8), prestretch=1.5), pressure=0.5)
    assert eq.volume == pytest.approx(fine.volume, rel=1e-8)
    estimate = fm.equilibrium(stretched(1.5, elements=16), pressure=0.5)
    error = fine.volume - estimate.volume
    assert fm.equilibrium(stretched(1.5, elements=16), center_height=fine.center_height).pressure == pytest.approx(0.5, rel=1e-5)
    assert 0 < abs(error) < 1e-5


@pytest.mark.parametrize("p", [1.5, 3.0, 30.0])
def test_limit_pressure_over_prestretch(p: float) -> None:
    """Limit: a far stretched neo-Hookean disc has the same tension everywhere and in every direction, mu T per length, as a soap film. It
    bulges into spherical caps, and bears most as a half sphere: P p = 2 at V = 2 pi p^3/3, but for terms in p^-6. Shooting says the same.
    """
    scene = stretched(p).replace(degree=4)
    (peak,) = fm.trace(scene, until={"volume": 20 * p**3}).special_points or ()
    assert peak.kind == "limit_point"
    peak = peak.equilibrium
    assert peak.pressure * p == pytest.approx(2, rel=0.1 * p**-6 + 1e-9)
    assert peak.volume == pytest.approx(2 * np.pi / 3 * p**3, rel=0.5 * p**-6 + 1e-6)
    known = shoot(scene, guess=Guess.of(peak), volume=peak.volume)
    assert known.converged
    assert peak.pressure == pytest.approx(known.pressure, rel=1e-8)


@pytest.mark.parametrize(
    ("change", "key", "words"),
    [
        ({"prestretch": 0.0}, "membrane.prestretch", "> 0"),
        ({"prestretch": -1.5}, "membrane.prestretch", "> 0"),
        ({"prestretch": float("nan")}, "membrane.prestretch", "finite"),
        ({"prestretch": True}, "membrane.prestretch", "finite"),
        ({"prestretch": 1.5, "mesh": fm.sphere()}, "membrane.prestretch", "flat shapes and tubes"),
        ({"prestretch": 1.5, "mesh": fm.annulus(0.4, inner="free", outer="radial")}, "membrane.prestretch", "no edge is held"),
        ({"prestretch": 1.5, "mesh": fm.cylinder(2.0, top="free")}, "membrane.prestretch", "both ends"),
        ({"prestretch": 1.5, "mesh": fm.disc(rim=clamped(radius=1.2))}, "membrane.prestretch", "not together"),
    ],
)
def test_what_cannot_be_stretched(change: dict[str, Any], key: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as error:
        fm.Scene(material=NH, **change)
    assert error.value.args[0].startswith(key) or key in str(error.value)


@pytest.mark.parametrize(
    ("end", "key", "words"),
    [
        (clamped(radius=0.0), "mesh.top.radius", "> 0"),
        (clamped(radius=-1.0), "mesh.top.radius", "> 0"),
        (clamped(height=float("inf")), "mesh.top.height", "finite"),
        (clamped(z=1.0), "mesh.top.z", "unknown"),
        ({"kind": "mirror", "radius": 1.2}, "mesh.top.radius", "not held there"),
        ({"kind": "free", "height": 1.2}, "mesh.top.height", "not held there"),
        ({"kind": "hub", "height": 1.2}, "mesh.top.height", "not held there"),
        ({"radius": 1.2}, "mesh.top.kind", "missing"),
        (5, "mesh.top", "clamped"),
    ],
)
def test_where_no_end_can_be_held(end: Any, key: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as error:
        fm.cylinder(2.0, top=end)
    assert key in str(error.value)
