"""What a scene may say of its magnetisation beside the susceptibility, and what does not go together."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import choice, is_number, number, switch
from ..errors import InputError
from ..physics.along import Along
from ..physics.magnetisation import DIRECTIONS, TRANSPORTS, Magnetisation, sources_that_act
from ..physics.sources import Wire

if TYPE_CHECKING:
    from .value import Scene


def checked_magnetisation(scene: Scene) -> dict[str, Any]:
    """The attributes of a scene that say how its sheet is magnetised, each checked by itself.

    Raises
    ------
    InputError
    """
    saturation, remanence = scene.saturation, scene.remanence
    if saturation is not None:
        saturation = number("membrane.saturation", saturation, "a finite number > 0 is allowed (mu0 Ms over sqrt(mu mu0))", above=0)
    if is_number(remanence):
        allowed = "a finite number >= 0 is allowed; against the field: turn the source (orientation), or give a table for a pattern"
        remanence = number("membrane.remanence", remanence, allowed, least=0)
    elif remanence is not None:
        remanence = Along.of("membrane.remanence", remanence)
    direction, transport = scene.remanence_direction, scene.remanence_transport
    for key, value, known in (("remanence_direction", direction, DIRECTIONS), ("remanence_transport", transport, TRANSPORTS)):
        if value is not None:
            choice(f"membrane.{key}", value, known)
            if remanence is None:
                raise InputError(f"membrane.{key}", value, "there is no remanence that it would belong to; give membrane.remanence as well")
    if remanence is not None and direction is None:
        raise InputError("membrane.remanence_direction", None, 'missing; with a remanence "normal" or "meridional" is needed')
    return {
        "demagnetization": switch("effects.demagnetization", scene.demagnetization),
        "saturation": saturation,
        "remanence": remanence,
        "remanence_transport": "deformed" if remanence is not None and transport is None else transport,
    }


def refuse_magnetisation(scene: Scene) -> None:
    """Raise InputError for parts of a scene that do not go together.

    Raises
    ------
    InputError
    """
    if scene.saturation is not None and not scene.susceptibility:
        allowed = "a susceptibility > 0 is needed beside membrane.saturation: it is the slope from which the magnetisation saturates"
        raise InputError("membrane.susceptibility", scene.susceptibility, allowed)
    if isinstance(scene.remanence, Along):
        _check_remanence(scene)
    magnetisation = Magnetisation.of(scene)
    if magnetisation is None or not magnetisation.tilts:
        return
    if scene.tension_field and not magnetisation.relaxes:
        allowed = (
            "false is allowed with a self-field, and with a remanence unless it is meridional and deformed: their energy depends on the "
            "slope, which wrinkles change, so that relaxing the strain energy alone does not relax the whole"
        )
        raise InputError("effects.tension_field", True, allowed)
    sources = sources_that_act(scene)
    if len(sources) > 1 and any(isinstance(source, Wire) for source in sources):
        allowed = "alone with a self-field or a remanence: beside other sources it twists the membrane, which is then not axisymmetric"
        raise InputError("source.kind", "wire", allowed)


def _check_remanence(scene: Scene) -> None:
    ends = scene.mesh.breakpoints()
    s = np.sort(np.concatenate([ends, (ends[1:] + ends[:-1]) / 2]))
    try:
        values = scene.remanence.at(*scene.mesh.position(s), s)
    except InputError:
        raise
    except Exception as error:  # whatever a stranger's function raises
        allowed = f"it must answer arrays (R, Z, s) with one number a point ({error})"
        raise InputError("membrane.remanence", scene.remanence.given, allowed) from error
    if not np.isfinite(values).all():
        raise InputError("membrane.remanence", scene.remanence.given, "a finite number everywhere is allowed")
