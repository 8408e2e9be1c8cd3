"""Tipped states against triangles in space: another kinematics, another mesh, no harmonics.

The surface is made of curved triangles of six nodes. The strain energy is Ogden's of the stretches from the metric at each quadrature
point, the volume is that below the triangles. Newton's method at a held volume starts from the state to be checked.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

import femmembrane as fm
from tests.solve.test_tipped import branch, tipping, upright

Array = NDArray[np.float64]
RINGS = 8


def at_a_point() -> ca.Function:
    """(position, deformation gradient) -> densities of energy and volume, each with gradient and Hessian."""
    y = ca.SX.sym("y", 9)
    x, F = y[:3], ca.reshape(y[3:], 3, 2)
    C = ca.mtimes(F.T, F)
    trace, determinant = C[0, 0] + C[1, 1], C[0, 0] * C[1, 1] - C[0, 1] ** 2
    larger = trace / 2 + ca.sqrt((C[0, 0] - C[1, 1]) ** 2 / 4 + C[0, 1] ** 2 + 1e-24)
    squares = (larger, determinant / larger, 1 / determinant)
    material, source = tipping().material, tipping().sources[0]
    W = sum(m / a * (sum(s ** (a / 2) for s in squares) - 3) for m, a in zip(material.mu, material.alpha, strict=True))
    z = x[2] - source.height
    field = source.strength * (x[0] ** 2 + x[1] ** 2 + 4 * z**2) / (x[0] ** 2 + x[1] ** 2 + z**2) ** 4
    volume = x[2] * (F[0, 0] * F[1, 1] - F[1, 0] * F[0, 1])
    rows = [part for f in (W - 2.5 / 2 * field, volume) for H, g in [ca.hessian(f, y)] for part in (f, g, ca.reshape(H, 81, 1))]
    return ca.Function("point", [y], [ca.densify(ca.vertcat(*rows))])


#: quadrature of degree four on a triangle: barycentric coordinates and weights
_A, _B = 0.445948490915965, 0.091576213509771
POINTS = np.array([[1 - 2 * g, g, g] for g in (_A, _B)] + [[g, 1 - 2 * g, g] for g in (_A, _B)] + [[g, g, 1 - 2 * g] for g in (_A, _B)])
WEIGHTS = np.array([0.223381589678011, 0.109951743655322] * 3) / 2


def shape_functions() -> tuple[Array, Array]:
    """Values (6 points, 6 nodes) and slopes (6 points, 6 nodes, 2); nodes are the corners, then the middles of 01, 12, 20."""
    L = POINTS
    values = np.concatenate([L * (2 * L - 1), 4 * L * np.roll(L, -1, axis=1)], axis=1)
    dL = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    corner = (4 * L - 1)[:, :, None] * dL
    middle = 4 * (L[:, :, None] * np.roll(dL, -1, axis=0) + np.roll(L, -1, axis=1)[:, :, None] * dL)
    return values, np.concatenate([corner, middle], axis=1)


@dataclass
class Triangles:
    """A disc of rings of triangles."""

    rest: Array
    cells: NDArray[np.int64]

    @classmethod
    def of(cls, rings: int) -> Triangles:
        points, cells = [np.zeros((1, 2))], []
        first = [0] + [1 + 3 * k * (k - 1) for k in range(1, rings + 1)]
        for k in range(1, rings + 1):  # 6 k points on the k-th ring
            angle = 2 * np.pi * np.arange(6 * k) / (6 * k)
            points.append(k / rings * np.stack([np.cos(angle), np.sin(angle)], axis=1))
            for sector in range(6):
                for i in range(k):
                    outer = [first[k] + (sector * k + i + j) % (6 * k) for j in (0, 1)]
                    inner = [first[k - 1] + (sector * (k - 1) + i + j) % max(6 * (k - 1), 1) for j in (0, 1)]
                    cells.append([inner[0], outer[0], outer[1]])
                    if i < k - 1:
                        cells.append([inner[0], outer[1], inner[1]])
        corners, triangles = np.concatenate(points), np.array(cells)
        edges = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
        unique, number = np.unique(edges, axis=0, return_inverse=True)
        middles = corners[unique].mean(axis=1)
        rim = (unique >= first[-1]).all(axis=1)
        middles[rim] /= np.hypot(*middles[rim].T)[:, None]  # the rim is a circle
        return cls(np.concatenate([corners, middles]), np.concatenate([triangles, len(corners) + number.reshape(-1, 3)], axis=1))

    def solve(self, x: Array, volume: float, pressure: float) -> tuple[Array, float, float]:
        """Positions, energy and pressure of the equilibrium at a volume."""
        values, slopes = shape_functions()
        jacobian = np.einsum("eni,qnj->eqij", self.rest[self.cells], slopes)
        weight = np.linalg.det(jacobian) * WEIGHTS
        slopes = np.einsum("qnj,eqji->eqni", slopes, np.linalg.inv(jacobian))
        B = np.zeros((*weight.shape, 9, 6, 3))  # position and deformation gradient, column by column, from the nodes
        for k in range(3):
            B[:, :, k, :, k] = values
            B[:, :, 3 + k, :, k], B[:, :, 6 + k, :, k] = slopes[..., 0], slopes[..., 1]
        B = B.reshape(*weight.shape, 9, 18)
        kernel = at_a_point().map(weight.size)
        place = (3 * self.cells[:, :, None] + np.arange(3)).reshape(len(self.cells), 18)
        free = np.flatnonzero(np.repeat(np.hypot(*self.rest.T) < 1 - 1e-9, 3))
        rows, columns = np.repeat(place, 18, axis=1).ravel(), np.tile(place, (1, 18)).ravel()
        y = x.ravel().copy()
        for _ in range(12):
            local = np.einsum("eqlk,ek->leq", B, y[place])
            found = np.asarray(kernel(local.reshape(9, -1))).reshape(2, 91, *weight.shape) * weight
            gradients = [np.bincount(place.ravel(), np.einsum("leq,eqlk->ek", part[1:10], B).ravel(), y.size)[free] for part in found]
            second = (found[0, 10:] - pressure * found[1, 10:]).reshape(9, 9, *weight.shape)
            local_K = np.einsum("eqlk,lmeq,eqmn->ekn", B, second, B, optimize=True)
            K = sparse.csc_matrix((local_K.ravel(), (rows, columns)), shape=(y.size, y.size))[free][:, free]
            row = sparse.csc_matrix(gradients[1])
            system = sparse.bmat([[K, -row.T], [row, None]], format="csc")
            step = splu(system).solve(np.append(pressure * gradients[1] - gradients[0], volume - found[1, 0].sum()))
            y[free] += step[:-1]
            pressure += step[-1]
            if np.abs(step[:-1]).max() < 1e-9:
                return y.reshape(-1, 3), float(found[0, 0].sum()), float(pressure)
        raise AssertionError("no equilibrium of triangles was found")


def placed(eq: fm.TippedEquilibrium, points: Array) -> Array:
    """Where a state carries points of the disc."""
    radius, angle = np.hypot(*points.T), np.arctan2(points[:, 1], points[:, 0])
    nodes = eq.potential.space.node_parameters()
    moved = eq.tipped.shape(eq.state, angle)[0]
    a, c, b = (np.array([np.interp(r, nodes, part[:, k]) for k, r in enumerate(radius)]) for part in moved)
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([(radius + a) * cos - c * sin, (radius + a) * sin + c * cos, b], axis=1)


@pytest.fixture(scope="module")
def states() -> dict[str, tuple[Array, float, float]]:
    mesh, volume = Triangles.of(RINGS), upright(0.3).volume
    eq = branch()[-1]
    round_ = fm.TippedEquilibrium(**{**vars(eq), "state": eq.tipped.harmonics.lifted(upright(0.3).state), "_answers": {}})
    return {
        "upright": mesh.solve(placed(round_, mesh.rest), volume, upright(0.3).pressure),
        "tipped": mesh.solve(placed(eq, mesh.rest), volume, eq.pressure),
    }


def test_the_energy_falls_by_as_much(states: dict[str, tuple[Array, float, float]]) -> None:
    fall = states["tipped"][1] - states["upright"][1]
    assert fall == pytest.approx(branch()[-1].energy - upright(0.3).energy, rel=0.015)


def test_the_pressures_are_the_same(states: dict[str, tuple[Array, float, float]]) -> None:
    assert states["upright"][2] == pytest.approx(upright(0.3).pressure, rel=1e-4)
    assert states["tipped"][2] == pytest.approx(branch()[-1].pressure, rel=1e-3)


def test_the_pole_moves_as_far(states: dict[str, tuple[Array, float, float]]) -> None:
    assert abs(states["tipped"][0][0, 0]) == pytest.approx(abs(branch()[-1].shift), rel=0.015)
    assert states["upright"][0][0, 0] == pytest.approx(0.0, abs=1e-9)
    assert states["tipped"][0][0, 2] == pytest.approx(branch()[-1].center_height, rel=3e-3)
