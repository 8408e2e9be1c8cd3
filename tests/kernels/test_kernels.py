"""The kernels in C against those in NumPy: the same values, and with them the same iteration counts.

Skipped where it was not built; ``.ci/run`` fails where a C compiler is at hand and it was not.
"""

from __future__ import annotations

import os
import subprocess
import sys
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

import femmembrane as fm
from femmembrane import kernels as switch
from femmembrane.discretization.space import HESSIAN_PAIRS, space_of
from femmembrane.errors import Status
from femmembrane.kernels.compiled_kernels import CompiledKernels
from femmembrane.kernels.numpy_kernels import NumpyKernels
from femmembrane.potential import Potential, potential_of
from femmembrane.potential.replay import record_tape, vectorise
from femmembrane.solve.banded import BandFactor, negative_directions
from femmembrane.solve.controls import ArcLengthControl, CenterHeightControl, Gas, PressureControl, VolumeControl
from femmembrane.solve.newton import correct
from tests.cases import PROBLEMS, SCENES, disc_scene
from tests.kernels.test_banded import counted, random_matrix, to_band

pytestmark = pytest.mark.skipif(switch.kernels().name != "compiled", reason="the extension module was not built")

#: the extension module
NATIVE = getattr(switch.kernels(), "module", None)
OPERATIONS = getattr(NATIVE, "OPERATIONS", ())

#: points in one block of the compiled half
BLOCK = 256

SHAPES = {
    **SCENES,
    "tension field": disc_scene(dipole=(400.0, -3.75)).replace(tension_field=True),
    "linear": disc_scene(dipole=(200.0, 6.5), elements=30, degree=1),
    "degree 6": disc_scene(dipole=(200.0, 6.5), elements=5, degree=6),
    "degree 8, one element": disc_scene(elements=1, degree=8),
    "many blocks": disc_scene(dipole=(200.0, 6.5), elements=331, degree=2),
    "two sources": disc_scene(elements=9, degree=3).replace(sources=[fm.Dipole(200, 6.5), fm.Dipole(50, -5.0)]),
}


def in_numpy(function, *args, **kwargs):
    with switch.in_numpy():
        return function(*args, **kwargs)


def dome(potential: Potential, height: float = 0.7) -> np.ndarray:
    space = potential.space
    r = space.mesh.position(space.interpolation_points())[0]
    return space.interpolate(0.05 * r * (1 - r**2), height * (1 - r**2))


def close(a, b, rtol=1e-12):
    a, b = np.asarray(a), np.asarray(b)
    np.testing.assert_allclose(a, b, rtol=0, atol=rtol * np.abs(b).max(initial=1e-300))


@pytest.mark.parametrize("name", SHAPES)
def test_evaluation_and_assembly(name):
    potential = potential_of(SHAPES[name])
    assert potential.elements.name == "compiled"
    assert in_numpy(lambda: potential.elements.name) == "NumPy"
    for height in (0.7, 1e-4, -0.3):
        x = dome(potential, height)
        found, expected = potential.evaluate(x, 1.3, 0.8), in_numpy(potential.evaluate, x, 1.3, 0.8)
        for key in ("elastic_energy", "magnetic_energy", "volume", "volume_gradient", "stress"):
            close(getattr(found, key), getattr(expected, key))
        ne, nq = potential.space.n_elements, potential.space.n_quadrature
        for a, b in ((found.force_density, expected.force_density), (found.stiffness_density, expected.stiffness_density)):
            for k, row in enumerate(b.reshape(-1, nq * ne)):
                close(a.reshape(-1, nq * ne)[k], row)
        close(found.band, expected.band)
        assert found.finite is expected.finite is True
        # forces nearly cancel in a node: they are compared with the forces that meet there
        scale = max(in_numpy(potential.force_scale, expected, 1.3))
        np.testing.assert_allclose(found.gradient, expected.gradient, rtol=0, atol=1e-13 * scale)


@pytest.mark.parametrize("name", SHAPES)
def test_a_step_solves_the_bordered_system(name):
    """[K, -V'; row, corner] (dx, dP) = (P V' - E', -gap) by the assembled band, in both implementations, with the sizes of dx and x."""
    potential = potential_of(SHAPES[name])
    x, gap, corner = dome(potential), 0.3, 0.7
    for run in (lambda function: function(), in_numpy):
        evaluation = run(lambda: potential.evaluate(x, 1.3))
        row = evaluation.volume_gradient + 0.1
        border, dx, dp, change, size = evaluation.step(row, corner, gap)
        force = 1.3 * evaluation.volume_gradient - evaluation.gradient
        np.testing.assert_array_equal(evaluation.unbalanced, force)
        left = NumpyKernels().product(evaluation.band, potential.space.half_bandwidth, dx) - dp * evaluation.volume_gradient
        np.testing.assert_allclose(left, force, rtol=0, atol=1e-10 * np.abs(force).max())
        assert row @ dx + corner * dp == pytest.approx(-gap, rel=1e-10)
        again, rate = border.solve(evaluation.unbalanced, -gap)
        np.testing.assert_array_equal(again, dx)
        assert rate == dp
        for vector, largest in ((dx, change), (x, size)):
            assert largest == tuple(np.abs(vector[index]).max(initial=0.0) for index in potential.space.fields)


@pytest.mark.parametrize("name", SHAPES)
def test_parts_of_a_quadratic_form(name):
    """Term by term from the densities and the local variables, element after element; with weights of one and no sign it is x . K x."""
    potential = potential_of(SHAPES[name])
    space, mode = potential.space, dome(potential, -0.4)
    evaluation = potential.evaluate(dome(potential), 1.3)
    local = space.at_quadrature(mode).reshape(4, -1)
    density = evaluation.stiffness_density.reshape(len(HESSIAN_PAIRS), -1)
    terms = np.array([(1 + (i != j)) * k * local[i] * local[j] for (i, j), k in zip(HESSIAN_PAIRS, density, strict=True)])
    integrand = terms.sum(axis=0).reshape(space.n_quadrature, space.n_elements)
    assert integrand.sum() == pytest.approx(evaluation.inner(mode, mode), rel=1e-10)
    expected = sum(abs(space.highest @ column) for column in integrand.T), np.abs(terms).sum()
    atol = 1e-12 * expected[1]
    for found in (evaluation.form_parts(mode), in_numpy(lambda: potential.evaluate(dome(potential), 1.3).form_parts(mode))):
        np.testing.assert_allclose(found, expected, rtol=0, atol=atol)


@pytest.mark.parametrize("name", SHAPES)
def test_kinks(name):
    """As the arrays of NumPy have them."""
    potential = potential_of(SHAPES[name])
    x = dome(potential) + np.random.default_rng(3).normal(scale=0.01, size=potential.space.n_free)
    np.testing.assert_allclose(potential.elements.kinks(potential.space, x), potential.space.kinks(x), rtol=1e-12, atol=1e-13)


def test_blocks_are_met_whole_and_in_part():
    assert potential_of(SHAPES["many blocks"]).n_points > 2 * BLOCK
    assert potential_of(SHAPES["many blocks"]).space.n_elements % (BLOCK // 3 // 4 * 4) % 4 != 0
    assert potential_of(SHAPES["degree 6"]).space.n_elements % 4 != 0


def same_result(found, expected):
    assert (found.status, found.iterations) == (expected.status, expected.iterations)
    assert (found.bordered is None) == (expected.bordered is None)
    if expected.status is Status.CONVERGED:
        close(found.x, expected.x, 1e-11)
        assert found.pressure == pytest.approx(expected.pressure, rel=1e-11, abs=1e-12)
        f = np.linspace(-1, 1, len(found.x))
        a, b = found.bordered.solve(f, 0.5), expected.bordered.solve(f, 0.5)
        close(np.append(*a), np.append(*b), 1e-6)  # as ill-conditioned as the membrane is


@pytest.mark.parametrize("problem", PROBLEMS, ids=lambda p: p.name)
def test_corrector_over_the_registry(problem):
    """From 1 % off in volume and from the state itself: the same iterates."""
    potential = potential_of(problem.point.scene)
    there = problem.solve("newton")
    control = {"pressure": PressureControl, "volume": VolumeControl}[problem.control](problem.point.expected[problem.control])
    for factor in (1.0, 0.999):
        guess = factor * there.state
        same_result(correct(potential, control, guess, there.pressure), in_numpy(correct, potential, control, guess, there.pressure))


@pytest.mark.parametrize("name", ["volume", "pressure", "height", "gas", "arc length"])
def test_corrector_under_every_control(name):
    potential = potential_of(SHAPES["degree 6"])
    there = fm.equilibrium(SHAPES["degree 6"], volume=5.0, solver="newton")
    dual = np.linspace(-1, 1, len(there.state))
    control = {
        "volume": VolumeControl(5.05),
        "pressure": PressureControl(1.01 * there.pressure),
        "height": CenterHeightControl(1.01 * there.center_height),
        "gas": Gas(amount=1.02 * (there.pressure + 0.3) * 7.0, chamber=2.0, atmosphere=0.3),
        "arc length": ArcLengthControl(dual, 0.3, there.state, 1.01 * there.pressure),
    }[name]
    found = correct(potential, control, there.state, there.pressure)
    same_result(found, in_numpy(correct, potential, control, there.state, there.pressure))
    assert found.status is Status.CONVERGED
    assert found.iterations > 1


@pytest.mark.parametrize("guess", ["far", "nan", "huge", "outside the energy"])
def test_corrector_fails_alike(guess):
    potential = potential_of(SHAPES["degree 6"])
    rng = np.random.default_rng(0)
    n = potential.space.n_free
    x = {
        "far": 3 * rng.normal(size=n),
        "nan": np.full(n, np.nan),
        "huge": np.full(n, 1e200),
        "outside the energy": dome(potential) - 5 * potential.space.interpolate(*2 * [potential.space.interpolation_points()]),
    }[guess]
    found, expected = (run(correct, potential, VolumeControl(5.0), x, 1.0) for run in (lambda f, *a: f(*a), in_numpy))
    assert found.status is expected.status is Status.NOT_CONVERGED
    assert found.iterations == expected.iterations


@pytest.mark.parametrize("name", ["degree 6", "tension field"])
def test_traces_and_verdicts(name):
    """Whole branches with limit points and verdicts, from one code and the other."""
    scene = SHAPES[name].replace(analysis=fm.Analysis(stability=("pressure", "volume")))
    kwargs = {"start": 0.35, "until": {"volume": 40.0}, "max_steps": 60}
    found, expected = fm.trace(scene, **kwargs), in_numpy(fm.trace, scene, **kwargs)
    assert len(found) == len(expected)
    assert found.status is expected.status
    for key in ("pressure", "volume", "center_height", "elastic_energy", "lambda_pressure", "lambda_volume"):
        np.testing.assert_allclose(found.column(key), expected.column(key), rtol=1e-6, atol=1e-8)
    for key in ("iterations", "verdict_pressure", "verdict_volume"):
        assert found.column(key).tolist() == expected.column(key).tolist()
    assert [(p.kind, round(p.pressure, 6)) for p in found.special_points] == [
        (p.kind, round(p.pressure, 6)) for p in expected.special_points
    ]


def test_factors_where_pivoting_is_needed():
    """Random matrices without a dominant diagonal: L D L^T alone would lose all digits in some of them."""
    n, kd = 60, 4
    for seed in range(60):
        matrix = random_matrix(seed, n, kd, shift=seed / 20 - 1)
        matrix[seed % n, seed % n] *= seed % 3
        band = to_band(matrix, kd)
        exact = np.random.default_rng(seed).normal(size=n)
        factor = BandFactor(band)
        error = np.abs(factor.solve(matrix @ exact) - exact).max()
        assert error < 1e-13 * np.linalg.cond(matrix) * np.abs(exact).max()
        assert factor.determinant_sign() == np.sign(np.linalg.slogdet(matrix)[0])
        for constraint in (None, exact) if seed % 3 else ():
            known = counted(matrix, constraint)
            assert negative_directions(band, kd, constraint) == in_numpy(negative_directions, band, kd, constraint) == known
            answer = NATIVE.inertia(np.ascontiguousarray(band.T), None, constraint, n, kd, 0.0, 0.0)
            assert answer in (known, -1)


def test_inertia_is_in_doubt_where_rounding_decides():
    n, kd = 20, 2
    singular = random_matrix(1, n, kd, shift=9.0)
    singular[7, :] = singular[:, 7] = 0
    band = np.ascontiguousarray(to_band(singular, kd).T)
    assert NATIVE.inertia(band, None, None, n, kd, 0.0, 0.0) == -1
    # the constraint is the mode of an eigenvalue zero of the restricted matrix: its Schur complement vanishes
    vector = np.zeros(n)
    vector[[2, 5]] = 1.0
    diagonal = np.ones(n)
    diagonal[5] = -1.0
    band = np.ascontiguousarray(to_band(np.diag(diagonal), kd).T)
    assert NATIVE.inertia(band, None, vector, n, kd, 0.0, 0.0) == -1


def arithmetic(a, b):
    """Every operation of the compiled half on two symbols."""
    names = [n for n in OPERATIONS if n != "ASSIGN"]
    found = []
    for name in names:
        operation = getattr(ca, f"OP_{name}")
        try:
            found.append((name, ca.SX.binary(operation, a, b) if name in BINARY else ca.SX.unary(operation, a)))
        except RuntimeError:  # pragma: no cover - an operation that this CasADi does not know
            continue
    return found


BINARY = {
    *("ADD", "SUB", "MUL", "DIV", "POW", "CONSTPOW", "FMIN", "FMAX", "LT", "LE", "EQ", "NE"),
    *("AND", "OR", "IF_ELSE_ZERO", "ATAN2", "HYPOT", "COPYSIGN", "FMOD"),
}


def test_every_operation_is_casadis():
    """On ordinary and extreme arguments, operands constant, shared or given for each point."""
    points = np.array([-1e300, -750.0, -40.0, -1.5, -0.4, -1e-9, 0.0, 1e-300, 1e-9, 0.3, 0.9, 1.0, 1.7, 30.0, 710.0, 1e300, np.inf, np.nan])
    left, right = (m.ravel() for m in np.meshgrid(points, points))
    data, local, shared = ca.SX.sym("d", 1), ca.SX.sym("l", 4), ca.SX.sym("p", 2)
    rows = []
    for a, b in ((data[0], local[0]), (data[0], shared[0]), (shared[0], local[0]), (local[0], ca.SX(0.7)), (shared[0], shared[1])):
        rows += [row for _, row in arithmetic(a, b)]
    assert len(rows) > 200
    module = NATIVE
    n = left.size
    space = space_of(fm.disc(elements=n), 1)
    for k in range(0, len(rows), 23):
        some = rows[k : k + 23] + [ca.SX(0.0)] * max(0, k + 23 - len(rows))
        function = ca.Function("operations", [data, local, shared], [ca.densify(ca.vertcat(*some))])
        # one point an element, one shape function, all unknowns free: the local variables are the unknowns
        tape = record_tape(function, module.OPERATIONS)
        table = np.zeros((4, 2))
        table[0, 0] = 1.0
        gather = np.stack([np.arange(n), np.full(n, n)])
        elements = module.Elements(tape, left[None].copy(), gather, table, np.zeros(n, dtype=np.int64), 1, 1, 0)
        densities = np.empty((20, n))
        for first, second in ((0.3, -1.2), (800.0, 0.0)):
            parameters = np.array([first, second])
            elements.evaluate(right.copy(), first, second, np.empty((3, n)), densities)
            exact = np.array(vectorise(function, n)(left[:, None], np.stack([right, *3 * [np.zeros(n)]]).T, parameters)).T
            np.testing.assert_allclose(densities, exact[3:], rtol=6e-16, atol=5e-324)
    assert space.n_elements == n


def test_an_unknown_operation_leaves_the_scene_to_numpy():
    potential = potential_of(SHAPES["linear"])
    few = SimpleNamespace(OPERATIONS=[name for name in OPERATIONS if name != "MUL"])
    assert record_tape(potential.point_function, few.OPERATIONS) is None
    point = SimpleNamespace(data=potential.point_data, tape=lambda known: record_tape(potential.point_function, known))
    assert CompiledKernels(few, NumpyKernels()).elements(potential.space, point).name == "NumPy"


def test_the_switch():
    with switch.in_numpy():
        assert switch.kernels().name == potential_of(SHAPES["linear"]).elements.name == "NumPy"
    assert switch.kernels().name == potential_of(SHAPES["linear"]).elements.name == "compiled"
    code = "from femmembrane.kernels import kernels; print(kernels().name)"
    for value, name in (("0", "NumPy"), ("1", "compiled")):
        found = subprocess.run(
            [sys.executable, "-c", code], env=os.environ | {"FEMMEMBRANE_COMPILED": value}, capture_output=True, text=True, check=True
        )
        assert found.stdout.strip() == name


def test_derivatives_that_are_no_numbers_are_told():
    """A membrane folded over the axis is outside the domain of the energy, and a needle of 1e200 beyond what doubles hold."""
    potential = potential_of(SHAPES["degree 6"])
    r = potential.space.interpolation_points()
    for x in (dome(potential) - 5 * potential.space.interpolate(r, r), np.full(potential.space.n_free, 1e200)):
        found, expected = potential.evaluate(x, 1.0), in_numpy(potential.evaluate, x, 1.0)
        assert found.finite is expected.finite is False


def test_wrong_arrays_are_refused():
    """Sizes and types are checked at the door: nothing is read or written out of bounds."""
    module, potential = NATIVE, potential_of(SHAPES["degree 6"])
    n = potential.space.n_free
    elements, gradients, densities = potential.elements.native, np.empty((3, n)), np.empty((20, potential.n_points))
    for x, room in ((np.zeros(n - 1), gradients), (np.zeros(n), gradients[:1]), (np.zeros(2 * n)[::2], gradients)):
        with pytest.raises((ValueError, BufferError)):
            elements.evaluate(x, 0.0, 1.0, room, densities)
    with pytest.raises(ValueError, match="x"):
        elements.evaluate(np.zeros(n, dtype=np.int64), 0.0, 1.0, gradients, densities)
    weights = potential.space.highest
    for name, mode, part in (("x", np.zeros(n - 1), weights), ("weights", np.zeros(n), weights[1:])):
        with pytest.raises(ValueError, match=name):
            elements.form_parts(densities, mode, part)
    with pytest.raises(ValueError, match="jumps"):
        elements.kinks(np.zeros(n), *potential.space.ends_of_elements[:3], 3, np.zeros(potential.space.n_elements))
    with pytest.raises(ValueError, match="band"):
        module.Factor(np.zeros((3, 4)), 4, 1)
    tape = record_tape(potential.point_function, module.OPERATIONS)
    space = potential.space
    sizes = space.n_quadrature, space.degree + 1, space.half_bandwidth
    field = np.zeros(n, dtype=np.int64)
    for gather, kd in ((space.gather + 1, sizes[2]), (space.gather, 1)):
        with pytest.raises(ValueError, match="gather"):
            module.Elements(tape, potential.point_data, np.ascontiguousarray(gather), space.table, field, *sizes[:2], kd)
    bad = (tape[0], tape[1] + 1000, *tape[2:])
    with pytest.raises(ValueError, match="instruction"):
        module.Elements(bad, potential.point_data, space.gather, space.table, field, *sizes)
