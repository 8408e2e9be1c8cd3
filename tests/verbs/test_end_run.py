"""Places of the ends as loads: a rim that is drawn out or lifted, a tube that is pulled."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.errors import InputError
from femmembrane.potential import Family, potential_of
from femmembrane.scene.variation import Parameter, names

RIM = {"kind": "clamped", "radius": 1.2, "height": 0.3}
DISC, CAP = fm.disc(8, rim=RIM), fm.cap(height=0.4, elements=8, rim=RIM)
ANNULUS = fm.annulus(0.3, elements=8, inner={"kind": "clamped", "radius": 0.4, "height": 0.5})
ENDS = [
    (DISC, "mesh.rim.radius"),
    (DISC, "mesh.rim.height"),
    (CAP, "mesh.rim.radius"),
    (CAP, "mesh.rim.height"),
    (ANNULUS, "mesh.inner.radius"),
    (ANNULUS, "mesh.inner.height"),
    (fm.cylinder(2.0, 8, top={"kind": "clamped", "height": 1.4}), "mesh.top.height"),
    (fm.cylinder(2.0, 8, bottom={"kind": "axial", "radius": 1.2}), "mesh.bottom.radius"),
]
NAMED = [f"{mesh.shape}-{name}" for mesh, name in ENDS]


def scene(mesh: Any) -> fm.Scene:
    return fm.Scene(material=fm.NeoHookean(), mesh=mesh)


@pytest.mark.parametrize(("mesh", "name"), ENDS, ids=NAMED)
def test_the_family_is_each_of_its_members(mesh: Any, name: str) -> None:
    """Forces, volume and height of the pole at any value of the number are those of the scene built with it, and so are derivatives."""
    parameter = Parameter(scene(mesh), name)
    family = Family(parameter.scene, parameter.vary, scene_at=parameter.scene_at)
    x = 0.02 * np.random.default_rng(0).normal(size=family.space.n_free)
    for value in (parameter.value, 1.1 * parameter.value + 0.05):
        own, member = family.evaluate(x, 0.7, value), potential_of(parameter.scene_at(value))
        np.testing.assert_allclose(own.gradient, member.evaluate(x, 0.7).gradient, atol=1e-12)
        assert own.volume == pytest.approx(member.evaluate(x, 0.7).volume, abs=1e-13)
        assert family.space.center_height(x) + family.pole_rise(value) == pytest.approx(member.space.center_height(x), abs=1e-14)
        above, below = (family.evaluate(x, 0.7, value + h) for h in (1e-5, -1e-5))
        assert family.volume_derivative(x, value) == pytest.approx((above.volume - below.volume) / 2e-5, abs=1e-7)
        forces = [e.gradient - 0.7 * e.volume_gradient for e in (above, below)]
        np.testing.assert_allclose(family.number_derivative(x, 0.7, value), (forces[0] - forces[1]) / 2e-5, rtol=1e-5, atol=1e-4)


HELD = ({"pressure": 0.5}, {"volume": 3.0}, {"center_height": 0.6})


@pytest.mark.parametrize(
    ("mesh", "name", "hold"),
    [(mesh, name, hold) for mesh, name in ENDS for hold in HELD if "center_height" not in hold or mesh in (DISC, CAP)],
)
def test_every_state_is_that_of_its_own_scene(mesh: Any, name: str, hold: dict[str, float]) -> None:
    start = scene(mesh)
    end = 1.1 * Parameter(start, name).value + 0.05
    stepped = fm.vary(start, name, [Parameter(start, name).value, end], hold=hold)
    traced = fm.trace(start, over=name, hold=hold, until={name: end})
    alone = fm.equilibrium(stepped[-1].scene, start=stepped[-1], **hold)
    assert stepped[-1].number(name) == traced[-1].number(name) == end
    for eq in (stepped[-1], traced[-1]):
        assert (eq.volume, eq.pressure, eq.center_height) == pytest.approx((alone.volume, alone.pressure, alone.center_height), rel=1e-8)


def test_only_ends_with_a_place_have_numbers() -> None:
    assert [name for name in names(scene(DISC)) if name.startswith("mesh.")] == ["mesh.rim.radius", "mesh.rim.height"]
    assert not [name for name in names(scene(fm.disc(8))) if name.startswith("mesh.")]
    with pytest.raises(InputError, match=r"mesh\.rim\.radius.*> 0"):
        fm.vary(scene(DISC), "mesh.rim.radius", [1.2, -0.1], hold={"pressure": 1.0})


def test_a_lifted_rim_lifts_the_unloaded_membrane_as_a_whole() -> None:
    branch = fm.vary(scene(DISC), "mesh.rim.height", [0.3, 1.3], hold={"pressure": 0.5})
    assert branch[1].center_height - branch[0].center_height == pytest.approx(1.0, abs=1e-10)
    assert branch[1].volume == pytest.approx(branch[0].volume, rel=1e-10)
