"""Special points followed over a grid: against curves whose extrema are known in closed form, and on branches."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.errors import InputError
from femmembrane.results.grid import dataset_of
from femmembrane.results.identities import followed, numbered_in_words, with_identities


@dataclass
class Row:
    values: dict[str, Any]
    status: str = "converged"
    message: str = ""
    seconds: float = 0.0


@dataclass
class Curve:
    """P(s) with V = s, given by the slope P'(s) as a polynomial."""

    slope: np.polynomial.Polynomial
    ends: tuple[float, float] = (-3.0, 3.0)
    roots: np.ndarray = field(init=False)

    def __post_init__(self):
        found = self.slope.roots()
        real = np.sort(found[np.abs(found.imag) < 1e-9].real)
        self.roots = real[(real > self.ends[0]) & (real < self.ends[1])]

    def row(self, **other) -> Row:
        pressure, s = self.slope.integ(), np.linspace(*self.ends, 41)
        values = {"volume": s, "pressure": pressure(s), "center_height": s / 2, "limit_points": len(self.roots)}
        values |= {"limit_volume": self.roots, "limit_pressure": pressure(self.roots), "limit_center_height": self.roots / 2}
        return Row(values, **other)


def grid(over, curve, drop=()):
    rows = [Row({}, "no equilibrium") if k in drop else curve(*values).row() for k, values in enumerate(product(*over.values()))]
    return dataset_of(over, rows, {})


def polynomial(*factors):
    found = np.polynomial.Polynomial([1.0])
    for factor in factors:
        found *= np.polynomial.Polynomial(factor)
    return found


def born_before_it(p):
    """A pair at s = 1 that dies at p = 0.6, a pair at s = -1 that is born at p = 0.3, and a point at 2 + p/2 that stays."""
    return Curve(polynomial([1 + (p - 0.61), -2, 1], [1 + (0.29 - p), 2, 1], [-2 - p / 2, 1]))


@pytest.mark.parametrize("backwards", [False, True])
def test_a_point_keeps_its_number_while_pairs_come_and_go(backwards):
    values = tuple(np.round(np.linspace(0.0, 0.9, 10), 3).tolist())
    over = {"material.ratio": values[::-1] if backwards else values}
    data = grid(over, born_before_it)
    identity = data["limit_identity"]
    order = []
    for p in values:
        cell = data.sel({"material.ratio": p})
        roots, numbers = cell["limit_volume"].values, cell["limit_identity"].values
        stays = int(np.nanargmax(roots))
        order.append(stays)
        assert numbers[stays] == 1  # in all scenes, whatever its place
        expected = {0: 1, **({-1: 2} if p > 0.29 else {}), **({1: 2} if p < 0.61 else {})}
        assert np.isfinite(numbers).sum() == 1 + sum(count for near, count in expected.items() if near)
    assert order == [2, 2, 2, 4, 4, 4, 4, 2, 2, 2]  # its place changes
    # each of the four points of the pairs has one number as well, which no other has
    own = {(int(n), bool(v > 0)) for n, v in zip(identity.values.ravel(), data["limit_volume"].values.ravel(), strict=True) if n > 1}
    assert len(own) == 4
    assert float(data["limit_cut"].sum()) == 0


def test_a_scene_without_a_branch_is_passed():
    data = grid({"material.ratio": (0.0, 0.1, 0.2)}, born_before_it, drop=(1,))
    assert np.isnan(data["limit_identity"].values[1]).all()
    assert data["limit_identity"].values[0].tolist() == data["limit_identity"].values[2].tolist()


def test_points_leave_through_the_end_of_a_branch():
    data = grid({"material.ratio": (0.0, 0.5, 1.0, 1.5)}, lambda p: Curve(polynomial([1, 1], [-2 - p, 1])))
    assert data["limit_identity"].values[:, 0].tolist() == [1, 1, 1, 1]
    assert data["limit_identity"].values[:2, 1].tolist() == [2, 2]
    assert np.isnan(data["limit_identity"].values[2:, 1]).all()


def swallowtail(a, b):
    """P' = s^3 + a s + b: three extrema where 4 a^3 + 27 b^2 < 0, one outside."""
    return Curve(polynomial([b, a, 0, 1]))


def test_round_a_swallowtail_a_minimum_comes_back_as_the_other_one():
    a, b = tuple(np.linspace(-2.0, 2.0, 12).tolist()), tuple(np.linspace(-1.5, 1.5, 12).tolist())
    data = grid({"source.0.height": a, "source.0.strength": b}, swallowtail)
    identity, cut = data["limit_identity"].values, data["limit_cut"].values
    counts = np.isfinite(identity).sum(axis=-1)
    inside = 4 * np.array(a)[:, None] ** 3 + 27 * np.array(b)[None] ** 2 < 0
    assert (counts == np.where(inside, 3, 1)).all()
    for scene in identity.reshape(-1, 3):
        known = scene[scene > 0]
        assert len(set(known)) == len(known)  # never one number twice in a scene
    # outside there is one number, and the maximum has one; the two minima cannot both have that of outside, and a cut says so
    assert set(identity[~inside][:, 0]) == {1}
    assert len(set(identity[inside][:, 1])) == 1
    assert 1 in identity[inside][:, [0, 2]]
    assert np.nansum(cut) > 0
    # over one line through the fold alone nothing is cut
    line = grid({"source.0.strength": tuple(np.linspace(-1.5, 1.5, 31).tolist())}, lambda b: swallowtail(-2.0, b))
    assert float(line["limit_cut"].sum()) == 0
    assert not (line["limit_identity"] == 0).any()


def test_what_is_as_near_to_two_is_not_sure():
    """From three points straight to one in their middle: it may be the first or the last."""
    curves = {-1.0: swallowtail(-2.0, 0.0), 1.0: swallowtail(2.0, 0.0)}
    data = grid({"source.0.strength": tuple(curves)}, curves.__getitem__)
    assert data["limit_identity"].values[1, 0] == 0
    points = followed(data, ["source.0.strength"], "limit_")
    assert points.identity[1, 0] == 0
    assert points.count == 0  # what is in one scene alone is followed nowhere
    unsure = int((points.identity == 0).sum())
    assert list(numbered_in_words(data)) == [f"limit points followed from scene to scene: {unsure} not followed from a neighbour"]


def mooney(ratio):
    run = fm.Run(control="arc-length", start=0.5, until={"center_height": 4.5}, max_steps=200)
    return fm.Scene(material=fm.MooneyRivlin(ratio), mesh=fm.disc(4), degree=3, run=run)


@pytest.fixture(scope="module")
def dying():
    """A maximum and a minimum of the pressure that merge between ratios of 0.05 and 0.06; below 0.03 the minimum lies beyond the end."""
    return fm.sweep(mooney(0.05), {"material.ratio": [0.02, 0.03, 0.04, 0.05, 0.06]}, workers=1)


def test_a_pair_of_limit_points_dies_in_the_middle_of_a_sweep(dying):
    data = dying.to_xarray()
    assert data["limit_identity"].values[:4, 0].tolist() == [1, 1, 1, 1]
    assert np.isnan(data["limit_identity"].values[4]).all()
    low = data["limit_identity"].values[:, 1]
    assert set(low[np.isfinite(low)]) == {2}
    assert "limit points followed from scene to scene: #1 in 4" in str(dying)


def test_a_curve_has_a_line_for_each_point(dying, tmp_path):
    axes = dying.plot(tmp_path / "curve.png").axes[1]
    assert axes.get_ylabel() == "limit points: pressure P = pR₀/(μT)"
    data = dying.to_xarray()
    lines = [np.asarray(line.get_ydata()) for line in axes.lines[:2]]
    assert np.isnan(lines[0][4])
    np.testing.assert_array_equal(lines[0][:4], data["limit_pressure"].values[:4, 0])
    assert lines[1][3] == data["limit_pressure"].values[3, 1]
    one = dying.plot(show=["limit_pressure#2"]).axes[0]
    assert one.get_ylabel() == "limit point #2: pressure P = pR₀/(μT)"
    for show in ("limit_pressure#9", "limit_pressure#x", "limit_pressure#0", "steps#1", "limit_identity#1"):
        with pytest.raises(InputError, match="number"):
            dying.plot(show=[show])
    fm.Sweep.load(_without_numbers(dying, tmp_path)).plot(show=["limit_pressure#2"])  # a file of an earlier version


def _without_numbers(found, tmp_path):
    from femmembrane.results.grid import save_dataset

    data = found.to_xarray()
    old = data.drop_vars([name for name in data.data_vars if str(name).endswith(("_identity", "_cut"))])
    assert with_identities(old, ["material.ratio"]).identical(data)
    save_dataset(old, tmp_path / "old.nc")
    return tmp_path / "old.nc"


def test_a_map_hatches_what_has_another_number(tmp_path):
    a, b = np.linspace(-2.0, 2.0, 12).tolist(), np.linspace(-1.5, 1.5, 12).tolist()
    over = {"source.0.height": tuple(a), "source.0.strength": tuple(b)}
    found = fm.Sweep(mooney(0.05), over, "branch", grid(over, swallowtail))
    figure = found.plot(tmp_path / "map.png", show=["limit_points", "limit_pressure#1", "limit_pressure#3", "limit_pressure.0"])
    titles = [axes.get_title() for axes in figure.axes if axes.get_title()]
    assert titles[1].startswith("limit point #1:")
    assert titles[3].startswith("limit point 1 of each branch:")
    words = {text.get_text() for legend in figure.legends for text in legend.get_texts()}
    assert "it has another number beside" in words
