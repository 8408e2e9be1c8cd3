"""Derivatives with respect to numbers of the scene, against solving again and against closed forms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.scene.variation import Parameter, names

#: quantities of every state
STATE = ("pressure", "volume", "center_height", "elastic_energy", "energy")


def solved(scene: fm.Scene, held: Mapping[str, float], start: fm.Equilibrium | None = None) -> fm.Equilibrium:
    return fm.equilibrium(scene, **held, start=start, solver="newton")


def answers(eq: fm.Equilibrium, of: Sequence[str], **along: Any) -> Any:
    found = [getattr(eq, name) for name in of if hasattr(eq, name)]
    profile = eq.profile(along.get("r", [0.25, 0.5]))
    return np.concatenate([np.array(found), *(profile[name] for name in of if name in profile)])


def again(scene: fm.Scene, name: str, answer: Any) -> tuple[Any, Any]:
    """Derivative of an answer by solving again at neighbouring values, extrapolated to step 0, and how far that is to be trusted."""
    parameter = Parameter(scene, name)
    h = 1.5e-3 * (abs(parameter.value) or 1.0)
    slopes = [(answer(parameter.scene_at(parameter.value + t)) - answer(parameter.scene_at(parameter.value - t))) / (2 * t) for t in (h, h / 2, h / 4)]
    fourth = [(4 * b - a) / 3 for a, b in zip(slopes, slopes[1:], strict=False)]
    best = (16 * fourth[1] - fourth[0]) / 15
    return best, np.abs(best - fourth[1])


def compare(scene: fm.Scene, held: Mapping[str, float], of: Sequence[str], to: Sequence[str], start: fm.Equilibrium | None = None, **along: Any) -> None:
    eq = solved(scene, held, start)
    (control,) = held
    found = eq.sensitivity(list(of), list(to), held=control, r=along.get("r", [0.25, 0.5]))
    scale = np.abs(answers(eq, of, **along))
    for name in to:
        mine = np.concatenate([np.atleast_1d(found[q][name]) for q in of])
        expected, doubt = again(scene, name, lambda changed: answers(solved(changed, held, eq), of, **along))
        number = abs(Parameter(scene, name).value) or 1.0
        allowed = 1e-6 * np.abs(expected) + 1e-8 * scale / number + 10 * doubt
        assert (10 * doubt <= 1e-5 * (np.abs(expected) + scale / number)).all(), (name, expected, doubt)
        assert (np.abs(mine - expected) <= allowed).all(), (name, mine, expected)


DISC = fm.disc(16)
SCENES: Mapping[str, tuple[fm.Scene, Mapping[str, float]]] = {
    "ogden": (fm.Scene(fm.Ogden.treloar(), DISC), {"center_height": 1.5}),
    "beyond the limit point": (fm.Scene(fm.MooneyRivlin(0.05), DISC), {"center_height": 2.0}),
    "gent": (fm.Scene(fm.Gent(30.0), DISC), {"volume": 4.0}),
    "polynomial": (fm.Scene(fm.Polynomial(c10=0.45, c01=0.05, c20=0.02, c11=0.01, c02=0.01, c30=0.01, c21=0.01, c12=0.01, c03=0.01), DISC), {"volume": 2.0}),
    "dipole": (fm.Scene(fm.MooneyRivlin(0.1), DISC, sources=[fm.Dipole(0.05, 1.5)], susceptibility=0.5), {"pressure": 0.4}),
    "weak dipole": (fm.Scene(fm.NeoHookean(), DISC, sources=[fm.Dipole(0.05, 1.5), fm.Dipole(0.02, 2.0)], susceptibility=2.5), {"volume": 0.4}),
    "magnetised": (
        fm.Scene(fm.NeoHookean(), DISC, sources=[fm.Dipole(0.05, 1.5)], susceptibility=0.5, saturation=0.4, demagnetization=True),
        {"volume": 1.0},
    ),
    "loads": (fm.Scene(fm.MooneyRivlin(0.1), DISC, loads=[fm.Weight(0.3), fm.Hydrostatic(0.2)]), {"volume": 1.5}),
    "prestretch": (fm.Scene(fm.NeoHookean(), DISC, prestretch=1.3), {"pressure": 0.7}),
    "rim": (fm.Scene(fm.MooneyRivlin(0.1), fm.disc(16, rim={"kind": "clamped", "radius": 1.2})), {"center_height": 0.8}),
    "tube": (fm.Scene(fm.MooneyRivlin(0.1), fm.Cylinder(length=2.0, elements=16)), {"volume": 9.0}),
    "two ends": (
        fm.Scene(
            fm.MooneyRivlin(0.1),
            fm.Cylinder(
                length=2.0,
                elements=16,
                top={"kind": "clamped", "height": 1.2, "radius": 1.1},
                bottom={"kind": "clamped", "height": -0.1, "radius": 1.0},
            ),
        ),
        {"volume": 9.0},
    ),
    "cap": (fm.Scene(fm.MooneyRivlin(0.1), fm.Cap(height=0.4, elements=16)), {"center_height": 0.9}),
    "sphere": (fm.Scene(fm.Ogden.treloar(), fm.Sphere(elements=12)), {"volume": 30.0}),
    "voltage": (fm.Scene(fm.MooneyRivlin(0.1), DISC, electric=fm.Electric(voltage=0.3)), {"volume": 1.0}),
    "total charge": (fm.Scene(fm.MooneyRivlin(0.1), DISC, electric=fm.Electric(total_charge=1.0)), {"volume": 1.0}),
    "frozen charge": (fm.Scene(fm.MooneyRivlin(0.1), DISC, electric=fm.Electric(frozen_charge=0.3)), {"volume": 1.0}),
    "tension field": (
        fm.Scene(fm.MooneyRivlin(0.1), fm.Cylinder(length=2.0, elements=16, top={"kind": "clamped", "height": 1.3}), tension_field=True),
        {"volume": 6.6},
    ),
}


@pytest.mark.parametrize("case", SCENES)
def test_derivatives_are_those_of_the_whole_solve(case: str) -> None:
    scene, held = SCENES[case]
    compare(scene, held, (*STATE, "rho", "eta", "stretch_1", "stretch_2", "mechanical_stress_1", "total_stress_2"), names(scene))
