"""Packed numbers, unpacked no further than they may."""

from __future__ import annotations

import lzma
import zlib

from . import UnreadableError


def unpack(data: bytes, packer: str, size: int) -> bytes:
    """A block of data that must unpack to ``size`` bytes.

    ``packer`` is the name that VTK gives to the program that packed it.
    """
    if packer == "vtkZLibDataCompressor":
        found = zlib.decompressobj().decompress(data, size + 1)
    elif packer == "vtkLZMADataCompressor":
        found = lzma.LZMADecompressor().decompress(data, size + 1)
    elif packer == "vtkLZ4DataCompressor":
        found = _unpack_lz4(data, size)
    else:
        raise UnreadableError(f"its data are packed by {packer[:40]}; zlib, lzma and lz4 are allowed")
    if len(found) != size:
        raise UnreadableError(f"a block of packed data does not hold the {size} bytes that it declares")
    return found


def _unpack_lz4(data: bytes, size: int) -> bytes:
    """A block of LZ4: literals, and copies of what came before (github.com/lz4/lz4, doc/lz4_Block_format.md)."""
    out = bytearray()
    place = 0

    def length(first: int, place: int) -> tuple[int, int]:
        """A length that goes on in further bytes while these are 255."""
        total = first
        while first == 15 or first == 255:
            first = data[place]
            total, place = total + first, place + 1
        return total, place

    while place < len(data):
        token = data[place]
        literals, place = length(token >> 4, place + 1)
        out += data[place : place + literals]
        place += literals
        if len(out) > size:
            break
        if place >= len(data):
            return bytes(out)
        back = int.from_bytes(data[place : place + 2], "little")
        copies, place = length(token & 15, place + 2)
        copies += 4
        if not 0 < back <= len(out) or len(out) + copies > size:
            break
        piece = bytes(out[-back:])
        out += (piece * (copies // back + 1))[:copies]
    raise UnreadableError("a block of data packed by lz4 is damaged")
