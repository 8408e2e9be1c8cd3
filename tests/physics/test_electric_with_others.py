"""Voltage and charge beside magnetised sheets, compressible materials and numbers that vary."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

import femmembrane as fm
from femmembrane.accuracy.shooting import Guess, shoot
from femmembrane.errors import InputError, Status
from femmembrane.physics.electrified_hooke import ElectrifiedHooke
from femmembrane.potential import potential_of
from femmembrane.potential.family import Family
from femmembrane.scene.variation import Parameter

DISC = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(8), degree=6)
MAGNETIC: dict[str, Any] = {"sources": [fm.Dipole(100, 6.0)], "susceptibility": 2.5, "demagnetization": True}


class Foam:
    """A compressible material of somebody else, which does not say what a field does to its thickness."""

    def energy(self, e1: Any, e2: Any) -> Any:
        return e1**2 + e2**2

    def stress(self, e1: Any, e2: Any) -> tuple[Any, Any]:
        return 2 * e1, 2 * e2

    def tangent(self, e1: Any, e2: Any) -> tuple[Any, Any, Any]:
        return 2 + 0 * e1, 0 * e1, 2 + 0 * e1

    def volume_ratio(self, e1: Any, e2: Any) -> Any:
        return np.exp(e1 + e2)


@pytest.mark.parametrize("load", ["voltage", "total_charge", "frozen_charge"])
def test_a_compressible_material_that_says_nothing_of_its_thickness_is_refused(load: str) -> None:
    with pytest.raises(InputError, match="how the field changes its thickness"):
        DISC.replace(material=Foam(), electric=fm.Electric(**{load: 0.1}))


def hooke_in_space(nu: float, e1: float, e2: float, voltage: float, charge: float) -> tuple[float, float]:
    """Hooke's energy in three dimensions with that of the field, at the thickness at which it is least, and lambda_3."""
    E1, E2, J = np.expm1(2 * e1) / 2, np.expm1(2 * e2) / 2, np.exp(e1 + e2)

    def slope(E3: float) -> float:
        thin = 1 + 2 * E3
        return 2 * nu / (1 - 2 * nu) * (E1 + E2 + E3) + 2 * E3 + voltage / 2 * J * thin**-1.5 + charge / 2 / J * thin**-0.5

    E3 = brentq(slope, -0.25, 0.3, xtol=1e-15)
    thick = np.sqrt(1 + 2 * E3)
    energy = nu / (1 - 2 * nu) * (E1 + E2 + E3) ** 2 + E1**2 + E2**2 + E3**2 - voltage / 2 * J / thick + charge / 2 * thick / J
    return energy, thick


@pytest.mark.parametrize("charge", [False, True], ids=["voltage", "charge"])
@pytest.mark.parametrize("nu", [-0.4, 0.0, 0.3, 0.49, 0.5])
def test_the_thickness_of_a_compressible_sheet(nu: float, charge: bool) -> None:
    """Hooke's law in three dimensions with the capacitor of that thickness, minimised over it; stress and tangent by differences."""
    response = ElectrifiedHooke(fm.Hooke(nu), 0.0 if charge else 0.08, 0.08 if charge else 0.0)
    e1, e2 = np.random.default_rng(0).uniform(-0.15, 0.15, (2, 6))
    h = 1e-6

    def whole(a: Any, b: Any) -> Any:
        return response.energy(a, b) + response.electric_energy(a, b)

    if nu < 0.5:
        exact = [hooke_in_space(nu, a, b, response.voltage, response.charge)[0] for a, b in zip(e1, e2, strict=True)]
        np.testing.assert_allclose(whole(e1, e2), exact, rtol=0, atol=1e-15)
    s1, s2 = response.stress(e1, e2)
    np.testing.assert_allclose(s1, (whole(e1 + h, e2) - whole(e1 - h, e2)) / (2 * h), rtol=0, atol=1e-9)
    np.testing.assert_allclose(s2, (whole(e1, e2 + h) - whole(e1, e2 - h)) / (2 * h), rtol=0, atol=1e-9)
    d11, d12, d22 = response.tangent(e1, e2)
    along, across = (
        [(a - b) / (2 * h) for a, b in zip(response.stress(*plus), response.stress(*minus), strict=True)]
        for plus, minus in (((e1 + h, e2), (e1 - h, e2)), ((e1, e2 + h), (e1, e2 - h)))
    )
    np.testing.assert_allclose([d11, d12, d12, d22], [*along, *across], rtol=0, atol=2e-9)
    # without field it is the plane law, and no thickness withstands a strong one
    bare = ElectrifiedHooke(fm.Hooke(nu), 0.0, 0.0)
    np.testing.assert_allclose(bare.tangent(e1, e2), fm.Hooke(nu).tangent(e1, e2), rtol=1e-14)
    if not charge and nu < 0.49:  # beyond that it takes a stronger one
        assert np.isnan(ElectrifiedHooke(fm.Hooke(nu), 9.0, 0.0).stress(e1, e2)).all()


@pytest.mark.parametrize("electric", [{"voltage": 0.3}, {"frozen_charge": 0.3}, {"total_charge": 0.3 * 4 * np.pi}], ids=str)
def test_a_compressible_sphere(electric: dict[str, float]) -> None:
    """P l^2 = d(energy)/dl; the capacitance is that of the thickness: 4 pi l^2/lambda_3 = 4 pi l^4 over the volume ratio."""
    stretch, h = 1.1, 1e-4
    scene = fm.Scene(material=fm.Hooke(0.3), mesh=fm.sphere(8), degree=4, electric=fm.Electric(**electric))
    eq = fm.equilibrium(scene, volume=4 * np.pi / 3 * stretch**3)
    squares = (0.09, 0.0) if "voltage" in electric else (0.0, 0.09)
    below, above = (hooke_in_space(0.3, np.log(stretch + k * h), np.log(stretch + k * h), *squares)[0] for k in (-1, 1))
    assert eq.pressure == pytest.approx((above - below) / (2 * h) / stretch**2, rel=1e-6)
    capacitance = 4 * np.pi * stretch**2 / hooke_in_space(0.3, np.log(stretch), np.log(stretch), *squares)[1]
    if "frozen_charge" not in electric:
        assert eq.capacitance == pytest.approx(capacitance, rel=1e-7)
    assert eq.charge == pytest.approx(0.3 * capacitance if "voltage" in electric else 0.3 * 4 * np.pi, rel=1e-7)
    shape = eq.profile()
    maxwell = shape["mechanical_stress_1"] - shape["total_stress_1"] - eq.pressure / scene.radius_to_thickness
    np.testing.assert_allclose(maxwell, eq.electric_field**2 / 2, rtol=1e-4)  # the other half acts across


@pytest.mark.parametrize(
    ("electric", "tension_field"),
    [({"voltage": 0.3}, False), ({"frozen_charge": 0.2}, False), ({"total_charge": 0.5}, False), ({"total_charge": 0.5}, True)],
    ids=str,
)
def test_a_compressible_disc(electric: dict[str, float], tension_field: bool) -> None:
    """dE/dV = P, and IPOPT agrees with Newton's method; shooting has the local law."""
    scene = DISC.replace(material=fm.Hooke(0.3), electric=fm.Electric(**electric), tension_field=tension_field)
    a, eq, b = (fm.equilibrium(scene, volume=0.5 + k * 1e-4, solver="newton") for k in (-1, 0, 1))
    assert (b.energy - a.energy) / 2e-4 == pytest.approx(eq.pressure, rel=1e-5)
    assert fm.equilibrium(scene, volume=0.5, solver="ipopt").pressure == pytest.approx(eq.pressure, rel=1e-9)
    if "total_charge" not in electric and not tension_field:
        found = shoot(scene, center_height=eq.center_height, guess=Guess.of(eq))
        assert (found.pressure, found.volume) == pytest.approx((eq.pressure, eq.volume), rel=1e-7)


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
    assert ends[1].status is Status.PULLED_IN
    assert "stress and field leave no stiffness along the meridian" in ends[1].message
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
    assert all(p.equilibrium.voltage > 0.5 for p in branch.special_points or ())  # at 0 all is stationary, by symmetry, and nothing turns
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
