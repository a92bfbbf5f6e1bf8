"""Apparent restitution coefficient of a beam as a whole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..._arguments import instance, number
from ..._showing import Shown, drawn_by
from ...errors import InvalidInput
from ..basis.events import BEAM_APPROACH, IMPACT, PART, PHASE, RELEASE, ROW_KIND, STICK, TOUCH
from .beam_motion import BeamMotion


@dataclass(frozen=True, eq=False, repr=False)
class ApparentRestitution(Shown):
    """Restitution coefficient of an equivalent one-mode model of a beam.

    Attributes
    ----------
    value : float
        ``-sum(u v) / sum(u^2)``, with u and v the velocities of the first mode before and after the
        contacts: the slope of v over -u through the origin, in which faster contacts have more
        weight.
    error : float
        Its standard error, from the scatter about the slope; nan of a single contact.
    each : ndarray, shape (n,)
        ``-v / u`` of each contact. Negative if the first mode still moves towards the stop at the
        end of the contact.
    approach, departure : ndarray, shape (n,)
        u and v [m/s]: velocities of the first mode relative to the stop, towards it.
    time, contact_time : ndarray, shape (n,)
        Start and duration of each contact [s], from its first impact until the tip leaves the stop
        for the last time.
    impacts : ndarray of int, shape (n,)
        Number of impacts of the tip in each contact, without those that are summed as chatter.
    left_out : int
        Number of contacts that were omitted, because the first mode did not move towards the stop,
        or they were at an end of the motion.
    modes : int
        Modes of the motion.
    within : float
        Longest pause inside a contact [s].

    See Also
    --------
    apparent_restitution, plot.apparent_restitution

    Examples
    --------
    >>> from impactsig import (
    ...     BaseMotion, Cantilever, Rigid, Stop, apparent_restitution, simulate,
    ... )
    >>> stop, base = Stop(1e-3, Rigid(0.6)), BaseMotion(2e-4, 130.0)
    >>> ruler = Cantilever(0.2, 0.025, 0.001, 210e9, 7850, stop=stop, forcing=base, modes=3)
    >>> found = apparent_restitution(simulate(ruler, periods=40))
    >>> found.modes, len(found.each) == len(found.time)
    (3, True)
    """

    value: float
    error: float
    each: np.ndarray
    approach: np.ndarray
    departure: np.ndarray
    time: np.ndarray
    contact_time: np.ndarray
    impacts: np.ndarray
    left_out: int
    modes: int
    within: float

    plot = drawn_by("apparent_restitution", "departure over approach")

    def __repr__(self) -> str:
        return (
            f"ApparentRestitution({self.value:.4g} ± {self.error:.1g}; {len(self.each)} contacts "
            f"of {self.impacts.mean():.3g} impacts, {self.modes} modes)"
        )


def apparent_restitution(motion: BeamMotion, *, within: float | None = None) -> ApparentRestitution:
    """Ratio of the first mode's velocities after and before each contact of a beam.

    A contact of a beam consists of many impacts of its tip, or of a span in which the tip stays at
    the stop: higher modes return the tip at once, and take energy that the first mode does not
    recover. In a one-mode model this loss is part of the restitution coefficient, as in
    [Karpodinis]_ with 0.2 for steel on steel. With many modes the result hardly depends on the
    restitution coefficient r of the tip itself: the tip stays at the stop for about a tenth of the
    period of the first mode, for any r, and leaves it after the beam has swung about its pinned
    tip.

    The effects of the spring and the forcing on the first mode in this time are included. It is
    therefore a property of the beam alone only if these are small, as for a stop at the rest
    position; under forcing it is a property of the motion.

    Parameters
    ----------
    motion : BeamMotion
        Motion of a `Cantilever`.
    within : float, optional
        Impacts belong to one contact if the tip leaves the stop for at most this time [s]; by
        default a quarter of the period of the first mode.

    Returns
    -------
    ApparentRestitution

    Raises
    ------
    InvalidInput
        If there is no whole contact before which the first mode moved towards the stop.

    See Also
    --------
    plot.restitution_over_modes, Cantilever

    Examples
    --------
    >>> from impactsig import (
    ...     BaseMotion, Cantilever, Rigid, Stop, apparent_restitution, simulate,
    ... )
    >>> stop, base = Stop(1e-3, Rigid(0.6)), BaseMotion(2e-4, 130.0)
    >>> ruler = Cantilever(0.2, 0.025, 0.001, 210e9, 7850, stop=stop, forcing=base, modes=1)
    >>> found = apparent_restitution(simulate(ruler, periods=40), within=1e-6)
    >>> round(found.value, 3)  # of one mode, that of the stop
    0.6
    """
    instance(
        "motion",
        motion,
        BeamMotion,
        "a BeamMotion",
        "In one mode the coefficient is that of the stop's law",
    )
    if within is None:
        within = float(0.25 / motion.frequencies[0])
    within = number("within", within, above=0)
    begins, ends, over = _touches(motion)
    rows = motion._rows
    time = motion._seconds(rows[begins])
    opens = np.flatnonzero(np.append(True, time[1:] - over[:-1] > within)) if len(time) else begins
    size = np.diff(np.append(opens, len(begins)))
    last = opens + size - 1
    start, stop, time, over = motion.start, motion.stop, time[opens], over[last]

    side, m = motion._regimes.side, len(motion.frequencies)
    before, after = rows[begins[opens]].copy(), rows[ends[last]]
    if motion._regimes.restitution >= 0:  # a row holds the state after its impact
        jump = (1 + motion._regimes.restitution) * before[:, BEAM_APPROACH] / m
        before[:, -m:] += side * jump[:, None]
    u, v = (side * motion._omega * (r[:, -m] + _base(motion, r)) for r in (before, after))
    # Of one at either end of the span nobody knows whether it is all.
    kept = (u > 0) & (over + within <= stop) & ((start == 0) | (time - within >= start))
    if not kept.any():
        raise InvalidInput(
            "motion", repr(motion), "a complete contact, with the first mode moving to the stop",
            "Let it run longer, or strike harder",
        )  # fmt: skip
    u, v = u[kept], v[kept]
    value = -float((u * v).sum() / (u * u).sum())
    scatter = float(((v + value * u) ** 2).sum() / (u * u).sum())
    error = (scatter / (len(u) - 1)) ** 0.5 if len(u) > 1 else float("nan")
    return ApparentRestitution(
        value, error, -v / u, u, v, time[kept], (over - time)[kept], size[kept],
        int((~kept).sum()), m, within,
    )  # fmt: skip


def _base(motion: BeamMotion, rows: np.ndarray) -> np.ndarray:
    """Velocity of the base, by the angular frequency of the reference, at rows."""
    return -(motion._base * np.exp(1j * rows[:, PHASE])).imag


def _touches(motion: BeamMotion) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows at which the tip meets the stop, rows at which it leaves, and when it does [s].

    An impact leaves where it meets, unless the stop holds the tip next.
    """
    kind = motion._rows[:, ROW_KIND]
    held = kind == TOUCH
    held[:-1] |= (kind[:-1] == IMPACT) & (kind[1:] == STICK)
    begins = motion._impact_rows
    leaves = np.append(np.flatnonzero((kind == PART) | (kind == RELEASE)), len(kind))
    ends = np.where(held[begins], leaves[np.searchsorted(leaves, begins)], begins)
    cut = ends == len(kind)
    ends[cut] = len(kind) - 1
    return begins, ends, np.where(cut, np.inf, motion._seconds(motion._rows[ends]))
