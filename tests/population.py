"""A population of random scenes, each with a state that certainly exists: what the search for a first state is measured by.

Everything about a member follows from its seed: its scene (:mod:`.random_scenes`), and by a walk along small steps from a state that
certainly exists (:mod:`.walker`) how strong its sources and loads are and which load is asked for. What the walks found is recorded in
data/population.json, so that asking need not walk again. ::

    python -m tests.population ask --count 200       # ask, write what was not answered as code that asks again, and the table
    python -m tests.population record --count 1000   # walk, and write the record of so many members
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import re
import signal
import sys
import time
import warnings
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import femmembrane as fm
from femmembrane.potential import Potential
from tests.random_scenes import Draft, draft, scaled_loads
from tests.walker import Spot, Walker

RECORD = Path(__file__).parent / "data" / "population.json"
#: part by which pressure or volume of a resolved state may change on a finer mesh
RESOLVED = 1e-3
#: and the logarithm of the largest stretch by so much
STEADY = 0.2
#: an answer that moves by more than this on a finer mesh does not count
UNRESOLVED = 3e-2
#: largest pressure times size of a state that is asked for, and largest volume over the cube of the size
HIGHEST, LARGEST = 2e3, 1e4
#: seconds of work after which a question counts as not answered, whatever else the machine does
PATIENCE = 60
#: what a message may not claim of a state that exists
CLAIMS = re.compile(
    r"no tension holds|there is no equilibrium|no equilibrium exists|turned back|no stable state (exists|was met beyond)|nothing holds"
)

# --- the walk -----------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Member:
    """A scene with a load at which a state certainly exists.

    ``minimum`` names the controls under which that state is a minimum, ``exact`` the quantity that was asked to be exactly zero.
    """

    seed: int
    family: str
    factor: float
    volume: float
    pressure: float
    center_height: float
    minimum: tuple[str, ...]
    pole: bool
    exact: str = ""
    gas: tuple[float, float, float] | None = None
    walked: int = 0

    @property
    def draft(self) -> Draft:
        return draft(self.seed)

    @property
    def scene(self) -> fm.Scene:
        return self.draft.scene(self.factor)

    def questions(self) -> Iterator[tuple[str, Any, str]]:
        """(keyword of fm.equilibrium, its value, solver)."""
        for control in ("volume", "pressure"):
            load = getattr(self, control)
            for solver in ("ipopt", "newton"):
                if solver == "newton" or control in self.minimum:
                    yield control, load, solver
                    if load == 0 and self.exact == control:
                        yield control, -0.0, solver
        if self.pole:
            yield "center_height", self.center_height, "newton"
        if self.gas is not None:
            yield "gas", fm.Gas(*self.gas), "newton"


class NoTruthError(Exception):
    """The walk of a draft met no state that can be asked for; the reason is the text."""


def walk(seed: int) -> Member:
    """Find a state of the scene of a seed by a walk.

    Raises
    ------
    NoTruthError
    """
    plan = draft(seed)
    scene = plan.scene()
    walker = Walker(Potential(scene))
    spot = _first(plan, walker)
    factor = 1.0
    if walker.potential.surrounded:
        strongest = walker.turn_on(spot)
        # away from the fold at which the state may have ended
        factor = 1.0 if strongest.factor == 1 else float(f"{0.8 * strongest.factor:.3g}")
        if factor < 0.01:
            raise NoTruthError("sources or loads could not be turned on")
        spot = walker.turn_on(spot, factor)
        scene = plan.scene(factor)
        walker = Walker(Potential(scene))
        found = walker.newton(spot.x, spot.pressure, 1.0, walker.at_volume(spot.volume), damped=True, most=30)
        if found is None:
            raise NoTruthError("the weaker scene was not solved")
        spot = found
    spots = list(_tour(plan, walker, spot))
    place = min(int(plan.share * len(spots)), len(spots) - 1) if plan.task == "branch" else len(spots) - 1
    finer = Walker(Potential(_finer(scene)))
    while True:
        chosen = _polished(plan, walker, spots[place])
        if chosen is not None and _resolved(walker, finer, chosen):
            break
        if place == 0 or plan.task != "branch":
            raise NoTruthError("no state was resolved by the mesh")
        place //= 2
    return _member(plan, walker, chosen, factor, len(spots))


def _first(plan: Draft, walker: Walker) -> Spot:
    """A state without sources and loads, moderately inflated."""
    flat = walker.potential.flat
    tension_field = walker.potential.scene.tension_field
    rest = walker.rest
    for amplitude in (0.25, 0.12, 0.5, 0.06, 0.9):
        shapes = [side * amplitude * walker.size * _outward(walker) for side in (1, -1)]
        volumes = [float(walker.evaluate(x, 0.0, 0.0).volume) for x in shapes]
        larger = 0 if abs(volumes[0]) >= abs(volumes[1]) else 1
        if abs(rest) < 1e-9 * walker.size**3:
            larger = 0 if plan.direction > 0 else 1
        spot = walker.from_foundation(shapes[larger])
        if spot is None or not walker.is_minimum(spot, "volume"):
            continue
        if not walker.taut(spot, 1e-3 if tension_field else 1e-4):
            continue
        if plan.everted and not flat and _mirrors(walker):
            spot = _mirrored(walker, spot)
        return spot
    raise NoTruthError("nothing was inflated")


def _outward(walker: Walker) -> Any:
    """Unit normal, falling off to the ends that are held."""
    space = walker.space
    s = space.interpolation_points()
    tangent = np.stack(space.mesh.tangent(s))
    tangent = tangent / np.hypot(*tangent)
    length = space.ends[-1] - space.ends[0]
    along = (s - space.ends[0]) / length
    fall = np.ones_like(s)
    for support, to_end, pole in zip(space.supports, (along, 1 - along), space.on_axis, strict=False):
        if not pole and support.held:
            fall = fall * np.sin(np.pi / 2 * np.minimum(1.0, to_end / 0.5))
    # towards the axis no farther than it is away
    R = space.mesh.position(s)[0]
    fall = fall * (1 - np.maximum(tangent[1], 0.0) * (1 - np.tanh(R / walker.size)))
    return space.interpolate(-tangent[1] * fall, tangent[0] * fall)


def _mirrors(walker: Walker) -> bool:
    """Whether the image of a state in the plane z = 0 is a state: the ends are a pole and a rim in that plane."""
    space = walker.space
    if len(space.supports) != 2 or not space.on_axis[0] or space.on_axis[1] or space.lids:
        return False
    return bool(abs(space.mesh.position(space.ends[-1:])[1][0]) < 1e-12 * walker.size)


def _mirrored(walker: Walker, spot: Spot) -> Spot:
    space = walker.space
    s = space.interpolation_points()
    u, _, w, _ = space.evaluate(spot.x, s.ravel())
    x = space.interpolate(u.reshape(s.shape), -w.reshape(s.shape) - 2 * space.mesh.position(s)[1])
    image = walker.newton(x, -spot.pressure, spot.factor, walker.at_volume(-spot.volume), damped=True, most=30)
    if image is None:
        raise NoTruthError("the mirror image was not solved")
    return image


def _tour(plan: Draft, walker: Walker, start: Spot) -> Iterator[Spot]:
    """States along the branch, as the draft says."""
    if plan.task == "faint":
        spot, excess = start, start.volume - walker.rest
        last = excess * 10 ** -(2 + 5 * plan.share)
        yield start
        while abs(excess) > abs(last):
            excess = math.copysign(max(abs(excess) / 2, abs(last)), excess)
            x = spot.x * (excess / (spot.volume - walker.rest)) if not walker.potential.flat else spot.x
            guess = [(x, spot.pressure), (spot.x, spot.pressure)]
            solved = (walker.newton(y, p, 1.0, walker.at_volume(walker.rest + excess), damped=True, most=40) for y, p in guess)
            new = next((s for s in solved if s is not None), None)
            if new is None or not walker.taut(new):
                return
            spot = new
            yield new
        return
    direction = plan.direction if abs(walker.rest) < 1e-9 * walker.size**3 else int(math.copysign(1, start.volume))
    if plan.task != "branch":
        direction = -direction if plan.task == "zero volume" else _towards_zero(walker, start)
    elif walker.potential.surrounded and plan.share < 0.3:
        direction = -direction
    yield start
    quantity = {"zero pressure": "pressure", "zero volume": "volume"}.get(plan.task)
    before = start
    for spot in walker.branch(start, direction, 80 if quantity else plan.steps):
        if not (walker.clear(spot) and walker.taut(spot)):
            return
        if abs(spot.volume) > LARGEST * max(walker.size**3, abs(walker.rest)) or abs(spot.pressure) * walker.size > HIGHEST:
            return
        if quantity and getattr(before, quantity) * getattr(spot, quantity) < 0:
            control = walker.at_pressure(0.0) if quantity == "pressure" else walker.at_volume(0.0)
            new = walker.newton(before.x, before.pressure, 1.0, control, damped=True, most=40)
            if new is not None and walker.taut(new):
                yield new
            return
        yield spot
        before = spot


def _towards_zero(walker: Walker, start: Spot) -> int:
    points = [next(iter(walker.branch(start, d, 1)), None) for d in (1, -1)]
    pressures = [abs(p.pressure) if p is not None else math.inf for p in points]
    return 1 if pressures[0] < pressures[1] else -1


def _polished(plan: Draft, walker: Walker, spot: Spot) -> Spot | None:
    """The state at a load of few digits where its branch is regular: the load is a number that someone may have typed."""
    if plan.task == "branch":
        for digits in (4, 8):
            volume = float(f"{spot.volume:.{digits}g}")
            new = walker.newton(spot.x, spot.pressure, spot.factor, walker.at_volume(volume), most=10)
            if new is not None and walker.rms(new.x - spot.x) < 0.02 * walker.size:
                spot = new
                break
    return spot if walker.residual(spot) < 1e-8 and walker.taut(spot) else None


def _finer(scene: fm.Scene) -> fm.Scene:
    mesh: Any = scene.mesh
    return scene.replace(mesh=mesh.with_elements(2 * mesh.elements))


def _resolved(walker: Walker, finer: Walker, spot: Spot) -> bool:
    """Whether the state is there on a mesh of half the size, with about the same pressure at its volume, or volume at its pressure."""
    for control in (finer.at_volume(spot.volume), finer.at_pressure(spot.pressure)):
        other = walker.moved_to(spot, finer, control)
        if other is not None:
            change = abs(other.pressure - spot.pressure) / max(abs(spot.pressure), 1e-9 / walker.size)
            size = abs(other.volume - spot.volume) / max(abs(spot.volume - walker.rest), 1e-12 * walker.size**3)
            small = abs(spot.pressure) * walker.size < 1e-3 and abs(other.pressure - spot.pressure) * walker.size < 1e-5
            steady = abs(_largest_stretch(finer, other) - _largest_stretch(walker, spot)) < STEADY
            return (change < RESOLVED or small) and size < RESOLVED and steady and finer.taut(other)
    return False


def _largest_stretch(walker: Walker, spot: Spot) -> float:
    """Logarithm of the largest stretch: of a needle or a layer that the mesh makes it grows where elements are halved."""
    space = walker.space
    u, u_x, _, w_x = space.at_quadrature(spot.x).reshape(4, *space.R.shape)
    along = np.hypot(space.R_x + u_x, space.Z_x + w_x) / np.hypot(space.R_x, space.Z_x)
    return float(np.log(max(along.max(), (1 + u / space.R).max())))


def _member(plan: Draft, walker: Walker, spot: Spot, factor: float, walked: int) -> Member:
    minimum = tuple(c for c in ("volume", "pressure") if walker.is_minimum(spot, c))
    exact = {"zero pressure": "pressure", "zero volume": "volume"}.get(plan.task, "") if walked > 1 else ""
    volume, pressure = spot.volume, spot.pressure
    if exact == "volume" and abs(volume) < 1e-9 * walker.size**3:
        volume = 0.0
    elif exact == "pressure" and abs(pressure) < 1e-9 / walker.size:
        pressure = 0.0
    else:
        exact = ""
    if plan.task == "branch" and abs(float(f"{volume:.8g}") - volume) <= 1e-13 * abs(volume):
        volume = float(f"{volume:.8g}")
    gas = None
    if plan.share < 0.5 and plan.task == "branch":
        chamber = max(0.0, -volume) + plan.gas[0] * walker.size**3
        atmosphere = max(0.0, -pressure) + plan.gas[1] / walker.size
        gas = ((pressure + atmosphere) * (volume + chamber), chamber, atmosphere)
    pole = bool(walker.space.on_axis.size and walker.space.on_axis[0] and walker.space.pole < walker.n) and not walker.space.lids
    return Member(plan.seed, plan.family, factor, volume, pressure, walker.space.center_height(spot.x), minimum, pole, exact, gas, walked)


# --- asking -------------------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Answer:
    """How a question was answered: right, wrong, refused, crashed, warned, or not in time."""

    member: Member
    control: str
    load: Any
    solver: str
    verdict: str
    text: str
    iterations: int = 0
    seconds: float = 0.0
    other: bool = False

    @property
    def good(self) -> bool:
        return self.verdict == "answered"

    def snippet(self) -> str:
        """Code that asks again."""
        tables = scaled_loads(self.member.draft.tables, self.member.factor)
        scene = f"population.member({self.member.seed}).scene" if "points" in tables["mesh"] else f"fm.Scene.from_dict({tables})"
        solver = "" if self.control in ("center_height", "gas") else f", solver={self.solver!r}"
        load = f"fm.{self.load}" if self.control == "gas" else repr(self.load)
        return f"fm.equilibrium({scene}, {self.control}={load}{solver})"


class _LateError(Exception):
    pass


def _ring(*_: Any) -> None:
    raise _LateError


def ask(member: Member) -> list[Answer]:
    """Every question of a member, cold, with what came of it."""
    return [_ask(member, *question) for question in member.questions()]


def _ask(member: Member, control: str, load: Any, solver: str) -> Answer:
    clock = time.process_time()
    old = signal.signal(signal.SIGPROF, _ring)
    signal.setitimer(signal.ITIMER_PROF, PATIENCE)
    eq, verdict, text = None, "", ""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            how = {} if control in ("center_height", "gas") else {"solver": solver}
            eq = fm.equilibrium(member.scene, **{control: load}, **how)
        except fm.SolveError as error:
            verdict, text = "refused", f"[{error.status.name}] {error}"
            if CLAIMS.search(str(error)):
                verdict = "wrong: false claim"
        except _LateError:
            verdict, text = "late", f"more than {PATIENCE} s"
        except Warning as warning:
            verdict, text = "warned", f"{type(warning).__name__}: {warning}"
        except Exception as error:
            verdict, text = "crashed", f"{type(error).__name__}: {str(error)[:200]}"
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
            signal.signal(signal.SIGPROF, old)
    seconds = time.process_time() - clock
    if eq is None:
        return Answer(member, control, load, solver, verdict, text, seconds=seconds)
    verdict, text, other = judge(member, control, load, solver, eq)
    return Answer(member, control, load, solver, verdict, text, eq.iterations, seconds, other)


def judge(member: Member, control: str, load: Any, solver: str, eq: fm.Equilibrium) -> tuple[str, str, bool]:
    """(verdict, text, whether the walk has another state) of an equilibrium that was returned."""
    scene = member.scene
    walker = Walker(Potential(scene))
    spot = Spot(np.array(eq.state), eq.pressure, 1.0, walker.evaluate(np.array(eq.state), eq.pressure, 1.0))
    size = walker.size
    found = f"V = {eq.volume:.9g}, P = {eq.pressure:.9g} where V = {member.volume:.9g}, P = {member.pressure:.9g} exists"
    if eq.status is not fm.Status.CONVERGED:
        return "refused", f"a state with status {eq.status.name} ({found})", True
    residual = walker.residual(spot)
    if not residual < 1e-8:
        return "wrong: residual", f"{residual:.1e} ({found})", True
    held = {"volume": (eq.volume, size**3), "pressure": (eq.pressure, 1 / size), "center_height": (eq.center_height, size)}
    if control == "gas":
        error = abs(load.pressure(eq.volume) - eq.pressure) / (abs(eq.pressure) + load.atmosphere)
    else:
        error = abs(held[control][0] - load) / (abs(load) + 1e-3 * held[control][1])
    if not error < 1e-8:
        return "wrong: another load", f"by {error:.1e} ({found})", True
    excess = abs(member.volume - walker.rest)
    near = abs(eq.volume - member.volume) <= 1e-5 * excess + 1e-9 * size**3
    near = near and abs(eq.pressure - member.pressure) * size <= 1e-5 * (abs(member.pressure) * size + 1e-6)
    near = near and abs(eq.center_height - member.center_height) <= 1e-5 * (abs(member.center_height) + size)
    if near:
        return "answered", found, False
    if not walker.taut(spot, -1e-8):
        return "wrong: compressed", f"though converged ({found})", True
    if solver == "ipopt" and control in ("volume", "pressure") and not walker.is_minimum(spot, control):
        return "wrong: no minimum", found, True
    finer = Walker(Potential(_finer(scene)))
    equation = {
        "volume": finer.at_volume(eq.volume),
        "pressure": finer.at_pressure(eq.pressure),
        "center_height": finer.at_height(eq.center_height),
        "gas": finer.at_gas(load.amount, load.chamber, load.atmosphere) if control == "gas" else None,
    }[control]
    # next to a fold of what is held the state of the finer mesh may lie beyond it: it is there all the same, at another volume or pressure
    ways = (equation, finer.at_volume(eq.volume), finer.at_pressure(eq.pressure))
    found_there = (there for way in ways if (there := walker.moved_to(spot, finer, way)))
    change = min((_moved(finer, there, eq, walker.rest, control) for there in found_there), default=None)
    if change is None:
        return "wrong: unresolved", f"not there on a finer mesh ({found})", True
    if change > UNRESOLVED:
        return "wrong: unresolved", f"moves by {change:.1e} on a finer mesh ({found})", True
    return "answered", found, True


def _moved(finer: Walker, there: Spot, eq: fm.Equilibrium, rest: float, control: str) -> float:
    """Largest relative change of pressure and volume on a finer mesh, and of the height of the pole where that is what was held."""
    size = finer.size
    pressure = abs(there.pressure - eq.pressure) / (abs(eq.pressure) + 1e-6 / size)
    volume = abs(there.volume - eq.volume) / (abs(eq.volume - rest) + 1e-6 * size**3)
    height = abs(finer.space.center_height(there.x) - eq.center_height) / (abs(eq.center_height) + size)
    return max(pressure, volume, height if control == "center_height" else 0.0)


# --- record and report --------------------------------------------------------------------------------------------------------------


@cache
def recorded(path: Path = RECORD) -> dict[int, Member]:
    """Members by their seeds, as the record has them; seeds without a truth are left out."""
    members = {}
    for row in json.loads(path.read_text(encoding="utf-8")) if path.exists() else []:
        row["minimum"] = tuple(row["minimum"])
        row["gas"] = tuple(row["gas"]) if row.get("gas") else None
        members[row["seed"]] = Member(**row)
    return members


def member(seed: int) -> Member:
    """The member of a seed, from the record or by walking."""
    known = recorded()
    return known[seed] if seed in known else walk(seed)


def record(members: Sequence[Member], path: Path = RECORD) -> None:
    rows = [json.dumps({k: v for k, v in asdict(m).items() if v not in ("", None)}) for m in members]
    path.write_text("[\n" + ",\n".join(rows) + "\n]\n", encoding="utf-8")


@dataclass
class Report:
    """Answers, counted."""

    answers: list[Answer] = field(default_factory=list)

    def table(self) -> str:
        """By families: scenes, questions, how they were answered, iterations and milliseconds (median and 95 of 100) of those answered."""
        titles = ("family", "scenes", "asked", "answered", "refused", "wrong", "crashed", "its", "95%", "ms", "95%")
        groups: dict[str, list[Answer]] = defaultdict(list)
        for answer in self.answers:
            groups[answer.member.family].append(answer)
        rows = [titles, *(self._row(name, group) for name, group in [*sorted(groups.items()), ("all", self.answers)])]
        return "\n".join(f"{row[0]:<12}" + "".join(f"{cell:>10}" for cell in row[1:]) for row in rows)

    def _row(self, name: str, group: Sequence[Answer]) -> tuple[Any, ...]:
        kinds = Counter(a.verdict.split(":")[0] for a in group)
        crashed = kinds["crashed"] + kinds["warned"] + kinds["late"]
        counts = (len({a.member.seed for a in group}), len(group), kinds["answered"], kinds["refused"], kinds["wrong"], crashed)
        work: list[float] = []
        for values in ([a.iterations for a in group if a.good], [1e3 * a.seconds for a in group if a.good]):
            work += [round(float(np.percentile(values or [0], share))) for share in (50, 95)]
        return name, *counts, *work

    @property
    def share(self) -> float:
        """The questions that were answered."""
        return sum(a.good for a in self.answers) / max(len(self.answers), 1)

    @property
    def wrong(self) -> list[Answer]:
        """Answers that are none, and refusals that claim what is not so."""
        return [a for a in self.answers if a.verdict.startswith("wrong")]

    def __str__(self) -> str:
        failed = {a.member.seed for a in self.answers if not a.good}
        scenes = len({a.member.seed for a in self.answers})
        others = sum(a.other for a in self.answers if a.good)
        return (
            f"{self.table()}\n{self.share:.2%} of the questions were answered ({others} by another equilibrium than that of the walk); "
            f"{scenes - len(failed)} of {scenes} scenes had every answer"
        )


def main(arguments: Sequence[str] | None = None) -> int:
    """Walk or ask from the command line."""
    parser = argparse.ArgumentParser(prog="python -m tests.population")
    parser.add_argument("what", choices=["ask", "record"])
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--count", type=int, default=100, help="how many members (record) or seeds (ask)")
    parser.add_argument("--out", type=Path, default=RECORD, help="record: where to write")
    asked = parser.parse_args(arguments)
    if asked.what == "record":
        _record_all(asked.first, asked.count, asked.out)
        return 0
    report = Report()
    members = [recorded()[seed] for seed in range(asked.first, asked.first + asked.count) if seed in recorded()]
    if not members:
        last = asked.first + asked.count - 1
        parser.error(f"no seed from {asked.first} to {last} is recorded in {RECORD.name}, whose largest is {max(recorded(), default=None)}")
    for one in members:
        answers = ask(one)
        report.answers += answers
        for a in answers:
            if not a.good:
                sys.stdout.write(f"# seed {one.seed} ({one.family}) {a.verdict}: {a.text}\n{a.snippet()}\n\n")
                sys.stdout.flush()
    sys.stdout.write(f"{report}\n")
    return 0


def _record_all(first: int, count: int, path: Path) -> None:
    members, lost = [], Counter[tuple[str, str]]()
    for seed in itertools.count(first):
        if len(members) == count:
            break
        try:
            members.append(walk(seed))
        except NoTruthError as reason:
            lost[draft(seed).family, str(reason)] += 1
            sys.stderr.write(f"seed {seed} ({draft(seed).family}): {reason}\n")
    record(members, path)
    for (family, reason), count in sorted(lost.items()):
        sys.stderr.write(f"no state to ask for: {family}: {reason}: {count}\n")
    sys.stderr.write(f"{len(members)} members\n")


if __name__ == "__main__":
    sys.exit(main())
