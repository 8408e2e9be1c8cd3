"""Branches with waves around the axis on disk, in notebooks, in space, and from the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.cli import main
from femmembrane.errors import InputError
from femmembrane.results.store import tipped_branch_of
from femmembrane.views.tipped import COLOR, WavySurface
from tests.stability.test_postbuckling import tipping


@pytest.fixture(scope="module")
def upright() -> fm.Branch:
    scene = tipping().replace(analysis=fm.Analysis(stability=("volume",), azimuthal_modes=(1,)))
    return fm.trace(scene, start=0.46, direction=-1, until={"volume": 0.44})


@pytest.fixture(scope="module")
def leaning(upright: fm.Branch) -> fm.TippedBranch:
    point = next(p for p in upright.special_points or () if p.kind == "azimuthal_onset")
    found: fm.TippedBranch = fm.trace(upright.scene, start=point, until={"pressure": 1.885}, max_steps=30)
    assert {eq.harmonics for eq in found} != {4}  # states of different lengths
    return found


def test_a_branch_comes_back_to_the_last_bit(leaning: fm.TippedBranch, tmp_path: Path) -> None:
    leaning.save(tmp_path / "leaning.nc")
    again = fm.load(tmp_path / "leaning.nc")
    assert isinstance(again, fm.TippedBranch)
    assert (again.status, again.message, len(again)) == (leaning.status, leaning.message, len(leaning))
    for name in leaning.columns:
        np.testing.assert_array_equal(again.column(name), leaning.column(name), err_msg=name)
    for one, other in zip(again, leaning, strict=True):
        assert np.array_equal(one.state, other.state)
        assert not one.state.flags.writeable
        assert (one.energy, one.status, one.waves) == (other.energy, other.status, 1)
    assert again[-1].verdict("volume").smallest_eigenvalue == leaning[-1].verdict("volume").smallest_eigenvalue
    assert leaning.special_points
    points = [[(p.kind, p.volume, p.error, p.equilibrium.energy) for p in b.special_points or ()] for b in (again, leaning)]
    assert points[0] == points[1]
    assert again.to_xarray().identical(leaning.to_xarray())
    assert all(variable.attrs["long_name"] != name for name, variable in again.to_xarray().variables.items())


def test_a_file_that_lacks_a_part_is_refused(leaning: fm.TippedBranch, tmp_path: Path) -> None:
    whole = leaning.to_xarray()
    broken = whole.copy(deep=True)
    broken["state"].values[0, 0] = np.nan
    for data in (whole.drop_vars("amplitude"), broken, whole.assign_attrs(waves=2)):
        with pytest.raises(InputError, match="a complete file written by femmembrane"):
            tipped_branch_of(data, "x.nc")
    with pytest.raises(InputError, match="one or more equilibria"):
        fm.TippedBranch(leaning.scene, (), leaning.status, "", ()).save(tmp_path / "none.nc")


def test_a_notebook_shows_its_diagram_and_table(leaning: fm.TippedBranch) -> None:
    page = leaning._repr_html_()
    assert 'alt="Pressure against volume"' in page
    assert f"{len(leaning)} equilibria with waves around the axis" in page
    assert f"{leaning[-1].amplitude:.6g}" in page
    assert "unstable" in page


def test_a_surface_in_space_is_that_of_the_state(leaning: fm.TippedBranch, tmp_path: Path) -> None:
    last = leaning[-1]
    surface = WavySurface.of_tipped(last, 24)
    known = last.surface(24)
    assert surface.box.low == pytest.approx(known["z"].min())
    # what the colour shows: at the pole the shift, at the rim nothing
    assert surface.scalars[0] == pytest.approx(abs(last.shift), rel=1e-12)
    assert np.abs(surface.scalars[surface.revolution.node == surface.revolution.node.max()]).max() < 1e-12
    np.testing.assert_allclose(np.linalg.norm(surface.normals, axis=1), 1.0, rtol=1e-5)
    fm.view(leaning[-2:], movie=tmp_path / "a.gif", size=(120, 90))
    from PIL import Image

    with Image.open(tmp_path / "a.gif") as movie:
        assert movie.n_frames == 2
    for ways, said in (({"color": "zone"}, COLOR), ({"mode": 1}, "axisymmetric")):
        with pytest.raises(InputError, match=said):
            fm.view(leaning, movie=tmp_path / "b.gif", **ways)


def test_the_command_switches_to_it(upright: fm.Branch, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    upright.save(tmp_path / "branch.nc")
    out = tmp_path / "lean"
    words = ["switch", str(tmp_path), "--out", str(out), "--harmonics", "5"]
    assert main([*words, "--until", "center_height=0.316"]) == 0
    said = capfd.readouterr()
    assert " equilibria, written: " in said.out
    found = fm.load(out)
    assert isinstance(found, fm.TippedBranch)
    assert found[-1].center_height == pytest.approx(0.316, rel=1e-9)
    names = {path.name for path in out.iterdir()}
    assert {"branch.nc", "branch.csv", "special_points.csv", "pressure-volume.png", "membrane.pvd", "run.json"} <= names
    assert main(["export", str(out), "--to", "csv"]) == 0
    assert main(["report", str(out)]) == 2
    assert "femmembrane view and export" in capfd.readouterr().err
    assert main(["switch", str(out), "--out", str(tmp_path / "x")]) == 2
    twice = ["--until", "volume=0.46", "--until", "volume=0.44"]
    for wrong, key in (
        (["--point", "9"], "--point"),
        (["--until", "height=1"], "--until"),
        (["--until", "volume=0,42"], "0.42"),
        (twice, "volume was given before"),
    ):
        assert main([*words, *wrong]) == 2
        assert key in capfd.readouterr().err


def test_too_few_harmonics_are_said_without_advice_on_meshes(upright: fm.Branch, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    upright.save(tmp_path / "branch.nc")
    assert main(["switch", str(tmp_path), "--out", str(tmp_path / "lean"), "--harmonics", "2", "--max-steps", "3"]) == 3
    said = capfd.readouterr().err
    assert "raise harmonics. Computed before and kept" in said
    assert "mesh" not in said
