"""Scenes of one structure share their point expressions, and a scene does not notice which others were built."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.potential import Potential, of_scene, potential, template
from femmembrane.potential.expressions import point_expressions
from femmembrane.solve.guess import spherical_dome
from tests.cases import OGDEN, disc_scene

BASE = disc_scene(OGDEN, (200.0, 6.5), elements=4)


@pytest.fixture
def builds(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[object]]:
    """The scenes whose expressions were written down, with no template kept from before."""
    seen: list[object] = []

    def counted(*given):
        seen.append(given[0])
        return point_expressions(*given)

    monkeypatch.setattr(potential, "point_expressions", counted)
    forget()
    yield seen
    forget()


def forget() -> None:
    template._template.cache_clear()
    of_scene._potential_of.cache_clear()


def values(scene: fm.Scene) -> list[np.ndarray]:
    found = Potential(scene)
    evaluation = found.evaluate(spherical_dome(found, 1.0), 0.7)
    return [np.array([evaluation.energy, evaluation.volume]), evaluation.gradient, evaluation.band, evaluation.stress]


def dipole(strength: float, height: float) -> fm.Scene:
    return BASE.replace(sources=[fm.Dipole(strength, height)])


def test_a_sweep_builds_once(builds):
    """Five scenes over strength and height, and branches with special points: one build."""
    scene = BASE.replace(run=fm.Run(control="arc-length", start=0.2, until={"volume": 1.0}))
    for over in ({"source.0.strength": [150.0, 200.0, 250.0]}, {"source.0.height": [6.0, 7.0]}):
        fm.sweep(scene, over, workers=1)
    assert len(builds) == 1


def test_a_run_over_a_number_builds_two(builds):
    """One for the family, where the strength is free, and one for its scenes."""
    run = fm.Run(control="arc-length", over="source.0.strength", hold={"volume": 0.5}, until={"source.0.strength": 210.0})
    for height in (6.0, 6.5, 7.0):
        fm.run(dipole(200.0, height).replace(run=run))
    assert len(builds) <= 2


OTHERS = {
    "susceptibility": lambda scene: scene.replace(susceptibility=1.3),
    "height": lambda scene: scene.replace(sources=[fm.Dipole(200.0, 5.1)]),
    "no source": lambda scene: scene.replace(sources=[]),
    "special numbers": lambda scene: scene.replace(sources=[fm.Dipole(1.0, 1.0)], susceptibility=1.0, material=fm.Ogden((1.0,), (2.0,))),
    "material": lambda scene: scene.replace(material=fm.Ogden((1.0, -0.35), (1.3, -2.0))),
}


@pytest.mark.parametrize("name", OTHERS)
def test_a_scene_has_the_same_bits_in_any_company(name, builds):
    alone = values(BASE)
    forget()
    values(OTHERS[name](BASE))
    assert all(np.array_equal(a, b) for a, b in zip(alone, values(BASE), strict=True))


SCENES = {
    "dipole": BASE,
    "saturated": BASE.replace(saturation=2.0, demagnetization=True),
    "remanent": BASE.replace(remanence=0.3, remanence_direction="meridional"),
    "loop and uniform": BASE.replace(sources=[fm.Loop(4.0, 3.0, 0.5), fm.Uniform(2.0)]),
    "ring": BASE.replace(sources=[fm.Magnet(3.0, 0.5, 0.8, 4.0, inner_radius=0.2)]),
    "gent": disc_scene(fm.Gent(30.0), elements=4),
    "tube": disc_scene(fm.ExtendedTube(0.3, 0.1, 0.5), elements=4).replace(tension_field=True),
    "exponents": disc_scene(fm.LopezPamies(1.0, 3.0, 0.5), elements=4),
    "loads": BASE.replace(loads=[fm.Weight(0.3), fm.Hydrostatic(0.5)]),
    "hub": disc_scene(elements=4).replace(mesh=fm.annulus(0.3, elements=4, inner="hub"), loads=[fm.HubForce(0.2)]),
}


@pytest.mark.parametrize("name", SCENES)
def test_a_template_says_what_the_scene_says(name, builds, monkeypatch):
    """Built by itself, a scene has the same values to round-off, and at most one operation in a hundred more or fewer."""
    scene = SCENES[name]
    by_template, operations = values(scene), Potential(scene).operations
    assert len(builds) == 1
    assert builds[0] is not scene
    monkeypatch.setattr(potential, "expressions_of", lambda build, *given: build(*given))
    for one, other in zip(by_template, values(scene), strict=True):
        assert np.abs(one - other).max() <= 1e-12 * np.abs(other).max()
    assert operations == pytest.approx(Potential(scene).operations, rel=0.01)


def test_a_number_that_is_zero_builds_nothing(builds):
    still = BASE.replace(loads=[fm.Weight(0.0)])
    assert Potential(still).operations == Potential(BASE).operations == 340
    assert Potential(BASE.replace(loads=[fm.Weight(0.1)])).operations > 340
    assert Potential(dipole(0.0, 6.5)).operations == 243


class Own(fm.Source):
    def field(self, rho, eta):
        return 0 * rho, 1.0 + 0 * eta, 0.0


def test_a_source_of_ones_own_is_built_by_itself(builds):
    scene = BASE.replace(sources=[fm.Dipole(200.0, 6.5), Own()])
    for _ in range(2):
        Potential(scene)
    assert [seen is scene for seen in builds] == [True, True]


def test_an_exponent_belongs_to_the_structure(builds):
    for alpha in (2.0, 2.5, -2.0):
        found = values(disc_scene(fm.Ogden((2 / alpha,), (alpha,)), elements=4))
        assert np.isfinite(found[1]).all()
    assert len(builds) == 3
