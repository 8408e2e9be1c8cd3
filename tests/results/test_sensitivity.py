"""Derivatives with respect to numbers of the scene, against solving again and against closed forms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.results.verdict import Verdict
from femmembrane.scene.variation import Parameter, Scale, names, parameter_of
from femmembrane.stability.eigenvalue_rates import require_simple
from femmembrane.stability.spectrum import Pencil

#: quantities of every state
STATE = ("pressure", "volume", "center_height", "elastic_energy", "energy")


def solved(scene: fm.Scene, held: Mapping[str, float], start: fm.Equilibrium | None = None) -> fm.Equilibrium:
    return fm.equilibrium(scene, **held, start=start, solver="newton")


def answers(eq: fm.Equilibrium, of: Sequence[str], **along: Any) -> Any:
    found = [getattr(eq, name) for name in of if hasattr(eq, name)]
    profile = eq.profile(along.get("r", [0.25, 0.5]))
    return np.concatenate([np.array(found), *(profile[name] for name in of if name in profile)])


def again(scene: fm.Scene, name: str, answer: Any) -> tuple[Any, Any]:
    """Derivative of an answer by solving again at neighbouring values, extrapolated to step 0, and how far that is to be trusted."""
    parameter = Parameter(scene, name)
    h = 1.5e-3 * (abs(parameter.value) or 1.0)
    slopes = [
        (answer(parameter.scene_at(parameter.value + t)) - answer(parameter.scene_at(parameter.value - t))) / (2 * t)
        for t in (h, h / 2, h / 4)
    ]
    fourth = [(4 * b - a) / 3 for a, b in pairwise(slopes)]
    best = (16 * fourth[1] - fourth[0]) / 15
    return best, np.abs(best - fourth[1])


def compare(
    scene: fm.Scene, held: Mapping[str, float], of: Sequence[str], to: Sequence[str], start: fm.Equilibrium | None = None, **along: Any
) -> None:
    eq = solved(scene, held, start)
    (control,) = held
    found = eq.sensitivity(list(of), list(to), held=control, r=along.get("r", [0.25, 0.5]))
    scale = np.abs(answers(eq, of, **along))
    for name in to:
        mine = np.concatenate([np.atleast_1d(found[q][name]) for q in of])
        expected, doubt = again(scene, name, lambda changed: answers(solved(changed, held, eq), of, **along))
        number = abs(Parameter(scene, name).value) or 1.0
        allowed = 1e-6 * np.abs(expected) + 1e-8 * scale / number + 10 * doubt
        assert (10 * doubt <= 1e-5 * (np.abs(expected) + scale / number)).all(), (name, expected, doubt)
        assert (np.abs(mine - expected) <= allowed).all(), (name, mine, expected)


DISC = fm.disc(16)
SCENES: Mapping[str, tuple[fm.Scene, Mapping[str, float]]] = {
    "ogden": (fm.Scene(fm.Ogden.treloar(), DISC), {"center_height": 1.5}),
    "beyond the limit point": (fm.Scene(fm.MooneyRivlin(0.05), DISC), {"center_height": 2.0}),
    "gent": (fm.Scene(fm.Gent(30.0), DISC), {"volume": 4.0}),
    "polynomial": (
        fm.Scene(fm.Polynomial(c10=0.45, c01=0.05, c20=0.02, c11=0.01, c02=0.01, c30=0.01, c21=0.01, c12=0.01, c03=0.01), DISC),
        {"volume": 2.0},
    ),
    "dipole": (fm.Scene(fm.MooneyRivlin(0.1), DISC, sources=[fm.Dipole(0.05, 1.5)], susceptibility=0.5), {"pressure": 0.4}),
    "weak dipole": (
        fm.Scene(fm.NeoHookean(), DISC, sources=[fm.Dipole(0.05, 1.5), fm.Dipole(0.02, 2.0)], susceptibility=2.5),
        {"volume": 0.4},
    ),
    "magnetised": (
        fm.Scene(fm.NeoHookean(), DISC, sources=[fm.Dipole(0.05, 1.5)], susceptibility=0.5, saturation=0.4, demagnetization=True),
        {"volume": 1.0},
    ),
    "loads": (fm.Scene(fm.MooneyRivlin(0.1), DISC, loads=[fm.Weight(0.3), fm.Hydrostatic(0.2)]), {"volume": 1.5}),
    "prestretch": (fm.Scene(fm.NeoHookean(), DISC, prestretch=1.3), {"pressure": 0.7}),
    "rim": (fm.Scene(fm.MooneyRivlin(0.1), fm.disc(16, rim={"kind": "clamped", "radius": 1.2})), {"center_height": 0.8}),
    "tube": (fm.Scene(fm.MooneyRivlin(0.1), fm.Tube(length=2.0, elements=16)), {"volume": 9.0}),
    "two ends": (
        fm.Scene(
            fm.MooneyRivlin(0.1),
            fm.Tube(
                length=2.0,
                elements=16,
                top={"kind": "clamped", "height": 1.2, "radius": 1.1},
                bottom={"kind": "clamped", "height": -0.1, "radius": 1.0},
            ),
        ),
        {"volume": 9.0},
    ),
    "cap": (fm.Scene(fm.MooneyRivlin(0.1), fm.Cap(height=0.4, elements=16)), {"center_height": 0.9}),
    "sphere": (fm.Scene(fm.Ogden.treloar(), fm.Sphere(elements=12)), {"volume": 30.0}),
    "voltage": (fm.Scene(fm.MooneyRivlin(0.1), DISC, electric=fm.Electric(voltage=0.3)), {"volume": 1.0}),
    "total charge": (fm.Scene(fm.MooneyRivlin(0.1), DISC, electric=fm.Electric(total_charge=1.0)), {"volume": 1.0}),
    "frozen charge": (fm.Scene(fm.MooneyRivlin(0.1), DISC, electric=fm.Electric(frozen_charge=0.3)), {"volume": 1.0}),
    "tension field": (
        fm.Scene(fm.MooneyRivlin(0.1), fm.Tube(length=2.0, elements=16, top={"kind": "clamped", "height": 1.3}), tension_field=True),
        {"volume": 6.6},
    ),
}


@pytest.mark.parametrize("case", SCENES)
def test_derivatives_are_those_of_the_whole_solve(case: str) -> None:
    scene, held = SCENES[case]
    to = [name for name in names(scene) if not name.endswith((".1", ".2"))]
    compare(scene, held, (*STATE, "rho", "eta", "stretch_1", "stretch_2", "mechanical_stress_1", "total_stress_2"), to)


def along_numbers(scene: fm.Scene, to: Sequence[str], answer: Any, mine: Mapping[str, Any], rel: float = 1e-6) -> None:
    """Derivatives against those of an answer of the whole scene."""
    for name in to:
        expected, doubt = again(scene, name, answer)
        assert (doubt <= 1e-6 * np.abs(expected).max() + 1e-9).all()
        assert mine[name] == pytest.approx(expected, rel=rel, abs=1e-7 * float(np.abs(expected).max()) + 1e-9), name


_DIPOLES = [fm.Dipole(0.05, 1.5), fm.Dipole(0.02, 2.0)]
LIMITS: Mapping[str, tuple[fm.Scene, str, Mapping[str, float], Sequence[str]]] = {
    "mooney": (
        fm.Scene(fm.MooneyRivlin(0.02), DISC, prestretch=1.1),
        "limit_point",
        {"volume": 9.0},
        ["material.ratio", "membrane.prestretch"],
    ),
    "ogden": (fm.Scene(fm.Ogden((0.98, -0.02), (2.0, -2.0)), DISC), "limit_point", {"volume": 9.0}, ["material.mu.0"]),
    "dipoles": (
        fm.Scene(fm.NeoHookean(), DISC, sources=_DIPOLES, susceptibility=2.5),
        "limit_point",
        {"center_height": 0.7},
        ["source.0.strength", "membrane.susceptibility"],
    ),
    "volume fold": (
        fm.Scene(fm.NeoHookean(), DISC, sources=_DIPOLES, susceptibility=2.5),
        "volume_fold",
        {"center_height": 0.7},
        ["source.0.strength", "source.1.height"],
    ),
    "voltage": (
        fm.Scene(fm.Gent(60.0), DISC, electric=fm.Electric(voltage=0.2)),
        "limit_point",
        {"volume": 4.0},
        ["electric.voltage", "material.jm"],
    ),
}


@pytest.mark.parametrize("case", LIMITS)
def test_folds_move_with_the_numbers(case: str) -> None:
    scene, kind, until, to = LIMITS[case]

    def fold(changed: fm.Scene) -> fm.SpecialPoint:
        points = fm.trace(changed, until=until).special_points or ()
        return next(point for point in points if point.kind == kind)

    of = ["pressure", "volume", "center_height"]
    found = fold(scene).sensitivity(of, to)
    mine = {name: np.array([found[q][name] for q in of]) for name in to}
    along_numbers(scene, to, lambda changed: np.array([getattr(fold(changed), q) for q in of]), mine)


def test_the_limit_point_of_a_branch() -> None:
    """Of a branch the first limit point, and everything else state by state."""
    scene = fm.Scene(fm.MooneyRivlin(0.05), fm.disc(16))
    branch = fm.trace(scene, until={"volume": 8.0})
    point = next(p for p in branch.special_points or () if p.kind == "limit_point")
    assert branch.sensitivity("limit_height", "material.ratio") == point.sensitivity("center_height", "material.ratio")
    several = branch.sensitivity(["limit_pressure", "limit_volume"], ["material.ratio"])
    assert several["limit_pressure"]["material.ratio"] == point.sensitivity("pressure", "material.ratio")
    rates = branch[3:6].sensitivity("pressure", ["material.ratio"], held="center_height")["material.ratio"]
    assert rates.tolist() == [eq.sensitivity("pressure", "material.ratio", held="center_height") for eq in branch[3:6]]
    # at a limit point the pressure is stationary along the branch, so that what is held makes no difference to its derivative
    at_volume = point.equilibrium.sensitivity("pressure", "material.ratio", held="volume")
    assert at_volume == pytest.approx(point.sensitivity("pressure", "material.ratio"), rel=1e-9)


EIGENVALUES: Mapping[str, tuple[fm.Scene, Mapping[str, float], dict[str, Any]]] = {
    "pressure": (fm.Scene(fm.MooneyRivlin(0.1), DISC), {"volume": 3.0}, {"control": "pressure"}),
    "volume": (
        fm.Scene(fm.MooneyRivlin(0.1), DISC, sources=[fm.Dipole(0.05, 1.5)], susceptibility=0.5),
        {"pressure": 0.4},
        {"control": "volume"},
    ),
    "waves": (
        fm.Scene(fm.MooneyRivlin(0.1), DISC, sources=[fm.Dipole(0.05, 1.5)], susceptibility=0.5),
        {"pressure": 0.4},
        {"azimuthal": 1},
    ),
    "total charge": (
        fm.Scene(fm.MooneyRivlin(0.1), DISC, electric=fm.Electric(total_charge=1.0)),
        {"volume": 1.0},
        {"control": "pressure"},
    ),
    "volume of a tube": (fm.Scene(fm.MooneyRivlin(0.1), fm.Tube(length=2.0, elements=16)), {"volume": 9.0}, {"control": "volume"}),
    "waves of a tube": (fm.Scene(fm.MooneyRivlin(0.1), fm.Tube(length=2.0, elements=16)), {"volume": 9.0}, {"azimuthal": 2}),
    "prestretch": (fm.Scene(fm.NeoHookean(), DISC, prestretch=1.3), {"pressure": 0.7}, {"control": "volume"}),
}


@pytest.mark.parametrize("case", EIGENVALUES)
def test_eigenvalues_move_with_the_numbers(case: str) -> None:
    scene, held, asked = EIGENVALUES[case]
    eq = solved(scene, held)
    to = names(scene)

    def value(changed: fm.Scene) -> Any:
        return np.array(solved(changed, held, eq).verdict(**asked).smallest_eigenvalue)

    along_numbers(scene, to, value, eq.sensitivity("eigenvalue", to, held=next(iter(held)), **asked))


def test_with_an_amount_of_gas() -> None:
    """At a held amount, chamber and atmosphere included; the eigenvalue under it as well."""
    scene = fm.Scene(fm.MooneyRivlin(0.1), DISC, chamber=fm.Chamber(2.0, 1.5))
    eq = fm.equilibrium(scene, gas=7.0)
    of = ["pressure", "volume", "eigenvalue", "gas_amount"]
    found = eq.sensitivity(of, names(scene), control="gas")

    def answer(changed: fm.Scene) -> Any:
        other = fm.equilibrium(changed, gas=7.0, start=eq)
        return np.array([other.pressure, other.volume, other.verdict("gas").smallest_eigenvalue, other.gas_amount])

    along_numbers(scene, names(scene), answer, {name: np.array([found[q][name] for q in of]) for name in names(scene)})
    # with the volume held the amount is what answers
    amount = eq.sensitivity("gas_amount", ["chamber.volume", "chamber.atmosphere"], held="volume")
    assert amount["chamber.volume"] == pytest.approx(eq.pressure + 1.5)
    assert amount["chamber.atmosphere"] == pytest.approx(eq.volume + 2.0)


@pytest.mark.parametrize("electric", [fm.Electric(voltage=0.3), fm.Electric(total_charge=1.0)])
def test_electric_quantities(electric: fm.Electric) -> None:
    scene = fm.Scene(fm.MooneyRivlin(0.1), DISC, electric=electric)
    eq = solved(scene, {"volume": 1.0})
    of = ["voltage", "charge", "capacitance", "electric_energy"]
    found = eq.sensitivity(of, names(scene), held="volume")

    def answer(changed: fm.Scene) -> Any:
        other = solved(changed, {"volume": 1.0}, eq)
        return np.array([getattr(other, name) for name in of])

    along_numbers(scene, names(scene), answer, {name: np.array([found[q][name] for q in of]) for name in names(scene)})


def test_what_a_run_over_a_number_holds_is_held() -> None:
    scene = fm.Scene(fm.MooneyRivlin(0.1), DISC, sources=[fm.Dipole(20.0, 4.0)], susceptibility=1.0)
    branch = fm.vary(scene, "source.0.height", [4.0, 4.2], hold={"pressure": 0.8})
    held = branch.sensitivity("volume", "source.0.height", held="pressure")
    assert (branch.sensitivity("volume", "source.0.height") == held).all()
    assert abs(held).min() > 1e-3


def test_electrodes_without_a_voltage() -> None:
    """Q = C(V) phi, where C does not change with the sign of phi."""
    eq = solved(fm.Scene(fm.MooneyRivlin(0.1), DISC, electric=fm.Electric(voltage=0.0)), {"volume": 1.0})
    found = eq.sensitivity(["charge", "capacitance", "electric_energy"], "electric.voltage", held="volume")
    assert found["charge"] == pytest.approx(eq.capacitance, rel=1e-8)
    assert abs(found["capacitance"]) < 1e-6 * eq.capacitance
    assert abs(found["electric_energy"]) < 1e-6


def test_a_sphere_against_its_closed_form() -> None:
    """P = sum 2 mu_k (l^(alpha_k - 3) - l^(-2 alpha_k - 3)) at the stretch l = (3 V/(4 pi))^(1/3): E = 4 pi W(l), P = E'/V'."""
    rubber = fm.Ogden(mu=(1.4, -0.1), alpha=(1.3, -1.8))
    scene = fm.Scene(rubber, fm.Sphere(elements=12), degree=4)
    stretch = 1.8
    eq = solved(scene, {"volume": 4 / 3 * np.pi * stretch**3})

    def term(alpha: float) -> float:
        return 2 * (stretch ** (alpha - 3) - stretch ** (-2 * alpha - 3))

    def slope(alpha: float) -> float:
        return 2 * np.log(stretch) * (stretch ** (alpha - 3) + 2 * stretch ** (-2 * alpha - 3))

    (mu, other), (alpha, beta) = rubber.mu, rubber.alpha
    found = eq.sensitivity("pressure", ["material.mu.0", "material.alpha.0"], held="volume")
    # the sum of mu alpha stays: the other modulus falls by alpha/beta, or mu by mu/alpha
    assert found["material.mu.0"] == pytest.approx(term(alpha) - alpha / beta * term(beta), rel=1e-7)
    assert found["material.alpha.0"] == pytest.approx(mu * slope(alpha) - mu / alpha * term(alpha), rel=1e-7)
    assert other * beta + mu * alpha == pytest.approx(2.0)


def test_a_stretched_disc_against_its_closed_form() -> None:
    """Nearly flat under the tension N = 1 - p^-6 over the radius p: V = pi P p^4/(8 N)."""
    p, volume = 1.3, 1e-4
    eq = solved(fm.Scene(fm.NeoHookean(), DISC, prestretch=p), {"volume": volume})
    expected = 8 * volume / np.pi * (10 * p**-11 - 4 * p**-5)
    assert eq.sensitivity("pressure", "membrane.prestretch", held="volume") == pytest.approx(expected, rel=1e-6)


def test_a_strength_that_is_zero() -> None:
    """The derivative is that of the first breath of a source: one-sided, as no source is weaker."""
    scene = fm.Scene(fm.NeoHookean(), DISC, sources=[fm.Dipole(0.0, 1.5)], susceptibility=2.5)
    eq = solved(scene, {"volume": 1.0})
    found = eq.sensitivity(["pressure", "eta"], "source.0.strength", held="volume", r=[0.0, 0.5])
    assert eq.sensitivity("pressure", "membrane.susceptibility", held="volume") == 0.0
    strengths = np.array([1e-4, 2e-4, 4e-4])
    weak = [solved(Parameter(scene, "source.0.strength").scene_at(m), {"volume": 1.0}, eq) for m in strengths]
    slopes = np.array([w.pressure - eq.pressure for w in weak]) / strengths
    assert found["pressure"] == pytest.approx((8 * slopes[0] - 6 * slopes[1] + slopes[2]) / 3, rel=1e-6)
    moves = [(w.profile([0.0, 0.5])["eta"] - eq.profile([0.0, 0.5])["eta"]) / m for w, m in zip(weak, strengths, strict=True)]
    assert found["eta"] == pytest.approx((8 * moves[0] - 6 * moves[1] + moves[2]) / 3, rel=1e-5)


def test_in_si_units() -> None:
    scales = fm.Scales(radius=0.02, thickness=3e-4, shear_modulus=4e5)
    eq = solved(fm.Scene(fm.MooneyRivlin(0.1), DISC, scales=scales), {"center_height": 1.0})
    found = eq.sensitivity(["pressure", "pressure_pa", "volume_m3"], "material.ratio", held="center_height")
    assert found["pressure_pa"] == pytest.approx(scales.to_si("pressure", found["pressure"]))
    assert found["volume_m3"] == pytest.approx(0.02**3 * eq.sensitivity("volume", "material.ratio", held="center_height"))


def test_electric_quantities_in_si_units() -> None:
    """Against solving again with another voltage, and on a sheet that is thicker or stiffer."""
    scales, permittivity = fm.Scales(radius=0.02, thickness=1e-3, shear_modulus=3e4), 3.0
    scene = fm.Scene(fm.MooneyRivlin(0.1), DISC, scales=scales, electric=fm.Electric(voltage=500.0, relative_permittivity=permittivity))
    eq = solved(scene, {"volume": 1.0})
    of = ["voltage_v", "charge_c", "capacitance_f", "electric_field_v_per_m"]
    found = eq.sensitivity(of, ["electric.voltage", "scales.thickness", "scales.shear_modulus"], held="volume")

    def answer(changed: fm.Scene) -> Any:
        other = solved(changed, {"volume": 1.0}, eq)
        converter = changed.converter
        assert converter is not None
        kinds = {"voltage": "voltage", "charge": "charge", "capacitance": "capacitance", "electric_field": "electric_field"}
        return np.array([converter.to_si(kind, getattr(other, name)) for name, kind in kinds.items()])

    here = answer(scene)
    for name in ("electric.voltage", "scales.thickness", "scales.shear_modulus"):
        parameter = parameter_of(scene, name)
        h = 1e-3 * parameter.value
        slopes = [
            (answer(parameter.scene_at(parameter.value + t)) - answer(parameter.scene_at(parameter.value - t))) / (2 * t)
            for t in (h, h / 2)
        ]
        true = (4 * slopes[1] - slopes[0]) / 3
        for k, q in enumerate(of):
            assert found[q][name] * parameter.value / here[k] == pytest.approx(true[k] * parameter.value / here[k], abs=1e-7)
    without = solved(scene.replace(electric=fm.Electric(voltage=0.1)), {"volume": 1.0})
    with pytest.raises(fm.InputError, match="did you mean 'voltage'"):
        without.sensitivity("voltage_v", "electric.voltage")


def test_what_has_no_derivative_is_refused() -> None:
    eq = solved(fm.Scene(fm.MooneyRivlin(0.1), DISC), {"volume": 1.0})
    for arguments, key, words in (
        (("presure", "material.ratio"), "of", "did you mean 'pressure'"),
        (("pressure_pa", "material.ratio"), "of", "known: "),
        (("pressure", "material.rato"), "to", "did you mean 'material.ratio'"),
        (("pressure", []), "to", "a name or a list of names"),
        ((3, "material.ratio"), "of", "a name or a list of names"),
        (("eigenvalue", "material.ratio"), "control", "known: gas, pressure, volume"),
    ):
        with pytest.raises(fm.InputError, match=words) as error:
            eq.sensitivity(*arguments)
        assert error.value.key == key
    with pytest.raises(fm.InputError, match="did you mean 'pressure'"):
        eq.sensitivity("volume", "material.ratio", held="pressur")
    with pytest.raises(fm.InputError, match="known: center_height, gas"):
        eq.sensitivity("volume", "material.ratio", held=["pressure"])  # type: ignore[arg-type]
    for places in ("middle", [[0.1, 0.2]], [0.1, None]):
        with pytest.raises(fm.InputError, match="reference radii in"):
            eq.sensitivity("eta", "material.ratio", r=places)  # type: ignore[arg-type]
    with pytest.raises(fm.InputError, match="no gas holds"):
        eq.sensitivity("volume", "material.ratio", held="gas")
    tube = solved(fm.Scene(fm.MooneyRivlin(0.1), fm.cylinder(3.0, 8)), {"volume": 11.0})
    with pytest.raises(fm.InputError, match="held along the axis"):
        tube.sensitivity("volume", "material.ratio", held="center_height")
    with pytest.raises(fm.InputError, match="fixed by the unit of stress"):
        solved(fm.Scene(fm.Ogden((1.25,), (1.6,)), DISC), {"volume": 1.0}).sensitivity("pressure", "material.mu.0")


def test_a_fold_has_no_derivative_at_what_is_stationary_there() -> None:
    branch = fm.trace(fm.Scene(fm.MooneyRivlin(0.05), DISC), until={"volume": 8.0})
    point = next(p for p in branch.special_points or () if p.kind == "limit_point")
    with pytest.raises(fm.SolveError, match="the pressure is stationary at this equilibrium"):
        point.equilibrium.sensitivity("volume", "material.ratio", held="pressure")
    with pytest.raises(fm.InputError, match="special points of this branch were not looked for"):
        branch[:3].sensitivity("limit_pressure", "material.ratio")
    with pytest.raises(fm.InputError, match="this branch has no limit point"):
        fm.trace(branch.scene, until={"volume": 1.0}).sensitivity("limit_pressure", "material.ratio")
    with pytest.raises(fm.InputError, match="ask for them in two calls"):
        branch.sensitivity(["limit_pressure", "volume"], "material.ratio")
    with pytest.raises(fm.SolveError, match="interpolated"):
        branch.at(volume=1.0).sensitivity("pressure", "material.ratio")


def test_a_multiple_eigenvalue_has_no_derivative() -> None:
    mass = np.zeros((4, 3), order="F")
    mass[2] = 1.0
    verdict = Verdict(True, 1.0, 1e-12, "pressure", 0, 0, "stable")
    for second, simple in ((1.0, False), (1.1, True)):
        band = np.zeros((4, 3), order="F")
        band[2] = 1.0, second, 2.0
        pencil = Pencil(band, mass, 1, None, 0.0)
        if simple:
            require_simple(pencil, verdict)
        else:
            with pytest.raises(fm.InputError, match="multiple"):
                require_simple(pencil, verdict)


_SCALES = fm.Scales(radius=0.02, thickness=3e-4, shear_modulus=4e5)
SCALED: Mapping[str, tuple[fm.Scene, Mapping[str, float]]] = {
    "bare": (fm.Scene(fm.NeoHookean(), fm.Cap(height=0.4, elements=16), scales=_SCALES), {"center_height": 0.9}),
    "pressure": (fm.Scene(fm.MooneyRivlin(0.1), DISC, scales=_SCALES), {"pressure": 0.7}),
    "loads": (
        fm.Scene(
            fm.MooneyRivlin(0.1),
            DISC,
            sources=[fm.Dipole(0.05, 1.5)],
            susceptibility=0.5,
            loads=[fm.Weight(0.3), fm.Hydrostatic(0.2)],
            scales=_SCALES,
        ),
        {"pressure": 0.4},
    ),
    "volts": (
        fm.Scene(fm.MooneyRivlin(0.1), DISC, electric=fm.Electric(voltage=9000.0, relative_permittivity=3.0), scales=_SCALES),
        {"volume": 1.0},
    ),
}


@pytest.mark.parametrize("case", SCALED)
def test_a_sheet_that_is_thicker_or_stiffer(case: str) -> None:
    """All that was given in SI units stays, what is held included; answers in SI units and without."""
    scene, held = SCALED[case]
    eq = solved(scene, held)
    ((name, load),) = held.items()
    of = ["pressure", "pressure_pa", "volume", "elastic_energy_j", "center_height_m", "total_stress_1_pa", "rho"]
    to = ["scales.thickness", "scales.shear_modulus"]
    found = eq.sensitivity(of, to, held=name, r=[0.1])

    def answer(value: float, scale: str) -> Any:
        changed = Scale(scene, scale).scene_at(value)
        scales = changed.scales
        assert scales is not None
        size = _SCALES.to_si("pressure", 1.0) / scales.to_si("pressure", 1.0) if name == "pressure" else 1.0
        other = solved(changed, {name: load * size}, eq)
        profile = other.profile([0.1])
        si = scales.to_si
        state = [other.pressure, si("pressure", other.pressure), other.volume, si("energy", other.elastic_energy)]
        return np.array([*state, si("length", other.center_height), profile["total_stress_1_pa"][0], profile["rho"][0]])

    for scale in to:
        value = getattr(_SCALES, scale.partition(".")[2])
        slopes = [(answer(value * (1 + t), scale) - answer(value * (1 - t), scale)) / (2 * t * value) for t in (2e-3, 1e-3)]
        expected = (4 * slopes[1] - slopes[0]) / 3
        mine = np.array([np.ravel(found[q][scale])[0] for q in of])
        allowed = 1e-6 * np.abs(expected) + 1e-8 * np.abs(answer(value, scale)) / value
        assert (np.abs(mine - expected) <= allowed).all(), (scale, mine, expected)


def test_a_scale_of_a_scene_without_units_is_unknown() -> None:
    with pytest.raises(fm.InputError, match="unknown") as error:
        solved(fm.Scene(fm.MooneyRivlin(0.1), DISC), {"volume": 1.0}).sensitivity("pressure", "scales.thickness")
    assert error.value.key == "to"


def test_wrinkles_that_come_and_go() -> None:
    """In a tube that is wrinkled in part slopes change where the border passes a quadrature point: a small step sees none."""
    scene = fm.Scene(fm.Gent(30.0), fm.Tube(length=2.0, elements=16), tension_field=True)
    eq = solved(scene, {"volume": 5.5})
    parameter, h = Parameter(scene, "membrane.prestretch"), 1e-5
    after, before = (solved(parameter.scene_at(1.0 + t), {"volume": 5.5}, eq).pressure for t in (h, -h))
    assert eq.sensitivity("pressure", "membrane.prestretch", held="volume") == pytest.approx((after - before) / (2 * h), rel=1e-7)
