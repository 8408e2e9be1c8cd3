"""Scene files that cannot be used, made from a seed: each with the key (or the words) that the message must name.

A file begins as one of a few whole scenes and is broken in one place, in a way that is known to be wrong, so that nothing has to be solved:
``femmembrane run`` must end with exit code 2 and one line, within a second, and leave no folder behind.
"""

from __future__ import annotations

import copy
import datetime
import math
import os
import random
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from .registry import Exit, Family, Number, command, run_file

FAMILY = Family(7, "bad input")

OGDEN = {"model": "ogden", "mu": [1.4910, 0.0029, -0.0236], "alpha": [1.3, 5.0, -2.0]}
DIPOLE = {"kind": "dipole", "strength": 200.0, "height": 6.5, "orientation": 1}
VOLUMES = {"control": "volume", "start": 0.5, "stop": 2.0, "steps": 4, "solver": "ipopt", "at_limit": "stop"}
ANALYSIS = {"stability": ["pressure", "volume"], "azimuthal_modes": [1, 2], "wrinkling": "total", "error_estimates": False, "extra": []}
#: whole scenes, between them every key
WHOLE: tuple[dict[str, Any], ...] = (
    {"title": "whole", "material": OGDEN, "membrane": {"susceptibility": 2.5, "radius_to_thickness": 1000}}
    | {"source": [DIPOLE], "mesh": {"shape": "disc", "elements": 4, "degree": 2, "ratio": 1.5}, "run": VOLUMES, "analysis": ANALYSIS},
    {"material": {"model": "neo-hookean"}, "mesh": {"radii": [0.0, 0.5, 1.0]}, "effects": {"tension_field": True}}
    | {"run": {"control": "arc-length", "start": 0.5, "until": {"volume": 2.0}, "max_steps": 40}},
    {"material": OGDEN, "membrane": {"susceptibility": 2.5}, "source": [DIPOLE, DIPOLE | {"height": -3.5}], "mesh": {"accuracy": 1e-3}}
    | {"run": {"control": "pressure", "values": [0.5, 1.0]}},
    {"material": OGDEN, "membrane": {"susceptibility": 2.5}, "source": [{"kind": "dipole", "height": 6.5}], "run": VOLUMES}
    | {"scales": {"radius": 0.05, "thickness": 5e-5, "shear_modulus": 4e5, "dipole_moment": 0.4}},
)

DATE, TIME = datetime.date(2019, 5, 1), datetime.datetime(2019, 5, 1, 7, 32, tzinfo=datetime.UTC)
HUGE = 10**400
TEXTS = ["", "x", "200 kPq", "5 cubits", "1e-3", "größe", "音", "a\nb", "\u202e", "\x07", "y" * 100_000]
#: what is never allowed where the key stands, whatever the scene around it
NOT_A_TABLE = [3, 1.5, True, "x", [], [1, 2], [{"a": 1}], DATE, math.nan]
NOT_A_NUMBER = [*TEXTS, True, [], [1.0], {}, {"a": 1.0}, DATE, TIME, math.nan, math.inf, -math.inf, HUGE, -HUGE]
NOT_POSITIVE = [*NOT_A_NUMBER, -1, -1e-90]
NOT_WHOLE = [*NOT_A_NUMBER, 0, -3, 2.5, 2.0, 1e300]
NOT_A_NAME = [*TEXTS, 3, 1.0, True, [], ["volume"], {}, DATE, math.nan, HUGE]
NOT_A_LIST = [*TEXTS, 3, 1.0, True, {}, DATE, math.nan, HUGE]
NOT_NUMBERS = [*NOT_A_LIST, [], ["1"], [1.0, True], [1.0, math.nan], [math.inf], [[1.0]], [1.0, HUGE], [DATE], [{}]]
NOT_A_SWITCH = [*TEXTS, 0, 1, 1.0, [], {}, DATE, math.nan, HUGE]
WRONG: dict[str, list[Any]] = {
    "title": [3, 1.5, True, [], ["x"], {}, DATE, math.nan],
    **dict.fromkeys(("material", "membrane", "mesh", "run", "analysis", "effects", "scales"), NOT_A_TABLE),
    "source": [3, 1.5, True, "x", [1, 2], [[]], DATE, math.nan, {}, DIPOLE],
    **dict.fromkeys(("material.model", "source.kind", "mesh.shape", "run.control", "run.solver", "run.at_limit"), NOT_A_NAME),
    **dict.fromkeys(("analysis.wrinkling",), NOT_A_NAME),
    **dict.fromkeys(("material.mu", "material.alpha"), NOT_NUMBERS),
    **dict.fromkeys(("run.values",), NOT_NUMBERS),
    "mesh.radii": [*NOT_NUMBERS, [0.0, 1.0, 0.5], [0.1, 1.0], [0.0, 0.5, 0.5, 1.0], [1.0, 0.0]],
    **dict.fromkeys(("membrane.susceptibility", "source.strength"), NOT_POSITIVE),
    **{key: [*NOT_POSITIVE, 0] for key in ("membrane.radius_to_thickness", "scales.radius", "scales.thickness")},
    **{key: [*NOT_POSITIVE, 0] for key in ("scales.shear_modulus", "scales.dipole_moment")},
    "source.height": [*NOT_A_NUMBER, 0, -0.0],
    "source.orientation": [*NOT_A_NUMBER, 0, 2, -1.5],
    **dict.fromkeys(("run.start", "run.stop"), NOT_A_NUMBER),
    **dict.fromkeys(("run.steps", "run.max_steps"), NOT_WHOLE),
    "mesh.elements": [*NOT_WHOLE, 10**30],
    "mesh.degree": [*NOT_WHOLE, 9, 10**30],
    "mesh.ratio": [*NOT_POSITIVE, 0, 1e7, 1e-7],
    "mesh.accuracy": [*NOT_POSITIVE, 0, 0.5, 1e-13],
    "run.until": [
        *NOT_A_LIST,
        [],
        {"volume": 1.0, "pressure": 2.0},
        {"hight": 2.0},
        {"volume": "x"},
        {"volume": math.nan},
        {"volume": HUGE},
    ],
    "analysis.stability": [*NOT_A_LIST[1:], [""], ["presure"], [1], ["volume", "volume"], [["volume"]], [True], [{}]],
    "analysis.azimuthal_modes": [*NOT_A_LIST[1:], [0], [-1], [1.5], ["1"], [True], [1, 1], [[1]], [{}]],
    "analysis.extra": [*NOT_A_LIST[1:], [""], ["unknown"], [1], ["a", "a"], [["a"]], [True], [{}]],
    **dict.fromkeys(("effects.tension_field", "analysis.error_estimates"), NOT_A_SWITCH),
}
#: keys without which nothing can be computed, where they are given, and what is named when they are missing
NEEDED = {
    **{key: key for key in ("material.model", "material.mu", "material.alpha", "membrane.susceptibility", "source.kind", "source.height")},
    **{
        key: key for key in ("scales.radius", "scales.thickness", "scales.shear_modulus", "run.start", "run.stop", "run.steps", "run.until")
    },
    "material": "material.model",
    "membrane": "membrane.susceptibility",
    "run": "run",
}
STRANGE = [
    "",
    " ",
    "größe",
    "音",
    "a.b",
    "a b",
    "a\nb",
    '"',
    "ELEMENTS",
    "Run",
    "z" * 100_000,
    "\u202e",
    "\\",
    "0",
    "-",
    "class",
    "__class__",
]
#: contradictions: scene, key, value, and the key that the message names
CONTRADICTIONS: tuple[tuple[int, str, Any, str], ...] = (
    (0, "run.values", [1.0], "run.start"),
    (0, "run.until", {"volume": 2.0}, "run.until"),
    (0, "run.max_steps", 7, "run.max_steps"),
    (0, "mesh.radii", [0.0, 0.3, 1.0], "mesh.elements"),
    (0, "mesh.accuracy", 1e-3, "mesh."),
    (0, "mesh.estimated", 1e-3, "mesh.estimated"),
    (0, "material.mu", [1.0, 2.0], "material.alpha"),
    (0, "material.mu", [1.0, 1.0, -1.0], "material.mu"),
    (0, "material.mu", [-1.4910, 0.0029, -0.0236], "material.mu[0]"),
    (0, "material.model", "neo-hookean", "material.mu"),
    (1, "material.mu", [1.0], "material.mu"),
    (1, "run.stop", 2.0, "run.stop"),
    (1, "run.values", [2.0], "run.values"),
    (1, "mesh.ratio", 2.0, "mesh.ratio"),
    (1, "scales", {"radius": 0.05, "thickness": 5e-5, "shear_modulus": 4e5, "dipole_moment": 0.4}, "scales.dipole_moment"),
    (2, "mesh.elements", 4, "mesh.elements"),
    (2, "mesh.degree", 2, "mesh.degree"),
    (2, "run.steps", 4, "run.steps"),
    (3, "membrane.radius_to_thickness", 50, "membrane.radius_to_thickness"),
    (3, "scales.radius", 1e308, "scales"),
)
#: valid TOML of other programs, and a key of each that no scene has
FOREIGN = {
    '[build-system]\nrequires = ["hatchling"]\n[project]\nname = "x"\n': "build-system",
    '[package]\nname = "x"\nedition = "2021"\n[dependencies]\nserde = "1.0"\n': "package",
    '[build]\ncommand = "make"\n[[redirects]]\nfrom = "/"\nto = "/a"\n': "build",
    'baseURL = "https://example.org"\ntheme = "ananke"\n[params]\n': "baseURL",
    '[[source]]\nname = "pypi"\nurl = "https://pypi.org/simple"\n[packages]\n': "packages",
    "odt = 1979-05-27T07:32:00Z\n": "odt",
}


@dataclass(frozen=True)
class Broken:
    """What the file holds (or how something else takes its place), and what the message must name."""

    how: str
    named: str
    content: bytes | Callable[[Path], None]


def broken(seed: int, count: int) -> Iterator[Broken]:
    """Broken scene files, as many as are wanted, always the same for a seed."""
    chance = random.Random(seed)
    kinds = [wrong_value] * 8 + [unknown_key] * 3 + [missing_key, contradiction, bad_text, bad_text, bad_bytes, no_file]
    for _ in range(count):
        yield chance.choice(kinds)(chance)


def wrong_value(chance: random.Random) -> Broken:
    tables = copy.deepcopy(chance.choice(WHOLE))
    key = chance.choice([k for k in WRONG if _holder(tables, k) is not None])
    value = chance.choice(WRONG[key])
    several = key.startswith("source.") and len(tables["source"]) > 1
    holder = _holder(tables, key)
    holder[key.rpartition(".")[2]] = value
    named = key.replace("source.", "source[0].") if several else key
    return Broken(f"{key} = {str(value)[:40]}", named, _written(tables))


def unknown_key(chance: random.Random) -> Broken:
    """A strange name, or a known one with a letter too many."""
    tables = copy.deepcopy(chance.choice(WHOLE))
    table = chance.choice(
        ["", *(name for name, value in tables.items() if isinstance(value, dict)), *(["source"] if "source" in tables else [])]
    )
    holder = tables if not table else tables[table][0] if table == "source" else tables[table]
    name = chance.choice([*STRANGE, *(k + chance.choice("sx_-") for k in holder)])
    holder[name] = chance.choice([1, "x", [1.0], {"a": 1}])
    path = f"{table}[0]" if table == "source" and len(tables["source"]) == 2 else table
    full = f"{path}.{name}" if path else name
    return Broken(f"unknown {table}.{name[:20]!r}", " ".join(full[:40].split()), _written(tables))


def missing_key(chance: random.Random) -> Broken:
    tables = copy.deepcopy(chance.choice(WHOLE[:1] + WHOLE[3:]))
    key = chance.choice([k for k in NEEDED if _holder(tables, k) is not None])
    del _holder(tables, key)[key.rpartition(".")[2]]
    return Broken(f"without {key}", NEEDED[key], _written(tables))


def contradiction(chance: random.Random) -> Broken:
    number, key, value, named = chance.choice(CONTRADICTIONS)
    tables = copy.deepcopy(WHOLE[number])
    table, _, name = key.rpartition(".")
    (tables.setdefault(table, {}) if table else tables)[name] = value
    return Broken(f"{key} beside others", named, _written(tables))


def bad_text(chance: random.Random) -> Broken:
    """No TOML, or TOML that is no scene: the message names the place or the key."""
    text = _written(chance.choice(WHOLE)).decode()
    depth = chance.choice([2_000, 20_000, 100_000])
    line = chance.choice([k for k, row in enumerate(text.splitlines()) if "=" in row and "," not in row and "[" not in row])
    rows = text.splitlines()
    name, _, value = rows[line].partition("=")
    cut = "\n".join(
        [*rows[:line], chance.choice([f"{name}=", f"{name}", f"{name} : {value}", f"{name}= “{value}”", f"= {value}", f"{name}=={value}"])]
    )
    foreign = chance.choice(list(FOREIGN))
    where = f"line {line + 1}"
    return chance.choice(
        [
            Broken("cut or mistyped", where, "\n".join([cut, *rows[line + 1 :]]).encode()),
            Broken("ends in the middle", where, cut.encode()),
            Broken("duplicate key", name.strip(), "\n".join([*rows[: line + 1], *rows[line:]]).encode()),
            Broken("duplicate table", "run", (text + "\n[run]\nstart = 1.0\n").encode()),
            Broken(
                "array of tables for a table", "effects", (_written(WHOLE[2]).decode() + "[[effects]]\ntension_field = true\n").encode()
            ),
            Broken("deep list", "nested too deeply", (text + f"\n[other]\na = {'[' * depth}{']' * depth}").encode()),
            Broken("deep table", "nested too deeply", (f"a = {'{a=' * depth}1{'}' * depth}\n" + text).encode()),
            Broken("deep key", "deep", (f"deep{'.a' * 900} = 1\n" + text).encode()),
            Broken("another program's", FOREIGN[foreign], foreign.encode()),
            Broken("no table at all", "material", chance.choice([b"", b"\n\n", b"# only a comment\n", b"\xef\xbb\xbf", b"title = 'x'\n"])),
            Broken("old line ends", "line 1", text.replace("\n", "\r").encode()),
            Broken("a page of the web", "line 1", b"<!DOCTYPE html>\n<html><body>404</body></html>\n"),
            Broken("JSON", "line 1", b'{"material": {"model": "ogden"}}\n'),
            Broken("YAML", "line 1", b"material:\n  model: ogden\n"),
        ]
    )


def bad_bytes(chance: random.Random) -> Broken:
    text = _written(chance.choice(WHOLE))
    at = chance.randrange(len(text))
    return chance.choice(
        [
            Broken("UTF-16", "UTF-8", text.decode().encode("utf-16")),
            Broken("Latin-1", "UTF-8", 'title = "größe"\n'.encode("latin-1") + text),
            Broken("a stray byte", "UTF-8", text[:at] + bytes([chance.randrange(0xF8, 0x100)]) + text[at:]),
            Broken("a null", "line", text[:at].rpartition(b"\n")[0] + b"\n\0\n" + text[at:]),
            Broken("PNG", "UTF-8", b"\x89PNG\r\n\x1a\n" + chance.randbytes(500)),
            Broken("noise", "UTF-8", b"\xff" + chance.randbytes(chance.randrange(1, 5000))),
            Broken("compressed", "UTF-8", b"\x1f\x8b\x08\x00" + chance.randbytes(200)),
            Broken("zeros", "line 1", bytes(chance.randrange(1, 100_000))),
        ]
    )


def no_file(chance: random.Random) -> Broken:
    """Something else in its place; the message names the scene and the reason."""

    def loop(path: Path) -> None:
        path.with_name("other").symlink_to(path)
        path.symlink_to(path.with_name("other"))

    def unreadable(path: Path) -> None:
        path.write_bytes(_written(WHOLE[0]))
        path.chmod(0)

    places = [
        Broken("a folder", "directory", lambda path: path.mkdir()),
        Broken("nothing", "No such file", lambda path: None),
        Broken("a link to nothing", "No such file", lambda path: path.symlink_to("nowhere")),
        Broken("a loop of links", "symbolic links", loop),
        Broken("endless", "larger than", lambda path: path.symlink_to("/dev/zero")),
    ]
    if os.geteuid():  # nothing is unreadable to an administrator
        places.append(Broken("unreadable", "Permission denied", unreadable))
    return chance.choice(places)


def fault(case: Broken, folder: Path) -> str:
    """What is wrong with the answer to a broken file; empty when nothing is."""
    path, out = folder / "scene.toml", folder / "out"
    if isinstance(case.content, bytes):
        path.write_bytes(case.content)
    else:
        case.content(path)
    before = sorted(folder.iterdir())
    clock = time.perf_counter()
    try:
        done = command("run", str(path), "--out", str(out))
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    seconds = time.perf_counter() - clock
    after = sorted(folder.iterdir())
    if done.code != 2 or done.out or done.err.count("\n") != 1:
        return f"exit code {done.code}, printed {done.out[:200]!r} and {done.err[:400]!r}"
    if len(done.err) > 1000:
        return f"a message of {len(done.err)} characters"
    if case.named not in done.err.replace(str(path), "FILE"):
        return f"{case.named!r} is not in {done.err!r}"
    return f"took {seconds:.1f} s" if seconds > 1 else "wrote something" if before != after else ""


def faults(seed: int, count: int) -> list[str]:
    """All that is wrong with the answers to broken files."""
    found = []
    for number, case in enumerate(broken(seed, count)):
        with tempfile.TemporaryDirectory() as folder:
            what = fault(case, Path(folder))
        if what:
            found.append(f"{number}: {case.how}: {what}")
    return found


def _holder(tables: dict[str, Any], key: str) -> Any:
    """The table in which a key stands, None when it does not."""
    table, _, name = key.rpartition(".")
    holder = tables.get(table) if table else tables
    holder = holder[0] if table == "source" and holder else holder
    return holder if holder is not None and name in holder else None


def _written(tables: dict[str, Any]) -> bytes:
    return tomli_w.dumps(tables).encode("utf-8")


@FAMILY.case("10,000 broken scene files", "each ends with code 2 and names its key", Number(0.0), 20261124, 10_000, slow=True)
@FAMILY.case("300 broken scene files", "each ends with code 2 and names its key", Number(0.0), 1, 300)
def broken_files(seed: int, count: int) -> float:
    """How many were answered wrongly; the first of them are the message of the failure."""
    found = faults(seed, count)
    if found:
        raise AssertionError("\n".join([f"{len(found)} of {count}", *found[:10]]))
    return 0.0


@FAMILY.case("volumes beyond all floats", "squares and cubes overflow", Exit(2, r"of a size up to 1e\+30"), "values = [-1e308]")
@FAMILY.case(
    "heights beyond all floats",
    "squares and cubes overflow",
    Exit(2, r"of a size up to 1e\+30"),
    'control = "height"\nvalues = [1.0, 1e300]',
)
@FAMILY.case("the smallest volume", "0 to round-off: the flat disc", Exit(0), "values = [1e-320]")
def command_with(run: str) -> object:
    """Numbers that no computation can use, and one that it takes for 0."""
    return run_file(f'[material]\nmodel = "neo-hookean"\n[mesh]\nelements = 4\n[run]\n{run}\n')


@FAMILY.case("a dipole 1e300 away", "its field is 0/0", Exit(2, r"source.height = 1e.300: .* of a size up to 1e\+30"), 1e300, 200.0)
@FAMILY.case("a dipole of strength 1e300", "the membrane would fall into it", Exit(2, r"of a size up to 1e\+100"), 6.5, 1e300)
def command_with_dipole(height: float, strength: float) -> object:
    dipole = f'[membrane]\nsusceptibility = 2.5\n[[source]]\nkind = "dipole"\nheight = {height}\nstrength = {strength}\n'
    return run_file(f'{dipole}[material]\nmodel = "neo-hookean"\n[mesh]\nelements = 4\n[run]\nvalues = [0.5]\n')
