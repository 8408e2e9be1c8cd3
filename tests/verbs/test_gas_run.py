"""Gas in scene files and runs: amounts as loads, chamber and atmosphere as numbers, verdicts, columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.errors import InputError
from femmembrane.verbs.convergence import convergence_of_run
from tests.cases import OGDEN, disc_scene

CHAMBER = fm.Chamber(volume=1.0, atmosphere=0.5)


def scene(**more: object) -> fm.Scene:
    return fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(16), chamber=CHAMBER, **more)  # type: ignore[arg-type]


def test_amounts_of_gas_are_loads(tmp_path: Path) -> None:
    """(P + atmosphere)(V + chamber) = N at each load, and the verdict is that of the membrane stiffened by the gas."""
    asked = scene(run=fm.Run(control="gas", start=1.0, stop=8.0, steps=4), analysis=fm.Analysis(stability=("pressure", "gas")))
    branch = fm.run(asked)
    np.testing.assert_allclose(branch.column("gas"), asked.run.loads() if asked.run else (), rtol=1e-12)
    np.testing.assert_allclose((branch.column("pressure") + 0.5) * (branch.column("volume") + 1.0), branch.column("gas"), rtol=1e-12)
    for eq in branch:
        gas = fm.Gas(CHAMBER.amount(eq.pressure, eq.volume), 1.0, 0.5)
        assert eq.verdict("gas").smallest_eigenvalue == pytest.approx(eq.verdict("gas", gas=gas).smallest_eigenvalue, rel=1e-9)
    assert (branch.column("lambda_gas") > branch.column("lambda_pressure")).all()
    branch.save(tmp_path / "branch.nc")
    again = fm.load(tmp_path / "branch.nc")
    for name in ("gas", "lambda_gas", "verdict_gas"):
        assert (again.column(name) == branch.column(name)).all()
    assert again.scene == asked
    assert "under gas" in str(branch)
    axes = branch.plot()
    assert "stable under pressure and gas control" in [text.get_text() for text in axes.get_legend().get_texts()]


@pytest.mark.parametrize("number", ["chamber.volume", "chamber.atmosphere"])
def test_the_chamber_is_a_number(number: str) -> None:
    values = [0.4, 1.0, 1.5]
    branch = fm.vary(scene(), number, values, hold={"gas": 4.0})
    traced = fm.trace(scene(), over=number, hold={"gas": 4.0}, until={number: 1.5})
    for eq in [*branch, *traced]:
        chamber = eq.scene.chamber
        assert chamber is not None
        assert chamber.amount(eq.pressure, eq.volume) == pytest.approx(4.0, rel=1e-10)
        assert branch.over == number
    for eq, value in zip(branch, values, strict=True):
        assert eq.number(number) == value
        gas = fm.Gas(4.0, eq.number("chamber.volume"), eq.number("chamber.atmosphere"))
        assert fm.equilibrium(scene(), gas=gas).volume == pytest.approx(eq.volume, rel=1e-9)
    assert traced[-1].volume == pytest.approx(branch[-1].volume, rel=1e-9)


def test_gas_holds_while_a_magnet_comes() -> None:
    magnetic = scene(sources=[fm.Dipole(strength=20.0, height=4.0)], susceptibility=1.0)
    branch = fm.vary(magnetic, "source.0.height", [4.0, 3.0, 2.5], hold={"gas": 1.0})
    np.testing.assert_allclose(branch.column("gas"), 1.0, rtol=1e-11)
    assert (np.diff(branch.column("volume")) > 0).all()


def test_a_scene_file_has_a_chamber(tmp_path: Path) -> None:
    asked = scene(run=fm.Run(control="chamber.volume", hold={"gas": 4.0}, values=(1.0, 2.0)))
    asked.to_toml(tmp_path / "scene.toml")
    assert "[chamber]" in (tmp_path / "scene.toml").read_text(encoding="utf-8")
    assert fm.Scene.from_toml(tmp_path / "scene.toml") == asked
    assert fm.run(asked).column("chamber.volume").tolist() == [1.0, 2.0]


def test_what_is_refused() -> None:
    bare = scene().replace(chamber=None)
    with pytest.raises(InputError, match=r"chamber.*missing"):
        bare.replace(run=fm.Run(control="gas", values=(1.0,)))
    with pytest.raises(InputError, match=r"chamber.*missing"):
        bare.replace(analysis=fm.Analysis(stability=("gas",)))
    with pytest.raises(InputError, match="no chamber of gas"):
        fm.vary(disc_scene(OGDEN, (20.0, 4.0), elements=8), "source.0.height", [4.0], hold={"gas": 1.0})
    with pytest.raises(InputError, match=r"hold\.gas"):
        fm.vary(scene(), "chamber.volume", [1.0], hold={"gas": -1.0})
    with pytest.raises(InputError, match=r"chamber\.volume"):
        fm.Chamber(volume=0.0)
    with pytest.raises(InputError, match=r"chamber\.volume"):
        fm.vary(scene(), "chamber.volume", [1.0, -1.0], hold={"gas": 1.0})


@pytest.mark.parametrize(
    ("over", "hold"),
    [
        ({}, None),
        ({"over": "chamber.volume"}, {"pressure": 1.0}),
        ({"over": "chamber.atmosphere"}, {"volume": 1.0}),
        ({"over": "membrane.prestretch"}, {"pressure": 1.0}),
    ],
)
def test_a_trace_ends_at_an_amount(over: dict[str, str], hold: dict[str, float] | None) -> None:
    """The last state lies on the amount exactly, in the chamber that its own scene has."""
    branch = fm.trace(scene(), until={"gas": 8.0 if not over else 5.0}, hold=hold, **over)  # type: ignore[arg-type]
    assert branch.status is fm.Status.CONVERGED
    assert branch[-1].gas_amount == pytest.approx(8.0 if not over else 5.0, rel=1e-12)
    if not over:
        assert fm.equilibrium(scene(), gas=fm.Gas(8.0, 1.0, 0.5)).volume == pytest.approx(branch[-1].volume, rel=1e-10)
    assert fm.run(scene(run=fm.Run(control="arc-length", start=0.5, until={"gas": 3.0})))[-1].gas_amount == pytest.approx(3.0, rel=1e-12)


def test_until_gas_needs_a_chamber_and_is_not_held() -> None:
    with pytest.raises(InputError, match="no chamber of gas"):
        fm.trace(scene().replace(chamber=None), until={"gas": 1.0})
    with pytest.raises(InputError, match=r"chamber.*missing"):
        scene(run=fm.Run(control="arc-length", start=0.5, until={"gas": 3.0})).replace(chamber=None)
    with pytest.raises(InputError, match="it is held"):
        fm.trace(scene(), over="chamber.volume", hold={"gas": 3.0}, until={"gas": 4.0})


@pytest.mark.parametrize("run", [fm.Run(control="gas", values=(3.0,)), fm.Run(control="arc-length", start=0.5, until={"gas": 3.0})])
def test_the_error_of_a_run_of_gas_is_studied_at_its_last_amount(run: fm.Run) -> None:
    study = convergence_of_run(scene(run=run), degrees=(1, 2), elements=(4, 8))
    assert (study.control, study.load) == ("gas", 3.0)
    assert study.errors["volume"][1, 1] < 1e-4 < study.errors["volume"][0, 0]


def test_a_number_is_an_amount_in_the_chamber_of_the_scene() -> None:
    assert fm.equilibrium(scene(), gas=8.0).volume == fm.equilibrium(scene(), gas=fm.Gas(8.0, 1.0, 0.5)).volume
    with pytest.raises(fm.InputError, match=r"^gas"):
        fm.equilibrium(scene(), gas=-1.0)
    with pytest.raises(fm.InputError, match="the scene has no chamber of gas"):
        fm.equilibrium(fm.Scene(material=fm.NeoHookean(), mesh=fm.disc(8)), gas=8.0)
