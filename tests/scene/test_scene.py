"""Scenes: what they accept, what they refuse and in which words, and that files and Python say the same."""

from __future__ import annotations

import copy
import math
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from femmembrane.discretization.meridian import disc
from femmembrane.errors import InputError
from femmembrane.physics.magnetics import Dipole
from femmembrane.physics.materials import NeoHookean, Ogden
from femmembrane.scene import Analysis, Run, Scene

DEMO = Path(__file__).parents[2] / "demos" / "dipole-above.toml"


def plain(**tables):
    """The smallest valid tables, some of them replaced."""
    return {"material": {"model": "neo-hookean"}, **tables}


def dipole(**keys):
    return {"kind": "dipole", "strength": 200, "height": 6.5, **keys}


# --- what is accepted


def test_demo_is_the_scene_of_the_readme():
    expected = Scene(
        material=Ogden(mu=(1.4910, 0.0029, -0.0236), alpha=(1.3, 5.0, -2.0)),
        sources=[Dipole(strength=200, height=6.5)],
        susceptibility=2.5,
        mesh=disc(elements=64),
        degree=2,
        title="Dipole above the membrane",
        run=Run(control="volume", start=0.5, stop=75.0, steps=60),
        analysis=Analysis(stability=["pressure", "volume"]),
    )
    assert Scene.from_toml(DEMO) == expected


def test_defaults():
    scene = Scene.from_dict(plain())
    assert scene == Scene(material=NeoHookean())
    assert (scene.mesh, scene.degree, scene.sources, scene.run) == (disc(elements=64), 2, (), None)


def test_radii_say_how_many_elements_there_are():
    scene = Scene.from_dict(plain(mesh={"radii": [0, 0.25, 1]}))
    assert scene.mesh == disc(radii=np.array([0, 0.25, 1])) == disc(2, radii=(0.0, 0.25, 1.0))
    assert (scene.mesh.elements, scene.to_dict()["mesh"]["radii"]) == (2, [0.0, 0.25, 1.0])
    assert hash(scene.mesh) == hash(disc(radii=[0, 0.25, 1]))


def test_lists_become_tuples_and_scenes_are_hashable():
    scene = Scene(material=NeoHookean(), sources=[Dipole(1, 2)], susceptibility=1, run=Run(values=np.array([0.5, 1])))
    other = Scene(material=NeoHookean(), sources=(Dipole(1, 2),), susceptibility=1.0, run=Run(values=(0.5, 1.0)))
    assert scene == other
    assert hash(scene) == hash(other)
    assert type(scene.susceptibility) is float
    assert all(type(v) is float for v in scene.run.values)


def test_numpy_numbers_are_numbers():
    run = Run(start=np.float64(1), stop=2, steps=np.int32(4))
    scene = Scene(material=NeoHookean(), degree=np.int64(3), radius_to_thickness=np.float32(10), run=run)
    assert type(scene.degree) is int
    assert type(scene.run.steps) is int
    assert type(scene.radius_to_thickness) is float


def test_loads():
    np.testing.assert_array_equal(Run(start=0.5, stop=2, steps=4).loads(), [0.5, 1.0, 1.5, 2.0])
    np.testing.assert_array_equal(Run(control="pressure", values=[2, 1]).loads(), [2.0, 1.0])
    np.testing.assert_array_equal(Run(start=0.5, stop=2, steps=1).loads(), [0.5])


def test_arc_length():
    run = Run(control="arc-length", start=0.5, until={"center_height": 5})
    assert run.until == {"center_height": 5.0}
    assert run.max_steps == 400
    assert hash(run) == hash(Run(control="arc-length", start=0.5, until={"center_height": 5.0}))
    assert run != Run(control="arc-length", start=0.5, until={"volume": 5.0})
    assert pickle.loads(pickle.dumps(run)) == copy.deepcopy(run) == run
    with pytest.raises(InputError, match=r"run\.control = 'arc-length'"):
        run.loads()


def test_replace_checks_anew():
    scene = Scene(material=NeoHookean())
    assert scene.replace(degree=3).degree == 3
    assert scene.degree == 2
    with pytest.raises(InputError, match=r"mesh\.degree = 9"):
        scene.replace(degree=9)
    with pytest.raises(InputError, match="did you mean 'degree'"):
        scene.replace(degre=3)


def test_scenes_are_frozen():
    with pytest.raises(AttributeError):
        Scene(material=NeoHookean()).degree = 3


# --- there and back

numbers = st.floats(-1e3, 1e3)
positive = st.floats(1e-3, 1e3)
heights = positive.flatmap(lambda h: st.sampled_from([h, -h]))
exponents = st.lists(st.sampled_from([-5.0, -2.0, 0.5, 1.3, 2.0, 6.0]), min_size=1, max_size=3)
materials = st.one_of(
    st.just(NeoHookean()), exponents.map(lambda alpha: Ogden(mu=tuple(2 / (len(alpha) * a) for a in alpha), alpha=tuple(alpha)))
)
runs = st.one_of(
    st.none(),
    st.builds(Run, control=st.sampled_from(["volume", "pressure"]), start=numbers, stop=numbers, steps=st.integers(1, 99)),
    st.builds(
        Run,
        control=st.sampled_from(["volume", "pressure"]),
        values=st.lists(numbers, min_size=1, max_size=4),
        solver=st.sampled_from(["ipopt", "newton"]),
    ),
    st.builds(
        Run,
        control=st.just("arc-length"),
        start=numbers,
        until=st.dictionaries(st.sampled_from(["volume", "pressure", "center_height"]), numbers, min_size=1, max_size=1),
        max_steps=st.integers(1, 999),
    ),
)
analyses = st.builds(
    Analysis,
    stability=st.lists(st.sampled_from(["pressure", "volume"]), unique=True),
    azimuthal_modes=st.lists(st.integers(1, 20), unique=True, max_size=3),
    wrinkling=st.sampled_from([None, "total", "mechanical"]),
    error_estimates=st.booleans(),
    extra=st.lists(st.sampled_from(["pole_stretch", "größe"]), unique=True),
)
orientations = st.sampled_from([1, -1])
dipoles = st.builds(Dipole, strength=positive | st.integers(0, 600), height=heights, orientation=orientations)
scenes = st.builds(
    Scene,
    material=materials,
    mesh=st.one_of(
        st.builds(disc, elements=st.integers(1, 500), ratio=st.floats(1e-6, 1e6)),
        st.sets(st.floats(1e-3, 0.999), max_size=9).map(lambda inner: disc(radii=(0, *sorted(inner), 1))),
    ),
    degree=st.integers(1, 8),
    sources=st.lists(dipoles, max_size=3),
    susceptibility=st.floats(0, 10),
    radius_to_thickness=positive,
    title=st.text(st.characters(codec="utf-8", exclude_categories=["Cc"]), max_size=20),
    run=runs,
    analysis=analyses,
)


@given(scene=scenes)
@settings(max_examples=60, deadline=None)
def test_round_trip(scene, tmp_path_factory):
    path = tmp_path_factory.getbasetemp() / "scene.toml"
    scene.to_toml(path)
    for back in (Scene.from_dict(scene.to_dict()), Scene.from_toml(path)):
        assert back == scene
        assert hash(back) == hash(scene)


def test_dictionary_holds_plain_values_only():
    def kinds(value):
        if isinstance(value, dict):
            return set().union({dict}, *(kinds(v) for v in value.values()))
        return set().union({list}, *(kinds(v) for v in value)) if isinstance(value, list) else {type(value)}

    scene = Scene.from_toml(DEMO).replace(run=Run(control="arc-length", start=np.float64(1), until={"volume": np.float32(2)}))
    assert kinds(scene.to_dict()) <= {dict, list, str, int, float}


def test_own_material_has_no_file():
    class Mine(NeoHookean):
        pass

    with pytest.raises(InputError, match=r"material\.model .* no name in scene files"):
        Scene(material=Mine()).to_dict()


# --- what is refused: tables, the key that the message starts with, a part of the advice

VOLUME = {"control": "volume", "start": 0.5, "stop": 2.0, "steps": 4}
LENGTH = {"control": "arc-length", "start": 0.5, "until": {"volume": 2.0}}
NAN, INF = math.nan, math.inf

REFUSED = [
    # tables and keys
    ({}, "material.model", "missing; known: arruda-boyce, extended-tube, fung, gent, gent-gent, hooke, lopez-pamies"),
    (plain(materal={}), "materal", "did you mean 'material'"),
    (plain(effects={"tension_feild": True}), "effects.tension_feild", "did you mean 'tension_field'?"),
    (plain(effects={"tension_field": 1}), "effects.tension_field", "true or false"),
    (plain(elements=4), "elements", "belongs in [mesh]"),
    (plain(title=3), "title", "text"),
    (plain(title="\ud800"), "title", "text"),
    (plain(mesh={"element": 4}), "mesh.element", "did you mean 'elements'"),
    (plain(mesh={"susceptibility": 4}), "mesh.susceptibility", "belongs in [membrane]"),
    (plain(membrane={"suceptibility": 4}), "membrane.suceptibility", "did you mean 'susceptibility'"),
    (plain(run={**VOLUME, "stepps": 4}), "run.stepps", "did you mean 'steps'"),
    (plain(analysis={"wrinkle": "total"}), "analysis.wrinkle", "did you mean 'wrinkling'"),
    (plain(analysis={"wrinkling": "totl"}), "analysis.wrinkling", "did you mean 'total'"),
    (plain(analysis={"error_estimate": True}), "analysis.error_estimate", "did you mean 'error_estimates'"),
    (plain(analysis={"error_estimates": 1}), "analysis.error_estimates", "true or false"),
    (plain(mesh=4), "mesh", "a table"),
    ({"material": "ogden"}, "material", "a table"),
    # material
    ({"material": {"model": "ogdan"}}, "material.model", "did you mean 'ogden'"),
    ({"material": {"model": 3}}, "material.model", "unknown"),
    ({"material": {"model": ["ogden"]}}, "material.model", "unknown"),
    ({"material": {"model": "ogden", "mu": [1.0]}}, "material.alpha", "missing"),
    ({"material": {"model": "ogden", "mu": [1.0], "alpha": [2.0], "beta": [1]}}, "material.beta", "unknown"),
    ({"material": {"model": "ogden", "mu": [-1.0], "alpha": [2.0]}}, "material.mu[0]", "sign"),
    ({"material": {"model": "ogden", "mu": [1.0, 1.0], "alpha": [2.0]}}, "material.alpha", "as many"),
    ({"material": {"model": "ogden", "mu": [2.0], "alpha": [2.0]}}, "material.mu", "must be 2"),
    ({"material": {"model": "ogden", "mu": 1.0, "alpha": [2.0]}}, "material.mu", "a list"),
    ({"material": {"model": "ogden", "mu": [NAN], "alpha": [2.0]}}, "material.mu", "finite"),
    ({"material": {"model": "ogden", "mu": "1", "alpha": [2.0]}}, "material.mu", "a list"),
    ({"material": {"model": "ogden", "mu": ["1"], "alpha": [2.0]}}, "material.mu", "finite"),
    ({"material": {"model": "ogden", "mu": [True], "alpha": [2.0]}}, "material.mu", "finite"),
    ({"material": {"model": "neo-hookean", "mu": [1.0]}}, "material.mu", "unknown"),
    # membrane
    (plain(source=[dipole()]), "membrane.susceptibility", "2.5"),
    (plain(membrane={"susceptibility": -1}), "membrane.susceptibility", ">= 0"),
    (plain(membrane={"susceptibility": NAN}), "membrane.susceptibility", ">= 0"),
    (plain(membrane={"susceptibility": True}), "membrane.susceptibility", ">= 0"),
    (plain(membrane={"susceptibility": "2.5"}), "membrane.susceptibility", ">= 0"),
    (plain(membrane={"radius_to_thickness": 0}), "membrane.radius_to_thickness", "> 0"),
    (plain(membrane={"radius_to_thickness": INF}), "membrane.radius_to_thickness", "> 0"),
    (plain(membrane={"radius_to_thickness": 10**400}), "membrane.radius_to_thickness", "> 0"),
    # sources
    (plain(source=dipole()), "source", "[[source]]"),
    (plain(source=3), "source", "[[source]]"),
    (plain(source=[3]), "source", "a table"),
    (plain(source=[{"strength": 200, "height": 6.5}]), "source.kind", "dipole"),
    (plain(source=[dipole(kind="dipol")]), "source.kind", "did you mean 'dipole'"),
    (plain(source=[{"kind": "dipole", "strength": 200}]), "source.height", "missing"),
    (plain(source=[dipole(hight=3)]), "source.hight", "did you mean 'height'"),
    (plain(source=[dipole(strength=-1)]), "source.strength", ">= 0"),
    (plain(source=[dipole(strength=True)]), "source.strength", ">= 0"),
    (plain(source=[dipole(height=INF)]), "source.height", "finite"),
    (plain(source=[dipole(height=10**400)]), "source.height", "finite"),
    (plain(source=[dipole(orientation=0)]), "source.orientation", "1 or -1"),
    (plain(source=[dipole(), dipole(height=NAN)]), "source[1].height", "finite"),
    (plain(source=[dipole(), dipole(hight=3)]), "source[1].hight", "did you mean 'height'"),
    (plain(source=[dipole(height=0)], membrane={"susceptibility": 2.5}), "source.height", "on the membrane"),
    (plain(source=[dipole(), dipole(height=-0.0)], membrane={"susceptibility": 2.5}), "source[1].height", "on the membrane"),
    # mesh
    (plain(mesh={"shape": "disk"}), "mesh.shape", "did you mean 'disc'"),
    (plain(mesh={"elements": -4}), "mesh.elements", ">= 1"),
    (plain(mesh={"elements": 4.0}), "mesh.elements", "whole number"),
    (plain(mesh={"elements": True}), "mesh.elements", "whole number"),
    (plain(mesh={"elements": 64, "radii": [0, 0.5, 1]}), "mesh.elements", "contradicts mesh.radii, the ends of 2"),
    (plain(mesh={"ratio": 0}), "mesh.ratio", "from 1e-06 to 1e+06"),
    (plain(mesh={"ratio": 2e6}), "mesh.ratio", "from 1e-06 to 1e+06"),
    (plain(mesh={"ratio": NAN}), "mesh.ratio", "from 1e-06 to 1e+06"),
    (plain(mesh={"ratio": "2"}), "mesh.ratio", "from 1e-06 to 1e+06"),
    (plain(mesh={"ratio": True}), "mesh.ratio", "from 1e-06 to 1e+06"),
    (plain(mesh={"ratio": 2, "radii": [0, 0.5, 1]}), "mesh.ratio", "together with mesh.radii"),
    (plain(mesh={"radii": 0.5}), "mesh.radii", "from 0 (the pole) to 1 (the rim)"),
    (plain(mesh={"radii": "01"}), "mesh.radii", "from 0 (the pole) to 1 (the rim)"),
    (plain(mesh={"radii": []}), "mesh.radii", "from 0 (the pole) to 1 (the rim)"),
    (plain(mesh={"radii": [0.1, 1]}), "mesh.radii", "from 0 (the pole) to 1 (the rim)"),
    (plain(mesh={"radii": [0, 0.9]}), "mesh.radii", "from 0 (the pole) to 1 (the rim)"),
    (plain(mesh={"radii": [0, 0.5, 0.5, 1]}), "mesh.radii[2]", "above the one before (0.5)"),
    (plain(mesh={"radii": [0, "a", 1]}), "mesh.radii[1]", "finite number"),
    (plain(mesh={"radii": [0, INF, 1]}), "mesh.radii[1]", "finite number"),
    (plain(mesh={"degree": 0}), "mesh.degree", "from 1 to 8"),
    (plain(mesh={"degree": 9}), "mesh.degree", "from 1 to 8"),
    (plain(mesh={"degree": 2.0}), "mesh.degree", "from 1 to 8"),
    (plain(mesh={"degree": True}), "mesh.degree", "from 1 to 8"),
    # run
    (plain(run={}), "run.start", "start, stop and steps, or values"),
    (plain(run={**VOLUME, "control": "volumes"}), "run.control", "did you mean 'volume'"),
    (plain(run={**VOLUME, "control": True}), "run.control", "unknown"),
    (plain(run={**VOLUME, "solver": "newtn"}), "run.solver", "did you mean 'newton'"),
    (plain(run={"start": 0.5}), "run.stop", "missing"),
    (plain(run={"start": 0.5, "stop": 2.0}), "run.steps", "missing"),
    (plain(run={"stop": 2.0, "steps": 4}), "run.start", "missing"),
    (plain(run={**VOLUME, "start": NAN}), "run.start", "finite"),
    (plain(run={**VOLUME, "stop": "2"}), "run.stop", "finite"),
    (plain(run={**VOLUME, "stop": False}), "run.stop", "finite"),
    (plain(run={**VOLUME, "steps": 0}), "run.steps", "from 1 to 1000000"),
    (plain(run={**VOLUME, "steps": 4.0}), "run.steps", "whole number"),
    (plain(run={**VOLUME, "values": [1.0]}), "run.start", "run.values"),
    (plain(run={**VOLUME, "until": {"volume": 1.0}}), "run.until", "start, stop and steps"),
    (plain(run={**VOLUME, "max_steps": 10}), "run.max_steps", "arc-length"),
    (plain(run={"values": []}), "run.values", "one or more"),
    (plain(run={"values": 1.0}), "run.values", "a list"),
    (plain(run={"values": "1.0"}), "run.values", "a list"),
    (plain(run={"values": [0.5, INF]}), "run.values[1]", "finite"),
    (plain(run={"values": [0.5, True]}), "run.values[1]", "finite"),
    (plain(run={**LENGTH, "stop": 2.0}), "run.stop", "start and until"),
    (plain(run={**LENGTH, "values": [2.0]}), "run.values", "start and until"),
    (plain(run={**LENGTH, "max_steps": 0}), "run.max_steps", "from 1 to 1000000"),
    (plain(run={**LENGTH, "until": {"height": 2.0}}), "run.until", "center_height"),
    (plain(run={**LENGTH, "until": {"volume": NAN}}), "run.until.volume", "finite"),
    (plain(run={**LENGTH, "until": {}}), "run.until", "one quantity"),
    (plain(run={**LENGTH, "until": 5.0}), "run.until", "one quantity"),
    (plain(run={**LENGTH, "until": {"volume": 2.0, "pressure": 1.0}}), "run.until", "one quantity"),
    (plain(run={"control": "arc-length", "start": 0.5}), "run.until", "missing"),
    (plain(run={"control": "arc-length", "until": {"volume": 2.0}}), "run.start", "missing"),
    # analysis
    (plain(analysis={"stability": ["presure"]}), "analysis.stability[0]", "did you mean 'pressure'"),
    (plain(analysis={"stability": "pressure"}), "analysis.stability", "a list"),
    (plain(analysis={"stability": ["volume", "volume"]}), "analysis.stability", "once"),
    (plain(analysis={"azimuthal_modes": [0]}), "analysis.azimuthal_modes[0]", "from 1 to 1000000"),
    (plain(analysis={"azimuthal_modes": [1, 2.0]}), "analysis.azimuthal_modes[1]", "whole number"),
    (plain(analysis={"azimuthal_modes": [True]}), "analysis.azimuthal_modes[0]", "whole number"),
    (plain(analysis={"azimuthal_modes": 1}), "analysis.azimuthal_modes", "a list"),
    (plain(analysis={"azimuthal_modes": [1, 1]}), "analysis.azimuthal_modes", "once"),
    (plain(analysis={"extra": "pole_stretch"}), "analysis.extra", "a list"),
    (plain(analysis={"extra": [1]}), "analysis.extra[0]", "a list of names"),
    (plain(analysis={"extra": ["a", "a"]}), "analysis.extra", "once"),
]


@pytest.mark.parametrize(("tables", "key", "advice"), REFUSED, ids=[f"{k}-{key}" for k, (_, key, _) in enumerate(REFUSED)])
def test_refused(tables, key, advice):
    with pytest.raises(InputError) as caught:
        Scene.from_dict(tables)
    assert caught.value.key == key
    assert str(caught.value).startswith(f"{key} = ")
    assert advice in caught.value.allowed


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        ({"material": "ogden"}, "material"),
        ({"material": NeoHookean}, "material"),
        ({"mesh": 64}, "mesh"),
        ({"sources": Dipole(1, 2), "susceptibility": 1}, "source"),
        ({"sources": [(1, 2)], "susceptibility": 1}, "source"),
        ({"sources": [Dipole(1, 2)]}, "membrane.susceptibility"),
        ({"sources": [Dipole(1, 0)], "susceptibility": 1}, "source.height"),
        ({"run": {"control": "volume"}}, "run"),
        ({"analysis": ["pressure"]}, "analysis"),
        ({"degree": 0}, "mesh.degree"),
        ({"radius_to_thickness": "1000"}, "membrane.radius_to_thickness"),
        ({"title": None}, "title"),
    ],
)
def test_refused_in_python(arguments, key):
    with pytest.raises(InputError) as caught:
        Scene(**{"material": NeoHookean(), **arguments})
    assert caught.value.key == key


def test_tables_must_be_a_mapping():
    with pytest.raises(InputError, match="a mapping"):
        Scene.from_dict([])


# --- files


@pytest.mark.parametrize(
    ("content", "advice"),
    [
        (b'title = "a"\n[material\n', "line 2"),
        (b'title = "a"\n[material]\nmodel = ', "line 3"),
        (b'title = "a"\r\nmodel = "b\r\n', "line 2"),
        (b"a = 1\na = 2\n", "line 2"),
        (b'title = "a"\n# \xff\n', "not UTF-8 text (line 2)"),
        (b"a = " + b"[" * 5000, "nested"),
        (b"a = " + b"1" * 5000, "TOML"),
    ],
    ids=["table", "end", "windows", "twice", "latin", "nested", "digits"],
)
def test_broken_file(tmp_path, content, advice):
    path = tmp_path / "scene.toml"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        Scene.from_toml(path)
    assert str(path) in str(caught.value.value)
    assert advice in caught.value.allowed


def test_no_file(tmp_path):
    for path in (tmp_path / "none.toml", tmp_path, "a\0b"):
        with pytest.raises(InputError, match="cannot be read"):
            Scene.from_toml(path)


def test_byte_order_mark_is_no_error(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_bytes(b'\xef\xbb\xbf[material]\r\nmodel = "neo-hookean"\r\n')
    assert Scene.from_toml(str(path)) == Scene(material=NeoHookean())


def test_reading_a_scene_imports_no_solver():
    code = (
        "import sys; from femmembrane.scene import Scene; Scene.from_toml(sys.argv[1]); "
        "print([m for m in ('scipy', 'casadi', 'skfem', 'matplotlib', 'xarray', 'cyclopts') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code, str(DEMO)], capture_output=True, text=True, cwd=DEMO.parents[1], check=False)
    assert (done.stdout.strip(), done.stderr) == ("[]", "")
