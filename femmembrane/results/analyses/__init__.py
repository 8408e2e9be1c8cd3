"""The analyses: what may be asked of every equilibrium, one file each, and the registry that all others read.

Whoever writes a table, a file or a page asks :func:`asked` for the analyses of a scene, and each of them for its part.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError, unknown_name
from ...quantities import Quantity, heading, quantity, typed
from .base import EquilibriumAnalysis, PrintedColumn, Remark
from .contact import ContactWithBodies
from .electrics import Electrics
from .error_estimates import ErrorEstimates
from .si_columns import SIColumns
from .verdicts import Verdicts
from .wrinkled_zones import WrinkledZones

if TYPE_CHECKING:
    from ...potential import Evaluation
    from ...scene import Scene
    from ..equilibrium import Equilibrium

_VERDICTS = Verdicts()
#: those that a scene asks for by keys of their own, in the order of their columns
ANALYSES: tuple[EquilibriumAnalysis, ...] = (_VERDICTS, Electrics(), SIColumns(), WrinkledZones(), ErrorEstimates(), ContactWithBodies())
#: those that a scene asks for by name, in ``analysis.extra``
EXTRA: dict[str, EquilibriumAnalysis] = {}
#: those by keys that answer while an equilibrium is recorded, which a branch asks at every step
_AT_ONCE = tuple(analysis for analysis in ANALYSES if type(analysis).compute is not EquilibriumAnalysis.compute)


def registered() -> tuple[EquilibriumAnalysis, ...]:
    """All analyses that there are."""
    return (*ANALYSES, *EXTRA.values())


def asked(scene: Scene) -> Sequence[EquilibriumAnalysis]:
    """The analyses that a scene asks for, in the order of their columns.

    Raises
    ------
    InputError
        For a name that nobody registered.
    """
    return [*(analysis for analysis in ANALYSES if analysis.asked(scene)), *_named_by(scene)]


def answer_at_once(equilibrium: Equilibrium, before: Equilibrium | None, evaluation: Evaluation) -> None:
    """Find the answers that are found while an equilibrium is recorded, see :meth:`.EquilibriumAnalysis.compute`."""
    scene = equilibrium.scene
    for analysis in _AT_ONCE:
        if analysis.asked(scene):
            analysis.compute(equilibrium, before, evaluation)
    if scene.analysis.extra:
        for analysis in _named_by(scene):
            analysis.compute(equilibrium, before, evaluation)


def _named_by(scene: Scene) -> list[EquilibriumAnalysis]:
    return [_named(f"analysis.extra[{k}]", name) for k, name in enumerate(scene.analysis.extra)]


def _named(key: str, name: str) -> EquilibriumAnalysis:
    if not EXTRA:
        raise InputError(key, name, "no analysis is registered under a name")
    if name not in EXTRA:
        raise unknown_name(key, name, EXTRA)
    return EXTRA[name]


def printed(scene: Scene) -> list[PrintedColumn]:
    """The columns of ``print(branch)``: verdicts in any case, and those of the analyses that the scene asks for."""
    wanted = asked(scene)
    shown = wanted if _VERDICTS in wanted else [_VERDICTS, *wanted]
    return [column for analysis in shown for column in analysis.printed(scene)]


def remarks(equilibrium: Equilibrium) -> list[Remark]:
    """The answers to all that the scene of an equilibrium asks, in words."""
    return [remark for analysis in asked(equilibrium.scene) for remark in analysis.remarks(equilibrium)]


def own_quantity(name: str) -> Quantity | None:
    """What a column or variable means that is an analysis' own; None for others, which the table of quantities has."""
    return next((found for analysis in registered() if (found := analysis.quantity(name)) is not None), None)


def known_quantity(name: str) -> Quantity:
    """What is known of a column or variable: what an analysis says of its own, else what the table of quantities says."""
    return own_quantity(name) or quantity(name)


def typed_column(name: str, values: Iterable[Any]) -> NDArray[Any]:
    """The cells of a column as an array of its type."""
    own = own_quantity(name)
    return typed(name, values) if own is None else np.array(list(values), dtype=own.type)


def column_heading(name: str) -> str:
    """The heading of a column where a person reads the table."""
    own = own_quantity(name)
    return heading(name) if own is None else own.symbol or own.words or heading(name)
