"""The drawings of axes and signs on the page of the theory, from equilibria of the package."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import femmembrane as fm

#: behind words over lines
PAPER = {"facecolor": "white", "edgecolor": "none", "pad": 1.0}
INK, BLUE, RED, FAINT = "#222222", "#1f77b4", "#c0392b", "#dbe9f6"


def draw(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    axes(folder / "axes.png")
    signs(folder / "signs.png")
    electric(folder / "electric.png")
    bending(folder / "bending.png")
    onset(folder / "onset.png")
    contact(folder / "contact.png")
    table(folder / "table.png")


def arrow(panel: Any, start: Any, end: Any, color: str = INK, width: float = 1.3) -> None:
    style = {"arrowstyle": "-|>", "color": color, "linewidth": width, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 12}
    panel.annotate("", end, start, arrowprops=style)


def axes(path: Path) -> None:
    """Reference and deformed meridian, a point with its tangent and normal, the dipole, and the pressure."""
    from matplotlib.figure import Figure

    height = 2.0
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16), sources=[fm.Dipole(strength=0.01, height=height)], susceptibility=1.0)
    profile = fm.equilibrium(scene, volume=2.6).profile(np.linspace(0.0, 1.0, 201))
    rho, eta = profile["rho"], profile["eta"]
    figure = Figure(figsize=(6.4, 5.8), facecolor="white", layout="constrained")
    panel = figure.add_subplot()
    panel.plot(-rho, eta, color=BLUE, linewidth=1.2)
    panel.plot(rho, eta, color=BLUE, linewidth=2.4)
    panel.plot([0, 1], [0, 0], color=INK, linewidth=2.0, dashes=(4, 2))
    arrow(panel, (-1.35, 0), (1.75, 0))
    arrow(panel, (0, -0.25), (0, 2.75))
    panel.text(1.77, 0.0, "$r$", va="center")
    panel.text(0.05, 2.7, "$z$")
    k = 80
    point = np.array([rho[k], eta[k]])
    panel.plot([0, point[0], point[0]], [point[1], point[1], 0], color="0.5", linewidth=0.9, linestyle=":")
    panel.text(0.06, point[1] - 0.04, r"$\rho$", va="top")
    panel.text(point[0] + 0.03, 0.12, r"$\eta$")
    panel.plot(*point, "o", color=BLUE, markersize=6)
    tangent = np.array([rho[k + 1] - rho[k - 1], eta[k + 1] - eta[k - 1]])
    tangent /= np.linalg.norm(tangent)
    normal = np.array([-tangent[1], tangent[0]])
    for direction, name in ((tangent, r"$\mathbf{t}$"), (normal, r"$\mathbf{\nu}$")):
        arrow(panel, point, point + 0.45 * direction)
        panel.text(*(point + 0.53 * direction), name, ha="center", va="center")
    r = k / 200
    panel.plot(r, 0, "o", color=INK, markersize=5)
    panel.text(r, -0.1, "the same point at rest, at $R$", ha="center", va="top", fontsize=10)
    for j in (35, 90, 165):
        slope = np.array([rho[j + 1] - rho[j - 1], eta[j + 1] - eta[j - 1]])
        out = np.array([-slope[1], slope[0]]) / np.linalg.norm(slope)
        end = np.array([rho[j], eta[j]]) - 0.03 * out
        arrow(panel, (end - 0.25 * out) * (-1, 1), end * (-1, 1), BLUE)
    panel.text(-0.45, 0.3, "$P > 0$ pushes\nfrom inside", color=BLUE, ha="center", fontsize=10)
    arrow(panel, (0, height - 0.14), (0, height + 0.2), RED, 2.5)
    panel.plot(0, height, "o", color=RED, markersize=7)
    panel.text(0.1, height, r"dipole at $z = h$, moment along $z$", color=RED, va="center")
    panel.plot(1, 0, "s", color=INK, markersize=7)
    panel.text(1.12, 0.06, "rim, clamped", va="bottom", fontsize=10)
    panel.text(0.05, eta[0] + 0.06, "pole", fontsize=10)
    panel.set(xlim=(-1.45, 1.9), ylim=(-0.3, 2.85), aspect="equal")
    panel.axis("off")
    figure.savefig(path, dpi=150)


def signs(path: Path) -> None:
    """Four shapes, each with its inside filled, and arrows along which a positive pressure pushes."""
    from matplotlib.figure import Figure

    shapes = (
        ("flat: the inside is below", fm.disc(16), 2.2),
        ("cap", fm.cap(0.5, elements=16), 1.6),
        ("cap of negative height: a bowl", fm.cap(-0.5, elements=16), 1.6),
        ("tube, with flat lids", fm.cylinder(1.4, elements=16), 6.0),
    )
    figure = Figure(figsize=(10, 2.5), facecolor="white", layout="constrained")
    for panel, (title, mesh, volume) in zip(figure.subplots(1, 4), shapes, strict=True):
        state = fm.equilibrium(fm.Scene(material=fm.NeoHookean(), mesh=mesh), volume=volume)
        profile = state.profile()
        rho, eta = profile["rho"], profile["eta"]
        panel.fill(np.concatenate([rho, -rho[::-1]]), np.concatenate([eta, eta[::-1]]), color=FAINT)
        ends = [k for k in (0, -1) if rho[k] > 1e-6]
        for side in (1, -1):
            panel.plot(side * rho, eta, color=BLUE, linewidth=2)
        for k in ends:
            panel.plot([-rho[k], rho[k]], [eta[k], eta[k]], color="0.4", linewidth=1, dashes=(4, 3))
            panel.plot([-rho[k], rho[k]], [eta[k], eta[k]], "s", color=INK, markersize=5)
        middle = np.array([0.0, (eta.max() + eta.min()) / 2])
        turn = 1 if mesh_side(rho, eta, middle) else -1
        for share in (0.25, 0.6):
            j = int(share * (len(rho) - 1))
            slope = np.array([rho[j + 1] - rho[j - 1], eta[j + 1] - eta[j - 1]])
            out = turn * np.array([-slope[1], slope[0]]) / np.linalg.norm(slope)
            for side in (1, -1):
                mirror = np.array([side, 1.0])
                end = (np.array([rho[j], eta[j]]) - 0.03 * out) * mirror
                arrow(panel, end - 0.25 * out * mirror, end, BLUE)
        panel.text(0, middle[1] + (0 if len(ends) > 1 else -0.25 * turn), "$V > 0$", ha="center", va="center")
        panel.set_title(title, fontsize=10)
        panel.set(xlim=(-1.4, 1.4), ylim=(middle[1] - 0.95, middle[1] + 0.95), aspect="equal")
        panel.axis("off")
    figure.savefig(path, dpi=150)


def electric(path: Path) -> None:
    """A piece of a sheet with electrodes, at rest and under a voltage."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

    figure = Figure(figsize=(8, 2.6), facecolor="white", layout="constrained")
    for panel, width, height, charged in zip(figure.subplots(1, 2), (2.0, 2.6), (0.8, 0.48), (False, True), strict=True):
        panel.add_patch(Rectangle((-width / 2, -height / 2), width, height, facecolor=FAINT, edgecolor="none"))
        for side in (1, -1):
            panel.plot([-width / 2, width / 2], 2 * [side * height / 2], color=INK, linewidth=3, solid_capstyle="butt")
        arrow(panel, (-width / 2, -0.75), (width / 2, -0.75))
        arrow(panel, (width / 2, -0.75), (-width / 2, -0.75))
        panel.text(0, -0.82, "in both directions", ha="center", va="top", fontsize=9)
        across = -width / 2 - 0.18
        arrow(panel, (across, -height / 2), (across, height / 2))
        arrow(panel, (across, height / 2), (across, -height / 2))
        panel.text(across - 0.08, 0, r"$T/J$" if charged else r"$T$", ha="right", va="center")
        if charged:
            for x in (-1.2, -0.7, -0.2, 0.3, 0.8):
                arrow(panel, (x, height / 2 - 0.06), (x, -height / 2 + 0.06), RED)
                for side, sign in ((1, "+"), (-1, "\u2212")):
                    panel.text(x + 0.2, side * (height / 2 + 0.11), sign, color=RED, ha="center", va="center", fontsize=11)
            panel.text(width / 2 + 0.1, 0, "field\n" + r"$J\,\Phi/T$", color=RED, va="center", fontsize=10)
        panel.set_title(r"under a voltage $\Phi$" if charged else "at rest, with compliant electrodes", fontsize=10)
        panel.set(xlim=(-2.0, 2.1), ylim=(-1.1, 0.75), aspect="equal")
        panel.axis("off")
    figure.savefig(path, dpi=150)


def bending(path: Path) -> None:
    """A piece of a deformed surface with its frame, and the waves that change its two curvatures."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 3.0), facecolor="white", layout="constrained")
    for panel, waves, name in zip(
        figure.subplots(1, 2),
        ((2.0, 0), (0, 5)),
        (r"$k_{11}$: waves along the meridian", r"$k_{22}$: waves around the axis"),
        strict=True,
    ):
        angle, along = np.meshgrid(np.linspace(-0.6, 0.6, 121), np.linspace(0.35, 1.05, 121))
        radius = (
            1
            + 0.05 * np.sin(2 * np.pi * waves[0] * (along - 0.35) / 0.7) * bool(waves[0])
            + 0.05 * np.cos(5 * np.pi * angle / 1.2) * bool(waves[1])
        )
        x, y, z = radius * np.sin(along) * np.sin(angle), radius * np.sin(along) * np.cos(angle), radius * np.cos(along)
        across, up = x, 0.75 * z - 0.62 * y  # seen from above and in front
        for k in range(0, 121, 15):
            panel.plot(across[:, k], up[:, k], color="0.55", linewidth=1.0)
            panel.plot(across[k], up[k], color=BLUE, linewidth=1.4)
        middle = (60, 60)
        start = np.array([across[middle], up[middle]])
        down = np.array([across[105, 60], up[105, 60]]) - start
        side = np.array([across[60, 105], up[60, 105]]) - start
        arrow(panel, start, start + down, INK, 2)
        arrow(panel, start, start + side, INK, 2)
        arrow(panel, start, start + np.array([0, 0.3]), RED, 2)
        panel.text(*(start + down + (0.04, 0.0)), r"$\mathbf{t}$, along $s$", bbox=PAPER)
        panel.text(*(start + side + (0.03, 0.02)), r"$\theta$")
        panel.text(*(start + np.array([0.04, 0.27])), r"$\mathbf{\nu}$", color=RED, bbox=PAPER)
        panel.set_title(name, fontsize=10)
        panel.set(aspect="equal")
        panel.axis("off")
    figure.savefig(path, dpi=150)


def onset(path: Path) -> None:
    """Amplitude against load, and energy over the amplitude, for both signs of Koiter's coefficient."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 2.9), facecolor="white", layout="constrained")
    gradual, energy, jump, falling = figure.subplots(1, 4)
    amplitude, dashed = np.linspace(-1, 1, 201), {"linestyle": (0, (4, 2))}
    for panel, sign, title in ((gradual, 1, r"$b > 0$: gradual"), (jump, -1, r"$b < 0$: a jump")):
        panel.plot([-1, 0], [0, 0], color=BLUE, linewidth=2)
        panel.plot([0, 1], [0, 0], color=BLUE, linewidth=1.3, **dashed)
        for half in (amplitude[amplitude >= 0], amplitude[amplitude <= 0]):
            panel.plot(sign * half**2, half, color=RED, linewidth=2 if sign > 0 else 1.3, **({} if sign > 0 else dashed))
        panel.plot(0, 0, "v", color=INK, markersize=8, markerfacecolor=INK if sign < 0 else "white")
        panel.set(title=title, xlabel=r"load $\rightarrow$", ylabel=r"amplitude $\xi$", xticks=[], yticks=[0])
    for panel, sign in ((energy, 1), (falling, -1)):
        for slope, color, name in ((1, BLUE, "before"), (-1, RED, "after")):
            panel.plot(
                amplitude, 0.35 * slope * amplitude**2 / 2 + 0.4 * sign * amplitude**4, color=color, linewidth=2 if slope > 0 else 1.5
            )
            k = 165
            value = 0.35 * slope * amplitude[k] ** 2 / 2 + 0.4 * sign * amplitude[k] ** 4
            place = {(1, 1): (0.35, 0.3), (1, -1): (0.35, -0.16), (-1, 1): (0.3, 0.11), (-1, -1): (0.0, -0.4)}[sign, slope]
            look = {"color": color, "fontsize": 9, "arrowprops": {"arrowstyle": "-", "color": color, "linewidth": 0.8}}
            panel.annotate(name, (amplitude[k], value), place, **look)
        panel.set(title="its energy", xlabel=r"amplitude $\xi$", ylabel=r"$U(\xi) - U(0)$", xticks=[0], yticks=[0], ylim=(-0.6, 0.6))
    for panel in (gradual, jump, energy, falling):
        panel.spines[["top", "right"]].set_visible(False)
    figure.savefig(path, dpi=150)


def contact(path: Path) -> None:
    """A membrane against a ball: gap and normal of a free point, the force on a held one, and the border between them."""
    from matplotlib.figure import Figure

    middle, size = 1.35, 0.9
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16), obstacles=[fm.Ball(radius=size, height=middle)])
    profile = fm.equilibrium(scene, volume=1.2).profile(np.linspace(0.0, 1.0, 401))
    rho, eta = profile["rho"], profile["eta"]
    figure = Figure(figsize=(6.2, 3.6), facecolor="white", layout="constrained")
    panel = figure.add_subplot()
    turn = np.linspace(0, 2 * np.pi, 241)
    panel.fill(size * np.cos(turn), middle + size * np.sin(turn), color="0.85")
    held = profile["contact_pressure"] > 0
    panel.plot(-rho, eta, color=BLUE, linewidth=1.2)
    panel.plot(rho, eta, color=BLUE, linewidth=2)
    panel.plot(rho[held], eta[held], color=INK, linewidth=4)
    border = int(np.flatnonzero(held)[-1])
    panel.plot(rho[border], eta[border], "o", color=INK, markersize=6)
    panel.annotate(
        "border of contact:\nit leaves along the tangent",
        (rho[border], eta[border]),
        (1.0, 1.4),
        fontsize=9,
        arrowprops={"arrowstyle": "-", "color": "0.4"},
    )
    point = np.array([rho[300], eta[300]])
    away = point - (0, middle)
    away /= np.linalg.norm(away)
    foot = np.array([0, middle]) + size * away
    panel.plot(*np.stack([foot, point]).T, color=RED, linewidth=1.5, linestyle=(0, (3, 2)))
    panel.text(*((foot + point) / 2 + (0.06, 0.04)), r"$g$", color=RED, ha="left", va="center")
    panel.plot(*point, "o", color=RED, markersize=5)
    arrow(panel, point, point + 0.3 * away, RED, 2)
    panel.text(*(point + 0.36 * away), r"$\mathbf{n}$", color=RED, ha="center", va="center")
    k = border // 2
    point = np.array([rho[k], eta[k]])
    away = (point - (0, middle)) / size
    arrow(panel, point, point + 0.3 * away, INK, 2)
    panel.text(*(point + 0.36 * away), r"$f\,\mathbf{n}$", ha="center", va="center")
    panel.text(0, middle, "rigid body", ha="center", fontsize=10)
    panel.set(xlim=(-1.5, 1.9), ylim=(-0.1, 1.75), aspect="equal")
    panel.axis("off")
    figure.savefig(path, dpi=150)


def table(path: Path) -> None:
    """What stands for a demo that draws nothing."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4, 2.8), facecolor="white")
    panel = figure.add_axes((0, 0, 1, 1))
    for row in range(6):
        for column, width in enumerate((0.16, 0.12, 0.14, 0.1)):
            panel.barh(-row, width, left=0.24 * column, height=0.3, color=BLUE if row == 0 else "0.8")
    panel.set(xlim=(-0.12, 0.98), ylim=(-5.8, 0.8))
    panel.axis("off")
    figure.savefig(path, dpi=100)


def mesh_side(rho: np.ndarray, eta: np.ndarray, inside: np.ndarray) -> bool:
    """Whether the normal to the left of the meridian points away from a point inside."""
    j = len(rho) // 2
    slope = np.array([rho[j + 1] - rho[j - 1], eta[j + 1] - eta[j - 1]])
    return float(np.dot([-slope[1], slope[0]], np.array([rho[j], eta[j]]) - inside)) > 0


if __name__ == "__main__":
    draw(Path(__file__).parent / "generated" / "drawings")
