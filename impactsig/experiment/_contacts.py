"""The mean contact time of a run, from what each second tells, and its standard error.

Detection measures the pulses of a second by the shape that they share, so their contact times are
off together, and now and then a faint second is misread as a whole (10 to 30 % too long, three to
five of its stated errors). The mean over impacts takes that in full, and a mean weighted by stated
errors half of it. Here the means of seconds are averaged as Huber does it [Huber1964]_.

A part of the error is the same in all seconds: at a given noise the shape is mistaken in the same
way, a half-sine by 0.35 standard errors of a second towards longer contacts. More seconds do
not average it away, so it is a part of the standard error whatever their number.
"""

from __future__ import annotations

import math

import numpy as np

from .._numerics.spread import DEVIATION_BY_MEDIAN
from ..impacts import Impacts

SECOND = 1.0  # [s]
HUBER = 1.345
"""Standard deviations beyond which a second counts less: 95 % of the mean's efficiency where errors
are normal."""
COMMON = 0.25
"""Part of the standard error of a second that all seconds of a run have in common."""
ROUNDS, STAYS = 30, 1e-6
ROUNDING = 1e-12  # of a contact time


def mean_contact(impacts: Impacts) -> tuple[float | None, float | None]:
    """Mean contact time and its standard error [s]; None what is not known.

    Seconds count by their impacts. Those further from the others than by HUBER standard deviations,
    the stated one or, where contacts differ from second to second, that of their means, count in
    inverse proportion to how far they are off. The standard error is that of stated errors shared
    within a second, or what the scatter of seconds says, whichever is more; the part COMMON of the
    stated ones does not become less with the number of seconds.
    """
    time, contact, errors = impacts.time, impacts.contact_time, impacts.contact_time_error
    if contact is None or not len(contact):
        return None, None
    if errors is not None:
        known = np.isfinite(errors)
        if known.any():
            time, contact, errors = time[known], contact[known], errors[known]
        else:
            errors = None
    first = np.flatnonzero(np.diff(np.floor((time - impacts.start) / SECOND), prepend=np.nan))
    count = np.diff(first, append=len(contact))
    means = np.add.reduceat(contact, first) / count
    stated = np.zeros(len(means)) if errors is None else np.add.reduceat(errors, first) / count
    middle = _median(means)
    apart = max(
        DEVIATION_BY_MEDIAN * _median(np.abs(means - middle)), _median(stated), ROUNDING * middle
    )
    weight = np.ones(len(means))
    for _ in range(ROUNDS):
        off = np.abs(means - middle)
        weight = HUBER * apart / np.maximum(off, HUBER * apart) if apart > 0 else weight
        before, middle = middle, float(count * weight @ means / (count @ weight))
        if abs(middle - before) <= STAYS * middle:
            break
    if errors is None:
        return middle, None
    share = count * stated / len(contact)
    shared = math.sqrt((1 - COMMON**2) * float(share @ share))
    whole = int(count[weight == 1.0].sum())
    pulls = count * weight * (means - middle)
    seen = math.sqrt(float(pulls @ pulls)) / whole if whole else 0.0
    return middle, math.hypot(max(shared, seen), COMMON * float(share.sum()))


def _median(values: np.ndarray) -> float:
    ordered = np.sort(values)  # of few, in a third of the time of np.median
    return 0.5 * float(ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2])
