"""Real materials by name: the numbers of their sources, recomputed; their names in scene files; that they are shipped."""

from __future__ import annotations

import pickle
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.physics import named
from femmembrane.scene.toml import MATERIALS

ROOT = Path(__file__).parents[2]
NAMES = sorted(tomllib.loads((ROOT / "femmembrane/physics/data/materials.toml").read_text(encoding="utf-8")))
each = pytest.mark.parametrize("name", NAMES)


def nominal(name, stretch, across):
    """Nominal stress in Pa in tension (across = -1/2) or at equal stretches (across = 1)."""
    data, e = fm.material_data(name), np.log(stretch)
    return data.shear_modulus * float(data.material.stress(e, across * e)[0]) / stretch


def from_the_source(name, stretch, across):
    """The same from the numbers of the source, by the definition of its model and without a shear modulus."""
    n, e = fm.material_data(name).numbers, np.log(stretch)
    third = -(1 + across) * e
    squares = np.exp(2 * np.array([e, across * e, third]))
    first = squares.sum()
    spread = squares[0] - squares[2]
    if name == "treloar-ogden":
        return 98066.5 * sum(m * (np.exp(a * e) - np.exp(a * third)) for m, a in zip(n["mu"], n["alpha"], strict=True)) / stretch
    if name == "latex-balloon":  # s_+ B + s_- B^-1 but for a pressure
        return 1e5 * (n["s_plus"] * spread + n["s_minus"] * (1 / squares[0] - 1 / squares[2])) / stretch
    slope = {
        "ecoflex-00-30": lambda: sum(k * n[f"c{k}"] * (first - 3) ** (k - 1) for k in (1, 2, 3)),
        "vhb-4910": lambda: sum(m / 2 * (first / 3) ** (a - 1) for m, a in zip(n["mu"], n["alpha"], strict=True)),
    }[name]()
    return 1e3 * 2 * slope * spread / stretch


@each
@pytest.mark.parametrize("stretch", [1.001, 1.5, 3.0])
@pytest.mark.parametrize("across", [-0.5, 1.0])
def test_stresses_are_those_of_the_source(name, stretch, across):
    assert nominal(name, stretch, across) == pytest.approx(from_the_source(name, stretch, across), rel=1e-10)


def test_shear_moduli():
    """By hand: half of 6.3 1.3 + 0.012 5 + 0.1 2 = 8.45 kgf/cm^2; 3 + 0.3 bar; 13.54 + 1.08 kPa; 2 17 kPa."""
    expected = {"treloar-ogden": 4.225 * 98066.5, "latex-balloon": 3.3e5, "vhb-4910": 14620, "ecoflex-00-30": 34e3}
    assert {name: fm.material_data(name).shear_modulus for name in NAMES} == pytest.approx(expected, rel=1e-14)


def test_treloars_rubber_is_the_one_of_the_class():
    one, other = fm.material("treloar-ogden"), fm.Ogden.treloar()
    assert one.mu == pytest.approx(other.mu, rel=1e-14)
    assert one.alpha == other.alpha


@each
def test_records_are_complete(name):
    data = fm.material_data(name)
    assert data.name == name
    assert isinstance(data.material, MATERIALS[data.model])
    assert data.material == fm.material(name)
    assert re.search(r"\(((19|20)\d\d)\)", data.citation)
    assert data.title
    assert data.valid
    assert data.checked
    assert data.unit


@each
def test_a_scene_keeps_the_name(name, tmp_path):
    scene = fm.Scene.from_dict({"material": {"name": name}, "mesh": {"elements": 4}})
    assert scene.material == fm.material(name)
    scene.to_toml(tmp_path / "scene.toml")
    assert f'name = "{name}"' in (tmp_path / "scene.toml").read_text(encoding="utf-8")
    again = fm.Scene.from_toml(tmp_path / "scene.toml")
    assert again == scene
    assert again.to_dict() == scene.to_dict() == pickle.loads(pickle.dumps(scene)).to_dict()


def test_a_changed_material_has_no_name():
    from femmembrane.scene.variation import Parameter

    scene = fm.Scene(material=fm.material("latex-balloon"), mesh=fm.disc(4))
    assert Parameter(scene, "material.ratio").scene_at(0.2).to_dict()["material"] == {"model": "mooney-rivlin", "ratio": 0.2}


def test_its_source_is_cited():
    scene = fm.Scene(material=fm.material("vhb-4910"), mesh=fm.disc(4))
    assert "10.1016/j.crme.2015.11.004" in fm.cite(fm.inflate(scene, volumes=[0.5]))
    assert "10.1016/j.crme.2015.11.004" not in fm.cite(fm.inflate(scene.replace(material=fm.NeoHookean()), volumes=[0.5]))


def test_refusals():
    with pytest.raises(fm.InputError, match=r"material.name = 'treloar': unknown; .*treloar-ogden"):
        fm.material("treloar")
    with pytest.raises(fm.InputError, match=r"material.name = 3"):
        fm.Scene.from_dict({"material": {"name": 3}})
    with pytest.raises(fm.InputError, match=r"material.model = 'gent': not allowed beside material.name"):
        fm.Scene.from_dict({"material": {"name": "vhb-4910", "model": "gent"}})


@each
def test_described_on_the_page_and_in_the_docstrings(name):
    page = (ROOT / "femmembrane/scene/README.md").read_text(encoding="utf-8")
    row = next(line for line in page.splitlines() if line.startswith(f"| `{name}` |"))
    assert f"{fm.material_data(name).shear_modulus / 1e3:.3g} kPa" in row
    assert all(f'"{name}"' in function.__doc__ for function in (named.material, named.material_data))


def test_the_data_are_shipped():
    """The wheel takes what stands under package-data; the source distribution takes what is under version control."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    patterns = project["tool"]["setuptools"]["package-data"]["femmembrane"]
    shipped = {path for pattern in patterns for path in (ROOT / "femmembrane").glob(pattern)}
    assert ROOT / "femmembrane/physics/data/materials.toml" in shipped


def test_a_balloon_of_latex_has_its_limit_point():
    """P = 2 s_+ (T/R) (1/l - 1/l^7) (1 + 0.1 l^2): the maximum at the root of its slope, in Pa by the scales of the record."""
    data = fm.material_data("latex-balloon")
    balloon = fm.Scene(material=data.material, mesh=fm.sphere(8), degree=3)
    stretch = np.linspace(1.2, 1.6, 400001)
    law = 2 * 3e5 * (1 / stretch - stretch**-7.0) * (1 + 0.1 * stretch**2)
    branch = fm.trace(balloon, start=5.0, until={"volume": 16.0})
    top = next(p for p in branch.special_points if p.kind == "limit_point")
    assert top.pressure * data.shear_modulus == pytest.approx(law.max(), rel=1e-7)
