"""Koiter's coefficient at azimuthal onsets: third and fourth derivatives, and what they say."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.potential import potential_of
from femmembrane.potential.surface import SurfaceSeries
from femmembrane.solve.banded import band_inner
from femmembrane.stability.postbuckling import postbuckling

RUBBER = fm.Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0))
DIPOLE = fm.Dipole(strength=600, height=-3.5)


def tipping(elements: int = 8, degree: int = 6) -> fm.Scene:
    asked = fm.Analysis(azimuthal_modes=(1,))
    return fm.Scene(material=RUBBER, sources=[DIPOLE], susceptibility=2.5, mesh=fm.disc(elements), degree=degree, analysis=asked)


def onset_of(scene: fm.Scene, **asked: Any) -> fm.SpecialPoint:
    branch = fm.trace(scene, **asked)
    return next(point for point in branch.special_points or () if point.kind == "azimuthal_onset")


@pytest.fixture(scope="module")
def tipped() -> fm.SpecialPoint:
    return onset_of(tipping(), start=0.5, direction=-1, until={"center_height": 0.3})


SCENES: dict[str, dict[str, Any]] = {
    "plain": {},
    "hydrostatic": {"loads": [fm.Hydrostatic(0.4), fm.Weight(0.2)]},
    "uneven": {"thickness": "1 - 0.3*R**2", "modulus": "1 + 0.2*R"},
    "voltage": {"electric": fm.Electric(voltage=0.3)},
    "frozen charge": {"electric": fm.Electric(frozen_charge=0.5)},
    "dipole": {"sources": [fm.Dipole(60.0, -2.5)], "susceptibility": 1.5},
    "saturating loop": {"sources": [fm.Loop(20.0, -1.5, 0.8)], "susceptibility": 1.5, "saturation": 2.0},
    "magnet": {"sources": [fm.Magnet(height=-2.0, radius=0.5, length=0.5, strength=5.0)], "susceptibility": 1.5},
    "compressible": {"material": fm.Hooke(0.3)},
    "pre-stretched": {"prestretch": 1.3},
    "cap": {"mesh": fm.cap(0.4, 8)},
    "annulus": {"mesh": fm.annulus(0.3, 8)},
}


def scene_of(name: str) -> fm.Scene:
    return fm.Scene(**{"material": RUBBER, "mesh": fm.disc(8), "degree": 4, **SCENES[name]})


@pytest.mark.parametrize("name", SCENES)
def test_third_derivatives_give_the_change_of_eigenvalues_with_the_volume(name: str) -> None:
    # d lambda/dV = U3[f, f, dx/dV] - dP/dV V''[f, f], against differences of the eigenvalues themselves
    scene = scene_of(name)
    middle = fm.equilibrium(scene, volume=1.5)
    e = 2e-4
    states = [fm.equilibrium(scene, volume=1.5 + k * e, start=middle) for k in (-1, 1)]
    for n in (1, 2):
        lower, upper = (state.verdict(azimuthal=n).smallest_eigenvalue for state in states)
        found = postbuckling(middle.potential, middle.state, middle.pressure, n)
        assert found.reason == ""
        assert found.slope == pytest.approx((upper - lower) / (2 * e), rel=2e-5, abs=2e-6)


@pytest.mark.parametrize("name", [name for name in SCENES if name != "annulus"])  # waves do not move its lid, this displacement does
def test_fourth_derivatives_of_the_surface_are_those_of_the_axisymmetric_potential(name: str) -> None:
    # along a displacement without waves; differences of its exact second derivatives
    scene = scene_of(name)
    eq = fm.equilibrium(scene, volume=1.0)
    potential, space = eq.potential, eq.potential.space
    rho = np.sin(np.pi * np.linspace(0, 1, eq.state.size))
    y = 0.1 * (rho + 0.5 * rho[::-1] ** 2) / (1 + np.arange(rho.size) % 3)
    u, u_x, w, w_x = space.at_quadrature(y).reshape(4, *space.R.shape)
    zero = np.zeros_like(u)
    direction = np.stack([u, zero, w, u_x, zero, w_x, zero, u, zero])[:, None]
    fourth, third, _ = SurfaceSeries(potential, eq.state, eq.pressure).along(direction)
    gradient = third[:, 0]
    density = np.stack([gradient[0] + gradient[7], gradient[3], gradient[2], gradient[5]])
    vector = space.assemble_vector(density.reshape(-1, space.n_elements))

    def second(t: float) -> float:
        return band_inner(potential.evaluate(eq.state + t * y, eq.pressure).band, space.half_bandwidth, y, y)

    e = 5e-3
    values = [second(k * e) for k in (-2, -1, 0, 1, 2)]
    slope = (values[0] - 8 * values[1] + 8 * values[3] - values[4]) / (12 * e)
    curvature = (-values[0] + 16 * values[1] - 30 * values[2] + 16 * values[3] - values[4]) / (12 * e * e)
    assert float(vector @ y) == pytest.approx(slope, rel=1e-4)
    assert float(fourth.sum()) == pytest.approx(curvature, rel=1e-3)


def test_differences_of_second_derivatives_are_as_good_as_formulas() -> None:
    from femmembrane.potential.surface import Expansions

    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(8), sources=[fm.Dipole(60.0, -2.5)], susceptibility=1.5)
    found = Expansions(potential_of(scene))
    rho, eta = np.linspace(1e-4, 1.0, 20), np.linspace(0.5, 0.0, 20)
    exact, near = found.position(rho, eta)[0], found._from_second_derivatives(rho, eta)
    assert (np.abs(near - exact).max(axis=1) < 1e-9 * np.abs(exact).max(axis=1)).all()


def test_tipping_over_beneath_a_strong_dipole_is_a_jump_at_a_held_volume(tipped: fm.SpecialPoint) -> None:
    # an independent three-dimensional membrane code finds the tipped states on the stable side of the onset, V > 0.4479
    assert (tipped.azimuthal, round(tipped.center_height, 3), round(tipped.volume, 4)) == (1, 0.312, 0.4479)
    after = tipped.postbuckling
    assert after.kind == "subcritical"
    assert after.coefficient == pytest.approx(-43.1787, abs=2e-4)  # recorded 2026-11-28; 16 elements of degree 6 agree
    assert after.slope > 0  # stable above
    assert np.isnan(after.amplitude(-1e-3))
    assert after.amplitude(1e-3) == pytest.approx(np.sqrt(after.slope * 1e-3 / (4 * -after.coefficient)))
    assert "jump" in after.words


def test_at_a_held_pressure_the_same_onset_is_gradual(tipped: fm.SpecialPoint) -> None:
    after = tipped.postbuckling.held("pressure")
    assert after.kind == "supercritical"
    assert after.coefficient == pytest.approx(41.895, abs=2e-3)  # recorded 2026-11-28
    assert after.reduction(1e-3) == 0.0
    with pytest.raises(fm.InputError, match="control"):
        tipped.postbuckling.held("gas")


def test_the_coefficient_converges(tipped: fm.SpecialPoint) -> None:
    finer = onset_of(tipping(12, 6), start=0.5, direction=-1, until={"center_height": 0.3})
    assert finer.postbuckling.coefficient == pytest.approx(tipped.postbuckling.coefficient, rel=1e-6)
    coarse = onset_of(tipping(32, 2), start=0.5, direction=-1, until={"center_height": 0.3})
    assert coarse.postbuckling.coefficient == pytest.approx(tipped.postbuckling.coefficient, rel=1e-3)


def test_a_gas_is_a_spring_between_volume_and_pressure(tipped: fm.SpecialPoint) -> None:
    # b = b_P + (b_V - b_P) Y/(Y + c) with Y = dV/dP of the branch and c = -dV/dP of the gas: elimination of one constraint
    eq = tipped.equilibrium
    volume, pressure = (tipped.postbuckling.held(c) for c in ("volume", "pressure"))
    rate = pressure.slope / volume.slope
    for chamber in (1e-3, 1.0, 1e3):
        gas = fm.Gas((eq.pressure + 1.0) * (eq.volume + chamber), chamber, 1.0)
        found = postbuckling(eq.potential, eq.state, eq.pressure, 1, gas).held("gas")
        softness = gas.compliance(eq.volume)
        expected = pressure.coefficient + (volume.coefficient - pressure.coefficient) * rate / (rate + softness)
        assert found.coefficient == pytest.approx(expected, rel=1e-7)
        # the amount grows by (P + P_atm) dV + (V + V_0) dP
        assert found.slope == pytest.approx(pressure.slope / ((eq.pressure + 1.0) * rate + eq.volume + chamber), rel=1e-7)


def test_a_pear_costs_the_same_in_any_direction() -> None:
    # on a sphere b of the onset with n = 1 follows from the branch of axisymmetric pears, V - V0 = -4 b/(d lambda/dV) xi^2
    scene = fm.Scene(material=RUBBER, mesh=fm.sphere(16), degree=4, analysis=fm.Analysis(azimuthal_modes=(1,)))
    branch = fm.trace(scene, until={"volume": 30.0})
    point, onset = (next(p for p in branch.special_points or () if p.kind == kind) for kind in ("branch_point", "azimuthal_onset"))
    steps = fm.StepControl(first=0.01, largest=0.02)
    plain = scene.replace(analysis=fm.Analysis())
    pears = fm.trace(plain, start=point, max_steps=3, steps=steps, special_points=False)[1:]
    potential, space = point.equilibrium.potential, point.equilibrium.potential.space
    assert potential.rigid is not None
    ratios: dict[str, list[float]] = {"volume": [], "pressure": []}
    squares = []
    for pear in pears:
        moved = pear.state - point.equilibrium.state
        squares.append(band_inner(potential.mass, space.half_bandwidth, moved, moved) - float(potential.rigid[:, 0] @ moved) ** 2)
        for name, ratio in ratios.items():
            ratio.append((getattr(pear, name) - getattr(point, name)) / squares[-1])
    for name, ratio in ratios.items():
        after = onset.postbuckling.held(name)
        at_onset = np.polyval(np.polyfit(squares, ratio, 2), 0.0)
        assert -4 * after.coefficient / after.slope == pytest.approx(at_onset, rel=1e-4)
        assert after.kind == "supercritical"


def test_what_is_not_known_is_said(tipped: fm.SpecialPoint) -> None:
    eq = tipped.equilibrium
    relaxed = potential_of(eq.scene.replace(tension_field=True))
    found = postbuckling(relaxed, eq.state, eq.pressure, 1)
    assert (found.kind, found.reason[:18]) == ("unknown", "the relaxed energy")
    assert np.isnan(found.coefficient)
    assert "not known" in found.words
    sloped = potential_of(eq.scene.replace(demagnetization=True))
    assert "slope" in postbuckling(sloped, eq.state, eq.pressure, 1).reason
    bent = potential_of(eq.scene.replace(bending=True, radius_to_thickness=1000.0))
    assert "bending" in postbuckling(bent, eq.state, eq.pressure, 1).reason
    charged = potential_of(eq.scene.replace(electric=fm.Electric(total_charge=0.1)))
    assert "total charge" in postbuckling(charged, eq.state, eq.pressure, 1).reason


def test_two_modes_at_once_are_refused(tipped: fm.SpecialPoint, monkeypatch: pytest.MonkeyPatch) -> None:
    eq = tipped.equilibrium
    from femmembrane.stability import postbuckling as module

    monkeypatch.setattr(module, "_NEAR", 1.0)  # all that is softer than the terms of the mode counts as zero
    assert "two modes with n = 1" in postbuckling(eq.potential, eq.state, eq.pressure, 1).reason


def test_a_sphere_with_all_its_modes_of_one_degree_at_once_is_refused() -> None:
    # its second-degree modes with n = 0, 1, 2 set in together, and have a cubic term; so do those of the third degree, without one
    scene = fm.Scene(material=fm.Varga(), mesh=fm.sphere(12), degree=4, analysis=fm.Analysis(azimuthal_modes=(1, 2, 3)))
    found = {p.azimuthal: p for p in fm.trace(scene, until={"volume": 60.0}).special_points or () if p.azimuthal}
    assert found[1].postbuckling.kind == "subcritical"  # pears of one direction are as good as those of any other
    for n in (2, 3):
        assert found[n].postbuckling.kind == "unknown"
        assert f"modes with n = {n} and n = {n - 1} set in at once" in found[n].postbuckling.reason


def test_only_onsets_have_a_coefficient() -> None:
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(8))
    limit = (fm.trace(scene, until={"volume": 4.0}).special_points or ())[0]
    with pytest.raises(fm.InputError, match="azimuthal_onset is allowed"):
        _ = limit.postbuckling


def test_tables_pages_and_pictures_say_it(tipped: fm.SpecialPoint, tmp_path: Any) -> None:
    branch = fm.trace(tipping(), start=0.5, direction=-1, until={"center_height": 0.3})
    from femmembrane.results.table import special_point_columns, special_point_rows

    rows = [dict(zip(special_point_columns(branch), row, strict=True)) for row in special_point_rows(branch)]
    (row,) = (row for row in rows if row["kind"] == "azimuthal_onset")
    assert (row["postbuckling"], round(row["postbuckling_coefficient"], 2)) == ("subcritical", -43.18)
    assert all(other["postbuckling"] == "" for other in rows if other is not row)
    axes = branch.plot()
    (line,) = (line for line in axes.lines if "azimuthal onset" in str(line.get_label()))
    assert line.get_label() == "azimuthal onset, subcritical"
    assert line.get_markerfacecolor() == "black"
    branch.report(tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert "azimuthal onset, n = 1, subcritical" in page
    assert "stable against small perturbations only" in page


def test_a_branch_from_a_file_has_it_as_well(tmp_path: Any) -> None:
    branch = fm.trace(tipping(), start=0.5, direction=-1, until={"center_height": 0.3})
    branch.save(tmp_path / "branch.nc")
    found, known = (next(p for p in b.special_points or () if p.azimuthal).postbuckling for b in (fm.load(tmp_path / "branch.nc"), branch))
    assert found.coefficient == pytest.approx(known.coefficient, rel=1e-9)


def test_an_onset_over_a_number_of_the_scene() -> None:
    # let down at a held volume the dipole tips the membrane over: the same jump as along the volume
    ways: dict[str, Any] = {"over": "source.0.height", "hold": {"volume": 0.47}, "until": {"source.0.height": -3.46}}
    point = onset_of(tipping(), start=0.47, **ways)
    assert point.number == pytest.approx(-3.48, abs=0.02)
    assert point.postbuckling.kind == "subcritical"


def test_nothing_is_built_until_it_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    from femmembrane.results import door

    def refuse(*_: object) -> None:
        raise AssertionError

    monkeypatch.setattr(door, "postbuckling", refuse)
    assert onset_of(tipping(), start=0.5, direction=-1, until={"center_height": 0.3}).azimuthal == 1
