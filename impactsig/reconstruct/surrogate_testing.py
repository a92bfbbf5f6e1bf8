"""Is it more than noise? A statistic of the data against the same of their surrogates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .._arguments import Seed, whole
from ..errors import InvalidInput
from .prediction import prediction_error, time_reversal_asymmetry
from .surrogates import LABEL, NULL, Method, longest_stretch
from .surrogates import surrogates as make_surrogates

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Alternative = Literal["less", "greater", "two-sided"]
Statistic = Literal["prediction_error", "time_reversal_asymmetry"]

LEVEL = 0.05
LONGEST_PERIOD = 64
PERIODIC_BELOW = 1e-3  # of the standard deviation, by which a period may be missed
FEW_VALUES = 0.5  # distinct values as a share of all


@dataclass(frozen=True, eq=False, repr=False)
class SurrogateTest:
    """What `surrogate_test` found.

    Attributes
    ----------
    statistic : float
        Of the data (where the surrogates are IAAFT, made nearly normal; see `surrogate_test`).
    surrogates : ndarray, shape (count,)
        The statistic of each surrogate.
    p_value : float
        Probability, were the null hypothesis true, of a rank as extreme as that of the data.
    name : str
        Of the statistic.
    alternative : str
        "less", "greater" or "two-sided".
    method : str
        The kind of surrogates.
    count : int
        Values of the series that were used; its ends may have been cut to fit.
    spectrum_error : float
        The greatest of the surrogates; see `Surrogates`.
    warnings : tuple of str
        Why the verdict may not mean what it says.
    """

    statistic: float
    surrogates: np.ndarray
    p_value: float
    name: str
    alternative: Alternative
    method: Method
    count: int
    spectrum_error: float
    warnings: tuple[str, ...] = ()

    @property
    def null(self) -> str:
        """The null hypothesis in words."""
        return NULL[self.method]

    @property
    def rejected(self) -> bool:
        """Whether the null hypothesis is rejected at the level of 5 %."""
        return self.p_value <= LEVEL

    @property
    def deviation(self) -> float | None:
        """From the mean of the surrogates, in their standard deviations; None where they agree."""
        if self.surrogates.min() == self.surrogates.max():
            return None
        spread = float(self.surrogates.std(ddof=1))
        return (self.statistic - float(self.surrogates.mean())) / spread

    def describe(self) -> str:
        """The verdict in words."""
        verdict = "more than" if self.rejected else "no sign of more than"
        words = (
            f"{verdict} {self.null} (p = {self.p_value:.2g}): {self.name} {self.statistic:.3g} "
            f"against {self.surrogates.mean():.3g} ± {self.surrogates.std(ddof=1):.2g} "
            f"of {len(self.surrogates)} {LABEL[self.method]} surrogates"
        )
        return "; but ".join((words, *self.warnings))

    def __str__(self) -> str:
        return self.describe()

    def __repr__(self) -> str:
        return f"SurrogateTest({self.describe()})"

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the statistic among its surrogates; see `impactsig.plot.surrogate_test`."""
        from .. import plot

        return plot.surrogate_test(self, ax=ax)


def surrogate_test(
    x: Any,
    statistic: Statistic | Callable[[np.ndarray], float] = "prediction_error",
    *,
    surrogates: Method = "iaaft",
    count: int = 99,
    alternative: Alternative | None = None,
    seed: Seed = None,
) -> SurrogateTest:
    """Test whether a series is more than what its surrogates are, by a statistic's rank.

    The statistic is worked out for the data and for `count` surrogates (Theiler et al.
    [Theiler1992]_). With L surrogates at or below that of the data and G at or above it,

        p = (L + 1)/(count + 1)  "less",    (G + 1)/(count + 1)  "greater",
        p = min(1, 2 min(L + 1, G + 1)/(count + 1))  "two-sided",

    which under the null hypothesis is at most alpha with probability alpha, where
    alpha (count + 1) (two-sided: half of it) is a whole number; else with less.

    With IAAFT surrogates, both are of the values through a power law fitted to make them nearly
    normal [YeoJohnson2000]_. The null hypothesis allows any monotone function, and IAAFT does not
    get near the spectrum of skewed values: without it a lognormal first-order process is rejected
    twice as often as it should be. (Normal scores of the ranks would not do: they bend a short
    Gaussian series so much that it is rejected too often.)

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        A series in the order of time; of impacts, their interspike intervals [s], where the run has
        gaps the longest stretch between two of them.
    statistic : {"prediction_error", "time_reversal_asymmetry"} or callable
        What to compare: `prediction_error` as it is by default (three delay coordinates, one step
        ahead); the cheap `time_reversal_asymmetry`, which misses dynamics that look alike in both
        directions; or any function of a series that returns a number.
    surrogates : {"iaaft", "phase", "shuffled"}
        Kind of surrogates, and so the null hypothesis; see `surrogates`.
    count : int
        Number of surrogates, 19 or more.
    alternative : {"less", "greater", "two-sided"}, optional
        On which side the data are expected; by default "less" for the prediction error, since
        determinism makes it smaller, and "two-sided" for any other.
    seed : int, SeedSequence or Generator, optional
        The same seed gives the same result; a Generator is drawn from and moves on.

    Raises
    ------
    InvalidInput
        If `x` is no series of finite numbers, is constant or too short for the statistic, or the
        statistic is not a finite number.

    Notes
    -----
    A rejection says what the data are not. That they are a deterministic process, does not follow:
    a non-linear stochastic or a non-stationary one is rejected as well. A periodic series is
    rejected without being chaotic; `warnings` then says so, as it does where few values are
    distinct (a coarse clock) or the ends of the series do not meet.

    Examples
    --------
    >>> x = [0.4]
    >>> for _ in range(500):
    ...     x.append(4 * x[-1] * (1 - x[-1]))
    >>> surrogate_test(x, count=19, seed=1).rejected
    True
    """
    values, notes = longest_stretch(x)
    count = whole("count", count, 19)
    named = _STATISTICS.get(statistic) if isinstance(statistic, str) else None
    if named is None and not callable(statistic):
        raise InvalidInput(
            "statistic", statistic, f"one of {', '.join(_STATISTICS)}, or a function"
        )
    evaluate: Callable[[np.ndarray], float] = named if named else statistic  # type: ignore[assignment]
    name = statistic.replace("_", " ") if isinstance(statistic, str) else _name_of(statistic)
    if alternative is None:
        alternative = "less" if statistic == "prediction_error" else "two-sided"
    if alternative not in ("less", "greater", "two-sided"):
        raise InvalidInput("alternative", alternative, 'one of "less", "greater", "two-sided"')
    judged = _symmetric(values) if surrogates == "iaaft" else values
    made = make_surrogates(judged, count, surrogates, seed=seed)
    own = _number(evaluate(made.original), name)
    others = np.array([_number(evaluate(row.copy()), name) for row in made.values])
    others.flags.writeable = False
    return SurrogateTest(
        own,
        others,
        _rank_p_value(own, others, alternative),
        name,
        alternative,
        surrogates,
        len(made.original),
        float(made.spectrum_error.max()),
        (*notes, *_oddities(values), *made.warnings),
    )


def _error_of_prediction(values: np.ndarray) -> float:
    return prediction_error(values).value


_STATISTICS: dict[str, Callable[[np.ndarray], float]] = {
    "prediction_error": _error_of_prediction,
    "time_reversal_asymmetry": time_reversal_asymmetry,
}


def _symmetric(x: np.ndarray) -> np.ndarray:
    """The values through the power law that makes them most nearly normal [YeoJohnson2000]_."""
    from scipy.stats import yeojohnson

    low, middle, high = np.quantile(x, (0.25, 0.5, 0.75))
    scaled = (x - middle) / (high - low if high > low else x.std())
    bent = yeojohnson(scaled)[0]
    return bent if np.isfinite(bent).all() and bent.min() < bent.max() else scaled


def _name_of(statistic: Callable[..., Any]) -> str:
    return str(getattr(statistic, "__name__", type(statistic).__name__))


def _number(value: Any, name: str) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = np.nan
    if not np.isfinite(number):
        raise InvalidInput(
            "statistic", f"{value!r} from {name}", "a function that returns a number"
        )
    return number


def _rank_p_value(own: float, others: np.ndarray, alternative: Alternative) -> float:
    below = (1 + int(np.sum(others <= own))) / (len(others) + 1)
    above = (1 + int(np.sum(others >= own))) / (len(others) + 1)
    if alternative == "two-sided":
        return min(1.0, 2 * min(below, above))
    return below if alternative == "less" else above


def _oddities(x: np.ndarray) -> tuple[str, ...]:
    """What makes a series unlike both the null hypothesis and chaos."""
    period = _period(x)
    if period:
        return (f"the series is periodic: it repeats every {period} values",)
    distinct = len(np.unique(x))
    if distinct <= FEW_VALUES * len(x):
        return (
            f"only {distinct} of {len(x)} values are distinct: a coarse clock, not the dynamics, "
            "may decide which are neighbours",
        )
    return ()


def _period(x: np.ndarray) -> int:
    """Values after which the series repeats, at least three times; 0 where it does not.

    In the mean square, so that a little jitter counts, and from each cycle to the next, so that a
    drift does: a series that does either is rejected as well without being chaotic.
    `exact_period` allows for neither, and `noisy_cycle` needs more cycles than must be seen here.
    """
    spread = float(x.std())
    for period in range(1, min(LONGEST_PERIOD, len(x) // 3) + 1):
        if np.sqrt(np.mean((x[period:] - x[:-period]) ** 2)) < PERIODIC_BELOW * spread:
            return period
    return 0
