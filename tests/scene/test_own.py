"""Materials, sources and functions of one's own: files, records, sweeps, the command."""

from __future__ import annotations

import importlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import tomli_w

import femmembrane as fm
from femmembrane.cli import main

MODULE = '''
from dataclasses import dataclass
from math import sqrt

import femmembrane as fm
from femmembrane.physics.invariant import InvariantMaterial


@dataclass(frozen=True)
class Knowles(InvariantMaterial):
    """Knowles (1977); neo-Hookean for n = 1."""

    b: float
    n: float

    def function(self, J):
        base = 1 + self.b * J / self.n
        curvature = self.b * (self.n - 1) / (2 * self.n)
        return (base**self.n - 1) / (2 * self.b), base ** (self.n - 1) / 2, curvature * base ** (self.n - 2)


@dataclass(frozen=True)
class Gradient(fm.Source):
    """Between two opposed coils."""

    strength: float
    height: float

    def field(self, rho, eta):
        amplitude = sqrt(self.strength)
        return -amplitude * rho / 2, amplitude * (eta - self.height), 0.0


def energy(l1, l2):
    return (l1**2 + l2**2 + 1 / (l1 * l2) ** 2 - 3) / 2


energy_material = fm.StrainEnergy(energy)
'''
RUN = {"control": "volume", "start": 0.5, "stop": 1.0, "steps": 2, "solver": "newton"}
TABLES = {"mesh": {"elements": 8}, "run": RUN}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder with a module that leaves nothing behind."""
    monkeypatch.setattr(sys, "path", [*sys.path])
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    (tmp_path / "ownparts.py").write_text(MODULE)
    importlib.invalidate_caches()
    yield tmp_path
    sys.modules.pop("ownparts", None)


def written(folder: Path, **tables: object) -> Path:
    path = folder / "scene.toml"
    path.write_text(tomli_w.dumps({**TABLES, **tables}))
    return path


@pytest.mark.parametrize("material", [{"model": "ownparts:Knowles", "b": 0.7, "n": 1.0}, {"model": "ownparts:energy_material"}])
def test_a_material_of_a_module_is_saved_reported_and_swept(folder: Path, material: dict[str, object]) -> None:
    """Both are neo-Hookean: the pressures are those of the material of the package."""
    scene = fm.Scene.from_toml(written(folder, material=material))
    branch = fm.run(scene)
    usual = fm.run(scene.replace(material=fm.NeoHookean()))
    np.testing.assert_allclose(branch.column("pressure"), usual.column("pressure"), rtol=1e-9)

    scene.to_toml(folder / "again.toml")
    assert fm.Scene.from_toml(folder / "again.toml") == scene
    branch.report(folder / "report.html")
    found = fm.sweep(scene, {"mesh.elements": [8, 10]}, quantity="run", workers=1, out=folder / "kept")
    assert found.failed == 0
    found.save(folder / "sweep.nc")
    assert fm.Sweep.load(folder / "sweep.nc", scene=scene).scene == scene


def test_numbers_of_a_class_are_swept(folder: Path) -> None:
    scene = fm.Scene.from_toml(written(folder, material={"model": "ownparts:Knowles", "b": 0.7, "n": 1.0}))
    found = fm.sweep(scene, {"material.n": [1.0, 2.0]}, quantity="equilibria", volume=1.0, workers=1)
    pressures = found.to_xarray()["state_pressure"].values[:, 0]
    alone = [fm.equilibrium(scene.replace(material=type(scene.material)(0.7, n)), volume=1.0).pressure for n in (1.0, 2.0)]
    np.testing.assert_allclose(pressures, alone, rtol=1e-8)


def test_a_data_file_imports_nothing(folder: Path, tmp_path: Path) -> None:
    source = {"kind": "ownparts:Gradient", "strength": 0.1, "height": 1.0}
    scene = fm.Scene.from_toml(written(folder, material={"model": "neo-hookean"}, source=[source], membrane={"susceptibility": 0.1}))
    branch = fm.run(scene)
    branch.save(folder / "branch.nc")
    del sys.modules["ownparts"]
    with pytest.raises(fm.InputError, match=r"ownparts:Gradient.*a data file imports nothing.*load\(path, scene=scene\)"):
        fm.load(folder / "branch.nc")
    assert "ownparts" not in sys.modules
    with pytest.raises(fm.InputError, match=r"another source than"):
        fm.load(folder / "branch.nc", scene=scene.replace(sources=[fm.Dipole(1.0, 3.0)]))
    with pytest.raises(fm.InputError, match="imports nothing"):
        fm.Scene.from_dict({"material": {"model": "os:system"}})


def test_what_has_no_form_in_files_is_recorded_and_comes_from_a_scene(tmp_path: Path) -> None:
    law = fm.StrainEnergy(lambda l1, l2: (l1**2 + l2**2 + 1 / (l1 * l2) ** 2 - 3) / 2)
    scene = fm.Scene.from_dict({**TABLES, "material": {"model": "neo-hookean"}})
    scene = scene.replace(material=law, thickness=lambda R, Z, s: 1 - 0.1 * R**2)
    branch = fm.run(scene)
    branch.save(tmp_path / "branch.nc")
    branch.report(tmp_path / "report.html")
    assert "no form in scene files" in (tmp_path / "report.html").read_text()
    again = fm.load(tmp_path / "branch.nc", scene=scene)
    assert again.scene == scene
    np.testing.assert_array_equal(again.column("pressure"), branch.column("pressure"))
    with pytest.raises(fm.InputError, match="no name in scene files"):
        scene.to_toml(tmp_path / "scene.toml")
    assert fm.sweep(scene, {"mesh.elements": [8, 10]}, quantity="run").failed == 0
    with pytest.raises(fm.InputError, match="cannot be sent to other processes"):
        fm.sweep(scene, {"mesh.elements": [8, 10]}, quantity="run", workers=2)


def test_the_command_runs_and_reports_it(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = written(folder, material={"model": "ownparts:Knowles", "b": 0.7, "n": 1.0}), folder / "out"
    assert main(["run", str(path), "--out", str(out), "--report"]) == 0
    assert json.loads((out / "run.json").read_text())["scene"]["material"] == {"model": "ownparts:Knowles", "b": 0.7, "n": 1.0}
    assert main(["report", str(out)]) == 2
    assert "--scene FILE" in capsys.readouterr().err
    assert main(["report", str(out), "--scene", str(path)]) == 0
    assert main(["export", str(out), "--to", "csv", "--scene", str(path)]) == 0
    assert main(["run", str(path), "--out", str(out), "--resume"]) == 0


@pytest.mark.parametrize(
    ("model", "words"),
    [
        ("ownparts:Nothing", "no Nothing; classes there: Gradient, Knowles"),
        ("ownparts:energy", r"it is a function.*StrainEnergy\(energy\)"),
        ("nowhere_at_all:Thing", "No module named"),
        ("ownparts:Knowles", "arguments of Knowles are needed"),
        (":Knowles", "no form in scene files"),
    ],
)
def test_refusals(folder: Path, model: str, words: str) -> None:
    with pytest.raises(fm.InputError, match=words):
        fm.Scene.from_toml(written(folder, material={"model": model}))


def test_another_module_of_the_same_name_is_refused(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Python keeps modules by their names: the second would be the first without a word."""
    material = {"model": "ownparts:energy_material"}
    fm.Scene.from_toml(written(folder, material=material))
    other = tmp_path_factory.mktemp("other")
    (other / "ownparts.py").write_text(MODULE)
    with pytest.raises(fm.InputError, match="rename one"):
        fm.Scene.from_toml(written(other, material=material))


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({}, r"scales.shear_modulus = None: missing; a material of one's own .* shear_modulus in Pa, in place of mu in \[material\]"),
        ({"units": "si"}, r"shear_modulus is missing; a material of one's own .* give that here as shear_modulus in Pa"),
        ({"modulus": 4e5}, r"material.mu = '0.4 MPa': unknown; arguments of Knowles: b, n; the shear modulus in Pa is shear_modulus in"),
    ],
)
def test_the_shear_modulus_of_a_material_of_ones_own_stands_in_the_scales(folder: Path, more: dict[str, object], words: str) -> None:
    scales = {"radius": 0.02, "thickness": 3e-4} | ({"shear_modulus": more["modulus"]} if "modulus" in more else {})
    material = {"model": "ownparts:Knowles", "b": 0.7, "n": 1.0, "mu": "0.4 MPa"}
    run = {"control": "pressure", "values": ["1 kPa"]} if "units" in more else TABLES["run"]
    tables = {**TABLES, "material": material, "scales": scales, "run": run} | ({"units": "si"} if "units" in more else {})
    with pytest.raises(fm.InputError, match=words):
        fm.Scene.from_dict(tables, folder=folder, own=True)
