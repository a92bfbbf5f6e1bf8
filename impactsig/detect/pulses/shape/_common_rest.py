"""What the family leaves of the clear pulses of a span, in common: the rest of their shape.

Residuals over heights are added up in short stretches of rise, flat top and fall. Each clear pulse
is then linear about the shape that it shares, this rest included, so no misfit is read as noise or
as scatter of shapes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...._compiling.compiled import allocating, kernel
from .._model import (
    AMPLITUDE,
    BY_POWER,
    BY_START,
    MAX_POINTS,
    POWERS,
    REST,
    START,
    VALUE,
    WIDER,
    draw,
    inside,
    linearize,
    parts_of,
    put_products,
    room_for,
)
from ..edges import FIT
from ..fit_errors import (
    BASE,
    CLEAR,
    ESTIMATE,
    FROM,
    NOISE,
    NOW,
    SCALE,
    SCORE,
    SHORT,
    SQUARE,
    TILT,
    TO,
    ZERO,
)

LEAST = 5
"""Pulses that a shape is read from."""
PER_EDGE, PER_TOP, BEFORE = 20, 10, 0.5
EDGE = int(PER_EDGE * (1.0 + BEFORE))
BINS = 2 * EDGE + PER_TOP
"""Stretches: of an edge and half its length before, of the flat top, of all."""
CREST = 8
"""Stretches beside the flat top where the crest may be."""
ALIKE, NOISE_TOO = 0.001, 1.5
"""Of the height, and times the noise of a stretch: what lies no farther below the highest stretch
is the crest too."""
USUAL = math.sqrt(2.0 * (2 * PER_EDGE + PER_TOP))
"""Standard deviation of the sum over these stretches of squares of noise over variances."""
ABSORBED = 7.0
"""By how much that sum is less than none: so many stretches does a shape of the family follow."""
EXACT = 1e-3
"""Standard error, of the height, of samples without noise."""
MEAN_SLOPE = 0.6
"""Points to either side that a slope is the mean over, at least. That of a foot between two samples
would bind a steep pulse to the sample that happens to lie there."""


@kernel
def is_clear(row):
    """Whether a pulse stands high enough above the noise to show its shape."""
    return row[2] >= CLEAR * row[FIT + NOISE]


@kernel
def _place(u, parts):
    """Where a time u since the start lies in the stretches, as a real number; -1 for nowhere."""
    if u < parts.rise:
        return max((u / parts.rise + BEFORE) * PER_EDGE, -1.0)
    if u < parts.rise + parts.flat:
        return EDGE + (u - parts.rise) / parts.flat * PER_TOP
    u = (parts.rise + parts.flat + parts.fall - u) / parts.fall
    place = EDGE + PER_TOP + (1.0 - u) * PER_EDGE
    return place if place < BINS else -1.0


class Room(NamedTuple):
    """Room for the samples of a pulse and curves at them."""

    points: np.ndarray
    means: np.ndarray
    curve: np.ndarray
    early: np.ndarray
    late: np.ndarray
    family: np.ndarray
    normal: np.ndarray


@allocating
def make_room():
    """Room for a pulse."""
    return Room(
        np.empty(MAX_POINTS),
        np.empty(MAX_POINTS),
        room_for(MAX_POINTS),
        room_for(MAX_POINTS),
        room_for(MAX_POINTS),
        np.empty(MAX_POINTS),
        np.empty((WIDER, WIDER + 1)),
    )


@kernel
def _samples(row, x, origin, room):
    """Put points and values of a pulse, as they were fitted, into `room`: how many, of how many."""
    kept = row[FIT:]
    a, b, zero = int(kept[FROM]), int(kept[TO]), int(kept[ZERO])
    per = (b - a + MAX_POINTS - 1) // MAX_POINTS
    count = (b - a) // per
    for k in range(count):
        at = a + k * per + 0.5 * (per - 1)
        total = 0.0
        for i in range(a + k * per, a + (k + 1) * per):
            total += x[zero + i - origin]
        room.points[k] = at
        room.means[k] = (total / per - kept[BASE] - kept[TILT] * at) / kept[SCALE]
    return count, per


@allocating
def common_rest(rows, clear, x, origin, room):
    """The rest of the shape of clear pulses over their heights, in BINS stretches.

    And its mean square over that of the heights less what noise leaves, and the standard error of
    that.
    """
    total, beyond, weight = np.zeros(BINS), np.zeros(BINS), np.zeros(BINS)
    edges = top = 0.0
    for j in clear:
        row = rows[j]
        kept = row[FIT:]
        p = kept[NOW : NOW + WIDER].copy()
        apart, p[POWERS] = p[POWERS], 0.0
        count, per = _samples(row, x, origin, room)
        points, means, curve = room.points[:count], room.means[:count], room.curve
        linearize(p, points, means, curve, room.normal)
        parts = parts_of(p)
        within = inside(p, parts, points)
        noise = max(kept[NOISE] / (kept[SCALE] * math.sqrt(per)), EXACT * p[AMPLITUDE])
        one = (p[AMPLITUDE] / noise) ** 2
        edges += one * 0.5 * (parts.rise + parts.fall)
        top += one * parts.flat
        for k in range(len(points)):
            place = math.floor(_place(points[k] - p[START], parts))
            if place < 0:
                continue
            drawn = within.first <= k < within.last
            rest = curve[REST, k - within.first] if drawn else means[k]
            total[place] += one * rest / p[AMPLITUDE]
            if drawn:
                at = k - within.first
                if k < within.fall:
                    rest -= apart * curve[BY_POWER, at]
                else:
                    rest += apart * curve[BY_POWER, at] - kept[SHORT] * curve[BY_START, at]
            beyond[place] += one * rest / p[AMPLITUDE]
            weight[place] += one
    square = shown = 0.0
    for b in range(BINS):
        if weight[b] > 0.0:
            total[b] /= weight[b]
            if EDGE - PER_EDGE <= b < EDGE + PER_TOP + PER_EDGE:
                square += beyond[b] ** 2 / weight[b] - 1.0
                shown += weight[b]
    _pool_top(total, weight, PER_EDGE * top / max(edges, 1e-300))
    for b in range(BINS):
        if weight[b] > 0.0:
            total[b] *= max(1.0 - 1.0 / (weight[b] * total[b] ** 2 + 1e-300), 0.0)
    shown = max(shown, 1e-300)
    return total, (square + ABSORBED) / shown, USUAL / shown


@kernel
def _pool_top(rest, weight, wide):
    """Make stretches of the flat top, `wide` of an edge's in all, no narrower than these, in place.

    Few samples fall into a tenth of a brief one: the highest would be a choice of noise. If it is
    narrower than one stretch, those beside it count too.
    """
    groups = min(max(int(wide + 0.5), 1), PER_TOP)
    for g in range(groups):
        first, last = EDGE + g * PER_TOP // groups, EDGE + (g + 1) * PER_TOP // groups
        beside = 1 if groups == 1 else 0
        total = seen = 0.0
        for b in range(first - beside, last + beside):
            total += weight[b] * rest[b]
            seen += weight[b]
        for b in range(first, last):
            rest[b], weight[b] = total / max(seen, 1e-300), seen


@kernel
def _height_at(b, rest, power):
    """How high the family with its rest stands in a stretch, over the crest of the family alone."""
    short = max(EDGE - b - 0.5, b + 0.5 - EDGE - PER_TOP, 0.0) / PER_EDGE
    return math.cos(0.5 * math.pi * short) ** power - 1.0 + rest[b]


@kernel
def _crest_near(b, rest, power):
    """The same by the parabola through five stretches, which neither cuts nor raises a crest."""
    beside = _height_at(b - 1, rest, power) + _height_at(b + 1, rest, power)
    beyond = _height_at(b - 2, rest, power) + _height_at(b + 2, rest, power)
    return (17.0 * _height_at(b, rest, power) + 12.0 * beside - 3.0 * beyond) / 35.0


@kernel
def crest_of(rest, power):
    """How far the crest of the family with its rest stands above that of the family; its variance.

    The mean over what is about as high as the greatest, which alone would be the choice of noise.
    `power` is that of the edges.
    """
    first, last = EDGE - CREST, EDGE + PER_TOP + CREST
    highest, rough = -1.0, 0.0
    for b in range(first, last):
        highest = max(highest, _crest_near(b, rest, power))
        # Of a smooth crest it is next to none, of noise it has 20 times the variance. Squares would
        # see nothing but the kinks of a flat top.
        third = _height_at(b - 1, rest, power) - 3.0 * _height_at(b, rest, power)
        third += 3.0 * _height_at(b + 1, rest, power) - _height_at(b + 2, rest, power)
        rough += math.sqrt(math.pi / 40.0) * abs(third) / (last - first)
    lowest = highest - ALIKE - NOISE_TOO * rough
    total = count = 0.0
    for b in range(first, last):
        one = _crest_near(b, rest, power)
        if one > lowest:
            total += one
            count += 1.0
    # Parabolas of neighbours have samples in common: six count as one.
    return total / count, 17.0 / 35.0 * rough**2 / max(count / 6.0, 1.0)


@kernel
def _rest_at(u, parts, rest):
    """The rest at a time u since the start, by a line between the middles of stretches."""
    place = _place(u, parts)
    if place < 0.0:
        return 0.0
    low, high = 0, EDGE - 1
    if place >= EDGE + PER_TOP:
        low, high = EDGE + PER_TOP, BINS - 1
    elif place >= EDGE:
        low, high = EDGE, EDGE + PER_TOP - 1
    at = min(max(place - 0.5, float(low)), float(high))
    b = min(int(at), high - 1)
    return rest[b] + (at - b) * (rest[b + 1] - rest[b])


@kernel
def linearize_anew(rows, alike, x, origin, room):
    """Make pulses linear about what they are taken for now."""
    for j in alike:
        p = rows[j, FIT + ESTIMATE : FIT + ESTIMATE + WIDER]
        _put_taken(rows[j], p)
        count, per = _samples(rows[j], x, origin, room)
        linearize(p, room.points[:count], room.means[:count], room.curve, room.normal)
        _keep(rows[j], per, room.normal)


@kernel
def linearize_with(rows, alike, x, origin, rest, room):
    """The same where the family misses them, with the rest of their shape and the slope of both."""
    for j in alike:
        p = rows[j, FIT + ESTIMATE : FIT + ESTIMATE + WIDER]
        _put_taken(rows[j], p)
        count, per = _samples(rows[j], x, origin, room)
        _linearize_missed(p, count, rest, room)
        _keep(rows[j], per, room.normal)


@kernel
def _put_taken(row, p):
    """Put the parameters of what a pulse is taken for now, in the family, into p."""
    for m in range(WIDER):
        p[m] = row[FIT + NOW + m]
    p[POWERS] = 0.0


@kernel
def _keep(row, per, normal):
    """Keep the normal equations of a pulse."""
    kept = row[FIT:]
    noise = max((kept[NOISE] / kept[SCALE]) ** 2 / per, 1.0)
    for m in range(WIDER):
        kept[SCORE + m] = normal[m, WIDER] / noise
        for k in range(WIDER):
            kept[SQUARE + m * WIDER + k] = normal[max(m, k), min(m, k)] / noise


@kernel
def _linearize_missed(p, count, rest, room):
    """As `linearize`, of a pulse with a rest, whose slope is that between stretches.

    The power is held: the rest takes its place.
    """
    points, x, curve = room.points[:count], room.means[:count], room.curve
    early, late = room.early, room.late
    parts = parts_of(p)
    per = points[1] - points[0]
    within = inside(p, parts, points)
    draw(
        p, parts, points[0] + within.first * per - p[START], per, within.last - within.first, curve
    )
    for k in range(count):
        drawn = within.first <= k < within.last
        room.family[k] = curve[VALUE, k - within.first] if drawn else 0.0
    apart = max(0.5 * min(parts.rise, parts.fall) / PER_EDGE, MEAN_SLOPE * per)
    u = points[0] - p[START]
    draw(p, parts, u - apart, per, count, early)
    draw(p, parts, u + apart, per, count, late)
    length = parts.rise + parts.flat + parts.fall
    first = last = fall = 0
    for k in range(count):
        at = u + k * per
        before = at < -BEFORE * parts.rise
        first += before
        fall += at < parts.rise + parts.flat
        last += at < length + BEFORE * parts.fall
    for k in range(first, last):
        at = u + k * per
        value = room.family[k] + _rest_at(at, parts, rest)
        slope = late[VALUE, k] - early[VALUE, k]
        slope += _rest_at(at + apart, parts, rest) - _rest_at(at - apart, parts, rest)
        curve[VALUE, k - first] = value
        curve[BY_START, k - first] = -p[AMPLITUDE] * slope / (2.0 * apart)
        curve[BY_POWER, k - first] = 0.0
        curve[REST, k - first] = x[k] - p[AMPLITUDE] * value
    put_products(p, parts, points, first, fall, last, curve, room.normal)
