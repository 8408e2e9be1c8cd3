"""Bending in the second variation: buckling of plates, curvature changes of surfaces, Hermite elements, and the worst number of waves."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import chebyshev
from scipy.linalg import eigh, null_space
from scipy.optimize import brentq
from skfem import Basis, ElementLineHermite, MeshLine

import femmembrane as fm
from femmembrane.errors import InputError
from femmembrane.potential import potential_of
from femmembrane.stability import bending
from femmembrane.stability.azimuthal import azimuthal_eigenvalue
from femmembrane.stability.azimuthal_operator import azimuthal_operator
from femmembrane.stability.bending import bending_form
from femmembrane.stability.second_variation import PAIRS, response_at_quadrature
from femmembrane.stability.spectrum import smallest_of
from femmembrane.stability.worst_waves import worst_waves
from tests.cases import OGDEN

THICKNESS = 1e-3
#: squares of the first zeros of J_1, J_2, J_3: N a^2/B of a clamped circular plate with n = 0, 1, 2 (Timoshenko and Gere 1961, section 9.3)
CLAMPED_PLATE = (14.681971, 26.374616, 40.706466)


def flat(prestretch: float, elements: int = 12, degree: int = 4, **changes: Any) -> fm.Scene:
    changes = {"bending": True, "radius_to_thickness": 1 / THICKNESS, **changes}
    return fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(elements), degree=degree, prestretch=prestretch, **changes)


def eigenvalue_at_rest(scene: fm.Scene, n: int) -> float:
    potential = potential_of(scene)
    pencil = azimuthal_operator(potential, np.zeros(potential.space.n_free), 0.0, n).pencil()
    return smallest_of(pencil, pencil.block_iterations()).value


def buckling_load(n: int, elements: int, degree: int, thickness: float = THICKNESS) -> float:
    """N a^2/B at which the eigenvalue of a compressed flat disc vanishes."""
    squared = thickness**2
    scenes = {"elements": elements, "degree": degree, "radius_to_thickness": 1 / thickness}
    strain = brentq(lambda e: eigenvalue_at_rest(flat(1 - e, **scenes), n), squared / 5, 20 * squared, xtol=1e-11 * squared, rtol=1e-10)
    stretch = 1 - strain
    return float(np.expm1(-6 * np.log(stretch)) * stretch**2 / (squared / 3))


@pytest.mark.parametrize("n", range(3))
def test_a_clamped_plate_buckles(n: int) -> None:
    """Strains are 1e-6 there, which the plate of small strains leaves out."""
    assert buckling_load(n, 12, 4) == pytest.approx(CLAMPED_PLATE[n], rel=2e-5)


@pytest.mark.parametrize("degree", [2, 3])
def test_the_order_of_buckling_loads(degree: int) -> None:
    """2 (p - 1): elements of degree p have curvatures of order p - 1."""
    exact = buckling_load(1, 12, 5)
    errors = [buckling_load(1, elements, degree) - exact for elements in (8, 16, 32)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (errors[-1] / exact, *orders) == pytest.approx((1.1e-3 if degree == 2 else 4.0e-7, *[2 * (degree - 1)] * 2), rel=0.25)


def test_the_penalty_does_not_matter_once_resolved(monkeypatch: pytest.MonkeyPatch) -> None:
    loads = []
    for penalty in (2.5, 5.0, 40.0):
        monkeypatch.setattr(bending, "PENALTY", penalty)
        bending._form_of.cache_clear()
        loads.append(buckling_load(2, 16, 4))
    bending._form_of.cache_clear()
    assert loads == pytest.approx([loads[1]] * 3, rel=3e-7)


@pytest.mark.parametrize("thickness", [0.1, 1e-3, 1e-4])
def test_a_plate_of_any_thickness(thickness: float) -> None:
    """With the moduli and the thickness of the compressed neo-Hookean sheet, -s l^2 = j^2 (T^2/12) l^-4 (l^2 + 3 l^-4)."""
    squared = thickness**2

    def excess(strain: float) -> float:
        l = 1 - strain  # noqa: E741
        return float(np.expm1(-6 * np.log(l)) * l**4 - CLAMPED_PLATE[0] * squared / 12 * l**-4 * (l**2 + 3 * l**-4))

    strain = brentq(excess, squared / 5, 20 * squared, xtol=1e-11 * squared)
    stretch = 1 - strain
    assert buckling_load(0, 12, 4, thickness=thickness) == pytest.approx(
        np.expm1(-6 * np.log(stretch)) * stretch**2 / (squared / 3), rel=1e-6
    )


# --- curvatures of surfaces


def dome(n_elements: int = 16, degree: int = 4, height: float = 0.6, **changes: Any) -> fm.Equilibrium:
    return _dome(n_elements, degree, height, tuple(changes.items()))


@cache
def _dome(n_elements: int, degree: int, height: float, changes: tuple[tuple[str, Any], ...]) -> fm.Equilibrium:
    scene = fm.Scene(
        material=OGDEN, mesh=fm.disc(n_elements), degree=degree, radius_to_thickness=20.0, **{"bending": True, **dict(changes)}
    )
    return fm.equilibrium(scene, center_height=height)


def test_changes_of_the_second_fundamental_form() -> None:
    """k_11, k_22 and k_12 of a mode against finite differences on the surface in space."""
    eq, n, size, step = dome(), 3, 1e-5, 2e-3
    space = eq.potential.space
    form = bending_form(eq.potential, eq.state)
    assert form is not None
    layout = bending.wave_unknowns(space, 2)
    mode = np.random.default_rng(1).standard_normal(layout.n_free) * 0.3
    local = layout.local(mode)
    rows = bending._curvatures(form._inside, form._at_points, n)
    element, point = 9, 2
    found = rows[:, point, :, element] @ local[:, element]
    s0 = float(space.s[point, element])
    a, c, b = (  # polynomials of the element in s
        np.polynomial.Polynomial.fit(space.s[:, element], space.shape_functions(space.points)[0] @ part, space.degree)
        for part in local[:, element].reshape(3, -1)
    )

    def surface(s: float, angle: float, amplitude: float) -> np.ndarray:
        u, _, w, _ = (float(part[0]) for part in space.displacement(eq.state, np.array([s])))
        rho = s + u + amplitude * a(s) * np.cos(n * angle)
        around, height = amplitude * c(s) * np.sin(n * angle), w + amplitude * b(s) * np.cos(n * angle)
        e_rho, e_theta = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
        return rho * e_rho + around * e_theta + np.array([0, 0, height])

    def forms(amplitude: float, angle: float) -> tuple[np.ndarray, np.ndarray]:
        """Tangents and second fundamental form, by central differences."""
        h, k = step * space.sizes[element], step
        at = {(i, j): surface(s0 + i * h, angle + j * k, amplitude) for i in (-1, 0, 1) for j in (-1, 0, 1)}
        first = np.array([(at[1, 0] - at[-1, 0]) / (2 * h), (at[0, 1] - at[0, -1]) / (2 * k)])
        normal = -np.cross(*first) / np.linalg.norm(np.cross(*first))
        ss, tt = (at[1, 0] - 2 * at[0, 0] + at[-1, 0]) / h**2, (at[0, 1] - 2 * at[0, 0] + at[0, -1]) / k**2
        st = (at[1, 1] - at[1, -1] - at[-1, 1] + at[-1, -1]) / (4 * h * k)
        return np.linalg.norm(first, axis=1), np.array([ss @ normal, tt @ normal, st @ normal])

    change = np.zeros(3)
    for angle, pick in ((0.0, [0, 1]), (np.pi / (2 * n), [2])):
        (along, around), _ = forms(0.0, angle)
        rate = (forms(size, angle)[1] - forms(-size, angle)[1]) / (2 * size)
        change[pick] = (rate / np.array([along**2, around**2, along * around]))[pick]
    assert change * np.sign(change[0] * found[0]) == pytest.approx(found, rel=2e-3)  # whatever the side that the normal is on


def test_rigid_motions_bend_nothing() -> None:
    """A shift and a tilt, in the space of the elements since the reference is flat: a tilt of the deformed surface is (eta, -eta, -rho)."""
    eq = dome()
    space = eq.potential.space
    form = bending_form(eq.potential, eq.state)
    assert form is not None
    u, _, w, _ = (part.reshape(space.degree + 1, -1) for part in space.displacement(eq.state, space.interpolation_points().ravel()))
    R, one = space.mesh.position(space.interpolation_points())[0], np.ones_like(u)
    rows = bending._curvatures(form._inside, form._at_points, 1)
    for a, c, b in ((one, -one, 0 * one), (w, -w, -(R + u))):
        local = np.concatenate([space.from_values @ part for part in (a, c, b)])
        strain = np.einsum("iqae,ae->iqe", rows, local)
        assert np.abs(strain).max() < 1e-9 * np.abs(np.einsum("iqae,ae->iqe", np.abs(rows), np.abs(local))).max()


def hermite_eigenvalue(eq: fm.Equilibrium, n: int, count: int = 1) -> np.ndarray:
    """Lowest eigenvalues of a clamped dome with a pole, n >= 2, by Hermite's cubics for all three fields."""
    potential, space = eq.potential, eq.potential.space
    form = bending_form(potential, eq.state)
    assert form is not None
    r = response_at_quadrature(potential, np.asarray(eq.state).tobytes())
    line = MeshLine(space.ends)
    points = (space.points[None], space.weights[:, 0] / (2 * np.pi))
    basis = Basis(line, ElementLineHermite(), quadrature=points)
    tables = []
    for derivative in range(3):
        parts = [np.stack([np.asarray(f[0]), f[0].grad[0], f[0].hess[0, 0]])[derivative] for f in basis.basis]
        tables.append(np.stack(parts).transpose(2, 0, 1) * space.sizes**derivative)  # (points, 4, elements), by the reference element
    value, slope, second = tables
    zero = np.zeros_like(value)
    local = [np.concatenate([t if k == f else zero for k in range(3)], axis=1) for f in range(3) for t in (value, slope)]
    # k in terms of the tangent t and the normal nu, as on the page of the module
    nu, speed, rho = (-r.t_z, r.t_rho), np.hypot(r.rho_x, r.eta_x), r.rho
    turning = form._inside.turning

    def of(a: Any, c: Any, b: Any) -> np.ndarray:
        return np.concatenate([a, c, b], axis=1)

    def times(factor: np.ndarray, table: np.ndarray) -> np.ndarray:
        return np.asarray(factor[:, None] * table)

    def derivative_along(factor: np.ndarray) -> np.ndarray:
        return times(factor / speed, slope)

    k11 = of(*(times(f / speed**2, second) - times(f * turning / speed**3, slope) for f in (nu[0], 0 * rho, nu[1])))
    k22 = of(times(-nu[0] * (n**2 + 1) / rho**2, value), times(-2 * n * nu[0] / rho**2, value), times(-(n**2) * nu[1] / rho**2, value))
    k22 = k22 + of(derivative_along(nu[0] * r.t_rho / rho), zero, derivative_along(nu[1] * r.t_rho / rho))
    k12 = of(derivative_along(-n * nu[0] / rho), derivative_along(-nu[0] / rho), derivative_along(-n * nu[1] / rho))
    turn = r.t_rho / rho**2
    k12 = k12 + of(times(n * nu[0] * turn, value), times(nu[0] * turn, value), times(n * nu[1] * turn, value))
    d11, d12, d22, d66 = form._inside.stiffness * (space.weights[:, :1] / (2 * np.pi))

    def integral(first: np.ndarray, second: np.ndarray, density: np.ndarray) -> np.ndarray:
        return np.einsum("qae,qbe,qe->abe", first, second, density)

    K = integral(k11, k11, d11) + integral(k22, k22, d22) + integral(k12, k12, d66)
    K = K + integral(k11, k22, d12) + integral(k22, k11, d12)
    density = azimuthal_operator(potential, eq.state, eq.pressure, n).density
    for (i, j), part in zip(PAIRS, density, strict=True):
        K = K + integral(local[i], local[j], part) + (0 if i == j else integral(local[j], local[i], part))
    M = sum(integral(local[i], local[i], potential.bulk) for i in (0, 2, 4))
    dofs, size = basis.element_dofs, basis.N
    gather = np.concatenate([dofs + k * size for k in range(3)])
    full = [np.zeros((3 * size, 3 * size)) for _ in range(2)]
    for matrix, part in zip(full, (K, M), strict=True):
        for e in range(space.n_elements):
            matrix[np.ix_(gather[:, e], gather[:, e])] += part[:, :, e]
    nodes = basis.nodal_dofs  # value and slope at each node
    pole, rim = nodes[:, np.argmin(line.p[0])], nodes[:, np.argmax(line.p[0])]
    held = [np.eye(3 * size)[end[0] + k * size] for end in (pole, rim) for k in range(3)]
    for end, corner in ((pole, (0, 0)), (rim, (-1, -1))):  # and the turn of the meridian
        row = np.zeros(3 * size)
        row[end[1]], row[end[1] + 2 * size] = -form._ends.t_z[corner], form._ends.t_rho[corner]
        held.append(row)
    free = null_space(np.array(held))
    return np.asarray(eigh(free.T @ full[0] @ free, free.T @ full[1] @ free, eigvals_only=True, subset_by_index=[0, count - 1]))


@pytest.mark.parametrize("n", [2, 7])
@pytest.mark.parametrize("height", [0.6, -0.35])
def test_hermite_elements_agree(n: int, height: float) -> None:
    """Two domes, the second compressed around the axis by a dipole below."""
    changes: dict[str, Any] = {}
    if height < 0:
        changes = {"sources": (fm.Dipole(400.0, -3.25),), "susceptibility": 2.5}
    eq = dome(32, 4, height, **changes)
    own = azimuthal_eigenvalue(eq.potential, eq.state, eq.pressure, n).value
    assert hermite_eigenvalue(eq, n)[0] == pytest.approx(own, rel=2e-4)


# --- wrinkles


INNER, RATIO = 0.3, 4.0


def lame() -> tuple[float, float]:
    """u = alpha r - 1/r of a plane sheet with nu = 1/2, whose radial tension at the inner edge is RATIO times that at the outer one."""
    return (2 / INNER**2 - 2 * RATIO) / (6 * (RATIO - 1)), -1.0


def lame_scene(scale: float, elements: int = 16) -> fm.Scene:
    alpha, beta = lame()
    inner, outer = (r + scale * (alpha * r + beta / r) for r in (INNER, 1.0))
    mesh = fm.annulus(INNER, elements, ratio=3.0, inner={"kind": "clamped", "radius": inner}, outer={"kind": "clamped", "radius": outer})
    return fm.Scene(material=fm.NeoHookean(), mesh=mesh, degree=4, bending=True, radius_to_thickness=1000.0)


def plate_on_lame(n: int, inner: float, alpha: float, beta: float, modes: int = 40) -> float:
    """The scale at which B lap lap w = div(N grad w) first has a solution with n waves, w = w' = 0 at both edges, by Chebyshev series.

    N_r = 6 alpha - 2 beta/r^2, N_theta = 6 alpha + 2 beta/r^2 over mu T, B = T^2/3.
    """
    x, weights = np.polynomial.legendre.leggauss(2 * modes)
    half = (1 - inner) / 2
    r, weights = inner + half * (1 + x), weights * half
    bubble = chebyshev.poly2cheb([1, 0, -2, 0, 1])
    w, w1, w2 = [], [], []
    for k in range(modes):
        series = chebyshev.chebmul(bubble, np.eye(modes)[k])
        for order, rows in enumerate((w, w1, w2)):
            rows.append(chebyshev.chebval(x, chebyshev.chebder(series, order)) / half**order)
    W, W1, W2 = np.array(w), np.array(w1), np.array(w2)
    k11, k22, k12 = W2, W1 / r - n**2 * W / r**2, n * (W1 / r - W / r**2)
    B = THICKNESS**2 / 3
    area = weights * r
    bend = B * ((k11 + k22) * area @ (k11 + k22).T - (k11 * area @ k22.T + k22 * area @ k11.T) / 2 + k12 * area @ k12.T)
    stress = W1 * (6 * alpha - 2 * beta / r**2) * area @ W1.T + W * (6 * alpha + 2 * beta / r**2) * n**2 / r**2 * area @ W.T
    values = eigh(-stress, bend, eigvals_only=True)
    return float(1 / values[-1]) if values[-1] > 0 else np.inf


def test_the_annulus_of_lame_wrinkles() -> None:
    """The first number of waves and its load, against the equation of the plate under the stresses of Lame (von Karman's, linearised)."""
    scales = {n: plate_on_lame(n, INNER, *lame()) for n in range(4, 20)}
    n = min(scales, key=lambda m: scales[m])
    assert n == 10

    def worst(scale: float) -> tuple[int, fm.Equilibrium]:
        eq = fm.equilibrium(lame_scene(scale), pressure=0.0)
        return worst_waves(eq.potential, eq.state, 0.0, eq.potential.evaluate(eq.state, 0.0))[0], eq

    def lowest(scale: float) -> float:
        eq = fm.equilibrium(lame_scene(scale), pressure=0.0)
        return azimuthal_eigenvalue(eq.potential, eq.state, 0.0, n).value

    found = brentq(lowest, 0.97 * scales[n], 1.03 * scales[n], xtol=1e-10)
    assert found == pytest.approx(scales[n], rel=4e-3)  # strains are 1e-3 there, which the plate leaves out
    number, eq = worst(1.02 * found)
    assert abs(number - n) <= 1
    assert eq.verdict(azimuthal="all").azimuthal == number
    assert eq.verdict(azimuthal="all").stable is False
    assert worst(0.98 * found)[1].verdict(azimuthal="all").stable is True


@pytest.mark.parametrize("thickness", [2e-5, 4e-5])
def test_the_wavelength_of_a_strip_in_tension(thickness: float) -> None:
    """lambda = 2 sqrt(pi) (B/T)^(1/4) sqrt(L) (Cerda and Mahadevan 2003), where sqrt(B/T) << L << R: a narrow ring, pulled along its radii
    by T and shortened around the axis to 1.15 times the hoop stress of its onset, 2 sqrt(T B) pi/L. The slope is held at both edges, which
    takes sqrt(B/T) of L at each.
    """
    length, tension, B = 0.02, 8e-4, thickness**2 / 3
    left = length - 2 * np.sqrt(B / tension)
    hoop = -1.15 * 2 * np.sqrt(tension * B) * np.pi / left
    e_r, e_theta = (2 * tension - hoop) / 6, (2 * hoop - tension) / 6  # s_r = 4 e_r + 2 e_theta
    places = [r * (1 + e_theta) + (e_r - e_theta) * (r - 1 + length / 2) for r in (1 - length, 1.0)]
    inner, outer = ({"kind": "clamped", "radius": place} for place in places)
    scene = fm.Scene(
        material=fm.NeoHookean(),
        mesh=fm.annulus(1 - length, 24, inner=inner, outer=outer),
        degree=4,
        bending=True,
        radius_to_thickness=1 / thickness,
    )
    verdict = fm.equilibrium(scene, pressure=0.0).verdict(azimuthal="all")
    assert verdict.stable is False
    assert verdict.wavelength == pytest.approx(2 * np.sqrt(np.pi * left) * (B / tension) ** 0.25, rel=0.05)
    assert verdict.wavelength == pytest.approx(2 * np.pi * (1 - length / 2) / verdict.azimuthal, rel=0.01)


def compressed(thickness: float = 1e-2, elements: int = 24, degree: int = 4, **changes: Any) -> fm.Scene:
    """The disc of figure 8a with a pole below the rim: an annulus is compressed around the axis."""
    changes = {"bending": True, "radius_to_thickness": 1 / thickness, **changes}
    sources = [fm.Dipole(400.0, -3.25)]
    return fm.Scene(material=OGDEN, sources=sources, susceptibility=2.5, mesh=fm.disc(elements), degree=degree, **changes)


def test_short_waves_have_eigenvalues_that_converge() -> None:
    """Without bending none has a meaning there. With it the worst number of waves is one, at its place whatever the mesh."""
    plain = fm.equilibrium(compressed(bending=False), center_height=-0.3)
    assert plain.verdict(azimuthal=14).reason.startswith("short-wave unstable")
    assert plain.verdict(azimuthal="all").reason.startswith("short-wave unstable")
    found = [fm.equilibrium(compressed(elements=e), center_height=-0.3).verdict(azimuthal="all") for e in (24, 48)]
    assert [verdict.azimuthal for verdict in found] == [14, 14]
    assert found[0].smallest_eigenvalue == pytest.approx(found[1].smallest_eigenvalue, rel=1e-5)
    assert found[1].stable is False


@pytest.mark.parametrize("thickness", [0.1, 1e-2, 1e-3])
@pytest.mark.parametrize("height", [-0.3, 0.6])
def test_no_waves_beyond_the_limit_are_worse(thickness: float, height: float) -> None:
    eq = fm.equilibrium(compressed(thickness), center_height=height)
    n, limit = worst_waves(eq.potential, eq.state, eq.pressure, eq.potential.evaluate(eq.state, eq.pressure))
    values = {m: azimuthal_eigenvalue(eq.potential, eq.state, eq.pressure, m).value for m in {*range(1, 6), n - 1, n, n + 1} - {0}}
    assert min(values, key=lambda m: values[m]) == n
    for m in (limit + 1, limit + 2, 2 * limit, 5 * limit):
        assert azimuthal_eigenvalue(eq.potential, eq.state, eq.pressure, m).value > max(values[n], 0.0)


def test_the_thinnest_sheet() -> None:
    """R0/T = 1e6: as many more waves as it is thinner, and the mesh says that it does not resolve them."""
    verdict = fm.equilibrium(compressed(1e-6), center_height=-0.3).verdict(azimuthal="all")
    assert 1.4e5 < verdict.azimuthal < 1.6e5
    assert verdict.wavelength == pytest.approx(2 * np.pi * 0.245 / verdict.azimuthal, rel=0.05)
    assert verdict._unresolved > 0.1 * abs(verdict.smallest_eigenvalue)


def test_a_taut_membrane_hardly_feels_it() -> None:
    """Of waves as long as the membrane: by a boundary layer at the rim, sqrt(B/s) wide. Without bending the worst of all numbers is found
    too.
    """
    plain, bent = (fm.equilibrium(compressed(1e-3, bending=on), center_height=1.3) for on in (False, True))
    for n in (1, 2, 3):
        values = [eq.verdict(azimuthal=n).smallest_eigenvalue for eq in (plain, bent)]
        assert 0 < values[1] - values[0] < 3e-3 * values[0]
    values = [eq.verdict("volume").smallest_eigenvalue for eq in (plain, bent)]
    assert 0 < values[1] - values[0] < 3e-3 * values[0]
    assert [eq.verdict(azimuthal="all").azimuthal for eq in (plain, bent)] == [1, 1]
    assert np.isnan(plain.verdict(azimuthal=1).wavelength)


def test_compression_along_the_meridian() -> None:
    """Axisymmetric verdicts and frequencies of a compressed flat disc are numbers, on both sides of its buckling."""
    for strain, stable in ((0.7e-6, True), (0.95e-6, False)):
        eq = fm.equilibrium(flat(1 - strain), pressure=0.0)
        verdict = eq.verdict("pressure")
        assert (verdict.stable, eq.verdict("volume").stable) == (stable, True)  # the mode of a held volume has a larger load
        assert eq.frequencies(count=1)[0].eigenvalue == pytest.approx(verdict.smallest_eigenvalue, rel=1e-6)
        assert eq.verdict(azimuthal=1).stable is True
        assert eq.frequencies(azimuthal=2, count=1)[0].eigenvalue > 0
    short = fm.equilibrium(flat(1 - 0.95e-6, bending=False), pressure=0.0)
    assert short.verdict("pressure").reason.startswith("short-wave unstable")


# --- scenes


def test_off_builds_nothing() -> None:
    """The same potential, matrices of the same size, and none of the module's objects."""
    on, off = compressed(), compressed(bending=False)
    potential = potential_of(off)
    x = fm.equilibrium(off, center_height=0.6).state
    assert bending_form(potential, x) is None
    operator = azimuthal_operator(potential, x, 1.0, 2)
    assert (operator.bending, operator.half_bandwidth) == (None, 3 * off.degree + 2)
    assert potential_of(off) is potential_of(off.replace(radius_to_thickness=7.0))
    with_it = potential_of(on)
    assert with_it.evaluate(x, 1.0).band == pytest.approx(potential.evaluate(x, 1.0).band, abs=0)


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"bending": True}, "membrane.radius_to_thickness"),
        ({"bending": "yes", "radius_to_thickness": 100.0}, "effects.bending"),
        ({"bending": True, "radius_to_thickness": 100.0, "tension_field": True}, "effects.bending"),
        ({"bending": True, "radius_to_thickness": 100.0, "degree": 1}, "mesh.degree"),
    ],
)
def test_what_bending_needs(changes: dict[str, Any], key: str) -> None:
    with pytest.raises(InputError, match=key.replace(".", r"\.")):
        fm.Scene(material=fm.NeoHookean(), **changes)
    plain = fm.Scene(material=fm.NeoHookean())
    with pytest.raises(InputError, match=key.replace(".", r"\.")):
        plain.replace(**changes)


def test_scene_files() -> None:
    scene = compressed(analysis=fm.Analysis(azimuthal_modes="all"))
    tables = scene.to_dict()
    assert (tables["effects"], tables["analysis"]["azimuthal_modes"]) == ({"bending": True}, ["all"])
    assert fm.Scene.from_dict(tables) == scene
    with pytest.raises(InputError, match="azimuthal_modes"):
        fm.Analysis(azimuthal_modes=("most",))
    with pytest.raises(InputError, match="azimuthal"):
        fm.equilibrium(flat(1.1), pressure=0.0).verdict(azimuthal="most")


def test_the_first_onset_of_any_number(tmp_path: Any) -> None:
    """The inner edge of a ring, drawn inwards by u = alpha (r - 1/r): the onset is that of the first of all numbers, at the load of the
    plate's equation. Tables and files have the worst number.
    """
    inner = 0.1
    loads = {n: plate_on_lame(n, inner, 1.0, -1.0) for n in range(2, 9)}
    n = min(loads, key=lambda m: loads[m])
    scene = fm.Scene(
        material=fm.NeoHookean(),
        mesh=fm.annulus(inner, 12, ratio=4.0, inner={"kind": "clamped", "radius": 0.9999 * inner}),
        degree=4,
        bending=True,
        radius_to_thickness=1 / THICKNESS,
        analysis=fm.Analysis(azimuthal_modes="all"),
    )
    number = "mesh.inner.radius"
    branch = fm.trace(scene, over=number, hold={"pressure": 0.0}, until={number: 0.9988 * inner})
    (point,) = (point for point in branch.special_points if point.kind == "azimuthal_onset")
    assert point.azimuthal == n
    assert inner - point.number == pytest.approx(loads[n] * (1 / inner - inner), rel=5e-3)
    verdict = point.equilibrium.verdict(azimuthal="all")
    assert verdict.azimuthal == n
    assert verdict.smallest_eigenvalue == pytest.approx(0.0, abs=1e-7)
    assert branch.column("lambda_all")[0] > 0 > branch.column("lambda_all")[-1]
    assert list(branch.column("waves_all")) == [eq.verdict(azimuthal="all").azimuthal for eq in branch]
    branch.save(tmp_path / "branch.nc")
    ours, theirs = (found[-1].verdict(azimuthal="all") for found in (branch, fm.load(tmp_path / "branch.nc")))
    assert (ours.azimuthal, ours.smallest_eigenvalue, ours.wavelength) == (theirs.azimuthal, theirs.smallest_eigenvalue, theirs.wavelength)
    assert theirs.reason == ours.reason


@pytest.mark.parametrize("against", [{"control": "volume"}, {"azimuthal": 3}])
def test_sensitivities_of_eigenvalues_have_bending(against: dict[str, Any]) -> None:
    """Against central differences of the eigenvalue at a held height of the pole, where bending is a tenth of it."""
    eq = fm.equilibrium(compressed(0.1, elements=12), center_height=0.6)
    found = eq.sensitivity(of="eigenvalue", to="source.0.strength", held="center_height", **against)

    def value(strength: float) -> float:
        scene = eq.scene.replace(sources=[fm.Dipole(strength, -3.25)])
        return float(fm.equilibrium(scene, center_height=0.6, start=eq).verdict(**against).smallest_eigenvalue)

    step = 0.5
    assert found == pytest.approx((value(400 + step) - value(400 - step)) / (2 * step), rel=1e-4)


# --- a pressurised sphere under a point force

#: R0/T does not matter for the state: P = p R/(mu T), Y = 3 mu T, l_p = R sqrt(p R/Y)
SPHERE_PRESSURE = 0.003
REACH = np.sqrt(SPHERE_PRESSURE / 3)
#: force over 2 pi p l_p^2 at which the hoop stress is first compressive: from the equations of shallow shells without bending
FIRST_COMPRESSION = 0.5693691877


def pushed_sphere(forces: list[float], **changes: Any) -> fm.Branch:
    """One half of a sphere between two opposite forces on small discs, 0.02 l_p in radius, at the pressure above."""
    unit, hub, count = 2 * np.pi * SPHERE_PRESSURE * REACH**2, 0.02 * REACH, 40
    angle = np.geomspace(hub + 0.3 * REACH, np.pi / 2 + 0.3 * REACH, 2 * count + 1) - 0.3 * REACH
    points = np.stack([np.sin(angle), np.cos(angle)], axis=1)
    points[-1] = (1.0, 0.0)
    cells = [[2 * k, 2 * k + 2, 2 * k + 1] for k in range(count)]
    mesh = fm.meridian_from_points(points, cells, first="hub", last="mirror")
    loads = [fm.HubForce(-forces[0] * unit)]
    scene = fm.Scene(material=fm.NeoHookean(), mesh=mesh, degree=4, loads=loads, **changes)
    return fm.vary(scene, "load.0.force", [-force * unit for force in forces], hold={"pressure": SPHERE_PRESSURE})


def test_a_pushed_sphere_is_first_compressed() -> None:
    """Within 0.6 %: the sphere is not quite shallow, its disc no point, and it is stretched."""
    branch = pushed_sphere([0.1, 0.3, 0.5, 0.994 * FIRST_COMPRESSION, 1.006 * FIRST_COMPRESSION])
    least = [eq.profile()["mechanical_stress_2"].min() for eq in branch[-2:]]
    assert least[0] > 0 > least[1]


def test_the_wrinkles_of_a_pushed_sphere() -> None:
    """n ~ T^(-2/3) and F - F_c ~ T^(2/3) at the onset, where a compressed zone has just opened: with s_2 ~ d and its width L ~ sqrt(d),
    d = F - F_c, the onset is at s_2 = 2 sqrt(s_1 B) pi/L, so that d^3 ~ B, and k_2 = (s_1 pi^2/(B L^2))^(1/4) ~ B^(-1/3).

    The factors, 210 and 0.0104, were recorded on 2026-11-28 from onsets at T = 1e-5, 3e-6 and 1e-6.
    """
    for thickness in (1e-5, 1e-6):
        shift, number = 210 * thickness ** (2 / 3), 0.0104 * thickness ** (-2 / 3)
        forces = [FIRST_COMPRESSION + part * shift for part in (0.85, 1.12)]
        branch = pushed_sphere([0.1, 0.3, 0.5, *forces], bending=True, radius_to_thickness=1 / thickness)
        numbers = [round(number * part) for part in (0.5, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.4, 2.0)]
        below, above = ([azimuthal_eigenvalue(eq.potential, eq.state, eq.pressure, n).value for n in numbers] for eq in branch[-2:])
        assert min(below) > 0 > min(above)
        assert abs(int(np.argmin(above)) - 4) <= 2


SHAPES: dict[str, tuple[dict[str, Any], dict[str, float]]] = {
    "sphere": ({"mesh": fm.sphere(12)}, {"volume": 6.0}),
    "torus": ({"mesh": fm.torus(aspect=3.0, elements=16)}, {"pressure": 0.5}),
    "hub and mirror": ({"mesh": fm.cylinder(length=2.0, elements=12, top="hub", bottom="mirror")}, {"volume": 8.0}),
    "free edge": ({"mesh": fm.annulus(0.3, 12, inner="free")}, {"volume": 0.5}),
    "charge": ({"mesh": fm.disc(12), "electric": fm.Electric(total_charge=0.5)}, {"volume": 1.0}),
    "self-field": (
        {"mesh": fm.disc(12), "sources": [fm.Dipole(20.0, 2.5)], "susceptibility": 1.0, "demagnetization": True},
        {"volume": 0.8},
    ),
    "uneven": ({"mesh": fm.disc(12), "thickness": "1 - 0.4*R**2"}, {"volume": 0.5}),
}


@pytest.mark.parametrize("name", SHAPES)
def test_every_shape_and_effect_bends(name: str) -> None:
    """Bending raises every eigenvalue, by nearly nothing where the sheet is thin."""
    arguments, load = SHAPES[name]
    plain = fm.Scene(material=fm.NeoHookean(), degree=3, **arguments)
    without = fm.equilibrium(plain, **load)
    for ratio, most in ((1e4, 1e-3), (30.0, 0.5)):
        eq = fm.equilibrium(plain.replace(bending=True, radius_to_thickness=ratio), **load)
        for asked in ({"control": "pressure"}, {"azimuthal": 1}, {"azimuthal": 3}):
            before, after = (state.verdict(**asked).smallest_eigenvalue for state in (without, eq))  # type: ignore[arg-type]
            assert -1e-9 < after / before - 1 < most


def test_a_sphere_bends_alike_in_all_directions() -> None:
    """Harmonics of one degree have one eigenvalue, whatever their number of waves around the axis: 2 for the lowest, 3 for n = 3."""
    scene = fm.Scene(material=fm.NeoHookean(), mesh=fm.sphere(16), degree=4, bending=True, radius_to_thickness=10.0)
    eq = fm.equilibrium(scene, volume=6.0)
    values = [eq.verdict("volume").smallest_eigenvalue, *(eq.verdict(azimuthal=n).smallest_eigenvalue for n in (1, 2))]
    assert values == pytest.approx([values[0]] * 3, rel=1e-6)
    plain = fm.equilibrium(scene.replace(bending=False), volume=6.0)
    assert values[0] > 1.002 * plain.verdict("volume").smallest_eigenvalue


def test_a_flat_membrane_at_rest_has_no_worst_number_of_waves() -> None:
    """Nothing is taut and nothing pushes: every eigenvalue is 0, and the search ends at once."""
    flat = fm.equilibrium(fm.Scene(fm.NeoHookean(), fm.disc(4), degree=2), volume=0.0)
    verdict = flat.verdict(azimuthal="all")
    assert (verdict.stable, verdict.smallest_eigenvalue, verdict.azimuthal) == (None, 0.0, 1)
