"""Runs that are killed, interrupted, out of room or not alone: whole files only, nothing lost that can be kept, and --resume goes on.

Every trial starts real processes. A checkpoint is saved after each equilibrium here (every other second by default), so that runs of a
second or two are cut in all their parts: start, computation, checkpoint, results.
"""

from __future__ import annotations

import csv
import errno
import json
import os
import random
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest import mock

import femmembrane as fm
from femmembrane.results import checkpoint, output, store

from .registry import Done, Exit, Family, Number, command

FAMILY = Family(8, "faults")
ROOT = Path(__file__).parents[2]

SCENE = """
[material]
model = "ogden"
mu = [1.4910, 0.0029, -0.0236]
alpha = [1.3, 5.0, -2.0]
[membrane]
susceptibility = 2.5
[[source]]
kind = "dipole"
strength = 200
height = 6.5
[mesh]
elements = 4
[analysis]
stability = ["volume"]
"""
CONTROLS = {
    "volume": "[run]\nstart = 0.5\nstop = 75.0\nsteps = 12\n",
    "pressure": '[run]\ncontrol = "pressure"\nvalues = [0.5, 1.0, 1.5, 1.7, 1.8, 1.85, 1.88, 1.7]\nat_limit = "jump"\n',
    "height": '[run]\ncontrol = "height"\nstart = 0.4\nstop = 4.0\nsteps = 6\n',
    "arc-length": '[run]\ncontrol = "arc-length"\nstart = 0.5\nuntil = {center_height = 1.4}\n',
}
PROGRAM = """
import sys
from femmembrane import cli
from femmembrane.results import checkpoint
checkpoint.PAUSE, checkpoint.SHARE = {pause}, 1e9
sys.exit(cli.main(sys.argv[1:]))
"""


def started(scene: Path, out: Path, *options: str, pause: float = 0.0) -> subprocess.Popen[str]:
    """``femmembrane run`` as a process of its own; nothing here is a terminal."""
    words = [sys.executable, "-W", "error", "-c", PROGRAM.format(pause=pause), "run", str(scene), "--out", str(out), *options]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment, start_new_session=True)


def ended(process: subprocess.Popen[str]) -> Done:
    out, err = process.communicate(timeout=120)
    return Done(process.returncode, out, err)


def resumed(scene: Path, out: Path) -> Done:
    return command("run", str(scene), "--out", str(out), "--resume")


def table(out: Path) -> list[dict[str, str]]:
    """branch.csv but for the seconds."""
    with (out / "branch.csv").open(encoding="utf-8") as file:
        return [{name: cell for name, cell in row.items() if name != "seconds"} for row in csv.DictReader(file)]


def torn(out: Path) -> list[str]:
    """Files of a folder that are not whole, and what does not belong there; a lock and files about to take their places are hidden."""
    bad = []
    for path in sorted(p for p in out.rglob("*") if p.is_file() and not p.name.startswith(".")):
        try:
            if path.suffix == ".nc":
                store.load(path)
            elif path.suffix == ".json":
                json.loads(path.read_text(encoding="utf-8"))
            elif path.suffix in (".vtu", ".pvd"):
                ElementTree.parse(path)
            elif path.suffix == ".csv":
                text = path.read_text(encoding="utf-8")
                if not text.endswith("\n") or len({line.count(",") for line in text.splitlines()}) != 1:
                    raise ValueError("a line is missing")
            elif path.suffix == ".png":
                if not path.read_bytes().endswith(b"IEND\xaeB`\x82"):
                    raise ValueError("no end")
            else:
                raise ValueError("whose is this?")
        except (ValueError, ElementTree.ParseError) as error:
            bad.append(f"{path.name}: {error}")
    return bad


def expect(fact: bool, what: object) -> None:
    if not fact:
        raise AssertionError(str(what))


@contextmanager
def workshop(run: str) -> Iterator[tuple[Path, Path, Path]]:
    """A scene file, a folder for an uninterrupted run, and another one."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scene = folder / "scene.toml"
        scene.write_text(SCENE + run, encoding="utf-8")
        yield scene, folder / "whole", folder / "out"


@FAMILY.case("killed at any moment, arc length, resumed", "the step remembers two points", Number(12), "arc-length", 12, 4, slow=True)
@FAMILY.case("killed at any moment, heights, resumed", "the prediction remembers two points", Number(12), "height", 12, 3, slow=True)
@FAMILY.case("killed at any moment, pressures, resumed", "the membrane snaps on the way", Number(14), "pressure", 14, 2, slow=True)
@FAMILY.case("killed at any moment, volumes, resumed", "the prediction remembers two points", Number(14), "volume", 14, 1, slow=True)
@FAMILY.case("killed three times, heights, resumed", "the prediction remembers two points", Number(3), "height", 3, 5)
def killed(control: str, trials: int, seed: int) -> int:
    """Trials after which every file was whole, and --resume (killed now and then as well) ended with the table of an uninterrupted run."""
    chance = random.Random(seed)
    with workshop(CONTROLS[control]) as (scene, whole, out):
        clock = time.perf_counter()
        done = ended(started(scene, whole, pause=0.1))
        length = time.perf_counter() - clock
        expect(done.succeeded, done)
        good = 0
        for trial in range(trials):
            target = out.with_name(f"out{trial}")
            for options in ((), ("--resume",))[: 1 + trial // 5 % 2]:
                process = started(scene, target, *options, pause=0.1)
                time.sleep(chance.uniform(0.2, 1.0) * length)
                process.kill()
                process.communicate()
                expect((bad := torn(target)) == [], (trial, bad))
            last = resumed(scene, target)
            expect(last.succeeded or (last.code == 0 and "nothing to resume" in last.err), last)
            expect(table(target) == table(whole), f"trial {trial}: another branch")
            expect(not torn(target) and not any(p.name.startswith(".") for p in target.rglob("*")), f"trial {trial}: leftovers")
            expect(not (target / checkpoint.NAME).exists(), f"trial {trial}: a checkpoint is left")
            good += 1
        return good


@FAMILY.case("Ctrl-C, then --resume", "what was computed is kept", Exit(130, "interrupted. Computed before and kept: .*--resume goes on"))
def interrupted() -> Done:
    """The signal comes with the first checkpoint; the partial results are whole, and the run goes on from them."""
    with workshop(CONTROLS["volume"].replace("steps = 12", "steps = 40")) as (scene, _, out):
        process = started(scene, out)
        _wait_for(out / checkpoint.NAME, process)
        os.kill(process.pid, signal.SIGINT)
        done = ended(process)
        expect((bad := torn(out)) == [], bad)
        kept = table(out)
        expect(json.loads((out / output.RECORD).read_text())["status"] == "interrupted" and 0 < len(kept) < 40, len(kept))
        expect(resumed(scene, out).succeeded, "not resumed")
        expect(table(out)[: len(kept)] == kept and len(table(out)) == 40, "another branch")
        return Done(done.code, done.out, re.sub(r"\d+ equilibri\w+", "some equilibria", done.err.replace(str(out), "out")))


@FAMILY.case("two runs into one folder", "each would overwrite the other", Exit(2, "--out = 'out': process .* is writing to it"))
def two_at_once() -> Done:
    """The second is refused, by the number of the first; once that is killed nothing stands in the way."""
    with workshop(CONTROLS["volume"].replace("steps = 12", "steps = 40")) as (scene, _, out):
        first = started(scene, out)
        _wait_for(out / checkpoint.NAME, first)
        second = command("run", str(scene), "--out", str(out))
        first.kill()
        first.communicate()  # which also closes its pipes
        expect(f"process {first.pid} " in second.err, second)
        scene.write_text(SCENE + CONTROLS["volume"], encoding="utf-8")
        expect(command("run", str(scene), "--out", str(out)).succeeded, "the lock of a killed run is in the way")
        words = second.err.replace(str(out), "out").partition(", a folder")[0].split()
        number = words.index("process")
        return Done(second.code, second.out, " ".join([*words[: number + 1], "N", "on this host", *words[words.index("is") :]]) + "\n")


@FAMILY.case("a full disk", "results are lost, or halved", Exit(4, "No space left on device; not written: .*kept in checkpoint.nc"))
def full_disk() -> Done:
    """Every result but the table meets a full disk; there is room for the checkpoint, and --resume writes the rest."""
    with workshop(CONTROLS["volume"]) as (scene, whole, out):
        expect(command("run", str(scene), "--out", str(whole)).succeeded, "the run itself")

        def full(name: str, *_: object) -> None:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        with mock.patch.object(output, "save", full), mock.patch("femmembrane.views.vtk.replace_file", full):
            done = command("run", str(scene), "--out", str(out))
        names = sorted(p.name for p in out.iterdir())
        expect(names == ["branch.csv", "checkpoint.nc", "membrane", "pressure-volume.png"] and not torn(out), names)
        expect(resumed(scene, out).succeeded, "not resumed")
        expect(table(out) == table(whole) and not (out / checkpoint.NAME).exists(), "another branch")
        return Done(done.code, done.out, done.err.replace(str(out), "out"))


@FAMILY.case(
    "files of at most 30 kB", "the writers of libraries see it first", Exit(4, "File too large; not written: branch.nc, .*make room")
)
def no_large_files() -> Done:
    """The limit of the system itself, in a process of its own."""
    with workshop(CONTROLS["volume"]) as (scene, _, out):
        words = [sys.executable, "-c", PROGRAM.format(pause=60.0), "run", str(scene), "--out", str(out)]
        done = subprocess.run(
            words,
            capture_output=True,
            text=True,
            check=False,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (30_000, 30_000)),
        )
        expect((out / "branch.csv").exists() and not torn(out) and not list(out.rglob(".*")), sorted(out.rglob("*")))
        return Done(done.returncode, done.stdout, done.stderr.replace(str(out), "out"))


@FAMILY.case("resumed with another scene", "two branches in one table", Exit(2, "mesh.elements is 5, was 4; run.stop is 70.0, was 75.0"))
def another_scene() -> Done:
    with workshop(CONTROLS["volume"]) as (scene, _, out):
        expect(resumed(scene, out).succeeded, "an empty folder is no obstacle")
        before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
        again = resumed(scene, out)
        expect(again.code == 0 and "nothing to resume" in again.err, again)
        scene.write_text(SCENE.replace("elements = 4", "elements = 5") + CONTROLS["volume"].replace("75.0", "70.0"), encoding="utf-8")
        done = resumed(scene, out)
        expect({path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before, "something was written")
        return done


@FAMILY.case("resumed from every step", "bits are lost on the way to a file", Number(0), *CONTROLS)
def every_step(*controls: str) -> int:
    """Differences between tables of uninterrupted runs and of runs resumed from each of their checkpoints, in memory and from a file."""
    differing = 0
    with tempfile.TemporaryDirectory() as folder:
        for control in controls:
            path = Path(folder) / "scene.toml"
            path.write_text(SCENE + CONTROLS[control], encoding="utf-8")
            scene, kept = fm.Scene.from_toml(path), []
            whole = fm.run(scene, on_checkpoint=kept.append)
            store.save(kept[len(kept) // 2], Path(folder) / "half.nc")
            for branch in (*kept[:: 1 + len(kept) // 12], store.load(Path(folder) / "half.nc")):
                differing += _bits(fm.run(scene, unfinished=branch)) != _bits(whole)
    return differing


def _bits(branch: fm.Branch) -> object:
    points = [(p.kind, p.volume, p.pressure, p.error) for p in branch.special_points or ()]
    rows = [(eq.pressure, eq.volume, eq.iterations, eq.verdict("volume").smallest_eigenvalue, *eq.state) for eq in branch]
    return rows, points, branch.status, branch.message


def _wait_for(path: Path, process: subprocess.Popen[str]) -> None:
    for _ in range(6000):
        if path.exists() or process.poll() is not None:
            return
        time.sleep(0.01)
