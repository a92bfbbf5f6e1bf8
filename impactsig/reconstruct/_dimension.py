"""From a series to its dimension: counting, resampling, reading each embedding, the verdict."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from . import _bending, _bootstrap, _estimators, _scaling
from ._counting import pair_counts_by_block
from ._series import known
from .correlation import CorrelationSum
from .dimension import CorrelationDimension, DimensionEstimate

PER_OCTAVE = 8
OCTAVES = 16

NOISE_FLOOR = 2.33
"""Radius in standard deviations of the noise at which erf(r / 2 s) is 0.9."""

RESOLUTION_FLOOR = 2.0

STRUCTURE = 0.2
"""Noise above this share of the standard deviation leaves no structure to be seen."""

EXTRAPOLATED_BELOW = 0.01
"""Correlation sums above it tell of the extent of the attractor, not of the limit."""

EXTRAPOLATED_FROM = 3 * PER_OCTAVE
"""Radii with slopes known to 5 % from which alone an extrapolation is made."""

FEW = 250
"""Vectors below which intervals are too narrow: of 100 they held in 74 to 86 %, of 200 in 90."""

ESTIMATOR = "Takens' and nearest-neighbour estimates, averaged over the scales that agree"
CHOSEN = "Takens' estimate averaged over the upper octave of the region given"


class _Setting(NamedTuple):
    """What the readings of all embedding dimensions share; radii in the range of the series.

    The floor may be wrong by the factor `doubt`, 1 where it is not one of noise.
    """

    radii: np.ndarray
    scale: float
    floor: float
    doubt: float
    delay: int
    theiler: int
    draws: np.ndarray
    region: tuple[float, float] | None
    seed: int


def estimate(
    x: np.ndarray,
    dimensions: tuple[int, ...],
    delay: int,
    theiler: int,
    resolution: float,
    region: tuple[float, float] | None,
    seed: int,
    workers: int | None,
) -> CorrelationDimension:
    """The dimension of a series that is neither constant nor periodic; see `dimension`."""
    values = known(x)
    scale = float(np.ptp(values / np.abs(values).max()) * np.abs(values).max())
    unit = (x - values.mean()) / scale
    quantised = _scaling.quantum(values) / scale
    if quantised:
        # Undoes the rounding: distances would else be whole steps, and C(r) a staircase.
        unit = unit + quantised * np.random.default_rng(seed).uniform(-0.5, 0.5, len(x))
    radii = 2.0 ** (np.arange(-PER_OCTAVE * OCTAVES, 1) / PER_OCTAVE)
    radii *= np.ptp(known(unit)) * (1 + 1e-9)
    vectors = [len(x) - (m - 1) * delay for m in dimensions]
    blocks = _bootstrap.block_count(vectors[-1], theiler)
    draws = _bootstrap.multipliers(blocks, seed)
    counts = [
        pair_counts_by_block(unit, m, delay, theiler, radii, blocks, workers) for m in dimensions
    ]
    totals = np.array([count.sum(axis=(0, 1)) for count in counts])
    correlation = CorrelationSum(radii * scale, totals, totals[:, -1], dimensions, delay, theiler)
    noise, certain, doubt = _scaling.noise_level(counts, radii, dimensions)
    warnings = []
    floor = RESOLUTION_FLOOR * resolution / scale
    marked, unit = unit, known(unit)
    if noise > STRUCTURE * unit.std():
        noise, doubt = 0.0, 1.0
    elif noise:
        floor = max(floor, NOISE_FLOOR * noise)
        # Either way the radii are left out: too much caution costs less than noise.
        if certain:
            share = noise / unit.std()
            warnings.append(f"noise of about {noise * scale:.2g} ({share:.2g} of the sd)")
        else:
            warnings.append(f"radii below {floor * scale:.2g} left out, where noise is possible")
    if quantised:
        warnings.append(f"values rounded to {quantised * scale:.3g}")
    if vectors[-1] < FEW:
        warnings.append(f"{vectors[-1]} vectors are few: such intervals hold in 75 to 90 %, not 95")
    same = totals[-1, 0] / totals[-1, -1]
    if same * vectors[-1] > 1:
        warnings.append(f"{same:.1%} of the pairs of vectors coincide")
    setting = _Setting(
        radii, scale, floor, doubt, delay, theiler, draws, region, seed
    )  # fmt: skip
    looks = [_look(m, marked, count, setting) for m, count in zip(dimensions, counts, strict=True)]
    # A single coordinate fills its range, and knows of no edges but its own.
    bends = [one.scales.bend for one in looks if one.scales is not None and one.embedding > 1]
    odds = _bending.odds(bends, vectors[-1]) if bends else np.zeros(1 + len(draws))
    read = tuple(_read_one(look, odds, setting) for look in looks)
    noise *= certain
    return _verdict(
        read, correlation, noise * scale, resolution, floor * scale, region is not None, warnings
    )


class _Look(NamedTuple):
    """What one embedding shows before all are known: its scales, by the rule or None."""

    embedding: int
    counts: np.ndarray
    points: int
    floor: float
    slopes: tuple[np.ndarray, np.ndarray]
    nearest: np.ndarray
    scales: _scaling.Scales | None


def _look(m: int, x: np.ndarray, counts: np.ndarray, given: _Setting) -> _Look:
    radii, draws = given.radii, given.draws
    points = len(x) - (m - 1) * given.delay
    step = float(np.log(radii[1] / radii[0]))
    slopes = _slopes(counts, step, draws)
    nearest = np.full(1 + len(draws), np.nan)
    if given.region is not None:
        return _Look(m, counts, points, given.floor, slopes, nearest, None)
    vectors = np.column_stack([x[k * given.delay : k * given.delay + points] for k in range(m)])
    neighbours = _estimators.Neighbours(vectors, given.theiler, draws.shape[1], given.seed)
    sums = counts.sum(axis=(0, 1))
    sums = sums / sums[-1]
    coarse = _estimators.takens(sums, step, 0)[_scaling.highest_scale(sums)]
    floor = max(given.floor, neighbours.even_up_to(coarse))
    nearest = neighbours.dimension(draws, floor)
    scales = _scaling.scales(counts, points, radii, floor, nearest, draws)
    return _Look(m, counts, points, floor, slopes, nearest, scales)


def _read_one(look: _Look, odds: np.ndarray, given: _Setting) -> DimensionEstimate:
    """What one embedding tells."""
    m, counts, radii, scale = look.embedding, look.counts, given.radii, given.scale
    within = counts.sum(axis=(0, 1))
    slopes, slope_errors = look.slopes
    if given.region is None:
        reading, error = _by_rule(look, odds, given)
    else:
        low, high = np.searchsorted(radii, np.array(given.region) / scale)
        low, high = min(int(low), len(radii) - 2), min(int(high), len(radii) - 1)
        reading = _scaling.read_region(counts, radii, low, max(high, low + 1), given.draws)
        error = 0.0
    if reading is None:
        none = np.empty(0)
        return DimensionEstimate(
            m, None, None, None, None, None, None, None, none, slopes, slope_errors
        )
    value = float(reading.values[0])
    drawn = reading.values[1:] - reading.values[1:].mean()
    chance = float(drawn.std())
    error = float(np.hypot(error, chance))
    drawn *= error / (chance or 1.0)
    half = float(stats.t.ppf(0.975, given.draws.shape[1] - 1)) * error
    # A logarithm means something only where there are enough pairs.
    first = max(reading.low, int(np.searchsorted(within, _scaling.LEAST_PAIRS)))
    step = float(np.log(radii[1] / radii[0]))
    whole = _estimators.slope(within / within[-1], step, first, reading.high)
    nearest = float(look.nearest[0])
    return DimensionEstimate(
        m,
        value,
        (value - half, value + half),
        (float(radii[reading.low] * scale), float(radii[reading.high] * scale)),
        float(reading.takens[0]),
        float(whole) if np.isfinite(whole) else None,
        nearest if np.isfinite(nearest) else None,
        _extrapolated(radii, slopes, slope_errors, within / within[-1]),
        drawn,
        slopes,
        slope_errors,
    )


def _slopes(counts: np.ndarray, step: float, draws: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Local slopes where there are enough pairs, and their standard errors."""
    slopes = _estimators.slopes_resampled(counts, step, PER_OCTAVE // 4, draws)
    slopes[:, counts.sum(axis=(0, 1)) < _scaling.LEAST_PAIRS] = np.nan
    return slopes[0], slopes[1:].std(axis=0)


def _by_rule(
    look: _Look, odds: np.ndarray, given: _Setting
) -> tuple[_scaling.Reading | None, float]:
    """The reading, and the error by the doubt about the floor."""
    if look.scales is None:
        return None, 0.0
    reading = _scaling.read(look.scales, odds, look.slopes)
    moved = []
    for factor in (1 / given.doubt, given.doubt) if given.doubt > 1 else ():
        other = _scaling.scales(
            look.counts, look.points, given.radii, factor * look.floor, look.nearest, given.draws
        )
        if other is not None:
            found = _scaling.read(other, odds, look.slopes)
            moved.append(float(found.values[0] - reading.values[0]))
    return reading, float(np.sqrt(np.mean(np.square(moved or [0.0]))))


def _extrapolated(
    radii: np.ndarray, slopes: np.ndarray, errors: np.ndarray, sums: np.ndarray
) -> float | None:
    """Intercept of the local slopes against 1 / ln(R / r), R = 1 being the range of the series."""
    with np.errstate(invalid="ignore"):
        use = (errors < 0.05 * slopes) & (sums <= EXTRAPOLATED_BELOW)
    if np.count_nonzero(use) < EXTRAPOLATED_FROM:
        return None
    inverse = 1 / np.log(1 / radii[use])
    weight = 1 / np.hypot(errors[use], _scaling.TOLERANCE * slopes[use])
    return float(np.polyfit(inverse, slopes[use], 1, w=weight)[1])


def _verdict(
    read: tuple[DimensionEstimate, ...],
    correlation: CorrelationSum,
    noise: float,
    resolution: float,
    floor: float,
    chosen: bool,
    warnings: list[str],
) -> CorrelationDimension:
    known = [one for one in read if one.value is not None]
    common: dict[str, Any] = {
        "by_dimension": read,
        "noise": noise,
        "resolution": resolution,
        "floor": floor,
        "correlation": correlation,
    }
    unread = [str(one.embedding) for one in read if one.value is None]
    if unread:
        warnings.append(
            f"no radius above {floor:.3g} holds enough pairs for m = {', '.join(unread)}"
        )
    plateau = known[-1:]
    for one in reversed(known[:-1]):
        if not _agree(one, plateau[0]) or not _agree(one, known[-1]):
            break
        plateau.insert(0, one)
    if len(plateau) < 2:
        return CorrelationDimension("no plateau", None, None, warnings=tuple(warnings), **common)
    last = plateau[-2:]
    value = float(np.mean([one.value for one in last]))
    drawn = np.nanmean([one.resamples for one in last], axis=0)
    half = _half_of(last[-1]) * float(np.nanstd(drawn) / (np.nanstd(last[-1].resamples) or 1.0))
    estimates = {
        "Takens": _mean(one.takens for one in last),
        "slope": _mean(one.slope for one in last),
        "nearest neighbours (D1)": _mean(one.nearest for one in last),
    }
    # What is carried on is a slow rise; below the value there is none.
    extrapolated = _mean(one.extrapolated for one in last)
    if extrapolated is not None and extrapolated < value - half:
        extrapolated = None
    steps = last[1].embedding - last[0].embedding
    rise = float(np.diff([one.value for one in last])[0]) / steps
    if rise > 0.05 * value:
        warnings.append(
            f"it still rises by {rise:.2f} from m = {last[0].embedding} to {last[1].embedding}"
        )
    # Least number of vectors for a dimension, with room [EckmannRuelle1992]_.
    points = (1 + np.sqrt(1 + 8 * correlation.pairs[-1])) / 2
    most = 2 * np.log10(points)
    if value > 0.75 * most:
        warnings.append(f"{points:.0f} vectors can tell of a dimension of {most:.1f} at the most")
    result = CorrelationDimension(
        "dimension",
        value,
        (value - half, value + half),
        last[-1].region,
        tuple(one.embedding for one in plateau),
        estimator=CHOSEN if chosen else ESTIMATOR,
        estimates=estimates,
        extrapolated=extrapolated,
        warnings=tuple(warnings),
        **common,
    )
    if result.spread is not None and result.spread > max(2 * half, 0.1 * value):
        differ = f"the estimators differ by {result.spread:.2f}"
        return CorrelationDimension(**{**vars(result), "warnings": (*result.warnings, differ)})
    return result


def _agree(one: DimensionEstimate, last: DimensionEstimate) -> bool:
    """Whether further coordinates add little: each of noise would add one to the dimension."""
    assert one.value is not None
    assert last.value is not None
    rise = abs(last.value - one.value)
    return rise <= _scaling.SATURATED * (last.embedding - one.embedding)


def _half_of(one: DimensionEstimate) -> float:
    assert one.interval is not None
    return (one.interval[1] - one.interval[0]) / 2


def _mean(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None
