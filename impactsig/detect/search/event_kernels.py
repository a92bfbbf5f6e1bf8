"""Kernels that group crests into events: one per impact, with its best width.

An impact raises the responses of many widths, and those of its neighbourhood. The crest that
stands highest above its noise is taken first; what it explains of the others is taken off them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiled import allocating, inner, kernel
from ..pulses.pair_fit import PAIR
from ..pulses.touching_kernels import NOT_TWO, TWO, crests_between_dips, two_pulses
from ..signal.ladder import HALF_SINE_GAIN, MATCH
from ..signal.order_kernels import put_in_order, select, value_at
from ._response_kernels import CREST, gated, noise_at, parts, parts_inside, running_sums

EVENT = 5  # fields of an event: centre, width [samples], height, height over noise, flank mean
LEAST = 5.0  # standard deviations that are left of a response once others are taken off
CLEAR = 15.0  # standard deviations from which an event is one whatever is around it
AROUND, SEEN = 32, 40  # widths to either side that are looked at, and responses on each
LOUDER = 2.0  # times the noise that they are at least, where they count
WIDER = 1.7  # times its width: what a crest's event may be as wide as
INSIDE = 0.5  # of a wide impact's height: the least of a narrow one on top of it
NARROW = 0.08  # of its width: the greatest of such, whose flanks lie on the wide one
LINKS = 3  # crests in a row, each of which explains part of the next
ROOM = 0.2  # of the way to a neighbour: how far a crest may move
SURE = 4.5  # standard deviations that the samples fall by between two crests, at least
RESPONSE = 1.03  # noise of the response to one sample over that of a sample


@inner
def _put(event, rows, k):
    """Make the event row k; a row given as an array takes numba six seconds to compile."""
    for i in range(EVENT):
        rows[k, i] = event[i]


@inner
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


class Noise(NamedTuple):
    """Noise of the responses: of the tabulated widths, and of others once computed, else NaN."""

    widths: np.ndarray
    sigma: np.ndarray
    known: np.ndarray


@allocating
def _noise_of(here):
    """Noise of the responses in a stretch."""
    known = np.full(2 * here.rungs.width[-1], np.nan)
    return Noise(here.rungs.width.astype(np.float64), here.noise, known)


@inner
def _sigma_at(width, noise):
    """Noise of the response to a whole number of samples."""
    if width >= len(noise.known):
        return noise_at(float(width), noise.widths, noise.sigma)
    sigma = noise.known[width]
    if np.isnan(sigma):
        sigma = noise.known[width] = noise_at(float(width), noise.widths, noise.sigma)
    return sigma


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


@allocating
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
    x, origin, total = here.x, here.origin, here.total
    noise = _noise_of(here)
    chosen = np.empty(len(crests), np.int64)
    kept = _leading(crests, order, noise.widths, chosen)
    events = np.empty((len(out), EVENT))
    found = 0
    event = np.empty(EVENT)
    greatest = 0.0
    for k in range(kept):
        greatest = max(greatest, noise.widths[int(crests[chosen[k], 1])])
    sums = np.empty(_room_for(WIDER * greatest))
    for k in range(kept):
        centre, width = crests[chosen[k], 0], noise.widths[int(crests[chosen[k], 1])]
        if not here.first <= centre < here.last:
            continue
        narrowest = 1.0 if width <= 2.0 else width / 1.6
        good = _best(x, origin, total, centre, narrowest, WIDER * width, noise, sums, event)
        if good and found < len(events):
            if event[1] <= widest and event[1] >= 4.0:
                found += _parted(x, origin, total, event, noise, events[found:])
            else:
                _put(event, events, found)
                found += 1
    events = events[:found]
    for k in range(found):
        if events[k, 3] < CLEAR:
            events[k, 3] = min(events[k, 3], _among(x, origin, total, events[k]))
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
            _put(events[k], out, count)
            count += 1
    return count


@allocating
def _among(x, origin, total, event):
    """Height of an event over the responses around it; inf if these are only noise.

    Within a burst, or in the ringing after a shock, one of many crests is no impact.
    """
    width = int(event[1])
    near, far = width + (width + 1) // 2 + 1, 5 * width + (width + 1) // 2 + 5
    reach = AROUND * width + far + width
    centre = int(event[0])
    lo, hi = max(centre - reach, origin), min(centre + reach + 1, origin + len(x))
    if (lo > centre - reach and lo > 0) or (hi < centre + reach + 1 and hi < total):
        return np.inf  # too wide for what is at hand
    sums = np.empty(hi - lo + 1)
    running_sums(x, lo - origin, hi - lo, sums)
    values = np.empty(SEEN)
    local = 0.0
    for side in (-1, 1):
        count = 0
        for k in range(SEEN):
            i = centre + side * (4 * width + (AROUND - 4) * width * k // SEEN)
            if lo + far + 1 < i < hi - far - 1:
                a, b, c = parts(sums, lo, hi, i, width, near, far)
                values[count] = a - 0.5 * (b + c)
                count += 1
        if count >= SEEN // 2:
            # Three quarters of Gaussian values lie below 0.6745 standard deviations; of a train of
            # impacts, which are positive for a short part of the time, below 0.
            upper = select(values, 0, count - 1, 3 * count // 4)
            local = max(local, HALF_SINE_GAIN * upper / 0.6745)
    if local * event[3] <= LOUDER * event[2]:
        return np.inf
    return event[2] / local


@inner
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
        rest, least = height, max(0.5 * height, LEAST * height / crests[index, 3])
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
                least = max(least, INSIDE * high if width <= NARROW * wide else np.inf)
            if rest >= least:
                rest -= max(high * explained(apart, width, wide), 0.0)
    return kept


@inner
def _margin(widest):
    """Samples from the crest to the outer end of a flank."""
    return int(6.2 * widest) + 16


@inner
def _room_for(widest):
    """Sums that `_best` needs room for."""
    return 2 * _margin(widest) + 2


@inner
def _best(x, origin, total, centre, narrowest, widest, noise, sums, event, room=np.inf):
    """Find the best width in a range near a centre, in quarter octaves.

    The crest is looked for within 0.6 widths and `room` of the centre. `sums` is room to work in.
    """
    margin = _margin(widest)
    lo, hi = max(0, int(centre) - margin), min(total, int(centre) + margin + 1)
    lo, hi = max(lo, origin), min(hi, origin + len(x))
    running_sums(x, lo - origin, hi - lo, sums)
    reference = x[lo - origin]
    event[0], event[1], event[2], event[3], event[4] = centre, narrowest, 0.0, 0.0, 0.0
    previous = 0
    steps = math.ceil(4.0 * math.log(widest / narrowest) / math.log(2.0) - 1e-9)
    for step in range(steps + 1):
        width = round(narrowest * 2.0 ** (0.25 * step))
        if width == previous or width > widest + 0.5:
            continue
        previous = width
        near = width + (width + 1) // 2 + 1
        far = near + 4 * width + 4
        gain = HALF_SINE_GAIN if width > 1 else 1.0
        sigma = _sigma_at(width, noise)
        shift = 0.5 * (width - 1) - (width - 1) // 2
        stride = max(1, width // 16)
        reach = min(0.6 * width, room)
        first = max(round(centre - shift - reach - 0.5), lo)
        last = min(round(centre - shift + reach + 0.5), hi - 1)
        per_unit, per_side = 1.0 / width, 1.0 / (far - near)
        inside = first - lo >= far and last + far < hi
        for i in range(first, last + 1, stride):
            if inside:
                c, left, right = parts_inside(sums, i - lo, width, near, far, per_unit, per_side)
            else:
                c, left, right = parts(sums, 0, hi - lo, i - lo, width, near, far)
            value = gated(c, left, right, gain)
            if value > sigma * event[3]:
                event[0], event[1], event[2] = i + shift, width, value
                event[3], event[4] = value / sigma, 0.5 * (left + right) + reference
    return event[3] > 0.0


@allocating
def _parted(x, origin, total, event, noise, out):
    """The events that an event consists of.

    Two where two half-sines explain the samples and one pulse does not; or one for each crest where
    the samples dip between crests and no single pulse explains that.
    """
    _put(event, out, 0)
    pair = np.empty(PAIR + 1)
    sigma = noise.sigma[0] / RESPONSE
    kind = two_pulses(x, origin, event[0], event[1], event[2], event[4], sigma, pair)
    if kind == NOT_TWO or len(out) < 2:
        return 1
    if kind == TWO:
        least = np.inf
        for m in range(2):
            length = math.exp(pair[3 * m + 2])
            width = max(1.0, round(MATCH * length))
            out[m, 0], out[m, 1], out[m, 2] = pair[3 * m + 1] + 0.5 * length, width, pair[3 * m]
            out[m, 3], out[m, 4] = pair[3 * m] / _sigma_at(int(width), noise), pair[PAIR]
            least = min(least, out[m, 3])
            if not 0.0 <= out[m, 0] <= total - 1.0:
                least = 0.0  # the crest of one lies where there are no samples
        if least >= LEAST:
            return 2
        _put(event, out, 0)
        return 1
    width, base = event[1], event[4]
    mean = max(1, int(0.2 * width))
    lo = max(int(event[0] - 1.1 * width), origin)
    hi = min(int(event[0] + 1.1 * width) + 1, origin + len(x))
    count = hi - lo - mean + 1
    if count < 3:
        return 1
    sure = SURE * _sigma_at(mean, noise) / (HALF_SINE_GAIN if mean > 1 else 1.0)
    crests, dips = np.empty(8, np.int64), np.empty(8, np.int64)
    here = x[lo - origin : hi - origin]
    n = crests_between_dips(here, base, mean, 0.15 * event[2], sure, crests, dips)
    if n < 2 or len(out) < n:
        return 1
    found = 0
    part, sums = np.empty(EVENT), np.empty(_room_for(float(2 * len(here))))
    for k in range(n):
        left = dips[k - 1] if k > 0 else crests[k] - (dips[k] - crests[k])
        right = dips[k] if k < n - 1 else crests[k] + (crests[k] - dips[k - 1])
        widest = max(1.0, 0.9 * (right - left))
        narrowest = max(1.0, 0.35 * (right - left))
        centre = lo + crests[k] + 0.5 * (mean - 1)
        if _best(x, origin, total, centre, narrowest, widest, noise, sums, part):
            _put(part, out, found)
            found += 1
    if found == 0:
        _put(event, out, 0)
        found = 1
    return found


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


@allocating
def place(here, events, white, out):
    """Crest and flanks of events at the widths that they have been given.

    Parameters
    ----------
    here : Stretch
    events : array (n, EVENT)
        The centre and the flank mean are filled, and the width is rounded.
    white : array (rungs,)
        Noise of the responses where it is white, over that of the first of them.
    out : array (n, 4), filled
        Centre, flank mean, width, and how many times that of white noise the noise over it is.
    """
    noise = _noise_of(here)
    event = np.empty(EVENT)
    colours = noise.sigma / (noise.sigma[0] * white)
    for k in range(len(events)):
        events[k, 1] = max(np.round(events[k, 1]), 1.0)
    sums = np.empty(_room_for(events[:, 1].max() if len(events) else 0.0))
    for k in range(len(events)):
        width, room = events[k, 1], np.inf
        for m in (k - 1, k + 1):
            if 0 <= m < len(events):
                room = min(room, ROOM * abs(events[m, 0] - events[k, 0]))
        centre = events[k, 0]
        x, origin, total = here.x, here.origin, here.total
        if _best(x, origin, total, centre, width, width, noise, sums, event, room):
            events[k, 0], events[k, 4] = event[0], event[4]
        out[k, 0], out[k, 1], out[k, 2] = events[k, 0], events[k, 4], width
        out[k, 3] = value_at(width, noise.widths, colours)
