"""The walls of the house: who may import whom, read off the source."""

from __future__ import annotations

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import femmembrane

PACKAGE = Path(femmembrane.__file__).parent
FILES = sorted(PACKAGE.rglob("*.py"))

#: each room may import those before it, in any way; what is left of the dot names a folder or a module
ROOMS = (
    ("checks", "errors", "memory", "quantities", "threads"),
    ("files", "lock"),
    ("physics",),
    ("discretization",),
    ("kernels",),
    ("origin",),
    ("scene",),
    ("potential",),
    ("solve",),
    ("results",),
    ("stability",),
    ("accuracy",),
    ("calibration",),
    ("views",),
    ("verbs",),
    ("cli", "__main__"),
)
LEVEL = {name: level for level, room in enumerate(ROOMS) for name in room}

#: the only arrows that climb, each with its reason; they are imports inside functions or for type checkers
CLIMBS = {
    ("results/door.py", "stability"): "a record answers questions about itself, such as its verdict",
    ("results/door.py", "accuracy"): "a record estimates its own errors",
    ("results/door.py", "views"): "a record shows itself",
}

#: only there, at any depth of the code
KEPT_IN = {
    "casadi": ("potential/", "solve/minimize.py"),
    "skfem": ("discretization/",),
}
#: only inside functions
HEAVY = (
    *("meshio", "pyvista", "matplotlib", "xarray", "pandas", "dask", "distributed", "vtk", "vtkmodules"),
    *("h5netcdf", "netCDF4", "rich", "tomli_w", "PIL", "imageio", "h5py"),
)


def name_of(path: Path) -> str:
    return path.relative_to(PACKAGE).as_posix()


def imports(path: Path) -> list[tuple[str, bool]]:
    """(absolute name, at module level) of every import; those in functions and for type checkers are not at module level."""
    found: list[tuple[str, bool]] = []
    parts = ("femmembrane", *path.relative_to(PACKAGE).with_suffix("").parts)

    def visit(node: ast.AST, outside: bool) -> None:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            for child in node.body:
                visit(child, False)
            for child in node.orelse:
                visit(child, outside)
            return
        if isinstance(node, ast.Import):
            found.extend((alias.name, outside) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(parts[: len(parts) - node.level]) if node.level else ""
            stem = ".".join(filter(None, (base, node.module)))
            # "from . import x" and "from .room import module" name modules by their last part
            found.extend((f"{stem}.{alias.name}", outside) for alias in node.names)
        inside = isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda))
        for child in ast.iter_child_nodes(node):
            visit(child, outside and not inside)

    visit(ast.parse(path.read_text(encoding="utf-8")), True)
    return found


def arrows(path: Path) -> list[tuple[str, str, bool]]:
    """(room, name, at module level) of what a file imports out of other rooms of the house."""
    parts = [(name.split("."), name, outside) for name, outside in imports(path)]
    return [(p[1], name, outside) for p, name, outside in parts if p[0] == "femmembrane" and len(p) > 1 and p[1] in LEVEL]


def test_there_is_something_to_walk():
    assert {"potential/potential.py", "scene/value.py", "solve/minimize.py", "discretization/space.py"} <= {name_of(f) for f in FILES}
    assert ("casadi", True) in imports(PACKAGE / "potential" / "expressions.py")
    assert any(name.startswith("femmembrane.errors") for name, _ in imports(PACKAGE / "physics" / "materials.py"))


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_libraries_stay_in_their_room(path):
    for name, _ in imports(path):
        library = name.split(".")[0]
        if library in KEPT_IN:
            assert name_of(path).startswith(KEPT_IN[library]), f"{name_of(path)} imports {library}"


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_heavy_libraries_are_imported_inside_functions(path):
    assert [name for name, outside in imports(path) if outside and name.split(".")[0] in HEAVY] == []


@pytest.mark.parametrize("path", [f for f in FILES if f != PACKAGE / "__init__.py"], ids=name_of)
def test_arrows_point_one_way(path):
    """No import points from an earlier room to a later one, be it in a function or for type checkers, but for those in CLIMBS."""
    room = path.relative_to(PACKAGE).with_suffix("").parts[0]
    assert room in LEVEL, f"{room} has no place in the house: add it to ROOMS"
    for other, name, outside in arrows(path):
        climbs = LEVEL[other] > LEVEL[room]
        assert not climbs or (not outside and (name_of(path), other) in CLIMBS), f"{name_of(path)} imports {name}"


def test_no_climb_is_listed_in_vain():
    found = {(name_of(path), room) for path in FILES if path != PACKAGE / "__init__.py" for room, _, _ in arrows(path)}
    assert set(CLIMBS) <= found


def test_public_names_are_imported_when_used():
    """The front door imports nothing of its own (``--help`` need not wait for the numerics)."""
    assert [name for name, outside in imports(PACKAGE / "__init__.py") if outside and name.startswith("femmembrane.")] == []
    assert set(femmembrane.__all__) <= set(dir(femmembrane))
    for name in femmembrane.__all__:
        assert getattr(femmembrane, name) is not None


def test_public_names_are_those_of_the_stub():
    """Each is taken from the module that the stub names, where type checkers look for it; ``import femmembrane`` loads none of them."""
    stub = ast.parse((PACKAGE / "__init__.pyi").read_text(encoding="utf-8"))
    homes = {alias.asname: node.module for node in stub.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert sorted(femmembrane.__all__) == sorted(["__version__", *homes])
    for name, home in homes.items():
        assert getattr(femmembrane, name) is getattr(importlib.import_module(f"femmembrane.{home}"), name)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = femmembrane.nothing
    loaded = [sys.executable, "-c", "import femmembrane, sys; print(*(name for name in sys.modules if name.startswith('femmembrane.')))"]
    assert subprocess.run(loaded, capture_output=True, check=True, text=True).stdout.split() == []


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_library_code_neither_prints_nor_asserts(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert not [node.lineno for node in ast.walk(tree) if isinstance(node, ast.Assert)]
    calls = [node.func for node in ast.walk(tree) if isinstance(node, ast.Call)]
    assert not [c for c in calls if ast.unparse(c) in ("print", "sys.exit", "exit", "quit")]


def test_tests_mirror_the_package():
    """Every folder of tests is a room of the package, or says what else it holds; no two files of tests have the same name."""
    tests = Path(__file__).parent
    folders = {path.parent.name for path in tests.rglob("test_*.py")} - {tests.name, "hard_cases", "verification"}
    rooms = {path.name for path in PACKAGE.iterdir() if path.is_dir()}
    assert len(folders) >= 12
    assert folders <= rooms
    names = [path.name for path in tests.rglob("test_*.py")]
    assert len(names) == len(set(names))
