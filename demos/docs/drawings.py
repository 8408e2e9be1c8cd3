"""The drawings of axes and signs on the page of the theory, from equilibria of the package."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import femmembrane as fm

INK, BLUE, RED, FAINT = "#222222", "#1f77b4", "#c0392b", "#dbe9f6"


def draw(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    axes(folder / "axes.png")
    signs(folder / "signs.png")
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
