"""Pictures and pages in SI units: numbers are those of the labels, and without scales nothing is offered."""

from __future__ import annotations

import re
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

import femmembrane as fm
from femmembrane.errors import InputError
from femmembrane.quantities import SCALED, Units, axis_label, caption, heading_in
from femmembrane.scene.number_units import shown_number
from femmembrane.views import explorer_data, plots
from femmembrane.views.report import report
from tests.cases import disc_scene

#: R0 = 2 cm, T = 0.3 mm, mu = 0.4 MPa: R0^3 = 8 ml, mu T/R0 = 6 kPa, mu T R0^2 = 48 mJ
SCALES = fm.Scales(radius=0.02, thickness=3e-4, shear_modulus=4e5)


@cache
def branch() -> fm.Branch:
    scene = disc_scene(dipole=(20, 4.5), elements=8).replace(scales=SCALES, analysis=fm.Analysis(wrinkling="total"))
    return fm.trace(scene, start=1.0, until={"volume": 8.0})


def test_units_by_hand():
    units = Units.of("si", SCALES)
    chosen = {
        name: (units.unit(name), units.factor(name)) for name in ("volume", "pressure", "center_height", "elastic_energy", "stretch_1")
    }
    assert chosen == {
        "volume": ("ml", pytest.approx(8.0)),
        "pressure": ("kPa", pytest.approx(6.0)),
        "center_height": ("mm", pytest.approx(20.0)),
        "elastic_energy": ("mJ", pytest.approx(48.0)),
        "stretch_1": ("", 1.0),
    }
    assert (axis_label("pressure", units), heading_in("pressure", units)) == ("pressure p in kPa", "p in kPa")
    assert axis_label("pressure", SCALED) == axis_label("pressure")
    assert caption(0.5, 0.25, units=units) == "V = 4 ml  p = 1.5 kPa"
    assert caption(0.5, 0.25) == "V = 0.5  P = 0.25"


def test_the_line_of_a_plot_has_the_numbers_of_its_labels():
    """Measured points in these units can be drawn over it."""
    scaled, si = branch().plot(), branch().plot(units="si")
    assert (si.get_xlabel(), si.get_ylabel()) == ("volume V in ml", "pressure p in kPa")
    lines = [(one.get_xydata(), other.get_xydata()) for one, other in zip(scaled.lines, si.lines, strict=True)]
    assert lines
    for one, other in lines:
        np.testing.assert_allclose(other, one * [8.0, 6.0], rtol=1e-13)


def test_meridians_and_zones_in_millimetres():
    profiles = plots.plot_profiles(branch(), units="si").axes[0]
    assert profiles.get_xlabel() == "radius in mm"
    legend = [text.get_text() for text in profiles.get_legend().get_texts()]
    assert legend[0] == "dipole at height 90 mm"
    assert legend[1].endswith(" kPa")
    assert max(np.nanmax(line.get_xdata()) for line in profiles.lines if line.get_label().startswith("V =")) >= 20.0
    assert any(90.0 in np.asarray(line.get_ydata()) for line in profiles.lines)  # the dipole, at 4.5 R0
    zones = plots.plot_zones(branch(), units="si").axes[0]
    assert (zones.get_xlabel(), zones.get_ylabel()) == ("volume V in ml", "reference radius r in mm")
    assert zones.get_ylim() == pytest.approx((0, 20))
    assert zones.get_xlim() == pytest.approx((8.0, 64.0))


def test_a_report_in_si_units():
    page = report(branch(), units="si")
    for text in ("pressure p in kPa", '<th scope="col" class="number">p in kPa</th>', "Cauchy stresses in kPa"):
        assert text in page
    (point,) = [p for p in branch().special_points if p.kind == "limit_point"][:1]
    assert f"{6.0 * point.pressure:.6g}" in re.sub("−", "-", page)  # noqa: RUF001
    assert "kPa" not in report(branch())


@pytest.mark.parametrize("draw", [fm.Branch.plot, plots.plot_profiles, plots.plot_zones, report])
def test_without_scales_si_units_are_refused(draw):
    bare = fm.inflate(disc_scene(elements=4), volumes=[1.0])
    with pytest.raises(InputError, match=r"units = 'si': the scene has no \[scales\]"):
        draw(bare, units="si")
    with pytest.raises(InputError, match="units = 'SI': unknown; known: scaled, si"):
        draw(bare, units="SI")


def test_a_sweep_in_si_units(tmp_path):
    scene = disc_scene(elements=4).replace(scales=SCALES, run=fm.Run(control="volume", values=[1.0, 2.0]))
    sweep = fm.sweep(scene, {"mesh.degree": [1, 2]}, quantity="run", workers=1)
    data = sweep.to_xarray()
    np.testing.assert_allclose(data["pressure_pa"], 6000 * data["pressure"], rtol=1e-14)
    assert data["volume_m3"].attrs == {"long_name": "enclosed volume, signed along the branch", "units": "m^3"}
    axes = sweep.plot(show=["pressure.0"], units="si").axes[0]
    assert axes.get_ylabel() == "step 1: pressure p in kPa"
    np.testing.assert_allclose(axes.lines[0].get_ydata(), 6 * data["pressure"][:, 0], rtol=1e-14)
    thicker = fm.sweep(scene, {"scales.thickness": [3e-4, 6e-4]}, quantity="run", workers=1)
    assert "pressure_pa" not in thicker.to_xarray()
    with pytest.raises(InputError, match="units = 'si'"):
        thicker.plot(units="si")


def test_a_page_shows_each_quantity_once_and_names_bodies_in_its_units():
    """A plate at 0.5 R0 is one at 10 mm; its force is in mN or N, and not a second time in the column for programs."""
    scene = fm.Scene(fm.NeoHookean(), mesh=fm.disc(8), obstacles=[fm.Plane(0.5)], scales=SCALES)
    run = fm.inflate(scene, volumes=[0.4, 1.2])
    in_mm, scaled = (explorer_data.page_data(run, units) for units in ("si", "scaled"))
    assert [body["label"] for body in in_mm["bodies"]] == ["plane at height 10 mm"]
    assert [body["label"] for body in scaled["bodies"]] == ["plane at height 0.5"]
    names = {one["name"]: one["label"] for one in in_mm["quantities"]}
    assert names["contact_force"].startswith("force on bodies in ")
    assert not names.keys() & {"contact_force_n", "volume_m3", "pressure_pa", "least_gap_m"}
    assert "volume_m3" in {one["name"] for one in scaled["quantities"]}


def test_heights_of_a_flat_shape_do_not_cover_each_other():
    scene = fm.Scene(fm.NeoHookean(), mesh=fm.disc(8), scales=SCALES)
    figure = plots.plot_profiles(fm.inflate(scene, volumes=[0.2, 0.4]), units="si")
    figure.canvas.draw()
    axes = figure.axes[0]
    boxes = [tick.label1.get_window_extent() for tick in axes.yaxis.get_major_ticks() if tick.label1.get_visible()]
    low, high = axes.get_window_extent().intervaly
    shown = sorted(tuple(box.intervaly) for box in boxes if low - 1 <= sum(box.intervaly) / 2 <= high + 1)
    assert len(shown) >= 2
    assert all(below[1] <= above[0] for below, above in pairwise(shown))


def test_numbers_of_a_scene_are_shown_in_si_units():
    """By hand: R0 = 20 mm, mu T R0 = 2.4 N, mu T/R0 = 6 kPa; moments are 4 pi R0^3 sqrt(M mu/mu0) by eq. 33 of the paper."""
    scene = fm.Scene(
        material=fm.NeoHookean(),
        mesh=fm.disc(4),
        sources=[fm.Dipole(4.0, 1.5), fm.Uniform(4.0)],
        obstacles=[fm.Ball(3.0, 0.5)],
        chamber=fm.Chamber(volume=2.0, atmosphere=16.0),
        electric=fm.Electric(voltage=2000.0, relative_permittivity=3.0),
        susceptibility=0.5,
        scales=SCALES,
    )
    units = Units.of("si", SCALES)
    moment = 4 * np.pi * 0.02**3 * np.sqrt(4.0 * 4e5 / 1.25663706e-6)
    flux_density = np.sqrt(4.0 * 4e5 * 1.25663706e-6)
    for key, label, value, shown in (
        ("source.0.height", "height of the source in mm", 1.5, 30.0),
        ("obstacle.0.height", "height of the obstacle in mm", 3.0, 60.0),
        ("obstacle.0.radius", "obstacle.0.radius in mm", 0.5, 10.0),
        ("chamber.volume", "chamber.volume in ml", 2.0, 16.0),
        ("chamber.atmosphere", "chamber.atmosphere in kPa", 16.0, 96.0),
        ("source.0.strength", "strength of the source in A m²", 4.0, moment),
        ("source.1.strength", "strength of the source in T", 4.0, flux_density),
        ("electric.voltage", "voltage in V", 2000.0, 2000.0),
        ("membrane.susceptibility", "susceptibility χ", 0.5, 0.5),
    ):
        found = shown_number(scene, key, units)
        assert (found.label, float(found.into(value))) == (label, pytest.approx(shown, rel=1e-8)), key
        plain = shown_number(scene, key, SCALED)
        assert float(plain.into(value)) == value
        assert " in " not in plain.label or key == "electric.voltage"


def test_axes_over_a_number_are_in_its_unit():
    key, scene = "source.0.height", disc_scene(dipole=(1, 4.5), elements=4).replace(scales=SCALES)
    over = fm.trace(scene, over=key, hold={"pressure": 1.0}, until={key: 3.0}, max_steps=60)
    _, axes = plots.new_figure((4, 3))
    plots.draw_branch(axes, over, across=key, up="pressure", units="si")
    assert axes.get_xlabel() == "height of the source in mm"
    line = next(line for line in axes.lines if len(line.get_xdata()) > 2)
    assert (line.get_xdata()[0], line.get_xdata()[-1]) == (pytest.approx(90.0), pytest.approx(60.0))
    data = explorer_data.page_data(over, "si", shapes=False)
    place = [item["name"] for item in data["quantities"]].index(key)
    assert data["quantities"][place]["label"] == "height of the source in mm"
    _, axes = plots.new_figure((4, 3))
    fm.sweep(scene.replace(run=fm.Run(control="pressure", values=(0.5,))), {key: [4.0, 4.5]}, quantity="run").plot(
        ax=axes, units="si", show=["steps"]
    )
    assert axes.get_xlabel() == "height of the source in mm"
    assert axes.lines[0].get_xdata() == pytest.approx([80.0, 90.0])
