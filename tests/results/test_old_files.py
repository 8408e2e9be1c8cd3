"""Files of earlier versions are read, and what is written says what it means."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.results import store
from tests.cases import disc_scene

OLD = Path(__file__).parents[1] / "data" / "branch-0.1.0.nc"


def test_a_file_of_version_0_1_0() -> None:
    """Numbers as recorded on 2026-11-24; the states give the profiles that stand beside them."""
    xarray = pytest.importorskip("xarray")
    branch = fm.load(OLD)
    assert branch.scene.title == "written by version 0.1.0"
    assert branch.column("volume") == pytest.approx([0.5, 2.7178170676, 7.5115921617], rel=1e-9)
    assert [e.verdict("pressure").word for e in branch] == ["stable", "unstable", "unstable"]
    assert [str(p.kind) for p in branch.special_points or ()] == ["limit_point", "volume_fold"]
    assert branch[0].zones().kinds == ("double", "radial", "taut")
    assert branch[0]._answers["errors", "volume"].pressure.relative == pytest.approx(1.70843e-4, rel=1e-4)
    assert branch.solver == ""
    assert "ipopt" not in branch.cite()
    with xarray.open_dataset(OLD, engine="h5netcdf") as dataset:
        for step, equilibrium in enumerate(branch):
            for name, values in equilibrium.profile().items():
                stored = dataset[name].values if name == "r" else dataset[name].values[step]
                np.testing.assert_allclose(values, stored, rtol=1e-12, atol=1e-14)


def test_an_old_file_is_saved_and_shown(tmp_path: Path) -> None:
    from femmembrane.views.report import report

    branch = fm.load(OLD)
    branch.save(tmp_path / "again.nc")
    again = fm.load(tmp_path / "again.nc")
    assert [e.state.tobytes() for e in again] == [e.state.tobytes() for e in branch]
    assert list(branch.to_dataframe().columns) == list(again.to_dataframe().columns)
    assert "volume fold (dV = 0)" in report(branch)


def test_every_variable_has_a_meaning_and_a_unit() -> None:
    """Of a trace and of a run that snaps, with everything asked for: no name stands for itself."""
    scene = fm.load(OLD).scene
    snapping = disc_scene(elements=8).replace(analysis=scene.analysis)
    branches = [fm.trace(scene, start=0.5, max_steps=3), fm.pressurize(snapping, pressures=[1.8, 1.95], at_limit="jump")]
    for branch in branches:
        dataset = store.to_xarray(branch)
        assert {"lambda_n1", "zone_kind", "error_estimate", "mode_n1_c"} <= set(map(str, dataset.variables))
        for name, variable in dataset.variables.items():
            assert variable.attrs["units"], name
            assert variable.attrs["long_name"] != name, name
    assert "jump_index" in dataset
    assert "trace_sigma" in store.to_xarray(branches[0])
