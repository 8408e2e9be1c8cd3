"""Strain energies beyond Ogden's: closed forms, digits at small strain, limits, and what is refused."""

from __future__ import annotations

from decimal import Decimal, getcontext

import casadi as ca
import numpy as np
import pytest

import femmembrane as fm
from femmembrane.accuracy.shooting import shoot
from femmembrane.accuracy.strong_form import Guess
from femmembrane.physics.tension_field import TensionField
from femmembrane.potential import Family, Potential
from femmembrane.potential.expressions import casadi_answers_numpy
from femmembrane.scene.variation import Parameter, names
from femmembrane.solve.guess import guess_at_volume
from tests.cases import disc_scene

getcontext().prec = 60
D = Decimal
HALF = D(1) / 2
CHAIN = [D(1) / 2, D(1) / 20, D(11) / 1050, D(19) / 7000, D(519) / 673750]


def arruda_boyce(links, squares, _):
    n, first = D(links), sum(squares)
    series = [c / n**k * (first ** (k + 1) - D(3) ** (k + 1)) for k, c in enumerate(CHAIN)]
    modulus = sum(2 * (k + 1) * c / n**k * D(3) ** k for k, c in enumerate(CHAIN))  # mu = 2 dW/dI_1 at rest
    return sum(series) / modulus


def lopez_pamies(squares, _):
    first = sum(squares)
    return sum(D(m) * D(3) ** (1 - D(a)) / (2 * D(a)) * (first ** D(a) - D(3) ** D(a)) for m, a in (("0.7", "0.75"), ("0.3", "1.5")))


def extended_tube(squares, stretches):
    x, share, beta = D("0.0225"), D("0.25"), D("0.5")
    j = sum(squares) - 3
    chains = ((1 - x) * j / (1 - x * j) + (1 - x * j).ln()) / (2 * (1 - 2 * x))
    return (1 - share) * chains + 2 * share / beta**2 * (sum((-beta * s.ln()).exp() for s in stretches) - 3)


def polynomial(squares, _):
    j, k = sum(squares) - 3, sum(1 / s for s in squares) - 3
    return sum(D(repr(c)) * j ** int(name[1]) * k ** int(name[2]) for name, c in NINE.items())


#: all powers up to the third; these are no fit, and one is negative
NINE = {"c10": 0.375, "c01": 0.125, "c20": -0.01, "c11": 0.005, "c02": 0.002, "c30": 0.001, "c21": 0.0003, "c12": 0.0002, "c03": 0.0001}

#: material and its definition, from the squares of the three stretches and the stretches
DEFINITIONS = {
    "mooney-rivlin": (
        fm.MooneyRivlin(0.3),
        lambda squares, _: (sum(squares) - 3 + D("0.3") * (sum(1 / s for s in squares) - 3)) / (2 * (1 + D("0.3"))),
    ),
    "varga": (fm.Varga(), lambda _, stretches: 2 * (sum(stretches) - 3)),
    "yeoh": (fm.Yeoh(-0.02, 0.001), lambda q, _: (j := sum(q) - 3) / 2 + D("-0.02") * j**2 + D("0.001") * j**3),
    "gent": (fm.Gent(97.2), lambda q, _: -D("97.2") / 2 * (1 - (sum(q) - 3) / D("97.2")).ln()),
    "arruda-boyce": (fm.ArrudaBoyce(26.5), lambda q, s: arruda_boyce(26.5, q, s)),
    "fung": (fm.Fung(0.07), lambda q, _: ((D("0.07") * (sum(q) - 3)).exp() - 1) / (2 * D("0.07"))),
    "gent-gent": (
        fm.GentGent(97.2, 0.3),
        lambda q, _: -D("0.7") * D("97.2") / 2 * (1 - (sum(q) - 3) / D("97.2")).ln() + D("0.45") * (sum(1 / s for s in q) / 3).ln(),
    ),
    "polynomial": (fm.Polynomial(**NINE), polynomial),
    "lopez-pamies": (fm.LopezPamies(0.75, 1.5, 0.3), lopez_pamies),
    "extended-tube": (fm.ExtendedTube(0.5, 0.15, 0.25), extended_tube),
    "veronda-westmann": (
        fm.VerondaWestmann(0.5),
        lambda q, _: ((D("0.5") * (sum(q) - 3)).exp() - 1) / D("0.5") - (sum(1 / s for s in q) - 3) / 2,
    ),
}
MATERIALS = {name: material for name, (material, _) in DEFINITIONS.items()}
#: those of both invariants, and of stretches beside an invariant
BOTH = ("gent-gent", "polynomial", "extended-tube", "veronda-westmann")
#: powers with symbols, ufuncs: what a user may write
OWN = fm.StrainEnergy(lambda a, b: (a**2 + b**2 + 1 / (a * b) ** 2 - 3) / 2 + 0.01 * np.log((a**2 + b**2 + 1 / (a * b) ** 2) / 3) ** 2)
ALL = MATERIALS | {"own": OWN}

every = pytest.mark.parametrize("name", MATERIALS)
everyone = pytest.mark.parametrize("name", ALL)
POINTS = [(0.1, 0.2), (0.9, -0.3), (1.2, 1.1), (-0.2, -0.4), (0.0, 0.7), (0.4, 0.4)]


def exact(name, e1, e2):
    """The definition at (e_1, e_2), with 60 digits."""
    stretches = [e.exp() for e in (D(e1), D(e2), -D(e1) - D(e2))]
    return DEFINITIONS[name][1]([s * s for s in stretches], stretches)


def exact_stress(name, e1, e2):
    """Central difference with 60 digits: error 1e-36 of the third derivative."""
    h = D("1e-18")
    return (exact(name, D(e1) + h, e2) - exact(name, D(e1) - h, e2)) / (2 * h)


# --- at a point


@everyone
def test_rest(name):
    material = ALL[name]
    assert material.energy(0.0, 0.0) == pytest.approx(0, abs=1e-16)
    assert np.ravel(material.stress(0.0, 0.0)) == pytest.approx([0, 0], abs=1e-15)
    assert np.ravel(material.tangent(0.0, 0.0)) == pytest.approx([4, 2, 4], rel=1e-14)  # shear modulus 1


@every
@pytest.mark.parametrize("size", [1e-12, 1e-8, 1e-4, 0.01, 0.3, 1.0])
def test_digits(name, size):
    material = MATERIALS[name]
    for e1, e2 in ((size, 0.8 * size), (size, -0.4 * size), (0.3 * size, size)):
        assert abs(D(float(material.energy(e1, e2))) / exact(name, e1, e2) - 1) < D("2e-14")
    for e1, e2 in ((size, 0.8 * size), (size, 0.1 * size)):
        for s, (a, b) in zip(material.stress(e1, e2), ((e1, e2), (e2, e1)), strict=True):
            assert abs(D(float(s)) / exact_stress(name, a, b) - 1) < D("2e-14")


@everyone
@pytest.mark.parametrize("point", POINTS)
def test_tangent_is_the_slope_of_the_stress(name, point):
    material, h = ALL[name], 1e-5
    e1, e2 = point
    t11, t12, t22 = (float(t) for t in material.tangent(e1, e2))
    for k, step, expected in ((0, (h, 0), t11), (1, (h, 0), t12), (0, (0, h), t12), (1, (0, h), t22)):
        high, low = (material.stress(e1 + sign * step[0], e2 + sign * step[1])[k] for sign in (1, -1))
        assert (high - low) / (2 * h) == pytest.approx(expected, rel=1e-7, abs=1e-7)


@everyone
def test_casadi_sees_the_same_formulas_and_their_derivatives(name):
    e, material = ca.SX.sym("e", 2), ALL[name]
    with casadi_answers_numpy():
        energy, stress = material.energy(e[0], e[1]), ca.vertcat(*material.stress(e[0], e[1]))
        hessian, gradient = ca.hessian(energy, e)
        t11, t12, t22 = material.tangent(e[0], e[1])
    rows = [energy, stress, t11, t12, t22, gradient, hessian[0, 0], hessian[0, 1], hessian[1, 1]]
    function = ca.Function("f", [e], [ca.vertcat(*rows)])
    for point in POINTS:
        found = np.array(function(point)).ravel()
        expected = [material.energy(*point), *material.stress(*point), *material.tangent(*point)]
        assert found[:6] == pytest.approx(np.ravel(expected), rel=1e-12, abs=1e-14)
        assert found[6:] == pytest.approx(found[1:6], rel=1e-11, abs=1e-12)


@every
@pytest.mark.parametrize("stretch", [0.7, 1.3, 2.5, 4.0])
def test_uniaxial_tension_and_equibiaxial_stretch(name, stretch):
    """Cauchy stresses in closed form; natural width l^(-1/2) in tension.

    2 (f_J + f_K/l) (l^2 - 1/l) and 2 (f_J + f_K l^2) (l^2 - 1/l^4) for W = f(J, K) (Rivlin 1948).
    """
    l2, up = stretch**2, {"uniaxial": stretch**2 - 1 / stretch, "equibiaxial": stretch**2 - stretch**-4}
    for kind, e2 in (("uniaxial", -np.log(stretch) / 2), ("equibiaxial", np.log(stretch))):
        first = l2 + 2 / stretch if kind == "uniaxial" else 2 * l2 + stretch**-4
        j = first - 3
        slope = {
            "yeoh": 0.5 - 0.04 * j + 0.003 * j**2,
            "gent": 97.2 / 2 / (97.2 - j),
            "fung": np.exp(0.07 * j) / 2,
            "arruda-boyce": sum((k + 1) * float(c) / 26.5**k * first**k for k, c in enumerate(CHAIN))
            / sum(2 * (k + 1) * float(c) / 26.5**k * 3**k for k, c in enumerate(CHAIN)),
            "lopez-pamies": (0.7 * (first / 3) ** -0.25 + 0.3 * (first / 3) ** 0.5) / 2,
        }
        k = (2 * stretch + stretch**-2 if kind == "uniaxial" else stretch**4 + 2 / l2) - 3
        factor = 1 / stretch if kind == "uniaxial" else l2
        both = {
            "gent-gent": 0.35 / (1 - j / 97.2) + factor * 0.45 / (3 + k),
            "veronda-westmann": np.exp(0.5 * j) - factor / 2,
            "polynomial": sum(
                c * (m * j ** max(m - 1, 0) * k**n + factor * n * j**m * k ** max(n - 1, 0))
                for (m, n), c in ((map(int, name[1:]), c) for name, c in NINE.items())
            ),
        }
        slope |= both
        room = 1 - 0.0225 * j
        chains = up[kind] * 0.75 / 0.955 * (0.955 + 0.00050625 * j) / room**2
        tube = 0.25 / 0.5 * 2 * ((stretch**0.25 if kind == "uniaxial" else stretch) - stretch**-0.5)
        other = stretch**-2 if kind == "uniaxial" else stretch**4
        third = stretch if kind == "uniaxial" else l2
        expected = {
            "varga": 2 * (stretch - (stretch**-0.5 if kind == "uniaxial" else stretch**-2)),
            "mooney-rivlin": up[kind] * (1 + 0.3 * (1 / stretch if kind == "uniaxial" else l2)) / 1.3,
            "extended-tube": chains + tube,
        }
        assert third * other == pytest.approx(1 / stretch if kind == "uniaxial" else l2 * stretch**4)
        wanted = expected.get(name, 2 * slope.get(name, 0) * up[kind])
        s1, s2 = MATERIALS[name].stress(np.log(stretch), e2)
        assert s1 == pytest.approx(wanted, rel=1e-13)
        assert s2 == pytest.approx(0 if kind == "uniaxial" else wanted, rel=1e-13, abs=1e-13)


@everyone
def test_the_tension_field_has_the_natural_width(name):
    """The relaxed energy is continuous with its slope where wrinkles begin, at l_2 = l_1^(-1/2), for every isotropic material."""
    material, relaxed = ALL[name], TensionField(ALL[name])
    e = 0.4
    assert relaxed.energy(e, -0.9 * e) == pytest.approx(float(material.energy(e, -e / 2)), rel=1e-14)
    assert float(material.stress(e, -e / 2)[1]) == pytest.approx(0, abs=1e-14)


# --- limits and refusals


@pytest.mark.parametrize(
    ("near", "size"),
    [
        (fm.MooneyRivlin(0.0), 0.0),
        (fm.Yeoh(0.0), 0.0),
        (fm.Gent(1e9), 1e-6),
        (fm.ArrudaBoyce(1e9), 1e-6),
        (fm.Fung(1e-9), 1e-6),
        (fm.GentGent(1e9, 0.0), 1e-6),
        (fm.Polynomial(), 0.0),
        (fm.LopezPamies(1.0), 0.0),
        (fm.ExtendedTube(0.5, 1e-6, 0.0), 1e-6),
    ],
    ids=lambda value: type(value).__name__,
)
@pytest.mark.parametrize("point", POINTS)
def test_limit_is_neo_hookean(near, size, point):
    plain = fm.NeoHookean()
    pairs = [(near.energy(*point), plain.energy(*point))]
    pairs += [*zip(near.stress(*point), plain.stress(*point), strict=True), *zip(near.tangent(*point), plain.tangent(*point), strict=True)]
    for found, expected in pairs:
        assert found == pytest.approx(expected, rel=size + 1e-14, abs=size + 1e-14)


def test_beyond_locking_nothing_is_a_number():
    """Not even a stress, which its formula would give: a solver has to notice."""
    gent = fm.Gent(2.0)
    assert np.isnan([gent.energy(1.0, 1.0), *gent.stress(1.0, 1.0), *gent.tangent(1.0, 1.0)]).all()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fm.MooneyRivlin(-0.01), r"material.ratio = -0.01: .*Baker-Ericksen"),
        (lambda: fm.MooneyRivlin("0"), r"material.ratio = '0'"),
        (lambda: fm.Yeoh(-0.01), r"material.c2 = -0.01: .*Baker-Ericksen"),
        (lambda: fm.Yeoh(-0.04, 0.001), r"material.c2 = -0.04: a number >= 0, or > -sqrt\(1.5 c3\) = -0.0387298"),
        (lambda: fm.Yeoh(0.1, -1e-9), r"material.c3 = -1e-09"),
        (lambda: fm.Gent(0.0), r"material.jm = 0.0: .*locks"),
        (lambda: fm.Gent(float("inf")), r"material.jm = inf"),
        (lambda: fm.ArrudaBoyce(1.0), r"material.links = 1.0: .*> 1"),
        (lambda: fm.Fung(-0.1), r"material.b = -0.1: .*dies out"),
        (lambda: fm.GentGent(-1.0, 0.3), r"material.jm = -1.0: .*locks"),
        (lambda: fm.GentGent(50.0, 1.0), r"material.share = 1.0: a number >= 0 and < 1"),
        (lambda: fm.GentGent(50.0, -0.1), r"material.share = -0.1: a number >= 0 and < 1"),
        (lambda: fm.LopezPamies(0.0), r"material.alpha1 = 0.0: .*other than 0"),
        (lambda: fm.LopezPamies(1.0, 2.0, "half"), r"material.share = 'half'"),
        (lambda: fm.ExtendedTube(0.0, 0.1, 0.5), r"material.beta = 0.0: a number > 0"),
        (lambda: fm.ExtendedTube(1.5, 0.1, 0.5), r"material.beta = 1.5: .*1 at most"),
        (lambda: fm.ExtendedTube(0.5, 0.75, 0.5), r"material.delta = 0.75: .*no stiffness at rest"),
        (lambda: fm.VerondaWestmann(0.35), r"material.b = 0.35: a finite number > 0.35754 is allowed: .*Baker-Ericksen"),
        (lambda: fm.Polynomial(c10=0.3, c01=0.1), r"material.c10 = 0.3: 2 \(c10 \+ c01\) = 1 is needed .* divide all coefficients by 0.8"),
        (lambda: fm.Polynomial(c10=-1.0), r"material.c10 = -1.0: 2 \(c10 \+ c01\) = 1 is needed \(shear modulus 1\), not -2$"),
        (lambda: fm.Polynomial(c10=0.6, c01=-0.1), r"material.c01 = -0.1: .*Baker-Ericksen.* not at stretches of 0.6018 and 0.6773"),
        (lambda: fm.Polynomial(c20=-1e-12), r"material.c20 = -1e-12: .*Baker-Ericksen"),
        (lambda: fm.Polynomial(c11=-0.001, c20=0.01), r"material.c11 = -0.001: .*Baker-Ericksen"),
        (lambda: fm.StrainEnergy(3), r"material.function = 3: a function"),
        (lambda: fm.StrainEnergy(lambda a, b: a if a > b else b), r"must accept symbols"),
        (lambda: fm.StrainEnergy(lambda a, b, c: a), r"a function of two stretches .* takes 3 arguments; the third stretch is 1/"),
        (lambda: fm.StrainEnergy(lambda a: a), r"a function of two stretches .* takes 1 argument$"),
        (lambda: fm.StrainEnergy(lambda a, b: a + b), r"must be 0 at rest, not 2, 1, 1"),
        (lambda: fm.StrainEnergy(lambda a, b: a**2 + b**2 + 1 / (a * b) ** 2 - 3), r"shear modulus must be 1, not 2;"),
        (lambda: fm.StrainEnergy(lambda a, b: (a**2 + b**2 + 1 / (a * b) ** 2 - 3) / 2 + (a - 1) ** 3), r"symmetric"),
    ],
)
def test_unstable_and_unusable_numbers_are_refused(make, message):
    with pytest.raises(fm.InputError, match=message):
        make()


def test_the_least_softening_that_is_refused_has_no_stiffness():
    """c2 = -sqrt(1.5 c3) is where f' = 1/2 + 2 c2 J + 3 c3 J^2 first touches 0, at J = -c2/(3 c3)."""
    c3 = 0.001
    c2 = -np.sqrt(1.5 * c3)
    assert fm.Yeoh(c2 * (1 - 1e-12), c3).function(-c2 / (3 * c3))[1] == pytest.approx(0, abs=1e-11)


def test_a_polynomial_is_refused_where_yeoh_is():
    """With powers of J alone the look-up has to find the closed bound c2 > -sqrt(1.5 c3), to 3 digits."""
    c30 = 0.001
    bound = np.sqrt(1.5 * c30)
    assert fm.Polynomial(c20=-0.9995 * bound, c30=c30).c30 == c30
    with pytest.raises(fm.InputError, match=r"material.c20 .*Baker-Ericksen"):
        fm.Polynomial(c20=-1.0005 * bound, c30=c30)


def test_the_softest_stretch_of_soft_tissue():
    """The bound of b is where exp(b J) - lambda^2/2 first touches 0, over all pairs of stretches."""
    from femmembrane.physics.invariants import LEAST_RATE

    e = np.linspace(-3, 3, 2001)[:, None]
    squares = np.exp(2 * e) + np.exp(2 * e.T) + np.exp(-2 * (e + e.T)) - 3
    with np.errstate(divide="ignore", invalid="ignore"):
        needed = np.where(squares > 1e-9, (2 * e - np.log(2)) / squares, 0)
    assert needed.max() < LEAST_RATE < needed.max() + 2e-5


def test_varied_coefficients_of_a_polynomial_keep_their_sum():
    scene = fm.Scene(material=fm.Polynomial(c10=0.4, c01=0.1, c20=0.01), mesh=fm.disc(4))
    assert Parameter(scene, "material.c01").scene_at(0.2).material == fm.Polynomial(c10=0.3, c01=0.2, c20=0.01)
    assert Parameter(scene, "material.c20").scene_at(0.2).material == fm.Polynomial(c10=0.4, c01=0.1, c20=0.2)


# --- membranes


NEW = [
    fm.GentGent(97.2, 0.3),
    fm.LopezPamies(0.75, 1.5, 0.3),
    fm.ExtendedTube(0.5, 0.15, 0.25),
    fm.VerondaWestmann(0.5),
    fm.Hooke(0.3),
    fm.Polynomial(c10=0.4, c01=0.1, c20=0.01),
]


@pytest.mark.parametrize("material", NEW, ids=lambda m: type(m).__name__)
def test_every_number_can_be_varied(material):
    """The family of a number, a symbol in it, is the potential of the scene with its value."""
    scene = disc_scene(material, elements=4)
    for name in names(scene):
        parameter = Parameter(scene, name)
        value = parameter.value * 1.01 + 1e-3
        there = Potential(parameter.scene_at(value))
        x = guess_at_volume(there, 0.3)
        one, other = Family(scene, parameter.vary).evaluate(x, 0.2, value), there.evaluate(x, 0.2)
        assert one.elastic_energy == pytest.approx(other.elastic_energy, rel=1e-12), name
        assert one.gradient == pytest.approx(other.gradient, rel=1e-10, abs=1e-13), name


def test_scene_files(tmp_path):
    for material in MATERIALS.values():
        scene = fm.Scene(material=material, mesh=fm.disc(elements=4))
        scene.to_toml(tmp_path / "scene.toml")
        assert fm.Scene.from_toml(tmp_path / "scene.toml") == scene
    with pytest.raises(fm.InputError, match=r"material.model = .*it has no name in scene files"):
        fm.Scene(material=OWN).to_dict()
    with pytest.raises(fm.InputError, match=r"material.model = 'gnet': unknown; did you mean 'gent'"):
        fm.Scene.from_dict({"material": {"model": "gnet"}})


def test_another_convention_of_ogden(tmp_path):
    """W = sum 2 mu_k/alpha_k^2 (sum of l_i^alpha_k - 3) is the same rubber; negative exponents have positive moduli there."""
    mu, alpha = (0.6, 0.3, 0.1), (1.3, 5.0, -2.0)
    other = fm.Ogden(mu, alpha, convention="2mu/alpha^2")
    assert other == fm.Ogden(tuple(2 * m / a for m, a in zip(mu, alpha, strict=True)), alpha)
    e1, e2 = 0.4, 0.1
    strains = np.array([e1, e2, -e1 - e2])
    expected = sum(2 * m / a**2 * (np.exp(a * strains).sum() - 3) for m, a in zip(mu, alpha, strict=True))
    assert other.energy(e1, e2) == pytest.approx(expected, rel=1e-12)
    table = {"model": "ogden", "mu": list(mu), "alpha": list(alpha), "convention": "2mu/alpha^2"}
    scene = fm.Scene.from_dict({"material": table})
    assert scene.material == other
    scene.to_toml(tmp_path / "scene.toml")  # in the default convention
    assert fm.Scene.from_toml(tmp_path / "scene.toml") == scene
    assert "convention" not in fm.Scene.to_dict(scene)["material"]


@pytest.mark.parametrize(
    ("mu", "alpha", "convention", "message"),
    [
        ((0.9, 0.1), (1.3, -2.0), None, r"material.mu\[1\] = 0.1: mu alpha > 0 .* say convention = \"2mu/alpha\^2\""),
        ((1.4, 0.1, -0.1), (1.3, -2.0, 3.0), None, r"material.mu\[1\] = 0.1: .*alpha = -2.0$"),
        ((0.6, 0.4), (1.3, 5.0), None, r"the sum of mu is 1, .*: say convention = \"2mu/alpha\^2\", or divide mu by 1.39$"),
        ((4e5,), (2.0,), None, r"not 800000; divide mu by 400000, .*scales.shear_modulus = 400000"),
        ((3e5, 1e5), (1.3, -2.0), "2mu/alpha^2", r"the sum of mu must be 1 .*, not 400000; divide mu by 400000, .*scales.shear_modulus"),
        ((1.1, -0.1), (1.3, -2.0), "2mu/alpha^2", r"material.mu\[1\] = -0.1: mu > 0 is required"),
        ((1.0,), (2.0,), "abaqus", r"material.convention = 'abaqus'"),
        ((1.0,), (0.0,), None, r"material.alpha = \(0.0,\): exponents other than 0"),
    ],
)
def test_moduli_in_the_wrong_convention_are_told_so(mu, alpha, convention, message):
    with pytest.raises(fm.InputError, match=message):
        fm.Ogden(mu, alpha) if convention is None else fm.Ogden(mu, alpha, convention=convention)


def test_treloar():
    """The paper's table 1 is Ogden's fit of 1972 over its shear modulus, with three or four digits."""
    material = fm.Ogden.treloar()
    assert material.mu == pytest.approx((1.4910, 0.0029, -0.0236), abs=2e-4)
    assert sum(m * a for m, a in zip(material.mu, material.alpha, strict=True)) == pytest.approx(2, rel=1e-14)


def test_a_material_costs_what_its_formula_needs():
    """Recorded on 2026-11-24: 156 operations neo-Hookean and Varga, 207 Arruda-Boyce; and no more when others exist.

    Recorded on 2026-11-28: at most 252 with both invariants, and 298 for all nine powers of them; with five 265.
    """
    counts = {name: Potential(disc_scene(m, elements=2)).operations for name, m in MATERIALS.items()}
    plain = Potential(disc_scene(fm.NeoHookean(), elements=2)).operations
    assert counts["varga"] <= plain
    assert max(count for name, count in counts.items() if name not in BOTH) < 1.4 * plain
    assert max(counts[name] for name in BOTH) < 2 * plain


def test_small_pressures():
    """A nearly flat membrane only knows the shear modulus: P = 3.3367 V^3 for every material, down to V = 1e-6 (strains of 1e-12)."""
    for name, material in MATERIALS.items():
        eq = fm.equilibrium(disc_scene(material, elements=16, degree=4), volume=1e-6, solver="newton")
        expected = fm.equilibrium(disc_scene(fm.NeoHookean(), elements=16, degree=4), volume=1e-6, solver="newton").pressure
        assert eq.pressure == pytest.approx(expected, rel=1e-9), name


@pytest.mark.parametrize("name", ALL)
def test_shooting_agrees(name):
    scene = disc_scene(ALL[name], elements=16, degree=6)
    eq = fm.equilibrium(scene, center_height=1.0)
    found = shoot(scene, center_height=1.0, guess=Guess.of(eq))
    assert found.converged
    assert (eq.pressure, eq.volume) == pytest.approx((found.pressure, found.volume), rel=1e-9)
    assert eq.elastic_energy == pytest.approx(found.elastic_energy, rel=1e-9)


@pytest.mark.parametrize(("jm", "volume"), [(2.0, 2.4), (5.0, 4.0), (30.0, 25.0)])
def test_gent_close_to_locking(jm, volume):
    """Up to 0.85 of J_m and more, from nothing and by both solvers."""
    scene = disc_scene(fm.Gent(jm), elements=16, degree=6)
    eq, other = (fm.equilibrium(scene, volume=volume, solver=solver) for solver in ("newton", "ipopt"))
    assert other.pressure == pytest.approx(eq.pressure, rel=1e-9)
    found = shoot(scene, volume=volume, guess=Guess.of(eq))
    assert found.converged
    assert eq.pressure == pytest.approx(found.pressure, rel=1e-8)
    strains = np.log(eq.profile()["stretch_1"]), np.log(eq.profile()["stretch_2"])
    assert 2 * fm.NeoHookean().energy(*strains).max() > 0.85 * jm
    assert np.isfinite(eq.profile()["mechanical_stress_1"]).all()


def test_mooney_rivlin_loses_its_limit_point():
    """The disc has a pressure maximum and a minimum beyond it, which merge at C_2/C_1 = 0.05544 (a cusp; recorded on 2026-11-24).

    The value is confirmed on both sides of it by traces: two limit points at 0.054, none at 0.056.
    """
    scene = disc_scene(fm.MooneyRivlin(0.05), elements=12, degree=4)
    branch = fm.trace(scene, start=0.5, until={"volume": 20.0})
    assert [p.kind for p in branch.special_points] == ["limit_point", "limit_point"]
    curve = fm.fold_curve(scene, start=branch.special_points[0], parameter="material.ratio", bounds=(0.05, 0.1))
    (cusp,) = curve.cusps
    assert cusp.value == pytest.approx(0.05544, abs=2e-5)
    for ratio, count in ((0.054, 2), (0.056, 0)):
        branch = fm.trace(scene.replace(material=fm.MooneyRivlin(ratio)), start=2.0, until={"volume": 25.0})
        assert len(branch.special_points) == count
