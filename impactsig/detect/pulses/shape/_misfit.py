"""Corrections for pulses whose shape is, or may be, outside the fitted family.

What the family leaves of the pulses of a span, over their heights, has the mean square r^2. By
instants and ends of many shapes, fits of such pulses are off by OFF_START r and OFF_END r
contact times, and peaks, once the rest of the shape is added at the crest, by OFF_CREST of it or
OFF_PEAK r. With these as prior, the mean edges of the clear pulses say which way (`_touch.py`),
and all instants and ends of the span move. Soft edges, which noise does not tell from those of a
force k x^p, are put between them and the family.
"""

from __future__ import annotations

import math

import numpy as np

from ...._compiling.compiled import allocating, kernel
from .._model import POWER, POWERS, parts_of
from ..edges import ERRORS, FIT, SHARED, SHARED_PEAK
from ..fit_errors import LEFT, LEFT_SD, MADE, NOW, UNIT
from ._common_rest import crest_of, is_clear
from ._shared_shape_kernels import BRIEF
from ._touch import STRETCHES, add_edges, read_touch

OFF_START, OFF_END, OFF_PEAK, OFF_CREST = 1.2, 1.8, 0.15, 0.1
COARSE, BETWEEN, FEWEST = 0.13, 0.16, 5.0
"""Samples that a touch with a misfit is off by: over those on its edge, and over the root of the
clear pulses, or so many, which begin anywhere between two samples."""
FINE = 9.0
"""Samples on an edge: with more, the latter is over the root of those of all pulses."""
UNSEEN, UNSEEN_FLAT = 0.075, 0.25
"""Of a sample, over the samples of an edge: how far off its touch is where no misfit shows, and
where the pulse has a flat top: where an edge of few samples turns into that is not seen."""
JUMP, JUMPS, JUMPED = 0.4, 0.5, 0.2
"""Samples that a touch is off by where the force begins with a jump, which lies anywhere between
two samples: where that logarithm is less than the family's by JUMPS, in full by JUMPED more."""
FEW_SHARED = 0.7
"""Of that, what all pulses of a span are off by."""
STEEP, FEW = 1.05, 8.0
"""Power, of 1 at least, and samples up to which an edge may be of infinite slope: its touch lies
between two samples, wherever these fall, and the error of it is not shared."""
SOFT = 0.054
"""Of an edge, times the square of the logarithm of its power: how much later than sin^q a contact
of force k x^p begins that sin^q follows, for p of 1.25 to 2. No noise shows which of the two it is,
so it is put between them, by half with half as its error."""
SINE, SOFTEST = 0.05, 1.5
"""Logarithms of the power up to which an edge is that of a half-sine, and from which it is moved no
more."""
SOFTER = 5.0
"""Times that half, how far from there the touch of a soft edge with a misfit may be."""
FAR = 0.1
"""Of the height: what the rest of the shape has more, the family is away from the pulses."""
FARTHEST = 0.4
"""Contact times that a fit is moved."""


@allocating
def correct_misfit(rows, alike, x, origin, left, held, rest, timed):
    """Correct instants and contact times for misfit, in place, and increase their errors.

    Parameters
    ----------
    rows : array
        As `impactsig.detect.pulses.pulse.measure_all` fills them.
    alike : array of int
        The rows that are measured by a fit.
    x, origin : array, int
        The samples that they were measured in, and the place of the first.
    left : float
        What `what_is_left` returns.
    held : float
        The same for the family as it is held where it has a `rest`; else 0.
    rest : array
        What `common_rest` returns.
    timed : bool
        Contact times are those from first to last touch.
    """
    rise, fall, early, late = _mean_edges(rows, alike)
    edges = np.zeros((2, STRETCHES, 3))
    add_edges(rows, alike, x, origin, rise, fall, edges)
    r = math.hypot(math.sqrt(left), max(math.sqrt(held) - FAR, 0.0))
    soft, softer = _later(math.log(early)), _later(math.log(late))
    early_off = math.hypot(OFF_START * r / rise, SOFTER * soft)
    late_off = math.hypot(OFF_END * r / fall, SOFTER * softer)
    start, start_variance, rises = read_touch(edges[0], early, soft, early_off)
    end, end_variance, falls = read_touch(edges[1], late, softer, late_off)
    clear = 0
    for k in alike:
        clear += is_clear(rows[k])
    start, end = start * rise, -end * fall
    start_variance, end_variance = start_variance * rise**2, end_variance * fall**2
    start, end = min(max(start, -FARTHEST), FARTHEST), min(max(end, -FARTHEST), FARTHEST)
    crest, peak = crest_of(rest, math.sqrt(early * late))
    # A misfit does not hide the height of a flat top.
    off_peak = OFF_PEAK / (1.0 + max(1.0 - rise - fall, 0.0) / (0.5 * BRIEF * (rise + fall)))
    peak += max((crest * OFF_CREST) ** 2, (off_peak * r) ** 2)
    for k in alike:
        row = rows[k]
        contact = row[1] if timed else _length(row)
        row[0] = max(row[0] + start * contact, 0.0)
        row[ERRORS] = math.sqrt(row[ERRORS] ** 2 + start_variance * contact**2)
        if early > STEEP or rise * _length(row) > FEW:
            row[SHARED] = math.sqrt(row[SHARED] ** 2 + start_variance * contact**2)
        if timed:
            row[1] += (end - start) * contact
            more = (start_variance + end_variance) * contact**2
            row[ERRORS + 1] = math.sqrt(row[ERRORS + 1] ** 2 + more)
        length = _length(row)
        _add_touches(
            row,
            math.hypot(_between(rise * length, clear), _coarse(rise * length, rises)),
            math.hypot(_between(fall * length, clear), _coarse(fall * length, falls)),
            _coarse(rise * length, rises),
            0.0,
            timed,
        )
        if row[FIT + UNIT] > 0.0:
            row[2] *= 1.0 + crest
            row[ERRORS + 2] = math.sqrt(row[ERRORS + 2] ** 2 + peak * row[2] ** 2)
            row[SHARED_PEAK] = math.sqrt(row[SHARED_PEAK] ** 2 + peak * row[2] ** 2)


@kernel
def allow_for_unseen(rows, alike, hidden, timed):
    """Correct pulses that the family follows for what samples do not show, and their errors.

    Few samples on an edge, a rest of mean square `hidden` that may be noise, and what law soft
    edges follow.
    """
    r = math.sqrt(hidden)
    for k in alike:
        parts = parts_of(rows[k, FIT + NOW :])
        rise, fall = _samples_on(parts.rise), _samples_on(parts.fall)
        flat = min(parts.flat / math.sqrt(rise * fall), 1.0)
        few = UNSEEN + (UNSEEN_FLAT - UNSEEN) * flat
        length = parts.rise + parts.flat + parts.fall
        p = rows[k, FIT + NOW :]
        early = _later(p[POWER] + p[POWERS]) * parts.rise
        late = _later(p[POWER] - p[POWERS]) * parts.fall
        rows[k, 0] += early
        rows[k, SHARED] = math.hypot(rows[k, SHARED], early)
        if timed:
            rows[k, 1] -= early + late
        first = math.hypot(few / rise, OFF_START * r * length)
        last = math.hypot(few / fall, OFF_END * r * length)
        _add_touches(rows[k], math.hypot(first, early), math.hypot(last, late), first, 1.0, timed)


@kernel
def doubt_unlike(rows, alike, timed):
    """Increase the errors of pulses whose fit misses more of them than of those `alike`.

    They have only their single fits, so each is off by what its own leaves.
    """
    at = 0
    for k in range(len(rows)):
        if at < len(alike) and alike[at] == k:
            at += 1
            continue
        row = rows[k]
        if row[5] == 0 and row[FIT + MADE] == row[0] and row[FIT + LEFT] > 0.0:
            off = math.sqrt(row[FIT + LEFT]) * _length(row)
            row[ERRORS] = math.hypot(row[ERRORS], OFF_START * off)
            if timed:
                row[ERRORS + 1] = math.hypot(row[ERRORS + 1], math.hypot(OFF_START, OFF_END) * off)


@kernel
def _later(power):
    """How much later than in the family an edge of such a power begins, by half [edges].

    From the logarithm of the power. It is the error of that, too.
    """
    return 0.5 * SOFT * min(power, SOFTEST) ** 2 if power > SINE else 0.0


@kernel
def _samples_on(edge):
    """Samples on an edge, one at least: a touch lies between two."""
    return max(edge, 1.0)


@kernel
def _coarse(edge, steeper):
    """How far off a touch with a misfit is for want of samples on its edge [samples]."""
    few = COARSE / _samples_on(edge)
    return math.hypot(few, JUMP * min(max((steeper - JUMPS) / JUMPED, 0.0), 1.0))


@kernel
def _between(edge, clear):
    """The same for want of pulses that begin elsewhere between two samples."""
    return BETWEEN / math.sqrt(max(clear, FEWEST) * max(edge / FINE, 1.0))


@kernel
def _add_touches(row, first, last, few, together, timed):
    """Add errors of the touches [samples], of correlation -`together`."""
    row[ERRORS] = math.hypot(row[ERRORS], first)
    row[SHARED] = math.hypot(row[SHARED], FEW_SHARED * few)
    if timed:
        both = first * first + last * last + 2.0 * together * first * last
        row[ERRORS + 1] = math.sqrt(row[ERRORS + 1] ** 2 + both)


@kernel
def what_is_left(rows, alike):
    """Mean square of what the family leaves of the pulses, over their heights; its error."""
    total = weight = 0.0
    for k in alike:
        kept = rows[k, FIT:]
        if kept[LEFT_SD] > 0.0:
            one = kept[LEFT_SD] ** -2.0
            total += one * kept[LEFT]
            weight += one
    if weight <= 0.0:
        return 0.0, np.inf
    return total / weight, 1.0 / math.sqrt(weight)


@kernel
def _length(row):
    """Fitted length of a pulse, whatever level its contact time refers to."""
    parts = parts_of(row[FIT + NOW :])
    return parts.rise + parts.flat + parts.fall


@kernel
def _mean_edges(rows, alike):
    """Mean shares of rise and fall in the lengths of pulses, and the powers of both edges."""
    rise = fall = early = late = total = 0.0
    for k in alike:
        p, height = rows[k, FIT + NOW :], rows[k, 2]
        parts = parts_of(p)
        length = parts.rise + parts.flat + parts.fall
        one = height * height
        rise += one * parts.rise / length
        fall += one * parts.fall / length
        early += one * (p[POWER] + p[POWERS])
        late += one * (p[POWER] - p[POWERS])
        total += one
    return rise / total, fall / total, math.exp(early / total), math.exp(late / total)
