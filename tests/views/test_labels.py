"""Labels cover no line, and stay in the picture."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from femmembrane.views.labels import add_label, covered, settle


def test_a_label_moves_off_a_line_and_keeps_its_way_where_there_is_room() -> None:
    figure = Figure()
    axes = figure.subplots()
    x = np.linspace(0, 1, 50)
    axes.plot(x, x)
    add_label(axes, "free", (0.5, 0.0), way=(1, 1))
    add_label(axes, "on the line", (0.5, 0.5), way=(1, 1))
    before = [text.xyann for text in axes.texts]
    settle(figure)
    free, moved = axes.texts
    assert free.xyann == before[0]
    assert moved.xyann != before[1]
    assert covered(axes, moved.get_window_extent()) == 0
    settle(figure)  # settled once, it stays
    assert covered(axes, moved.get_window_extent()) == 0


def test_labels_cover_neither_each_other_nor_the_edge() -> None:
    figure = Figure()
    axes = figure.subplots()
    axes.plot([0, 1], [0, 0], "o")
    for _ in range(2):
        add_label(axes, "label", (1.0, 0.0))
    settle(figure)
    boxes = [text.get_window_extent() for text in axes.texts]
    assert not any(a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])
    inside = axes.get_window_extent()
    assert all(inside.contains(*box.p0) and inside.contains(*box.p1) for box in boxes)
