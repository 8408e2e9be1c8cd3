"""Files for other programs: their own readers open them, and find the membrane that was computed."""

from __future__ import annotations

import csv
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.cli import main
from femmembrane.views.export import FORMATS
from femmembrane.views.vtk import SECTORS
from tests.cases import disc_scene

vtk = pytest.importorskip("vtkmodules")

NODES = 17


@cache
def branch() -> fm.Branch:
    scene = disc_scene(dipole=(150, 4.5), elements=8).replace(analysis=fm.Analysis(("volume",), wrinkling="total"))
    return fm.inflate(scene, volumes=[0.5, 2.0, 5.0])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A saved branch, exported by the command to every format."""
    path = tmp_path_factory.mktemp("export")
    branch().save(path / "branch.nc")
    for suffix in FORMATS:
        assert main(["export", str(path), "--to", suffix.lstrip(".")]) == 0
    return path


def numpy_of(array: object) -> np.ndarray:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return vtk_to_numpy(array)


def volume_of(points: np.ndarray, triangles: np.ndarray) -> float:
    """Int z n_z dA over triangles: the volume above the plane of the rim."""
    a, b, c = (points[triangles[:, k]].astype(float) for k in range(3))
    return float((np.cross(b - a, c - a)[:, 2] / 2 * (a + b + c)[:, 2] / 3).sum())


def polygon_volume(equilibrium: fm.Equilibrium) -> float:
    """A polygon of n sides in place of each circle loses 1 - sin(x)/x, x = 2 pi/n, of the volume."""
    x = 2 * np.pi / SECTORS
    return float(np.sin(x) / x * equilibrium.volume)


def test_every_format_is_written(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert {f"export{suffix}" for suffix in FORMATS} <= {file.name for file in folder.iterdir()}
    assert main(["export", str(folder / "branch.nc"), "--to", "stl", "--step", "0", "--out", str(folder / "first.stl")]) == 0
    said = capfd.readouterr()
    assert "written:" in said.out
    assert said.err == ""


def test_vtu_in_paraview_s_reader(folder: Path) -> None:
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(folder / "export.vtu"))
    reader.Update()
    grid = reader.GetOutput()
    assert grid.GetNumberOfPoints() == 1 + (NODES - 1) * SECTORS
    data = grid.GetPointData()
    names = {data.GetArrayName(k) for k in range(data.GetNumberOfArrays())}
    assert {"displacement", "stretch_1", "total_stress_2", "zone"} <= names
    assert np.ptp(numpy_of(grid.GetPoints().GetData())[:, 2]) == pytest.approx(branch()[-1].center_height, rel=1e-12)
    assert set(numpy_of(grid.GetCellData().GetArray("volume"))) == {branch()[-1].volume}


def test_xdmf_in_vtk_s_reader(folder: Path) -> None:
    """Every step in time has its own points and data, on the same cells."""
    reader_module = pytest.importorskip("vtkmodules.vtkIOXdmf2")
    reader = reader_module.vtkXdmfReader()
    reader.SetFileName(str(folder / "export.xdmf"))
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(vtk.vtkCommonExecutionModel.vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    assert tuple(times) == (0.0, 1.0, 2.0)
    for step, equilibrium in enumerate(branch()):
        reader.UpdateTimeStep(step)
        grid = reader.GetOutputDataObject(0)
        while grid.IsA("vtkMultiBlockDataSet"):
            grid = grid.GetBlock(0)
        points = numpy_of(grid.GetPoints().GetData())
        assert (len(points), grid.GetNumberOfCells()) == (1 + (NODES - 1) * SECTORS, (NODES - 1) * SECTORS)
        assert points[0, 2] == pytest.approx(equilibrium.center_height, rel=1e-12)
        profile = equilibrium.profile()
        ring = numpy_of(grid.GetPointData().GetArray("stretch_2"))[1::SECTORS]
        np.testing.assert_array_equal(ring, profile["stretch_2"][1:])
        moved = numpy_of(grid.GetPointData().GetArray("displacement"))
        np.testing.assert_allclose((points - moved)[:, 2], 0, atol=1e-14)


def test_xdmf_and_vtu_in_meshio_and_pyvista(folder: Path, tmp_path: Path) -> None:
    """A branch by meshio's reader of time series, one equilibrium as a mesh."""
    import meshio

    cells = {"triangle": SECTORS, "quad": (NODES - 2) * SECTORS}
    with meshio.xdmf.TimeSeriesReader(folder / "export.xdmf") as reader:
        points, blocks = reader.read_points_cells()
        assert {block.type: len(block.data) for block in blocks} == cells
        assert points[0, 2] == pytest.approx(branch()[0].center_height, rel=1e-12)
        assert reader.num_steps == 3
        for step, equilibrium in enumerate(branch()):
            time, data, _ = reader.read_data(step)
            assert time == step
            np.testing.assert_array_equal(data["stretch_2"][1::SECTORS], equilibrium.profile()["stretch_2"][1:])
    fm.export(branch()[1], tmp_path / "one.xdmf")
    fm.export(branch()[1], tmp_path / "one.vtu")
    for name in ("one.xdmf", "one.vtu"):
        mesh = meshio.read(tmp_path / name)
        assert {kind: len(mesh.cells_dict[kind]) for kind in cells} == cells
        assert mesh.points[0, 2] == pytest.approx(branch()[1].center_height, rel=1e-12)
        pyvista = pytest.importorskip("pyvista")
        grid = pyvista.get_reader(tmp_path / name).read() if name.endswith(".vtu") else None
        if grid is not None:
            assert grid.n_points == len(mesh.points)
            np.testing.assert_array_equal(grid["stretch_1"], mesh.point_data["stretch_1"])


def test_lengths_are_in_m_where_the_scene_has_scales(tmp_path: Path) -> None:
    import meshio

    scales = fm.Scales(radius=0.05, thickness=1e-4, shear_modulus=1e5)
    eq = fm.equilibrium(disc_scene(elements=4).replace(scales=scales), volume=2.0)
    height = 0.05 * eq.center_height
    for suffix in (".vtu", ".xdmf", ".stl", ".obj"):
        fm.export(eq, tmp_path / f"a{suffix}")
        mesh = meshio.read(tmp_path / f"a{suffix}")
        assert np.ptp(mesh.points[:, 2]) == pytest.approx(height, rel=1e-6)
        if suffix in (".vtu", ".xdmf"):
            assert mesh.point_data["displacement"][0, 2] == pytest.approx(height, rel=1e-12)
    mesh = meshio.read(tmp_path / "a.vtu")
    assert mesh.cell_data["volume_m3"][0][0] == pytest.approx(2.0 * 0.05**3, rel=1e-12)
    assert mesh.cell_data["pressure_pa"][0][0] == pytest.approx(scales.to_si("pressure", eq.pressure), rel=1e-12)
    fm.export(eq, tmp_path / "a.csv")
    with (tmp_path / "a.csv").open(newline="", encoding="utf-8") as file:
        row = next(csv.DictReader(file))
    assert (float(row["eta"]), float(row["eta_m"])) == (eq.center_height, pytest.approx(height, rel=1e-12))


def test_stl_encloses_the_volume(folder: Path) -> None:
    """Its triangles face the way the pressure pushes, and enclose the volume with the plane of the rim."""
    from vtkmodules.vtkIOGeometry import vtkSTLReader

    for file, equilibrium in (("export.stl", branch()[-1]), ("first.stl", branch()[0])):
        fm.export(branch(), folder / "first.stl", step=0)
        reader = vtkSTLReader()
        reader.SetFileName(str(folder / file))
        reader.Update()
        surface = reader.GetOutput()
        points = numpy_of(surface.GetPoints().GetData())
        triangles = numpy_of(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3)
        assert len(triangles) == SECTORS * (2 * NODES - 3)
        assert volume_of(points, triangles) == pytest.approx(polygon_volume(equilibrium), rel=2e-2)


def test_obj_keeps_the_points(folder: Path) -> None:
    from vtkmodules.vtkIOGeometry import vtkOBJReader

    reader = vtkOBJReader()
    reader.SetFileName(str(folder / "export.obj"))
    reader.Update()
    surface = reader.GetOutput()
    assert surface.GetNumberOfPoints() == 1 + (NODES - 1) * SECTORS
    assert surface.GetNumberOfCells() == (NODES - 1) * SECTORS
    assert numpy_of(surface.GetPoints().GetData())[0, 2] == pytest.approx(branch()[-1].center_height, rel=1e-6)


def test_pvd_in_pyvista(folder: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    assert pyvista.get_reader(folder / "export.pvd").time_values == [0, 1, 2]


def test_csv_is_the_profile(folder: Path) -> None:
    with (folder / "export.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3 * NODES
    assert list(rows[0])[:7] == ["step", "volume", "pressure", "r", "rho", "eta", "stretch_1"]
    for step, equilibrium in enumerate(branch()):
        own = [row for row in rows if int(row["step"]) == step]
        for name, values in equilibrium.profile().items():
            assert [float(row[name]) for row in own] == values.tolist()
        assert {float(row["volume"]) for row in own} == {equilibrium.volume}
    fm.export(branch(), folder / "one.csv", step=-2)
    assert (folder / "one.csv").read_text(encoding="utf-8").count("\n1,") == NODES


def test_an_equilibrium_on_its_own(tmp_path: Path) -> None:
    assert fm.export(branch()[1], tmp_path / "a.pvd") == [tmp_path / "a" / "a_0000.vtu", tmp_path / "a.pvd"]
    assert fm.export(branch()[1], tmp_path / "a.xdmf") == [tmp_path / "a.h5", tmp_path / "a.xdmf"]


@pytest.mark.parametrize(
    ("name", "step", "told"),
    [
        ("a.ply", None, "known: csv, obj"),
        ("a.stll", None, "did you mean 'stl'"),
        ("a", None, "format"),
        ("a.vtu", 3, "from -3 to 2"),
        ("a.pvd", 1, "holds all equilibria"),
        ("missing/a.obj", None, "existing, writable folder"),
    ],
)
def test_refusals(name: str, step: int | None, told: str, tmp_path: Path) -> None:
    with pytest.raises(fm.InputError, match=told):
        fm.export(branch(), tmp_path / name, step=step)
    assert list(tmp_path.iterdir()) == []


def test_refusals_of_the_command(folder: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(folder), "--to", "vtu", "--out", str(tmp_path / "a.stl")]) == 2
    assert "ends in .vtu" in capfd.readouterr().err
    assert main(["export", str(tmp_path), "--to", "vtu"]) == 2
    assert list(tmp_path.iterdir()) == []
