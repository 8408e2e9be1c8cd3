"""Pre-stretch as a load, and what it does to the limit point."""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.potential import Family
from femmembrane.scene.variation import Parameter, names
from tests.cases import OGDEN

STRETCH = "membrane.prestretch"
SCENE = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16))


@pytest.mark.parametrize("hold", [{"pressure": 0.5}, {"volume": 0.5}, {"center_height": 0.3}])
def test_every_state_is_that_of_its_own_scene(hold: dict[str, float]) -> None:
    branch = fm.vary(SCENE, STRETCH, [1.0, 1.2, 1.5], hold=hold)
    assert [eq.scene.prestretch for eq in branch] == [1.0, 1.2, 1.5]
    for eq in branch:
        alone = fm.equilibrium(eq.scene, **hold)
        assert alone.pressure == pytest.approx(eq.pressure, rel=1e-8)
        assert alone.volume == pytest.approx(eq.volume, rel=1e-8)
        assert alone.profile()["rho"][-1] == pytest.approx(eq.scene.prestretch, rel=1e-12)


def test_derivatives_of_forces_and_volume() -> None:
    eq = fm.equilibrium(SCENE.replace(prestretch=1.2), volume=0.5)
    family, h = Family(SCENE, Parameter(SCENE, STRETCH).vary), 1e-5
    above, below = (family.evaluate(eq.state, eq.pressure, 1.2 + step) for step in (h, -h))
    assert family.evaluate(eq.state, eq.pressure, 1.2).volume == pytest.approx(eq.volume, rel=1e-13)
    assert family.volume_derivative(eq.state, 1.2) == pytest.approx((above.volume - below.volume) / (2 * h), rel=1e-8)
    forces = [e.gradient - eq.pressure * e.volume_gradient for e in (above, below)]
    np.testing.assert_allclose(family.number_derivative(eq.state, eq.pressure, 1.2), (forces[0] - forces[1]) / (2 * h), atol=1e-8)


@pytest.mark.parametrize("stretch", [1 + 1e-9, 1e3])
def test_next_to_none_and_a_thousandfold(stretch: float) -> None:
    branch = fm.vary(SCENE, STRETCH, [1.0, stretch], hold={"pressure": 5e-4})
    assert branch[-1].residual < 1e-10
    assert branch[-1].scene.prestretch == stretch


def test_the_limit_point_of_a_three_term_ogden_disc_vanishes_at_some_stretch() -> None:
    """The maximum and the minimum of the pressure merge in a cusp; a disc that is stretched more has none of them."""
    scene = fm.Scene(material=OGDEN, mesh=fm.disc(16))
    limit = next(p for p in fm.trace(scene, start=0.5, until={"volume": 5.0}).special_points or () if p.kind == "limit_point")
    curve = fm.fold_curve(scene, start=limit, parameter=STRETCH, bounds=(1.0, 3.0))
    (cusp,) = curve.cusps
    assert cusp.kind == "cusp"
    for value, folds in ((cusp.value - 0.02, 2), (cusp.value + 0.02, 0)):
        traced = fm.trace(scene.replace(prestretch=value), start=4.0, until={"volume": 40.0})
        assert sum(p.kind == "limit_point" for p in traced.special_points or ()) == folds


def test_where_it_cannot_be() -> None:
    assert STRETCH in names(SCENE)
    assert STRETCH not in names(fm.Scene(material=fm.NeoHookean(), mesh=fm.cap(height=0.3)))


def test_a_volume_fold_over_the_stretch_is_where_the_volume_is_stationary() -> None:
    """The rim takes volume with it: V has a minimum in p at P = 0.5, and equilibria on both sides of it hold more."""
    branch = fm.trace(SCENE, over=STRETCH, hold={"pressure": 0.5}, until={STRETCH: 1.3})
    (fold,) = [p for p in branch.special_points or () if p.kind == "volume_fold"]
    p, h = fold.equilibrium.scene.prestretch, 1e-3
    below, above = (fm.equilibrium(SCENE.replace(prestretch=p + step), pressure=0.5).volume for step in (-h, h))
    curvature = (below + above - 2 * fold.volume) / h**2
    assert curvature > 1
    assert abs(above - below) / (2 * h) < 0.01 * curvature * h + 1e-5


@pytest.mark.parametrize("solver", ["ipopt", "newton"])
@pytest.mark.parametrize("values", [[1.1, 1.0], [1.0, 1.1]], ids=["down", "up"])
@pytest.mark.parametrize("tension_field", [False, True])
def test_a_flat_disc_goes_to_rest_and_from_it(tension_field: bool, values: list[float], solver: str) -> None:
    """It stays flat, with s = p^2 - p^-4 in both directions: round-off of no stress is no compression."""
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16), degree=3, prestretch=1.1, tension_field=tension_field)
    for eq, p in zip(fm.vary(scene, STRETCH, values, hold={"pressure": 0.0}, solver=solver), values, strict=True):
        assert abs(eq.volume) < 1e-14
        stress = eq.potential.evaluate(eq.state, eq.pressure).stress
        assert np.abs(stress - (p**2 - p**-4)).max() < 1e-9
