"""What an analysis is: one question that is asked of every equilibrium, and all that follows from its answer."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ...quantities import Quantity, Units, heading_in, in_si, written

if TYPE_CHECKING:
    import xarray

    from ...potential import Evaluation
    from ...scene import Scene
    from ..branch import Branch
    from ..equilibrium import Equilibrium
    from ..special_point import SpecialPoint

Array = NDArray[np.float64]
#: one cell of a table
Cell = float | int | str
#: a variable of a data set: dimensions and values
Variable = tuple[tuple[str, ...], Any]


class EquilibriumAnalysis:
    """One question that is asked of every equilibrium.

    Tables, files, pages, pictures and the terminal ask an analysis for its part, and know none by name. Every method has an answer for an
    analysis without that part, so that a class writes down only what it has. Answers that take time go through
    :meth:`.Equilibrium.remembered`.

    Attributes
    ----------
    tables, pictures : mapping of str to callable
        Further files of a run, by their names, and who writes one from a branch to a path. Of a branch without equilibria there are tables
        only.
    """

    tables: ClassVar[Mapping[str, Callable[[Branch, Path], object]]] = {}
    pictures: ClassVar[Mapping[str, Callable[[Branch, Path], object]]] = {}

    def asked(self, scene: Scene) -> bool:
        """Whether a scene asks for it; of one that is registered under a name, the scene names it in ``analysis.extra``."""
        return True

    # --- the answer

    def compute(self, equilibrium: Equilibrium, before: Equilibrium | None, evaluation: Evaluation) -> None:
        """Answer while the equilibrium is recorded, for what profits from the equilibrium before or from the evaluation of the state.

        Without this the answer is found when a table, a file or a user asks for it.
        """

    # --- tables

    def columns(self, scene: Scene) -> Sequence[str]:
        """Names of the columns of a scene that asks for it, in their order."""
        return ()

    def more_columns(self) -> Sequence[str]:
        """Names that ``Branch.column`` takes of every scene."""
        return ()

    def knows(self, column: str) -> bool:
        """Whether a column of any scene is its own; those of :meth:`more_columns`, unless there are too many to list."""
        return column in self.more_columns()

    def value(self, equilibrium: Equilibrium, column: str) -> Cell:
        """One cell of a column of its own."""
        raise NotImplementedError

    def point_columns(self, scene: Scene) -> Sequence[str]:
        """Names of columns of ``special_points.csv``."""
        return ()

    def found_columns(self, points: Sequence[SpecialPoint]) -> Sequence[str]:
        """Names of columns of ``special_points.csv`` that the points found ask for, after those of :meth:`point_columns`."""
        return ()

    def point_value(self, point: SpecialPoint, column: str) -> Cell:
        """One cell of a column of special points: the attribute of that name."""
        found: Cell = getattr(point, column)
        return found

    def quantity(self, name: str) -> Quantity | None:
        """What a column or variable of its own means, where the table of quantities does not say it."""
        return None

    # --- files

    def variables(self, branch: Branch) -> Mapping[str, Variable]:
        """What a NetCDF file holds beside the columns: all that :meth:`restore` needs."""
        return {}

    def restore(self, dataset: xarray.Dataset, branch: Branch) -> None:
        """Let the equilibria of a branch that was read from a file, and those of its special points, remember the answers that stand in it.

        Without this they are found again from the states, when somebody asks.
        """

    def at_nodes(self, equilibrium: Equilibrium) -> Mapping[str, NDArray[Any]]:
        """Values at the nodes of the meridian, for surfaces in VTU files."""
        return {}

    # --- words and pages

    def remarks(self, equilibrium: Equilibrium) -> Iterable[Remark]:
        """The answer in words, each remark about one thing."""
        return ()

    def printed(self, scene: Scene) -> Sequence[PrintedColumn]:
        """Columns of ``print(branch)``."""
        return ()

    def section(self, branch: Branch) -> Section | None:
        """A section of the report of a branch with equilibria."""
        return None


@dataclass(frozen=True)
class Remark:
    """An answer in words.

    Attributes
    ----------
    subject, text : str
        What it is about and what is said, for pages.
    terminal, caption : str
        The same for the line on the terminal while a run goes on, and for the caption in the window; empty where it is not shown.
    """

    subject: str
    text: str
    terminal: str = ""
    caption: str = ""


@dataclass(frozen=True)
class PrintedColumn:
    """A column of ``print(branch)``: its heading, its width (0 for as wide as it is), and the text of a cell."""

    heading: str
    text: Callable[[Equilibrium], str]
    width: int = 0


def printed_in(name: str, units: Units) -> PrintedColumn:
    """The column of a quantity in these units."""
    head = heading_in(name, units)
    width, shown = max(12, len(head)), in_si(name) if units.unit(name) else name
    factor = units.factor(name)
    return PrintedColumn(f"{head:>{width}}", lambda equilibrium: written(shown, getattr(equilibrium, name) * factor, width), width)


@dataclass(frozen=True)
class Table:
    """A table of a page."""

    header: Sequence[str]
    rows: Sequence[Sequence[Any]]
    caption: str = ""


@dataclass(frozen=True)
class Curves:
    """A figure of curves against the step.

    Attributes
    ----------
    label, axis : str
        What the figure shows, and the text at its axis.
    values : mapping of str to ndarray, shape (number of equilibria,)
        The curves by their labels.
    logarithmic : bool
        Whether sizes are shown on a logarithmic scale. Else the scale is linear around zero, which has a line.
    columns : int
        Of the legend.
    """

    label: str
    axis: str
    values: Mapping[str, Array]
    logarithmic: bool = False
    columns: int = 2


@dataclass(frozen=True)
class Drawing:
    """A figure that is drawn on Matplotlib's axes: ``draw`` answers the handles of a legend."""

    label: str
    draw: Callable[[Any, Branch], Sequence[Any]]


@dataclass(frozen=True)
class Section:
    """A section of the report: a figure beside a table, and remarks on the last equilibrium."""

    title: str
    figure: Curves | Drawing | None = None
    table: Table | None = None
    last: Sequence[Remark] = ()
