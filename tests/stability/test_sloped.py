"""Energies that depend on the slope: second variation, Legendre-Hadamard condition, and the paper's tests beside them."""

from __future__ import annotations

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.accuracy.collocation import collocate
from femmembrane.accuracy.shooting import shoot
from femmembrane.accuracy.strong_form import Guess
from femmembrane.physics.magnetics import magnetic_field
from femmembrane.potential import potential_of
from femmembrane.solve.wellposed import apparent, ill_posed
from femmembrane.stability.acoustic import supporting_all
from femmembrane.stability.azimuthal import azimuthal_eigenvalue, lowest_eigenvalues
from femmembrane.stability.azimuthal_operator import azimuthal_operator
from femmembrane.stability.jacobi import jacobi_test, legendre_test
from femmembrane.stability.second_variation import response_at_quadrature
from tests.cases import SUSCEPTIBILITY, disc_scene

BELOW = disc_scene(dipole=(400, -3.75), elements=16, degree=6).replace(demagnetization=True)
STRONG = disc_scene(dipole=(600, -3.5), elements=16, degree=6).replace(demagnetization=True)
ABOVE = disc_scene(dipole=(200, 6.5), elements=16, degree=6)
HARD = {"susceptibility": None, "remanence": 0.3, "remanence_direction": "normal"}
ROTATED, DEFORMED = ABOVE.replace(**HARD, remanence_transport="rotated"), ABOVE.replace(**HARD)
SATURATED = ABOVE.replace(saturation=3.0)
EVERYTHING = ROTATED.replace(demagnetization=True, susceptibility=1.0, saturation=2.0)
MERIDIONAL = {"remanence_direction": "meridional", "susceptibility": 0.5}

#: scene, pole height, smallest eigenvalues for n = 1, 2, 3 by a spectral Galerkin method of others
EIGENVALUES = [
    (BELOW, 1.0, (3.683160004, 13.822384106, 26.641919882)),
    (BELOW, 0.7, (4.715851761, 13.483544055, 23.271290542)),
    (STRONG, 1.0, (3.507766213, 13.864897536, 26.941443035)),
    (STRONG, 0.7, (4.257658683, 12.537441284, 21.596881925)),
    (ROTATED, 0.5, (5.815311406, 13.611971656, 21.836289773)),
    (DEFORMED, 0.5, (5.883146762, 13.797733067, 22.157022170)),
    (SATURATED, 0.5, (5.697116822, 13.257157302, 21.198956684)),
]


@pytest.mark.parametrize(("scene", "height", "expected"), EIGENVALUES)
def test_eigenvalues(scene, height, expected):
    eq = fm.equilibrium(scene, center_height=height)
    found = [azimuthal_eigenvalue(potential_of(scene), eq.state, eq.pressure, n).value for n in (1, 2, 3)]
    assert found == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    "scene",
    [BELOW, EVERYTHING, DEFORMED, DEFORMED.replace(**MERIDIONAL), ROTATED.replace(**MERIDIONAL, thickness="1 + 0.3*R**2")],
    ids=["self-field", "everything", "deformed", "meridional deformed", "meridional rotated"],
)
def test_no_waves_are_the_axisymmetric_operator(scene):
    """The form of the surface in space at n = 0, against the derivatives of the energy of the meridian: entry by entry."""
    eq = fm.equilibrium(scene, center_height=0.6)
    potential = potential_of(scene)
    own = potential.evaluate(eq.state, eq.pressure).band
    assert azimuthal_operator(potential, eq.state, eq.pressure, 0).band == pytest.approx(own, abs=1e-13 * np.abs(own).max())


@pytest.mark.parametrize("scene", [BELOW, EVERYTHING, DEFORMED], ids=["self-field", "everything", "deformed"])
def test_the_gradient_is_that_of_the_energy(scene):
    potential = potential_of(scene)
    generator, step = np.random.default_rng(3), 1e-6
    x = fm.equilibrium(scene, center_height=0.6).state
    direction = generator.standard_normal(x.size) / np.sqrt(x.size)
    there = potential.evaluate(x, 0.0)
    sides = [potential.evaluate(x + sign * step * direction, 0.0) for sign in (1, -1)]
    assert there.gradient @ direction == pytest.approx((sides[0].energy - sides[1].energy) / (2 * step), rel=1e-6)


def test_a_turned_scene_is_the_same():
    """A free sphere beside a uniform field: shifts cost nothing, a tilt does, since the self-field sees the slope."""
    free = fm.Scene(material=fm.NeoHookean(), mesh=fm.sphere(12), degree=4, susceptibility=1.0, sources=[fm.Uniform(0.02)])
    for demagnetization, count in ((False, 2), (True, 1)):
        scene = free.replace(demagnetization=demagnetization)
        eq = fm.equilibrium(scene, volume=6.0)
        operator = azimuthal_operator(potential_of(scene), eq.state, eq.pressure, 1)
        assert operator.rigid is not None
        assert operator.rigid.shape[1] == count


@pytest.mark.parametrize(("height", "hoop_holds"), [(1.0, True), (0.7, True), (0.5, False), (0.4, False)])
def test_legendre_hadamard(height, hoop_holds):
    """Closed forms with kappa = chi^2/(1 + chi): s_1 + kappa (h_t^2 - h_n^2) - (kappa h_n h_t)^2/(l_1^2 W_11) and s_2 - kappa h_n^2."""
    eq = fm.equilibrium(BELOW, center_height=height)
    potential = potential_of(BELOW)
    evaluation = potential.evaluate(eq.state, eq.pressure)
    r = response_at_quadrature(potential, eq.state.tobytes())
    h = magnetic_field(BELOW.sources, r.rho, r.eta)
    h_t, h_n = h[0] * r.t_rho + h[1] * r.t_z, h[1] * r.t_rho - h[0] * r.t_z
    kappa = SUSCEPTIBILITY**2 / (1 + SUSCEPTIBILITY)
    along = r.s1 + kappa * (h_t**2 - h_n**2) - (kappa * h_n * h_t) ** 2 / (r.s1 / r.N1 * r.W11)
    found = supporting_all(evaluation)
    assert found[0] == pytest.approx(along.ravel(), abs=1e-12)
    assert found[1] == pytest.approx((r.s2 - kappa * h_n**2).ravel(), abs=1e-12)
    assert evaluation.stress.min() > 0.1  # all mechanical stresses are tensile
    assert eq.verdict("pressure").stable
    verdict = eq.verdict(azimuthal=2)
    assert bool(verdict.stable) is hoop_holds
    assert ("wrinkles along meridians" in verdict.reason) is not hoop_holds


def test_ever_shorter_waves():
    """Where the hoop number is positive, eigenvalues grow with n without end; where it is negative, they fall."""
    for height, falls in ((0.7, False), (0.5, True)):
        scene = BELOW.replace(mesh=fm.disc(60), degree=4)
        eq = fm.equilibrium(scene, center_height=height)
        values = [lowest_eigenvalues(potential_of(scene), eq.state, eq.pressure, n, 1)[0][0] for n in (10, 80)]
        assert (values[1] < 0) is falls
    assert values[0] == pytest.approx(39.8, abs=0.1)


def test_the_branch_ends_in_a_normal_field():
    """M = 600: the number of the meridian is 0.0012 at the height 0.45, with a mechanical stress of 0.146; just below it is gone."""
    scene = STRONG.replace(mesh=fm.disc(24))
    branch = fm.trace(scene, until={"center_height": 0.3}, start=1.5, max_steps=400, direction=-1)
    assert branch.status is fm.Status.LEGENDRE_FAILURE
    assert branch[-1].center_height == pytest.approx(0.45, abs=0.02)
    assert "do not hold the meridian" in branch.message
    potential = branch[-1].potential
    last = potential.evaluate(branch[-1].state, branch[-1].pressure)
    assert last.stress.min() > 0
    assert ill_posed(potential, last) is None or apparent(potential, last) is not None


@pytest.mark.parametrize(
    ("scene", "height"),
    [(ABOVE.replace(demagnetization=True), 1.4), (BELOW, 0.7), (DEFORMED, 2.0), (EVERYTHING, 2.0), (ROTATED.replace(**MERIDIONAL), 1.0)],
    ids=["self-field", "below", "deformed", "everything", "meridional"],
)
def test_jacobi(scene, height):
    """As many conjugate points as negative directions; Legendre's condition along the radius."""
    eq = fm.equilibrium(scene, center_height=height)
    assert legendre_test(eq).satisfied
    assert len(jacobi_test(eq).conjugate_points) == eq.verdict("pressure").negative_directions


def test_a_cap_and_its_mirror_image():
    """A normal remanence points to where the pressure pushes. A mirror turns a moment along its normal over, and the dipole with it."""
    results = []
    for height, orientation in ((0.5, 1), (-0.5, -1)):
        scene = fm.Scene(
            material=fm.NeoHookean(),
            mesh=fm.cap(height=height, elements=12),
            degree=4,
            susceptibility=0.5,
            demagnetization=True,
            remanence=0.2,
            remanence_direction="normal",
            sources=[fm.Dipole(2.0, 5 * height, orientation)],
        )
        eq = fm.equilibrium(scene, volume=1.6)
        eigenvalues = [azimuthal_eigenvalue(potential_of(scene), eq.state, eq.pressure, n).value for n in (1, 2)]
        results.append((eq.pressure, eq.energy, *eigenvalues, *eq.profile()["total_stress_1"][:5]))
    assert results[0] == pytest.approx(results[1], rel=1e-9)


@pytest.mark.parametrize(("direction", "turns"), [("normal", True), ("meridional", False)])
def test_the_material_of_a_magnetised_sphere(direction, turns):
    """It may turn under its shape at no cost if it is magnetised along its normal, and not if it is along its meridians."""
    scene = fm.Scene(
        material=fm.NeoHookean(),
        mesh=fm.sphere(16),
        degree=4,
        remanence=0.2,
        remanence_direction=direction,
        sources=[fm.Uniform(0.01)],
    )
    eq = fm.equilibrium(scene, volume=6.5)
    operator = azimuthal_operator(potential_of(scene), eq.state, eq.pressure, 1)
    assert (operator.spin is not None) is turns


@pytest.mark.parametrize(
    "more",
    [
        {"demagnetization": True},
        {"saturation": 3.0},
        {"demagnetization": True, "saturation": 3.0},
        {"demagnetization": True, "saturation": 2.0, "remanence": 0.2, "remanence_direction": "normal", "remanence_transport": "rotated"},
    ],
    ids=lambda more: " ".join(map(str, more)),
)
def test_shooting_and_collocation(more):
    """Two methods that share nothing with the elements, on the strong form: the sheet's tension turned out of the meridian."""
    scene = BELOW.replace(**{"demagnetization": False, **more})
    eq = fm.equilibrium(scene, center_height=0.5)
    for method in (collocate,) if more.get("saturation") else (shoot, collocate):  # saturation makes a radius by itself dear
        found = method(scene, guess=Guess.of(eq), center_height=0.5)
        assert found.converged
        for quantity in ("pressure", "volume", "magnetic_energy"):
            assert getattr(found, quantity) == pytest.approx(getattr(eq, quantity), rel=2e-9), quantity


def test_what_the_strong_form_refuses():
    with pytest.raises(fm.InputError, match=r"membrane\.remanence"):
        shoot(DEFORMED, guess=Guess(1.0, 0.5, 1.1), center_height=0.5)
