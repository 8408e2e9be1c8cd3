"""Ctrl-C while a sweep starts its processes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
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


def _places() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
