"""Restitution coefficient of a bouncing body, from its instants of impact alone."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from .._arguments import instance, number
from .._showing import Shown
from .._trains.interval_errors import errors_in_intervals
from ..errors import InvalidInput
from ..impacts import Impacts
from ._bouncing import bouncing
from ._drop import Drop, Fit, fit

Contact = Literal["measured", "given", "fitted"]
LEAST_FLIGHTS = 2
LEAST_WITH_CONTACT = 4
"""Flights from which on a contact time common to all can be estimated beside the coefficient."""
LAWS = (0.0, -0.2)
"""Powers of the speed that contact times go by: of a linear spring, and of Hertz."""
TRIED = 9
"""Powers that are tried from one to the other."""
LEAST_MIDDLE = 0.3
"""Of the error of an instant, that the middle of its contact has at least."""
MOST_TIME = 1e100
"""Seconds; sums of squares of such times are numbers still."""
SURE = 0.95


@dataclass(frozen=True, eq=False)
class Bounces(Shown):
    """Restitution coefficient of a bouncing body, with its evidence.

    Attributes
    ----------
    restitution : float
        Ratio of the speeds after and before an impact.
    error : float
        Its standard error.
    interval : tuple of float
        Its 95 % confidence interval.
    flights : ndarray, shape (k,)
        Times of free flight, without the contacts [s].
    ratios, ratio_errors : ndarray, shape (k - 1,)
        Ratio of each flight to the one before, the coefficient of each impact, and its standard
        error.
    contact_time : float
        Mean contact time subtracted from the intervals [s].
    contact : {"measured", "given", "fitted"}
        Source of the contact time.
    first : int
        Index of the impact before the first flight.
    misfit : float
        Ratio of the sum of squared residuals to that expected from the errors of the instants; NaN
        without degrees of freedom. Above 1, the stated errors have been multiplied by its square
        root.

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
    contact: Contact = "measured"
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

    A body that leaves the ground with speed v returns after 2 v / g. With a restitution coefficient
    r each flight is therefore r times as long as the one before, for any height and g. Flights are
    the intervals between impacts minus the contact times. r and the first flight are fitted to all
    flights by generalised least squares.

    Parameters
    ----------
    impacts : Impacts
        The bounces of one drop, three or more. The longest chain is used in which every flight is
        shorter than the one before by about the same factor. A flight may skip one or two impacts
        that are not bounces, if this makes the chain longer.
    contact_time : float, optional
        Contact time of all impacts [s]. By default the measured ones are used; if there are none,
        as in sound, a common contact time is fitted as well, which requires five bounces.

    Returns
    -------
    Bounces

    Raises
    ------
    InvalidInput
        If there are too few bounces, or no error can be estimated.

    Notes
    -----
    Measured contact times with errors, and fitted ones, are assumed to follow a power of the speed,
    c r^(p k) at bounce k. p is 0 for a linear spring and -1/5 for Hertz contact; all powers in
    between are considered to the extent that they agree with the bounces, and the interval contains
    the coefficients for all of these.

    Errors derive from those of the instants, `Impacts.time_error`, and of measured contact times,
    which share an error because they are measured with one shape. If a contact is measured too
    long, its beginning is too early by half of that; this half is assumed to be part of
    `time_error`, and the middle of the contact has the remaining error. If the scatter of the
    bounces is larger, errors are increased accordingly; if the instants have no errors, they are
    estimated from the scatter. The interval is then based on Student's distribution. Air drag,
    which shortens high flights, is not part of the model.

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
    contact: Contact = "measured" if measured else "fitted" if given is None else "given"
    contacts = np.full(len(impacts), given or 0.0)
    if impacts.contact_time is not None and measured:
        contacts = impacts.contact_time
    which = bouncing(impacts, contacts)
    needed = LEAST_WITH_CONTACT if contact == "fitted" else LEAST_FLIGHTS
    if len(which) <= needed:
        remedy = "Give contact_time=, of which less are needed" if contact == "fitted" else ""
        remedy = "contact_time= is taken off each interval" if given else remedy
        raise InvalidInput(
            "impacts", f"{max(len(which) - 1, 0)} flights, each shorter than the one before",
            f"{needed} such flights or more", remedy,
        )  # fmt: skip
    flights = np.diff(impacts.time[which]) - contacts[which[:-1]]
    if not 1 / MOST_TIME < flights.min() <= flights.max() < MOST_TIME:
        raise InvalidInput(
            "impacts", f"flights of {flights.min():.3g} to {flights.max():.3g} s",
            f"times between {1 / MOST_TIME:g} and {MOST_TIME:g} s", "Give them in another unit",
        )  # fmt: skip
    drop = _drop(impacts, which, contacts, contact)
    if drop.errors is None and drop.left < 1:
        raise InvalidInput(
            "impacts.time_error", None, "the errors of the instants, as the bounces are few"
        )
    share = float(np.exp(np.median(np.diff(np.log(flights)))))
    laws = np.linspace(*LAWS, TRIED) if drop.with_contact else LAWS[:1]
    fits = [fit(drop, law, share) for law in laws]
    return _summary(drop, fits, contacts[which], contact, int(which[0]))


def _drop(impacts: Impacts, which: np.ndarray, contacts: np.ndarray, contact: Contact) -> Drop:
    """The bounces, with the errors of what is measured of them."""
    instants, contacts, spread = impacts.time[which], contacts[which], None
    before = np.concatenate(([0.0], np.cumsum(contacts[:-1])))  # known, unless they have errors
    if impacts.time_error is None:
        return Drop(instants - before, None, contacts, None, contact == "fitted")
    errors = errors_in_intervals(impacts, np.minimum(impacts.time_error, MOST_TIME))[which]
    if contact == "measured" and impacts.contact_time_error is not None:
        whole = np.minimum(impacts.time_error[which], MOST_TIME)
        own = np.minimum(impacts.contact_time_error[which], MOST_TIME)
        # A contact that is measured too long begins too early: its middle has less of an error.
        instants, before = instants + contacts / 2, np.zeros(len(which))
        errors = np.sqrt(np.maximum(whole**2 - own**2 / 4, (LEAST_MIDDLE * whole) ** 2))
        spread = _contact_covariance(own, None if impacts.peak is None else impacts.peak[which])
    every = errors if spread is None else np.append(errors, np.diag(spread))
    if not (np.isfinite(every).all() and every.min() > 0):
        raise InvalidInput(
            "impacts", "instants whose errors are 0 or not known", "positive standard errors",
            "Give time_error, or None to read it from the scatter",
        )  # fmt: skip
    with_contact = contact == "fitted" or spread is not None
    return Drop(instants - before, errors, contacts, spread, with_contact)


def _contact_covariance(error: np.ndarray, peak: np.ndarray | None) -> np.ndarray:
    """Covariance of measured contact times.

    Contacts are measured with one shape, whose error they share. By itself a weak one tells less
    than its stated error, which rests on the others being like it: contacts of Hertz, which last
    the longer the weaker they are, come out up to 30 % too short at the noise. So each has at least
    the error of the surest, by the ratio of their peaks; half of that of the surest is taken for
    its own, though all may be shared.
    """
    sure = int(np.argmin(error))
    single = error
    if peak is not None and np.isfinite(peak).all() and peak.min() > 0:
        single = np.maximum(error, error[sure] * peak[sure] / peak)
    return np.diag(single**2 - error[sure] ** 2 / 2) + error[sure] ** 2


def _summary(
    drop: Drop, fits: list[Fit], measured: np.ndarray, contact: Contact, first: int
) -> Bounces:
    """The mean over the laws of contact, and an interval of all that are as likely."""
    from scipy.special import ndtri, stdtrit

    known, left = drop.errors is not None, drop.left
    best = min(fits, key=lambda one: one.squares)
    misfit = best.squares / left if left else math.nan
    scale, quantile = 1.0, float(ndtri(0.5 + SURE / 2))
    if not known or (left and misfit > 1):
        scale, quantile = misfit, float(stdtrit(left, 0.5 + SURE / 2))
    beyond = np.array([one.squares - best.squares for one in fits]) / max(scale, 1e-300)
    weight = np.exp(-beyond / 2) / np.exp(-beyond / 2).sum()
    ratio = np.array([one.restitution for one in fits])
    error = np.sqrt([one.variance * scale for one in fits])
    # Where another law fits worse, less is left for the coefficient to be off.
    reach = error * np.sqrt(np.maximum(quantile**2 - beyond, 0.0))
    likely = beyond <= quantile**2
    own = float(weight @ ratio)
    powers = np.arange(len(drop.instants))
    lasted = best.contact * best.restitution ** (best.law * powers)
    if drop.contact_errors is not None:  # from middle to middle
        lasted[:-1] = (lasted[:-1] + lasted[1:]) / 2
    times = np.diff(drop.instants) - lasted[:-1]
    square = np.ones(len(powers)) if drop.errors is None else drop.errors**2
    covariance = np.diag(square[1:] + square[:-1]) - np.diag(square[1:-1], 1)
    covariance -= np.diag(square[1:-1], -1)
    return Bounces(
        own,
        math.sqrt(weight @ (error**2 + (ratio - own) ** 2)),
        (
            max(float((ratio - reach)[likely].min()), 0.0),
            min(float((ratio + reach)[likely].max()), 1.0),
        ),
        times,
        times[1:] / times[:-1],
        _ratio_errors(times, covariance * scale),
        best.contact if contact == "fitted" else float(measured[:-1].mean()),
        contact,
        first,
        misfit if known else math.nan,
    )


def _ratio_errors(times: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Standard errors of successive ratios, to first order."""
    slope = np.zeros((len(times) - 1, len(times)))
    rows = np.arange(len(times) - 1)
    slope[rows, rows + 1] = 1 / times[:-1]
    slope[rows, rows] = -times[1:] / times[:-1] ** 2
    return np.sqrt(np.einsum("ij,jk,ik->i", slope, covariance, slope))
