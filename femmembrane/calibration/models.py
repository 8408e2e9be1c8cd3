"""Models side by side: where each starts, and how well data support it.

AICc = -2 log L + 2 k + 2 k (k + 1)/(n - k - 1) (Akaike 1974; Hurvich and Tsai 1989) and BIC = -2 log L + k log n (Schwarz 1978), where
k counts fitted numbers and estimated deviations. Every model has its shear modulus free.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ..errors import FemmembraneError, unknown_name
from ..physics.invariant import Gent, Yeoh
from ..physics.materials import Material, MooneyRivlin, NeoHookean, Ogden
from ..results.fit import ComparedModel, Comparison
from ..scene import Scene
from .fitting import check_count, fitted
from .laws import Law
from .least_squares import Problem
from .measured import measured_tests


def _ogden(alpha: Sequence[float], weights: Sequence[float]) -> Ogden:
    return Ogden(tuple(2 * w / a for w, a in zip(weights, alpha, strict=True)), tuple(alpha))


#: material to start from, and its numbers
MODELS: Mapping[str, tuple[Material, tuple[str, ...]]] = {
    "neo-hookean": (NeoHookean(), ("material.mu",)),
    "mooney-rivlin": (MooneyRivlin(0.1), ("material.c10", "material.c01")),
    "gent": (Gent(60.0), ("material.mu", "material.jm")),
    "yeoh": (Yeoh(0.002, 1e-4), ("material.c1", "material.c2", "material.c3")),
    "ogden-1": (_ogden((1.8,), (1.0,)), ("material.mu.0", "material.alpha.0")),
    "ogden-2": (_ogden((1.7, 5.0), (0.95, 0.05)), tuple(f"material.{n}.{k}" for n in ("mu", "alpha") for k in range(2))),
    "ogden-3": (_ogden((1.3, 5.0, -2.0), (0.9, 0.02, 0.08)), tuple(f"material.{n}.{k}" for n in ("mu", "alpha") for k in range(3))),
}


def compared(scene: Scene, data: Any, models: Sequence[str], noise: Any, units: str | None, starts: int) -> Comparison:
    """Fit models to the same data, and order them by AICc."""
    for name in models:
        if name not in MODELS:
            raise unknown_name("models", name, MODELS)
    found = [_one(scene, data, name, noise, units, starts) for name in models]
    return Comparison(tuple(sorted(found, key=lambda m: (not math.isfinite(m.aicc), m.aicc if math.isfinite(m.aicc) else 0.0))))


def _one(scene: Scene, data: Any, name: str, noise: Any, units: str | None, starts: int) -> ComparedModel:
    material, parameters = MODELS[name]
    law = Law(scene.replace(material=material), parameters)
    tests = measured_tests(law, data, noise, units)
    problem = Problem(law, tests)
    deviations = sum(block.noise.unknown for _, block in problem.blocks)
    numbers, n = len(parameters) + deviations, problem.count - problem.free_states
    try:
        check_count(law, problem)
        fit = fitted(law, tests, starts=starts, intervals="linear", advise=False)
    except FemmembraneError as error:
        if name == "neo-hookean":  # what it cannot read no other model can
            raise
        return ComparedModel(name, None, numbers, math.nan, math.nan, str(error))
    twice = -2 * fit.log_likelihood
    spare = n - numbers - 1
    message = "" if spare > 0 else f"{n} measured numbers are too few for the criterion of {numbers} numbers"
    aicc = twice + 2 * numbers + 2 * numbers * (numbers + 1) / spare if spare > 0 else math.nan
    return ComparedModel(name, fit, numbers, aicc, twice + numbers * math.log(n), message)
