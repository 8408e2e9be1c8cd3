"""What one redraw of the live explorer costs on this machine, by what it consists of, at several accuracies.

While a slider moves, `femmembrane explore SCENE.toml --live` traces the whole branch anew with both verdicts and sends its curve to the
browser. Rows are medians over several values of the strength of the dipole, taken in turn, in milliseconds of one processor: of the
branch with verdicts and its error, of the curve and the numbers that the page shows, and of their text. The browser takes about 30 ms
more.

    python demos/live.py            five seconds
    python demos/live.py --repeat 31   steadier medians
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import femmembrane as fm
from femmembrane.verbs.live import LiveScene
from femmembrane.views.explorer_data import page_data

ELEMENTS = (8, 16, 32, 64)


def redraw(live: LiveScene, strength: float, elements: int) -> tuple[list[float], float, int]:
    """Milliseconds of branch, page and text; the error of the last pressure, and the number of states."""
    clocks = [time.process_time()]
    answer = live.answer({"source.0.strength": strength}, elements)
    clocks.append(time.process_time())
    data = page_data(answer.branch, shapes=False)
    clocks.append(time.process_time())
    json.dumps(data, separators=(",", ":")).encode()
    clocks.append(time.process_time())
    return [1e3 * (b - a) for a, b in pairwise(clocks)], answer.error, len(answer.branch)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=7, help="redraws of each row")
    parser.add_argument("--out", type=Path, help="is not used: nothing is written")
    repeat = parser.parse_args(arguments).repeat

    live = LiveScene(fm.Scene.from_toml(Path(__file__).parent / "dipole-above.toml"))
    redraw(live, 200.0, ELEMENTS[0])  # imports
    times: dict[int, list[list[float]]] = {elements: [] for elements in ELEMENTS}
    errors: dict[int, tuple[float, int]] = {}
    for k in range(repeat):  # rows in turn, so that whatever else the machine does meets all of them
        for elements in ELEMENTS:
            parts, *errors[elements] = redraw(live, 200.0 + 3.0 * k, elements)  # type: ignore[assignment]
            times[elements].append(parts)
    print(f"{'elements':>8} {'states':>6} {'error in P':>10} {'branch':>7} {'page':>6} {'text':>5} {'together':>8} {'a second':>8}")
    for elements in ELEMENTS:
        parts = [statistics.median(column) for column in zip(*times[elements], strict=True)]
        error, states = errors[elements]
        row = " ".join(f"{value:{width}.1f}" for value, width in zip(parts, (7, 6, 5), strict=True))
        print(f"{elements:>8} {states:>6} {error:>10.1e} {row} {sum(parts):>8.1f} {1e3 / sum(parts):>8.0f}")

    assert errors[32][0] < 1e-6
    assert errors[8][0] > 30 * errors[32][0]


if __name__ == "__main__":
    main(sys.argv[1:])
