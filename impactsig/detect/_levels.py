"""What a force record is searched with: matched response, noise, and the level of certainty."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ._force_kernels import Matched, respond, strongest_responses

NOISE_RUNS = 32  # estimates of the noise
NOISE_RUN = 2048  # samples of one, or 32 widths of a pulse
WIDEST = 2048  # widest matched response [samples]
FALSE_ALARMS = 0.05  # expected in a record, were the noise Gaussian; or, if that is more,
FALSE_SHARE = 0.002  # of the impacts found
LEAST_SIGMA = 5.0
DOUBTFUL = 0.02  # of the strongest response: quiet stretches must be quieter than this
# The mean over w of a half-sine of length T is most above white noise (by sqrt(w)) at
# tan(x) = 2 x, x = pi w / (2 T) = 1.16556; it is then sin(x)/x of the peak.
HALF_SINE_GAIN = 1.16556 / math.sin(1.16556)


class Levels(NamedTuple):
    """Levels of the matched response [unit], and the noise of the samples [unit]."""

    threshold: float
    release: float
    noise: float
    matched_noise: float


def matched_response(
    strong: list[tuple[np.ndarray, bool]], polarity: float
) -> tuple[Matched, float]:
    """Direction and width of the pulses, from the strongest of each frame; its response.

    The width is the one at which the response, in units of the noise that white noise would have
    there (1/sqrt(width)), is greatest; the median over frames.
    """
    up: list[tuple[float, int]] = []  # strength and width of each frame's strongest
    down: list[tuple[float, int]] = []
    lean = 0.0
    for x, whole in strong:
        octaves = [_matched(1.0, width) for width in _widths(len(x), steps=1)]
        extremes = np.empty((len(octaves), 4))
        strongest_responses(x, whole, np.array(octaves), extremes)
        for sign, column, best in ((1.0, 0, up), (-1.0, 2, down)):
            best.append(_best_width(x, sign, octaves, extremes[:, column : column + 2]))
        middle = shortest_half(x[:: max(1, len(x) // 2048)])[0]
        lean += float(x.max()) + float(x.min()) - 2.0 * middle
    both = [sum(item[0] for item in side) for side in (up, down)]
    sign = 1.0 if both[0] >= both[1] else -1.0
    # Close-set pulses have gaps as strong as themselves; the values lean away from their floor.
    if max(both) < 1.5 * min(both):
        sign = 1.0 if lean >= 0 else -1.0
    sign = polarity or sign
    chosen = up if sign > 0 else down
    # Frames in which nothing but noise was strongest must not set the width.
    loud = [item for item in chosen if item[0] >= 0.25 * max(chosen)[0]]
    width = int(np.median([item[1] for item in loud]))
    strongest = max(abs(_matched(sign, w).gain) * x / math.sqrt(w) for x, w in chosen)
    return _matched(sign, width), max(strongest, 0.0)


def _best_width(
    x: np.ndarray, sign: float, octaves: list[Matched], extremes: np.ndarray
) -> tuple[float, int]:
    """Strength and width of the strongest response, to a quarter of an octave."""
    strengths = [_strength(sign * row[0], m) for row, m in zip(extremes, octaves, strict=True)]
    octave = int(np.argmax(strengths))
    index = int(extremes[octave, 1])
    best = (strengths[octave], octaves[octave].width)
    for width in _widths(len(x), steps=4):
        if 0.5 <= width / octaves[octave].width <= 2:
            trial = _matched(sign, width)
            response = _respond_near(x, trial, index, width)
            best = max(best, (_strength(float(response.max()), trial), width))
    return best


def _strength(response: float, matched: Matched) -> float:
    return response / abs(matched.gain) * math.sqrt(matched.width)


def _matched(sign: float, width: int) -> Matched:
    near = width + (width + 1) // 2 + 1
    gain = sign * HALF_SINE_GAIN if width > 1 else sign
    return Matched(gain, width, near, near + 4 * width + 4)


def _widths(samples: int, steps: int) -> list[int]:
    """From 1 up, `steps` an octave, as wide as the samples allow."""
    widest = max(1, min(WIDEST, samples // 8))
    return sorted({round(2 ** (k / steps)) for k in range(int(steps * math.log2(widest)) + 1)})


def _respond_near(x: np.ndarray, matched: Matched, index: int, around: int) -> np.ndarray:
    """Matched response of x at the samples at most `around` from `index`."""
    first, last = max(0, index - around), min(len(x), index + around + 1)
    return _response(x, matched, first, last)


def _response(x: np.ndarray, matched: Matched, first: int, last: int) -> np.ndarray:
    y = np.empty(last - first)
    sums = np.empty(last - first + 2 * (matched.far + matched.width) + 1)
    respond(x, 0, len(x), first, last, matched, sums, y)
    return y


def noise_levels(
    spread: list[np.ndarray], matched: Matched, strongest: float
) -> tuple[float, float]:
    """Standard deviation of the noise: of the samples above their flanks, and of the response.

    Each run of samples gives one estimate, from the shortest interval that holds half of the
    values: right as long as pulses and their flanks fill less than half of the run. Where they
    fill more, the quietest stretches of the run tell, if they are quiet beyond doubt. The upper
    quartile of the runs is taken: a record silent for a part of the time is as noisy as the rest
    of it.
    """
    single = matched._replace(gain=1.0, width=1)
    estimates: list[tuple[float, float]] = []
    length = max(NOISE_RUN, 32 * matched.width)
    step = max(1, len(spread) // NOISE_RUNS)
    runs = max(1, NOISE_RUNS // len(spread))
    for x in spread[::step]:
        count = min(runs, max(1, len(x) // length))
        for k in range(count):
            first = len(x) * k // count
            last = min(len(x), first + length)
            raw = shortest_half(_response(x, single, first, last))[1]
            filtered = shortest_half(_response(x, matched, first, last))[1]
            quiet = _quiet_stretches(x[first:last], matched.width)
            if quiet < DOUBTFUL * strongest:
                # Noise of any colour: at worst averaging over a width does not reduce it.
                raw, filtered = min(raw, quiet), min(filtered, abs(matched.gain) * quiet)
            estimates.append((raw, filtered))
    raw, filtered = np.quantile(np.array(estimates), 0.75, axis=0, method="nearest")
    return float(raw), float(filtered)


def _quiet_stretches(x: np.ndarray, width: int) -> float:
    """1.5 times the standard deviation that 15 % of the stretches of a pulse's width stay below.

    The factor makes it no lower than sigma for white noise in stretches of eight samples.
    """
    length = max(min(width, len(x) // 20), 8)
    count = len(x) // length
    if count < 4:
        return math.inf
    deviations = x[: count * length].reshape(count, length).astype(np.float64).std(axis=1)
    return 1.5 * float(np.quantile(deviations, 0.15, method="nearest"))


def shortest_half(values: np.ndarray) -> tuple[float, float]:
    """Middle of the shortest interval that holds half of the values, and the Gaussian sigma of it.

    Rousseeuw & Leroy's shorth [Rousseeuw1988]_: for Gaussian values the interval is 1.349 sigma
    long.
    """
    ordered = np.sort(values)
    half = len(ordered) // 2 + 1
    lengths = ordered[half - 1 :] - ordered[: len(ordered) - half + 1]
    at = int(np.argmin(lengths))
    return float(ordered[at] + ordered[at + half - 1]) / 2, float(lengths[at]) / 1.3489795


def discovery_level(responses: np.ndarray, widths: float) -> float:
    """Level, in sigma, above which hardly any of the `responses` is noise.

    The lowest at which Gaussian noise would exceed it FALSE_ALARMS times in the whole record, or
    once for 1/FALSE_SHARE of the impacts that do, on average [Benjamini1995]_. The mean of white
    noise over a sliding window has the covariance 1 - |lag| / width, for which excursions above
    u begin u^2 Q(u) times a width, Q being the upper tail [Aldous1989]_.
    """

    def expected(u: float) -> float:
        return widths * u * u * 0.5 * math.erfc(u / math.sqrt(2))

    lowest = LEAST_SIGMA
    while expected(lowest) > FALSE_ALARMS:
        lowest += 0.01
    for rank, u in enumerate(sorted(responses, reverse=True), start=1):
        if u < lowest and expected(u) <= FALSE_SHARE * rank:
            lowest = float(u)
    return lowest
