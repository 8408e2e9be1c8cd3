"""Mesh files as Gmsh, VTK, ParaView, dolfinx and Abaqus write them: all are read, or refused in words."""

from __future__ import annotations

import os
import stat
import struct
import warnings
import zlib
from base64 import b64encode
from pathlib import Path
from typing import Any

import h5py
import meshio
import numpy as np
import pytest

import femmembrane as fm
from femmembrane.discretization.dialects import READERS
from femmembrane.discretization.mesh_files import FORMATS

DATA = Path(__file__).parents[1] / "data"

#: a quarter of a circle from the pole to the rim, in the order and direction of no one
ANGLES = np.linspace(0, np.pi / 2, 7)
QUARTER = np.stack([np.sin(ANGLES), np.cos(ANGLES)], axis=1)
QUARTER[0, 0] = QUARTER[-1, 1] = 0.0


def in_plane(points: np.ndarray, plane: str = "xy") -> np.ndarray:
    zero = np.zeros(len(points))
    return np.column_stack([points[:, 0], points[:, 1], zero] if plane == "xy" else [points[:, 0], zero, points[:, 1]])


# --- Gmsh


@pytest.mark.parametrize(
    ("name", "curved"),
    [
        ("gmsh-2.2-binary-two-groups.msh", False),
        ("gmsh-4.0-save-all.msh", False),
        ("gmsh-4.1-binary-save-all.msh", True),
        ("gmsh-4.1.msh", True),
        ("gmsh.inp", True),
    ],
)
def test_files_of_gmsh(name: str, curved: bool) -> None:
    """An arc from (0, 1) to (1, 0) in the group "membrane", with the line on to (2, 0) in "all"; written by Gmsh 4.15.2.

    The arc is in both groups. The binary file of version 4.1 has x, 0, z.
    """
    arc = fm.read_meridian(DATA / name, group="membrane")
    assert (arc.elements, arc.curved) == (6, curved)
    assert np.hypot(*np.array(arc.points).T) == pytest.approx(1, rel=1e-14)
    both = fm.read_meridian(DATA / name, group="all")
    assert (both.elements, both.points[-1]) == (10, (2.0, 0.0))
    assert fm.read_meridian(DATA / name) == both
    scene = {"material": {"model": "neo-hookean"}, "mesh": {"file": name, "group": "membrane"}}
    assert fm.Scene.from_dict(scene, DATA).mesh == arc
    with pytest.raises(fm.InputError, match=r"mesh.group = 'membran': unknown; did you mean 'membrane'"):
        fm.read_meridian(DATA / name, group="membran")


def test_lines_in_two_groups_are_taken_once_and_that_is_said() -> None:
    curve = fm.read_meridian(DATA / "gmsh-2.2-binary-two-groups.msh")
    assert curve.repaired == ("6 cells that are listed more than once were taken once",)
    branch = fm.Branch(fm.Scene(material=fm.NeoHookean(), mesh=curve), ())
    assert branch.notes[0] == "mesh: 6 cells that are listed more than once were taken once"


PARTITIONED = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
1
1 7 "wall"
$EndPhysicalNames
$Entities
0 1 0 0
1 0 0 0 1 2 0 1 7 0
$EndEntities
$PartitionedEntities
2
0
0 2 0 0
2 1 1 1 1 0 0 0 1 1 0 1 7 0
3 1 1 2 1 2 0 1 0 1 2 0 1 7 0
$EndPartitionedEntities
$Nodes
2 4 1 4
1 2 0 2
1
2
0 0 0
1 0 0
1 3 0 2
3
4
1 2 0
0 2 0
$EndNodes
$Elements
2 3 1 3
1 2 1 2
1 1 2
2 2 3
1 3 1 1
3 3 4
$EndElements
"""


def test_a_mesh_that_gmsh_has_divided_for_processors_keeps_its_groups(tmp_path: Path) -> None:
    path = tmp_path / "a.msh"
    path.write_text(PARTITIONED, encoding="utf-8")
    assert fm.read_meridian(path, group="wall").points == ((0, 2), (1, 2), (1, 0), (0, 0))


# --- VTK


def polydata(points: np.ndarray, pieces: list[list[int]]) -> Any:
    import pyvista

    return pyvista.PolyData(points, lines=np.concatenate([[len(piece), *piece] for piece in pieces]))


def vtk_file(path: Path, data: Any, mode: str = "appended", packer: str = "None", version: int = 51) -> Path:
    """A file by VTK's own writer."""
    from vtkmodules import vtkIOLegacy, vtkIOXML

    if path.suffix == ".vtk":
        writer = vtkIOLegacy.vtkPolyDataWriter() if data.IsA("vtkPolyData") else vtkIOLegacy.vtkUnstructuredGridWriter()
        writer.SetFileVersion(version)
        (writer.SetFileTypeToASCII if mode == "ascii" else writer.SetFileTypeToBinary)()
    else:
        writer = vtkIOXML.vtkXMLPolyDataWriter() if data.IsA("vtkPolyData") else vtkIOXML.vtkXMLUnstructuredGridWriter()
        writer.SetDataMode({"ascii": 0, "binary": 1}.get(mode, 2))
        writer.SetEncodeAppendedData(mode != "raw")
        getattr(writer, f"SetCompressorTypeTo{packer}")()
        writer.SetBlockSize(64)
        writer.SetHeaderTypeToUInt64() if mode == "raw" else writer.SetHeaderTypeToUInt32()
    writer.SetFileName(str(path))
    writer.SetInputData(data)
    assert writer.Write()
    return path


@pytest.mark.parametrize("packer", ["None", "ZLib", "LZ4", "LZMA"])
@pytest.mark.parametrize("mode", ["ascii", "binary", "appended", "raw"])
@pytest.mark.parametrize("suffix", [".vtp", ".vtu"])
def test_xml_files_of_vtk(suffix: str, mode: str, packer: str, tmp_path: Path) -> None:
    """Polylines of PolyData, and of a grid, in every encoding of VTK's writer."""
    pieces = [[0, 1, 2], [3, 2], [3, 4, 5, 6]]
    data = polydata(in_plane(QUARTER, "xz"), pieces)
    data.point_data["height"] = QUARTER[:, 1]
    if suffix == ".vtu":
        data = data.cast_to_unstructured_grid()
    curve = fm.read_meridian(vtk_file(tmp_path / f"a{suffix}", data, mode, packer))
    found = np.array(curve.points)
    assert found == pytest.approx(QUARTER, abs=1e-15 if mode != "ascii" else 1e-9)


@pytest.mark.parametrize("version", [42, 51])
@pytest.mark.parametrize("mode", ["ascii", "binary"])
@pytest.mark.parametrize("grid", [False, True])
def test_older_files_of_vtk(grid: bool, mode: str, version: int, tmp_path: Path) -> None:
    data = polydata(in_plane(QUARTER), [[0, 1, 2], [3, 2], [3, 4, 5, 6]])
    data.field_data["time"] = [0.5]
    data.field_data["made by"] = ["a program of a long name " * 4, "x", "POINTS 3 float"]
    data.point_data["height"] = QUARTER[:, 1]
    if grid:
        data = data.cast_to_unstructured_grid()
    curve = fm.read_meridian(vtk_file(tmp_path / "a.vtk", data, mode, version=version))
    assert np.array(curve.points) == pytest.approx(QUARTER, abs=1e-15 if mode == "binary" else 1e-9)


def test_a_surface_is_refused_with_advice(tmp_path: Path) -> None:
    import pyvista

    for name, data in (("a.vtp", pyvista.Sphere()), ("a.vtu", pyvista.Sphere().cast_to_unstructured_grid()), ("a.vtk", pyvista.Sphere())):
        with pytest.raises(
            fm.InputError, match=r"cells in the file: (polygon|triangle); of a surface of revolution save its meridian alone"
        ):
            fm.read_meridian(vtk_file(tmp_path / name, data))


# --- XDMF

XDMF = """<?xml version="1.0"?>
<Xdmf Version="3.0" xmlns:xi="https://www.w3.org/2001/XInclude"><Domain>
<Grid Name="mesh" GridType="Uniform">
<Topology TopologyType="{kind}" NumberOfElements="{n}" NodesPerElement="{width}">
<DataItem Dimensions="{n} {width}" NumberType="Int" Format="HDF">{file}:/Mesh/mesh/topology</DataItem></Topology>
<Geometry GeometryType="{geometry}"><DataItem Dimensions="{m} {d}" Format="HDF">{file}:/Mesh/mesh/geometry</DataItem></Geometry>
</Grid>{more}</Domain></Xdmf>
"""
STEPS = """<Grid Name="f" GridType="Collection" CollectionType="Temporal"><Grid Name="f" GridType="Uniform">
<xi:include xpointer="xpointer(/Xdmf/Domain/Grid[@GridType='Uniform'][1]/*[self::Topology or self::Geometry])" /><Time Value="0" />
</Grid></Grid>"""


def dolfinx(path: Path, points: np.ndarray, cells: np.ndarray, kind: str, more: str = "", file: str = "a.h5") -> Path:
    """A file as dolfinx writes a mesh of intervals: io.XDMFFile.write_mesh, and with ``more`` write_function."""
    with h5py.File(path.with_name("a.h5"), "w") as target:
        target["Mesh/mesh/topology"], target["Mesh/mesh/geometry"] = cells, points
    (m, d), (n, width) = points.shape, cells.shape
    text = XDMF.format(kind=kind, n=n, width=width, m=m, d=d, geometry="XY" if d == 2 else "XYZ", file=file, more=more)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("more", ["", STEPS])
def test_intervals_of_dolfinx(more: str, tmp_path: Path) -> None:
    k = np.arange(6)
    path = dolfinx(tmp_path / "a.xdmf", QUARTER, np.stack([k, k + 1], axis=1), "PolyLine", more)
    assert fm.read_meridian(path).points == tuple(map(tuple, QUARTER.tolist()))
    k = np.arange(0, 6, 2)
    path = dolfinx(tmp_path / "a.xdmf", in_plane(QUARTER), np.stack([k, k + 2, k + 1], axis=1), "Edge_3", more)
    assert fm.read_meridian(path).curved


@pytest.mark.parametrize("data_format", ["XML", "HDF", "Binary"])
def test_vertices_beside_lines(data_format: str, tmp_path: Path) -> None:
    k = np.arange(6)
    cells = [("vertex", np.array([[0], [6]])), ("line", np.stack([k, k + 1], axis=1))]
    here = Path.cwd()
    os.chdir(tmp_path)  # where meshio writes binary files
    try:
        meshio.Mesh(in_plane(QUARTER), cells).write("a.xdmf", data_format=data_format)
    finally:
        os.chdir(here)
    assert np.array(fm.read_meridian(tmp_path / "a.xdmf").points) == pytest.approx(QUARTER, abs=1e-15)


def test_grids_are_groups(tmp_path: Path) -> None:
    """A mesh and its parts, as grids over the same points."""
    item = '<DataItem Dimensions="{} {}" NumberType="{}" Precision="8" Format="XML">{}</DataItem>'

    def text(array: np.ndarray, kind: str) -> str:
        return item.format(*array.shape, kind, " ".join(map(repr, array.ravel().tolist())))

    grids = ""
    for name, k in (("mesh", np.arange(6)), ("membrane", np.arange(4))):
        cells = np.stack([k, k + 1], axis=1)
        grids += f'<Grid Name="{name}"><Topology TopologyType="Polyline">{text(cells, "Int")}</Topology>'
        grids += f'<Geometry GeometryType="XY">{text(QUARTER, "Float")}</Geometry></Grid>'
    (tmp_path / "a.xdmf").write_text(f'<Xdmf Version="2.0"><Domain>{grids}</Domain></Xdmf>', encoding="utf-8")
    assert fm.read_meridian(tmp_path / "a.xdmf", group="membrane").elements == 4
    assert fm.read_meridian(tmp_path / "a.xdmf").elements == 6


def test_nothing_outside_its_folder_is_opened(tmp_path: Path) -> None:
    """Absolute paths, paths upwards, links out of the folder, pipes, and links inside HDF5."""
    inner = tmp_path / "inner"
    inner.mkdir()
    k = np.arange(6)
    cells = np.stack([k, k + 1], axis=1)
    dolfinx(tmp_path / "b.xdmf", QUARTER, cells, "PolyLine")
    (inner / "link.h5").symlink_to(tmp_path / "a.h5")
    os.mkfifo(inner / "pipe.h5")
    assert stat.S_ISFIFO((inner / "pipe.h5").stat().st_mode)
    for file, words in {
        str(tmp_path / "a.h5"): "files in its own folder are allowed",
        "../a.h5": "files in its own folder are allowed",
        "link.h5": "files in its own folder are allowed",
        "pipe.h5": "is no plain file",
        "none.h5": "is missing",
    }.items():
        path = dolfinx(inner / "a.xdmf", QUARTER, cells, "PolyLine", file=file)
        with pytest.raises(fm.InputError, match=words):
            fm.read_meridian(path)
    with h5py.File(inner / "a.h5", "w") as target:
        target["Mesh/mesh/topology"] = h5py.ExternalLink(str(tmp_path / "a.h5"), "/Mesh/mesh/topology")
        target["Mesh/mesh/geometry"] = QUARTER
    path.write_text(path.read_text(encoding="utf-8").replace("none.h5", "a.h5"), encoding="utf-8")
    with pytest.raises(fm.InputError, match="has no data"):
        fm.read_meridian(path)


# --- what is too large


def test_what_unpacks_to_gigabytes_is_refused_by_its_numbers(tmp_path: Path) -> None:
    """By what is declared; and a block that holds more than it declares is not unpacked further."""
    vtu = '<VTKFile type="UnstructuredGrid" header_type="UInt64" compressor="vtkZLibDataCompressor"><UnstructuredGrid>'
    vtu += '<Piece NumberOfPoints="{n}" NumberOfCells="1"><Points><DataArray type="Float64" NumberOfComponents="3" format="binary">'
    vtu += "{data}</DataArray></Points></Piece></UnstructuredGrid></VTKFile>"
    bomb = zlib.compress(bytes(2**26), 9)
    for n, size, words in (
        (2**28, 2**32, r"declares 268435456 points"),
        (4, 2**32, r"an array unpacks to 4294967296 bytes, 160000000 are allowed"),
        (4, 96, r"does not hold the 96 bytes that it declares"),
    ):
        head = struct.pack("<QQQQ", 1, size, 0, len(bomb))
        (tmp_path / "a.vtu").write_text(vtu.format(n=n, data=(b64encode(head) + b64encode(bomb)).decode()), encoding="utf-8")
        with pytest.raises(fm.InputError, match=words):
            fm.read_meridian(tmp_path / "a.vtu")
    (tmp_path / "a.vtk").write_text("# vtk DataFile Version 3.0\n\nBINARY\nDATASET POLYDATA\nPOINTS 4000000000 double\n", encoding="utf-8")
    (tmp_path / "a.msh").write_text("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4000000000 1 4\n$EndNodes\n", encoding="utf-8")
    for name, words in (("a.vtk", "declares 4000000000 points"), ("a.msh", "declares 4000000000 nodes")):
        with pytest.raises(fm.InputError, match=words):
            fm.read_meridian(tmp_path / name)
    with h5py.File(tmp_path / "a.h5", "w") as target:
        target["Mesh/mesh/topology"] = np.array([[0, 1]])
        target.create_dataset("Mesh/mesh/geometry", shape=(2**27, 3), dtype="f8", chunks=True, compression="gzip", fillvalue=0.0)
    text = XDMF.format(kind="PolyLine", n=1, width=2, m=4, d=3, geometry="XYZ", file="a.h5", more="")
    (tmp_path / "a.xdmf").write_text(text, encoding="utf-8")
    with pytest.raises(fm.InputError, match="are 402653184 numbers, 20000000 are allowed"):
        fm.read_meridian(tmp_path / "a.xdmf")


# --- round-off


def circle(turns: np.ndarray, aspect: float = 3.0) -> np.ndarray:
    return np.stack([aspect + np.sin(turns), np.cos(turns)], axis=1)


def test_a_ring_whose_seam_is_there_twice_but_apart_has_a_remark(tmp_path: Path) -> None:
    """Farther apart than round-off: a slit may be meant. It is asked about in every way that a curve comes in, and once."""
    points = circle(2 * np.pi * np.arange(61) / 60)
    points[-1] = points[0] + np.array([0.0, -1e-4])
    curve = fm.meridian_from_points(points)
    assert not curve.closed
    (remark,) = curve.repaired
    assert "1.0e-04 apart and were left so; for a closed curve let them coincide" in remark
    fm.write_meridian(curve, tmp_path / "slit.vtu", curved=False)
    assert len(fm.read_meridian(tmp_path / "slit.vtu").repaired) == 1
    scene = fm.Scene(material=fm.NeoHookean(), mesh=curve)
    assert fm.Scene.from_dict(scene.to_dict()) == scene
    assert fm.Scene.from_dict(scene.to_dict()).mesh.repaired == curve.repaired


def test_a_ring_that_closes_but_for_round_off_is_closed(tmp_path: Path) -> None:
    """61 points whose ends are 1.1e-16 apart: P = 0.5 gives the V of the closed ring, and not of one clamped at a slit."""
    points = circle(2 * np.pi * np.arange(61) / 60)
    points[-1] = points[0] + np.array([0.0, -1.1102230246251565e-16])
    curve = fm.meridian_from_points(points)
    assert curve.closed
    assert curve.repaired == ("the ends of the curve, 1.1e-16 apart, were joined: it is closed",)
    points[-1] = points[0]
    exact = fm.meridian_from_points(points)
    assert exact.repaired == ()
    assert exact == curve
    found = [fm.equilibrium(fm.Scene(material=fm.NeoHookean(), mesh=mesh), pressure=0.5).volume for mesh in (curve, exact)]
    assert found[0] == found[1]
    branch = fm.inflate(fm.Scene(material=fm.NeoHookean(), mesh=curve), volumes=[found[0]])
    branch.save(tmp_path / "branch.nc")
    assert fm.load(tmp_path / "branch.nc").notes == branch.notes
    assert branch.notes[0] == "mesh: the ends of the curve, 1.1e-16 apart, were joined: it is closed"


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("offset", [1.2246e-16, -1.8e-16])
def test_poles_all_but_on_the_axis_are_poles(kind: Any, offset: float, size: float) -> None:
    """sin(pi) in double and single precision, in any unit."""
    s = np.linspace(0, np.pi, 13)
    points = size * np.stack([np.sin(s.astype(kind)), np.cos(s.astype(kind))], axis=1).astype(float)
    points[-1, 0] = size * (offset if kind is np.float64 else float(np.sin(np.float32(np.pi))))
    curve = fm.meridian_from_points(points)
    assert (curve.points[0][0], curve.points[-1][0]) == (0.0, 0.0)
    assert len(curve.repaired) == 1
    assert "was put on it: it is a pole" in curve.repaired[0]
    assert fm.meridian_from_points(points[::-1]).points == curve.points


def test_segments_with_points_of_their_own_are_joined(tmp_path: Path) -> None:
    """Each cell with two own points, moved by round-off of single precision."""
    rng = np.random.default_rng(3)
    points = np.repeat(QUARTER, 2, axis=0)[1:-1]
    points[1:-1] += rng.uniform(-1e-7, 1e-7, points[1:-1].shape)
    k = np.arange(0, 12, 2)
    meshio.Mesh(in_plane(points), [("line", np.stack([k, k + 1], axis=1))]).write(tmp_path / "a.vtu")
    curve = fm.read_meridian(tmp_path / "a.vtu")
    assert np.array(curve.points) == pytest.approx(QUARTER, abs=2e-7)
    assert curve.repaired[0].startswith("5 points were merged with others at the same place (up to")


def test_what_is_small_on_purpose_stays(tmp_path: Path) -> None:
    """Elements graded a million to one, and a hub of a ten-millionth of the size: no two of their points are the same."""
    for mesh, ends in ((fm.disc(64, ratio=1e6), {}), (fm.annulus(1e-7, 256, ratio=1e6), {"first": "hub"})):
        fm.write_meridian(mesh, tmp_path / "a.vtu", curved=False)
        curve = fm.read_meridian(tmp_path / "a.vtu", **ends)
        assert curve.elements == mesh.elements
        assert curve.points[0][0] == mesh.breakpoints()[0]
        assert curve.repaired == ()


def test_the_direction_of_a_curve_does_not_hang_on_round_off() -> None:
    """A ring with a flat top, and a cone of 45 degrees, moved by round-off."""
    square = np.array([[1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 0.0]])
    cone = np.array([[1.0, 0.0], [1.5, 0.5], [2.0, 1.0]])
    for points in (square, cone):
        starts = set()
        for seed in range(8):
            moved = points + np.random.default_rng(seed).uniform(-1e-15, 1e-15, points.shape)
            starts.add(tuple(np.round(fm.meridian_from_points(moved).points[0], 9).tolist()))
        assert len(starts) == 1


# --- Abaqus, in parts


PARTS = """*Heading
 two parts, numbered anew each
*Part, name=Lower
*Node
 1, 0., 0., 0.
 2, 1., 0., 0.
 3, 1., 1., 0.
*Element, type=SAX1
1, 1, 2
2, 2,
3
*Elset, elset=side, generate
 2, 2, 1
*End Part
*Part, name=Upper
*Node
 1, 1., 1., 0.
 2, 1., 2., 0.
 3, 0., 2., 0.
*Element, type=SAX1
1, 1, 2
2, 2, 3
*End Part
*Assembly, name=Assembly
*Instance, name=Lower-1, part=Lower
*End Instance
*Instance, name=Upper-1, part=Upper
*End Instance
*Node
 1, 7., 7., 0.
*Elset, elset=side, instance=Upper-1
 1,
*Nset, nset=n, instance=Upper-1
 1, 2
*End Assembly
*Step
*Static
1., 1.
*End Step
"""


def test_parts_of_abaqus_have_numbers_of_their_own(tmp_path: Path) -> None:
    path = tmp_path / "a.inp"
    path.write_text(PARTS, encoding="utf-8")
    assert fm.read_meridian(path).points == ((0, 2), (1, 2), (1, 1), (1, 0), (0, 0))
    assert fm.read_meridian(path, group="side").points == ((1, 2), (1, 1), (1, 0))


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("part=Upper\n", "part=Upper\n 5., 0., 0.\n", "is moved"),
        ("name=Upper-1, part=Upper", "name=Upper-1, part=Lower", "two instances"),
        ("*Element, type", "*Ngen\n1, 3\n*Element, type", r"\*Ngen"),
        ("*Node\n", "*Node, system=C\n", "moves nodes"),
        ("*Node\n", "*Node, input=nodes.txt\n", "includes another file"),
    ],
)
def test_nodes_of_abaqus_that_are_not_listed_in_place_are_refused(old: str, new: str, told: str, tmp_path: Path) -> None:
    path = tmp_path / "a.inp"
    path.write_text(PARTS.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(fm.InputError, match=told):
        fm.read_meridian(path)


# --- damaged files


def samples(folder: Path) -> list[Path]:
    """A tiny file of each dialect."""
    k = np.arange(6)
    found = [*DATA.glob("gmsh*")]
    for suffix in FORMATS:
        fm.write_meridian(fm.cap(0.5, 4), folder / f"a{suffix}")
        found.append(folder / f"a{suffix}")
    data = polydata(in_plane(QUARTER), [[0, 1, 2], [3, 2], [3, 4, 5, 6]])
    for name, mode, packer in (("a.vtp", "ascii", "None"), ("b.vtp", "raw", "LZ4"), ("c.vtp", "binary", "ZLib"), ("d.vtp", "raw", "LZMA")):
        found.append(vtk_file(folder / name, data, mode, packer))
    for name, mode, version in (("b.vtk", "ascii", 42), ("c.vtk", "binary", 51), ("d.vtk", "ascii", 51)):
        found.append(vtk_file(folder / name, data, mode, version=version))
    (folder / "x").mkdir()
    found.append(dolfinx(folder / "x" / "a.xdmf", QUARTER, np.stack([k, k + 1], axis=1), "PolyLine", STEPS))
    meshio.Mesh(in_plane(QUARTER), [("line", np.stack([k, k + 1], axis=1))]).write(folder / "y.xdmf", data_format="XML")
    return [*found, folder / "y.xdmf", found[-1].with_suffix(".h5")]


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """A file cut off, with bits turned, bytes exchanged for others, a piece left out or repeated, or other digits."""
    out, kind = bytearray(data), rng.integers(6)
    places = rng.integers(0, len(out), 1 + int(rng.integers(8)))
    if kind == 0:
        return bytes(out[: places[0]])
    for place in places.tolist():
        if kind == 1:
            out[place] ^= 1 << int(rng.integers(8))
        elif kind == 2:
            out[place] = int(rng.integers(256))
    if kind == 3:
        low, high = sorted(rng.integers(0, len(out), 2).tolist())
        del out[low:high]
    elif kind == 4:
        low = int(places[0])
        out[low:low] = out[low : low + 40] * int(rng.integers(1, 5))
    elif kind == 5:
        digits = [k for k, byte in enumerate(out) if chr(byte).isdigit()]
        for place in rng.choice(digits, min(3, len(digits)), replace=False).tolist() if digits else []:
            out[place : place + 1] = str(int(rng.integers(10 ** int(rng.integers(1, 13))))).encode()
    return bytes(out)


def _refusal(path: Path) -> fm.InputError | None:
    """Why a file is refused; None if it is read, as a curve."""
    try:
        curve = fm.read_meridian(path)
    except fm.InputError as error:
        return error
    return None if np.isfinite(curve.points).all() else fm.InputError("mesh.points", path, "not finite")


def _fuzz(folder: Path, number: int, capfd: pytest.CaptureFixture[str], seed: int) -> None:
    files = samples(folder)
    rng = np.random.default_rng(seed)
    outcomes = {"read": 0, "refused": 0}
    for k in range(number):
        path = files[k % len(files)]
        whole = path.read_bytes()
        target = folder / "x" / "a.xdmf" if path.suffix == ".h5" else folder / f"damaged{path.suffix}"
        damage = path if path.suffix == ".h5" else target
        damage.write_bytes(damaged(whole, rng))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            error = _refusal(target)
        outcomes["read" if error is None else "refused"] += 1
        if error is not None:
            assert error.key == "mesh.file", (k, error)
            assert 20 < len(error.allowed) < 400, (k, str(error))
            assert "(1)" not in str(error)
            assert str(error).isprintable(), (k, str(error))
        if path.suffix == ".h5":
            path.write_bytes(whole)
    assert min(outcomes.values()) > number / 20, outcomes
    assert capfd.readouterr() == ("", "")


def test_samples_are_read_when_they_are_whole(tmp_path: Path) -> None:
    files = [path for path in samples(tmp_path) if path.suffix != ".h5"]
    assert [path.name for path in files if _refusal(path) is not None] == []
    assert {path.suffix for path in files} == set(READERS)


def test_damaged_files_are_read_or_refused_in_words(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    _fuzz(tmp_path, 300, capfd, seed=1)


@pytest.mark.slow
def test_many_damaged_files(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    _fuzz(tmp_path, 3000, capfd, seed=2)
