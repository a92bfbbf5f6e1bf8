"""Kernels that group crests into events: one per impact, with its best width.

An impact raises the responses of many widths, and those of its neighbourhood. The crest that
stands highest above its noise is taken first; what it explains of the others is taken off them.
"""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import allocating, kernel
from ...pulses.touching_kernels import is_one_pulse
from ...signal.ladder import HALF_SINE_GAIN, MATCH
from ...signal.order_kernels import put_in_order, select
from .._response_kernels import CREST, parts, running_sums
from ._parting_kernels import parted
from .width_kernels import EVENT, LEAST, RESPONSE, best_width, noise_of, put, room_for

CLEAR = 15.0  # standard deviations from which an event is one whatever is around it
NEAR, FAR = (32, 40, 2.0), (128, 160, 1.2)
"""Widths to either side that are looked at, responses on each, and times the noise that they are at
least, where they count: the more there are, the better they tell it."""
SWELLS = 2.3  # times the noise that swelling noise is at most
WIDER = 1.7  # times its width: what a crest's event may be as wide as
INSIDE = 0.5  # of a wide impact's height: the least of a narrow one on top of it
NARROW = 0.08  # of its width: the greatest of such, whose flanks lie on the wide one
LINKS = 3  # crests in a row, each of which explains part of the next


@kernel
def _sine_within(x):
    """Sine of x, or of the right angle that is nearer where x is beyond; its series, to 1e-9."""
    x = min(max(x, -0.5 * math.pi), 0.5 * math.pi)
    z = -x * x
    y = 1.0 + z * (1 / 72) * (1.0 + z * (1 / 110) * (1.0 + z * (1 / 156)))
    return x * (1.0 + z * (1 / 6) * (1.0 + z * (1 / 20) * (1.0 + z * (1 / 42) * y)))


@kernel
def explained(apart, width, wide):
    """Response of a width to a unit half-sine of another width, at a distance."""
    turn = math.pi * MATCH / wide
    centre, half = turn * apart, 0.5 * turn * width
    near, far = turn * (1.5 * width + 0.5), turn * (5.5 * width + 4.5)
    # Integrals of the half-sine, in the angle that it has gone through.
    response = (_sine_within(centre + half) - _sine_within(centre - half)) / (2.0 * half)
    before = _sine_within(centre - near) - _sine_within(centre - far)
    after = _sine_within(centre + far) - _sine_within(centre + near)
    return HALF_SINE_GAIN * (response - 0.5 * (before + after) / (far - near))


@kernel
def near_crests(before, own, after, first, last, widths, out, doubt):
    """Copy the crests of three spans that may matter in [first, last); returns their number.

    They stay in their order. `doubt` takes what is the less the more certain they are.
    """
    widest = 0.0
    for crests in (before, own, after):
        for k in range(len(crests)):
            widest = max(widest, widths[int(crests[k, 1])])
    margin = LINKS * 0.5 * (widest / MATCH + widest)
    low, high = first - margin, last + margin
    count = 0
    for crests in (before, own, after):
        for k in range(len(crests)):
            if low <= crests[k, 0] < high:
                for m in range(CREST):
                    out[count, m] = crests[k, m]
                doubt[count] = -crests[k, 3]
                count += 1
    return count


def strongest_first(doubt):
    """Indices of the crests from the most to the least certain; ties in order."""
    order = np.argsort(doubt)
    # What keeps the order of equal values takes three times as long.
    return np.argsort(doubt, kind="stable") if _tied(doubt, order) else order


@kernel
def _tied(values, order):
    same = 0
    for k in range(1, len(order)):
        same += values[order[k]] == values[order[k - 1]]
    return same > 0


def find_events(here, crests, order, widest, out):
    """Events whose crests lie in a stretch, in order of time.

    Parameters
    ----------
    here : Stretch
    crests : array (n, CREST)
        Of the stretch and of those beside it.
    order : array (n,)
        The crests from the most certain to the least.
    widest : float
        Greatest width of a contact; a wider event is not parted.
    out : array (m, EVENT), filled

    Returns
    -------
    int
        How many there are.
    """
    events, unclear = np.empty((len(out), EVENT)), np.empty(len(out), np.bool_)
    found, count = _find(here, crests, order, widest, events, unclear, out)
    if count < 0:  # few records need it, and what it takes to part events takes long to compile
        count = _part_and_choose(here, events[:found], unclear, out)
    return count


@allocating
def _find(here, crests, order, widest, events, unclear, out):
    """Put events with their best widths into `events`, and those that remain into `out`.

    Returns how many there are of either, or -1 for the latter where events are `unclear`: they may
    have to be parted.
    """
    x, origin, total = here.x, here.origin, here.total
    noise = noise_of(here)
    chosen = np.empty(len(crests), np.int64)
    kept = _leading(crests, order, noise.widths, chosen)
    found = doubts = 0
    event = np.empty(EVENT)
    sigma = noise.sigma[0] / RESPONSE
    greatest = 0.0
    for k in range(kept):
        greatest = max(greatest, noise.widths[int(crests[chosen[k], 1])])
    sums = np.empty(room_for(WIDER * greatest))
    for k in range(kept):
        centre, width = crests[chosen[k], 0], noise.widths[int(crests[chosen[k], 1])]
        if not here.first <= centre < here.last:
            continue
        narrowest = 1.0 if width <= 2.0 else width / 1.6
        upper = WIDER * width
        good = best_width(x, origin, total, centre, narrowest, upper, noise, sums, event, np.inf)
        if good and found < len(events):
            unclear[found] = 4.0 <= event[1] <= widest and not is_one_pulse(
                x, origin, event[0], event[1], event[2], event[4], sigma
            )
            doubts += unclear[found]
            put(event, events, found)
            found += 1
    if doubts:
        return found, -1
    return found, _choose(x, origin, total, events[:found], out)


@allocating
def _part_and_choose(here, events, unclear, out):
    """Part the unclear events, and put those that remain into `out`; returns how many there are."""
    x, origin, total = here.x, here.origin, here.total
    noise = noise_of(here)
    every = np.empty((len(out), EVENT))
    found = 0
    for k in range(len(events)):
        if found == len(every):
            break
        if unclear[k]:
            found += parted(x, origin, total, events[k], noise, every[found:])
        else:
            put(events[k], every, found)
            found += 1
    return _choose(x, origin, total, every[:found], out)


@allocating
def _choose(x, origin, total, events, out):
    """Put the events that stand out, and that no stronger one overlaps, into `out`, by time."""
    found = len(events)
    for k in range(found):
        if events[k, 3] < CLEAR:
            ringing = _among(x, origin, total, events[k], *NEAR, False)
            swelling = _among(x, origin, total, events[k], *FAR, True)
            events[k, 3] = min(events[k, 3], ringing, swelling)
    alone = np.zeros(found, np.bool_)
    keys = np.empty(found)
    order, room = np.empty(found, np.int64), np.empty(found, np.int64)
    for k in range(found):
        keys[k] = -events[k, 3]
    put_in_order(keys, order, room)
    _distinct(events, order, alone)
    for k in range(found):
        keys[k] = events[k, 0]
    put_in_order(keys, order, room)
    count = 0
    for k in order:
        if alone[k]:
            put(events[k], out, count)
            count += 1
    return count


@allocating
def _among(x, origin, total, event, around, seen, louder, both_sides):
    """Height of an event over the responses around it; inf if these are only noise.

    `seen` responses are looked at up to `around` widths to either side, and count where they are
    at least `louder` times the noise, on one side or on both sides.

    Within a burst, or in the ringing after a shock, one of many crests is no impact; nor in noise
    that swells and fades, which is as loud before as after.
    """
    width = int(event[1])
    near, far = width + (width + 1) // 2 + 1, 5 * width + (width + 1) // 2 + 5
    reach = around * width + far + width
    centre = int(event[0])
    lo, hi = max(centre - reach, origin), min(centre + reach + 1, origin + len(x))
    if (lo > centre - reach and lo > 0) or (hi < centre + reach + 1 and hi < total):
        return np.inf  # too wide for what is at hand
    sums = np.empty(hi - lo + 1)
    running_sums(x, lo - origin, hi - lo, sums)
    values = np.empty(seen)
    least, most = np.inf, 0.0
    step, rest = (around - 4) * width // seen, (around - 4) * width % seen
    for side in (-1, 1):
        count = quiet = left = 0
        away = 4 * width
        for _ in range(seen):
            i = centre + side * away
            if lo + far + 1 < i < hi - far - 1:
                a, b, c = parts(sums, lo, hi, i, width, near, far)
                values[count] = a - 0.5 * (b + c)
                quiet += _deviation(values[count]) * event[3] <= louder * event[2]
                count += 1
            away, left = away + step, left + rest
            if left >= seen:
                away, left = away + 1, left - seen
        # Three quarters of Gaussian values lie below 0.6745 standard deviations; of a train of
        # impacts, which are positive for a short part of the time, below 0.
        quarters = 3 * count // 4
        if count < seen // 2 or quiet > quarters:
            if both_sides:
                return np.inf
            continue
        deviation = _deviation(select(values, 0, count - 1, quarters))
        least, most = min(least, deviation), max(most, deviation)
    local = most
    if both_sides:
        # Noise of seconds tells half of what swells in them; more are impacts, close together.
        local = least if least * event[3] < SWELLS * event[2] else 0.0
    if local * event[3] <= louder * event[2]:
        return np.inf
    return event[2] / local


@kernel
def _deviation(quarter):
    """Standard deviation of responses, whose upper quartile is given."""
    return HALF_SINE_GAIN * quarter / 0.6745


@kernel
def _place_among(values, count, value):
    """Number of the first `count` ascending values that are less, found without branches."""
    low = 0
    while count > 1:
        half = count // 2
        low += half * (values[low + half - 1] < value)
        count -= half
    return low + (count == 1 and values[low] < value)


@allocating
def _leading(crests, order, widths, out):
    """Indices of the crests that stronger crests do not explain, in the order of `order`.

    Parameters
    ----------
    crests : array (n, 4)
        Centre, rung, response, response over its noise.
    order : array (n,)
        The crests from the most certain to the least.
    out : array (n,) of int, filled

    Returns
    -------
    int
        How many there are.
    """
    kept, widest = 0, 0.0
    # Those kept, in the order of centres.
    centres, wides, heights = np.empty(len(crests)), np.empty(len(crests)), np.empty(len(crests))
    for index in order:
        centre, width = crests[index, 0], widths[int(crests[index, 1])]
        height = crests[index, 2]
        sure = LEAST * height / crests[index, 3]
        rest, least = height, max(0.5 * height, sure)
        reach = 0.5 * (widest / MATCH + width)
        place_of = _place_among(centres, kept, centre)
        before, after = place_of - 1, place_of
        while rest >= least:  # the nearest first: mostly it explains enough
            left = centre - centres[before] if before >= 0 else np.inf
            right = centres[after] - centre if after < kept else np.inf
            apart = min(left, right)
            if apart > reach:
                out[kept] = index
                for k in range(kept, place_of, -1):
                    centres[k], wides[k], heights[k] = centres[k - 1], wides[k - 1], heights[k - 1]
                centres[place_of], wides[place_of], heights[place_of] = centre, width, height
                widest = max(widest, width)
                kept += 1
                break
            k = before if left <= right else after
            before, after = before - (left <= right), after + (left > right)
            wide, high = wides[k], heights[k]
            if apart > 0.5 * (wide / MATCH + width):
                continue
            if width < wide and apart < 0.5 * wide / MATCH:
                # More than another shape explains, and what noise does.
                least = max(least, INSIDE * high + sure if width <= NARROW * wide else np.inf)
            if rest >= least:
                rest -= max(high * explained(apart, width, wide), 0.0)
    return kept


@allocating
def _distinct(events, order, out):
    """Mark the events that do not overlap a stronger one."""
    taken = np.empty((len(order), 2))
    count = 0
    for index in order:
        centre, width = events[index, 0], events[index, 1]
        out[index] = True
        for m in range(count):
            wide = max(width, taken[m, 1])
            if abs(centre - taken[m, 0]) < 0.6 * wide and min(width, taken[m, 1]) > NARROW * wide:
                out[index] = False
                break
        if out[index]:
            taken[count, 0], taken[count, 1] = centre, width
            count += 1
