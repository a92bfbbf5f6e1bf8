"""Nonlinear prediction error, and time-reversal asymmetry."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ..._arguments import choice, one_or_several, whole
from ..._showing import Shown, drawn_by
from ...errors import InvalidInput
from .._arguments import varying
from .._series import known, series, unbroken

Predictor = Literal["constant", "linear"]

NEIGHBOR_SHARE = 0.01  # of the delay vectors, as Sauer takes them


@dataclass(frozen=True, eq=False, repr=False)
class PredictionError(Shown):
    """Normalised prediction errors for every horizon.

    Attributes
    ----------
    horizon : ndarray of int, shape (h,)
        Steps ahead.
    error : ndarray, shape (h,)
        Root mean square error over the standard deviation; 1 is no better than the mean.
    dimension, delay, neighbors, theiler : int
        Settings of the prediction.
    predictor : str
        "constant" or "linear".
    references : int
        Number of delay vectors whose future was predicted.

    See Also
    --------
    prediction_error, results.SurrogateTest, plot.prediction_error

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import prediction_error
    >>> found = prediction_error(np.sin(0.3 * np.arange(500)), dimension=3)
    >>> bool(found.error[0] < 0.05)
    True
    """

    horizon: np.ndarray
    error: np.ndarray
    dimension: int
    delay: int
    neighbors: int
    theiler: int
    predictor: Predictor
    references: int

    @property
    def value(self) -> float:
        """The error at the first horizon."""
        return float(self.error[0])

    def describe(self) -> str:
        """Describe the result in words."""
        step = "step" if self.horizon[0] == 1 else "steps"
        return (
            f"{self.value:.3g} standard deviations {self.horizon[0]} {step} ahead, from "
            f"{self.neighbors} neighbours in {self.dimension} dimensions"
        )

    plot = drawn_by("prediction_error", "the error against the horizon")


def prediction_error(
    x: Any,
    dimension: int = 3,
    delay: int = 1,
    horizon: int | Iterable[int] = 1,
    *,
    neighbors: int | None = None,
    theiler: int | None = None,
    predictor: Predictor = "constant",
) -> PredictionError:
    """Normalised error of nearest-neighbour predictions of a series.

    For each delay vector v_i = (x_i, x_{i+delay}, ..., x_{i+(m-1) delay}) the prediction p_i is the
    mean of the values h steps after the ends of its k nearest neighbours; the error is

        E(h) = sqrt(<(p_i - x_{i+(m-1) delay+h})^2>) / sd(x),

    with averages over i and the standard deviation of the predicted values [Sauer1994]_. E = 1 is
    no better than the mean; a deterministic series has E << 1 for small h and E -> 1 as h grows.
    All horizons have the same references and neighbours.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        A series in the order of time; of impacts, their interspike intervals [s].
    dimension, delay : int
        Coordinates of a delay vector, and the values from one to the next.
    horizon : int or sequence of int
        h, steps ahead.
    neighbors : int, optional
        k; by default 1 % of the vectors, as in [Sauer1994]_, but at least 5, and with the linear
        predictor at least 2 (dimension + 1). Nearness is by the largest difference of a
        coordinate; of equally near vectors the earlier are taken.
    theiler : int, optional
        Vectors at most so many steps before or after are excluded; by default (m - 1) delay + h, so
        that no neighbour shares a value with the vector or its future.
    predictor : {"constant", "linear"}
        The mean of the neighbours' futures, or the plane fitted to them.

    Returns
    -------
    PredictionError
        E(h) (`error`) for each `horizon`, shape (h,), with the settings that were used.

    Raises
    ------
    InvalidInput
        If `x` is not a series of finite numbers, is constant, or is too short for these settings.

    See Also
    --------
    surrogate_test, lyapunov_exponent

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import prediction_error
    >>> found = prediction_error(np.sin(0.3 * np.arange(500)), dimension=3)
    >>> bool(found.error[0] < 0.05)
    True
    """
    dimension, delay = whole("dimension", dimension, 1), whole("delay", delay, 1)
    required = "steps ahead, a whole number or several"
    steps, _ = one_or_several("horizon", horizon, required)
    horizons = np.array([whole("horizon", step, 1) for step in steps], np.int64)
    if not len(horizons):
        raise InvalidInput("horizon", horizon, required)
    choice("predictor", predictor, ("constant", "linear"))
    values = varying(series(x, gap=1))
    reach = (dimension - 1) * delay + int(horizons.max())
    window = reach if theiler is None else whole("theiler", theiler, 0)
    references = np.flatnonzero(unbroken(values, reach + 1))
    count = len(references)
    least = 2 * (dimension + 1) if predictor == "linear" else 1
    if neighbors is None:
        neighbors = max(int(NEIGHBOR_SHARE * count), 5, least)
    neighbors = whole("neighbors", neighbors, least)
    if count < 2 * window + 1 + neighbors:
        raise InvalidInput(
            "x",
            f"{len(known(values))} values"
            + (f", {count} vectors that no gap breaks" if np.isnan(values).any() else ""),
            f"at least {reach + 2 * window + 1 + neighbors} for dimension {dimension}, delay "
            f"{delay}, horizon {horizons.max()}, theiler {window} and {neighbors} neighbors",
        )
    from ._errors import forecasts

    fixed = values.view()
    fixed.flags.writeable = False  # as some arrays come: for others it would be compiled again
    rank = np.argsort(values[references], kind="stable")
    linear = predictor == "linear"
    found = forecasts(
        fixed, references, rank, dimension, delay, horizons, neighbors, window, linear
    )
    target = values[references + reach - horizons.max() + horizons[:, None]]
    spread = target.std(axis=1)
    if not spread.all():
        raise InvalidInput("x", "constant after its first values", "values that are not all equal")
    error = np.sqrt(np.mean((found - target) ** 2, axis=1)) / spread
    for array in (error, horizons):
        array.flags.writeable = False
    return PredictionError(horizons, error, dimension, delay, neighbors, window, predictor, count)


def time_reversal_asymmetry(x: Any, delay: int = 1) -> float:
    """Skewness of the steps, <d^3> / <d^2>^(3/2) with d_i = x_{i+delay} - x_i.

    Its mean is 0 for every linear Gaussian process, also if observed through a function, since such
    a process is reversible in time [SchreiberSchmitz2000]_.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        A series in the order of time; of impacts, their interspike intervals [s].
    delay : int
        Number of steps from one value to the other.

    Returns
    -------
    float
        The skewness, without a unit; positive if rises are steeper than falls.

    Raises
    ------
    InvalidInput
        If `x` is not a series of finite numbers longer than `delay`, or does not change in as much.

    See Also
    --------
    surrogate_test, prediction_error

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import time_reversal_asymmetry
    >>> saw = np.arange(300) % 10  # rises slowly, falls at once
    >>> time_reversal_asymmetry(saw) < 0
    True
    """
    delay = whole("delay", delay, 1)
    values = varying(series(x, least=delay + 1, gap=1))
    together = unbroken(values, delay + 1)
    if not together.any():
        raise InvalidInput(
            "x", f"{len(known(values))} values", f"two {delay} steps apart between the same gaps"
        )
    step = (values[delay:] - values[:-delay])[together]
    largest = float(np.abs(step).max())
    if largest == 0:
        raise InvalidInput(
            "x", f"periodic in {delay} values", "values that change in `delay` steps"
        )
    step = step / largest  # whose cubes are numbers
    return float(np.mean(step**3) / np.mean(step**2) ** 1.5)
