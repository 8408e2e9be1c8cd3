"""What the explorer shows of a branch, as plain lists and mappings that become JSON: its page does nothing but draw them.

===============  ======================================================================================
``quantities``   what the axes of the diagram may show, with labels; ``axes`` are the two shown first
``lines``        the curve with the look of its verdicts; ``bands``, ``snaps`` lie behind it and across
``states``       equilibria and special points along the branch: numbers, verdicts, answers in words
``shapes``       the same states in space, in the same order: meridian, fields, zones, modes
``bodies``       the sources, and ``box`` the room that all shapes and bodies need
===============  ======================================================================================

Values are rounded to the digits that a picture or a table shows.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SolveError, Status
from ..quantities import PLACES, PROFILE, SCALED, Units, axis_label, heading_in, in_si, quantity
from ..results.analyses import asked, column_heading, known_quantity
from ..results.analyses.verdicts import Verdicts
from ..results.curve import specials_between
from ..results.table import columns
from ..results.zones import KINDS
from ..scene import ALL
from ..scene.number_units import shown_number
from .backend import load
from .branch_lines import MARKERS, Strands, after, answer
from .figures import AMONG, Style
from .picture import zone_colors
from .surroundings import Box, named, surroundings
from .svg import dark
from .vtk import Array, finite_at_ends, spread
from .zones import PATTERNS

if TYPE_CHECKING:
    from ..results.branch import Branch
    from ..results.equilibrium import Equilibrium
    from ..results.special_point import SpecialPoint
    from ..results.verdict import Verdict

#: places along a drawn meridian, and most states with shapes on one page
PLACES_ALONG, MOST_STATES = 97, 240
#: significant digits of shapes, and of numbers in tables
_SHAPE, _NUMBER = 5, 9
#: waves around the axis of the modes of a run that asked for no verdict
_WAVES = (0, 1, 2)
#: columns that are no quantity of a branch
_NOT_DRAWN = ("iterations", "seconds", "residual")


@dataclass(frozen=True, eq=False)
class State:
    """An equilibrium that the page shows: a step of the branch, or one of its special points."""

    equilibrium: Equilibrium
    step: int | None
    point: SpecialPoint | None = None
    place: int = 0


def states_of(branch: Branch, most: int = MOST_STATES) -> list[State]:
    """Steps and special points in their order along the branch. Of a long branch some steps are left out, evenly."""
    kept = {round(float(k)) for k in np.linspace(0, len(branch) - 1, min(most, len(branch)))}
    inside, places = specials_between(branch), {id(point): k for k, point in enumerate(branch.special_points or ())}
    found: list[State] = []
    for k, equilibrium in enumerate(branch):
        found += [State(equilibrium, k)] if k in kept else []
        found += [State(p.equilibrium, None, p, places[id(p)]) for p in (inside[k] if k < len(inside) else ())]
    named = {id(state.point) for state in found}
    return found + [State(p.equilibrium, None, p, places[id(p)]) for p in branch.special_points or () if id(p) not in named]


def page_data(branch: Branch, units: str = "scaled", *, shapes: bool = True) -> dict[str, Any]:
    """All that the page shows.

    Parameters
    ----------
    branch : Branch
        With one or more equilibria.
    units : {"scaled", "si"}
    shapes : bool
        False leaves the shapes to :func:`shape_of`, for a page that asks for them one by one.

    Raises
    ------
    InputError
        For SI units of a scene without scales.
    """
    load()
    chosen = Units.of(units, branch.scene.converter)
    names = drawn_columns(branch, chosen)
    strands, states = Strands.of(branch, names, chosen), states_of(branch)
    places = [strands.points[s.place] if s.step is None else strands.steps[s.step] for s in states]
    left_out = len(branch) - sum(state.step is not None for state in states)
    return {
        "title": branch.scene.title or "Inflated membrane",
        "status": str(branch.status),
        "good": branch.status is Status.CONVERGED,
        "message": branch.message if branch.status is Status.CONVERGED else f"{branch.message} What helps: {branch.status.advice}.",
        "notes": [*([branch.mesh_used] if branch.mesh_used else []), *branch.notes, *_left_out(left_out)],
        "quantities": [{"name": name, "label": _label(branch, name, chosen)} for name in names],
        "axes": [branch.over or "volume", answer(branch)],
        "heading": AMONG if branch.scene.analysis.stability else "",
        "lines": [{**_look(style), "values": _columns(line)} for style, line in strands.lines],
        "bands": _bands(strands.bands),
        "snaps": [_columns(ends) for ends in strands.snaps],
        "fields": [{"name": name, "label": _field(name, chosen)} for name in _fields(branch, chosen)],
        "zones": [{"kind": kind, "label": PATTERNS[kind].name, "color": color} for kind, color in zip(KINDS, zone_colors(), strict=True)],
        "zoned": f"zones by the signs of the {branch.scene.analysis.zone_criterion} stresses",
        "length": chosen.unit("rho"),
        "states": [_state(state, place, names, chosen) for state, place in zip(states, places, strict=True)],
        "shapes": [shape_of(state.equilibrium, chosen) for state in states] if shapes else None,
        **_room([state.equilibrium for state in states] if shapes else _some(states), chosen),
    }


def drawn_columns(branch: Branch, units: Units = SCALED) -> list[str]:
    """The columns of a branch that its axes may show, each quantity once in these units."""
    found = [name for name in columns(branch) if name not in _NOT_DRAWN and known_quantity(name).type is not str]
    shown = {in_si(name) for name in found if units.unit(name)}
    return [name for name in found if name not in shown]


def _left_out(count: int) -> list[str]:
    return [f"{count} equilibria between those shown are left out of this page; the line goes through all of them"] if count else []


def _label(branch: Branch, name: str, units: Units) -> str:
    own = known_quantity(name)
    if "." in name:
        return shown_number(branch.scene, name, units).label
    label = axis_label(name, units) if own == quantity(name) else own.label or column_heading(name)
    return label if own.unit == "1" else f"{label} in {own.unit}"


def _field(name: str, units: Units) -> str:
    shown = quantity(name)
    unit = units.unit(name)
    return f"{shown.meaning} in {unit}" if unit else shown.meaning


def _fields(branch: Branch, units: Units) -> list[str]:
    """Stretches and stresses; total stresses differ from mechanical ones by what a field and the thickness add."""
    return [name for name in PROFILE if name not in ("rho", "eta", "r", "s") and (branch.scene.sources or not name.startswith("total"))]


def _look(style: Style) -> dict[str, Any]:
    """How a line is drawn, in the words of the page: dashes of Matplotlib are counted in widths of the line."""
    from matplotlib.colors import to_hex

    dashes = "solid" if isinstance(style.dashes, str) else ",".join(f"{max(part * style.width, 1):.3g}px" for part in style.dashes[1])
    color = to_hex(style.color)
    return {"label": style.label, "color": color, "dark": dark(color), "dash": dashes, "width": 1.4 * style.width}


def _bands(bands: Sequence[tuple[tuple[int | str, ...], Array]]) -> list[dict[str, Any]]:
    """Darker for more modes, and for shorter waves, as in other pictures."""
    order = sorted({waves for waves, _ in bands}, key=lambda waves: (len(waves), list(map(str, waves))))
    names = [", ".join("any" if n == ALL else str(n) for n in waves) for waves in order]
    look = {waves: {"label": f"unstable to azimuthal n = {names[k]}", **_grey(k)} for k, waves in enumerate(order)}
    return [{**look[waves], "values": _columns(line)} for waves, line in bands]


def _grey(place: int) -> dict[str, str]:
    part = round(255 * max(0.84 - 0.14 * place, 0.4))
    color = f"#{part:02x}{part:02x}{part:02x}"
    return {"color": color, "dark": dark(color)}


# --- states


def _state(state: State, place: Array, names: Sequence[str], units: Units) -> dict[str, Any]:
    equilibrium, point = state.equilibrium, state.point
    wanted = equilibrium.scene.analysis.verdicts
    return {
        "step": state.step,
        "name": f"step {state.step}" if point is None else _point_name(point),
        "kind": None if point is None else str(point.kind),
        "word": "" if point is None else _kind_name(point),
        "after": "" if point is None else after(point),
        "values": _array(place, _NUMBER),
        "verdicts": [_verdict(equilibrium.verdict(p.control, azimuthal=p.azimuthal), p.words) for p in wanted],
        "answers": [*_point_words(point), *_answers(equilibrium)],
        "numbers": [[heading_in(name, units), _rounded(units.factor(name) * getattr(equilibrium, name), _NUMBER)] for name in PLACES],
    }


def _point_name(point: SpecialPoint) -> str:
    name = _kind_name(point)
    if point.zone is not None:
        return f"{name}: {point.zone}"
    return f"{name}, n = {point.azimuthal}" if point.azimuthal else name


def _kind_name(point: SpecialPoint) -> str:
    """The kind of a special point, and of an onset what comes after it."""
    name = MARKERS.get(str(point.kind), ("X", str(point.kind).replace("_", " ")))[1]
    return f"{name}, {after(point)}" if after(point) else name


def _point_words(point: SpecialPoint | None) -> list[list[str]]:
    if point is None:
        return []
    beyond = [["beyond it", point.postbuckling.words]] if point.azimuthal else []
    return [["located", f"to a relative error of {point.error:.1e}"], *beyond]


def _verdict(verdict: Verdict, against: str) -> dict[str, Any]:
    return {"against": against, "word": verdict.word, "reason": verdict.reason, "value": _rounded(verdict.smallest_eigenvalue, _NUMBER)}


def _answers(equilibrium: Equilibrium) -> list[list[str]]:
    """What analyses say of a state in words, other than its verdicts; and how it was found, where that is not as usual."""
    said = [] if equilibrium.status is Status.CONVERGED else [["status", str(equilibrium.status)]]
    others = [analysis for analysis in asked(equilibrium.scene) if not isinstance(analysis, Verdicts)]
    return [*said, *([remark.subject, remark.text] for analysis in others for remark in analysis.remarks(equilibrium))]


# --- shapes


def shape_of(equilibrium: Equilibrium, units: Units) -> dict[str, Any]:
    """The membrane in space: places along the meridian with fields, kinds of zones between them, and the lowest modes.

    Places are spread like the nodes, so that layers are seen, and lie on all borders of zones.
    """
    space, zones = equilibrium.potential.space, equilibrium.zones()
    nodes = space.node_parameters()
    places = spread(equilibrium, PLACES_ALONG)
    s = np.unique(np.concatenate([places, [zone.s[1] for zone in zones]]).clip(places[0], places[-1]))
    profile = finite_at_ends(equilibrium.profile(s))
    length = units.factor("rho")
    fields = [name for name in PROFILE if name in profile and name not in ("rho", "eta", "r", "s")]
    return {
        "rho": _array(length * profile["rho"]),
        "eta": _array(length * profile["eta"]),
        "fields": {name: _array(units.factor(name) * profile[name]) for name in fields},
        "zone": zones.numbers((s[1:] + s[:-1]) / 2).tolist(),
        "zones": [[zone.kind, *(_rounded(v, 4) for v in (*zone.r, *zone.rho, zone.area_fraction))] for zone in zones],
        "hubs": [[_rounded(length * profile[name][k], _SHAPE) for name in ("rho", "eta")] for k in space.hubs],
        "modes": [_mode(label, n, shape, nodes, s) for label, n, shape in _modes(equilibrium)],
    }


def _modes(equilibrium: Equilibrium) -> Iterator[tuple[str, int, Mapping[str, Array]]]:
    """The lowest mode of each verdict that was asked for; natural modes where none was."""
    wanted = equilibrium.scene.analysis.verdicts
    for p in wanted:
        verdict = equilibrium.verdict(p.control, azimuthal=p.azimuthal)
        if verdict.mode is not None:
            yield f"{p.words}: λ = {verdict.smallest_eigenvalue:.4g}", verdict.azimuthal, verdict.mode
    if not wanted:
        for n in _WAVES:
            try:
                found = equilibrium.frequencies(azimuthal=n, count=1)[0]
            except SolveError:
                continue
            yield f"{'axisymmetric, pressure held' if n == 0 else f'n = {n}'}: λ = {found.eigenvalue:.4g}", n, found.mode


def _mode(label: str, waves: int, shape: Mapping[str, Array], nodes: Array, s: Array) -> dict[str, Any]:
    """A mode at the places of the meridian, its largest displacement 1."""
    order = np.argsort(nodes, kind="stable")
    parts = {key: np.interp(s, nodes[order], np.asarray(shape[key])[order]) for key in ("u", "w", "c") if key in shape}
    largest = max(float(np.abs(part).max()) for part in parts.values()) or 1.0
    return {"label": label, "n": waves, **{key: _array(part / largest, 4) for key, part in parts.items()}}


def _some(states: Sequence[State], most: int = 7) -> list[Equilibrium]:
    """A few equilibria, ends included: what a page has room for that is drawn many times a second."""
    return [states[int(k)].equilibrium for k in np.unique(np.linspace(0, len(states) - 1, most).round().astype(int))]


def _room(shown: Sequence[Equilibrium], units: Units) -> dict[str, Any]:
    """The sources near the membranes, and the box around all."""
    box = Box.of([_meridian(equilibrium) for equilibrium in shown])
    around, length = surroundings(shown[0].scene, box), units.factor("rho")
    bodies = [
        {
            "label": named(body.label, units),
            "moment": body.moment,
            "rigid": body.rigid,
            "rho": [_rounded(length * r, 6) for r, _ in body.points],
        }
        | {"z": [_rounded(length * z, 6) for _, z in body.points]}
        for body in around.near
    ]
    return {
        "bodies": bodies,
        "absent": [named(label, units) for label in around.absent],
        "box": [_rounded(length * v, 6) for v in (box.radius, box.low, box.high)],
    }


def _meridian(equilibrium: Equilibrium) -> dict[str, Array]:
    """Where the nodes are, without the stretches and stresses of a profile."""
    space = equilibrium.potential.space
    s = space.node_parameters()
    (u, _, w, _), (R, Z) = space.displacement(equilibrium.state, s), space.mesh.position(s)
    return {"rho": R + u, "eta": Z + w}


# --- numbers


def _rounded(value: Any, digits: int) -> float | None:
    """A number as JSON has it: null where it is none."""
    number = float(value)
    return float(f"{number:.{digits}g}") + 0.0 if np.isfinite(number) else None


#: powers of ten as they are written, from the first on
_FIRST = -300
_TENS = np.array([float(f"1e{k}") for k in range(_FIRST, 301)])


def _array(values: NDArray[Any], digits: int = _SHAPE) -> list[Any]:
    """Numbers as :func:`_rounded` has them, in lists within lists; all at once, for a page has tens of thousands."""
    v = np.asarray(values, dtype=float)
    finite = np.isfinite(v)
    size = np.abs(np.where(finite & (v != 0), v, 1.0))
    last = np.clip(digits - 1 - np.floor(np.log10(size)).astype(int), _FIRST, -_FIRST)  # the place that is rounded
    up, down = _TENS[np.maximum(last, 0) - _FIRST], _TENS[np.maximum(-last, 0) - _FIRST]
    with np.errstate(over="ignore"):
        rounded = np.rint(np.where(finite, v, 0.0) / down * up) / up * down + 0.0
    if finite.all():
        return rounded.tolist()
    found = rounded.astype(object)
    found[~finite] = None
    return found.tolist()


def _columns(line: Array) -> list[list[float | None]]:
    return _array(line.T, 6)
