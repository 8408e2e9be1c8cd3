"""What a study of work against precision found."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import files
from ..discretization.meridian import by_quantity
from ..errors import unknown_name
from ..quantities import heading
from . import door

if TYPE_CHECKING:
    from ..scene import Scene

STARTS = ("warm", "cold")


@dataclass(frozen=True)
class Measurement:
    """One line of a study.

    Attributes
    ----------
    what : str
        ``solve``: one equilibrium; ``stage``: a part of the work on it; ``effect``: an equilibrium without or with an effect.
    method : str
        ipopt or newton (finite elements), shooting, collocation, published; the name of the stage or effect.
    start : str
        warm (a neighbouring state is known) or cold; for an effect, off or on.
    degree, elements, unknowns : int or None
        Of the finite elements.
    tolerance : float or None
        Of a method with a tolerance in place of a mesh.
    error : float
        Relative error of the pressure, or under pressure control of the volume, against the reference. NaN where none is defined.
    milliseconds : float
        Median wall time; NaN if nothing came of it.
    setup_milliseconds : float
        Additional time of the first solve on a mesh: building the problem and, for IPOPT, compiling it.
    iterations, evaluations : int or None
        Of the solver, rejected steps included; right-hand sides of the independent methods.
    repeats : int
        How many solves the median is taken over.
    converged : bool
    front : bool
        Whether nothing with the same start is both faster and more accurate.
    message : str
        Why it did not converge.
    """

    what: str
    method: str
    start: str = ""
    degree: int | None = None
    elements: int | None = None
    unknowns: int | None = None
    tolerance: float | None = None
    error: float = np.nan
    milliseconds: float = np.nan
    setup_milliseconds: float = np.nan
    iterations: int | None = None
    evaluations: int | None = None
    repeats: int = 0
    converged: bool = True
    front: bool = False
    message: str = ""


@dataclass(frozen=True)
class Reference:
    """The equilibrium that errors are measured against.

    Attributes
    ----------
    value : float
        The pressure, or under pressure control the volume.
    error : float
        Relative difference from elements of twice the size, an upper estimate of its own error (at least 1e-14).
    elements, degree : int
    """

    value: float
    error: float
    elements: int
    degree: int


#: columns of the table; every line repeats the machine, so that a table can stand alone
COLUMNS = (*(f.name for f in fields(Measurement)), "machine")


_TITLES = {
    "newton": "finite elements, Newton",
    "ipopt": "finite elements, IPOPT",
    "shooting": "shooting, Newton",
    "collocation": "collocation",
    "published": "shooting as published",
}


@dataclass(frozen=True, eq=False)
class Cost:
    """What :func:`cost` measured.

    Attributes
    ----------
    scene : Scene
    control : str
        volume, pressure or center_height.
    load : float
    quantity : str
        Its relative error is measured: pressure, or under pressure control volume.
    reference : Reference
        What errors are measured against, and its own error.
    lines : tuple of Measurement
    machine : mapping of str to str
        Processor, number of processors, system and versions.
    """

    scene: Scene
    control: str
    load: float
    quantity: str
    reference: Reference
    lines: tuple[Measurement, ...] = field(repr=False)
    machine: Mapping[str, str] = field(repr=False)

    def select(self, **having: Any) -> tuple[Measurement, ...]:
        """The lines with given attributes, as in ``select(what="solve", method="newton", start="warm")``.

        Parameters
        ----------
        **having
            Attributes of :class:`Measurement` and their values.

        Raises
        ------
        InputError
            For an attribute that a line does not have.
        """
        for name in having:
            if name not in COLUMNS[:-1]:
                raise unknown_name("select", name, COLUMNS[:-1])
        return tuple(line for line in self.lines if all(getattr(line, name) == value for name, value in having.items()))

    @property
    def front(self) -> tuple[Measurement, ...]:
        """The solves that no other solve with the same start beats in both time and error: warm ones first, and the fastest first."""
        return tuple(sorted((line for line in self.lines if line.front), key=lambda line: (STARTS.index(line.start), line.milliseconds)))

    @property
    def sentence(self) -> str:
        """What to reckon with: what a state costs at the accuracy that the scene asks for (1e-6 without one), a further digit, and effects.

        Costs are those of a next load step by Newton's method, on the cheapest of the meshes that were measured. What effects add was
        measured on the scene's own mesh, and is left out where it was not measured or not found.
        """
        return " ".join(part for part in (_digits(self), _additions(self)) if part)

    def _repr_html_(self) -> str:
        """The picture and the table, for notebooks."""
        return door.study_html(self, "Error over wall time")

    def __str__(self) -> str:
        return "\n".join(_text(self))

    def to_dataframe(self) -> Any:
        """All lines as a pandas DataFrame with the columns :data:`COLUMNS`."""
        import pandas

        return pandas.DataFrame(list(self._rows()), columns=list(COLUMNS))

    def write_csv(self, path: str | PathLike[str]) -> None:
        """Write all lines as a CSV file under a header, whole or not at all; what does not apply is left empty.

        Parameters
        ----------
        path : path

        Raises
        ------
        InputError
            When the folder does not exist or cannot be written to.
        """
        files.write_csv(path, COLUMNS, ([None if _absent(value) else value for value in row] for row in self._rows()))

    def plot(self, path: str | PathLike[str] | None = None, *, ax: Any = None, start: str | None = None) -> Any:
        """Error against milliseconds as a Matplotlib figure.

        Parameters
        ----------
        path : path, optional
            Where the figure is also written.
        ax : matplotlib Axes, optional
            Where to draw one kind of start; the answer is then these axes.
        start : {"warm", "cold"}, optional
            The only kind of start that is drawn.

        Raises
        ------
        InputError
            Without solves that converged, for an unknown kind of start, and for a file that cannot be written.
        """
        return door.plot_cost(self, path, ax, start)

    def _rows(self) -> Iterator[list[Any]]:
        machine = ", ".join(self.machine.values())
        for line in self.lines:
            yield [*asdict(line).values(), machine]


#: the accuracy that is spoken of where a scene asks for none
_USUAL = 1e-6
#: an addition of less than this part of a step is none that a clock tells
_NOTICED = 0.02
#: effects in words, and what their lines are called
_ADDED = {
    "azimuthal modes": "the verdict against {waves}",
    "zones of wrinkles": "looking for zones of wrinkles",
    "tension field": "the tension field",
}


def _cheapest(lines: Sequence[Measurement], error: float) -> Measurement | None:
    """The fastest of the lines that are as accurate as this."""
    return min((line for line in lines if line.error <= error), key=lambda line: line.milliseconds, default=None)


def _digits(study: Cost) -> str:
    """What an accuracy and each further digit cost."""
    known = [line for line in study.select(what="solve", method="newton", start="warm", converged=True) if np.isfinite(line.milliseconds)]
    accuracy = by_quantity(getattr(study.scene.mesh, "accuracy", None) or _USUAL).tightest
    letter = heading(study.quantity)
    chosen = _cheapest(known, accuracy)
    if chosen is None:
        best = min((line.error for line in known), default=np.nan)
        return "" if np.isnan(best) else f"{letter} to {accuracy:.0e} takes more elements than were measured; the best error is {best:.0e}."
    said = f"{letter} to {accuracy:.0e} costs {_ms(chosen.milliseconds)} a state with {chosen.elements} elements of degree {chosen.degree}"
    floor = max(study.reference.error, min(line.error for line in known))
    digits = int(np.floor(np.log10(accuracy / floor)))
    last = None if digits < 1 else _cheapest(known, accuracy * 10.0**-digits)
    if last is None:
        return f"{said}."
    each = (last.milliseconds - chosen.milliseconds) / digits
    mesh = f"{last.elements} elements of degree {last.degree}"
    more = "next to nothing" if each < _NOTICED * chosen.milliseconds else _ms(each)
    return f"{said}; each further digit costs {more}, down to {accuracy * 10.0**-digits:.0e} with {mesh}."


def _additions(study: Cost) -> str:
    """What effects add to a step."""
    effects = study.select(what="effect")
    added = []
    for off, on in zip(effects[::2], effects[1::2], strict=True):
        more = on.milliseconds - off.milliseconds
        if off.method not in _ADDED or not (off.converged and on.converged and np.isfinite(more)):
            continue
        waves = study.scene.analysis.azimuthal_modes or (1,)
        name = _ADDED[off.method].format(waves=", ".join(f"n = {n}" for n in waves))
        added.append(f"{name} adds {_ms(more) if more > _NOTICED * off.milliseconds else 'next to nothing'}")
    if not added:
        return ""
    mesh = f"on {effects[0].elements} elements of degree {effects[0].degree}, where a state costs {_ms(effects[0].milliseconds)},"
    listed = added[0] if len(added) == 1 else f"{', '.join(added[:-1])} and {added[-1]}"
    return f"{mesh[0].upper()}{mesh[1:]} {listed}."


def _ms(milliseconds: float) -> str:
    return f"{milliseconds:.2g} ms" if milliseconds < 100 else f"{milliseconds:.0f} ms"


def _absent(value: Any) -> bool:
    return value is None or (isinstance(value, float) and np.isnan(value))


def _number(value: Any, form: str, width: int) -> str:
    return " " * (width - 1) + "-" if _absent(value) else f"{value:{width}{form}}"


def _text(study: Cost) -> Iterator[str]:
    letter = heading(study.quantity)
    reference = study.reference
    at = f"{heading(study.control)} = {study.load:.9g}"
    yield f"One equilibrium at {at}: relative error in {letter} and milliseconds (* nothing is better in both)"
    yield (
        f"reference: {letter} = {reference.value:.15g}, {reference.elements} elements of degree {reference.degree}, "
        f"own error {reference.error:.1g}"
    )
    yield ", ".join(study.machine.values())
    if study.sentence:
        yield f"\n{study.sentence}"
    yield from _element_table(study, letter)
    yield from _method_table(study, letter)
    stages, effects = study.select(what="stage"), study.select(what="effect")
    if stages:
        yield f"\n{'parts, on ' + str(stages[0].elements) + ' elements of degree ' + str(stages[0].degree):<54} {'ms':>9}"
        yield from (f"  {line.method:<52} {line.milliseconds:>9.3f}" for line in stages)
    if effects:
        yield f"\n{'one load step (Newton iterations)':<44} {'off ms':>14} {'on ms':>14}"
        for off, on in zip(effects[::2], effects[1::2], strict=True):
            times = (f"{line.milliseconds:9.3f} ({line.iterations:>2})" if line.converged else f"{'-':>14}" for line in (off, on))
            yield f"  {off.method:<42} {' '.join(times)}"


def _element_table(study: Cost, letter: str) -> Iterator[str]:
    lines = study.select(what="solve")
    kinds = list(dict.fromkeys((line.method, line.start) for line in lines if line.degree))
    meshes = list(dict.fromkeys((line.degree, line.elements, line.unknowns) for line in lines if line.degree))
    if not meshes:
        return
    heads = "".join(f"{method + ' ' + start:>14}" for method, start in kinds)
    builds = list(dict.fromkeys(method for method, _ in kinds))
    yield f"\ndegree elements unknowns {'error in ' + letter:>10}{heads}" + "".join(f"{'set-up ' + b:>15}" for b in builds)
    for degree, n, unknowns in meshes:
        own = {(line.method, line.start): line for line in lines if (line.degree, line.elements) == (degree, n)}
        error = next((line.error for line in own.values() if line.converged), None)
        times = "".join(_number(own[k].milliseconds, ".2f", 12) + (" *" if own[k].front else "  ") for k in kinds)
        setups = [
            next((own[k].setup_milliseconds for k in kinds if k[0] == b and not _absent(own[k].setup_milliseconds)), None) for b in builds
        ]
        yield f"{degree:>6} {n:>8} {unknowns:>8} {_number(error, '.1e', 10)}{times}" + "".join(_number(t, ".1f", 15) for t in setups)


def _method_table(study: Cost, letter: str) -> Iterator[str]:
    lines = [line for line in study.select(what="solve") if line.degree is None]
    if lines:
        yield f"\n{'method':<24} tolerance {'error in ' + letter:>10} {'ms':>12} {'iterations':>12} {'right-hand sides':>17}"
    for line in lines:
        time_ = _number(line.milliseconds, ".2f", 12) + (" *" if line.front else "  ")
        yield (
            f"{_TITLES[line.method]:<24} {line.tolerance:>9.0e} {_number(line.error, '.1e', 10)} {time_} {line.iterations:>10} "
            f"{line.evaluations:>17}" + ("" if line.converged else f"  {line.message}")
        )
