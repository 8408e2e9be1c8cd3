"""Numbers with a unit, such as "5 kPa" or "1.2 A m^2", as numbers in SI units.

A unit is a product of symbols, each with a prefix and a whole power as needed: ``mm``, ``kg/m^3``, ``A m^2``, ``A*m^2``. What follows
a ``/`` divides. Numbers are converted in decimal arithmetic, so that "5 kPa" is 5000 to the last bit.

The factors: Bureau International des Poids et Mesures, The International System of Units, 9th ed. (2019); for mmHg, psi and atm NIST
Special Publication 811 (2008), appendix B.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from decimal import Decimal, localcontext
from typing import TypeAlias

from ..errors import InputError

#: powers of kg, m, s and A
Dimension: TypeAlias = tuple[int, int, int, int]

#: factor to SI units and dimension of every symbol that takes a prefix
_SYMBOLS: Mapping[str, tuple[str, Dimension]] = {
    "g": ("1e-3", (1, 0, 0, 0)),
    "m": ("1", (0, 1, 0, 0)),
    "s": ("1", (0, 0, 1, 0)),
    "A": ("1", (0, 0, 0, 1)),
    "N": ("1", (1, 1, -2, 0)),
    "Pa": ("1", (1, -1, -2, 0)),
    "bar": ("1e5", (1, -1, -2, 0)),
    "J": ("1", (1, 2, -2, 0)),
    "V": ("1", (1, 2, -3, -1)),
    "C": ("1", (0, 0, 1, 1)),
    "T": ("1", (1, 0, -2, -1)),
    "l": ("1e-3", (0, 3, 0, 0)),
    "L": ("1e-3", (0, 3, 0, 0)),
}
#: symbols that stand as they are
_WHOLE: Mapping[str, tuple[str, Dimension]] = {
    "mmHg": ("133.322387415", (1, -1, -2, 0)),
    "cmH2O": ("98.0665", (1, -1, -2, 0)),
    "mmH2O": ("9.80665", (1, -1, -2, 0)),
    "psi": ("6894.757293168361", (1, -1, -2, 0)),
    "atm": ("101325", (1, -1, -2, 0)),
    "in": ("0.0254", (0, 1, 0, 0)),
}
_PREFIXES: Mapping[str, int] = {
    "": 0,
    "p": -12,
    "n": -9,
    "u": -6,
    "\N{MICRO SIGN}": -6,
    "\N{GREEK SMALL LETTER MU}": -6,
    "m": -3,
    "c": -2,
    "d": -1,
    "h": 2,
    "k": 3,
    "M": 6,
    "G": 9,
}
#: what is allowed in each SI unit, for messages
EXAMPLES: Mapping[str, str] = {
    "m": 'a length such as "20 mm"',
    "m^3": 'a volume such as "3 ml"',
    "Pa": 'a pressure or modulus such as "5 kPa", "12 mbar", "0.4 MPa"',
    "J": 'an energy such as "2 mJ"',
    "N": 'a force such as "0.2 N"',
    "kg/m^3": 'a density such as "1000 kg/m^3"',
    "A m^2": 'a magnetic moment such as "0.5 A m^2"',
    "A": 'a current such as "10 A"',
    "T": 'a flux density such as "50 mT"',
    "A/m": 'a magnetic field such as "10 kA/m"',
    "V": 'a voltage such as "3 kV"',
    "C": 'a charge such as "2 nC"',
    "C/m^2": 'a charge per area such as "20 uC/m^2"',
    "V/m": 'an electric field such as "40 MV/m"',
}
_NUMBER = re.compile(r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?)\s*(?![eE][+-]?[0-9])([^\W\d_].*?)\s*", re.DOTALL)
_PART = re.compile(r"([^\W\d_]+(?:2O)?)(?:\^?(-?[1-9]))?")
_DOT = "\N{MIDDLE DOT}"
_SUPERSCRIPTS = str.maketrans("\N{SUPERSCRIPT TWO}\N{SUPERSCRIPT THREE}", "23")
#: characters of a number with its unit
_MAX_TEXT = 100


def has_unit(value: object) -> bool:
    """Whether a value is a number with something like a unit, such as "5 kPa"; an expression in R, such as "1 - 0.4*R", is not."""
    return isinstance(value, str) and len(value) <= _MAX_TEXT and _NUMBER.fullmatch(value) is not None


def in_unit(key: str, text: str, *allowed: str) -> tuple[float, str]:
    """A number with a unit as a number in one of the SI units that are allowed, and which of them it is.

    Parameters
    ----------
    key : str
        Its name, for the error.
    text : str
    *allowed : str
        SI units of different kinds, such as "Pa" or "A m^2".

    Raises
    ------
    InputError
        For a text that is no number with a unit, an unknown unit, and a unit of another kind.
    """
    examples = " or ".join(EXAMPLES.get(unit, f"a number in {unit}") for unit in allowed)
    found = _NUMBER.fullmatch(text) if len(text) <= _MAX_TEXT else None
    if found is None:
        raise InputError(key, text, f"{examples} is allowed")
    with localcontext() as context:
        context.prec = 50
        factor, dimension = _unit(key, text, found[2])
        for unit in allowed:
            if _unit(key, text, unit)[1] == dimension:
                number = float(Decimal(found[1]) * factor)
                if math.isinf(number):
                    raise InputError(key, text, f"{examples} is allowed, which a float can hold in {unit}")
                return number, unit
    raise InputError(key, text, f"{examples} is allowed")


def _unit(key: str, text: str, unit: str) -> tuple[Decimal, Dimension]:
    """Factor to SI units and dimension of a product of symbols."""
    factor, dimension = Decimal(1), (0, 0, 0, 0)
    for place, group in enumerate(unit.translate(_SUPERSCRIPTS).split("/")):
        parts = group.replace("*", " ").replace(_DOT, " ").split()
        for part in parts or [""]:
            one = _PART.fullmatch(part)
            known = _symbol(one[1]) if one else None
            if one is None or known is None:
                near = _near(part)
                hint = f"; write {near}" if near else f"; {_known()} are known, with SI prefixes and powers"
                raise InputError(key, text, f"{part or unit!r} is no unit known here{hint}")
            power = int(one[2] or 1) * (-1 if place else 1)
            factor *= known[0] ** power
            dimension = _added(dimension, known[1], power)
    return factor, dimension


def _added(one: Dimension, other: Dimension, power: int) -> Dimension:
    a, b, c, d = (x + power * y for x, y in zip(one, other, strict=True))
    return a, b, c, d


def _symbol(text: str) -> tuple[Decimal, Dimension] | None:
    if text in _WHOLE:
        number, dimension = _WHOLE[text]
        return Decimal(number), dimension
    for symbol, (number, dimension) in _SYMBOLS.items():
        prefix = text.removesuffix(symbol)
        if text.endswith(symbol) and prefix in _PREFIXES:
            return Decimal(number).scaleb(_PREFIXES[prefix]), dimension
    return None


#: how units are written that go by another name
_OTHERWISE: Mapping[str, str] = {
    "inch": "in",
    "inches": "in",
    "mil": "1e-3 in",
    "thou": "1e-3 in",
    "ft": "12 in",
    "foot": "12 in",
    "feet": "12 in",
    "micron": "um",
    "microns": "um",
    "cc": "cm^3",
    "ccm": "cm^3",
    "torr": "mmHg",
    "Torr": "mmHg",
    "lbf": "4.44822 N",
    "kgf": "9.80665 N",
    "lb": "0.453592 kg",
    "lbs": "0.453592 kg",
    "oersted": "79.5775 A/m",
    "Oe": "79.5775 A/m",
    "gauss": "1e-4 T",
    "Gauss": "1e-4 T",
    "G": "1e-4 T, if it is a gauss",
}
#: names of symbols and prefixes, written out
_NAMES = {
    "gram": "g",
    "meter": "m",
    "metre": "m",
    "second": "s",
    "ampere": "A",
    "newton": "N",
    "pascal": "Pa",
    "joule": "J",
    "volt": "V",
    "coulomb": "C",
    "tesla": "T",
    "liter": "l",
    "litre": "l",
}
_PREFIX_NAMES = {
    "": "",
    "nano": "n",
    "micro": "u",
    "milli": "m",
    "centi": "c",
    "deci": "d",
    "hecto": "h",
    "kilo": "k",
    "mega": "M",
    "giga": "G",
}


def _near(part: str) -> str:
    """How an unknown symbol would be written: out of its name or another spelling; empty if that is unknown."""
    word, power = re.sub(r"^(\w*?)\^?(-?[1-9])?\.?$", r"\1", part), re.search(r"(?<=[^\W\d])\^?(-?[1-9])\.?$", part)
    behind = f"^{power[1]}" if power else ""
    if word in _OTHERWISE:
        return _OTHERWISE[word] if not behind else _raised(_OTHERWISE[word], int(behind[1:]))
    if word and _symbol(word) is not None:
        return word + behind
    lowered = word.lower().removesuffix("s")
    for name, prefix in _PREFIX_NAMES.items():
        if lowered.startswith(name) and lowered.removeprefix(name) in _NAMES:
            return prefix + _NAMES[lowered.removeprefix(name)] + behind
    alike = [symbol for symbol in _spellings() if symbol.lower() == word.lower()]
    return " or ".join(symbol + behind for symbol in alike[:3])


def _raised(written: str, power: int) -> str:
    """A power of what an unknown symbol is written as: (12 in)^2 is 144 in^2."""
    found = re.fullmatch(r"([\d.e-]*) ?([a-zA-Z]+)(?:\^(\d))?", written)
    if found is None:  # more than one symbol
        return f"its {power}. power out of {written}"
    number = f"{Decimal(found[1]) ** power:.6g} " if found[1] else ""
    return f"{number}{found[2]}^{int(found[3] or 1) * power}"


def _spellings() -> list[str]:
    """Symbols with the prefixes that they have in laboratories."""
    prefixes = ("", "k", "M", "m", "u", "c")
    return [*_WHOLE, *(prefix + symbol for symbol in _SYMBOLS for prefix in prefixes if (prefix, symbol) != ("M", "m"))]


def _known() -> str:
    return ", ".join((*(s for s in _SYMBOLS if s not in ("s", "L")), *_WHOLE))
