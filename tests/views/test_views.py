"""Files for ParaView and pictures: they open elsewhere, hold the numbers of the profile, and show something."""

from __future__ import annotations

import dataclasses
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from femmembrane.discretization.meridian import disc
from femmembrane.errors import InputError, Status
from femmembrane.physics.magnetics import Dipole
from femmembrane.physics.materials import NeoHookean
from femmembrane.results.branch import Branch
from femmembrane.results.equilibrium import Equilibrium
from femmembrane.results.special_point import Jump, SpecialPoint
from femmembrane.results.verdict import Verdict
from femmembrane.scene import Analysis, Scene
from femmembrane.verbs import inflate, trace
from femmembrane.views import figures, picture, plots, vtk, zones

pyvista = pytest.importorskip("pyvista")

ELEMENTS, VOLUMES = 12, [0.5, 1.5, 4.0, 8.0]
SCENE = Scene(
    NeoHookean(),
    mesh=disc(ELEMENTS),
    sources=[Dipole(strength=50, height=5.0)],
    susceptibility=2.5,
    title="A title, 5 $ a piece",
    analysis=Analysis(("pressure", "volume")),
)


@pytest.fixture(scope="module")
def branch() -> Branch:
    return inflate(SCENE, volumes=VOLUMES)


@pytest.fixture(scope="module")
def folder(branch: Branch, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("vtk") / "some name.pvd"
    assert vtk.write_vtk(branch, path)[-1] == path
    return path.parent


@pytest.fixture(scope="module")
def grids(folder: Path) -> list[pyvista.UnstructuredGrid]:
    return [pyvista.read(path) for path in sorted((folder / "some name").glob("*.vtu"))]


def surface_volume(grid: pyvista.UnstructuredGrid) -> float:
    """Int z n_z dA over the surface: the volume above the plane of the rim (divergence theorem; the rim's disc adds nothing)."""
    cells = grid.cells_dict
    quads = cells[pyvista.CellType.QUAD]
    triangles = np.concatenate([cells[pyvista.CellType.TRIANGLE], quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    a, b, c = (np.asarray(grid.points, dtype=float)[triangles[:, k]] for k in range(3))
    return float((np.cross(b - a, c - a)[:, 2] / 2 * (a + b + c)[:, 2] / 3).sum())


# --- VTU and PVD


def test_collection(branch: Branch, folder: Path, grids: list[pyvista.UnstructuredGrid]) -> None:
    reader = pyvista.get_reader(folder / "some name.pvd")
    assert reader.time_values == list(range(len(branch)))
    assert len(grids) == len(branch)
    files = [entry.get("file", "") for entry in ET.parse(folder / "some name.pvd").iter("DataSet")]
    assert all((folder / file).is_file() and not Path(file).is_absolute() for file in files)


def test_cells(grids: list[pyvista.UnstructuredGrid]) -> None:
    nodes = 2 * ELEMENTS + 1
    for grid in grids:
        assert grid.n_points == 1 + (nodes - 1) * vtk.SECTORS  # one point at the pole
        counts = {kind: len(cells) for kind, cells in grid.cells_dict.items()}
        assert counts == {
            pyvista.CellType.TRIANGLE: vtk.SECTORS,
            pyvista.CellType.QUAD: (nodes - 2) * vtk.SECTORS,
            pyvista.CellType.LINE: nodes - 1,
        }


def test_fields_are_those_of_the_profile(branch: Branch, grids: list[pyvista.UnstructuredGrid]) -> None:
    for equilibrium, grid in zip(branch, grids, strict=True):
        profile = equilibrium.profile()
        line = grid.cells_dict[pyvista.CellType.LINE]
        meridian = np.append(line[:, 0], line[-1, 1])
        expected = np.stack([profile["rho"], 0 * profile["rho"], profile["eta"]], axis=1)
        np.testing.assert_allclose(grid.points[meridian], expected, atol=1e-14)
        for name in vtk.PROFILE:  # the scene has neither scales nor electrodes
            values = grid.point_data[name]
            assert np.isfinite(values).all()
            np.testing.assert_array_equal(values[meridian], profile[name])
        assert set(grid.cell_data["pressure"]) == {equilibrium.pressure}
        assert set(grid.cell_data["volume"]) == {equilibrium.volume}


def test_displacement_leads_back_to_the_disc(grids: list[pyvista.UnstructuredGrid]) -> None:
    for grid in grids:
        reference = grid.points - grid.point_data["displacement"]
        np.testing.assert_allclose(reference[:, 2], 0, atol=1e-14)
        radii = np.unique(np.hypot(reference[:, 0], reference[:, 1]).round(12))
        np.testing.assert_allclose(radii, np.linspace(0, 1, 2 * ELEMENTS + 1), atol=1e-11)


def test_rim_is_clamped(grids: list[pyvista.UnstructuredGrid]) -> None:
    for grid in grids:
        rim = grid.points[-vtk.SECTORS :]
        np.testing.assert_allclose(np.hypot(rim[:, 0], rim[:, 1]), 1, atol=1e-14)
        np.testing.assert_allclose(rim[:, 2], 0, atol=1e-14)
        assert np.abs(grid.point_data["displacement"][-vtk.SECTORS :]).max() <= 1e-14


def test_enclosed_volume(branch: Branch, grids: list[pyvista.UnstructuredGrid]) -> None:
    """A polygon of n sides in place of each circle loses sin(x)/x, x = 2 pi/n, of the volume; the broken meridian a little more."""
    x = 2 * np.pi / vtk.SECTORS
    for equilibrium, grid in zip(branch, grids, strict=True):
        assert surface_volume(grid) == pytest.approx(np.sin(x) / x * equilibrium.volume, rel=5e-3)


def test_fewer_steps_leave_no_old_surfaces(branch: Branch, tmp_path: Path) -> None:
    vtk.write_vtk(branch, tmp_path / "m.pvd")
    (tmp_path / "m" / "m_mine.vtu").write_text("not ours")
    vtk.write_vtk(branch[:2], tmp_path / "m.pvd")
    assert sorted(p.name for p in (tmp_path / "m").iterdir()) == ["m_0000.vtu", "m_0001.vtu", "m_mine.vtu"]


def test_annulus_and_sphere() -> None:
    """Every end of a meridian, on the axis or not, closes as it should."""
    for r, triangles, points in (([0.5, 1.0], 0, 8), ([0.0, 1.0], 4, 5), ([0.0, 1.0, 0.0], 8, 6)):
        revolution = vtk.Revolution.of(np.array(r), sectors=4)
        assert len(revolution.triangles) == triangles
        assert revolution.node.size == points
        cells = [*revolution.triangles.tolist(), *revolution.quads.tolist(), *revolution.line.tolist()]
        assert all(len(set(cell)) == len(cell) for cell in cells)


def test_undefined_on_the_axis(branch: Branch) -> None:
    """A quantity that is 0/0 on the axis takes its neighbour's value."""

    class Undefined:
        def profile(self) -> dict[str, np.ndarray]:
            return {"r": np.array([0.0, 1.0]), "stretch_2": np.array([np.nan, 1.5])}

    assert vtk.smooth_profile(Undefined())["stretch_2"].tolist() == [1.5, 1.5]  # type: ignore[arg-type]


def test_names_that_are_refused(branch: Branch, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.pvd"):
        branch.to_vtk(tmp_path / "membrane.vtu")
    with pytest.raises(InputError, match="writable"):
        branch.to_vtk(tmp_path / "nowhere" / "membrane.pvd")


# --- rendered pictures


def test_render(branch: Branch, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    from matplotlib.image import imread

    picture.render(branch, tmp_path / "membrane.png", size=(400, 300))
    image = imread(tmp_path / "membrane.png")[..., :3]
    assert image.shape == (300, 400, 3)
    assert image.std() > 0.05
    assert 0.1 < (image.min(axis=2) < 0.9).mean() < 0.9  # neither blank nor cut off
    border = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
    assert (border == 1).all()
    assert capfd.readouterr() == ("", "")


def test_render_refuses(branch: Branch, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="stretch_1"):
        picture.render(branch[0], tmp_path / "membrane.png", quantity="strech_1")
    with pytest.raises(InputError, match="one or more equilibria"):
        picture.render(branch[:0], tmp_path / "membrane.png")


# --- plots


def styles(figure: object) -> dict[str, str]:
    (axes,) = figure.axes  # type: ignore[attr-defined]
    return {line.get_label(): line.get_linestyle() for line in axes.lines if not line.get_label().startswith("_")}


def test_pressure_volume(branch: Branch, tmp_path: Path) -> None:
    from matplotlib.image import imread

    figure = plots.plot_pressure_volume(branch, tmp_path / "pv.png")
    (axes,) = figure.axes
    assert axes.get_xlabel() == "volume V/R₀³"
    assert axes.get_ylabel() == "pressure P = pR₀/(μT)"
    assert imread(tmp_path / "pv.png")[..., :3].std() > 0.05
    # the limit point of the neo-Hookean disc is at V = 2.797 (reference/disc.json); the dipole moves it little
    assert styles(figure) == {"stable under both controls": "-", "stable under volume control only": "--"}
    assert axes.get_legend() is not None


def test_lines_meet(branch: Branch) -> None:
    """No gap where the style changes. The change is at the special point between the two equilibria, or where the curve turns back."""
    limit = trace(SCENE, start=1.5, until={"volume": 4.0}).special_points
    for points in (None, limit):
        figure = plots.plot_pressure_volume(dataclasses.replace(branch, special_points=points))
        lines = [line.get_xydata() for line in figure.axes[0].lines if line.get_label().startswith("stable")]
        assert len(lines) == 2
        np.testing.assert_array_equal(lines[0][-1], lines[1][0])
        np.testing.assert_allclose(lines[0][-1], (limit[0].volume, limit[0].pressure), rtol=1e-12 if points else 0.02)


def test_no_claim_without_verdicts(branch: Branch) -> None:
    """What nobody tested is grey, unlike what is stable, and is named."""
    scene = SCENE.replace(analysis=Analysis())
    plain = dataclasses.replace(branch, scene=scene, equilibria=tuple(dataclasses.replace(e, scene=scene) for e in branch))
    figure = plots.plot_pressure_volume(plain)
    assert styles(figure) == {"stability not tested": "-"}
    (line, *dots) = figure.axes[0].lines
    assert (line.get_color(), len(dots)) == ("0.62", len(branch))
    drawn = line.get_xydata().tolist()
    assert all([e.volume, e.pressure] in drawn for e in branch)


@pytest.mark.parametrize("control", ["pressure", "volume"])
def test_one_control(branch: Branch, control: str) -> None:
    scene = SCENE.replace(analysis=Analysis((control,)))
    one = dataclasses.replace(branch, scene=scene, equilibria=tuple(dataclasses.replace(e, scene=scene) for e in branch))
    expected = {f"stable under {control} control": "-"} | ({"unstable under pressure control": ":"} if control == "pressure" else {})
    assert styles(plots.plot_pressure_volume(one)).keys() == expected.keys()


def test_azimuthal_instability_is_a_band(branch: Branch) -> None:
    """Behind the line, from half-way before the first equilibrium that is unstable to the mode."""
    scene = SCENE.replace(analysis=Analysis(azimuthal_modes=(1,)))
    equilibria = []
    for k, equilibrium in enumerate(branch):
        verdict = Verdict(k < 2, 1.5 - k, 1e-9, None, 1, 0, "")
        equilibria.append(dataclasses.replace(equilibrium, scene=scene, _answers={("verdict", None, 1): verdict}))
    figure = plots.plot_pressure_volume(dataclasses.replace(branch, scene=scene, equilibria=tuple(equilibria)))
    (band,) = (line for line in figure.axes[0].lines if line.get_label() == "unstable to azimuthal n = 1")
    volumes = band.get_xydata()[:, 0]
    assert branch[1].volume < volumes[0] < branch[2].volume
    assert volumes[-1] == branch[3].volume


def test_special_points_have_distinct_markers(branch: Branch) -> None:
    kinds = [*plots.MARKERS, "something_new"]
    points = tuple(SpecialPoint(kind, 1.0 + k, 1.0, 1.0, 0.0, branch[0]) for k, kind in enumerate(kinds))
    figure = plots.plot_pressure_volume(dataclasses.replace(branch, special_points=points))
    named = [line for line in figure.axes[0].lines if not line.get_label().startswith("_")]
    markers = [line.get_marker() for line in named if line.get_linestyle() == "None"]
    assert len(set(markers)) == len(kinds)


def judged(equilibrium: Equilibrium, pressure: bool, volume: bool) -> Equilibrium:
    """The equilibrium with verdicts made up."""
    words = {"pressure": pressure, "volume": volume}
    verdicts = {("verdict", c, 0): Verdict(stable, 1.0 if stable else -1.0, 1e-9, c, 0, 0, "") for c, stable in words.items()}
    return dataclasses.replace(equilibrium, _answers=verdicts)


def test_two_special_points_between_neighbours(branch: Branch) -> None:
    """Between limit point and volume fold the membrane has lost stability under pressure control alone, computed points there or not."""
    places = {"limit_point": (2.2, 1.92, 1.1), "volume_fold": (3.2, 1.88, 1.3)}
    special = tuple(SpecialPoint(kind, *place, 0.0, branch[1]) for kind, place in reversed(places.items()))
    equilibria = tuple(judged(e, k < 2, k < 2) for k, e in enumerate(branch))
    figure = plots.plot_pressure_volume(dataclasses.replace(branch, equilibria=equilibria, special_points=special))
    lines = {line.get_label(): line.get_xydata() for line in figure.axes[0].lines if not line.get_label().startswith("_")}
    limit, fold = (np.array(place[:2]) for place in places.values())
    np.testing.assert_array_equal(lines["stable under both controls"][-1], limit)
    np.testing.assert_array_equal(lines["stable under volume control only"][[0, -1]], [limit, fold])
    np.testing.assert_array_equal(lines["unstable under both controls"][0], fold)


def test_snap_is_an_arrow(branch: Branch) -> None:
    """The line goes on to the fold where the branch turned back, and begins again where the membrane lands."""
    limit = SpecialPoint("limit_point", 1.7, 1.9, 1.0, 0.0, branch[1])
    snapping = dataclasses.replace(branch, jumps=(Jump(2, limit, branch[2]),))
    (axes,) = plots.plot_pressure_volume(snapping).axes
    lines = [
        line.get_xydata() for line in axes.lines if line.get_label() in ("stable under both controls", "stable under volume control only")
    ]
    np.testing.assert_array_equal([lines[0][-1], lines[1][0]], [[1.7, 1.9], [branch[2].volume, branch[2].pressure]])
    assert [tuple(arrow.xy) for arrow in axes.texts] == [(branch[2].volume, branch[2].pressure)]
    assert "snap" in [text.get_text() for text in axes.get_legend().get_texts()]


def test_early_end_is_marked(branch: Branch) -> None:
    for status in (Status.STEP_LIMIT, Status.LEGENDRE_FAILURE):
        (axes,) = plots.plot_pressure_volume(dataclasses.replace(branch, status=status)).axes
        (cross,) = (line for line in axes.lines if line.get_label() == f"ends here: {status}")
        assert cross.get_xydata().tolist() == [[branch[-1].volume, branch[-1].pressure]]


@pytest.mark.parametrize("status", [Status.LEGENDRE_FAILURE, Status.SLACK])
def test_ill_posed_stretch_is_not_judged(branch: Branch, status: Status) -> None:
    marked = tuple(dataclasses.replace(e, status=status) if k > 1 else e for k, e in enumerate(branch))
    assert "ill-posed (compressed or slack)" in styles(plots.plot_pressure_volume(dataclasses.replace(branch, equilibria=marked)))


def test_draw_branch_onto_axes(branch: Branch) -> None:
    """Other quantities, several branches in one picture without naming anything twice, one style for all."""
    _, (left, right) = plots.new_figure((8, 4), title="two", widths=(1, 2))
    plots.draw_branch(left, branch, across="center_height", up="volume")
    plots.draw_branch(left, branch, across="center_height", up="volume")
    labels = plots.legend_entries(left)[1]
    assert labels == ["stable under both controls", "stable under volume control only"]
    assert left.get_xlabel() == "pole height η(0)/R₀"
    plots.draw_branch(right, branch, style=plots.Style("grey", "-", "0.5"), dots=False)
    (line,) = right.lines
    assert (line.get_label(), line.get_color()) == ("grey", "0.5")
    with pytest.raises(InputError, match="center_height"):
        plots.draw_branch(left, branch, across="centre_height")


def test_one_equilibrium(branch: Branch, tmp_path: Path) -> None:
    branch[:1].plot(tmp_path / "pv.png")
    assert (tmp_path / "pv.png").stat().st_size > 0


def test_profiles(branch: Branch, tmp_path: Path) -> None:
    figure = plots.plot_profiles(branch, tmp_path / "profiles.png", count=3)
    (axes,) = figure.axes
    curves = [line for line in axes.lines if line.get_label().startswith("V = ")]
    assert len(curves) == 3
    profile = branch[-1].profile(np.linspace(0, 1, 201))
    x, y = curves[-1].get_xydata().T
    np.testing.assert_array_equal(np.sort(x[x.size // 2 :]), np.sort(profile["rho"]))
    np.testing.assert_array_equal(y[y.size // 2 :], profile["eta"])
    assert any("dipole at height 5" in text.get_text() for text in axes.get_legend().get_texts())
    assert axes.get_ylim()[1] > 5


# --- wrinkling: bands along curves and filled regions


def wrinkled(branch: Branch, criterion: str | None = "total") -> Branch:
    """The branch beside a dipole that compresses the flattest membrane around its pole; stresses need no balance."""
    scene = branch.scene.replace(sources=[Dipole(strength=150, height=4.5)], analysis=Analysis(("volume",), wrinkling=criterion))
    equilibria = tuple(judged(dataclasses.replace(e, scene=scene, _answers={}), True, True) for e in branch)
    return dataclasses.replace(branch, scene=scene, equilibria=equilibria)


def bands(axes: object) -> dict[str, list[object]]:
    """Lines drawn as bands, by the first word of their labels; unnamed ones under that of the band before."""
    found: dict[str, list[object]] = {}
    word = ""
    for line in axes.lines:  # type: ignore[attr-defined]
        if line.get_path_effects():
            word = word if line.get_label().startswith("_") else line.get_label().split()[0]
            found.setdefault(word, []).append(line)
    return found


def test_meridian_shows_its_zones(branch: Branch) -> None:
    """Bands end exactly at the located borders, on both halves; they differ without colour, and are drawn when asked for."""
    equilibrium = wrinkled(branch)[0]
    assert equilibrium.zones().kinds == ("double", "radial", "taut")
    _, axes = plots.new_figure((6, 4))
    plots.draw_profile(axes, equilibrium, plots.PLAIN)
    found = bands(axes)
    double, radial, _ = equilibrium.zones()
    (line,) = found["double"]
    assert (line.get_xdata()[0], line.get_xdata()[-1]) == pytest.approx((-double.rho[1], double.rho[1]), abs=1e-14)
    ends = sorted(abs(x) for line in found["radial"] for x in (line.get_xdata()[0], line.get_xdata()[-1]))
    assert ends == pytest.approx(sorted(2 * radial.rho), abs=1e-14)
    assert "double wrinkles (total s11, s22 < 0)" in plots.legend_entries(axes)[1]
    _, axes = plots.new_figure((6, 4))
    plots.draw_profile(axes, equilibrium, plots.PLAIN, zones=False)
    assert bands(axes) == {}
    plots.draw_profile(axes, wrinkled(branch, None)[0], plots.PLAIN, zones=True)
    assert bands(axes).keys() == {"double", "radial"}


def test_labels_say_what_decides() -> None:
    scene = SCENE.replace(analysis=Analysis(wrinkling="mechanical"))
    kinds = ("taut", "radial", "double")
    plain = ["taut", "radial wrinkles (mechanical s22 < 0)", "double wrinkles (mechanical s11, s22 < 0)"]
    assert [zones.zone_label(scene, kind) for kind in kinds] == plain
    relaxed = ["taut", "radial wrinkles (no tension across)", "double wrinkles (slack)"]
    assert [zones.zone_label(scene.replace(tension_field=True), kind) for kind in kinds] == relaxed


def test_patterns_differ_without_colour() -> None:
    looks = [(p.core, p.ink, str(p.dashes), p.hatch) for p in zones.PATTERNS.values()]
    assert len(set(looks)) == len({p.hatch for p in zones.PATTERNS.values()}) == 4
    for pattern in zones.PATTERNS.values():
        assert 0 <= float(pattern.ink) <= float(pattern.fill) <= 1  # shades of grey


def test_branch_shows_where_it_is_wrinkled(branch: Branch) -> None:
    """A band up to half-way to the first equilibrium that is taut everywhere, wider than that of azimuthal instability."""
    shown = wrinkled(branch)
    assert [zones.shown_kinds(e.zones()) for e in shown] == [("double",), (), (), ()]
    (axes,) = plots.plot_pressure_volume(shown).axes
    ((line,),) = bands(axes).values()
    assert line.get_xdata()[0] == shown[0].volume
    assert shown[0].volume < line.get_xdata()[-1] < shown[1].volume
    assert line.get_linewidth() > 8
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["stable under volume control", "not resolved between steps", "double wrinkles (total s11, s22 < 0)"]  # no equilibria
    assert bands(plots.plot_pressure_volume(wrinkled(branch, None)).axes[0]) == {}


def test_zones_picture(branch: Branch, tmp_path: Path) -> None:
    from matplotlib.image import imread

    shown = wrinkled(branch)
    figure = plots.plot_zones(shown, tmp_path / "zones.png")
    (axes,) = figure.axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("volume V/R₀³", "reference radius r/R₀")
    assert axes.get_xlim() == pytest.approx((shown[0].volume, shown[-1].volume))
    assert axes.get_ylim() == pytest.approx((0, 1))
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["taut", "radial wrinkles (total s22 < 0)", "double wrinkles (total s11, s22 < 0)"]
    corners = {tuple(point) for line in axes.lines for point in line.get_xydata().tolist()}
    assert {(e.volume, border) for e in shown for border in e.zones().borders} <= corners
    image = imread(tmp_path / "zones.png")[..., :3]
    assert image.std() > 0.05
    assert np.abs(np.ptp(image, axis=2)).max() < 0.01  # grey throughout


def test_zones_against_steps(branch: Branch) -> None:
    """A branch that turns back in volume is shown by its steps; one that goes down in volume looks like one that goes up."""
    shown = wrinkled(branch)
    back = dataclasses.replace(shown, equilibria=(*shown.equilibria, shown[1]))
    (axes,) = plots.plot_zones(back).axes
    assert axes.get_xlabel() == "step"
    assert axes.get_xlim() == pytest.approx((0, 4))
    (axes,) = plots.plot_zones(dataclasses.replace(shown, equilibria=shown.equilibria[::-1])).axes
    (same,) = plots.plot_zones(shown).axes
    drawn, expected = (np.array(sorted(p for line in a.lines for p in line.get_xydata().tolist())) for a in (axes, same))
    np.testing.assert_allclose(drawn, expected, atol=1e-9)
    assert axes.get_xlim() == same.get_xlim()
    (axes,) = plots.plot_zones(shown[:1]).axes
    assert axes.get_xlim() == pytest.approx((-0.5, 0.5))


@pytest.mark.parametrize("order", [1, -1])
def test_no_zones_within_a_snap(branch: Branch, order: int) -> None:
    """Between two parts of a branch there are no states to interpolate: zones change half-way, and borders keep their radii till there."""
    shown = wrinkled(branch)
    equilibria = shown.equilibria[:2][::order]
    snapping = dataclasses.replace(shown, equilibria=equilibria, jumps=(Jump(1, None, equilibria[1]),))
    (axes,) = plots.plot_zones(snapping).axes
    first, middle = shown[0].volume, (shown[0].volume + shown[1].volume) / 2
    expected = [sorted([x, border] for x in (first, first, middle)) for border in shown[0].zones().borders]
    assert [sorted(line.get_xydata().tolist()) for line in axes.lines] == expected


def test_no_border_across_a_snap_between_equal_kinds(branch: Branch) -> None:
    """Two states with the same kinds of zones and a snap between: two stretches of border, not one line."""
    shown = wrinkled(branch)
    first = shown.equilibria[0]
    landing = dataclasses.replace(first, volume=first.volume + 1.0)
    assert first.zones().borders
    snapping = dataclasses.replace(shown, equilibria=(first, landing), jumps=(Jump(1, None, landing),))
    (axes,) = plots.plot_zones(snapping).axes
    assert len(axes.lines) == 2 * len(first.zones().borders)
    for line in axes.lines:
        assert np.ptp(line.get_xdata()) == pytest.approx(0.5)


def test_plots_refuse(branch: Branch) -> None:
    for plot in (plots.plot_pressure_volume, plots.plot_profiles, plots.plot_zones):
        with pytest.raises(InputError, match="one or more equilibria"):
            plot(branch[:0])
    with pytest.raises(InputError, match="count"):
        plots.plot_profiles(branch, count=0)


def test_no_global_state(branch: Branch) -> None:
    """Plots leave Matplotlib's settings and windows alone."""
    import subprocess
    import sys

    heavy = "{'matplotlib', 'pyvista', 'meshio', 'xarray', 'pandas'}"
    code = f"import sys, femmembrane.views.plots, femmembrane.views.vtk; print(sorted({heavy} & set(sys.modules)))"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == "[]"
    plots.plot_pressure_volume(branch)
    assert "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()


@pytest.mark.parametrize(
    ("words", "label"),
    [
        ({"pressure": "stable", "volume": "stable", "gas": "stable"}, "stable under all three controls"),
        ({"pressure": "unstable", "volume": "stable", "gas": "stable"}, "stable under volume and gas control only"),
        ({"pressure": "unstable", "volume": "stable", "gas": "unstable"}, "stable under volume control only"),
        ({"pressure": "unstable", "volume": "unstable", "gas": "unstable"}, "unstable under all three controls"),
        ({"pressure": "unstable", "volume": "stable"}, "stable under volume control only"),
        ({"pressure": "unstable", "gas": "stable"}, "stable under gas control only"),
        ({"pressure": "stable", "gas": "stable"}, "stable under pressure and gas control"),
        ({"gas": "stable"}, "stable under gas control"),
    ],
)
def test_the_label_names_every_control_under_which_a_state_is_stable(words: dict[str, str], label: str) -> None:
    assert figures.style_of(words).label == label
