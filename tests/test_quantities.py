"""One table of quantities: everything that is shown or stored is in it, and nobody else writes a label or a unit."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import femmembrane as fm
from femmembrane import quantities
from femmembrane.quantities import ELECTRIC_UNITS, PLACES, QUANTITIES, SI_UNITS, quantity
from femmembrane.results import convergence, cost, grid, table
from femmembrane.results.analyses.wrinkled_zones import ZONE_COLUMNS
from femmembrane.solve.controls import CONTROLS
from tests.cases import disc_scene

PACKAGE = Path(fm.__file__).parent
SCALES = fm.Scales(radius=0.05, thickness=1e-4, shear_modulus=3e5)


@cache
def branch() -> fm.Branch:
    """One that has every column: verdicts, zones, errors, a source, a load and scales."""
    analysis = fm.Analysis(stability=("pressure", "volume"), azimuthal_modes=(1,), wrinkling="total", error_estimates=True)
    scene = disc_scene(dipole=(150, 4.5), elements=8).replace(analysis=analysis, scales=SCALES, loads=(fm.Weight(0.05),))
    return fm.inflate(scene, volumes=[1.0, 1.5])


def test_every_column_can_be_asked_for() -> None:
    """``branch.column`` knows the columns of the table, each with the values that the table has."""
    frame = branch().to_dataframe()
    assert list(frame.columns) == table.columns(branch())
    for name in frame.columns:
        np.testing.assert_array_equal(branch().column(name), frame[name].to_numpy(), err_msg=name)
    assert {"load_energy", "pressure_pa", "error_energy", "fraction_taut", "verdict_pressure", "lambda_n1"} <= set(frame.columns)


def test_whatever_is_stored_is_in_the_table() -> None:
    listed = [*table.columns(branch()), *table.SPECIAL_POINT_COLUMNS, *(f"zone_{name}" for name in ZONE_COLUMNS)]
    listed = [name for name in listed if name != "zone_step"]
    for name in [*listed, *convergence.COLUMNS, *cost.COLUMNS, *convergence.COMPARED, *branch()[0].profile()]:
        assert name in QUANTITIES or quantity(name).meaning != name, name
    for name in grid.DIMENSIONS:
        assert name in QUANTITIES or grid.place_of_variable(name)[0] in PLACES, name
    for name, variable in branch().to_xarray().variables.items():
        assert variable.attrs["long_name"] != name, name
        assert variable.attrs["units"] == quantity(str(name)).unit


@pytest.mark.parametrize("name", [name for name, known in QUANTITIES.items() if known.si])
def test_in_si_units_a_quantity_has_the_unit_of_its_kind(name: str) -> None:
    known = QUANTITIES[name]
    if known.si in ELECTRIC_UNITS:  # which need a permittivity
        assert not SCALES.converts(known.si)
        assert QUANTITIES[quantities.in_si(name)].unit == ELECTRIC_UNITS[known.si]
        return
    assert QUANTITIES[quantities.in_si(name)].unit == SI_UNITS[known.si] == SCALES.units(known.si)
    assert quantities.si_values({name: 2.0}, SCALES) == {quantities.in_si(name): SCALES.to_si(known.si, 2.0)}


def test_words_and_symbols() -> None:
    assert [control.symbol for control in CONTROLS.values()] == [quantities.heading(name) for name in CONTROLS] == ["V", "P", "pole height"]
    assert [quantities.title(name) for name in PLACES] == ["volume V", "pressure P", "pole height"]
    assert quantities.caption(1.23456, -0.5, ",  ") == "V = 1.235,  P = -0.5"
    assert [quantities.written(name, np.pi, 12) for name in PLACES] == ["     3.14159", "   3.1415927", "     3.14159"]
    assert quantities.key_label("source.1.height") == quantities.key_label("source.height") == "height of the source h/R₀"
    assert quantities.key_label("material.mu.1") == "modulus of term 2 over the shear modulus, μ2/μ"
    assert quantities.key_label("mesh.elements") == "mesh.elements"
    assert quantity("lambda_n2").meaning == "smallest eigenvalue, omega^2 rho_m R0^2/mu, azimuthal mode n = 2"
    assert quantity("mode_volume_u").meaning.endswith("axisymmetric shapes under volume control: u")
    assert quantities.typed("verdict_n1", []).dtype.kind == "U"
    assert quantities.typed("negative_directions", []).dtype.kind == "i"


def test_labels_with_units_are_written_once() -> None:
    """A label that says what a quantity is divided by, or a caption with V and P, stands in the table alone."""
    label = re.compile(r"/\(?(R₀|μT)|\bV = \{[^}]*:\.4g\}.*P = ")
    found = [
        f"{path.relative_to(PACKAGE)}: {line.strip()}"
        for path in sorted(PACKAGE.rglob("*.py"))
        if path.name != "quantities.py"
        for line in path.read_text(encoding="utf-8").splitlines()
        if label.search(line)
    ]
    assert found == []
