"""Measurement of one pulse: touch, release, peak, impulse, without assuming its shape.

A family of shapes is fitted (`_fit.py`). A pulse that clearly is no member (residual
variance more than twice the noise) is measured on its own edges: the last samples above a level,
extrapolated to the baseline along the edge.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import allocating, kernel
from ._errors import (
    UNKNOWN,
    Errors,
    Seen,
    edge_errors,
    touches,
    unless_flagged,
    with_crest,
    with_impulse,
    with_level,
)
from ._extent import Place, extent_of, level_out, stands_out, summit
from ._fit import Fit, descend, room_to_fit
from ._fit import Room as FitRoom
from ._model import MAX_POINTS, PARAMETERS, START, parts_of, put_parameters
from .edges import (
    ERRORS,
    FIT,
    NO_PULSE,
    SHARED,
    SHARED_PEAK,
    crest_at,
    crossing,
    integral,
    touch,
)
from .fit_errors import (
    BASE,
    ESTIMATE,
    FROM,
    LEVEL,
    MADE,
    NOISE,
    SCALE,
    SEEN,
    TAKEN,
    TILT,
    TO,
    UNIT,
    ZERO,
    ErrorRoom,
    fit_errors,
    room_for_errors,
)

STEEP = 0.05  # of the flat top: shorter edges are read off the samples
SLOPING = 0.25  # of the flat top: shorter edges are not fitted unless they are the family's
NEARLY = 0.05  # of the height: of what the family misses by less, other pulses may be too


class Pulse(NamedTuple):
    """Measured quantities of one pulse; times in samples since the start of the segment."""

    start: float
    contact: float
    peak: float
    impulse: float
    rise: float
    flags: int
    errors: Errors


class Room(NamedTuple):
    """Room for the measurement of a pulse."""

    samples: np.ndarray  # (2, n)
    points: np.ndarray
    means: np.ndarray
    p: np.ndarray
    fit: FitRoom
    errors: ErrorRoom


@kernel
def measure_reach(width):
    """Samples on either side of its peak that the measurement of a pulse uses."""
    return 12 * width + 16


@kernel
def measure_pulse(
    signal,
    origin,
    total,
    peak,
    base,
    before,
    after,
    width,
    sigma,
    colour,
    level,
    relative,
    keep,
    room,
):
    """Measure the pulse around `peak`.

    Parameters
    ----------
    signal : 1-D array
        The samples from `origin` on of a segment of `total` samples, or as many as may matter.
    origin, total : int
        Place of signal[0] in the segment, and the length of the segment.
    peak, before, after : int
        Place in the segment of this pulse's peak, and of its neighbours' (-1 and `total` if
        there is none).
    base : float
        First guess of the baseline.
    width : int
        Width of the response that suits the pulse, in samples.
    sigma : float
        Standard deviation of the noise.
    colour : float
        Standard deviation of the noise over the width, over that of white noise.
    level, relative : float, bool
        Level above the baseline that the contact time refers to, as a share of the peak if
        relative; 0 for the touch itself.
    keep : array
        Takes the fit: columns as in `fit_errors.py`; the first is NaN if none is taken.
    room : Room
    """
    keep[MADE], keep[SEEN], keep[SCALE] = np.nan, np.nan, 0.0
    reach = measure_reach(width)
    lo, hi = max(origin, peak - reach), min(origin + len(signal), peak + reach + 1)
    place = Place(before, peak, after, lo, hi, total)
    x = room.samples[0, : hi - lo]
    around = signal[lo - origin : hi - origin]
    for i in range(len(x)):
        x[i] = around[i]
    top, crest = summit(x, place, base, width, sigma)
    height = crest - base
    if not stands_out(x, top, width, crest - 0.4 * height):
        return Pulse(0.0, 0.0, 0.0, 0.0, 0.0, NO_PULSE, UNKNOWN)
    extent, flags = extent_of(x, top, place, base, height, width, sigma)
    for i in range(len(x)):
        x[i] -= base
    baseline = level_out(x, top, extent, place, width, sigma, colour, height, room.samples[1])
    height -= baseline.at_top
    if height <= 0.0:
        return Pulse(0.0, 0.0, 0.0, 0.0, 0.0, NO_PULSE, UNKNOWN)

    crest, shift = crest_at(x, top, sigma)
    seen = Seen(top, extent.left_limit, extent.right_limit, sigma * colour, baseline)
    fits, start, contact, rise, errors = False, 0.0, 0.0, 0.0, UNKNOWN
    if flags == 0:
        fits, start, contact, rise, crest, errors = _by_shape(
            x, crest, extent, width, sigma, height, seen, keep, room
        )
    if not fits:
        edge = max(0.02 * height, min(3.0 * sigma, 0.25 * height))
        first = touch(x, top, -1, extent.left_limit, edge, seen.noise)
        last = touch(x, top, 1, extent.right_limit, edge, seen.noise)
        edges = touches(x, first, last, edge, seen)
        start, contact, rise = edges.start, edges.contact, top + shift - edges.start
        errors = edge_errors(x, edges, seen)
    start, contact = max(start, 0.0), contact + min(start, 0.0)
    contact = min(contact, len(x) - 1 - start)
    impulse = integral(x, start, start + contact)
    if contact <= 0.0 or crest <= 0.0 or impulse <= 0.0:
        return Pulse(0.0, 0.0, 0.0, 0.0, 0.0, NO_PULSE, UNKNOWN)
    rise = min(max(rise, 0.0), contact)
    end = start + contact
    errors = with_impulse(x, start, end, errors, seen)
    if level > 0.0:
        contact = 0.0
        share = level if relative else 0.0
        if relative:  # of the peak; of its sample, where a fit puts the peak far above that
            level *= crest if x[top] > level * crest else x[top]
        if relative or height > level:
            contact = crossing(x, top, 1, extent.right_limit, level)
            contact -= crossing(x, top, -1, extent.left_limit, level)
        errors = with_level(x, level, share, errors, seen)
    errors = unless_flagged(x, errors, flags, start, end, seen)
    if keep[SCALE] > 0.0:
        keep[TAKEN], keep[MADE] = lo + keep[ESTIMATE + START], lo + start
    if flags == 0:
        keep[ZERO], keep[BASE] = lo, base + baseline.at_top - baseline.tilt * top
        keep[TILT], keep[NOISE] = baseline.tilt, seen.noise
        keep[SEEN], keep[LEVEL] = lo + start, baseline.level
    return Pulse(lo + start, contact, crest, impulse, rise, flags, errors)


@kernel
def _by_shape(x, crest, extent, width, sigma, height, seen, keep, room):
    """Whether the family of shapes fits; start, contact, rise time and peak of the fit.

    And the standard errors, that of the impulse left out.
    """
    top = seen.top
    left_limit, right_limit = extent.left_limit, extent.right_limit
    pad = max(3, (extent.right - extent.left) // 2)
    a, b = max(left_limit, extent.left - pad), min(right_limit, extent.right + pad) + 1
    keep[FROM], keep[TO] = a, b
    per = (b - a + MAX_POINTS - 1) // MAX_POINTS
    count = (b - a) // per
    points, means, p = room.points[:count], room.means[:count], room.p
    # Noise of the averaged samples; a thousandth of the peak stands for a silent record's. A
    # few samples fit many shapes exactly: a hundredth leaves the choice to the priors.
    unit = max(sigma / math.sqrt(per), (1e-2 if width < 8 else 1e-3) * height)
    for k in range(count):
        points[k] = a + k * per + 0.5 * (per - 1)
        total = 0.0
        for i in range(a + k * per, a + (k + 1) * per):
            total += x[i]
        means[k] = total / (per * unit)
    # A quarter-sine is at 0.2 and 0.8 of its height after 0.128 and 0.590 of its length.
    # A faint pulse has no crossings to trust; it starts from the matched width.
    start, rise, fall, flat = top - 0.675 * width, 0.6 * width, 0.6 * width, 0.14 * width
    if height > 12.0 * sigma:
        early = crossing(x, top, -1, a, 0.2 * height)
        late = crossing(x, top, 1, b - 1, 0.2 * height)
        rise = max((crossing(x, top, -1, a, 0.8 * height) - early) / 0.462, 0.5)
        fall = max((late - crossing(x, top, 1, b - 1, 0.8 * height)) / 0.462, 0.5)
        start = early - 0.128 * rise
        flat = max(late + 0.128 * fall - start - rise - fall, 0.1 * (rise + fall))
        if rise + fall < STEEP * flat:
            # Sides with hardly a sample show no shape, and the priors would make up a foot.
            return False, 0.0, 0.0, 0.0, crest, UNKNOWN
    sloping = rise + fall > SLOPING * flat
    put_parameters(height / unit, start, rise, flat, fall, p)
    log_edge = math.log(0.6 * width)
    misfit, at = descend(points, means, log_edge, p, room.fit, None)
    fit = Fit(misfit, room.fit.normals[at], room.fit.curves[at])
    parts = parts_of(p)
    length = parts.rise + parts.flat + parts.fall
    # An edge beyond the valley to a neighbour would be read from the neighbour's samples.
    left_most = left_limit - 1.0 if a == left_limit else a - pad
    right_most = right_limit + 1.0 if b == right_limit + 1 else b + pad
    inside = p[1] > left_most and p[1] + length < right_most
    # What does not fit a faint pulse is not its shape, and its edges tell even less.
    faint = height < 8.0 * sigma
    fits = (fit.misfit < 2.0 or faint) and p[0] > 0.0 and inside
    errors = UNKNOWN
    nearly = inside and sloping and p[0] > 0.0 and math.sqrt(fit.misfit) < NEARLY * p[0]
    if fits or nearly:
        errors = fit_errors(points, log_edge, p, fit, per, unit, seen, keep, room.errors)
        keep[SCALE] = unit
    if fits and unit <= sigma:
        crest = p[0] * unit  # less noisy than the greatest sample
    elif fits:
        errors = with_crest(x, errors, seen)
    if unit > sigma:
        keep[UNIT] = 0.0
    return fits, p[1], length, parts.rise + 0.5 * parts.flat, crest, errors


@allocating
def measure_all(signal, origin, total, events, again, sigma, before, after, level, relative, out):
    """Measure the events marked in `again` into rows of `out`.

    The standard errors go into the columns from `ERRORS` on, the fits into those from `FIT` on.

    Parameters
    ----------
    signal : array
        Samples without hum, from sample `origin` on, of `total` in all.
    events : array (n, 4)
        Place of the response's crest, mean of its flanks, width, and how many times that of white
        noise its noise over the width is.
    sigma : float
        Noise of a sample.
    before, after : float
        Places of the crests before the first and after the last, -1 and `total` where none is.
    level, relative : float, bool
        That the contact time refers to; a share of the peak if relative.
    """
    widest = 0.0
    for k in range(len(events)):
        widest = max(widest, events[k, 2])
    longest = 2 * measure_reach(int(widest)) + 1 if len(events) else 0
    room = Room(
        np.empty((2, longest)),
        np.empty(MAX_POINTS),
        np.empty(MAX_POINTS),
        np.empty(PARAMETERS),
        room_to_fit(MAX_POINTS),
        room_for_errors(),
    )
    for k in range(len(events)):
        if not again[k]:
            continue
        peak = int(events[k, 0] + 0.5)
        previous = int(events[k - 1, 0] + 0.5) if k > 0 else int(before)
        following = int(events[k + 1, 0] + 0.5) if k + 1 < len(events) else int(after)
        pulse = measure_pulse(
            signal,
            origin,
            total,
            peak,
            events[k, 1],
            previous,
            following,
            int(events[k, 2]),
            sigma,
            events[k, 3],
            level,
            relative,
            out[k, FIT:],
            room,
        )
        out[k, 0], out[k, 1], out[k, 2] = pulse.start, pulse.contact, pulse.peak
        out[k, 3], out[k, 4], out[k, 5] = pulse.impulse, pulse.rise, pulse.flags
        errors = pulse.errors
        out[k, ERRORS], out[k, ERRORS + 1] = errors.start, errors.contact
        out[k, ERRORS + 2], out[k, ERRORS + 3] = errors.peak, errors.impulse
        out[k, SHARED] = out[k, SHARED_PEAK] = 0.0
