"""Convergence studies: orders, absolute errors, honest floors, extrapolation, what is written, and the command."""

from __future__ import annotations

import csv
import math
import pickle
from functools import cache

import numpy as np
import pytest

import femmembrane as fm
from femmembrane import cli
from femmembrane.accuracy.convergence import profile_norms
from femmembrane.results.convergence import COLUMNS, PROFILES, RESOLVED, observed_orders, richardson
from tests.cases import POINTS, SPECIAL_POINTS, disc_scene

BY_NAME = {point.name: point for point in POINTS}
#: without a source, with the dipole above, with the strong dipole below
SMOOTH = ("ogden_disc-4", "dipole_above-0.5", "dipole_below-0.5")


@cache
def study(name: str) -> fm.Convergence:
    return fm.convergence(BY_NAME[name].scene, volume=BY_NAME[name].expected["volume"])


def fitted(errors: np.ndarray, elements: tuple[int, ...]) -> float:
    return -float(np.polyfit(np.log(elements), np.log(errors), 1)[0])


# --- against theory and the reference tables


@pytest.mark.parametrize("quantity", ["pressure", "elastic_energy", "magnetic_energy", "energy", "lambda_pressure", "lambda_volume"])
@pytest.mark.parametrize("name", SMOOTH)
def test_values_converge_at_twice_the_degree(name, quantity):
    found = study(name)
    if quantity == "magnetic_energy" and not found.scene.sources:
        assert quantity not in found.quantities
        return
    for degree, orders, resolved in zip(found.degrees, found.orders(quantity), found.resolved(quantity), strict=True):
        known = orders[np.isfinite(orders)]
        assert np.isfinite(orders).sum() == max(resolved.sum() - 1, 0)
        if degree < 3:
            assert known[-1] == pytest.approx(2 * degree, abs=0.15)
        elif known.size > 1:  # with 8 elements degrees 3 and 4 are not yet at their order below the strong dipole
            assert known[-1] == pytest.approx(2 * degree, abs=0.6)


@pytest.mark.parametrize(("norm", "more"), [("profile_l2", 1), ("profile_h1", 0)])
@pytest.mark.parametrize("name", SMOOTH)
def test_profiles_converge_at_the_order_of_their_norm(name, norm, more):
    """p + 1 in L2 and p in H1."""
    found = study(name)
    for degree, errors in zip(found.degrees, found.errors[norm], strict=True):
        # the finest mesh of degree 4 is at round-off in L2
        assert fitted(errors[1:3], found.elements[1:3]) == pytest.approx(degree + more, abs=0.3)


@pytest.mark.parametrize("name", SMOOTH)
def test_errors_are_those_against_the_reference_table(name):
    """Measured against an independent spectral solver (data/README.md, good to 1e-11) instead of the study's own reference."""
    found, expected = study(name), dict(BY_NAME[name].expected)
    expected["energy"] = expected["elastic_energy"] + expected["magnetic_energy"]
    for quantity in ("pressure", "energy", "lambda_pressure", "lambda_volume", "elastic_energy"):
        exact = np.abs(found.values[quantity] / expected[quantity] - 1)
        assert found.errors[quantity] == pytest.approx(exact, rel=1e-3, abs=2e-11)
        assert found.reference[quantity] == pytest.approx(expected[quantity], rel=2e-11)
        assert found.floors[quantity] < 1e-12
    assert found.errors["pressure"][1, 3] < 5e-8  # 64 quadratic elements; recorded on 2026-11-24: 3.7e-8 at the most


@pytest.mark.parametrize("quantity", ["pressure", "energy", "lambda_volume"])
@pytest.mark.parametrize("name", SMOOTH)
def test_extrapolated_values_keep_their_promise(name, quantity):
    """They know nothing of the reference; they are at least ten times closer to it than the finest mesh, and within their own error."""
    found = study(name)
    values, errors = found.extrapolated(quantity)
    for i, degree in enumerate(found.degrees[:3]):
        off = abs(values[i] - found.reference[quantity]) / found.scale[quantity]
        assert off < max(2 * errors[i] / found.scale[quantity], 1e-12)
        if degree < 3:
            assert off < 0.1 * found.errors[quantity][i, -1]


def test_errors_below_the_floor_are_not_resolved_and_have_no_order():
    """The reference of its own kind: what it is measured against is itself."""
    found = fm.convergence(disc_scene(), volume=2.0, degrees=(2, 8), elements=(16, 32))
    assert found.resolved("pressure").tolist() == [[True, True], [False, False]]
    assert np.isnan(found.orders("pressure")[1]).all()
    assert np.isfinite(found.orders("pressure")[0, 1])
    assert "<" in str(found).splitlines()[-10]


def test_the_floor_of_a_rough_problem_is_high():
    """Wrinkled zones end inside elements: errors of the reference are then far from round-off, and the floor says so."""
    scene = disc_scene(dipole=(400, -3.25)).replace(tension_field=True)
    start = fm.equilibrium(scene, center_height=0.5)
    found = fm.convergence(scene, center_height=-0.1, degrees=(2,), elements=(16, 32), start=start)
    assert found.floors["pressure"] > 1e-9
    # 2.464635 in the table of demos/wrinkles.md
    assert found.reference["pressure"] == pytest.approx(2.464635, abs=max(5e-7, 10 * found.floors["pressure"] * 2.5))


@pytest.mark.parametrize("mesh", [fm.disc(16, ratio=0.1), fm.disc(radii=np.linspace(0, 1, 17) ** 1.5)])
def test_graded_meshes_keep_the_order(mesh):
    found = fm.convergence(disc_scene().replace(mesh=mesh), volume=2.0, degrees=(2,), elements=(16, 32, 64))
    assert found.orders("pressure")[0, 1:] == pytest.approx(4, abs=0.15)
    assert found.element_size[0] == pytest.approx(np.diff(mesh.breakpoints()).max(), rel=1e-12)


@pytest.mark.parametrize("ratio", [1, 0.01, 1e3])
def test_meshes_of_a_study_are_nested(ratio):
    mesh = fm.disc(20, ratio)
    assert mesh.with_elements(20) == mesh
    coarse, fine = (mesh.with_elements(n).breakpoints() for n in (16, 32))
    assert fine[::2] == pytest.approx(coarse, rel=1e-13)
    assert fm.disc(radii=mesh.breakpoints()).with_elements(40).breakpoints()[::2] == pytest.approx(mesh.breakpoints(), rel=1e-15)


def test_states_under_pressure_and_height_control():
    """Beyond the limit point of the disc: unstable under pressure, and found all the same."""
    point = BY_NAME["ogden_disc-2"]
    assert point.expected["lambda_pressure"] < 0
    near = fm.equilibrium(point.scene, volume=point.expected["volume"])
    for control in ("pressure", "center_height"):
        found = fm.convergence(point.scene, **{control: point.expected[control]}, degrees=(2,), elements=(16, 32), start=near)
        assert control not in found.quantities
        assert found.reference["volume"] == pytest.approx(point.expected["volume"], rel=1e-9)
        assert found.orders("volume")[0, 1] == pytest.approx(4, abs=0.3)


def test_a_study_survives_pickling():
    """Sent between processes, as a sweep does."""
    one = fm.convergence(disc_scene(elements=8), volume=1.0, degrees=(1, 2), elements=(4, 8))
    other = pickle.loads(pickle.dumps(one))
    assert str(other) == str(one)
    np.testing.assert_array_equal(other.errors["pressure"], one.errors["pressure"])


def test_first_limit_point():
    expected = next(p for p in SPECIAL_POINTS["ogden_disc"] if p["kind"] == "limit_point")
    scene = BY_NAME["ogden_disc-4"].scene
    found = fm.convergence(scene, volume=10.0, degrees=(1, 2), elements=(16, 32), limit_points=True)
    for quantity in ("pressure", "volume"):
        assert found.reference[f"limit_{quantity}"] == pytest.approx(expected[quantity], rel=1e-10)
        assert found.orders(f"limit_{quantity}")[:, 1] == pytest.approx([2, 4], abs=0.2)


def test_a_mesh_without_the_equilibrium_is_named():
    """Next to the last limit point of the dipole above 8 linear elements are too few (recorded on 2026-11-24)."""
    found = fm.convergence(
        BY_NAME["dipole_above-4.7"].scene, volume=BY_NAME["dipole_above-4.7"].expected["volume"], degrees=(1, 2), elements=(8, 16)
    )
    assert np.isnan(found.errors["pressure"]).tolist() == [[True, False], [False, False]]
    assert len(found.messages) == 1
    assert "8 elements of degree 1" in found.messages[0]
    assert found.messages[0] in str(found)


# --- the arithmetic


def test_orders_of_an_exact_power():
    elements = (8, 16, 48)
    assert observed_orders(3.0 * np.array(elements) ** -2.5, elements)[1:] == pytest.approx(2.5)
    assert np.isnan(observed_orders(np.array([1.0, np.nan, 0.0]), elements)).all()


@pytest.mark.parametrize("elements", [(8, 16, 32), (8, 12, 30), (4, 8, 16, 64)])
@pytest.mark.parametrize("order", [1.0, 2.0, 3.7])
def test_richardson_of_an_exact_power(order, elements):
    """v = 2 - 3 n^-q: the limit is 2."""
    value, error = richardson(2 - 3 * np.array(elements) ** -order, elements, degree=2)
    assert value == pytest.approx(2, abs=1e-11)
    assert error < 0.5


def test_richardson_without_an_order():
    assert richardson(np.array([1.0, 2.0, 1.0]), (1, 2, 4), 2) == (1.0, 1.0)
    assert richardson(np.array([1.0, 1.25]), (1, 2), 2) == (1.25, 0.25)
    assert richardson(np.array([np.nan, 1.0, np.nan]), (1, 2, 4), 2)[0] == 1.0
    assert math.isnan(richardson(np.full(3, np.nan), (1, 2, 4), 2)[0])


def test_profile_norms_of_polynomials():
    """The flat disc (rho, eta) = (r, 0): Int r^2 2 pi r dr = pi/2, and pi more for the slope; and w = 1 - r^2 on two unlike meshes."""
    from femmembrane.discretization.space import Space

    space, other = Space(fm.disc(3, ratio=7), 2), Space(fm.disc(5), 3)
    zero = np.zeros(space.n_free)
    assert profile_norms(space, zero) == pytest.approx((np.sqrt(np.pi / 2), np.sqrt(1.5 * np.pi)), rel=1e-14)
    s = other.interpolation_points()
    x = other.interpolate(np.zeros_like(s), 1 - s**2)
    # Int (1 - r^2)^2 2 pi r dr = pi/3, Int 4 r^2 2 pi r dr = 2 pi
    assert profile_norms(other, x, space, zero) == pytest.approx((np.sqrt(np.pi / 3), np.sqrt(np.pi * 7 / 3)), rel=1e-13)


# --- tables and pictures


def test_table_holds_every_number(tmp_path):
    found = study("dipole_above-0.5")
    found.write_csv(tmp_path / "convergence.csv")
    with (tmp_path / "convergence.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COLUMNS
    assert len(rows) == len(found.degrees) * len(found.elements) * len(found.quantities)
    row = next(r for r in rows if (r["degree"], r["elements"], r["quantity"]) == ("2", "64", "pressure"))
    assert float(row["error"]) == found.errors["pressure"][1, 3]
    assert float(row["value"]) == found.values["pressure"][1, 3]
    assert float(row["order"]) == found.orders("pressure")[1, 3]
    assert row["resolved"] == "True"
    assert int(row["unknowns"]) == 2 * (2 * 64 + 1) - 3
    frame = found.to_dataframe()
    assert list(frame.columns) == list(COLUMNS)
    assert frame[frame.quantity.isin(PROFILES)].value.isna().all()
    assert (frame.error[frame.resolved] > RESOLVED * frame.floor[frame.resolved]).all()


def test_failed_write_leaves_nothing(tmp_path):
    with pytest.raises(fm.InputError):
        study("dipole_above-0.5").write_csv(tmp_path / "none" / "convergence.csv")
    assert not list(tmp_path.iterdir())


def test_print_has_a_line_for_each_mesh():
    lines = str(study("dipole_above-0.5")).splitlines()
    assert sum(line[:9].split() == ["2", "64"] for line in lines) == 1
    assert max(map(len, lines)) <= 160
    assert lines[-1].startswith("lambda (V)")


@pytest.mark.parametrize("against", ["unknowns", "element_size"])
def test_picture(tmp_path, against):
    found = study("dipole_above-0.5")
    figure = found.plot(tmp_path / "convergence.png", against=against)
    assert (tmp_path / "convergence.png").stat().st_size > 20_000
    axes = figure.axes
    assert len(axes) == 4
    assert all(a.get_xscale() == a.get_yscale() == "log" and a.get_xlabel() for a in axes)
    lines = [line for line in axes[0].lines if line.get_linestyle() != "None"]
    assert len({line.get_marker() for line in lines}) == len(lines) == 4
    assert lines[1].get_ydata()[3] == found.errors["pressure"][1, 3]
    assert [text.get_text() for text in axes[0].texts][:2] == ["2.0", "4.0"]


# --- bad input


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        ({}, "convergence"),
        ({"volume": 1.0, "pressure": 1.0}, "convergence"),
        ({"volume": "1"}, "volume"),
        ({"volume": 1.0, "degrees": (2, 9)}, "degrees"),
        ({"volume": 1.0, "degrees": 2}, "degrees"),
        ({"volume": 1.0, "degrees": ()}, "degrees"),
        ({"volume": 1.0, "elements": (16, 8)}, "elements"),
        ({"volume": 1.0, "elements": (8.0, 16)}, "elements"),
        ({"volume": 1.0, "elements": (0, 16)}, "elements"),
        ({"volume": 1.0, "limit_points": 1}, "limit_points"),
        ({"volume": 1.0, "start": 0.5}, "start"),
    ],
)
def test_refused(arguments, key):
    with pytest.raises(fm.InputError) as caught:
        fm.convergence(disc_scene(elements=8), **arguments)
    assert caught.value.key == key


def test_unknown_names():
    found = study("dipole_above-0.5")
    for ask in (found.orders, found.extrapolated, lambda q: found.plot(quantities=[q])):
        with pytest.raises(fm.InputError, match="did you mean 'pressure'"):
            ask("presure")
    with pytest.raises(fm.InputError, match="unknowns"):
        found.plot(against="unknown")


# --- the command

SCENE = """
title = "small"
[material]
model = "neo-hookean"
[mesh]
elements = 16
[run]
"""


@pytest.mark.parametrize(
    ("run", "control", "load"),
    [
        ("values = [1.0, 2.0]", "volume", 2.0),
        ('control = "height"\nvalues = [0.5, 1.0]', "center_height", 1.0),
        ('control = "arc-length"\nstart = 0.5\nuntil = {pressure = 1.8}', "pressure", 1.8),
    ],
)
def test_command(tmp_path, capfd, run, control, load):
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    scene.write_text(SCENE + run + "\n", encoding="utf-8")
    assert cli.main(["convergence", str(scene), "--out", str(out), "--degrees", "1,2", "--elements", "8,16,32"]) == cli.DONE
    said = capfd.readouterr()
    assert "written:" in said.out
    assert said.err == ""
    assert {path.name for path in out.iterdir()} == {"convergence.csv", "convergence.png"}
    with (out / "convergence.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {(row["degree"], row["elements"]) for row in rows} == {(d, n) for d in "12" for n in ("8", "16", "32")}
    assert control not in {row["quantity"] for row in rows}
    material = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(32))
    near = fm.equilibrium(material, **{control: load})
    quantity = "volume" if control == "pressure" else "pressure"
    value = next(float(r["value"]) for r in rows if (r["degree"], r["elements"], r["quantity"]) == ("2", "32", quantity))
    assert value == pytest.approx(getattr(near, quantity), rel=1e-9)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--degrees", "2,1"], "--degrees = [2, 1]"),
        (["--degrees", "9"], "from 1 to 8"),
        (["--elements", "8,x"], "--elements = '8,x'"),
        (["--elements", ""], "--elements = ''"),
    ],
)
def test_bad_options(tmp_path, capsys, options, told):
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    scene.write_text(SCENE + "values = [1.0]\n", encoding="utf-8")
    assert cli.main(["convergence", str(scene), "--out", str(out), *options]) == cli.BAD_INPUT
    said = capsys.readouterr()
    assert told in said.err
    assert said.err.count("\n") == 1
    assert not out.exists()


def test_command_beyond_a_limit_point(tmp_path, capfd):
    """No equilibrium near P = 3: exit code 3, one line, nothing written."""
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    scene.write_text(SCENE + 'control = "pressure"\nvalues = [1.0, 3.0]\n', encoding="utf-8")
    assert cli.main(["convergence", str(scene), "--out", str(out)]) == cli.NOT_CONVERGED
    said = capfd.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert not out.exists()
