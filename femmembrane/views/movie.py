"""Frames of a picture to a file: GIF with Pillow, MP4 where a writer is installed."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib.util import find_spec
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import replace_file

#: a frame: height, width, colour
Frame = NDArray[np.uint8]

SUFFIXES = (".gif", ".mp4")
#: number of frames, first and last included, that choose the colours of a GIF
_SAMPLES = 6
#: what is as light as this is paper
_PAPER = 240


def check_movie(path: str | PathLike[str]) -> None:
    """Raise InputError for a name that no movie can have, and for MP4 without a writer: before anything is drawn."""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError("movie", str(path), "a name that ends in .gif or .mp4 is allowed")
    if suffix == ".mp4" and not (find_spec("imageio") and find_spec("imageio_ffmpeg")):
        advice = 'MP4 needs a writer that is not installed: pip install "imageio[ffmpeg]"; or ask for a .gif, which needs nothing more'
        raise InputError("movie", str(path), advice)


def write_movie(frames: Iterable[Frame], path: str | PathLike[str], *, rate: float, hold: float = 0.0) -> None:
    """Write frames of one size to a GIF, which repeats, or an MP4.

    Parameters
    ----------
    frames : iterable of ndarray, shape (height, width, 3)
    path : path
        The suffix, .gif or .mp4, chooses the format.
    rate : float
        Frames a second.
    hold : float
        Seconds for which the last frame stays.

    Raises
    ------
    InputError
        For another suffix, without a writer for MP4, and for a file that cannot be written.
    """
    check_movie(path)
    with replace_file(path) as temporary:
        if Path(path).suffix.lower() == ".gif":
            _write_gif(list(frames), temporary, rate, hold)
        else:
            _write_mp4(frames, temporary, rate, hold)


def _write_gif(frames: Sequence[Frame], path: Path, rate: float, hold: float) -> None:
    from PIL import Image

    chosen = np.unique(np.linspace(0, len(frames) - 1, _SAMPLES).round().astype(int))
    # one palette for all frames and no dithering: nothing flickers, and parts at rest cost no bytes
    seen = np.concatenate([frames[k][::3, ::3].reshape(-1, 3) for k in chosen])
    ink = seen[seen.min(axis=1) < _PAPER]
    paper = np.full((max(ink.shape[0] // 100, 1), 3), 255, dtype=np.uint8)  # one colour, whatever its share of the picture
    palette = Image.fromarray(np.concatenate([paper, ink])[None]).quantize(256, method=Image.Quantize.MEDIANCUT, kmeans=3)
    colors = np.array(palette.getpalette()).reshape(-1, 3)
    colors[colors.min(axis=1) > _PAPER] = 255  # the paper is white: its colour is matched to a few units only
    palette.putpalette(colors.ravel().tolist())
    images = [Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    milliseconds = [round(1000 / rate)] * len(images)
    milliseconds[-1] += round(1000 * hold)
    images[0].save(path, save_all=True, append_images=images[1:], duration=milliseconds, loop=0, optimize=False)


def _write_mp4(frames: Iterable[Frame], path: Path, rate: float, hold: float) -> None:
    import imageio.v2 as imageio  # type: ignore[import-not-found]  # no dependency: check_movie asks for it

    # all players read this pixel format with even numbers of pixels
    options: dict[str, Any] = {"fps": rate, "codec": "libx264", "pixelformat": "yuv420p", "quality": 8, "macro_block_size": 2}
    with imageio.get_writer(path, **options) as writer:
        for frame in frames:
            even = frame[: frame.shape[0] // 2 * 2, : frame.shape[1] // 2 * 2]
            writer.append_data(even)
        for _ in range(round(rate * hold)):
            writer.append_data(even)
