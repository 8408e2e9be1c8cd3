"""What a fit leaves behind: numbers with what data say about them, models side by side, and plans of tests."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, Status, unknown_name
from ..files import write_csv
from . import door

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure

    from ..scene import Scene

Array = NDArray[np.float64]

_COLUMNS = ("test", "row", "state", "quantity", "held", "measured", "predicted", "deviation", "residual")
_NUMBERS = ("parameter", "value", "unit", "standard_error", "relative_error", "low", "high", "interval", "on_bound")
_MODELS = ("model", "numbers", "log_likelihood", "aicc", "bic", "delta_aicc", "weight", "chi_square", "determined", "values", "message")


def percent(part: float) -> str:
    """A relative error as a person reads it."""
    return f"{100 * part:.0f} %" if part >= 0.995 else f"{100 * part:.2g} %"


def _digits(value: float) -> str:
    """A number with five digits, and no power of ten where it is large."""
    return f"{float(f'{value:.5g}'):.12g}"


@dataclass(frozen=True)
class Correlation(Mapping[str, Mapping[str, float]]):
    """Correlations by name: ``correlation["a", "b"]``, or ``correlation["a"]["b"]``.

    Attributes
    ----------
    names : tuple of str
    matrix : ndarray, shape (p, p)
    """

    names: tuple[str, ...]
    matrix: Array = field(repr=False)

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, tuple) and len(key) == 2:
            return float(self.matrix[self._place(key[0]), self._place(key[1])])
        return dict(zip(self.names, map(float, self.matrix[self._place(key)]), strict=True))

    def _place(self, name: Any) -> int:
        if name not in self.names:
            raise KeyError(name)
        return self.names.index(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


@dataclass(frozen=True, eq=False)
class FittedColumn:
    """One measured column beside its prediction, in the unit of its table.

    Attributes
    ----------
    test : str
        Of which test.
    quantity, header : str
        What it is, and how the table calls it.
    against, against_header : str
        What is held where it is predicted.
    held, held_measured, held_deviation : ndarray, shape (n,)
        Where the prediction is made; what was measured there, and its standard deviation, 0 where it is exact or was not measured.
    measured, predicted, deviation : ndarray, shape (n,)
        Deviation is the standard deviation of a measurement.
    residual : ndarray, shape (n,)
        (predicted - measured) over the deviation.
    slope : ndarray, shape (n,)
        Derivative of the prediction with respect to what is held.
    band : ndarray, shape (n,)
        Half the width of the 95 % band of the prediction.
    rows, states : tuple of int
        Rows of the table, from 1 (lines of a file), and the state that each belongs to.
    """

    test: str
    quantity: str
    header: str
    against: str
    against_header: str
    held: Array
    held_measured: Array
    held_deviation: Array
    measured: Array
    predicted: Array
    deviation: Array
    residual: Array
    slope: Array
    band: Array
    rows: tuple[int, ...]
    states: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Fit:
    """Numbers of a scene that suit measured tests best, and how far data determine them.

    Attributes
    ----------
    scene : Scene
        The scene with these numbers. A free shear modulus is in its scales; without scales in its ``modulus``.
    parameters : tuple of str
    values, standard_errors : mapping of str to float
        Moduli in Pa where the scene has scales.
    intervals : mapping of str to (float, float)
        95 % intervals: by profile likelihood where that differs from the linearised one.
    linear_intervals : mapping of str to (float, float)
        Linearised.
    units : mapping of str to str
        "Pa" or "".
    correlation : Correlation
        By name.
    covariance : ndarray, shape (p, p)
    determined : bool
        Whether every number has a standard error of at most a quarter of its size.
    verdict : str
        The same in words: what is determined, and what would determine the rest.
    combinations : int
        How many combinations of the numbers are determined.
    on_bounds : tuple of str
        Numbers that stand on a bound of what is allowed.
    profiled : tuple of str
        Numbers whose interval is by profile likelihood.
    columns : tuple of FittedColumn
    chi_square : float
        Sum of squares of residuals over deviations.
    freedom : int
        Measured numbers less those adjusted.
    noise : mapping of str to float
        Deviations that were estimated from residuals, by column, in its unit.
    log_likelihood : float
    status : Status
    notes : tuple of str
        What was done to the tables, and what to look at.
    seconds : float
    evaluations : int
        How often all states were solved.
    samples : mapping of str to ndarray
        Numbers of the fits to data sets that were drawn, where they were asked for.

    Examples
    --------
    >>> import numpy as np, femmembrane as fm
    >>> heights = np.linspace(0.1, 1.0, 10)
    >>> truth = fm.Scene(material=fm.Gent(jm=20.0), mesh=fm.disc(8), degree=4)
    >>> pressures = [fm.equilibrium(truth, center_height=h).pressure for h in heights]
    >>> guess = truth.replace(material=fm.Gent(jm=60.0))
    >>> fit = fm.fit(guess, {"center_height": heights, "pressure": pressures}, ["material.mu", "material.jm"], noise="1 %")
    >>> print({name: round(value, 4) for name, value in fit.values.items()}, fit.determined)
    {'material.mu': 1.0, 'material.jm': 20.0} True
    """

    scene: Scene
    parameters: tuple[str, ...]
    values: Mapping[str, float]
    standard_errors: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]
    linear_intervals: Mapping[str, tuple[float, float]] = field(repr=False)
    units: Mapping[str, str] = field(repr=False)
    correlation: Correlation = field(repr=False)
    covariance: Array = field(repr=False)
    determined: bool
    verdict: str
    combinations: int
    on_bounds: tuple[str, ...]
    profiled: tuple[str, ...]
    columns: tuple[FittedColumn, ...] = field(repr=False)
    chi_square: float
    freedom: int
    noise: Mapping[str, float]
    log_likelihood: float = field(repr=False)
    status: Status
    notes: tuple[str, ...]
    seconds: float = field(repr=False)
    evaluations: int = field(repr=False)
    samples: Mapping[str, Array] = field(default_factory=dict, repr=False)

    def _repr_html_(self) -> str:
        """Data and fitted curve above the numbers, for notebooks."""
        return door.study_html(self, "Measured and fitted")

    @property
    def summary(self) -> str:
        """The numbers with their standard errors, and whether they are determined, in a line."""
        units = {name: f" {unit}" if unit else "" for name, unit in self.units.items()}
        found = [f"{name} = {self.values[name]:.6g} +- {self.standard_errors[name]:.2g}{units[name]}" for name in self.parameters]
        return f"{', '.join(found)} ({'determined' if self.determined else 'not determined'})"

    def __str__(self) -> str:
        width = max(9, *(len(name) for name in self.parameters))
        lines = [f"{'parameter':<{width}} {'value':>12} {'error':>8}  95 % interval"]
        for name in self.parameters:
            value, error, (low, high) = self.values[name], self.standard_errors[name], self.intervals[name]
            part = percent(error / abs(value)) if error < 10 * abs(value) else "-"
            unit = f" {self.units[name]}" if self.units[name] else ""
            lines.append(f"{name:<{width}} {value:>12.6g} {part:>8}  {_digits(low)} to {_digits(high)}{unit}")
        lines.append(self.verdict)
        return "\n".join([*lines, *self.notes])

    def to_dataframe(self) -> pandas.DataFrame:
        """Every measured number beside its prediction as a pandas DataFrame, in the units of its table."""
        import pandas

        return pandas.DataFrame(list(self._rows()), columns=list(_COLUMNS))

    def write_csv(self, path: str | PathLike[str]) -> None:
        """Write the numbers: value, unit, standard error, interval, a row each.

        Parameters
        ----------
        path : path
        """
        write_csv(path, _NUMBERS, list(self._numbers()))

    def write_residuals(self, path: str | PathLike[str]) -> None:
        """Write every measured number beside its prediction.

        Parameters
        ----------
        path : path
        """
        write_csv(path, _COLUMNS, list(self._rows()))

    def _rows(self) -> Iterator[tuple[Any, ...]]:
        for c in self.columns:
            numbers = zip(c.rows, c.states, c.held, c.measured, c.predicted, c.deviation, c.residual, strict=True)
            for row, state, held, *others in numbers:
                yield (c.test, row, state, c.header, held, *others)

    def _numbers(self) -> Iterator[tuple[Any, ...]]:
        for name in self.parameters:
            value, error = self.values[name], self.standard_errors[name]
            relative = error / abs(value) if value else np.inf
            kind = "profile" if name in self.profiled else "linear"
            yield (name, value, self.units[name], error, relative, *self.intervals[name], kind, name in self.on_bounds)

    def plot(self, path: str | PathLike[str] | None = None) -> Figure:
        """Data with the fitted curve and its 95 % band, and residuals below, as a Matplotlib figure.

        Parameters
        ----------
        path : path, optional
            Where the figure is also written.
        """
        return door.plot_fit(self, path)  # type: ignore[no-any-return]

    def report(self, path: str | PathLike[str]) -> None:
        """Write one HTML page about the fit.

        Parameters
        ----------
        path : path
        """
        door.write_fit_report(self, path)


@dataclass(frozen=True, eq=False)
class ComparedModel:
    """One model of a comparison.

    Attributes
    ----------
    name : str
        As in scene files; Ogden's with its number of terms.
    fit : Fit or None
        None where it could not be fitted.
    numbers : int
        Fitted numbers, estimated deviations included.
    aicc, bic : float
        Akaike's criterion with its correction for few data, and Schwarz' criterion: the smaller, the better supported.
    message : str
        Why there is no fit, or no criterion.
    """

    name: str
    fit: Fit | None
    numbers: int
    aicc: float
    bic: float
    message: str = ""


@dataclass(frozen=True, eq=False)
class Comparison(Sequence[ComparedModel]):
    """Models side by side on the same data, the best supported by AICc first.

    Attributes
    ----------
    models : tuple of ComparedModel
    """

    models: tuple[ComparedModel, ...]

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, str):
            return self._named(key)
        return self.models[key]

    def _named(self, name: str) -> ComparedModel:
        known = {model.name: model for model in self.models}
        if name not in known:
            raise unknown_name("model", name, known)
        return known[name]

    def __len__(self) -> int:
        return len(self.models)

    @property
    def best(self) -> Fit:
        """The fit that AICc supports best.

        Raises
        ------
        InputError
            When no model could be fitted.
        """
        for model in self.models:
            if model.fit is not None:
                return model.fit
        raise InputError("models", [model.name for model in self.models], "a model is allowed that can be fitted to these data")

    def weights(self) -> Mapping[str, float]:
        """Akaike weights: how far data support each model among these."""
        known = {m.name: m.aicc for m in self.models if np.isfinite(m.aicc)}
        least = min(known.values(), default=0.0)
        raw = {name: float(np.exp(-(value - least) / 2)) for name, value in known.items()}
        total = sum(raw.values()) or 1.0
        return {m.name: raw.get(m.name, 0.0) / total for m in self.models}

    def _rows(self) -> Iterator[tuple[Any, ...]]:
        weights, least = self.weights(), min((m.aicc for m in self.models), default=np.nan)
        for m in self.models:
            fit = m.fit
            if fit is None:
                yield (m.name, m.numbers, *[np.nan] * 6, False, "", m.message)
                continue
            values = " ".join(f"{name.removeprefix('material.')}={value:.6g}" for name, value in fit.values.items())
            delta = m.aicc - least
            yield (
                m.name,
                m.numbers,
                fit.log_likelihood,
                m.aicc,
                m.bic,
                delta,
                weights[m.name],
                fit.chi_square,
                fit.determined,
                values,
                m.message,
            )

    def to_dataframe(self) -> pandas.DataFrame:
        """The table as a pandas DataFrame."""
        import pandas

        return pandas.DataFrame(list(self._rows()), columns=list(_MODELS))

    def write_csv(self, path: str | PathLike[str]) -> None:
        """Write the table.

        Parameters
        ----------
        path : path
        """
        write_csv(path, _MODELS, list(self._rows()))

    def __str__(self) -> str:
        lines = [f"{'model':<16} {'numbers':>7} {'AICc':>10} {'BIC':>10} {'weight':>7}  determined"]
        weights = self.weights()
        for m in self.models:
            if m.fit is None:
                lines.append(f"{m.name:<16} {m.numbers:>7} {'-':>10} {'-':>10} {'-':>7}  {m.message}")
                continue
            known = "yes" if m.fit.determined else "no"
            lines.append(f"{m.name:<16} {m.numbers:>7} {m.aicc:>10.2f} {m.bic:>10.2f} {weights[m.name]:>7.2f}  {known}")
        return "\n".join(lines)


@dataclass(frozen=True, eq=False)
class Plan:
    """Measurements that would determine numbers best, before anything is measured.

    Attributes
    ----------
    parameters : tuple of str
    points : tuple of (str, float)
        Test and value of what is held (height, volume or stretch) of each measurement; what repeats is to be measured as often.
    standard_errors, even_errors : mapping of str to float
        Relative standard errors that this plan would give, and as many evenly spread measurements of the first test.
    determined : bool
        Whether every number would be determined.
    verdict : str
        In words.
    gain : float
        By what factor the plan shrinks the standard errors of the even one, in the geometric mean over all combinations of the numbers.
    tests : mapping of str to float
        Candidate tests, and the geometric mean of relative standard errors that the best plan would have with the first and this one alone.
    """

    parameters: tuple[str, ...]
    points: tuple[tuple[str, float], ...]
    standard_errors: Mapping[str, float]
    even_errors: Mapping[str, float]
    determined: bool
    verdict: str
    gain: float
    tests: Mapping[str, float]

    def __str__(self) -> str:
        lines, counted = [], {point: self.points.count(point) for point in self.points}
        for test in dict.fromkeys(test for test, _ in counted):
            values = [f"{value:.4g}" + (f" (x{count})" if count > 1 else "") for (t, value), count in counted.items() if t == test]
            lines.append(f"{test}: {', '.join(values)}")
        for name in self.parameters:
            lines.append(f"{name}: {100 * self.standard_errors[name]:.3g} % (evenly spread: {100 * self.even_errors[name]:.3g} %)")
        return "\n".join([*lines, self.verdict])
