"""Voltage and charge beside magnetised sheets, compressible materials and numbers that vary."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import femmembrane as fm
from femmembrane.accuracy.shooting import Guess, shoot
from femmembrane.errors import InputError, Status
from femmembrane.potential import potential_of
from femmembrane.potential.family import Family
from femmembrane.scene.variation import Parameter

DISC = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(8), degree=6)
MAGNETIC: dict[str, Any] = {"sources": [fm.Dipole(100, 6.0)], "susceptibility": 2.5, "demagnetization": True}


@pytest.mark.parametrize("load", ["voltage", "total_charge", "frozen_charge"])
def test_a_compressible_material_is_refused(load: str) -> None:
    with pytest.raises(InputError, match="incompressible material is allowed"):
        DISC.replace(material=fm.Hooke(poisson_ratio=0.3), electric=fm.Electric(**{load: 0.1}))


@pytest.mark.parametrize("load", ["voltage", "frozen_charge"])
def test_shooting_with_a_self_field(load: str) -> None:
    """The local equations of both, integrated without elements."""
    scene = DISC.replace(mesh=fm.disc(16), electric=fm.Electric(**{load: 0.3}), **MAGNETIC)
    eq = fm.equilibrium(scene, center_height=0.8)
    found = shoot(scene, center_height=0.8, guess=Guess.of(eq))
    assert (found.pressure, found.volume) == pytest.approx((eq.pressure, eq.volume), rel=1e-8)
    without = fm.equilibrium(scene.replace(demagnetization=False), center_height=0.8)
    assert abs(eq.pressure - without.pressure) > 1e-3


def test_pull_in_beside_a_weak_self_field() -> None:
    """Where a self-field is hardly there, the voltage ends the branch where it does without; moduli and tension are judged together."""
    plain = DISC.replace(material=fm.Ogden.treloar(), mesh=fm.disc(12), degree=4, electric=fm.Electric(voltage=np.sqrt(0.1)))
    weak = plain.replace(sources=[fm.Dipole(1e-8, 6.0)], susceptibility=1.0, demagnetization=True)
    ends = [fm.trace(scene, start=1.5, until={"volume": 40.0}, max_steps=80, throw=False) for scene in (plain, weak)]
    assert ends[0].status is Status.PULLED_IN
    assert ends[1].status is Status.LEGENDRE_FAILURE
    assert ends[1][-1].volume == pytest.approx(ends[0][-1].volume, rel=0.05)


@pytest.mark.parametrize(
    ("electric", "tension_field"),
    [
        ({"voltage": 0.3}, False),
        ({"total_charge": 1.0}, True),
        ({"frozen_charge": 0.3}, False),
        ({"total_charge": 0.5, "start": 0.2, "stop": 0.53}, False),
    ],
)
def test_members_of_a_family(electric: dict[str, float], tension_field: bool) -> None:
    """Each is the potential of its own scene, and the derivative with respect to the number is that of differences."""
    scene = DISC.replace(material=fm.Gent(30.0), mesh=fm.disc(4), degree=2, electric=fm.Electric(**electric), tension_field=tension_field)
    load = f"electric.{next(iter(electric))}"
    for name, value in ((load, 0.4), ("membrane.prestretch", 1.2), ("material.jm", 40.0)):
        parameter = Parameter(scene, name)
        family = Family(scene, parameter.vary, scene_at=parameter.scene_at)
        member, own = family.member(value), potential_of(parameter.scene_at(value))
        r = own.space.interpolation_points()
        x = own.space.interpolate(-0.05 * r * (1 - r**2), 0.3 * (1 - r**4))
        found, expected = member.evaluate(x, 0.7), own.evaluate(x, 0.7)
        np.testing.assert_allclose(found.unbalanced, expected.unbalanced, rtol=0, atol=1e-13)
        np.testing.assert_allclose(found.band, expected.band, rtol=0, atol=1e-11)
        assert found.energy == pytest.approx(expected.energy, rel=1e-13)
        assert (found.spring is None) == (expected.spring is None) == ("total_charge" not in electric)
        h = 1e-5
        slope = (family.evaluate(x, 0.7, value - h).unbalanced - family.evaluate(x, 0.7, value + h).unbalanced) / (2 * h)
        np.testing.assert_allclose(family.number_derivative(x, 0.7, value), slope, rtol=0, atol=1e-7 * np.abs(slope).max())


def test_a_sphere_over_its_voltage() -> None:
    """P = 2/l - 2/l^7 - 2 phi^2 l: at a pressure held, the voltage turns where phi^2(l) is largest."""
    pressure = 0.3
    found = minimize_scalar(
        lambda stretch: -(2 / stretch - 2 / stretch**7 - pressure) / (2 * stretch), bounds=(1.0, 2.0), options={"xatol": 1e-12}
    )
    sphere = fm.Scene(material=fm.NeoHookean(), mesh=fm.sphere(8), degree=4, electric=fm.Electric(voltage=0.0))
    branch = fm.trace(sphere, over="electric.voltage", hold={"pressure": pressure}, until={"electric.voltage": 1.0, "volume": 12.0})
    (turn,) = [p for p in branch.special_points or () if p.kind == "number_fold"]
    assert turn.equilibrium.voltage == pytest.approx(np.sqrt(-found.fun), rel=1e-8)


def test_a_run_over_a_charge() -> None:
    scene = DISC.replace(electric=fm.Electric(total_charge=0.5))
    branch = fm.vary(scene, "electric.total_charge", [0.5, 1.0, 0.0], hold={"volume": 1.2})
    for eq in branch:
        alone = fm.equilibrium(eq.scene, volume=1.2)
        assert (alone.pressure, alone.voltage) == pytest.approx((eq.pressure, eq.voltage), rel=1e-9, abs=1e-12)
        assert eq.charge == pytest.approx(eq.number("electric.total_charge"), rel=1e-12, abs=1e-12)


def test_electrodes_of_part_keep_their_ends_without_voltage() -> None:
    """Members of one family have the same elements, the one without voltage too."""
    scene = DISC.replace(electric=fm.Electric(voltage=0.0, stop=0.53))
    assert scene.element_ends == (0.53,)
    branch = fm.vary(scene, "electric.voltage", [0.0, 0.2], hold={"volume": 1.0})
    for eq in branch:
        assert fm.equilibrium(eq.scene, volume=1.0).pressure == pytest.approx(eq.pressure, rel=1e-10)
