"""How often the 95 % intervals of dimensions and exponents hold the truth, with half-widths.

Truths: D2 of the beam's intervals over whole lacunar periods of 10^7 of them, 1.113 +- 0.003 at
20.1 Hz and 1.0555 +- 0.002 at 20.3355 Hz; its D1 by Kaplan and Yorke 1.1219 and 1.0603; Hénon
1.21 +- 0.01, Lorenz's intervals 2.05 +- 0.02; `benchmarks.beam_dimensions` for further beams;
closed forms for the other sets of `UNSEEN`, by which no constant was chosen, but 2.05 - 1 for
Lorenz' maxima. That of a slope is the slope of long noise-free series over the same scales.

Every series adds a line to results/coverage.jsonl as soon as it is measured, so that a run that is
broken off goes on where it was. It goes round all cases, with more of the short series in a round.
`benchmarks.coverage_page` makes docs/dimension_coverage.md of all lines there are. When the
estimator changes, empty the file.

Of the beam, one long orbit is cut into series that do not overlap. The first `TRAINS` of a case are
given as impacts with their `time_error`, the others as intervals with that `timing_error`: these
only skip the search for a forcing period, which takes 20 times the time of all the rest.

    python -m benchmarks.coverage [--series 200] [--case WORD ...]
"""

from __future__ import annotations

import argparse
import functools
import json
import math
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np
from scipy.interpolate import CubicSpline

import impactsig
from impactsig import Impacts, correlation_dimension, scenes, simulate
from impactsig.reconstruct._fits import least_squares
from impactsig.reconstruct.dimensions._kernel_sum import STEP, kernel_sum
from tests import series
from tests.series import iterated

LINES = Path(__file__).parent / "results" / "coverage.jsonl"
SIZES = (500, 2000, 10_000)
LONG, PARTS, STRETCHES = 200_000, 20, 10
"""Values of a long series, its parts, and how many of them the true slopes are of."""
LONG_SEED = 987_000
SERIES, TRAINS = 200, 2
ROUND = {500: 40, 2000: 20, 10_000: 5}
"""Series of each size in a round, which takes about as long for each."""
BEAMS = {20.1: (1.113, 1.1219), 20.3355: (1.0555, 1.0603)}
UNSEEN_BEAMS = {
    (20.15, 0.2): (1.1104, 1.1184),
    (20.2, 0.2): (1.0944, 1.1063),
    (20.25, 0.2): (1.0818, 1.0908),
    (20.3, 0.2): (1.0725, 1.0719),
    (20.4, 0.2): (1.0491, 1.0489),
    (20.45, 0.2): (math.nan, 1.0472),
    (20.5, 0.2): (math.nan, 1.0410),
    (20.3, 0.15): (1.0399, 1.0430),
    (20.6, 0.3): (1.0587, 1.0621),
    (20.5, 0.4): (1.1702, 1.1779),
    (20.3, 0.3): (1.1409, 1.1493),
    (20.1, 0.1): (1.0529, 1.0621),
    (20.2, 0.3): (1.1442, 1.1537),
}
"""D2 and D1 by frequency and restitution, as `benchmarks.beam_dimensions` prints them.

No constant of a dimension was chosen by any of them. Rules of exponents were chosen by or after a
look at those of 20.2, 20.3, 20.4, 20.45 and 20.5 Hz with the restitution 0.2. At 20.45 and 20.5 Hz
the beam lingers near a cycle, and D2 over whole lacunar periods comes out above D1, as 1.056 and
1.068.
"""
RESTITUTION = 0.2


class Case(NamedTuple):
    """A name, what draws a series and its options, D2, D1 or nan, and which `LONG_SERIES` it is."""

    name: str
    draw: Callable[[int], tuple[Any, dict]]
    d2: float
    d1: float = np.nan
    long: str = ""


@functools.cache
def beam(frequency: float, restitution: float = RESTITUTION) -> tuple[np.ndarray, float]:
    """Intervals of the beam for `SERIES` of the greatest size, and by how much an impact contracts.

    In e-folds of areas.
    """
    scene = scenes.karpodinis(frequency, restitution=restitution)
    count = SERIES * SIZES[-1]
    x = simulate(scene, periods=2 * count, transient=1000).impacts.intervals()[:count]
    return x, scene.damping / scene.time_unit * x.mean() - 2 * np.log(restitution)


def of_beam(
    frequency: float,
    count: int,
    error: float,
    faults: float,
    seed: int,
    restitution: float = RESTITUTION,
):
    """A stretch of the beam's impacts as an instrument sees them; those of seeds do not overlap."""
    x, contraction = beam(frequency, restitution)
    begin = seed * count % (len(x) - count + 1)
    time = np.cumsum(np.concatenate(([0.0], x[begin : begin + count])))
    train = Impacts(time, time_error=np.zeros(count + 1))
    measured = impactsig.measure(train, jitter=error, missed=faults, spurious=faults, seed=seed)
    options = {"missed": faults, **({} if faults else {"contraction": contraction})}
    if seed < TRAINS:
        return measured.impacts, options
    known = {"timing_error": error, "spurious": faults} if faults else {"timing_error": error}
    return measured.impacts.intervals(), options | known


def of_map(make, count: int, noise: float, seed: int):
    """A series with known noise of a share of its standard deviation."""
    x = make(count, seed)
    return series.noisy(x, noise, seed), {"value_error": noise * float(x.std())}


def known_noise() -> Iterator[Case]:
    """The systems of which the truth is known, under the noise that is stated."""
    for count in SIZES:
        for frequency, (d2, d1) in BEAMS.items():
            for error in (0.0, 2e-6, 5e-6, 1e-5, 2e-5, 5e-5):
                yield Case(
                    f"beam {frequency} Hz, {1e6 * error:.0f} µs, n {count}",
                    functools.partial(of_beam, frequency, count, error, 0.0),
                    d2,
                    d1,
                    f"beam {frequency}",
                )
        for error in (0.0, 1e-5):
            yield Case(
                f"beam 20.1 Hz, {1e6 * error:.0f} µs, 5 % missed, 5 % spurious, n {count}",
                functools.partial(of_beam, 20.1, count, error, 0.05),
                BEAMS[20.1][0],
                np.nan,
                "beam 20.1",
            )
        for name, make, d2, noises in (
            ("Hénon", series.henon, 1.21, (0.0, 0.005, 0.01)),
            ("Lorenz", series.lorenz_intervals, 2.05, (0.0, 0.02)),
        ):
            for noise in noises:
                yield Case(
                    f"{name}, noise {noise:.1%}, n {count}",
                    functools.partial(of_map, make, count, noise),
                    d2,
                    np.nan,
                    name,
                )


# -- sets by which no constant was chosen ------------------------------------------------------


def baker(count: int, seed: int) -> np.ndarray:
    """x + y of a baker's map with strips 0.35 and 0.65 high, squeezed to 0.25 and 0.4."""
    rng = np.random.default_rng(seed)

    def step(x: float, y: float) -> tuple[float, float]:
        if y < 0.35:
            x, y = 0.25 * x, y / 0.35
        else:
            x, y = 0.6 + 0.4 * x, (y - 0.35) / 0.65
        return x, (y + 1e-15 * rng.uniform()) % 1.0  # binary digits run out

    return iterated(step, rng.uniform(size=2), lambda x, y: x + 0.5 * y, count, 200)


def gauss(count: int, seed: int) -> np.ndarray:
    """The fractional part of 1 / x: density 1 / (1 + x)."""
    rng = np.random.default_rng(seed)
    return iterated(
        lambda x: ((1 / x) % 1.0 or rng.uniform(),), [rng.uniform()], series.first, count
    )


def beta(count: int, seed: int) -> np.ndarray:
    """The golden beta transformation: a density of two steps."""
    rng = np.random.default_rng(seed)

    def step(x: float) -> tuple[float]:
        return (((1 + np.sqrt(5)) / 2 * x + 1e-15 * rng.uniform()) % 1.0,)

    return iterated(step, [rng.uniform()], series.first, count)


def wound(times: int, by: float, count: int, seed: int) -> np.ndarray:
    """x + y / 2 + cos t / 2 of a solenoid that winds so many times and contracts so much."""
    rng = np.random.default_rng(seed)

    def step(t: float, x: float, y: float) -> tuple[float, float, float]:
        x, y = by * x + np.cos(2 * np.pi * t), by * y + np.sin(2 * np.pi * t)
        return (times * t + 1e-15 * rng.uniform()) % 1.0, x, y

    def seen(t: float, x: float, y: float) -> float:
        return x + 0.5 * y + 0.5 * np.cos(2 * np.pi * t)

    return iterated(step, rng.uniform(size=3), seen, count, 200)


def solenoid(count: int, seed: int) -> np.ndarray:
    """x + y / 2 + cos t / 2 of the Smale-Williams solenoid that contracts by 0.3."""
    return wound(2, 0.3, count, seed)


def unseen_beams() -> Iterator[Case]:
    """The beam at frequencies and restitutions by which no constant of a dimension was chosen."""
    for count in SIZES[:2]:
        for (frequency, restitution), (d2, d1) in UNSEEN_BEAMS.items():
            for error in (0.0, 1e-5, 2e-5):
                yield Case(
                    f"further beam {frequency} Hz, restitution {restitution}, "
                    f"{1e6 * error:.0f} µs, n {count}",
                    functools.partial(
                        of_beam, frequency, count, error, 0.0, restitution=restitution
                    ),
                    d2,
                    d1,
                )


def strips(count: int, seed: int) -> np.ndarray:
    """x + y / 2 of a baker's map of three strips, of heights and widths `HEIGHTS` and `WIDTHS`."""
    rng = np.random.default_rng(seed)

    def step(x: float, y: float) -> tuple[float, float]:
        k = int(np.searchsorted((0.2, 0.7), y, side="right"))
        x = (0.0, 0.4, 0.75)[k] + WIDTHS[k] * x
        return x, ((y - (0.0, 0.2, 0.7)[k]) / HEIGHTS[k] + 1e-15 * rng.uniform()) % 1.0

    return iterated(step, rng.uniform(size=2), lambda x, y: x + 0.5 * y, count, 200)


HEIGHTS, WIDTHS = np.array([0.2, 0.5, 0.3]), np.array([0.3, 0.2, 0.25])


def zigzag(count: int, seed: int) -> np.ndarray:
    """Up from 0 to 1 at 0.2, down to 0 at 0.7, up to 1 at 1: uniform on [0, 1]."""
    rng = np.random.default_rng(seed)

    def step(x: float) -> tuple[float]:
        x = float(np.interp(x, (0.0, 0.2, 0.7, 1.0), (0.0, 1.0, 0.0, 1.0)))
        return (min(x + 1e-15 * rng.uniform(), 1.0),)

    return iterated(step, [rng.uniform()], series.first, count)


def cusp(count: int, seed: int) -> np.ndarray:
    """1 - 2 sqrt |x| [Hemmer1984]: density (1 - x) / 2; it lingers at -1."""
    start = np.random.default_rng(seed).uniform(-1, 1)
    return iterated(lambda x: (1 - 2 * math.sqrt(abs(x)),), [start], series.first, count, 200)


def winding(count: int, seed: int) -> np.ndarray:
    """x + y / 2 + cos t / 2 of a solenoid that winds three times and contracts by 0.1."""
    return wound(3, 0.1, count, seed)


def other_beam(frequency: float, restitution: float, count: int, seed: int) -> np.ndarray:
    """Intervals of a beam of another restitution."""
    x, _ = beam(frequency, restitution)
    begin = seed * count % (len(x) - count + 1)
    return x[begin : begin + count]


def dimension_of_strips(heights: np.ndarray, widths: np.ndarray) -> float:
    """1 + s with sum heights^2 widths^-s = 1, of a product with the uniform direction."""
    from scipy.optimize import brentq

    return 1 + float(brentq(lambda s: heights**2 @ widths**-s - 1, 0.01, 1.0))


def kaplan_yorke(count: int, seed: int) -> np.ndarray:
    """x + y of Kaplan and Yorke's map, x doubled and y = 0.2 y + cos 4 pi x."""
    rng = np.random.default_rng(seed)

    def step(x: float, y: float) -> tuple[float, float]:
        return (2 * x + 1e-15 * rng.uniform()) % 1.0, 0.2 * y + math.cos(4 * math.pi * x)

    return iterated(step, [rng.uniform(), 0.0], lambda x, y: x + y, count, 200)


def filtered_tent(count: int, seed: int) -> np.ndarray:
    """A skew tent map with its top at 0.35 through a filter, y = 0.25 y + x."""
    x, y = skew_tent_of(0.35, count + 200, seed), 0.0
    found = np.empty(len(x))
    for i in range(len(x)):
        y = 0.25 * y + x[i]
        found[i] = y
    return found[200:]


def skew_tent_of(top: float, count: int, seed: int) -> np.ndarray:
    """The tent map with its top there: uniform on [0, 1]."""
    rng = np.random.default_rng(seed)

    def step(x: float) -> tuple[float]:
        x = x / top if x < top else (1 - x) / (1 - top)
        return (min(x + 1e-15 * rng.uniform(), 1.0),)

    return iterated(step, [rng.uniform()], series.first, count)


def circle(count: int, seed: int) -> np.ndarray:
    """Turns of z (z - 0.4) / (1 - 0.4 z) on the unit circle: it leaves 0, so they are uniform."""
    rng = np.random.default_rng(seed)

    def step(turn: float) -> tuple[float]:
        z = np.exp(2j * np.pi * (turn + 1e-15 * rng.uniform()))
        return (np.angle(z * (z - 0.4) / (1 - 0.4 * z)) / (2 * np.pi) % 1.0,)

    return iterated(step, [rng.uniform()], series.first, count)


def turned_strips(count: int, seed: int) -> np.ndarray:
    """x + y / 2 of a baker's map with strips 0.6 and 0.4 high, 0.35 and 0.15 wide, one turned."""
    rng = np.random.default_rng(seed)

    def step(x: float, y: float) -> tuple[float, float]:
        if y < 0.6:
            x, y = 0.35 * x, y / 0.6
        else:
            x, y = 1 - 0.15 * x, (1 - y) / 0.4
        return x, (y + 1e-15 * rng.uniform()) % 1.0

    return iterated(step, rng.uniform(size=2), lambda x, y: x + 0.5 * y, count, 200)


@numba.njit
def maxima(count: int, x: float, y: float, z: float) -> np.ndarray:
    """Successive maxima of z of Lorenz' flow, by steps of 0.002 and parabolas."""
    found, kept, h = np.empty(count), -50, 0.002
    state, rates, at = np.array([x, y, z]), np.empty((4, 3)), np.empty(3)
    before = last = z
    while kept < count:
        for k in range(4):
            for d in range(3):
                at[d] = state[d] + (h * (1.0 if k == 3 else 0.5) * rates[k - 1, d] if k else 0.0)
            rates[k, 0] = 10 * (at[1] - at[0])
            rates[k, 1] = at[0] * (28 - at[2]) - at[1]
            rates[k, 2] = at[0] * at[1] - 8 / 3 * at[2]
        state += h / 6 * (rates[0] + 2 * rates[1] + 2 * rates[2] + rates[3])
        if last > before and last >= state[2]:
            if kept >= 0:
                rise, bend = (state[2] - before) / 2, before - 2 * last + state[2]
                found[kept] = last - rise**2 / (2 * bend)
            kept += 1
        before, last = last, state[2]
    return found


def lorenz_maxima(count: int, seed: int) -> np.ndarray:
    """Maxima of z of Lorenz' flow: a section of it, of D2 2.05 - 1."""
    return maxima(count, *np.random.default_rng(seed).uniform(1.0, 10.0, 3))


EARLIER = {
    "baker": (baker, dimension_of_strips(np.array([0.35, 0.65]), np.array([0.25, 0.4]))),
    "skew tent": (functools.partial(skew_tent_of, 0.3), 1.0),
    "Gauss": (gauss, 1.0),
    "golden beta": (beta, 1.0),
    "cat": (series.cat, 2.0),
    "solenoid": (solenoid, 1 - np.log(2) / np.log(0.3)),
    "baker of three": (strips, dimension_of_strips(HEIGHTS, WIDTHS)),
    "zigzag": (zigzag, 1.0),
    "cusp": (cusp, 1.0),
    "solenoid of three": (winding, 1 + np.log(3) / np.log(10)),
    **{
        f"beam {frequency} Hz, restitution {restitution}": (
            functools.partial(other_beam, frequency, restitution),
            UNSEEN_BEAMS[frequency, restitution][0],
        )
        for frequency, restitution in ((20.3, 0.3), (20.1, 0.1))
    },
}
"""Sets that chose no constant when they were named, but were looked at when rules were made."""

UNSEEN = {
    "Kaplan and Yorke's map": (kaplan_yorke, 1 + np.log(2) / np.log(5)),
    "filtered tent": (filtered_tent, 1 + np.log(0.35**2 + 0.65**2) / np.log(0.25)),
    "circle": (circle, 1.0),
    "turned strips": (
        turned_strips,
        dimension_of_strips(np.array([0.6, 0.4]), np.array([0.35, 0.15])),
    ),
    "Lorenz' maxima": (lorenz_maxima, 1.05),
    "beam 20.2 Hz, restitution 0.3": (
        functools.partial(other_beam, 20.2, 0.3),
        UNSEEN_BEAMS[20.2, 0.3][0],
    ),
}
"""Sets that were named, with these parameters, before the first series of any was read.

Of a map that stretches by 1 / p_i and contracts evenly by a, D2 = 1 + ln(sum p_i^2) / ln a.
"""


def unseen() -> Iterator[Case]:
    """Sets that served no tuning, and earlier ones, noise-free and with 0.5 % of noise."""
    for count in SIZES[:2]:
        for kind, sets in (("unseen", UNSEEN), ("earlier", EARLIER)):
            for name, (make, d2) in sets.items():
                for noise in (0.0, 0.005):
                    yield Case(
                        f"{kind}: {name}, noise {noise:.1%}, n {count}",
                        functools.partial(of_map, make, count, noise),
                        d2,
                    )


# -- noise and tori, which have none or are recognised ---------------------------------------------


def drawn(make: Callable[..., Any], how: Any, seed: int):
    """500 values of a kind of noise."""
    return make(500, how, np.random.default_rng(seed)), {}


def recognised() -> Iterator[Case]:
    """Truth nan: there is no dimension to be found."""
    for exponent in (0.0, 0.5, 1.0, 1.5, 2.0):
        yield Case(
            f"noise 1/f^{exponent}, n 500",
            functools.partial(drawn, series.coloured, exponent),
            np.nan,
        )
    for weight in (0.5, 0.9):
        yield Case(
            f"noise AR {weight}, n 500",
            functools.partial(drawn, series.autoregressive, [weight]),
            np.nan,
        )
    for tones in (1, 2):
        yield Case(
            f"torus of {tones}, n 500",
            lambda seed, tones=tones: (series.torus(500, seed, tones), {}),
            float(tones),
        )


# -- running -----------------------------------------------------------------------------------


def measured(case: Case, seed: int) -> dict:
    """What one series gives, as numbers."""
    x, options = case.draw(seed)
    found = correlation_dimension(x, **options, workers=1)
    line: dict = {"case": case.name, "seed": seed, "verdict": found.verdict}
    if found.slope is not None:
        line["slope"] = [found.slope.value, *found.slope.interval]
        line["scales"] = found.slope.scales
        line["embedding"] = found.slope.embedding
    if found.dimension is not None:
        line["d2"] = [found.dimension, *found.interval]
    if found.kaplan_yorke is not None:
        line["d1"] = [found.kaplan_yorke.value, *found.kaplan_yorke.interval]
    return line


LONG_SERIES: dict[str, Callable[[], list[np.ndarray]]] = {
    "beam 20.1": lambda: np.array_split(beam(20.1)[0], STRETCHES),
    "beam 20.3355": lambda: np.array_split(beam(20.3355)[0], STRETCHES),
    "Hénon": lambda: [series.henon(LONG, LONG_SEED + k) for k in range(STRETCHES)],
    "Lorenz": lambda: [series.lorenz_intervals(LONG, LONG_SEED + k) for k in range(3)],  # slow
}


@functools.cache
def true_sums(long: str, embedding: int) -> CubicSpline:
    """ln K over ln H of long noise-free series."""
    return long_splines(LONG_SERIES[long](), embedding)


def long_splines(stretches: list[np.ndarray], embedding: int) -> CubicSpline:
    """ln K over ln H, on the mean over stretches.

    The slope of one of 200 000 values scatters by a fifth of that of a series of 10 000.
    """
    scales, sums = np.empty(0), []
    for x in stretches:
        given = (scales[0] * (1 + 1e-6), scales[-1]) if len(scales) else None
        found, sums_of_one = long_sums(x, embedding, given)
        scales = scales if len(scales) else found
        sums.append(sums_of_one)
    count = min(map(len, sums))
    mean = np.mean([one[-count:] for one in sums], axis=0)
    return CubicSpline(np.log(scales[-count:]), np.log(mean))


def long_sums(
    x: np.ndarray, embedding: int, given: tuple[float, float] | None
) -> tuple[np.ndarray, np.ndarray]:
    """Scales and sums of one long noise-free series.

    The largest scales are counted in few of its vectors: those that all of `PARTS` stretches reach
    are the mean of theirs.
    """
    none = np.zeros((embedding, embedding))
    whole = kernel_sum(x, embedding, 1, 12, none, largest=0.12, given=given)
    sums = whole.sums.copy()
    given = (whole.scales[0] * (1 + 1e-6), whole.scales[-1])  # the same scales
    parts = [
        kernel_sum(part, embedding, 1, 12, none, given=given).sums
        for part in np.array_split(x, PARTS)
    ]
    count = min(map(len, parts))
    sums[-count:] = np.mean([part[-count:] for part in parts], axis=0)
    return whole.scales, sums


def true_slope(case: Case, line: dict) -> float:
    """The noise-free slope over the scales of a line, read at as many of them as that has."""
    spline = true_sums(case.long, line["embedding"])
    low, high = np.log(line["scales"])
    if low < spline.x[0] or high > spline.x[-1]:
        return np.nan
    at = np.linspace(low, high, math.ceil((high - low) / STEP - 1e-6) + 1)
    return least_squares(at, spline(at))


HEAD = (
    "| case | series | slope held [%] | ± | D2 | answered [%] | held [%] | ± "
    "| D1 | held [%] | ± |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|\n"
)


def share(held: int, count: int) -> str:
    """In per cent, with the 95 % bounds of Clopper and Pearson."""
    from scipy.stats import binomtest

    low, high = binomtest(held, count).proportion_ci(0.95)
    return f"{100 * held / count:.0f} ({100 * low:.0f}–{100 * high:.0f})"


def summed_up(case: Case, lines: list[dict]) -> str:
    """A row of the table."""

    def cells(name: str, truths: list[float]) -> str:
        known = [
            (line[name], truth)
            for line, truth in zip(lines, truths, strict=True)
            if name in line and np.isfinite(truth)
        ]
        if not known:
            return "– | –"
        held = sum(one[1] - 1e-9 <= truth <= one[2] + 1e-9 for one, truth in known)
        half = np.mean([(one[2] - one[1]) / 2 for one, _ in known])
        return f"{share(held, len(known))} | {half:.3f}"

    def truth(value: float) -> str:
        return f"{value:.4g}" if np.isfinite(value) else "–"

    slopes = [true_slope(case, line) if case.long and "slope" in line else np.nan for line in lines]
    answered = sum(line.get("d2") is not None for line in lines)
    return (
        f"| {case.name} | {len(lines)} | {cells('slope', slopes)} | {truth(case.d2)} | "
        f"{share(answered, len(lines))} | {cells('d2', len(lines) * [case.d2])} | "
        f"{truth(case.d1)} | {cells('d1', len(lines) * [case.d1])} |"
    )


def all_cases() -> list[Case]:
    """In the order of the table."""
    return [*known_noise(), *unseen_beams(), *unseen(), *recognised()]


def lines_there_are() -> dict[str, list[dict]]:
    """What was measured so far, by case."""
    lines: dict[str, list[dict]] = defaultdict(list)
    if LINES.exists():
        for text in LINES.read_text(encoding="utf-8").splitlines():
            line = json.loads(text)
            lines[line["case"]].append(line)
    return lines


def go_on(case: Case, seeds: range, lines: list[dict]) -> None:
    """Measure the series that `lines` lacks, and write each down at once."""
    done = {line["seed"] for line in lines}
    for seed in seeds:
        if seed not in done:
            lines.append(measured(case, seed))
            with LINES.open("a", encoding="utf-8") as file:
                file.write(json.dumps(lines[-1]) + "\n")


def main() -> None:
    """Go on with the series that are missing, the shortest first."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--series", type=int, default=SERIES)
    parser.add_argument("--case", nargs="*", default=[], help="words that a name must hold")
    chosen = parser.parse_args()
    LINES.parent.mkdir(exist_ok=True)
    lines = lines_there_are()
    cases = [case for case in all_cases() if all(word in case.name for word in chosen.case)]
    for turn in range(math.ceil(chosen.series / min(ROUND.values()))):
        for size in SIZES:
            seeds = range(turn * ROUND[size], min((turn + 1) * ROUND[size], chosen.series))
            for case in cases:
                if case.name.endswith(f"n {size}"):
                    go_on(case, seeds, lines[case.name])
    print(HEAD, end="")
    for case in cases:
        print(summed_up(case, lines[case.name]), flush=True)


if __name__ == "__main__":
    main()
