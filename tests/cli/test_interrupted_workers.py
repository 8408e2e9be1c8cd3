"""Ctrl-C while a sweep starts its processes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

STARTING = """
import os, signal, sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from femmembrane.verbs import parallel

if __name__ == "__main__":
    for seconds in (0.05, 0.3):
        executor = ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=parallel._begin)
        future = parallel._submit(executor, os.getpid)
        (process,) = executor._processes.values()
        process.join(seconds)
        os.kill(process.pid, signal.SIGINT)
        process.join()
        print(process.exitcode)
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of a POSIX system")
def test_a_process_that_is_interrupted_while_it_starts_says_nothing(tmp_path: Path) -> None:
    """It is sent the signal in the middle of its imports."""
    script = tmp_path / "starting.py"
    script.write_text(STARTING)
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=60, check=False, env=_places())
    assert done.stderr == ""
    assert done.stdout.split() == [str(-signal.SIGINT)] * 2


SCENE = """
[material]
model = "neo-hookean"
[mesh]
elements = 16
[run]
control = "arc-length"
start = 0.5
until = {volume = 20.0}
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of a POSIX system")
def test_a_sweep_that_is_interrupted_three_times_says_one_thing(tmp_path: Path) -> None:
    """As by an impatient hand: the second and third one fall into the end of the processes."""
    (tmp_path / "scene.toml").write_text(SCENE)
    words = ["sweep", "scene.toml", "--over", "membrane.prestretch=1.01:1.5:60", "--workers", "2", "--out", "out"]
    started = subprocess.Popen(
        [sys.executable, "-m", "femmembrane", *words],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=_places(),
        start_new_session=True,
    )
    kept = tmp_path / "out" / "scenes.sqlite-wal"
    while started.poll() is None and not (kept.exists() and kept.stat().st_size > 20_000):
        time.sleep(0.02)
    for _ in range(3):
        os.killpg(started.pid, signal.SIGINT)
        time.sleep(0.1)
    out, said = started.communicate(timeout=60)
    assert (started.returncode, out) == (130, "")
    assert said.count("\n") == 1
    assert "scenes are kept in out: the same command goes on from there" in said


def _places() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
