"""Folds in contact, followed while a number changes."""

from __future__ import annotations

import pytest

import femmembrane as fm
from femmembrane.scene.variation import Parameter
from femmembrane.verbs.folds import _STEPS, FoldRequest, FoldRun

NH = fm.NeoHookean()


def limits(scene, volume, start):
    branch = fm.trace(scene, start=start, until={"volume": volume}, max_steps=300)
    return [p for p in branch.special_points if p.kind == "limit_point"]


def plate(height, elements=16, degree=3, **more):
    return fm.Scene(**{"material": NH, **more}, mesh=fm.disc(elements), degree=degree, obstacles=[fm.Plane(height)])


CASES = {
    "height of a plate": (plate(1.0), 6.0, "obstacle.0.height"),
    "material": (plate(1.0, material=fm.MooneyRivlin(0.01)), 7.0, "material.ratio"),
    "prestretch": (plate(1.0, prestretch=1.1), 8.0, "membrane.prestretch"),
    "radius of a ball": (
        fm.Scene(material=NH, mesh=fm.disc(24), degree=3, obstacles=[fm.Ball(1.6, 0.8)]),
        8.0,
        "obstacle.0.radius",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_limit_point_in_contact_is_followed(name):
    """The tangent of the curve against a difference along it, and its end against a trace in the scene there."""
    scene, volume, parameter = CASES[name]
    limit = limits(scene, volume, 0.45 * volume)[-1]
    assert limit.equilibrium.contact.touching
    number = Parameter(scene, parameter)
    run = FoldRun(scene, FoldRequest(limit, number, (0.9 * number.value, 1.1 * number.value), 1, 2, _STEPS, "stop"))
    first = run.point
    assert run.step() is None
    second, change = run.point, run.point.number - first.number
    for quantity in ("volume", "pressure"):
        difference = (second.value(quantity) - first.value(quantity)) / change
        mean = sum(p.rate(quantity) / p.rate("number") for p in (first, second)) / 2
        assert mean == pytest.approx(difference, rel=2e-3)
    there = limits(number.scene_at(second.number), 1.3 * volume, 0.45 * volume)[-1]
    assert second.state.pressure == pytest.approx(there.pressure, rel=1e-7)


def test_the_curve_ends_on_the_bound_with_its_limit_point():
    """The limit point that the plate moved: known at both ends from traces."""
    curve = fm.fold_curve(plate(1.0), start=limits(plate(1.0), 6.0, 3.0)[-1], parameter="obstacle.0.height", bounds=(1.0, 1.03))
    assert curve.values[-1] == 1.03
    assert curve.pressure[-1] == pytest.approx(limits(plate(1.03), 6.2, 3.0)[-1].pressure, rel=1e-7)
    assert curve.equilibria[-1].contact.touching
