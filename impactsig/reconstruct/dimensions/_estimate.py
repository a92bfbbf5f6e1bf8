"""From a series to the slope of its correlation sum and the dimension of its attractor."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.special import stdtrit

from .._fits import Fit, least_squares
from ._faults import with_faults
from ._kernel_sum import BLOCKS, FLOOR, LARGEST, LEAST_PAIRS, STEP, KernelSum, kernel_sum
from ._limit import LEAST_SPAN, best_scales, departure
from ._noise import Noise
from ._slope import Slope, slope
from ._unrelated import steepened, unrelated
from .dimension import CorrelationDimension, ScaleSlope

FIRST_EMBEDDING, MOST_EMBEDDING = 3, 8

STEEP, LARGEST_STEEP = 1.5, 0.01
"""Above that slope the extent of the attractor shows from this K on."""

LARGEST_SHARE = 0.08
"""Share of the extent up to which slopes D of less than 1.6 e-folds below `LARGEST` are read.

There K is about 0.08^D: more than 0.03 where D is below 1.4, as a scale is a lesser share of an
attractor of a lower dimension at the same K. The extent lessens the last local slopes by 10 %.
"""

LEAST_CLEAR = 1.0
"""W below `LARGEST` from which on a slope beyond it is read as a dimension.

With less, 21 of 200 series of 500 intervals of the beam under 50 microseconds had one, and 15 of
those intervals held it.
"""

RISES = 0.15
"""What a further coordinate may add to the slope; of noise it adds nearly one.

Where a motion expands distances beyond the scales within the time of a vector, its last coordinates
look like noise, and the slope is too high by about as much.
"""

PAIRS_A_VECTOR = 0.25
"""Sum of the kernel at the least scale, for each vector.

Errors by the chance of single pairs fall with the number of pairs, those by the states visited with
that of vectors: at scales with few pairs a vector the former outweigh.
"""

DOSES = 3
"""Times that missed and spurious impacts are put in once more."""

MOST_FAULTS = 0.12
"""Share of missed and spurious impacts, together, beyond which no dimension is read."""

MOST_REPEATED = 0.01
"""Share of vectors equal to an earlier one, without rounding, beyond which nothing is counted."""

FEWEST_SCALES = 3
"""Of a slope."""

NORMAL = 100.0
"""Error over its part by chance, from which on t is normal."""
FEW = 200
"""Vectors below which too few pairs decide for 95 % intervals."""


class Setting(NamedTuple):
    """The series and parameters of an estimate; lengths except `resolution` in units of `unit`."""

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
        """Correlation sum K(H) in one embedding dimension."""
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
    chance: np.ndarray  # share of the pairs that unrelated vectors are, at each scale
    slope: Slope
    clear: tuple[float, float]  # scales at which the extent of the attractor does not show

    @property
    def span(self) -> float:
        """W of a dimension."""
        return math.log(self.clear[1] / self.clear[0])

    def over(self, some: slice, fit: Fit) -> _Read:
        """The slope over some of the scales, below the extent of the attractor."""
        sums = self.sums.over(some)
        found = slope(sums, fit)
        return _Read(self.embedding, sums, self.chance[some], found, found.scales)


def estimate(given: Setting, noise: Noise, embedding: int | None) -> CorrelationDimension:
    """Slope and dimension of a deterministic series; see `dimension`."""
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
    limit = read
    if read is not None and given.scales is None:
        if read.span >= LEAST_SPAN:
            limit = read.over(best_scales(read.sums, read.chance), given.fit)
            read = _well_paired(read, given.fit)
        elif read.sums.sums[-1] < LARGEST / 2:
            read = limit = _wider(given, noise, read, LARGEST)
        else:
            largest = LARGEST_SHARE ** max(read.slope.value, 1.0)
            if largest > LARGEST:
                wider = _wider(given, noise, read, largest)
                clear = wider.slope.scales if read.span >= LEAST_CLEAR else read.clear
                read = limit = wider._replace(clear=clear)
    if again >= MOST_REPEATED:
        reason = f"{again:.1%} of the values are a copy of an earlier stretch"
        return CorrelationDimension("no scales", None, None, reason=reason, **common)
    if read is None or limit is None:
        reason = (
            f"no scale above {floor:.3g} holds {LEAST_PAIRS:.0f} pairs of neighbours"
            if floor
            else f"no scale holds {LEAST_PAIRS:.0f} pairs of neighbours"
        )
        return CorrelationDimension(
            "no scales", None, None, reason=reason, warnings=tuple(warnings), **common
        )
    if read.sums.vectors < FEW:
        warnings.append(
            f"{read.sums.vectors} vectors are few: such intervals hold less often than 95 %"
        )
    found = read.slope
    value, errors = _with_doubts(given, noise, read)
    common.update(
        slope=_stated(given, read, value, errors),
        scales=given.unit * read.sums.scales,
        sums=read.sums.sums,
        slopes=found.local,
        slope_errors=_half_width(found.local_errors, found.local_errors),
        warnings=tuple(warnings),
    )
    if limit.slope.scales != found.scales:
        value, errors = _with_doubts(given, noise, limit)
    rise = _rise(given, noise, limit) if limit.span >= LEAST_SPAN else 0.0
    if not math.isfinite(rise):  # at the larger scales it is no less
        rise = _rise(given, noise, read)
    reason, needed = _why_not(given, noise, limit, value, rise)
    if reason:
        return CorrelationDimension("slope", None, None, reason=reason, needed=needed, **common)
    missed_by = departure(limit.sums, limit.chance, limit.span)
    errors = errors | {
        "the choice of scales": missed_by.span,
        "the embedding": max(rise, 0.0),
        "unrelated vectors": missed_by.unrelated,
        "a slope that still rises": missed_by.rising,
    }
    taken = _stated(given, limit, value, errors)
    return CorrelationDimension("dimension", value, taken.interval, dimension_slope=taken, **common)


def _with_doubts(given: Setting, noise: Noise, read: _Read) -> tuple[float, dict[str, float]]:
    """Value of a slope, and its errors by what they come from."""
    value, errors = read.slope.value, {"chance": read.slope.error}
    # The higher noise has the higher floor; both are read over what is left.
    if noise.other is not None and any(noise.other):
        errors["noise"] = _moved_by_noise(given, noise, read)
    if given.missed or given.spurious:
        shift = _shift_by_faults(given, noise, read)
        value -= shift
        errors["missed and spurious impacts"] = abs(shift)
    return value, errors


def _stated(given: Setting, read: _Read, value: float, errors: dict[str, float]) -> ScaleSlope:
    """A slope with its interval, in the unit of the series."""
    half = float(_half_width(read.slope.error, math.hypot(*errors.values())))
    low, high = (given.unit * scale for scale in read.slope.scales)
    return ScaleSlope(value, (value - half, value + half), (low, high), read.embedding, errors)


def _half_width(chance: Any, error: Any) -> Any:
    """Half-width of the 95 % interval, given the part of the error that blocks estimate.

    Degrees of freedom are those of Welch and Satterthwaite; the other shares are taken for exact.
    """
    least = np.finfo(float).tiny
    ratio = np.maximum(error, least) / np.maximum(chance, least)
    freedom = (BLOCKS - 1) * np.minimum(ratio, NORMAL) ** 4
    return stdtrit(freedom, 0.975) * error


def repeated(given: Setting) -> float:
    """Share of triples of values that have occurred before exactly."""
    vectors = np.lib.stride_tricks.sliding_window_view(given.values, FIRST_EMBEDDING)
    vectors = vectors[~np.isnan(vectors).any(axis=1)]
    return 1 - len(np.unique(vectors, axis=0)) / len(vectors)


def _read(given: Setting, noise: Noise, embedding: int | None) -> _Read | None:
    """Slope in the given embedding, or in the first with more than 2 D coordinates."""
    m, largest, read = embedding or FIRST_EMBEDDING, LARGEST, None
    while True:
        sums = given.sums(noise, m, given.scales, largest)
        if sums is None or len(sums.scales) < FEWEST_SCALES:
            return read
        chance = _chance(given, noise, m, sums)
        if given.scales is None:
            related = slice(_related(sums, chance))
            sums, chance = sums.over(related), chance[related]
        found = slope(sums, given.fit)
        read = _Read(m, sums, chance, found, found.scales)
        wanted = min(math.floor(2 * read.slope.value) + 1, MOST_EMBEDDING)
        if embedding is not None or wanted <= m:
            wanted = m
        steep = read.slope.value > STEEP and given.scales is None and largest == LARGEST
        if wanted == m and not steep:
            return read
        m, largest = wanted, LARGEST_STEEP if steep else largest


def _chance(given: Setting, noise: Noise, m: int, sums: KernelSum) -> np.ndarray:
    return unrelated(sums.scales, given.values, m, given.theiler, noise.of_value**2)


def _related(sums: KernelSum, chance: np.ndarray) -> int:
    """Number of scales to use: without those that unrelated vectors steepen.

    The largest are left out. Slopes also rise where an attractor is lacunar, and unrelated vectors
    may not show because its extent lessens the slope: neither alone is a reason.
    """
    steeper = steepened(sums.scales, sums.sums, chance)
    logs, values = np.log(sums.scales), np.log(sums.sums)
    count = len(logs)
    while count > FEWEST_SCALES and steeper[count - 1] > RISES:
        last, rest = slice(count - FEWEST_SCALES, count), slice(count - 1)
        if least_squares(logs[last], values[last]) - least_squares(logs[rest], values[rest]) < (
            RISES
        ):
            break
        count -= 1
    return count


def _well_paired(read: _Read, fit: Fit) -> _Read:
    """The same without the smallest scales of few pairs, if W is still large enough."""
    sums = read.sums
    spans = np.log(sums.scales[-1] / sums.scales)
    kept = (sums.raw >= PAIRS_A_VECTOR * sums.vectors) | (spans < LEAST_SPAN + STEP)
    return read.over(slice(len(kept) - int(np.count_nonzero(kept)), None), fit)


def _wider(given: Setting, noise: Noise, read: _Read, largest: float) -> _Read:
    """The slope up to K = `largest`."""
    sums = given.sums(noise, read.embedding, None, largest)
    if sums is None or len(sums.scales) <= len(read.sums.scales):
        return read
    chance = _chance(given, noise, read.embedding, sums)
    related = slice(_related(sums, chance))
    sums, chance = sums.over(related), chance[related]
    if len(sums.scales) <= len(read.sums.scales):
        return read
    return read._replace(sums=sums, chance=chance, slope=slope(sums, given.fit))


def _again(given: Setting, noise: Noise, read: _Read, values: np.ndarray) -> float | None:
    """Slope over the same scales with another noise and series."""
    sums = given.sums(noise, read.embedding, read.slope.scales, values=values)
    return (
        None if sums is None or len(sums.scales) < FEWEST_SCALES else slope(sums, given.fit).value
    )


def _moved_by_noise(given: Setting, noise: Noise, read: _Read) -> float:
    """Change of the slope if the noise is one standard error higher."""
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
    """Change of the slope by twice as many missed and spurious impacts."""
    shifts = []
    for seed in range(DOSES):
        dosed = with_faults(given.values, given.missed, given.spurious, seed)
        again = _again(given, noise, read, dosed)
        if again is not None:
            shifts.append(again - read.slope.value)
    return float(np.mean(shifts)) if shifts else 0.5


def _rise(given: Setting, noise: Noise, read: _Read) -> float:
    """Increase of the slope by one more coordinate, over the same scales."""
    sums = given.sums(noise, read.embedding + 1, read.slope.scales)
    if sums is None or len(sums.scales) < FEWEST_SCALES:
        return math.inf
    same = read.sums.over(slice(-len(sums.scales), None))
    return slope(sums, given.fit).value - slope(same, given.fit).value


def _why_not(
    given: Setting, noise: Noise, read: _Read, value: float, rise: float
) -> tuple[str, str]:
    """Why the slope is not the dimension of the attractor, and what would be needed."""
    span, (low, top) = read.span, read.clear
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
    largest = float(np.interp(top, read.sums.scales, read.sums.sums))
    within = largest * (wanted / top) ** max(value, 0.5)
    vectors = math.sqrt(2 * LEAST_PAIRS / within)
    below = " below the extent of the attractor" if top < read.slope.scales[1] else ""
    if vectors > read.sums.vectors or not needed:
        needed.append(f"about {10 * math.ceil(1.2 * vectors / 10)} intervals")
    return (
        f"the scales{below} span {span:.1f} e-folds ({unit * low:.3g} to {unit * top:.3g}); a "
        f"dimension takes {LEAST_SPAN}",
        " and ".join(needed),
    )
