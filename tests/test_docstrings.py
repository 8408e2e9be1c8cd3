"""The docstrings of the public names: their examples run, and they list every parameter, every error and the source of every formula."""

from __future__ import annotations

import ast
import dataclasses
import doctest
import enum
import inspect
import pkgutil
import re
import textwrap
from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Any

import pytest

import femmembrane as fm
from femmembrane import physics
from femmembrane.discretization.meridian import Meridian
from femmembrane.physics.materials import Material
from femmembrane.solve.controls import Control, Controlled

NAMES = sorted(name for name in fm.__all__ if not name.startswith("_"))
#: what a user meets first: each shows an example
MAIN_NAMES = {
    *("Scene", "disc", "annulus", "cap", "cylinder", "sphere", "torus"),
    *("NeoHookean", "Ogden", "Gent", "StrainEnergy", "Dipole", "Loop", "Hydrostatic", "Scales"),
    *("equilibrium", "inflate", "pressurize", "trace", "fold_curve", "sweep", "convergence", "load", "Equilibrium", "Branch"),
}
#: their methods are described once, for all classes that have them
PROTOCOLS = (Meridian, Material, Control, Controlled)
#: modules of physics without a formula
WITHOUT_FORMULAS = {"outline"}
ERRORS = {"InputError", "SolveError"}
SOURCE = re.compile(r"\b(1[89]|20)\d\d\b|paper eqs?\. ?\d|Saxena")


def examples(name: str) -> list[doctest.DocTest]:
    return [found for found in doctest.DocTestFinder(recurse=True).find(getattr(fm, name), name, globs={}) if found.examples]


def public(name: str) -> Iterator[tuple[str, Callable[..., Any]]]:
    """A public name, and the methods and properties of its own if it is a class."""
    thing = getattr(fm, name)
    yield name, thing
    if inspect.isclass(thing):
        for key, value in vars(thing).items():
            function = getattr(value, "fget", None) or getattr(value, "__func__", value)
            if not key.startswith("_") and inspect.isfunction(function):
                yield f"{name}.{key}", function


CALLABLES = {path: thing for name in NAMES for path, thing in public(name)}


def descriptions(path: str) -> list[str]:
    """The docstrings of a function, or of a method in its class, in the classes before it and in the protocols that it follows."""
    name, _, method = path.partition(".")
    if not method:
        return [inspect.getdoc(CALLABLES[path]) or ""]
    owner = getattr(fm, name)
    followed = [p for p in PROTOCOLS if all(hasattr(owner, key) for key in vars(p) if not key.startswith("_"))]
    places = [vars(place).get(method) for place in (*owner.__mro__, *followed)]
    found = [getattr(place, "fget", None) or getattr(place, "__func__", place) for place in places if place is not None]
    return [inspect.cleandoc(place.__doc__ or "") for place in found]


def section(text: str, title: str) -> str | None:
    """What stands under a heading of numpydoc."""
    found = re.search(rf"^{title}\n-+\n(.*?)(?=^\w[\w ]*\n-+\n|\Z)", text, re.MULTILINE | re.DOTALL)
    return None if found is None else found[1]


def listed(text: str, title: str) -> list[str]:
    lines = (section(text, title) or "").splitlines()
    entries = [line.split(" : ")[0] for line in lines if line and not line.startswith(" ")]
    return [name.strip().lstrip("*") for entry in entries for name in entry.split(",")]


def parameters(thing: Callable[..., Any]) -> list[str]:
    if inspect.isclass(thing) and (issubclass(thing, enum.Enum) or thing is fm.FemmembraneError):
        return []
    names = inspect.signature(thing).parameters
    return [name for name in names if name not in ("self", "cls") and not name.startswith("_")]


def own_code(thing: Callable[..., Any]) -> str:
    """Source of a function; of a class, what runs when it is made."""
    if not inspect.isclass(thing):
        return inspect.getsource(inspect.unwrap(thing))
    makers = [vars(thing)[key] for key in ("__init__", "__post_init__") if key in vars(thing)]
    written = [maker for maker in makers if maker.__code__.co_filename != "<string>"]  # dataclass writes the others
    return "\n".join(textwrap.dedent(inspect.getsource(maker)) for maker in written)


def raised(thing: Callable[..., Any]) -> set[str]:
    """Names of the errors that the code itself raises, functions inside it left out."""
    tree = ast.parse(textwrap.dedent(own_code(thing)))
    inner = {node for part in tree.body for f in ast.walk(part) if isinstance(f, ast.FunctionDef) and f is not part for node in ast.walk(f)}
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Raise) and node not in inner and isinstance(node.exc, ast.Call):
            name = getattr(node.exc.func, "id", "")
            found.add("InputError" if name == "unknown_name" else name)
    return found & ERRORS


@pytest.mark.parametrize("name", sorted(NAMES))
def test_examples_print_what_they_say(name):
    """Every main name has an example; all examples run, and print numbers that are the same on every processor."""
    tests = examples(name)
    assert name not in MAIN_NAMES or any(test.name == name for test in tests)
    runner = doctest.DocTestRunner(verbose=False)
    report: list[str] = []
    for test in tests:
        runner.run(test, out=report.append, clear_globs=True)
    assert runner.failures == 0, "".join(report)
    assert runner.tries == sum(len(test.examples) for test in tests)


def test_main_names_are_public():
    assert set(NAMES) >= MAIN_NAMES


@pytest.mark.parametrize("path", sorted(CALLABLES))
def test_parameters_are_listed(path):
    """All parameters of the signature and no others, in order unless they are given by name alone. Records list them as attributes."""
    thing, wanted = CALLABLES[path], parameters(CALLABLES[path])
    found = [listed(text, title) for text in descriptions(path) for title in ("Parameters", "Attributes")]
    if inspect.isclass(thing) and dataclasses.is_dataclass(thing):
        inherited = [n for base in thing.__mro__[1:] if base.__module__.startswith("femmembrane.results") for n in listed_of(base)]
        assert any(sorted({*names, *inherited}) == sorted(wanted) for names in found), (wanted, found)
    else:
        assert wanted in ([], *found), (wanted, found)


def listed_of(record: type) -> list[str]:
    return listed(inspect.cleandoc(record.__doc__ or ""), "Attributes")


@pytest.mark.parametrize("path", sorted(CALLABLES))
def test_errors_are_announced(path):
    """Under Raises, in the docstring of whatever raises them."""
    sections = " ".join(section(text, "Raises") or "" for text in descriptions(path))
    assert {error for error in raised(CALLABLES[path]) if error not in sections} == set()


MODULES = sorted(m.name for m in pkgutil.iter_modules(physics.__path__) if m.name not in WITHOUT_FORMULAS)


@pytest.mark.parametrize("module", MODULES)
def test_formulas_name_their_source(module):
    """A paper with an equation, or an author with a year."""
    assert SOURCE.search(import_module(f"femmembrane.physics.{module}").__doc__ or "")


def is_material(thing: Any) -> bool:
    return thing.__module__.startswith("femmembrane.physics") and hasattr(thing, "energy")


MATERIALS = [name for name in NAMES if is_material(getattr(fm, name))]


@pytest.mark.parametrize("name", MATERIALS)
def test_materials_name_their_source(name):
    assert SOURCE.search(getattr(fm, name).__doc__)
