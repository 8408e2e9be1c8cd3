"""The registry of analyses: one that has every part is met wherever analyses are asked, and one that is not asked for nowhere."""

from __future__ import annotations

import json
from typing import ClassVar

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.quantities import Quantity
from femmembrane.results import output, table
from femmembrane.results.analyses import ANALYSES, EXTRA, asked
from femmembrane.results.analyses.base import Drawing, EquilibriumAnalysis, PrintedColumn, Section, Table
from femmembrane.scene import Perturbations
from tests.cases import disc_scene


class Side(EquilibriumAnalysis):
    """On which side of a volume of 1 an equilibrium lies; counts how often it had to look."""

    tables: ClassVar = {"side.csv": lambda branch, path: path.write_text(json.dumps(branch.column("side").tolist()))}
    pictures: ClassVar = {"side.png": lambda branch, path: path.write_bytes(b"drawn")}

    def __init__(self):
        self.looked = 0

    def _find(self, equilibrium):
        self.looked += 1
        return "beyond" if equilibrium.volume > 1 else "before"

    def columns(self, scene):
        return ("side",)

    def quantity(self, name):
        return Quantity("side of V = 1", type=str) if name == "side" else None

    def value(self, equilibrium, column):
        return equilibrium.remembered(("side",), lambda: self._find(equilibrium))

    def point_columns(self, scene):
        return ("side",)

    def point_value(self, point, column):
        return self.value(point.equilibrium, column)

    def restore(self, dataset, branch):
        for equilibrium, side in zip(branch, dataset["side"].values, strict=True):
            equilibrium.remember(("side",), str(side))

    def at_nodes(self, equilibrium):
        return {"beyond": np.full(equilibrium.potential.space.node_parameters().size, float(equilibrium.volume > 1))}

    def printed(self, scene):
        return [PrintedColumn("side", lambda equilibrium: self.value(equilibrium, "side"))]

    def section(self, branch):
        def draw(axes, drawn):
            return axes.plot(drawn.column("volume"), label="volume")

        return Section("Side", Drawing("Volumes", draw), Table(["step", "side"], [[0, branch.column("side")[0]]]))


@pytest.fixture
def side(monkeypatch):
    analysis = Side()
    monkeypatch.setitem(EXTRA, "side", analysis)
    return analysis


@pytest.fixture
def branch(side):
    scene = disc_scene(elements=8).replace(analysis=fm.Analysis(("volume",), extra=("side",)))
    return fm.trace(scene, start=0.5, until={"volume": 4.0})


def test_every_part_is_met(side, branch, tmp_path):
    from femmembrane.views.report import report
    from femmembrane.views.vtk import Revolution, smooth_profile, surface_data

    names = [path.name for path in output.write_run(branch, tmp_path)]
    assert {"side.csv", "side.png"} <= set(names)
    assert json.loads((tmp_path / "side.csv").read_text()) == ["beyond" if eq.volume > 1 else "before" for eq in branch]
    assert table.columns(branch)[-4:] == ["side", "residual", "iterations", "seconds"]
    assert side.looked == len(branch) + len(branch.special_points)  # once each
    assert (tmp_path / "special_points.csv").read_text().splitlines()[0] == "kind,volume,pressure,center_height,error,side"
    lines = str(branch).splitlines()
    assert [line.split()[-1] for line in lines[:2]] == ["side", "before"]
    assert '<section id="side">' in report(branch)
    last = branch[-1]
    profile = smooth_profile(last)
    data = surface_data(last, profile, Revolution.of_membrane(last, profile["r"]))
    assert set(data["beyond"]) == {1.0}
    output.write_run(branch[:0].__class__(branch.scene, ()), tmp_path)
    assert (tmp_path / "side.csv").exists()
    assert not (tmp_path / "side.png").exists()  # that of the run before


def test_answers_come_back(side, branch, tmp_path):
    branch.save(tmp_path / "branch.nc")
    looked = side.looked
    loaded = fm.load(tmp_path / "branch.nc")
    assert loaded.column("side").tolist() == branch.column("side").tolist()
    assert side.looked == looked
    assert loaded.to_xarray()["side"].attrs["long_name"] == "side of V = 1"


def test_a_file_with_an_analysis_that_nobody_knows(branch, tmp_path, monkeypatch):
    branch.save(tmp_path / "branch.nc")
    monkeypatch.delitem(EXTRA, "side")
    with pytest.raises(fm.InputError, match=r"analysis.extra\[0\] = 'side'"):
        fm.load(tmp_path / "branch.nc")


def test_who_is_asked():
    """Each key of its own turns on its analysis, and nothing else does."""
    plain = disc_scene(elements=8)
    keys = {"stability": ("volume",), "azimuthal_modes": (2,), "wrinkling": "total", "error_estimates": True}
    found = {key: [type(a).__name__ for a in asked(plain.replace(analysis=fm.Analysis(**{key: value})))] for key, value in keys.items()}
    assert found == {
        "stability": ["Verdicts"],
        "azimuthal_modes": ["Verdicts"],
        "wrinkling": ["WrinkledZones"],
        "error_estimates": ["ErrorEstimates"],
    }
    assert asked(plain) == []
    assert len(asked(plain.replace(analysis=fm.Analysis(**keys)))) == len(ANALYSES) - 3  # those of scales, electrodes and bodies are not
    assert [type(a).__name__ for a in asked(plain.replace(electric=fm.Electric(voltage=0.1)))] == ["Electrics"]


def test_verdicts_asked_for():
    """One list, the axisymmetric ones first, each with its words."""
    asked_for = fm.Analysis(azimuthal_modes=(2, 1), stability=("volume",)).verdicts
    assert asked_for == (Perturbations("volume"), Perturbations(None, 2), Perturbations(None, 1))
    assert [p.tag for p in asked_for] == ["volume", "n2", "n1"]
    assert [p.against for p in asked_for[:2]] == ["under volume control", "against n = 2"]
    assert [p.words for p in asked_for[:2]] == ["axisymmetric, volume held", "n = 2 waves around the axis"]
    assert fm.Analysis().verdicts == ()
