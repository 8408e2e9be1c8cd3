"""Errors against unknowns or element size, in logarithmic scales."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import unknown_name
from ..quantities import axis_label
from ..results.convergence import RESOLVED, Convergence
from .figures import fitting_columns, new_figure, save_axes, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

AGAINST = ("unknowns", "element_size")
_MARKERS = "osD^vPX*"
_DASHES: tuple[Any, ...] = (
    "-",
    (0, (6, 2)),
    (0, (3, 1.5)),
    (0, (1, 1.2)),
    (0, (6, 1.5, 1, 1.5)),
    (0, (9, 2)),
    (0, (2, 3)),
    (0, (4, 1, 1, 1)),
)


def plot_convergence(
    study: Convergence,
    path: str | PathLike[str] | None = None,
    *,
    ax: Axes | None = None,
    quantities: Sequence[str] | None = None,
    against: str = "unknowns",
) -> Figure | Axes:
    """One panel a quantity, one line a degree with its own marker and dashes; the last order that is resolved stands at its line.

    Hollow markers in the grey band are errors that the reference does not resolve.

    Parameters
    ----------
    study : Convergence
    path : path, optional
        Picture to write; the suffix chooses the format.
    ax : matplotlib Axes, optional
        Where to draw one quantity, the first of ``quantities``.
    quantities : sequence of str, optional
        Default: pressure (or volume, where the pressure is held), the eigenvalue under the other control, the profile in both norms.
    against : {"unknowns", "element_size"}

    Raises
    ------
    InputError
        For an unknown quantity or axis, or a file that cannot be written.
    """
    if against not in AGAINST:
        raise unknown_name("against", str(against), AGAINST)
    first = "volume" if study.control == "pressure" else "pressure"
    asked = (first, "lambda_volume", "profile_l2", "profile_h1") if quantities is None else tuple(quantities)
    for name in asked:
        if name not in study.quantities:
            raise unknown_name("quantities", str(name), study.quantities)
    if ax is not None:
        handles = _draw(ax, study, asked[0], against)
        ax.set_ylabel("relative error (numbers: observed orders)")
        ax.legend(handles=[*handles, _band()], fontsize=9, framealpha=0.9, edgecolor="none", handlelength=3.6)
        return save_axes(ax, path)
    figure, axes = new_figure((3.3 * len(asked) + 0.4, 4.4), title=study.scene.title or " ", widths=(1.0,) * len(asked))
    handles = []
    for panel, name in zip(np.atleast_1d(axes), asked, strict=True):
        handles = _draw(panel, study, name, against)
    np.atleast_1d(axes)[0].set_ylabel("relative error (numbers: observed orders)")
    handles.append(_band())
    columns = min(len(handles), 2 * len(asked), fitting_columns(figure))
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, frameon=False, fontsize=9, handlelength=3.6)
    return save_figure(figure, path)


def _band() -> Any:
    from matplotlib.patches import Patch

    return Patch(color="0.92", label="not resolved")


def _draw(axes: Axes, study: Convergence, name: str, against: str) -> list[Any]:
    errors, resolved, orders = study.errors[name], study.resolved(name), study.orders(name)
    if study.scale[name] == 1:
        axes.set_title(f"{axis_label(name)} (absolute)", fontsize=10)
    else:
        axes.set_title(axis_label(name), fontsize=10)
    _scales(axes, axis_label(against))
    shades = np.linspace(0.0, 0.55, len(study.degrees))
    handles = []
    for i, degree in enumerate(study.degrees):
        x = study.unknowns[i].astype(float) if against == "unknowns" else study.element_size
        look: dict[str, Any] = {"color": str(shades[i]), "marker": _MARKERS[degree - 1], "markersize": 5.5, "linewidth": 1.3}
        shown = np.where(errors[i] > 0, errors[i], np.nan)
        handles += axes.plot(x, np.where(resolved[i], shown, np.nan), linestyle=_DASHES[degree - 1], label=f"degree {degree}", **look)
        axes.plot(x, np.where(resolved[i], np.nan, shown), **(look | {"linestyle": "none", "markerfacecolor": "white"}))
        known = np.flatnonzero(np.isfinite(orders[i]))
        if known.size:
            k = known[-1]
            middle = (np.sqrt(x[k - 1] * x[k]), np.sqrt(errors[i, k - 1] * errors[i, k]))
            side = 1 if against == "unknowns" else -1  # above the line, which falls or rises
            beside: dict[str, Any] = {"xytext": (4 * side, 4), "textcoords": "offset points", "ha": "left" if side > 0 else "right"}
            axes.annotate(f"{orders[i, k]:.1f}", middle, fontsize=8.5, **beside)
    low, high = axes.get_ylim()
    top = RESOLVED * study.floors[name]
    bottom = min(low, top / 30)
    axes.axhspan(bottom, top, color="0.92", zorder=0, linewidth=0)
    axes.set_ylim(bottom, high)
    return handles


def _scales(axes: Axes, across: str) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel(across)
    axes.grid(color="0.9", linewidth=0.6)
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
