"""Joint measurement of two pulses that overlap, as half-sines."""

from __future__ import annotations

import math

import numpy as np

from ..._compiling.compiled import allocating, kernel
from ..._trains.impact_flags import UNRESOLVED
from ..signal.ladder import MATCH
from ._fit import fit_pair
from ._small_matrices import factor, invert
from .edges import ERRORS
from .pair_fit import PAIR, begin_pair, pair_cost
from .touching_kernels import PER_WIDTH, look_around, to_samples

NEAR = 1.15  # mean lengths between two crests: pulses further apart are measured one by one
MISFIT, SHAPE = 2.0, 0.01  # residual variance over the noise's, or of the height: as in a pulse
PLACED = 0.3  # lengths that a fitted crest may be off the crest of the response


@kernel
def _may_overlap(first, second):
    """Whether two events are close enough to be a pair."""
    apart = second[0] - first[0]
    return 2.0 <= apart <= NEAR * 0.5 * (first[2] + second[2]) / MATCH


@kernel
def with_partners(events, again, out):
    """Mark the events to be measured again, with their possible partners; whether any has one."""
    for k in range(len(out)):
        out[k] = again[k]
    for k in range(1, len(out)):
        out[k] |= out[k - 1] and _may_overlap(events[k - 1], events[k])
    any_pair = False
    for k in range(len(out) - 1, 0, -1):
        pair = out[k] and _may_overlap(events[k - 1], events[k])
        out[k - 1] |= pair
        any_pair |= pair
    return any_pair


@allocating
def measure_pairs(signal, origin, events, again, sigma, level, relative, out):
    """Measure pulses in pairs again, in the rows of `out`, where two half-sines fit.

    Parameters
    ----------
    signal, origin, events, again, sigma, level, relative
        As `impactsig.detect.pulses.pulse.measure_all` takes them; `again` with partners.
    out : array (n, 7 or more)
        Start, contact, peak, impulse, rise, flags and whether the pulse is clipped.
    """
    p, errors = np.empty(PAIR), np.empty((2, 4))
    k = 0
    while k + 1 < len(events):
        alone = out[k, 5] > 0 and int(out[k, 5]) != UNRESOLVED
        alone |= out[k + 1, 5] > 0 and int(out[k + 1, 5]) != UNRESOLVED
        alone |= out[k, 6] > 0 or out[k + 1, 6] > 0
        alone |= not again[k] or not _may_overlap(events[k], events[k + 1])
        if alone or not _fit(signal, origin, events[k], events[k + 1], sigma, p, errors):
            k += 1
            continue
        for m in range(2):
            row, height, length = out[k + m], p[3 * m], math.exp(p[3 * m + 2])
            row[0], row[1], row[2] = p[3 * m + 1], length, height
            row[3], row[4], row[5] = 2.0 / math.pi * height * length, 0.5 * length, 0.0
            for q in range(4):
                row[ERRORS + q] = errors[m, q]
            if level > 0.0:
                share = level if relative else level / height
                row[1] *= 1.0 - 2.0 / math.pi * math.asin(min(share, 1.0))
        k += 2


@allocating
def _fit(signal, origin, first, second, sigma, p, errors):
    """Whether two half-sines fit; writes heights, starts and lengths [samples] into `p`.

    Standard errors of start, contact, peak and impulse go into the two rows of `errors`.
    """
    length = 0.5 * (first[2] + second[2]) / MATCH
    apart = second[0] - first[0]
    points, means = np.empty(8 * PER_WIDTH), np.empty(8 * PER_WIDTH)
    width = MATCH * (apart + length)
    height = 0.0
    for i in range(int(first[0]) - origin, int(second[0]) - origin + 1):
        height = max(height, signal[i] - first[1])
    middle = 0.5 * (first[0] + second[0])
    seen = look_around(signal, origin, middle, width, height, first[1], sigma, points, means)
    points, means = points[: seen.points], means[: seen.points]
    if seen.points == 0 or not begin_pair(points, means, seen.left, seen.right, p):
        return False
    misfit = fit_pair(points, means, p)
    if misfit > max(MISFIT, (SHAPE * height / seen.unit) ** 2) or min(p[0], p[3]) <= 0.0:
        return False
    if not _standard_errors(points, means, p, misfit, seen, errors):
        return False
    to_samples(p, seen)
    for m in range(2):
        length = math.exp(p[3 * m + 2])
        crest = first[0] if m == 0 else second[0]
        if abs(p[3 * m + 1] + 0.5 * length - crest) > PLACED * length:
            return False
    return p[1] >= 0.0


@allocating
def _standard_errors(points, means, p, misfit, seen, errors):
    """Standard errors from the posterior covariance, scaled by the misfit if above noise.

    False where the samples do not determine the pair: one of the two is next to nothing.
    """
    normal = np.empty((PAIR, PAIR + 1))
    pair_cost(p, points, means, normal)
    for i in range(PAIR):
        normal[i, i] *= 1.0 + 1e-9
    factors, covariance = normal[:, :PAIR], np.empty((PAIR, PAIR))
    if not factor(factors):
        return False
    invert(factors, covariance)
    covariance *= max(misfit, 1.0)
    for m in range(2):
        a, start, log = 3 * m, 3 * m + 1, 3 * m + 2
        height, length = p[a], math.exp(p[log])
        errors[m, 0] = seen.per * math.sqrt(covariance[start, start])
        errors[m, 1] = seen.per * length * math.sqrt(covariance[log, log])
        errors[m, 2] = seen.unit * math.sqrt(covariance[a, a])
        relative = covariance[a, a] / height**2 + covariance[log, log]
        relative += 2.0 * covariance[log, a] / height
        impulse = 2.0 / math.pi * height * length * seen.unit * seen.per
        errors[m, 3] = impulse * math.sqrt(max(relative, 0.0))
    return True
