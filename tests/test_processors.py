"""Nothing hangs on two functions of two libraries agreeing to the last bit: on other processors they do not."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.accuracy.collocation import collocate
from femmembrane.accuracy.strong_form import Guess
from femmembrane.discretization.space import Space

from .cases import disc_scene

#: functions whose last bit hangs on the processor
FUNCTIONS = ("expm1", "exp", "sin", "cos", "log", "log1p", "arctan", "hypot", "tan")


@pytest.fixture(params=[-1, 1], ids=["down", "up"])
def another_processor(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """NumPy's functions as a processor would compute them that rounds the other way: inexact results are moved by one bit."""

    def moved(function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **more: Any) -> Any:
            value = function(*arguments, **more)
            exact = np.isin(value, (0.0, 1.0, -1.0))
            return np.where(exact, value, np.nextafter(value, request.param * np.inf))[()]

        return call

    for name in FUNCTIONS:
        monkeypatch.setattr(np, name, moved(getattr(np, name)))


MESHES = [
    *(fm.disc(n, ratio) for n in (2, 3, 5, 64) for ratio in (0.5, 1 / 3, 7.0, 1e6, 1e-6)),
    *(fm.annulus(0.3, n, ratio) for n in (3, 7) for ratio in (0.3, 4.0)),
    *(fm.cap(h, 5, 3.0) for h in (0.3, -2.0, 40.0)),
    fm.sphere(7, 0.4),
    fm.cylinder(2.2, 7, 0.7),
    fm.torus(3.0, 7),
]


@pytest.mark.usefixtures("another_processor")
@pytest.mark.parametrize("mesh", MESHES, ids=str)
def test_ends_are_met_exactly(mesh: Any) -> None:
    """Of every shape, on every grading: the first and the last end, and what lies on the axis, whatever the functions say."""
    ends = mesh.breakpoints()
    first, last = (0.0, 1.0) if mesh.shape == "disc" else (getattr(mesh, "start", 0.0), getattr(mesh, "stop", 2 * np.pi))
    assert (ends[0], ends[-1]) == (first, last)
    assert (np.diff(ends) > 0).all()
    space = Space(mesh, 3)
    assert np.array_equal(space.node_parameters()[[0, -1]], ends[[0, -1]])
    R, Z = mesh.position(space.node_parameters())
    poles = [k for k, on_axis in zip((0, -1), space.on_axis, strict=True) if on_axis]
    assert len(poles) == {"disc": 1, "cap": 1, "sphere": 2}.get(mesh.shape, 0)
    assert not R[poles].any()
    if mesh.shape in ("disc", "cap"):
        assert Z[-1] == 0
        assert not space.lids
    if mesh.shape == "disc":
        assert fm.disc(radii=tuple(ends.tolist())) == fm.disc(radii=mesh.refined().breakpoints()[::2])
        assert mesh.with_elements(2 * mesh.elements).breakpoints()[-1] == 1


def test_numbers_that_all_but_meet_an_end_are_taken() -> None:
    """Radii by a formula of one's own, radii of a profile, radii of a guess: each all but ends at 1."""
    below = float(np.nextafter(1.0, 0.0))
    assert fm.disc(radii=(0.0, 0.5, below)) == fm.disc(radii=(1e-17, 0.5, float(np.nextafter(1.0, 2.0)))) == fm.disc(radii=(0.0, 0.5, 1.0))
    with pytest.raises(fm.InputError, match="from 0"):
        fm.disc(radii=(0.0, 0.5, 0.999))
    eq = fm.equilibrium(disc_scene(elements=8), volume=1.0)
    assert eq.profile([float(np.nextafter(1.0, 2.0))])["rho"][0] == pytest.approx(1.0, abs=1e-12)
    with pytest.raises(fm.InputError, match="in \\[0, 1\\]"):
        eq.profile([1.001])
    guess = Guess.of(eq)
    profile = {name: np.array(values) for name, values in guess.profile.items()}
    profile["r"][-1] = below
    moved = Guess(guess.center_height, guess.stretch, guess.pressure, profile)
    assert collocate(eq.scene, volume=1.0, guess=moved).pressure == pytest.approx(collocate(eq.scene, volume=1.0, guess=guess).pressure)


PROGRAM = """
import femmembrane as fm
scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(5, 7.0))
print(fm.disc(3, 0.5).breakpoints()[-1].hex(), fm.equilibrium(scene, volume=1.0).pressure)
"""


@pytest.mark.parametrize("off", ["", "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL AVX512_SPR", "AVX2 FMA3"])
def test_numpy_without_what_a_processor_has(off: str) -> None:
    """NumPy takes other functions where it is told that a feature is missing; of unknown ones it says so, which is no matter here."""
    environment = {**os.environ, "NPY_DISABLE_CPU_FEATURES": off, "PYTHONWARNINGS": "ignore"}
    done = subprocess.run([sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=False)
    if "cannot disable CPU feature" in done.stderr:
        pytest.skip("NumPy was built with this feature for all processors")
    end, pressure = done.stdout.split()
    assert float.fromhex(end) == 1.0
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(5, 7.0))
    assert float(pressure) == pytest.approx(fm.equilibrium(scene, volume=1.0).pressure)
