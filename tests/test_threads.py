"""One thread for linear algebra in every public computation, and the caller's setting afterwards."""

from __future__ import annotations

import pytest
from threadpoolctl import ThreadpoolController

import femmembrane as fm
from femmembrane.potential import Potential
from femmembrane.threads import one_thread

from .cases import OGDEN, disc_scene

SCENE = disc_scene(OGDEN, elements=4)
CONTROLLER = ThreadpoolController()


def allowed() -> set[int]:
    """Threads that each BLAS of the process may use."""
    return {library["num_threads"] for library in CONTROLLER.info() if library["user_api"] == "blas"}


@pytest.fixture
def two_threads():
    """A caller who allows two, also where the environment says one."""
    with CONTROLLER.limit(limits=2, user_api="blas"):
        if allowed() != {2}:
            pytest.skip("no BLAS here whose threads can be set")
        yield


@pytest.fixture
def seen(monkeypatch):
    """Threads allowed while energies are evaluated."""
    found: set[int] = set()
    evaluate = Potential.evaluate

    def watched(self, *args, **kwargs):
        found.update(allowed())
        return evaluate(self, *args, **kwargs)

    monkeypatch.setattr(Potential, "evaluate", watched)
    return found


def test_limited_inside_and_restored_outside(two_threads):
    assert one_thread(allowed)() == {1}
    assert allowed() == {2}


def test_restored_after_an_error(two_threads):
    with pytest.raises(ZeroDivisionError):
        one_thread(lambda: 1 / 0)()
    assert allowed() == {2}


VERBS = {
    "equilibrium": lambda: fm.equilibrium(SCENE, volume=1.0),
    "inflate": lambda: fm.inflate(SCENE, volumes=[0.5, 1.0]),
    "pressurize": lambda: fm.pressurize(SCENE, pressures=[0.5, 1.0]),
    "trace": lambda: fm.trace(SCENE, start=0.5, max_steps=3),
    "trace_iter": lambda: list(fm.trace_iter(SCENE, start=0.5, max_steps=3)),
    "equilibria": lambda: fm.equilibria(SCENE, volume=1.0),
    "run": lambda: fm.run(SCENE.replace(run=fm.Run(control="volume", start=0.5, stop=1.0, steps=2))),
    "convergence": lambda: fm.convergence(SCENE, volume=1.0, elements=[2, 4]),
}


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_computes_in_one_thread(verb, two_threads, seen):
    VERBS[verb]()
    assert seen == {1}
    assert allowed() == {2}
