"""Standard errors of quantities measured from the samples of one pulse.

Of an edge: the noise of its samples over its slope. Those of a fit are in `fit_errors.py`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import kernel
from ..._trains.impact_flags import OPEN_END, OPEN_START, UNRESOLVED
from .edges import Baseline, crossing, edge_group


class Errors(NamedTuple):
    """Standard errors of start, contact [samples], peak and impulse."""

    start: float
    contact: float
    peak: float
    impulse: float


UNKNOWN = Errors(np.inf, np.inf, np.inf, np.inf)
JUMP_SEEN = 9.0
"""Standard deviations of the noise that a jump in the force must have: twice those of its own."""


class Seen(NamedTuple):
    """The samples of a pulse: top, extent, noise and baseline."""

    top: int
    left_limit: int
    right_limit: int
    noise: float  # of a sample, as large as that over the pulse would be if white
    baseline: Baseline


class Touch(NamedTuple):
    """Extrapolated ends of a pulse, with errors from noise and from curvature."""

    start: float
    contact: float
    start_noise: float
    contact_noise: float
    start_curve: float
    contact_curve: float


@kernel
def touches(x, start, end, level, seen):
    """Ends of a pulse extrapolated from `level`, with their errors."""
    first, bent = _touch_error(x, start, -1, seen.left_limit, level, seen)
    last, curved = _touch_error(x, end, 1, seen.right_limit, level, seen)
    return Touch(start, end - start, first, math.hypot(first, last), bent, math.hypot(bent, curved))


@kernel
def edge_errors(x, edges, seen):
    """Standard errors of a pulse measured from its edges and crest."""
    first = math.hypot(edges.start_noise, edges.start_curve)
    contact = math.hypot(edges.contact_noise, edges.contact_curve)
    return with_crest(x, Errors(first, contact, 0.0, 0.0), seen)


@kernel
def _touch_error(x, at, step, limit, level, seen):
    """Noise over slope, and half of the possible shift by curvature below the level."""
    foot = crossing(x, seen.top, step, limit, level)
    higher = crossing(x, seen.top, step, limit, 2.0 * level)
    out, run = abs(at - foot), max(abs(foot - higher), 0.5)
    group, slope = edge_group(x, seen.top, step, limit, level, seen.noise)
    # Of the three means, by the half of the parabola and of their line: v groups beyond the last.
    v = out / group
    bent = 0.25 * v * (v + 1.0)
    weight = math.sqrt((1.0 + v + bent) ** 2 + (v + 2.0 * bent) ** 2 + bent**2)
    # The end is kept within twice the line's.
    noise = min(seen.noise / (slope * math.sqrt(group)) * weight, out + 1.0)
    beside = _level_error(seen.baseline, at) * run / max(level, 1e-300)
    return math.hypot(noise, beside), 0.5 * abs(out - run)


@kernel
def with_crest(x, errors, seen):
    """Add the error of a peak that is the greatest of the samples near it."""
    near = 1
    for i in range(seen.left_limit, seen.right_limit + 1):
        near += x[i] > x[seen.top] - 3.0 * seen.noise
    noise = seen.noise * math.sqrt(1.0 + math.log(near))
    peak = math.hypot(noise, _level_error(seen.baseline, seen.top))
    return Errors(errors.start, errors.contact, peak, errors.impulse)


@kernel
def with_impulse(x, start, end, errors, seen):
    """Add the error of the sum of the samples between start and end.

    An end that is off by an error misses slope error^2 / 2, whose mean square is 3 slope^2
    error^4 / 4. Where a straight edge begins between two samples, at a share f of the way, the
    line between them is too great by slope f (1 - f)^2 / 2, whose mean square is slope^2 / 420.
    Where the force begins or ends with a jump, that is jump (f - 1/2), of mean square jump^2 / 12.
    """
    first, last = int(start) + 1, math.ceil(end) - 1
    slopes = 0.0
    if last - first >= 1:
        slopes = (x[first + 1] - x[first]) ** 2 + (x[last - 1] - x[last]) ** 2
    level = (end - start) * _level_error(seen.baseline, 0.5 * (start + end))
    late = math.sqrt(max(errors.contact**2 - errors.start**2, 0.0))
    steep = math.pi * x[seen.top] / (end - start)
    missed = 0.75 * steep**2 * (errors.start**4 + late**4)
    early = _jump(x, first, 1, x[seen.top], seen.noise)
    ending = _jump(x, last, -1, x[seen.top], seen.noise)
    edges = slopes / 420.0 + (early**2 + ending**2) / 12.0 + missed
    impulse = math.sqrt(seen.noise**2 * (end - start) + level**2 + edges)
    return Errors(errors.start, errors.contact, errors.peak, impulse)


@kernel
def _jump(x, first, step, height, noise):
    """How high a jump before the `first` sample of an edge, or the next, is; 0 unless it is seen.

    It is what the difference of two samples has more than a line through the next two has. The
    force has risen since the jump, in the mean for half a sample. What begins above the baseline,
    or does not go on rising, is the corner of a steep edge; more than half of the height, an edge
    of hardly a sample.
    """
    if not 3 <= first < len(x) - 3:
        return 0.0
    at = first
    jump = _more_than_a_line(x, at, step)
    if _more_than_a_line(x, at + step, step) > jump:
        at += step
        jump = _more_than_a_line(x, at, step)
    rise, after = x[at + step] - x[at], x[at + 2 * step] - x[at + step]
    seen = jump > JUMP_SEEN * noise and x[at - step] < 0.25 * jump and jump < 0.5 * height
    return jump + max(0.5 * rise, 0.0) if seen and after > 0.5 * rise else 0.0


@kernel
def _more_than_a_line(x, at, step):
    """By how much a sample is farther above the one before than a line through the next two is."""
    return 3.0 * (x[at] - x[at + step]) - x[at - step] + x[at + 2 * step]


@kernel
def with_level(x, level, share, errors, seen):
    """Add the error of the contact time between the crossings of `level`.

    `share` of the peak, whose error moves the level as that of the baseline does.
    """
    if x[seen.top] <= level:
        known = x[seen.top] + 3.0 * errors.peak < level
        return Errors(errors.start, 0.0 if known else np.inf, errors.peak, errors.impulse)
    beside = math.hypot(_level_error(seen.baseline, seen.top), share * errors.peak)
    early = _steepness(x, -1, seen.left_limit, level, seen)
    late = _steepness(x, 1, seen.right_limit, level, seen)
    # Between two samples their noise counts by (1 - f)^2 + f^2, 2/3 in the mean.
    noise = math.sqrt(2.0 / 3.0) * seen.noise * math.hypot(early, late)
    contact = math.hypot(noise, beside * (early + late))
    contact = math.hypot(contact, _noise_above(level, seen.noise))
    return Errors(errors.start, contact, errors.peak, errors.impulse)


@kernel
def _noise_above(level, noise):
    """Root mean square of the samples after either end of a pulse in which noise exceeds a level.

    They are geometrically distributed; mean and variance of both ends add up.
    """
    if noise <= 0.0:
        return 0.0
    chance = 0.5 * math.erfc(math.sqrt(0.5) * level / noise)
    mean = chance / (1.0 - chance)
    return math.sqrt(4.0 * mean**2 + 2.0 * mean / (1.0 - chance))


@kernel
def _steepness(x, step, limit, level, seen):
    """Samples per unit of height of an edge, around a level."""
    wide = max(2.0 * seen.noise, 0.05 * level, 1e-300)
    below, above = min(wide, 0.5 * level), min(wide, 0.5 * (x[seen.top] - level))
    low = crossing(x, seen.top, step, limit, level - below)
    high = crossing(x, seen.top, step, limit, level + above)
    return abs(low - high) / (below + above)


@kernel
def unless_flagged(x, errors, flags, start, end, seen):
    """Set errors to infinity for quantities that the record does not contain.

    A pulse that is measured as far as the valley to a neighbour may begin or end half its way
    from there to its crest off, and what lies under the neighbour is missing from its impulse.
    """
    first, length, peak, impulse = errors.start, errors.contact, errors.peak, errors.impulse
    if flags & UNRESOLVED:
        for at in (start, end):
            value = x[int(at + 0.5)]
            if value > 0.2 * x[seen.top]:
                off = 0.5 * abs(seen.top - at)
                first = math.hypot(first, off) if at == start else first
                length = math.hypot(length, off)
                impulse = math.hypot(impulse, value * off)
    if flags & (OPEN_START | OPEN_END):
        length = impulse = np.inf
        first = np.inf if flags & OPEN_START else first
        if seen.top in (0, len(x) - 1):
            peak = np.inf
    return Errors(first, length, peak, impulse)


@kernel
def _level_error(baseline, at):
    """Standard error of the baseline at a sample."""
    return math.hypot(baseline.level, baseline.slope * (at - baseline.centre))
