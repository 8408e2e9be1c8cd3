"""Texts of a figure as TeX reads them: for PGF files, which any document may read with any TeX."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: what TeX reads as a command, where nothing else is meant by it
_ESCAPED = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "{": r"\{",
    "}": r"\}",
    "$": r"\$",
    "&": r"\&",
    "#": r"\#",
}
_SIGNS = {
    "\u2212": "$-$",
    "\u00b1": r"$\pm$",
    "\u221a": r"$\surd$",
    "\u2026": r"\dots{}",
    "\u2013": "--",
    "\u00b5": r"$\mu$",
    "\u00b7": r"$\cdot$",
}
#: capital Greek letters that TeX has; the others look like Latin ones
_CAPITALS = ("GAMMA", "DELTA", "THETA", "LAMDA", "XI", "PI", "SIGMA", "UPSILON", "PHI", "PSI", "OMEGA")


def in_tex(text: str, math: bool = True) -> str:
    """A text with Greek letters and small digits as commands of TeX. Where no formulas are meant, signs of TeX stand for themselves.

    >>> print(in_tex("pressure P = pR\u2080/(\u03bcT)"))
    pressure P = pR$_{0}$/($\\mu$T)
    """
    signs = _SIGNS if math else _SIGNS | _ESCAPED
    return "".join(signs.get(sign) or _letter(sign) for sign in text)


def _letter(sign: str) -> str:
    if sign < "\u0080":
        return sign
    kind, _, of = unicodedata.decomposition(sign).partition(" ")
    if kind in ("<sub>", "<super>"):
        return f"${'_' if kind == '<sub>' else '^'}{{{chr(int(of, 16))}}}$"
    greek, _, name = unicodedata.name(sign, "").partition(" LETTER ")
    name = name.split(" ")[0]
    if greek == "GREEK SMALL" and name != "OMICRON":
        return f"$\\{name.lower().replace('lamda', 'lambda')}$"
    if greek == "GREEK CAPITAL" and name in _CAPITALS:
        return f"$\\{name.capitalize().replace('Lamda', 'Lambda')}$"
    return sign


@contextmanager
def tex_texts(figure: Figure) -> Iterator[None]:
    """A figure all of whose texts TeX can read."""
    from matplotlib.text import Text

    kept = [(text, text.get_text()) for text in figure.findobj(Text)]  # type: ignore[attr-defined]  # of its artists these have texts
    try:
        for text, words in kept:
            text.set_text(in_tex(words, text.get_parse_math()))  # type: ignore[attr-defined]
        yield
    finally:
        for text, words in kept:
            text.set_text(words)  # type: ignore[attr-defined]
