"""Mains hum in a force record: detection, fit and removal.

Taken off, not filtered out: a filter would move the first touch. In each span the lines of 50 or
60 Hz that stand out of their surroundings are fitted to the samples between impacts, with
amplitudes that change linearly in time, which a frequency that is 0.1 % off needs no more than;
where it is off by more, it is read from the strongest line.
"""

from __future__ import annotations

import functools

import numpy as np

from .mains_kernels import mean_blocks, normal_equations, stand_out

BASES = (50.0, 60.0)
HARMONICS = 10
ASIDE = 3.5  # Hz from a line: what is as strong there is no line
STANDS = 8.0  # times what is beside it: a line
STANDS_TOO = 3.0  # the same of a harmonic, where one line is known
LOUD = 0.7  # of the noise of a sample: a line that need not stand out by more than a harmonic
SMALL = 0.02  # of the noise of a sample: too weak to matter
RIDGE = 1e-3
STEADY, FINE = 1e-3, 2e-4  # of the frequency: off by less is none, and how finely it is read
BESIDE, LEFT = 1.0, 0.15  # Hz from a line; what a fit of the mains leaves there, of the line
MOST = 2.0  # seconds of a span in which the mains keep their pace


@functools.lru_cache(maxsize=8)
def _waves(count: int, pace: float, frequencies: tuple[float, ...]) -> np.ndarray:
    """exp(i omega t) at the centres of blocks, a row for each frequency."""
    t = (np.arange(count) + 0.5) / pace
    return np.exp(2j * np.pi * np.array(frequencies)[:, None] * t)


@functools.lru_cache(maxsize=8)
def _seen_through(count: int, pace: float, lines: tuple[float, ...]) -> np.ndarray:
    """Rows whose products with the block means are twice the complex amplitudes.

    Those of the lines, then of what is below and above each.
    """
    frequencies = lines + tuple(f + d for f in lines for d in (-ASIDE, ASIDE))
    window = np.hanning(count + 2)[1:-1]
    waves = 2.0 * _waves(count, pace, frequencies) * window / window.sum()
    return np.vstack((waves.real, waves.imag))


def _standing(
    means: np.ndarray, pace: float, frequencies: tuple[float, ...], times: float, sigma: float
) -> np.ndarray:
    """Amplitudes of lines in a Hann window; 0 for lines that do not stand out."""
    amplitudes = np.empty(len(frequencies))
    waves = _seen_through(len(means), pace, frequencies)
    # What makes up much of the background hides impacts from its mask, and they hide the line.
    stand_out(waves, means, times, SMALL * sigma, STANDS_TOO, LOUD * sigma, amplitudes)
    return amplitudes


def base_of(lines: tuple[float, ...]) -> float:
    """Mains frequency of the first of some lines."""
    return next(one for one in BASES if lines[0] % one == 0)


@functools.lru_cache(maxsize=8)
def _first_lines(highest: float) -> tuple[float, ...]:
    """The lines by which hum is recognised."""
    return tuple(b * h for b in BASES for h in (1, 2, 3) if b * h < highest)


@functools.lru_cache(maxsize=8)
def _every_line(base: float, highest: float) -> tuple[float, ...]:
    """Those of the mains of one frequency."""
    return tuple(base * h for h in range(1, HARMONICS + 1) if base * h < highest)


def find_lines(
    sums: np.ndarray,
    counts: np.ndarray,
    pace: float,
    rate: float,
    sigma: float,
    fitted: tuple[float, ...] = (),
    base: float | None = None,
) -> tuple[float, ...]:
    """Frequencies of the mains lines in the background, and those fitted before.

    Parameters
    ----------
    sums, counts : arrays (b,)
        Sums of the samples of the background in each block, and of how many.
    pace, rate : float
        Blocks and samples a second.
    sigma : float
        Noise of a sample; weaker lines are left.
    fitted : tuple of float
        Lines that are taken off already. What is left of one need not stand out to be worth
        another fit, and others stand out more clearly.
    base : float, optional
        The mains that the seconds beside show: its lines need not stand out as one that is new.
    """
    if len(sums) < 64 or len(sums) / pace > MOST or counts.sum() < 0.3 * len(sums) * rate / pace:
        return fitted
    means, halved = np.empty(len(sums)), np.empty(len(sums) // 2)
    mean_blocks(sums, counts, means, halved)
    highest = 0.4 * pace
    if fitted:
        base = base_of(fitted)
    elif base is None:
        first = _first_lines(0.5 * highest)
        if not first:
            return ()
        amplitudes = _standing(halved, 0.5 * pace, first, STANDS, sigma)
        strongest = int(np.argmax(amplitudes))
        if not amplitudes[strongest]:
            return ()
        base = base_of(first[strongest:])
    every = _every_line(base, highest)
    amplitudes = _standing(means, pace, every, STANDS_TOO, sigma)
    others = {f for f, a in zip(every, amplitudes, strict=True) if a}
    return tuple(sorted({*fitted, *others}))


def fit_lines(
    sums: np.ndarray, counts: np.ndarray, block: int, rate: float, lines: tuple[float, ...]
) -> np.ndarray:
    """Complex amplitudes of the lines at the middle of the span, and their change over it.

    Returns
    -------
    array (lines, 2)
        x(t) = Re sum (a + b u) exp(i omega t), u from -1 to 1 over the blocks.
    """
    if max(lines) < 0.2 * rate / block:  # blocks of twice the length tell as much
        even = len(sums) // 2 * 2
        sums, counts = (one[:even:2] + one[1:even:2] for one in (sums, counts))
        block *= 2
    design = _design(len(sums), block, rate, lines)
    normal, right = np.empty((len(design), len(design))), np.empty(len(design))
    normal_equations(design, sums, counts, RIDGE, normal, right)
    parts = np.linalg.solve(normal, right)[:-1].reshape(2, 2, -1)
    return (parts[:, 0] + 1j * parts[:, 1]).T.copy()


def pace_of(sums: np.ndarray, counts: np.ndarray, pace: float, line: float) -> float:
    """Frequency of a line over its nominal one, by the turn of its phase between two halves.

    A generator may be a hertz off; grids keep their pace to 0.1 %, where it is 1.
    """
    half = len(sums) // 2
    window = np.hanning(half + 2)[1:-1]
    turned = 1.0 + 0.0j
    for part in (slice(half), slice(half, 2 * half)):
        means, halved = np.empty(half), np.empty(half // 2)
        mean_blocks(sums[part], counts[part], means, halved)
        wave = _waves(2 * half, pace, (line,))[0][part]
        turned = (window * means) @ wave * np.conj(turned)
    off = -np.angle(turned) / (2.0 * np.pi) * pace / half / line
    return 1.0 + FINE * round(off / FINE) if abs(off) > STEADY else 1.0


def keeps_pace(
    sums: np.ndarray, counts: np.ndarray, pace: float, lines: tuple[float, ...], fit: np.ndarray
) -> bool:
    """Whether the strongest line was one of the mains: little is left beside it.

    Of a tone a third of a hertz and more beside, the fit leaves much.

    Parameters
    ----------
    sums, counts : arrays (b,)
        Of the background, once the fit is taken off.
    """
    strongest = int(np.argmax(np.abs(fit[:, 0])))
    means, halved = np.empty(len(sums)), np.empty(len(sums) // 2)
    mean_blocks(sums, counts, means, halved)
    window = np.hanning(len(means) + 2)[1:-1]
    beside = (lines[strongest] - BESIDE, lines[strongest] + BESIDE)
    left = np.abs(_waves(len(means), pace, beside) @ (window * means)) * 2.0 / window.sum()
    return bool(left.max() < LEFT * abs(fit[strongest, 0]))


@functools.lru_cache(maxsize=8)
def _design(count: int, block: int, rate: float, lines: tuple[float, ...]) -> np.ndarray:
    """Design matrix of the lines for the means of blocks, a row each."""
    f = np.array(lines)
    # What the mean over a block leaves of a line.
    left = np.sin(np.pi * f * block / rate) / (block * np.sin(np.pi * f / rate))
    waves = _waves(count, rate / block, lines) * left[:, None]
    u = np.linspace(-1.0, 1.0, count)
    return np.vstack((waves.real, -waves.imag, u * waves.real, -u * waves.imag, np.ones(count)))
