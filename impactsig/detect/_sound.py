"""Impacts in a sound record: the instants at which the power rises at once in all octaves.

The record is split into octaves above about 1 kHz (5/3 wavelet), and their power taken in frames
of at most 0.5 ms. With F the mean power over the 4 ms from a frame on, weighted by a line that
falls to zero, A that over the 4 ms before it, and N the power of the noise, the rise is the mean
over the m octaves

    D = 1/m sum_b max(0, ln((F_b + 4 N_b) / (A_b + 4 N_b))).

Ringing decays and does not raise D, but it beats and rattles; how much tells the median of D over
the record. An impact is a crest of D that no other within 3 ms exceeds, of at least 22 times that
median and 0.5. Its attack is where, within 1.5 ms of the crest, the variance of the signal
changes most [Maeda1985]_: halfway between two samples. Where impacts sound alike, their waveforms
tell the instants closer (`_sound_alike.py`); where a filter rings before them, the modes that they
share do (`_shared_modes.py`).

N is the power that a tenth of the record stays below, freed from the bias of that choice, and no
less than 70 dB below the strongest. Nothing depends on how the record was cut into blocks. Memory
is bounded by the stretches kept for the median, the sounds that a waveform is learned from, and
1/256 of the record for the ranges of F and A.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..errors import InvalidInput
from ..impacts import CLIPPED
from ._shared_modes import SharedModes
from ._sound_alike import Lengths, Overlay, lengths_at
from ._sound_kernels import (
    BINS,
    BLOCK,
    EDGE,
    GROUP,
    Scale,
    octave_powers,
    rises,
    search,
    survey,
)
from ._stream import Piece, refuse_huge
from ._windows import Window, windows

LONGEST_HOP = 0.5e-3  # [s]
FORWARD = 4e-3  # [s]
PAST = 4e-3  # [s]
SPACING = 3e-3  # [s], between impacts
LAG_RATES = (22_050.0, 8_000.0)  # [Hz], of the innovations an attack is timed in
SLOPE = 0.25e-3  # [s], of the straight line they are taken from
SIGMAS = 2.0  # of the noise: weaker sound does not count
TIMES_BACKGROUND = 22.0
LEAST_RISE = 0.5  # in the mean over octaves [neper of power]: 2.2 dB
NOISE_QUANTILE, NORMAL_QUANTILE = 0.1, -1.2815515655446004
RANGE = 1e-7  # least noise power, of the strongest power: 70 dB
CORE = 32 * BLOCK  # frames of a window
STRETCH = 512  # frames kept together for the background
KEPT = 256  # stretches kept


class SoundImpacts(NamedTuple):
    """Impacts found in a sound record, and what they were judged by."""

    time: np.ndarray  # instants of attack since the first sample [s]
    peak: np.ndarray  # greatest deviation within 4 ms from the mean of the 4 ms before [unit]
    flags: np.ndarray  # uint8
    threshold: float  # RMS of a sound that counts [unit]
    noise: float  # RMS of the noise in the octaves searched [unit]
    least_rise: float  # threshold of D
    background: float  # median of D
    alike: float  # share of the impacts that are timed by their waveform
    reason: str  # why there are none
    time_error: np.ndarray  # standard error of the instants [s]; NaN where it is not known


@dataclass
class Levels:
    """What the first pass learns of the record."""

    samples: int = 0
    resolution: float = 0.0  # relative, of the numbers that hold the samples
    lowest: float = math.inf
    highest: float = -math.inf
    counts: np.ndarray = field(default_factory=lambda: np.empty(0))  # of the noise powers
    strongest: np.ndarray = field(default_factory=lambda: np.empty(0))  # per octave
    greatest: list[np.ndarray] = field(default_factory=list)  # per window: (octaves, blocks)
    least: list[np.ndarray] = field(default_factory=list)
    kept: list[tuple[int, np.ndarray, np.ndarray]] = field(default_factory=list)


def detect_sound(
    pieces: Callable[[], Iterable[Piece]],
    rate: float,
    *,
    threshold: float | None = None,
    skip: bool = True,
) -> SoundImpacts:
    """Find the impacts in a sound record.

    Parameters
    ----------
    pieces : callable
        Gives the record's stretches of finite samples, anew at each call.
    rate : float
        Sampling rate [Hz].
    threshold : float, optional
        Times the noise (RMS) that an impact must reach in every octave above 1 kHz. It tells
        knocks, which are heard at all frequencies, from duller sounds. By default 2 in the mean
        over octaves: an impact may ring in a few octaves only.
    skip : bool
        Pass over blocks that cannot hold an impact. The result is the same without it.

    Notes
    -----
    Settings found right on real recordings: drums, `merge_within` 0.03 s (strokes on two drums
    are never quite at once); taps on a desk, `merge_within` 0.1 s (a finger bounces); keys of a
    keyboard, `threshold` 15 and `merge_within` 0.3 s (press and release are two sounds; clicks at
    both ends of those recordings, perhaps of a mouse, are duller than a key).

    An impact in the first 4 ms or the last 6 ms of a stretch cannot be told: there is too little
    beside it to compare.
    """
    scale = scale_at(rate)
    left = scale.past + scale.spacing + EDGE
    right = scale.forward + scale.spacing + EDGE
    levels = survey_levels(pieces, scale, left, right)
    if not levels.samples or levels.lowest == levels.highest:
        reason = "the record is constant" if levels.samples else "the record has no valid sample"
        return _nothing(reason)
    refuse_huge(levels.lowest, levels.highest)
    floor, noise = noise_floor(levels, scale)
    background = background_rise(levels.kept, floor, scale)
    least_rise = max(LEAST_RISE, TIMES_BACKGROUND * background)
    sigmas = SIGMAS if threshold is None else threshold
    limits = (
        math.exp(least_rise * scale.octaves),
        0.0 if threshold is None else (threshold / SIGMAS) ** 2,
        levels.lowest,
        levels.highest,
    )
    lengths = sound_lengths(rate, scale)
    modes = SharedModes(rate, scale.short_lag, scale.slope)
    overlay = Overlay(lengths, lambda: modes.timing().shift)
    sounds = np.empty((CORE // scale.spacing + 2, lengths.length))
    found = [np.empty((0, 3))]
    for number, window in enumerate(windows(pieces(), CORE * scale.hop)):
        greatest, least = levels.greatest[number], levels.least[number]
        active = np.ones(greatest.shape[1], np.bool_)
        if skip:
            bound = np.empty(greatest.shape[1])
            rises(greatest, least, floor, len(bound), bound)
            active = bound >= limits[0]
            if not active.any():
                continue
        x, valid = window.samples(left * scale.hop, right * scale.hop, scale.hop)
        count = -(-len(window.core) // scale.hop)
        out = np.empty((count // scale.spacing + 2, 3))
        telling = telling_frames(window, scale)
        n = search(x, left, count, valid, telling, floor, limits, active, scale, out, sounds)
        out[:n, 0] += window.first - left * scale.hop
        modes.add(window, out[:n, 0])
        overlay.add(sounds[:n])
        out[:n, 0] += window.segment
        found.append(out[:n])
    columns = np.concatenate(found)
    by_wave, by_modes = overlay.shifts(), modes.timing()
    # An attack that is off by more than the waveform can be shifted is laid a period beside it.
    beside = np.abs(by_wave - by_modes.shift) > np.maximum(lengths.agree, 5.0 * by_modes.error)
    alike = np.isfinite(by_wave) & ~beside
    columns[:, 0] = shifted(columns[:, 0], np.where(alike, by_wave, by_modes.shift))
    reason = ""
    if not len(columns):
        decibels = 10.0 / math.log(10.0)
        reason = (
            f"the power rises nowhere by {decibels * least_rise:.1f} dB within "
            f"{1e3 * FORWARD:g} ms, in the mean over octaves, to {sigmas:g} times the noise"
        )
    return SoundImpacts(
        columns[:, 0] / rate,
        columns[:, 1],
        (CLIPPED * columns[:, 2]).astype(np.uint8),
        sigmas * noise,
        noise,
        least_rise,
        background,
        float(alike.mean()) if len(alike) else 0.0,
        reason,
        np.where(alike, np.nan, by_modes.error) / rate,
    )


def _nothing(reason: str) -> SoundImpacts:
    none = np.empty(0)
    return SoundImpacts(
        none, none, np.empty(0, np.uint8), 0.0, 0.0, LEAST_RISE, 0.0, 0.0, reason, none
    )


def shifted(attack: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """Instants of attack shifted where a shift is known.

    Where that would put two out of order, both stay as they are.
    """
    known = np.isfinite(shift)
    while True:
        instant = np.where(known, attack + shift, attack)
        crossed = np.flatnonzero(np.diff(instant) <= 0)
        if not len(crossed):
            return instant
        known[crossed] = known[crossed + 1] = False


def scale_at(rate: float) -> Scale:
    """The lengths of the detector at a sampling rate.

    Raises
    ------
    InvalidInput
        If the rate leaves no octave above 1 kHz, or is beyond that of any sound.
    """
    if not 4e3 <= rate <= 1e6:
        raise InvalidInput(
            "rate", rate, "4 kHz to 1 MHz for sound", 'Give sensor="force" for other records'
        )
    octaves = int(math.log2(rate * LONGEST_HOP))
    hop = 2**octaves
    past, forward, spacing = (max(round(t * rate / hop), 1) for t in (PAST, FORWARD, SPACING))
    short_lag, long_lag = (max(round(rate / f), 1) for f in LAG_RATES)
    slope = max(round(rate * SLOPE), 1)
    reach = spacing * hop // 2
    scale = Scale(hop, octaves, past, forward, spacing, short_lag, long_lag, slope, reach, 0)
    return scale._replace(before=sound_lengths(rate, scale).before)


def sound_lengths(rate: float, scale: Scale) -> Lengths:
    """Lengths of the sounds that are laid over each other: they last until the next may come."""
    return lengths_at(rate, scale.short_lag, scale.slope, scale.spacing * scale.hop)


def survey_levels(
    pieces: Callable[[], Iterable[Piece]], scale: Scale, left: int, right: int
) -> Levels:
    """First pass: noise powers, ranges of the blocks, and every 2^k-th stretch of powers."""
    levels = Levels(
        counts=np.zeros((scale.octaves, BINS), np.int64), strongest=np.zeros(scale.octaves)
    )
    stride, stretch = 1, 0
    for window in windows(pieces(), CORE * scale.hop):
        core = window.core
        x, _ = window.samples(left * scale.hop, right * scale.hop, scale.hop)
        count = -(-len(core) // scale.hop)
        whole = min((len(core) + len(window.after)) // scale.hop - EDGE, count)
        shape = (scale.octaves, -(-count // BLOCK))
        levels.greatest.append(np.empty(shape))
        levels.least.append(np.empty(shape))
        after, before = np.empty((scale.octaves, count)), np.empty((scale.octaves, count))
        strongest = survey(
            x,
            left,
            count,
            max(whole, 0),
            levels.counts,
            scale,
            after,
            before,
            levels.greatest[-1],
            levels.least[-1],
        )
        first, last = telling_frames(window, scale)
        after[:, : max(first, 0)] = 0.0
        after[:, max(last, 0) :] = 0.0
        levels.strongest = np.maximum(levels.strongest, strongest)
        levels.samples += len(core)
        if np.issubdtype(core.dtype, np.floating):
            levels.resolution = float(np.finfo(core.dtype).eps)
        levels.lowest = min(levels.lowest, float(core.min()))
        levels.highest = max(levels.highest, float(core.max()))
        for k in range(0, count, STRETCH):
            if stretch % stride == 0:
                part = slice(k, k + STRETCH)
                levels.kept.append((stretch, after[:, part].copy(), before[:, part].copy()))
                if len(levels.kept) > KEPT:
                    stride *= 2
                    levels.kept = [item for item in levels.kept if item[0] % stride == 0]
            stretch += 1
    return levels


def telling_frames(window: Window, scale: Scale) -> tuple[int, int]:
    """First and last (exclusive) frame, from the core's first, with all that D needs beside it."""
    last = (len(window.core) + len(window.after)) // scale.hop - EDGE - scale.forward
    return scale.past - window.first // scale.hop, last


def noise_floor(levels: Levels, scale: Scale) -> tuple[np.ndarray, float]:
    """Power below which a rise does not count, per octave; RMS of the noise [unit].

    The mean of n squares of Gaussian noise of power N stays below N (1 - 2/9n + z sqrt(2/9n))^3
    with the probability of z (Wilson and Hilferty).
    """
    seen = levels.counts.sum(axis=1)
    rounding = (levels.resolution * max(-levels.lowest, levels.highest)) ** 2
    total = 0.0
    floor = np.zeros(scale.octaves)
    for b, gain in enumerate(white_gains(scale)):
        place = int(np.searchsorted(np.cumsum(levels.counts[b]), NOISE_QUANTILE * seen[b]))
        power = 2.0 ** ((place + 0.5) / 64.0 - 300.0) if place else 0.0
        n = GROUP * scale.hop / 2 ** (b + 1)
        power /= (1.0 - 2.0 / (9.0 * n) + NORMAL_QUANTILE * math.sqrt(2.0 / (9.0 * n))) ** 3
        floor[b] = SIGMAS**2 * max(power, RANGE * levels.strongest[b], rounding)
        total += power / (gain * 2 ** (b + 1))
    return floor, math.sqrt(total)


def white_gains(scale: Scale) -> np.ndarray:
    """Power of each octave's details for white noise of power 1."""
    half = EDGE * scale.hop
    impulse = np.zeros(2 * half)
    gains = np.zeros(scale.octaves)
    even, odd, high = np.empty(half), np.empty(half), np.empty(half)
    power = np.empty((scale.octaves, 1))
    for shift in range(scale.hop):
        impulse[:] = 0.0
        impulse[half + shift] = 1.0
        octave_powers(impulse, scale.octaves, even, odd, high, power)
        gains += power[:, 0] * 2 * half / scale.hop
    return gains


def background_rise(
    kept: list[tuple[int, np.ndarray, np.ndarray]], floor: np.ndarray, scale: Scale
) -> float:
    """Median of D over the frames kept."""
    found = []
    for _, after, before in kept:
        ratio = np.empty(after.shape[1])
        rises(after, before, floor, len(ratio), ratio)
        found.append(ratio)
    return math.log(np.median(np.concatenate(found))) / scale.octaves
