"""Impact times in cycles of a base period whose rate is tracked through the run."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ._tracking_kernels import coherence, window_scores

HARMONICS = np.arange(1, 9)
WEIGHT = np.exp(-((0.11 * HARMONICS) ** 2))  # what jitter leaves of the harmonics
LEAST_WINDOW = 20.0  # [cycles]
WINDOW_IMPACTS = 14.0  # and at least so many impacts in a window, on average
LEAST_WINDOWS = 1.5  # in a run whose rate is followed
SPARSEST = 100.0  # cycles an impact
WANDER = 0.0015  # standard deviation by which the rate changes, per square root of a cycle
BLOCK = 30  # impacts of which one phase is read
REACH = 0.12  # [cycles] by which the phase of a block may be off the one predicted
FADING = 0.85  # weight of the template against the block before it
CARRIED = 0.7  # share of the slope that is carried on
RATE_ERROR = 0.026  # relative, of the base period given and of its drift through the run
MOST_REFINED = 2000  # impacts used to find a single rate; they are spread over the run


class Warps:
    """A train in several warps of time, each computed when first used.

    Attributes
    ----------
    cycles : ndarray
        The train by the clock given, whose rate is right to `RATE_ERROR`.
    """

    def __init__(self, cycles: np.ndarray) -> None:
        self.cycles = cycles

    @cached_property
    def constant(self) -> np.ndarray:
        """Cycles at the one rate that suits the train best."""
        return steady_rate(self.cycles, RATE_ERROR)

    @cached_property
    def rate(self) -> np.ndarray:
        """Cycles at a rate that is tracked through the run; for a short run, at the one rate."""
        if np.ptp(self.cycles) < LEAST_WINDOWS * _window(self.cycles):
            return self.constant
        return tracked_rate(self.cycles, RATE_ERROR)

    @cached_property
    def phase(self) -> np.ndarray:
        """The same, with the phase tracked as well."""
        return tracked_phase(self.rate)


def steady_rate(cycles: np.ndarray, tolerance: float) -> np.ndarray:
    """Cycles at the one rate, within `tolerance` of 1, at which harmonics are most coherent.

    They are coherent inside windows of a few cycles, then of ever more, up to the whole run.
    """
    rate, longest = 1.0, max(float(cycles[-1]), 1e-9) * 1.001
    # eight impacts to the first window, which else has as many peaks as it has impacts
    window = min(max(2 * LEAST_WINDOW, 8 * longest / len(cycles)), longest)
    limits = rate - tolerance, rate + tolerance
    while True:
        # four samples to a peak of the highest harmonic
        step = 1 / (4 * window * HARMONICS[-1])
        reach = step * np.ceil(tolerance / step)
        low, high = max(rate - reach, limits[0]), min(rate + reach, limits[1])
        power = np.empty(max(round((high - low) / step), 2) + 1)
        step = (high - low) / (len(power) - 1)
        _fill_coherence(cycles, window, low, step, power)
        best = int(np.argmax(power))
        rate = float(np.clip(low + step * (best + vertex(power, best)), *limits))
        if window >= longest:
            return cycles * rate
        tolerance = 2 * step
        window = min(6 * window, longest)


def is_sparse(cycles: np.ndarray) -> bool:
    """Whether impacts are too rare in this clock for it to mean anything.

    No period is as long, and the rates to be tried grow with the time that eight impacts take.
    """
    return bool(cycles[-1] - cycles[0] > SPARSEST * len(cycles))


def tracked_rate(cycles: np.ndarray, tolerance: float) -> np.ndarray:
    """Cycles at a rate that is followed through the run, within `tolerance` of 1.

    In windows of 20 cycles and more, weighted by a Gaussian, the score of a rate is the power of
    the harmonics of the base period; the sequence of rates is the best one under a random walk
    (Viterbi's algorithm). A motion of period (m, n) has m phases modulo 1 whatever n, so harmonics
    of the base period serve for all of them.
    """
    span, window = float(np.ptp(cycles)), _window(cycles)
    stride, width = window / 4, window / 4
    centre = cycles[0] + stride * np.arange(int(span / stride) + 2)
    step = 0.19 / (4 * window)
    count = int(np.ceil(tolerance / step))
    rate = step * np.arange(-count, count + 1)
    score = np.empty((len(centre), len(rate)))
    low = np.searchsorted(cycles, centre - 2.5 * width)
    high = np.searchsorted(cycles, centre + 2.5 * width)
    window_scores(cycles, low, high, centre, rate[0], step, width, WEIGHT, score)
    # windows overlap: each impact counts once
    score *= stride / (width * np.sqrt(np.pi))
    states = np.arange(len(rate))
    cost = step**2 / (2 * WANDER**2 * stride / 6) * (states[:, None] - states) ** 2
    path = rate[best_path(score, cost)]
    # the walk moves in steps; a parabola over three windows smooths it
    smooth = np.convolve(np.pad(path, 1, "edge"), [0.25, 0.5, 0.25], "valid")
    return cycles + spline_integral(smooth, stride, cycles - centre[0])


def spline_integral(values: np.ndarray, step: float, x: np.ndarray) -> np.ndarray:
    """Integral from 0 to each x of the cubic spline through values at 0, step, 2 step, ...

    With the second derivatives m of the spline, ``m[i - 1] + 4 m[i] + m[i + 1]`` are 6 times the
    second differences over step^2. There is no knot one step from either end ("not-a-knot"), so
    that equation alone tells ``m[1]``. At least four values; scipy.interpolate has such splines
    too, but to import it takes a fifth of a short command's time.
    """
    bend = 6 * np.diff(values, 2)
    m = np.empty(len(values))
    m[1], m[-2] = bend[0] / 6, bend[-1] / 6
    right, ratios, reduced = bend[1:-1].copy(), [0.0], [m[1]]
    for known in right.tolist():
        ratios.append(1 / (4 - ratios[-1]))
        reduced.append((known - reduced[-1]) * ratios[-1])
    for i in range(len(values) - 3, 1, -1):
        m[i] = reduced[i - 1] - ratios[i - 1] * m[i + 1]
    m[0], m[-1] = 2 * m[1] - m[2], 2 * m[-2] - m[-3]
    whole = (values[:-1] + values[1:]) / 2 - (m[:-1] + m[1:]) / 24
    before = np.concatenate([[0.0], np.cumsum(whole)])
    k = np.clip((x / step).astype(np.intp), 0, len(values) - 2)
    u = x / step - k
    since, ahead = u * u, 1 - (1 - u) ** 2
    part = (values[k] * ahead + values[k + 1] * since) / 2
    part -= (m[k] * ahead**2 + m[k + 1] * since * (2 - since)) / 24
    return step * (before[k] + part)


def _window(cycles: np.ndarray) -> float:
    """Length of the windows in which the rate is tracked."""
    return max(LEAST_WINDOW, WINDOW_IMPACTS * float(np.ptp(cycles)) / len(cycles))


def tracked_phase(cycles: np.ndarray) -> np.ndarray:
    """Cycles minus the phase of blocks of impacts against a fading template, twice."""
    count = len(cycles) // BLOCK
    if count < 3:
        return cycles
    for _ in range(2):
        edges = np.linspace(0, len(cycles), count + 1).astype(np.intp)
        sums = np.add.reduceat(harmonics(cycles), edges[:-1], axis=1)
        centre = np.add.reduceat(cycles, edges[:-1]) / np.diff(edges)
        phase = np.zeros(count)
        middle = count // 2
        for order in (range(middle + 1, count), range(middle - 1, -1, -1)):
            _follow(sums, centre, phase, order, middle)
        cycles = cycles - _between(cycles, centre, phase)
    return cycles


def _follow(
    sums: np.ndarray, centre: np.ndarray, phase: np.ndarray, order: range, begin: int
) -> None:
    """Track the phases of blocks in this order, from the block `begin` on."""
    shift = np.linspace(-REACH, REACH, 97)
    turn = np.exp(-2j * np.pi * shift[:, None] * HARMONICS)
    template = sums[:, begin] * WEIGHT
    before, slope = begin, 0.0
    for k in order:
        apart = centre[k] - centre[before]
        predicted = phase[before] + slope * apart
        turned = sums[:, k] * np.exp(-2j * np.pi * HARMONICS * predicted)
        overlap = ((turn * turned) @ template.conj()).real
        best = int(np.argmax(overlap))
        moved = shift[best] + (shift[1] - shift[0]) * vertex(overlap, best)
        phase[k] = predicted + moved
        template = FADING * template
        template += (1 - FADING) * turned * np.exp(-2j * np.pi * HARMONICS * moved) * WEIGHT
        if apart:
            slope = CARRIED * slope + (1 - CARRIED) * (phase[k] - phase[before]) / apart
        before = k


def harmonics(cycles: np.ndarray) -> np.ndarray:
    """exp(2 pi i h u) of every harmonic h, shape (8, n)."""
    turn = np.exp(2j * np.pi * cycles)
    power = np.empty((len(HARMONICS), *cycles.shape), complex)
    power[0] = turn
    for h in range(1, len(HARMONICS)):  # by rows, in a third of cumprod's time
        np.multiply(power[h - 1], turn, out=power[h])
    return power


def vertex(values: np.ndarray, best: int) -> float:
    """Position of a maximum between samples, by the parabola through its neighbours."""
    if not 0 < best < len(values) - 1:
        return 0.0
    below, peak, above = values[best - 1 : best + 2]
    curvature = below - 2 * peak + above
    return float(0.5 * (below - above) / curvature) if curvature < 0 else 0.0


def best_path(score: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Path of greatest total score through the columns, minus a cost for changes.

    Viterbi's algorithm.
    """
    states = np.arange(score.shape[1])
    came_from = np.zeros(score.shape, np.intp)
    best = score[0]
    for k in range(1, len(score)):
        reached = best[:, None] - change
        came_from[k] = np.argmax(reached, axis=0)
        best = reached[came_from[k], states] + score[k]
    path = np.empty(len(score), np.intp)
    path[-1] = int(np.argmax(best))
    for k in range(len(score) - 1, 0, -1):
        path[k - 1] = came_from[k, path[k]]
    return path


def _fill_coherence(
    cycles: np.ndarray, window: float, rate: float, step: float, power: np.ndarray
) -> None:
    """Power of the harmonics inside windows, summed over both, at each rate + r step."""
    which = (cycles / window).astype(np.intp)
    if len(cycles) > MOST_REFINED:
        first = np.flatnonzero(np.diff(which, prepend=-1))
        size = len(cycles) / len(first)
        keep = max(int(MOST_REFINED / size), 1)
        kept = which[first[np.linspace(0, len(first) - 1, keep).astype(np.intp)]]
        inside = np.isin(which, kept)
        cycles, which = cycles[inside], which[inside]
    first = np.flatnonzero(np.diff(which, prepend=-1))
    coherence(cycles - (which + 0.5) * window, first, rate, step, WEIGHT, power)


def _between(cycles: np.ndarray, centre: np.ndarray, phase: np.ndarray) -> np.ndarray:
    """Phase of blocks interpolated at every impact, extrapolated at both ends."""
    inside = np.interp(cycles, centre, phase)
    for end, inner, beyond in ((0, 1, cycles < centre[0]), (-1, -2, cycles > centre[-1])):
        slope = (phase[end] - phase[inner]) / (centre[end] - centre[inner])
        inside[beyond] = phase[end] + slope * (cycles[beyond] - centre[end])
    return inside
