"""Classical measures by nolds, with the validation and the names of this package.

nolds [Scholzel2019]_ is loaded when one of these is first called. What it would answer with a
silent zero, a NaN or a bare assertion is refused here, and so is a run with gaps; lines are fitted
by least squares, so that the same series has the same answer twice. Where impactsig has a measure
of its own (`lyapunov_exponent`), that one also tells how certain it is.
"""

from __future__ import annotations

import importlib
import math
import warnings
from typing import Any

import numpy as np

from .._arguments import number, whole
from ..errors import ImpactsigWarning, InvalidInput
from ._arguments import varying
from ._series import series
from ._theiler import theiler_window
from ._values import exact_period, rounding_doubt

FIT = "poly"  # nolds' other way, RANSAC, draws random numbers and needs another library


def lyap_r(
    x: Any, *, dimension: int, delay: int = 1, theiler: int | None = None, steps: int = 20,
    step: float = 1.0,
) -> float:  # fmt: skip
    """Largest Lyapunov exponent by nolds' `lyap_r` [Rosenstein1993]_, over all of the steps.

    nolds keeps all distances: 8 n^2 bytes. No scaling region is determined.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        A series in the order of time; of impacts, their interspike intervals [s].
    dimension, delay : int
        Of the embedding (nolds: emb_dim, lag).
    theiler : int, optional
        Vectors that are not further apart in time are not neighbours (nolds: min_tsep); two mean
        periods by default, as in `correlation_sum`.
    steps : int
        Points that neighbours are followed for (nolds: trajectory_len), 2 or more.
    step : float
        Time between values [s] (nolds: tau); the exponent is per unit of it.

    Returns
    -------
    float

    Raises
    ------
    InvalidInput
        If `x` is not a series of finite numbers, constant, periodic, or too short.

    Warns
    -----
    ImpactsigWarning
        If few of the values are different, as of a coarse clock.
    """
    dimension, delay = whole("dimension", dimension, 1), whole("delay", delay, 1)
    steps, step = whole("steps", steps, 2), number("step", step, above=0)
    values = _parting(x)
    window = theiler_window(theiler, values)
    _least(values, (dimension - 1) * delay + steps + 2 * window + 2)
    return _answer(
        "lyap_r", values, emb_dim=dimension, lag=delay, min_tsep=window, trajectory_len=steps,
        tau=step, fit=FIT,
    )  # fmt: skip


def lyap_e(
    x: Any, *, dimension: int = 10, matrix_dimension: int = 4, theiler: int = 0,
    neighbors: int | None = None, step: float = 1.0,
) -> np.ndarray:  # fmt: skip
    """Lyapunov spectrum by nolds' `lyap_e` (Eckmann and others' local Jacobians).

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        A series in the order of time; of impacts, their interspike intervals [s].
    dimension : int
        Of the embedding in which neighbours are found (nolds: emb_dim).
    matrix_dimension : int
        Of the Jacobians, and so the number of exponents (nolds: matrix_dim), 2 or more;
        `matrix_dimension` - 1 must divide `dimension` - 1.
    theiler : int
        Vectors that are not further apart in time are not neighbours (nolds: min_tsep).
    neighbors : int, optional
        Fewest neighbours (nolds: min_nb); the lesser of 2 and 4 more than `matrix_dimension` by
        default, as nolds has it.
    step : float
        Time between values [s] (nolds: tau).

    Returns
    -------
    ndarray, shape (matrix_dimension,)

    Raises
    ------
    InvalidInput
        If `x` is not a series of finite numbers, constant, periodic, or too short, or the
        dimensions do not fit.

    Warns
    -----
    ImpactsigWarning
        If few of the values are different, as of a coarse clock.
    """
    matrix_dimension = whole("matrix_dimension", matrix_dimension, 2)
    dimension, theiler = whole("dimension", dimension, 2), whole("theiler", theiler, 0)
    if (dimension - 1) % (matrix_dimension - 1):
        raise InvalidInput(
            "dimension", dimension, f"1 more than a multiple of {matrix_dimension - 1}"
        )
    if neighbors is None:
        neighbors = min(2 * matrix_dimension, matrix_dimension + 4)
    neighbors, step = whole("neighbors", neighbors, 1), number("step", step, above=0)
    values = _parting(x)
    between = (dimension - 1) // (matrix_dimension - 1)
    _least(values, dimension + between + 2 * theiler + neighbors)
    found = _call(
        "lyap_e", values, emb_dim=dimension, matrix_dim=matrix_dimension, min_nb=neighbors,
        min_tsep=theiler, tau=step,
    )  # fmt: skip
    if not np.isfinite(found).all():
        raise InvalidInput("x", f"exponents {found}", _TOLD, _REMEDY)
    return np.asarray(found, float)


def sampen(x: Any, *, dimension: int = 2, delay: int = 1, tolerance: float | None = None) -> float:
    """Sample entropy by nolds' `sampen` [nat].

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        A series in the order of time; of impacts, their interspike intervals [s].
    dimension, delay : int
        Of the shorter vectors (nolds: emb_dim, lag).
    tolerance : float, optional
        Greatest difference of a coordinate, in the unit of `x`; a fifth of the standard deviation
        in two dimensions by default, as nolds has it.

    Returns
    -------
    float

    Raises
    ------
    InvalidInput
        If `x` is not a series of finite numbers, constant or too short, or no vectors are alike.
    """
    dimension, delay = whole("dimension", dimension, 1), whole("delay", delay, 1)
    if tolerance is not None:
        tolerance = number("tolerance", tolerance, above=0)
    values = _whole(x)
    _least(values, dimension * delay + 10)
    return _answer("sampen", values, emb_dim=dimension, lag=delay, tolerance=tolerance)


def hurst_rs(x: Any) -> float:
    """Hurst exponent by nolds' `hurst_rs` (rescaled range, corrected for short series).

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        A series in the order of time, 100 values or more; of impacts, their intervals [s].

    Returns
    -------
    float

    Raises
    ------
    InvalidInput
        If `x` is not a series of finite numbers, constant, periodic, or too short.
    """
    return _answer("hurst_rs", _aperiodic(x, least=100), fit=FIT)


def dfa(x: Any, *, order: int = 1) -> float:
    """Exponent of the detrended fluctuation analysis by nolds' `dfa`.

    Parameters
    ----------
    x : Impacts or array_like, shape (n,)
        A series in the order of time, 100 values or more; of impacts, their intervals [s].
    order : int
        Of the polynomial that is taken away, 1 or more.

    Returns
    -------
    float

    Raises
    ------
    InvalidInput
        If `x` is not a series of finite numbers, constant, periodic, or too short.
    """
    order = whole("order", order, 1)
    return _answer("dfa", _aperiodic(x, least=100), order=order, fit_exp=FIT)


def _whole(x: Any, least: int = 2) -> np.ndarray:
    """A series that varies and has no gaps, which nolds does not support."""
    values = varying(series(x, least=least, gap=1))
    crossing = np.count_nonzero(np.isnan(values))
    if crossing:
        raise InvalidInput(
            "x",
            f"impacts of a run with {crossing} intervals across gaps",
            "a series without gaps",
            "Take a part of the run, with Impacts.between",
        )
    return values


def _aperiodic(x: Any, least: int = 2) -> np.ndarray:
    """Require a series that does not repeat exactly."""
    values = _whole(x, least)
    period = exact_period(values)
    if period is not None:
        raise InvalidInput("x", f"values that recur after {period}", _TOLD, "They are periodic")
    return values


def _parting(x: Any) -> np.ndarray:
    """Require a series whose neighbours can diverge; warns of values that are equal by rounding."""
    values = _aperiodic(x)
    few = rounding_doubt(values)
    if few:
        words = f"{few}: nolds takes logarithms of gaps that may be rounding"
        warnings.warn(words, ImpactsigWarning, stacklevel=3)
    return values


_TOLD = "a series of which the measure is defined"
_REMEDY = "The series is too regular, too coarsely rounded or too short for it"


def _call(name: str, values: np.ndarray, **options: Any) -> Any:
    with warnings.catch_warnings():
        # nolds imports a module that warns of its own age; what it warns of here ends as an error.
        warnings.simplefilter("ignore")
        nolds = importlib.import_module("nolds")
        try:
            return getattr(nolds, name)(values, **options)
        except (AssertionError, ValueError, np.linalg.LinAlgError) as error:
            raise InvalidInput(
                "x", f"{len(values)} values", f"{_TOLD} ({error})", _REMEDY
            ) from None


def _answer(name: str, values: np.ndarray, **options: Any) -> float:
    found = float(_call(name, values, **options))
    if not math.isfinite(found):
        raise InvalidInput("x", f"{name} {found}", _TOLD, _REMEDY)
    return found + 0.0  # not -0.0


def _least(values: np.ndarray, needed: int) -> None:
    if len(values) < needed:
        raise InvalidInput("x", f"{len(values)} values", f"at least {needed} with these arguments")
