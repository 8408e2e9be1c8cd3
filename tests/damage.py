"""Files as disks, transfers and strangers damage them, always the same for a seed."""

from __future__ import annotations

import random
from collections.abc import Iterator


def damaged(content: bytes, seed: int, count: int) -> Iterator[bytes]:
    """Contents that differ from the one given: bits flipped, bytes or blocks replaced, lost, added, swapped, an end cut off."""
    chance = random.Random(seed)
    while count:
        found = chance.choice(_KINDS)(bytearray(content), chance)
        if found != content:
            count -= 1
            yield bytes(found)


def _flip(data: bytearray, chance: random.Random) -> bytearray:
    data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    return data


def _noise(data: bytearray, chance: random.Random) -> bytearray:
    for _ in range(chance.randrange(2, 20)):
        data[chance.randrange(len(data))] = chance.randrange(256)
    return data


def _zeros(data: bytearray, chance: random.Random) -> bytearray:
    start, length = chance.randrange(len(data)), chance.choice([16, 512, 4096])
    data[start : start + length] = bytes(len(data[start : start + length]))
    return data


def _cut(data: bytearray, chance: random.Random) -> bytearray:
    return data[: chance.randrange(len(data))]


def _lost(data: bytearray, chance: random.Random) -> bytearray:
    start = chance.randrange(len(data))
    del data[start : start + chance.randrange(1, 512)]
    return data


def _added(data: bytearray, chance: random.Random) -> bytearray:
    start = chance.randrange(len(data) + 1)
    data[start:start] = chance.randbytes(chance.randrange(1, 512))
    return data


def _copied(data: bytearray, chance: random.Random) -> bytearray:
    here, there, length = chance.randrange(len(data)), chance.randrange(len(data)), chance.randrange(1, 1024)
    data[here : here + length] = data[there : there + length]
    return data


_KINDS = (_flip, _flip, _noise, _zeros, _cut, _lost, _added, _copied)
