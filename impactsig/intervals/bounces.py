"""Restitution coefficient of a bouncing body, from its instants of impact alone."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from .._arguments import instance, number
from .._interval_errors import errors_in_intervals
from .._showing import Shown
from ..errors import InvalidInput
from ..impacts import Impacts

LEAST_FLIGHTS = 2
LEAST_WITH_CONTACT = 4
"""Flights from which on a contact time common to all can be estimated beside the coefficient."""
STRAY = 0.12
"""By which the logarithm of a ratio may be off the usual one before an impact is no bounce."""
LAWS = (0.0, -0.2)
"""Powers of the speed that contact times go by: of a linear spring, and of Hertz."""
MOST_TIME = 1e100
"""Seconds; sums of squares of such times are numbers still."""
SURE = 0.95


@dataclass(frozen=True, eq=False)
class Bounces(Shown):
    """Restitution coefficient of a bouncing body, with its evidence.

    Attributes
    ----------
    restitution : float
        Speed after an impact by that before it.
    error : float
        Its standard error.
    interval : tuple of float
        Its 95 % confidence interval.
    flights : ndarray, shape (k,)
        Times of free flight, without the contacts [s].
    ratios, ratio_errors : ndarray, shape (k - 1,)
        Of each flight to the one before, and their standard errors: the coefficient of each impact.
    contact_time : float
        The contact time taken off each interval, on average [s].
    contact : {"measured", "given", "fitted"}
        Where that is from.
    first : int
        The impact before the first flight.
    misfit : float
        Sum of the squared residuals over what the errors of the instants let expect; NaN where
        nothing is left to judge by. Above 1 the errors have been raised by its square root.

    See Also
    --------
    restitution_from_bounces, results.ApparentRestitution

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Impacts, restitution_from_bounces
    >>> drop = Impacts.from_times(np.cumsum(0.5 * 0.8 ** np.arange(8)), time_error=np.full(8, 1e-4))
    >>> bounces = restitution_from_bounces(drop, contact_time=0.0)
    >>> np.round(bounces.ratios[:3], 6)
    array([0.8, 0.8, 0.8])
    """

    restitution: float
    error: float
    interval: tuple[float, float]
    flights: np.ndarray = field(repr=False)
    ratios: np.ndarray = field(repr=False)
    ratio_errors: np.ndarray = field(repr=False)
    contact_time: float = 0.0
    contact: Literal["measured", "given", "fitted"] = "measured"
    first: int = 0
    misfit: float = math.nan

    def __str__(self) -> str:
        low, high = self.interval
        return (
            f"restitution coefficient {self.restitution:.5g} ± {self.error:.2g} "
            f"(95 %: {low:.5g} to {high:.5g}) from {len(self.flights)} flights"
        )


def restitution_from_bounces(impacts: Impacts, *, contact_time: float | None = None) -> Bounces:
    """Estimate the restitution coefficient of a body that is dropped and bounces.

    A body that leaves the ground with speed v is back after 2 v / g, so with a restitution
    coefficient r each flight lasts r times as long as the one before, whatever the height and g.
    The flights are the intervals between impacts less the contact times. r and the first flight are
    fitted to all of them by generalised least squares, as neighbouring intervals share the error of
    an instant.

    Parameters
    ----------
    impacts : Impacts
        The bounces of one drop, three or more. The longest stretch in which each flight is by about
        the same share shorter than the one before is taken.
    contact_time : float, optional
        Of every impact [s]. By default as measured; where it was not, as of sound, one that all
        impacts share is fitted too, for which five bounces are needed.

    Returns
    -------
    Bounces

    Raises
    ------
    InvalidInput
        If there are too few bounces, or nothing to read an error from.

    Notes
    -----
    Errors are those of the instants, `Impacts.time_error`, and one of measured contact times that
    all of them share, as detection measures them with one shape. They are raised where the flights
    scatter by more; where instants have no errors they are those of the scatter. Then the interval
    is by Student's distribution. The drag of the air shortens high flights and is not part of the
    model.

    See Also
    --------
    fit_oscillator, measure

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import Impacts, restitution_from_bounces
    >>> flights = 0.5 * 0.8 ** np.arange(8)
    >>> drop = Impacts.from_times(np.cumsum(flights), time_error=np.full(8, 1e-4))
    >>> found = restitution_from_bounces(drop, contact_time=0.0)
    >>> round(found.restitution, 6)
    0.8
    """
    instance("impacts", impacts, Impacts)
    given = None if contact_time is None else number("contact_time", contact_time, least=0)
    measured = given is None and impacts.contact_time is not None
    contacts = np.zeros(len(impacts))
    if measured:
        assert impacts.contact_time is not None
        contacts = impacts.contact_time
    elif given is not None:
        contacts = np.full(len(impacts), given)
    intervals = np.diff(impacts.time) - contacts[:-1]
    first, last = _stretch(intervals, impacts.interval_spans_gap())
    flights = intervals[first:last]
    fitted = not measured and given is None
    needed = LEAST_WITH_CONTACT if fitted else LEAST_FLIGHTS
    if len(flights) < needed:
        remedy = "Give contact_time=, of which less are needed" if fitted else ""
        remedy = "contact_time= is taken off each interval" if given else remedy
        raise InvalidInput(
            "impacts", f"{len(flights)} flights, each shorter than the one before",
            f"{needed} such flights or more", remedy,
        )  # fmt: skip
    if not 1 / MOST_TIME < flights.min() <= flights.max() < MOST_TIME:
        raise InvalidInput(
            "impacts", f"flights of {flights.min():.3g} to {flights.max():.3g} s",
            f"times between {1 / MOST_TIME:g} and {MOST_TIME:g} s", "Give them in another unit",
        )  # fmt: skip
    covariance = _covariance(impacts, first, last, measured)
    rest = (contacts[first:last], first, given is not None)
    spring, *others = (
        _fitted(flights, covariance, fitted, *rest, law) for law in (LAWS if fitted else LAWS[:1])
    )
    return _between(spring, others[0]) if others else spring


def _between(first: Bounces, second: Bounces) -> Bounces:
    """Mean of the estimates under two contact laws, with an interval that covers both."""
    apart = abs(first.restitution - second.restitution)
    return replace(
        first,
        restitution=0.5 * (first.restitution + second.restitution),
        error=math.hypot(max(first.error, second.error), apart / math.sqrt(12)),
        interval=(
            min(first.interval[0], second.interval[0]),
            max(first.interval[1], second.interval[1]),
        ),
    )


def _stretch(intervals: np.ndarray, broken: np.ndarray) -> tuple[int, int]:
    """The longest stretch of intervals that shrink by nearly the same ratio."""
    if len(intervals) < LEAST_FLIGHTS:
        return 0, len(intervals)
    usable = (intervals > 0) & ~broken
    logs = np.log(np.where(usable, intervals, 1.0))
    steps = np.diff(logs)
    shrinks = usable[1:] & usable[:-1] & (steps < 0)
    best = (0, 1)
    for centre in steps[shrinks]:
        good = shrinks & (np.abs(steps - centre) < STRAY)
        edges = np.flatnonzero(np.diff(np.concatenate(([0], good.astype(int), [0]))))
        for low, high in edges.reshape(-1, 2).tolist():
            if high + 1 - low > best[1] - best[0]:
                best = (low, high + 1)
    return best


def _covariance(impacts: Impacts, first: int, last: int, measured: bool) -> np.ndarray | None:
    """Covariance of the flights; None if the instants have no errors."""
    if impacts.time_error is None:
        return None
    error = errors_in_intervals(impacts, np.minimum(impacts.time_error, MOST_TIME))
    square = error[first : last + 1] ** 2
    covariance = np.diag(square[1:] + square[:-1]) - np.diag(square[1:-1], 1)
    covariance -= np.diag(square[1:-1], -1)
    if measured and impacts.contact_time_error is not None:
        # Alike contacts are measured with one shape, whose error they share.
        covariance += float(np.median(impacts.contact_time_error[first:last])) ** 2
    usable = np.isfinite(covariance).all() and np.diag(covariance).min() > 0
    if not usable:
        raise InvalidInput(
            "impacts", "instants whose errors are 0 or not known", "positive standard errors",
            "Give time_error, or None to read it from the scatter",
        )  # fmt: skip
    return covariance


def _fitted(
    flights: np.ndarray,
    covariance: np.ndarray | None,
    with_contact: bool,
    contacts: np.ndarray,
    first: int,
    given: bool,
    law: float,
) -> Bounces:
    from scipy.optimize import least_squares
    from scipy.stats import norm, t

    count = len(flights)
    left = count - 2 - with_contact
    if covariance is None and left < 1:
        raise InvalidInput(
            "impacts.time_error", None, "the errors of the instants, as the bounces are few"
        )
    known = covariance is not None
    # Without errors neighbours share that of an instant all the same, of a size to be found.
    shape = 2 * np.eye(count) - np.eye(count, k=1) - np.eye(count, k=-1)
    factor = np.linalg.cholesky(covariance if covariance is not None else shape)
    number = np.arange(count)

    def model(at: np.ndarray) -> np.ndarray:
        return at[0] * at[1] ** number + (at[2] * at[1] ** (law * number) if with_contact else 0.0)

    def residuals(at: np.ndarray) -> np.ndarray:
        return np.linalg.solve(factor, flights - model(at))

    def slopes(at: np.ndarray) -> np.ndarray:
        own = [at[1] ** number, at[0] * number * at[1] ** (number - 1.0)]
        if with_contact:
            own[1] = own[1] + at[2] * law * number * at[1] ** (law * number - 1.0)
            own.append(at[1] ** (law * number))
        return -np.linalg.solve(factor, np.column_stack(own))

    share = float(np.exp(np.median(np.diff(np.log(flights)))))
    start = [float(flights[0]), min(max(share, 0.01), 0.999)] + [0.0] * with_contact
    low, high = [0.0, 1e-6], [np.inf, 1.0]
    # A contact time is positive, but its estimate may not be: a bound would bias the coefficient.
    bounds = (low + [-np.inf] * with_contact, high + [np.inf] * with_contact)
    found = least_squares(
        residuals, start, slopes, bounds=bounds, x_scale=np.maximum(np.abs(start), 1e-3),
        ftol=1e-14, xtol=1e-14, gtol=1e-14,
    )  # fmt: skip
    squares = 2 * found.cost
    misfit = squares / left if left else math.nan
    spread = _variance(found.jac, 1)
    quantile = float(norm.ppf(0.5 + SURE / 2))
    scale = 1.0
    if not known or (left and misfit > 1):
        scale, quantile = misfit, float(t.ppf(0.5 + SURE / 2, left))
    error = math.sqrt(spread * scale)
    own = float(found.x[1])
    contact = float(found.x[2]) if with_contact else float(contacts.mean())
    times = flights - (contact * own ** (law * number) if with_contact else 0.0)
    variance = (covariance if covariance is not None else shape) * scale
    return Bounces(
        own,
        error,
        (max(own - quantile * error, 0.0), min(own + quantile * error, 1.0)),
        times,
        times[1:] / times[:-1],
        _ratio_errors(times, variance),
        contact,
        "fitted" if with_contact else "given" if given else "measured",
        first,
        misfit if known else math.nan,
    )


def _variance(jacobian: np.ndarray, k: int) -> float:
    """Variance of parameter k by a fit, as large as rounding can tell where it is not determined.

    Of bounces that hardly get shorter, a longer contact is a longer flight, and the inverse of the
    normal matrix had negative entries.
    """
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
    _, singular, directions = np.linalg.svd(jacobian / size, full_matrices=False)
    singular = np.maximum(singular, np.finfo(float).eps * singular[0])
    return float(np.sum((directions[:, k] / singular) ** 2) / size[k] ** 2)


def _ratio_errors(times: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Standard errors of successive ratios, to first order."""
    slope = np.zeros((len(times) - 1, len(times)))
    rows = np.arange(len(times) - 1)
    slope[rows, rows + 1] = 1 / times[:-1]
    slope[rows, rows] = -times[1:] / times[:-1] ** 2
    return np.sqrt(np.einsum("ij,jk,ik->i", slope, covariance, slope))
