"""Maps of a sweep over two keys and curves of one over one key.

Scenes without a value, and scenes that ended early, are hatched and named. Shades and hatches read the same in grey and to the
colour-blind.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, Status, unknown_name
from ..quantities import PLACES, Units, axis_label
from ..results.grid import DIMENSIONS, place_of_variable
from ..results.identities import FAMILIES, NOT_SURE, with_identities
from ..scene.laboratory import number_kind
from ..scene.number_units import shown_kind
from .backend import title_text
from .figures import BLUE, DASHED, DOTTED, ORANGE, SOLID, fitting_columns, new_figure, save_axes, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..results.sweep import Sweep

Array = NDArray[Any]

#: variables shown for each quantity by default, as far as the sweep has them
SHOWN = {
    "branch": ("limit_points", "limit_pressure#1", "limit_pressure#2", "largest_wrinkled_fraction"),
    "run": ("steps", "limit_points", "limit_pressure#1", "largest_wrinkled_fraction"),
    "equilibria": ("equilibria", "stable_equilibria"),
    "tipping": ("onset_center_height", "onset_pressure"),
    "wrinkling": ("onset_center_height", "onset_pressure"),
}
#: in place of those that are numbered, over one key: all of them in one panel
_ALL = {"limit_pressure#1": "limit_pressure", "limit_pressure#2": ""}
#: colours of numbered points, with dashes that tell them apart in grey
_LINES = (
    (BLUE, SOLID),
    (ORANGE, DASHED),
    ("#009e73", DOTTED),
    ("#cc79a7", (0, (6, 1.5, 1, 1.5))),
    ("#56b4e9", (0, (8, 2))),
)
_UNSURE = "not followed from a neighbour"
_OTHERWISE = "it has another number beside"
_HATCHES = ("////", "\\\\\\\\", "xxxx", "....", "----", "||||", "++++", "oooo")
_MARKERS = "osv^D<>p"
#: values that count something, in as many shades
_COUNTS = ("limit_points", "volume_folds", "equilibria", "stable_equilibria", "azimuthal_onsets")
#: more different counts than this share shades
_SHADES = 9


def plot_grid(
    sweep: Sweep,
    path: str | PathLike[str] | None = None,
    show: Sequence[str] | None = None,
    units: str = "scaled",
    ax: Axes | None = None,
) -> Figure | Axes:
    """One panel for each variable: a map over two keys, or a curve over one. On given axes: the first variable.

    Raises
    ------
    InputError
        For an unknown variable, three keys or more, a file that cannot be written, or SI units of scenes without scales of their own.
    """
    chosen = Units.of(units, sweep.scales)
    dims = tuple(sweep.over)
    if len(dims) > 2:
        allowed = "maps have two keys, curves one; choose values of the others by to_xarray().sel(...) for a plot of your own"
        raise InputError("over", list(dims), allowed)
    data = with_identities(sweep.to_xarray(), dims)  # of a file that lacks them
    names = list(_available(data, _shown(sweep.quantity, len(dims))) if show is None else show)
    panels = [(name, _factor(name, chosen), _values(data, name, dims)) for name in names]
    if not panels:
        raise InputError("sweep", sweep.quantity, "no scene has a result to show; status and message say why")
    numbers = {key: shown_kind(key, number_kind(key), chosen) for key in dims}
    data = data.assign_coords({key: shown.into(data[key].values) for key, shown in numbers.items() if data[key].dtype.kind in "if"})
    draw = _draw_map if len(dims) == 2 else _draw_curve
    handles: dict[str, Any] = {}
    hatches: dict[str, str] = {}
    if ax is None:
        figure, row = new_figure((5.2 * len(panels) + 0.4, 4.9), widths=[1.0] * len(panels))
    for axes, (name, factor, values) in zip(np.atleast_1d(row) if ax is None else [ax], panels, strict=ax is None):
        handles |= draw(axes, data, dims, name, _label(name, chosen), factor * values, hatches, factor)
        axes.set_xlabel(numbers[dims[0]].label)
        if len(dims) == 2:
            axes.set_ylabel(numbers[dims[1]].label)
    if ax is not None:
        if handles:
            ax.legend(list(handles.values()), list(handles), framealpha=0.9, edgecolor="none", fontsize=8.5)
        return save_axes(ax, path)
    if handles:
        figure.legend(
            list(handles.values()),
            list(handles),
            loc="outside lower center",
            frameon=False,
            fontsize=8.5,
            ncols=min(3, len(handles), fitting_columns(figure)),
        )
    figure.suptitle(title_text(sweep.scene.title), fontsize=11, wrap=True, parse_math=False)
    return save_figure(figure, path)


def _shown(quantity: str, keys: int) -> list[str]:
    names = SHOWN[quantity]
    return list(names) if keys > 1 else [shown for name in names if (shown := _ALL.get(name, name))]


def _available(data: Any, names: Sequence[str]) -> Iterator[str]:
    for name in names:
        variable, mark, place = _parts(name)
        if variable not in data:
            continue
        if mark == "#" and int(place) > _count(data, variable):
            continue
        if not mark and f"{_tag(variable)}identity" in data and not _count(data, variable):
            continue
        yield name


def _parts(name: str) -> tuple[str, str, str]:
    """A variable, whether points are named by number (#) or by place (.), and which."""
    mark = "#" if "#" in name else "."
    variable, found, place = str(name).partition(mark)
    return variable, found, place


def _tag(variable: str) -> str:
    """The family of the points whose places a variable holds; empty for others."""
    return next((tag for tag in FAMILIES if variable.removeprefix(tag) in PLACES and variable.startswith(tag)), "")


def _numbered(data: Any, variable: str) -> bool:
    """Whether a variable holds places of points that have numbers."""
    return bool(_tag(variable)) and f"{_tag(variable)}identity" in data


def _count(data: Any, variable: str) -> int:
    """How many numbers the points of a variable have."""
    if not _numbered(data, variable):
        return 0
    known = data[f"{_tag(variable)}identity"].values
    return int(np.nanmax(known)) if np.isfinite(known).any() else 0


def _of_number(data: Any, variable: str, number: int) -> Array:
    """The values of the point with a number, shape of the grid; NaN where there is none."""
    own = data[f"{_tag(variable)}identity"].values == number
    values = np.where(own, data[variable].values, 0.0).sum(axis=-1)
    return np.where(own.any(axis=-1), values, np.nan)


def _values(data: Any, name: str, dims: tuple[str, ...]) -> Array:
    """The numbers of a panel, shape of the grid; with one more axis for the numbers of points, where a curve shows all of them."""
    known = [str(v) for v in data.data_vars if data[v].dtype.kind == "f" and v in DIMENSIONS]
    variable, mark, place = _parts(name)
    if variable not in known:
        raise unknown_name("show", name, known)
    array = data[variable]
    if mark == "#":
        count = _count(data, variable)
        if not place.isdigit() or not 1 <= int(place) <= count:
            numbers = f"its points have numbers 1 to {count}" if count else "its values have no numbers"
            raise InputError("show", name, f"{variable} with a number such as {variable}#1 is allowed: {numbers}")
        return _of_number(data, variable, int(place))
    if array.ndim > len(dims) == 1 and not mark and _numbered(data, variable):
        return np.stack([_of_number(data, variable, k + 1) for k in range(_count(data, variable))], axis=-1)
    if array.ndim == len(dims):
        if place:
            raise InputError("show", name, f"{variable} has one value a scene: give no place")
        return array.values
    if not place.isdigit() or int(place) >= array.shape[-1]:
        allowed = f"{variable} with a place from 0 is allowed, such as {variable}.0: scenes have up to {array.shape[-1]}"
        if _numbered(data, variable):
            allowed += f"; or a point by its number, such as {variable}#1"
        raise InputError("show", name, allowed)
    return array.values[..., int(place)]


def _factor(name: str, units: Units) -> float:
    return units.factor(place_of_variable(_parts(name)[0])[0])


def _label(name: str, units: Units) -> str:
    """What a panel shows, with its unit."""
    variable, mark, place = _parts(name)
    quantity, what = place_of_variable(variable)
    if not quantity:
        return axis_label(variable)
    which = f" #{place}" if mark == "#" else f" {int(place) + 1}" if place else "s" if _tag(variable) else ""
    order = " of each branch" if mark == "." and _tag(variable) else ""
    return f"{what}{which}{order}: {axis_label(quantity, units)}"


def _reasons(data: Any, values: Array, name: str = "") -> Array:
    """Why a scene has no plain value: how its branch ended, or that nothing of the kind was found. Empty for plain values."""
    status = np.asarray(data["status"].values, dtype=object)
    outcome = np.asarray(data["outcome"].values, dtype=object) if "outcome" in data else np.full(status.shape, "none there", dtype=object)
    good = str(Status.CONVERGED)
    reasons = np.full(status.shape, "", dtype=object)
    missing = ~np.isfinite(values)
    ended = np.array([f"{s}, before there was one" for s in status.ravel()], dtype=object).reshape(status.shape)
    ended = np.where(np.asarray(data["has_result"].values), ended, status)
    reasons[missing] = np.where(status == good, outcome, ended)[missing]
    variable, mark, _ = _parts(name)
    if mark == "#":
        for what, reason in ((data[f"{_tag(variable)}cut"].values == 1, _OTHERWISE), (_unsure(data, variable), _UNSURE)):
            reasons[missing & what.any(axis=-1)] = reason
    early = ~missing & (status != good)
    reasons[early] = np.array([f"{s}, further on" for s in status[early]], dtype=object)
    return reasons


def _unsure(data: Any, variable: str) -> Array:
    """Which points of each scene have no number."""
    return np.asarray(data[f"{_tag(variable)}identity"].values == NOT_SURE)


def _positions(data: Any, key: str) -> tuple[Array, bool]:
    """Where the values of a key are on an axis, and whether they are numbers."""
    values = data[key].values
    numbers = values.dtype.kind in "if"
    return (values.astype(float) if numbers else np.arange(len(values), dtype=float)), numbers


def _edges(centers: Array) -> Array:
    """Ends of the cells around sorted values."""
    if len(centers) == 1:
        return centers[0] + np.array([-0.5, 0.5])
    middle = (centers[1:] + centers[:-1]) / 2
    return np.concatenate([[2 * centers[0] - middle[0]], middle, [2 * centers[-1] - middle[-1]]])


def _draw_map(
    axes: Axes, data: Any, dims: tuple[str, ...], name: str, label: str, values: Array, hatches: dict[str, str], factor: float
) -> dict[str, Any]:
    x, y = (_positions(data, key)[0] for key in dims)
    along, up = np.argsort(x), np.argsort(y)
    x_edges, y_edges = _edges(x[along]), _edges(y[up])
    grid = values[np.ix_(along, up)].T
    reasons = _reasons(data, values, name)[np.ix_(along, up)].T
    axes.set_facecolor("white")
    if np.isfinite(grid).any():
        _shade(axes, name, x_edges, y_edges, grid, grid[np.isfinite(grid) & (reasons == "")])
    axes.set(xlim=(x_edges[0], x_edges[-1]), ylim=(y_edges[0], y_edges[-1]))
    for key, positions, axis in ((dims[0], x, axes.xaxis), (dims[1], y, axes.yaxis)):
        if not _positions(data, key)[1]:
            axis.set_ticks(positions, [title_text(str(v)) for v in data[key].values], parse_math=False)
    axes.set_title(label, fontsize=10)
    return _hatch(axes, x_edges, y_edges, reasons, grid, hatches)


def _shade(axes: Axes, name: str, x_edges: Array, y_edges: Array, grid: Array, plain: Array) -> None:
    """Shades that span the plain values. Values of a branch that ended early, perhaps far away, have the shade of the end they pass."""
    from matplotlib import colormaps
    from matplotlib.colors import BoundaryNorm, ListedColormap

    masked = np.ma.masked_invalid(grid)
    counts = np.unique(grid[np.isfinite(grid)])
    if name in _COUNTS and len(counts) <= _SHADES:
        low, high = int(counts[0]), int(counts[-1])
        levels = np.arange(low, high + 1)
        shades = ListedColormap(colormaps["cividis"](np.linspace(0.05, 1.0, len(levels))))
        mesh = axes.pcolormesh(x_edges, y_edges, masked, cmap=shades, norm=BoundaryNorm(np.append(levels, high + 1) - 0.5, len(levels)))
        axes.figure.colorbar(mesh, ax=axes, ticks=levels).ax.minorticks_off()
    else:
        known = plain if plain.size else masked.compressed()
        low, high = known.min(), known.max()
        extend = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}
        ends = extend[bool(masked.min() < low), bool(masked.max() > high)]
        axes.figure.colorbar(axes.pcolormesh(x_edges, y_edges, masked, cmap="cividis", vmin=low, vmax=high), ax=axes, extend=ends)


def _hatch(axes: Axes, x_edges: Array, y_edges: Array, reasons: Array, grid: Array, hatches: dict[str, str]) -> dict[str, Any]:
    """Cells that are no plain values, a hatch for each reason, and their entries for a legend."""
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Patch

    handles = {}
    for reason in sorted(set(reasons.ravel()) - {""}):
        pattern = hatches.setdefault(reason, _HATCHES[len(hatches) % len(_HATCHES)])
        rows, columns = np.nonzero(reasons == reason)
        corners = [
            [(x_edges[j], y_edges[i]), (x_edges[j + 1], y_edges[i]), (x_edges[j + 1], y_edges[i + 1]), (x_edges[j], y_edges[i + 1])]
            for i, j in zip(rows, columns, strict=True)
        ]
        empty = bool(np.isnan(grid[rows, columns]).any())
        face = "0.93" if empty else "none"
        edge = "0.35" if empty else "0.75"
        axes.add_collection(PolyCollection(corners, facecolors=face, edgecolors=edge, linewidths=0, hatch=pattern))
        handles[reason] = Patch(facecolor="0.93" if empty else "0.45", edgecolor=edge, hatch=pattern, linewidth=0)
    return handles


def _draw_curve(
    axes: Axes, data: Any, dims: tuple[str, ...], name: str, label: str, values: Array, hatches: dict[str, str], factor: float
) -> dict[str, Any]:
    """A curve over one key; scenes without a plain value are marked at the foot, or on the curve."""
    (key,) = dims
    x, numbers = _positions(data, key)
    order = np.argsort(x)
    handles: dict[str, Any] = {}
    if values.ndim > 1:
        handles = _draw_numbered(axes, data, name, x, order, values, factor)
        with np.errstate(all="ignore"):
            values = np.where(np.isfinite(values).any(axis=-1), np.nanmin(np.where(np.isfinite(values), values, np.inf), axis=-1), np.nan)
    x, values, reasons = x[order], values[order], _reasons(data, values, name)[order]
    if not handles:
        axes.plot(x, values, "-", color=BLUE, linewidth=1.6, marker=".", markersize=5)
    axes.set(ylabel=label)
    axes.grid(color="0.92", linewidth=0.6)
    if not numbers:
        axes.set_xticks(x, [title_text(str(v)) for v in data[key].values[order]], parse_math=False)
    foot = np.nanmin(values) if np.isfinite(values).any() else 0.0
    for reason in sorted(set(reasons) - {""}):
        hatches.setdefault(reason, _MARKERS[len(hatches) % len(_MARKERS)])
        own = reasons == reason
        places = np.where(np.isfinite(values[own]), values[own], foot)
        (handles[reason],) = axes.plot(
            x[own], places, linestyle="none", marker=hatches[reason], color="#222222", markerfacecolor="white", markersize=6
        )
    return handles


def _draw_numbered(axes: Axes, data: Any, name: str, x: Array, order: Array, values: Array, factor: float) -> dict[str, Any]:
    """A line for each numbered point, which ends where the point does; points without a number are hollow and joined by nothing."""
    what = place_of_variable(name)[1]
    handles: dict[str, Any] = {}
    for k, curve in enumerate(values[order].T):
        if k < len(_LINES):
            color, dashes = _LINES[k]
            (handles[f"{what} #{k + 1}"],) = axes.plot(
                x[order], curve, linestyle=dashes, color=color, linewidth=1.6, marker=".", markersize=5
            )
        else:
            (handles[f"{what}s with higher numbers"],) = axes.plot(
                x[order], curve, ":", color="0.6", linewidth=1.2, marker=".", markersize=4
            )
    rows, places = np.nonzero(_unsure(data, name))
    if rows.size:
        unsure = factor * data[name].values[rows, places]
        look: dict[str, Any] = {"linestyle": "none", "marker": "o", "color": "0.45", "markerfacecolor": "white", "markersize": 5}
        (handles[_UNSURE],) = axes.plot(x[rows], unsure, **look)
    return handles
