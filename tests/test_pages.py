"""The pages of documentation: what they name exists, what they list is complete, and their examples run."""

from __future__ import annotations

import dataclasses
import inspect
import re
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.errors import Status

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "femmembrane"
PAGES = sorted(
    path for path in (ROOT / "README.md", *(p for top in ("femmembrane", "demos", "meshes", "tests") for p in (ROOT / top).rglob("*.md")))
)
#: names of kinds in scene files, and of their registries
REGISTRIES = {"model": "MATERIALS", "source": "SOURCES", "load": "LOADS", "obstacle": "OBSTACLES", "shape": "SHAPES"}


def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def anchors(text: str) -> set[str]:
    """The anchors that a site makes of the headings of a page."""
    return {re.sub(r"[^\w\- ]", "", line.lstrip("# ").lower()).replace(" ", "-") for line in text.splitlines() if line.startswith("#")}


def test_the_first_page_is_short():
    lines = text_of(ROOT / "README.md").splitlines()
    assert len(lines) <= 200
    assert sum(bool(re.match(r"python3 -m venv .*pytest", line)) for line in lines) == 1


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(page):
    text = text_of(page)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if "://" in target:
            continue
        path, _, anchor = target.partition("#")
        found = page.parent / path if path else page
        assert found.exists(), target
        assert not anchor or anchor in anchors(text_of(found)), target


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_files_that_are_named_exist(page):
    """In backticks, as seen from the top, from the package or from the folder of the page."""
    for name in re.findall(r"`((?:[\w.-]+/)+[\w.-]+\.(?:py|toml|md|h|vtu|msh|vtk))`", text_of(page)):
        assert any((folder / name).exists() for folder in (ROOT, PACKAGE, page.parent)), name


def registry(name: str) -> dict[str, type]:
    """A registry of scene files, found in any module of their room."""
    import_module("femmembrane.scene")
    rooms = [module for path, module in sys.modules.items() if (path + ".").startswith("femmembrane.scene.")]
    return next(table for table in (getattr(module, name, None) for module in rooms) if isinstance(table, dict))


@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind, table in REGISTRIES.items() for name in registry(table)])
def test_scene_files_are_described(kind, name):
    """Every registered name has a row, which names the arguments that are its own."""
    text = text_of(PACKAGE / "scene" / "README.md")
    rows = [line for line in text.splitlines() if line.startswith(f"| `{name}` |")]  # a shape and an obstacle may share a name
    shared = {
        "strength",
        "orientation",
        "elements",
        "ratio",
        "ends",
        "accuracy",
        "estimated",
    }  # said above the tables, or written by the package alone
    own = [f.name for f in dataclasses.fields(registry(REGISTRIES[kind])[name]) if f.name not in shared]
    assert any(all(f"`{argument}" in row for argument in own) for row in rows)


@pytest.mark.parametrize("record", [fm.Run, fm.Analysis, fm.Scales])
def test_tables_of_a_scene_are_described(record):
    text = text_of(PACKAGE / "scene" / "README.md")
    assert [f.name for f in dataclasses.fields(record) if f"`{f.name}" not in text] == []


@pytest.mark.parametrize("status", [s for s in Status if s not in (Status.CONVERGED, Status.INTERRUPTED)])
def test_every_status_is_explained(status):
    assert f"| `{status.value}` |" in text_of(ROOT / "README.md")


def test_verbs_of_the_first_page_exist():
    for name, arguments in re.findall(r"`fm\.(\w+)\(([^)`]*)", text_of(ROOT / "README.md").split("## Verbs")[1]):
        asked = [word.split("=")[0].strip() for word in arguments.split(",") if "=" in word]
        assert set(asked) <= inspect.signature(getattr(fm, name)).parameters.keys(), name


def test_ten_lines_of_python(capsys):
    """They run as they stand (with 6 steps in place of 60), and print what their comments say."""
    code = re.findall(r"```python\n(.*?)```", text_of(ROOT / "README.md"), re.DOTALL)[0]
    names: dict[str, object] = {}
    exec(code.replace("75, 60)", "75, 6)"), names)
    printed = capsys.readouterr().out
    assert len(names["run"]) == 6
    assert [name in printed for name in ("'limit_point'", "'volume_fold'", "4 equilibria at pressure 1.8")] == [True, True, True]
    assert printed.rstrip().splitlines()[-1] == names["branch"][-1].verdict("volume").reason


def example(heading: str) -> dict[str, type]:
    """What the code below a heading of the page on how to add something defines."""
    section = text_of(PACKAGE / "README.md").split(f"### {heading}\n")[1].split("\n### ")[0]
    names: dict[str, type] = {"__name__": __name__}
    exec(re.findall(r"```python\n(.*?)```", section, re.DOTALL)[0], names)
    return names


DISC = fm.disc(16)


def test_the_material_that_is_added():
    """Neo-Hookean for n = 1; stiffer above, with derivatives that fit its energy."""
    knowles = example("A material")["Knowles"]
    plain = fm.equilibrium(fm.Scene(material=fm.NeoHookean(), mesh=DISC), volume=1.0)
    assert fm.equilibrium(fm.Scene(material=knowles(b=0.5, n=1.0), mesh=DISC), volume=1.0).pressure == pytest.approx(
        plain.pressure, rel=1e-11
    )
    hard = knowles(b=0.5, n=2.0)
    e1, e2, d = 0.3, 0.2, 1e-5
    assert (hard.energy(e1 + d, e2) - hard.energy(e1 - d, e2)) / (2 * d) == pytest.approx(hard.stress(e1, e2)[0], rel=1e-8)
    assert (hard.stress(e1 + d, e2)[0] - hard.stress(e1 - d, e2)[0]) / (2 * d) == pytest.approx(hard.tangent(e1, e2)[0], rel=1e-8)


def test_the_source_that_is_added():
    """Above its middle the magnetisable membrane is drawn up, below down, to mirror images."""
    gradient = example("A source")["Gradient"]
    up, down = (
        fm.equilibrium(fm.Scene(material=fm.NeoHookean(), mesh=DISC, sources=[gradient(1.0, h)], susceptibility=1.0), pressure=0.0)
        for h in (-1.0, 1.0)
    )
    assert up.center_height > 0.01
    assert down.center_height == pytest.approx(-up.center_height, rel=1e-9)


def test_the_load_that_is_added():
    """On stiff springs the pressure lifts every point but those near the rim by P/k, at small deflections."""
    foundation = example("A load")["Foundation"]
    eq = fm.equilibrium(fm.Scene(material=fm.NeoHookean(), mesh=DISC, loads=[foundation(100.0)]), pressure=0.01)
    r = np.linspace(0.0, 0.7, 5)
    assert eq.profile(r)["eta"] == pytest.approx(np.full(5, 1e-4), rel=1e-3)


def test_the_analysis_that_is_added(monkeypatch, tmp_path):
    """Registered, it is a column, a variable with a meaning, a remark and a section; it comes back from the file, and nobody else pays."""
    from femmembrane.cli import progress
    from femmembrane.results.analyses import EXTRA
    from femmembrane.views import html, report, viewer

    analysis = example("An analysis")["PoleStretch"]()
    scene = fm.Scene(material=fm.NeoHookean(), mesh=DISC, analysis=fm.Analysis(extra=["pole_stretch"]))
    with pytest.raises(fm.InputError, match=r"analysis.extra\[0\] = 'pole_stretch': no analysis"):
        fm.inflate(scene, volumes=[1.0])
    monkeypatch.setitem(EXTRA, "pole_stretch", analysis)
    branch = fm.inflate(fm.Scene.from_dict(scene.to_dict()), volumes=[1.0, 2.0])
    expected = [eq.profile()["stretch_1"][0] for eq in branch]
    assert expected[1] > expected[0] > 1.1
    assert branch.column("pole_stretch").tolist() == branch.to_dataframe()["pole_stretch"].tolist() == pytest.approx(expected, rel=1e-9)
    assert branch.to_xarray()["pole_stretch"].attrs == {"long_name": "meridional stretch at the pole", "units": "1"}
    branch.save(tmp_path / "branch.nc")
    loaded = fm.load(tmp_path / "branch.nc")
    assert loaded.scene == branch.scene
    assert loaded.column("pole_stretch").tolist() == branch.column("pole_stretch").tolist()
    words = f"{expected[1]:.4g}"
    assert ("stretch at the pole", words) in html.equilibrium_pairs(branch[1])
    assert progress._line(branch[1]).endswith(f"pole: {words}")
    assert viewer._caption(branch[1], 1, 2).endswith(f"stretch {words} at the pole")
    assert '<section id="pole">' in report.report(branch)
    plain = fm.inflate(scene.replace(analysis=fm.Analysis()), volumes=[1.0])
    assert "pole_stretch" not in plain.to_dataframe()
    with pytest.raises(fm.InputError, match=r"analysis.extra\[0\] = 'pole_strech': unknown; did you mean 'pole_stretch'"):
        fm.inflate(scene.replace(analysis=fm.Analysis(extra=["pole_strech"])), volumes=[1.0])
