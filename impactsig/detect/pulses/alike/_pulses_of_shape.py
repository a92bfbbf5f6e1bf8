"""One pulse, or two that touch, measured as pulses of a given shape."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..edges import ERRORS, SHARED, SHARED_PEAK
from ._alike_kernels import BOTH, fit_two

BESIDE = 0.5  # contact times on either side of a pair that are fitted with it
POINTS = 64  # means of samples in a contact, at most
NOWHERE = 1e9  # where the second of one pulse begins
MISFIT, SHAPE = 2.0, 0.02  # residual variance over the noise's, or over the height's square
PLACED = 0.4  # contact times that crests may be off from where they were
AS_LONG = 1.8  # times the usual contact, or less by as much, that one of a pair may last
RUNS = 8.0  # runs of alike rest in a contact, where the shape misses more than noise
SIZES = 4  # start, contact time, peak and impulse


class Shape(NamedTuple):
    """Shape of pulses, and what is known of measurements by it."""

    knots: np.ndarray
    crest: float  # contact times since the start
    area: float  # over height and contact time
    length: float  # mean logarithm of the contact time
    spread: float
    errors: np.ndarray  # of start, contact time, peak, impulse: what pulses share of them
    off: np.ndarray  # by how much single pulses differ from the mean shape in these
    single: np.ndarray  # errors of these by noise, over it
    shared: np.ndarray  # of start and peak


class Stretch(NamedTuple):
    """Means of samples about one or two pulses, in units of their noise."""

    points: np.ndarray  # counted from `zero`
    means: np.ndarray
    zero: float
    unit: float
    per: int
    crests: np.ndarray
    height: float


def between(rows: np.ndarray, first: int, last: int) -> tuple[float, float]:
    """End of the pulse before some, and start of that after them."""
    before = float(rows[first - 1, 0] + rows[first - 1, 1]) if first > 0 else 0.0
    return before, float(rows[last + 1, 0]) if last + 1 < len(rows) else np.inf


def stretch_of(
    some: np.ndarray,
    usual: float,
    first: float,
    last: float,
    noise: float,
    x: np.ndarray,
    origin: int,
) -> Stretch | None:
    """The samples about one or two pulses between their neighbours, None where they are too few."""
    crests = some[:, 0] + some[:, 4]
    margin = (1.0 + BESIDE) * usual
    begin = max(int(crests[0] - margin), int(first) + 1, origin)
    end = int(min(crests[-1] + margin + 1.0, last, origin + len(x)))
    per = max(int(usual) // POINTS, 1)
    count = (end - begin) // per
    height = float(some[:, 2].max())
    if count < 2 * BOTH or not height > 0.0:
        return None
    unit = max(noise / math.sqrt(per), 1e-3 * height)
    means = x[begin - origin : begin - origin + count * per].reshape(count, per).mean(axis=1) / unit
    # Rounding takes least of times that are counted from here.
    points = per * np.arange(count) + 0.5 * (per - 1)
    return Stretch(points, means, float(begin), unit, per, crests - begin, height)


def descend(some: np.ndarray, seen: Stretch, shape: Shape) -> tuple[np.ndarray, np.ndarray, float]:
    """Parameters of one or two pulses of a shape, their covariance and the misfit."""
    p, covariance = np.zeros(BOTH), np.zeros((BOTH, BOTH))
    p[2] = p[5] = shape.length
    p[4] = NOWHERE
    p[BOTH - 1] = min(seen.means[:3].mean(), seen.means[-3:].mean())
    for m, row in enumerate(some):
        p[3 * m] = max(row[2], 0.1 * seen.height) / seen.unit
        p[3 * m + 1] = seen.crests[m] - shape.crest * math.exp(shape.length)
    misfit = fit_two(
        seen.points, seen.means, shape.knots, shape.length, shape.spread, p, covariance
    )
    runs = math.exp(shape.length) / (seen.per * RUNS)
    covariance *= 1.0 + max(misfit - 1.0, 0.0) * max(runs, 1.0)
    return p, covariance, misfit


def fit_shape(
    some: np.ndarray, seen: Stretch, shape: Shape
) -> tuple[np.ndarray, np.ndarray, float] | None:
    """The same; None where pulses of the shape do not fit."""
    p, covariance, misfit = descend(some, seen, shape)
    high = (SHAPE * seen.height / seen.unit) ** 2
    heights, starts, logs = (p[m : 3 * len(some) : 3] for m in range(3))
    if not misfit <= max(MISFIT, high) or not (heights > 0.0).all():
        return None
    lengths = np.exp(logs)
    off = np.abs(starts + shape.crest * lengths - seen.crests)
    if (off > PLACED * lengths).any() or (np.abs(logs - shape.length) > math.log(AS_LONG)).any():
        return None
    return (p, covariance, misfit) if seen.zero + starts[0] >= 0.0 else None


def put(
    row: np.ndarray, p: np.ndarray, covariance: np.ndarray, seen: Stretch, shape: Shape
) -> None:
    """Write one pulse with its errors into a row."""
    length, peak = math.exp(p[2]), p[0] * seen.unit
    impulse = shape.area * peak * length
    row[0], row[1], row[2], row[3] = seen.zero + p[1], length, peak, impulse
    row[4], row[5] = shape.crest * length, 0.0
    relative = covariance[0, 0] / p[0] ** 2
    both = relative + covariance[2, 2] + 2.0 * covariance[2, 0] / p[0]
    own = (covariance[1, 1], length**2 * covariance[2, 2], peak**2 * relative, both * impulse**2)
    sizes = (length, length, peak, impulse)
    noise = seen.unit * math.sqrt(seen.per)
    for q in range(SIZES):
        error = math.sqrt(max(own[q], 0.0))
        # What moves an end by much where only noise does also does where the shape is another.
        less = max(error * peak / (sizes[q] * noise * shape.single[q]), 1.0)
        rest = math.hypot(shape.errors[q], shape.off[q] * less) * sizes[q]
        row[ERRORS + q] = math.hypot(error, rest)
    row[SHARED], row[SHARED_PEAK] = shape.shared[0] * length, shape.shared[1] * peak


def measure_by_shape(two: np.ndarray, seen: Stretch, shape: Shape) -> bool:
    """Measure a pair by a shape; whether it fits."""
    if (found := fit_shape(two, seen, shape)) is None:
        return False
    p, covariance, _ = found
    for m, row in enumerate(two):
        own = slice(3 * m, 3 * m + 3)
        put(row, p[own], covariance[own, own], seen, shape)
    return True
