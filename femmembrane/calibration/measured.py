"""Tests as the fit sees them: what is held, what is predicted, and how well each column is known."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..checks import is_number
from ..errors import InputError
from ..physics.units import has_unit, in_unit
from ..potential import potential_of
from ..quantities import SI_UNITS
from ..scene import Scene
from .bulge import Bulge, States, meridian_at, pole_stretch
from .laws import Law
from .simple import Simple
from .tables import KINDS, SIMPLE, Table, read_table

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: a column that is exact while the state has another coordinate is known to this part of its size
_EXACT = 1e-6
_PERCENT = re.compile(r"\s*([0-9.eE+-]+)\s*%\s*")
#: ratio of measured to predicted from which on a unit is wrong rather than a number of the scene
_FAR = 300.0


@dataclass(frozen=True)
class Noise:
    """How well a column is known: a part of the value, or a deviation for each row, or an unknown deviation common to all rows."""

    relative: float = 0.0
    deviation: Array | None = None
    unknown: bool = False


@dataclass(frozen=True, eq=False)
class LabTest:
    """A test of a fit with several tests.

    Parameters
    ----------
    data : mapping, DataFrame or path
        Its table.
    scene : Scene, optional
        Where it is another one than that of the fit: of another radius or pre-stretch. Its material plays no part.
    kind : {"bulge", "uniaxial", "planar", "equibiaxial"}, optional
        Left out: what the columns say.
    noise : mapping, float or str, optional
        As for :func:`femmembrane.fit`.
    units : {"scaled", "si"}, optional
        What columns without a unit are, where the scene has scales.

    Examples
    --------
    >>> import femmembrane as fm
    >>> strip = fm.LabTest({"stretch": [1.2, 1.5, 2.0], "nominal_stress": [0.5, 1.05, 1.75]}, kind="uniaxial")
    >>> strip.kind
    'uniaxial'
    """

    data: Any
    scene: Scene | None = None
    kind: str | None = None
    noise: Any = None
    units: str | None = None


@dataclass(eq=False)
class Block:
    """One measured column of a test, or the points of its profiles.

    Attributes
    ----------
    name : str
        Its quantity.
    measured, deviation : ndarray, shape (n,)
    state : ndarray of int, shape (n,)
        Which state of its test each number belongs to.
    rows : ndarray of int, shape (n,)
        Rows of the table.
    noise : Noise
    level : float
        Of an unknown deviation: what residuals say about it.
    """

    name: str
    measured: Array
    state: Index
    rows: Index
    noise: Noise
    deviation: Array
    level: float = 0.0


class Measured:
    """A test: its table, its states, and predictions of its columns.

    Parameters
    ----------
    law : Law
    test : LabTest
    number : int
        Which of the tests it is, for messages.
    """

    def __init__(self, law: Law, test: LabTest, number: int) -> None:
        self.law, self.number = law, number
        self.scene = _scene_of(law, test)
        self.table: Table = read_table(test.data, self.scene.scales, test.units)
        self.notes = list(self.table.notes)
        self.kind, self.stress = _kind(self.table, test.kind)
        self.latent = False
        self.blocks: list[Block] = []
        if self.kind == "bulge":
            self._bulge(test)
        else:
            self._simple(test)
        if not self.blocks:
            raise InputError(
                self.table.name,
                sorted(self.table.columns),
                "beside what is held a column is allowed that can be predicted, such as 'pressure'",
            )

    @property
    def name(self) -> str:
        return self.table.name if self.table.name != "data" or self.number == 0 else f"data[{self.number}]"

    @property
    def count(self) -> int:
        """Number of states."""
        return len(self.targets)

    # --- what there is

    def _simple(self, test: LabTest) -> None:
        columns = self.table.columns
        for name in ("stretch", self.stress):
            if name not in columns:
                raise InputError(self.table.name, sorted(columns), f"columns 'stretch' and {self.stress!r} are allowed for a simple test")
        self.predictor: Any = Simple(self.law, self.kind)
        stretch, stress = columns["stretch"], columns[self.stress]
        wrong = np.flatnonzero((stretch - 1) * stress < 0)
        if wrong.size:
            row = int(wrong[0])
            raise InputError(
                self.table.where(row, self.stress), self.table.shown(row, self.stress), "a stress with the sign of stretch - 1 is allowed"
            )
        kept = self._informative((stretch != 1) | (stress != 0), "stretch")
        self.target = "stretch"
        self.targets = stretch[kept]
        state = np.arange(len(kept))
        noise = self._noise(test, ("stretch", self.stress))
        self._add(self.stress, kept, state, noise.get(self.stress) or Noise(unknown=True))
        self._held("stretch", kept, state, noise.get("stretch"))

    def _bulge(self, test: LabTest) -> None:
        columns = self.table.columns
        potential = potential_of(self.scene)
        has_height = potential.space.pole < potential.space.n_free
        if "center_height" in columns and not has_height:
            raise InputError(
                self.table.name, "center_height", f"the first end of this {self.scene.mesh.shape} is held along the axis; give volumes"
            )  # type: ignore[attr-defined]
        self.target = "center_height" if has_height and ("center_height" in columns or "volume" not in columns) else "volume"
        self.predictor = Bulge(self.law, self.scene, self.target)
        scalars = [n for n in ("pressure", "center_height", "volume", "pole_stretch") if n in columns]
        profile = "r" in columns or "z" in columns
        if profile and not {"r", "z"} <= columns.keys():
            raise InputError(self.table.name, sorted(columns), "points of a profile have both 'r' and 'z'")
        if not scalars or (len(scalars) < 2 and not profile):
            allowed = (
                "two of pressure, center_height, volume and pole_stretch, or one of them with points r and z of the profile, are allowed"
            )
            raise InputError(self.table.name, sorted(columns), allowed)
        self._check_signs(columns)
        numbers = columns.get("state", np.arange(len(self.table), dtype=float))
        values, firsts, states = np.unique(numbers, return_index=True, return_inverse=True)
        if "state" in columns:
            self._check_states(scalars, states, firsts)
        first = firsts if "state" in columns else np.arange(len(self.table))
        first = np.array([r for r in first if self._says_something(columns, scalars, int(r))])
        if not len(first):
            raise InputError(self.table.name, "all rows", "rows away from rest are allowed")
        if len(first) < len(values):
            self.notes.append("rows at rest, which say nothing about the numbers, are left out")
        state = np.arange(len(first))
        noise = self._noise(test, (*scalars, "r", "z", "profile"))
        exact = next((n for n in ("center_height", "volume", "pole_stretch", "pressure") if n in scalars and noise.get(n) is None), None)
        self.targets = self._first_targets(columns, first)
        for name in scalars:
            if name == self.target:
                continue
            found = noise.get(name) or (
                Noise(deviation=np.full(1, _EXACT)) if name == exact and exact != self.target else Noise(unknown=True)
            )
            self._add(name, first, state, found)
        self._held(self.target, first, state, noise.get(self.target) if exact != self.target else None)
        if self.target not in columns:
            self.latent = True
        if profile:
            self._points(columns, numbers, first, noise)
        self._note_order(first)

    def _points(self, columns: Mapping[str, Array], numbers: Array, first: Index, noise: Mapping[str, Noise]) -> None:
        place = {float(numbers[r]): k for k, r in enumerate(first)}
        rows = np.array([r for r in range(len(self.table)) if float(numbers[r]) in place])
        state = np.array([place[float(numbers[r])] for r in rows])
        found = noise.get("profile") or noise.get("z") or noise.get("r") or Noise(unknown=True)
        if "reference_radius" in columns:
            self._add("r", rows, state, noise.get("r") or found)
            self._add("z", rows, state, noise.get("z") or found)
        else:
            self._add("profile", rows, state, found, np.zeros(len(rows)))

    def _add(self, name: str, rows: Any, state: Index, noise: Noise, measured: Array | None = None) -> None:
        rows = np.asarray(rows)
        values = self.table.columns[name][rows] if measured is None else measured
        if noise.deviation is not None:
            spread = np.broadcast_to(noise.deviation, (len(self.table),) if len(noise.deviation) > 1 else (1,))
            noise = Noise(deviation=spread[rows] if len(spread) > 1 else np.full(len(rows), float(spread[0])))
        block = Block(name, values, state, rows, noise, np.ones(len(rows)))
        self.blocks.append(block)
        set_deviation(block, values)
        if not (block.deviation > 0).all():
            k = int(np.flatnonzero(~(block.deviation > 0))[0])
            raise InputError(
                self.table.where(int(rows[k]), name), f"{name}_sd", "a standard deviation > 0 is allowed for what is predicted"
            )

    def _held(self, name: str, rows: Any, state: Index, noise: Noise | None) -> None:
        """What is held is known exactly, or is one more measured column."""
        if noise is None or name not in self.table.columns:
            return
        rows = np.asarray(rows)
        if noise.deviation is not None and not noise.deviation.any():
            return
        self.latent = True
        self._add(name, rows, state, noise)

    def _noise(self, test: LabTest, names: Sequence[str]) -> dict[str, Noise]:
        """What is said about each column; nothing about the others."""
        found = {n: Noise(deviation=np.broadcast_to(d, (len(self.table),)).copy()) for n, d in self.table.deviations.items()}
        given = test.noise
        if given is None:
            return found
        if not isinstance(given, Mapping):
            response = next((n for n in names if n == "pressure" or n.endswith("stress")), names[-1])
            given = {response: given}
        for name, value in given.items():
            if name == "stress" and self.stress:
                name = self.stress
            if name not in names:
                raise InputError(
                    "noise",
                    name,
                    f"columns of the table are allowed: {', '.join(n for n in names if n in (*self.table.columns, 'profile'))}",
                )
            found[name] = self._one_noise(name, value)
        return found

    def _one_noise(self, name: str, value: Any) -> Noise:
        key, kind = f"noise[{name!r}]", KINDS.get(name, "length")
        if isinstance(value, str) and (part := _PERCENT.fullmatch(value)):
            number = float(part[1]) / 100
            if not 0 < number < 10:
                raise InputError(key, value, "a part of the value such as '1 %' is allowed")
            return Noise(relative=number)
        if isinstance(value, str) and value == "unknown":
            return Noise(unknown=True)
        if has_unit(value) and self.scene.scales is not None and kind:
            return Noise(deviation=np.array([self.scene.scales.from_si(kind, in_unit(key, value, SI_UNITS[kind])[0])]))
        if is_number(value) and value >= 0:
            column = name if name != "profile" else "z"
            return Noise(deviation=np.array([float(value) * self.table.factors.get(column, 1.0)]))
        raise InputError(
            key, value, "a standard deviation in the unit of the column, a text such as '1 %' or '0.05 kPa', or 'unknown' is allowed"
        )

    def _informative(self, keep: NDArray[np.bool_], what: str) -> Index:
        kept = np.flatnonzero(keep)
        if not kept.size:
            raise InputError(self.table.name, what, "rows away from rest are allowed")
        if kept.size < len(keep):
            self.notes.append("rows at rest, which say nothing about the numbers, are left out")
        return kept

    def _says_something(self, columns: Mapping[str, Array], scalars: Sequence[str], row: int) -> bool:
        return any(columns[n][row] != (1.0 if n == "pole_stretch" else 0.0) for n in scalars) or not self._plain

    @property
    def _plain(self) -> bool:
        """Whether the membrane is flat at rest and only the pressure moves it, so that pressure and height have one sign."""
        scene = self.scene
        return not (scene.sources or scene.loads or scene.electric) and potential_of(scene).flat

    def _check_signs(self, columns: Mapping[str, Array]) -> None:
        if not self._plain:
            return
        for name in ("pressure", "center_height", "volume"):
            if name in columns and (bad := np.flatnonzero(columns[name] < 0)).size:
                row = int(bad[0])
                raise InputError(
                    self.table.where(row, name),
                    self.table.shown(row, name),
                    "a number >= 0 is allowed: this membrane is flat at rest, and only the pressure inflates it",
                )
        for name in ("center_height", "volume"):
            if name in columns and "pressure" in columns:
                bad = np.flatnonzero((columns[name] == 0) & (columns["pressure"] != 0))
                if bad.size:
                    row = int(bad[0])
                    here = self.table.shown(row, "pressure")
                    allowed = f"a flat membrane bears no pressure, and here the pressure is {here:g}; leave the row out"
                    raise InputError(self.table.where(row, name), self.table.shown(row, name), allowed)

    def _check_states(self, scalars: Sequence[str], states: Index, firsts: Index) -> None:
        for name in scalars:
            values = self.table.columns[name]
            other = np.flatnonzero(values != values[firsts[states]])
            if other.size:
                row = int(other[0])
                usual = int(firsts[states[row]])
                allowed = (
                    f"rows of one state have one {name}: {self.table.shown(usual, name):g} as in row {self.table.rows[usual]} is allowed"
                )
                raise InputError(self.table.where(row, name), self.table.shown(row, name), allowed)

    def _note_order(self, first: Index) -> None:
        values = self.targets
        falls = np.flatnonzero(np.diff(values) < 0)
        if falls.size and self.target in self.table.columns:
            row = int(first[falls[0] + 1])
            self.notes.append(f"{self.table.where(row, self.target)}: it falls below the row before; the order of rows plays no part")

    def _first_targets(self, columns: Mapping[str, Array], first: Index) -> Array:
        """Where the states are looked for; the guess from a stretch is that of a neo-Hookean disc."""
        if self.target in columns:
            return columns[self.target][first].astype(float)
        size = float(potential_of(self.scene).space.unit)
        if "pole_stretch" in columns:
            return np.asarray(1.083 * size * np.sqrt(np.maximum(columns["pole_stretch"][first] - 1, 1e-4)))
        if "z" in columns:
            numbers = columns["state"] if "state" in columns else np.arange(len(self.table))
            return np.array([columns["z"][numbers == numbers[r]].max() for r in first])
        if "volume" in columns:
            return columns["volume"][first] / (math.pi * size**2) * 2
        raise InputError(self.table.name, sorted(columns), "heights, volumes or stretches beside the pressure are allowed")

    # --- predictions

    def predict(self, values: Array) -> list[tuple[Array, Array]] | None:
        """Prediction and derivatives, (n,) and (n, p + 1), of every block at the targets; None where there is none."""
        if self.kind != "bulge":
            found = self.predictor.predict(values, self.targets)
            if found is None:
                return None
            return [self._own(block, len(values)) if block.name == "stretch" else found for block in self.blocks]
        states = self.predictor.states(values, self.targets)
        return None if states is None else [self._of_block(block, states, len(values)) for block in self.blocks]

    def _own(self, block: Block, p: int) -> tuple[Array, Array]:
        """The target itself."""
        derivatives = np.zeros((len(block.measured), p + 1))
        derivatives[:, p] = 1.0
        return self.targets[block.state], derivatives

    def _of_block(self, block: Block, states: States, p: int) -> tuple[Array, Array]:
        if block.name == self.target:
            return self._own(block, p)
        columns = {
            "pressure": (states.pressure, states.d_pressure),
            "volume": (states.volume, states.d_volume),
            "center_height": (states.height, states.d_height),
        }
        if block.name in columns:
            value, derivatives = columns[block.name]
            return value[block.state], derivatives[block.state]
        if block.name == "pole_stretch":
            pairs = [pole_stretch(states, int(i)) for i in block.state]
            return np.array([v for v, _ in pairs]), np.stack([d for _, d in pairs])
        return self._of_profile(block, states, p)

    def _of_profile(self, block: Block, states: States, p: int) -> tuple[Array, Array]:
        value, derivatives = np.empty(len(block.state)), np.empty((len(block.state), p + 1))
        for i in np.unique(block.state):
            here = np.flatnonzero(block.state == i)
            rows = block.rows[here]
            if block.name in ("r", "z"):
                s = _places(states, self.table.columns["reference_radius"][rows])
                points, slopes, _ = meridian_at(states, int(i), s)
                axis = 0 if block.name == "r" else 1
                value[here], derivatives[here] = points[axis], slopes[axis]
                continue
            measured = np.stack([self.table.columns["r"][rows], self.table.columns["z"][rows]])
            value[here], derivatives[here] = _distances(states, int(i), measured)
        return value, derivatives


def set_deviation(block: Block, predicted: Array) -> None:
    """Standard deviations of a block by what is predicted; an unknown one keeps its level."""
    noise = block.noise
    if noise.relative:
        size = np.abs(predicted)
        block.deviation = noise.relative * np.maximum(size, 1e-6 * float(size.max(initial=0.0)) + 1e-300)
    elif noise.deviation is not None:
        block.deviation = noise.deviation
    else:
        level = block.level or 0.01 * float(np.abs(block.measured).max(initial=0.0)) or 0.01
        block.deviation = np.full(len(block.measured), level)


def measured_tests(law: Law, data: Any, noise: Any, units: str | None) -> list[Measured]:
    """The tests of a fit."""
    several = isinstance(data, (list, tuple))
    given = list(data) if several else [data]
    if not given:
        raise InputError("data", data, "one test or more are allowed")
    tests = [d if isinstance(d, LabTest) else LabTest(d) for d in given]
    filled = [LabTest(t.data, t.scene, t.kind, noise if t.noise is None else t.noise, units if t.units is None else t.units) for t in tests]
    return [Measured(law, test, k) for k, test in enumerate(filled)]


def _scene_of(law: Law, test: LabTest) -> Scene:
    scene = law.scene if test.scene is None else test.scene
    if not isinstance(scene, Scene):
        raise InputError("scene", scene, "a Scene is allowed")
    if scene is law.scene:
        return scene
    own, other = law.scene.scales, scene.scales
    if (own is None) != (other is None):
        raise InputError("scene.scales", other, "scales for the scenes of all tests, or for none, are allowed")
    if own is not None and other is not None and own.shear_modulus != other.shear_modulus:
        scene = scene.replace(scales=dataclasses.replace(other, shear_modulus=own.shear_modulus), material=law.scene.material)
    return scene.replace(material=law.scene.material)


def _kind(table: Table, asked: str | None) -> tuple[str, str]:
    """Kind of a test and its column of stress."""
    said = [name for name in SIMPLE if name in table.columns]
    if asked is not None and asked not in ("bulge", *SIMPLE.values()):
        raise InputError("kind", asked, f"bulge, {', '.join(SIMPLE.values())} are allowed")
    if asked == "bulge" or (asked is None and not said and "nominal_stress" not in table.columns):
        if "stretch" in table.columns and "pressure" not in table.columns:
            raise InputError(
                table.name,
                sorted(table.columns),
                "beside 'stretch' a column is allowed that says which test it is, such as 'uniaxial_stress'",
            )
        return "bulge", ""
    if said:
        if len(said) > 1 or (asked is not None and SIMPLE[said[0]] != asked):
            raise InputError(table.name, said, "one stress in a table is allowed, that of its own test; give several tables")
        return SIMPLE[said[0]], said[0]
    if asked is None:
        allowed = (
            "which test it is must be said: 'uniaxial_stress', 'planar_stress' or 'equibiaxial_stress' is allowed, or LabTest(..., kind=)"
        )
        raise InputError(table.name, table.headers["nominal_stress"], allowed)
    return asked, "nominal_stress"


def _places(states: States, radii: Array) -> Array:
    """Parameters of the meridian with these reference radii, from its first end on."""
    mesh = states.space.mesh
    ends = mesh.breakpoints()
    s = np.linspace(ends[0], ends[-1], 8 * len(ends) + 1)
    R = mesh.position(s)[0]
    turn = len(R) if (np.diff(R) > 0).all() else int(np.flatnonzero(np.diff(R) <= 0)[0]) + 1
    if turn < 2 or radii.min() < R[0] - 1e-9 or radii.max() > R[turn - 1] + 1e-9:
        raise InputError(
            "reference_radius",
            float(radii.max()),
            f"radii from {R[0]:.6g} to {R[max(turn - 1, 0)]:.6g} of the membrane at rest are allowed",
        )
    return np.interp(radii, R[:turn], s[:turn])


def _distances(states: States, i: int, measured: Array) -> tuple[Array, Array]:
    """Distances of points from a meridian along its normal, and their derivatives."""
    ends = states.space.mesh.breakpoints()
    s = np.linspace(ends[0], ends[-1], 16 * (len(ends) - 1) + 1)
    curve = meridian_at(states, i, s)[0]
    nearest = np.argmin(((curve[:, None, :] - measured[:, :, None]) ** 2).sum(axis=0), axis=1)
    place = s[nearest]
    for _ in range(6):
        points, _, slopes = meridian_at(states, i, place)
        step = ((measured - points) * slopes).sum(axis=0) / (slopes**2).sum(axis=0)
        place = np.clip(place + step, ends[0], ends[-1])
    points, derivatives, slopes = meridian_at(states, i, place)
    normal = np.stack([-slopes[1], slopes[0]]) / np.hypot(*slopes)
    return ((points - measured) * normal).sum(axis=0), np.einsum("am,amk->mk", normal, derivatives)


def check_units(tests: Sequence[Measured], predictions: Sequence[list[tuple[Array, Array]]]) -> None:
    """Refuse columns that are far from what the scene predicts at the start: a wrong unit.

    Raises
    ------
    InputError
    """
    for test, predicted in zip(tests, predictions, strict=True):
        for block, (value, _) in zip(test.blocks, predicted, strict=True):
            if block.name not in ("pressure", "volume", "uniaxial_stress", "planar_stress", "equibiaxial_stress", "nominal_stress"):
                continue
            with np.errstate(all="ignore"):
                ratio = float(np.median(np.abs(block.measured) / np.abs(value)))
            if not 1 / _FAR < ratio < _FAR and math.isfinite(ratio) and ratio > 0:
                row = int(block.rows[len(block.rows) // 2])
                factor = f"{ratio:.3g}" if ratio > 1 else f"1/{1 / ratio:.3g}"
                near = round(math.log10(ratio) / 3) * 3
                about = (
                    f"about {10.0 ** abs(near):g} times {'what' if near > 0 else 'less than'} "
                    if near and abs(math.log10(ratio) - near) < 1
                    else f"{factor} times what "
                )
                words = {"pressure": "pressures", "volume": "volumes"}.get(block.name, "stresses")
                known = value[len(block.rows) // 2] / test.table.factors[block.name]
                allowed = (
                    f"{words} are {about}this sheet holds with the numbers of the scene ({known:.4g} there): is its unit right? "
                    "If it is, start from a shear modulus in the scene that is near"
                )
                raise InputError(test.table.where(row, block.name), test.table.shown(row, block.name), allowed)


def check_sizes(tests: Sequence[Measured]) -> None:
    """Refuse heights and volumes that no such membrane has: a wrong unit."""
    for test in tests:
        columns = test.table.columns
        if test.kind != "bulge":
            continue
        unit = float(potential_of(test.scene).space.unit)
        for name, size in (("center_height", unit), ("volume", unit**3)):
            if name not in columns:
                continue
            middle = float(np.median(np.abs(columns[name]))) / size
            row = int(np.argsort(np.abs(columns[name]))[len(columns[name]) // 2])
            if middle > _FAR:
                what = "1000 times" if name == "center_height" and middle < 1e5 else f"{middle:.3g} times"
                allowed = f"these are about {what} the size of this membrane; is the unit of the column right?"
                raise InputError(test.table.where(row, name), test.table.shown(row, name), allowed)
            top = float(np.max(np.abs(columns[name]))) / size
            if 0 < top < 1 / _FAR and test._plain and name == "center_height":
                allowed = "the largest is about 1000 times less than a test of this membrane reaches; is the unit of the column right?"
                raise InputError(test.table.where(row, name), test.table.shown(row, name), allowed)


def iterate(tests: Sequence[Measured]) -> Iterator[tuple[Measured, Block]]:
    """All blocks of all tests."""
    for test in tests:
        for block in test.blocks:
            yield test, block
