"""Data sets on disk: NetCDF files that are sealed when they are written and checked when they are read."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from collections.abc import Mapping
from os import PathLike
from typing import TYPE_CHECKING, Any

from .. import files
from ..errors import InputError

if TYPE_CHECKING:
    import xarray

#: seconds after which another process is thought not to come back from a file
_PATIENCE = 60.0
#: bytes of values that one byte of a file may hold at most: what its compression reaches
_UNFOLDED = 1100


def write_dataset(dataset: xarray.Dataset, path: str | PathLike[str], encoding: Mapping[str, Any]) -> None:
    """Write a data set to a sealed NetCDF file, whole or not at all."""
    image = io.BytesIO()  # HDF5 itself does not survive a full disk: it is met here, by one plain write
    marked = dataset.assign_attrs(seal=f"{files.SEAL} its digest is the last line of the file, and of all before that line")
    marked.to_netcdf(image, engine="h5netcdf", encoding=encoding)
    content = files.sealed(image.getvalue())
    with files.replace_file(path) as temporary:
        temporary.write_bytes(content)


def read_dataset(path: str | PathLike[str], what: str) -> xarray.Dataset:
    """All of a NetCDF file, after its digest was checked; nothing that it refers to outside of itself is read.

    Files of earlier versions have no digest; neither has what another program wrote.

    Raises
    ------
    InputError
        When it cannot be read or was damaged; ``what`` is needed in its place.
    """
    try:
        content, whole = files.unsealed(files.read_bytes(path))
        if not whole:
            _try_out(content)
        return parsed(content)
    except Exception as error:  # there is nothing that libraries do not raise when they meet bytes that nobody wrote
        raise InputError("path", str(path), f"{what} is needed ({reason(error)})") from error


def parsed(content: bytes) -> xarray.Dataset:
    """The data set in the bytes of a NetCDF file; raises anything for bytes that nobody wrote."""
    import xarray

    _refuse_elsewhere(content)
    # the values as they stand: no times, masks or scales are in our files
    dataset = xarray.load_dataset(io.BytesIO(content), engine="h5netcdf", decode_times=False, mask_and_scale=False)
    dataset.attrs.pop("seal", None)
    return dataset


def reason(error: Exception) -> str:
    """What went wrong while a file was read, in one line that is not too long."""
    text = (error.strerror if isinstance(error, OSError) else None) or str(error)
    if not isinstance(error, (OSError, ValueError)):
        text = f"{type(error).__name__}: {text}"
    line = " ".join(text.split())
    return line if len(line) <= 200 else line[:197] + "..."


def _try_out(content: bytes) -> None:
    """Let another process read bytes that no digest vouches for: of damaged ones HDF5 may never come back, or end the process."""
    code = "import sys; from femmembrane.results.netcdf import parsed; parsed(sys.stdin.buffer.read())"
    places = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    try:
        done = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", code], input=content, capture_output=True, env=places, timeout=_PATIENCE, check=False
        )
    except subprocess.TimeoutExpired:
        raise ValueError("it is damaged: to read it would take for ever") from None
    if done.returncode not in (0, 1):  # 1: an exception, which is met here as well
        raise ValueError("it is damaged: to read it would end the process")


def _refuse_elsewhere(content: bytes) -> None:
    """Refuse a file of which a part is in another one, or that unfolds to much more than it can have held."""
    import h5py

    with h5py.File(io.BytesIO(content), "r") as file:
        room = _UNFOLDED * len(content)
        for name in file:
            if not isinstance(file.get(name, getlink=True), h5py.HardLink):
                raise ValueError(f"{name!r} is a link")
            part = file[name]
            if not isinstance(part, h5py.Dataset):
                raise ValueError(f"{name!r} is no variable")
            if part.external or part.is_virtual:
                raise ValueError(f"the values of {name!r} are in another file")
            if not _only_a_dimension(part):
                room -= part.size * part.dtype.itemsize
            if room < 0:
                raise ValueError("its variables are larger than it can hold")


def _only_a_dimension(part: Any) -> bool:
    """Whether a variable only gives a dimension its length: it has no values."""
    return bytes(part.attrs.get("NAME", b"")).startswith(b"This is a netCDF dimension but not a netCDF variable")
