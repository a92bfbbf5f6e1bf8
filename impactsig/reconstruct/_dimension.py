"""From a series to the slope of its correlation sum, and to the dimension of its attractor."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.special import stdtrit

from ._faults import with_faults
from ._fits import Fit, least_squares
from ._kernel_sum import FLOOR, LARGEST, LEAST_PAIRS, KernelSum, kernel_sum
from ._noise import Noise
from ._slope import Slope, slope
from ._unrelated import steepened
from .dimension import CorrelationDimension, ScaleSlope

KAPPA = 0.15
"""The slope over W e-folds misses the dimension by KAPPA / W, as a standard error."""

LEAST_SPAN = 1.6
"""W from which on a dimension is read."""

FIRST_EMBEDDING, MOST_EMBEDDING = 3, 8

STEEP, LARGEST_STEEP = 1.5, 0.01
"""Above that slope the extent of the attractor shows from this K on."""

RISES = 0.15
"""What a further coordinate may add to the slope; of noise it adds nearly one.

Where a motion expands distances beyond the scales within the time of a vector, its last coordinates
look like noise, and the slope is too high by about as much.
"""

DOSES = 3
"""Times that missed and spurious impacts are put in once more."""

MOST_FAULTS = 0.12
"""Share of missed and spurious impacts, together, beyond which no dimension is read."""

MOST_REPEATED = 0.01
"""Share of vectors equal to an earlier one, without rounding, beyond which nothing is counted."""

FEWEST_SCALES = 3
"""Of a slope."""

FEW = 200
"""Vectors below which too few pairs decide for 95 % intervals."""


class Setting(NamedTuple):
    """What is counted, and how; all lengths but `resolution` in units of `unit`."""

    values: np.ndarray
    delay: int
    theiler: int
    floor: float
    scales: tuple[float, float] | None
    missed: float
    spurious: float
    unit: float
    resolution: float
    workers: int | None
    fit: Fit = least_squares

    def sums(
        self,
        noise: Noise,
        m: int,
        scales: tuple[float, float] | None,
        largest: float = LARGEST,
        values: np.ndarray | None = None,
    ) -> KernelSum | None:
        """K(H) in one embedding."""
        return kernel_sum(
            self.values if values is None else values,
            m,
            self.delay,
            self.theiler,
            noise.covariance(m, self.delay),
            self.floor,
            self.workers,
            largest,
            scales,
        )


class _Read(NamedTuple):
    embedding: int
    sums: KernelSum
    slope: Slope


def estimate(given: Setting, noise: Noise, embedding: int | None) -> CorrelationDimension:
    """Slope and dimension of a series that is a motion; see `dimension`."""
    warnings: list[str] = []
    floor = given.unit * max(given.floor, FLOOR * noise.of_value)
    common: dict[str, Any] = {
        "noise": given.unit * noise.of_value,
        "timing_error": given.unit * noise.timing,
        "noise_source": noise.source,
        "resolution": given.resolution,
        "floor": floor,
        "delay": given.delay,
        "theiler": given.theiler,
        "missed": given.missed,
        "spurious": given.spurious,
    }
    if given.resolution:
        warnings.append(f"values rounded to {given.resolution:.3g}")
    again = 0.0 if given.resolution else repeated(given)
    read = _read(given, noise, embedding) if again < MOST_REPEATED else None
    if again >= MOST_REPEATED:
        reason = f"{again:.1%} of the values are a copy of an earlier stretch"
        return CorrelationDimension("no scales", None, None, reason=reason, **common)
    if read is None:
        reason = (
            f"no scale above {floor:.3g} holds {LEAST_PAIRS:.0f} pairs of neighbours"
            if floor
            else f"no scale holds {LEAST_PAIRS:.0f} pairs of neighbours"
        )
        return CorrelationDimension(
            "no scales", None, None, reason=reason, warnings=tuple(warnings), **common
        )
    sums, found, m = read.sums, read.slope, read.embedding
    value, errors = found.value, {"chance": found.error}
    # The higher noise has the higher floor; both are read over what is left.
    if noise.other is not None and any(noise.other):
        errors["noise"] = _moved_by_noise(given, noise, read)
    if given.missed or given.spurious:
        shift = _shift_by_faults(given, noise, read)
        value -= shift
        errors["missed and spurious impacts"] = abs(shift)
    if sums.vectors < FEW:
        warnings.append(f"{sums.vectors} vectors are few: such intervals hold less often than 95 %")
    blocks = len(sums.parts)
    reach = float(stdtrit(blocks - 1, 0.975))
    half = reach * math.hypot(*errors.values())
    low, high = (given.unit * scale for scale in found.scales)
    result = ScaleSlope(value, (value - half, value + half), (low, high), m, errors)
    common.update(
        slope=result,
        scales=given.unit * sums.scales,
        sums=sums.sums,
        slopes=found.local,
        slope_errors=reach * found.local_errors,
        warnings=tuple(warnings),
    )
    rise = _rise(given, noise, read) if found.span >= LEAST_SPAN else 0.0
    reason, needed = _why_not(given, noise, read, value, rise)
    if reason:
        return CorrelationDimension("slope", None, None, reason=reason, needed=needed, **common)
    half = reach * math.hypot(*errors.values(), KAPPA / found.span, max(rise, 0.0))
    return CorrelationDimension("dimension", value, (value - half, value + half), **common)


def repeated(given: Setting) -> float:
    """Share of the vectors of three values that stand before in the very same numbers."""
    vectors = np.lib.stride_tricks.sliding_window_view(given.values, FIRST_EMBEDDING)
    vectors = vectors[~np.isnan(vectors).any(axis=1)]
    return 1 - len(np.unique(vectors, axis=0)) / len(vectors)


def _read(given: Setting, noise: Noise, embedding: int | None) -> _Read | None:
    """The slope in the embedding given, or in the first with more than 2 D coordinates."""
    m, largest, read = embedding or FIRST_EMBEDDING, LARGEST, None
    while True:
        sums = given.sums(noise, m, given.scales, largest)
        if sums is None or len(sums.scales) < FEWEST_SCALES:
            return read
        if given.scales is None:
            sums = sums.smallest(_related(given, noise, m, sums))
        read = _Read(m, sums, slope(sums, given.fit))
        wanted = min(math.floor(2 * read.slope.value) + 1, MOST_EMBEDDING)
        if embedding is not None or wanted <= m:
            wanted = m
        steep = read.slope.value > STEEP and given.scales is None and largest == LARGEST
        if wanted == m and not steep:
            return read
        m, largest = wanted, LARGEST_STEEP if steep else largest


def _related(given: Setting, noise: Noise, m: int, sums: KernelSum) -> int:
    """How many of the scales are to be read: where slopes rise and unrelated vectors explain it.

    The largest are left out. Slopes also rise where an attractor is lacunar, and unrelated vectors
    may not show because its extent lessens the slope: neither alone is a reason.
    """
    chance = steepened(sums.scales, sums.sums, given.values, m, given.theiler, noise.of_value**2)
    logs, values = np.log(sums.scales), np.log(sums.sums)
    count = len(logs)
    while count > FEWEST_SCALES and chance[count - 1] > RISES:
        last, rest = slice(count - FEWEST_SCALES, count), slice(count - 1)
        if least_squares(logs[last], values[last]) - least_squares(logs[rest], values[rest]) < (
            RISES
        ):
            break
        count -= 1
    return count


def _again(
    given: Setting, noise: Noise, read: _Read, m: int, values: np.ndarray | None = None
) -> float | None:
    """The slope over the same scales of another embedding, noise or series."""
    sums = given.sums(noise, m, read.slope.scales, values=values)
    return (
        None if sums is None or len(sums.scales) < FEWEST_SCALES else slope(sums, given.fit).value
    )


def _moved_by_noise(given: Setting, noise: Noise, read: _Read) -> float:
    """How far the slope moves if the noise is a standard error higher."""
    assert noise.other is not None
    high = Noise(*noise.other, "")
    low, top = read.slope.scales
    floor = max(low, FLOOR * high.of_value)
    if top < 2 * floor:
        return 0.5  # as good as unknown
    moved = []
    for one in (noise, high):
        sums = given.sums(one, read.embedding, (floor, top))
        if sums is None or len(sums.scales) < FEWEST_SCALES:
            return 0.5
        moved.append(slope(sums, given.fit).value)
    return abs(moved[1] - moved[0])


def _shift_by_faults(given: Setting, noise: Noise, read: _Read) -> float:
    """By how much as many missed and spurious impacts again would raise the slope."""
    shifts = []
    for seed in range(DOSES):
        dosed = with_faults(given.values, given.missed, given.spurious, seed)
        again = _again(given, noise, read, read.embedding, dosed)
        if again is not None:
            shifts.append(again - read.slope.value)
    return float(np.mean(shifts)) if shifts else 0.5


def _rise(given: Setting, noise: Noise, read: _Read) -> float:
    """What one more coordinate adds to the slope over the same scales."""
    sums = given.sums(noise, read.embedding + 1, read.slope.scales)
    if sums is None or len(sums.scales) < FEWEST_SCALES:
        return math.inf
    same = read.sums.largest(len(sums.scales))
    return slope(sums, given.fit).value - slope(same, given.fit).value


def _why_not(
    given: Setting, noise: Noise, read: _Read, value: float, rise: float
) -> tuple[str, str]:
    """Why the slope is not the dimension of the attractor, and what would be needed."""
    span, (low, top) = read.slope.span, read.slope.scales
    unit = given.unit
    if given.missed + given.spurious > MOST_FAULTS:
        return (
            f"{given.missed + given.spurious:.0%} of the impacts are missed or spurious, beyond "
            f"{MOST_FAULTS:.0%} no dimension is read",
            "repair the train first (repair_intervals)",
        )
    if read.embedding >= MOST_EMBEDDING:
        return f"the slope asks for more than {MOST_EMBEDDING} coordinates", "a simpler motion"
    if span >= LEAST_SPAN:
        if rise <= RISES:
            return "", ""
        if not math.isfinite(rise):
            return (
                "with a further coordinate too few pairs are left to see whether the slope rises",
                "more impacts",
            )
        return (
            f"the slope still rises with a further coordinate, from {read.slope.value:.2f} by "
            f"{rise:.2f}, as that of noise does, or of a motion that expands distances beyond "
            "these scales within a vector",
            "smaller scales: less noise, or more impacts",
        )
    wanted = top * math.exp(-LEAST_SPAN)
    limit = FLOOR * noise.of_value
    needed = []
    if limit > wanted:
        share = wanted / limit
        kind, level = ("a timing error", noise.timing) if noise.timing else ("noise", noise.value)
        needed.append(f"{kind} of {unit * level * share:.2g} instead of {unit * level:.2g}")
    if given.floor > wanted:
        share = wanted / given.floor
        needed.append(f"a resolution of {given.resolution * share:.2g}")
    # Where 60 pairs are, K being a power law below the largest scale.
    within = float(read.sums.sums[-1]) * (wanted / top) ** max(value, 0.5)
    vectors = math.sqrt(2 * LEAST_PAIRS / within)
    if vectors > read.sums.vectors or not needed:
        needed.append(f"about {10 * math.ceil(1.2 * vectors / 10)} intervals")
    return (
        f"the scales span {span:.1f} e-folds ({unit * low:.3g} to {unit * top:.3g}); a dimension "
        f"takes {LEAST_SPAN}",
        " and ".join(needed),
    )
