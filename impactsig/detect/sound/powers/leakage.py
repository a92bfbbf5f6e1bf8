"""Hum in octaves: the power of low tones that the wavelet lets through.

The 5/3 wavelet rejects tones below an octave by only 12 dB per octave. Hum 60 dB above the noise
exceeds it in octaves above 1 kHz, most at the crests of its waveform: each is a rise of some
milliseconds, 100 a second, and the noise of the octave, a low quantile of its power, lies between
them. With N_b the noise of the narrow bands below an octave (`floor.py`), H the response of the
wavelet to a tone at the centre f_b of a band, and w the window of K samples, hum contributes

    p = 2 / (K sum_n w_n^2) sum_b N_b |H(f_b)|^2

to the mean power. In noise of any smooth spectrum 4 p is less than the noise of the octave. Where
it is more, a high-pass filter is needed before the octaves; and what hum is left is background:
the 0.9-quantile of the power, but no more than 4 p. Impacts do not raise N_b.
"""

from __future__ import annotations

import functools

import numpy as np

from .._kernels import EDGE, Scale, octave_powers
from .bands import Bands, bands_at

CRESTS = 4.0  # times its mean: power of hum at the crests of its waveform
OFTEN = 0.9  # quantile of the power that crests of hum reach
PERIODS = 1 << 14  # samples, at least, of a tone
STOP = 90.0  # [dB] of the filter
NARROWEST = 150.0  # [Hz], between what it stops and what it passes


@functools.lru_cache(maxsize=8)
def leakage_at(scale: Scale, rate: float, hop: int) -> np.ndarray:
    """Crests of power in octaves (octaves, bands) from unit power in narrow bands below them."""
    bands = bands_at(rate, hop)
    size = len(bands.window)
    count = -(-PERIODS // scale.hop) * scale.hop
    scratch, power = np.empty((3, count // 2)), np.empty((scale.octaves, count // scale.hop))
    out = np.zeros((scale.octaves, len(bands.first)))
    for b, frequency in enumerate(centres(bands)):
        above = frequency < 2.0 ** -(2.0 + np.arange(scale.octaves))
        if not above.any():
            break
        tone = np.sqrt(2.0) * np.cos(2.0 * np.pi * frequency * np.arange(count))
        octave_powers(tone, scale.octaves, *scratch, power)
        out[above, b] = power[above, EDGE:-EDGE].mean(axis=1)
    return CRESTS * 2.0 / (size * float(np.sum(bands.window.astype(float) ** 2))) * out


def centres(bands: Bands) -> np.ndarray:
    """Centres of the narrow bands, per sample."""
    begin = np.cumsum(bands.width) - bands.width
    index = np.arange(len(bands.weights)) + np.repeat(bands.first - begin, bands.width)
    weighed = np.add.reduceat(bands.weights * index, begin)
    return np.asarray(weighed / np.add.reduceat(bands.weights, begin) / len(bands.window))


def loudest_hum(noise: np.ndarray, leaks: np.ndarray) -> int:
    """The number of bands that a filter must stop, from the lowest up, for the octaves' `noise`.

    `leaks` (octaves, bands) are the crests of hum that each band contributes.
    """
    above = np.cumsum(leaks[:, ::-1], axis=1)[:, ::-1]
    return int(np.count_nonzero(above > noise[:, None], axis=1).max())


def add_hum(noise: np.ndarray, hum: np.ndarray, means: np.ndarray, sounding: np.ndarray) -> None:
    """Raise the noise of octaves to the crests of hum where these exceed it.

    `means` (octaves, groups) are the powers that the noise is a low quantile of.
    """
    for b in np.flatnonzero(hum > noise):
        kept = means[b, sounding]
        if len(kept):
            place = int(OFTEN * len(kept))
            noise[b] = max(noise[b], min(hum[b], np.partition(kept, place)[place]))


def high_pass(scale: Scale, rate: float, bands: Bands, stopped: int) -> np.ndarray:
    """Symmetric filter that passes the octaves and stops so many narrow bands."""
    from scipy import signal

    passed = 2.0 ** -(scale.octaves + 1.0)
    stop = min(float(centres(bands)[stopped - 1]), passed - NARROWEST / rate)
    count, beta = signal.kaiserord(STOP, 2.0 * (passed - stop))
    taps = signal.firwin(count | 1, passed + stop, window=("kaiser", beta), pass_zero=False)
    return np.asarray(taps)


def responses(taps: np.ndarray, bands: Bands) -> np.ndarray:
    """Power that a symmetric filter leaves of a tone at the centre of each band."""
    half = len(taps) // 2
    angle = 2.0 * np.pi * np.outer(centres(bands), np.arange(-half, half + 1))
    return np.asarray((np.cos(angle) @ taps) ** 2)


def filtered(x: np.ndarray, taps: np.ndarray) -> np.ndarray:
    """Samples through a symmetric filter; half its length is spoilt at either end."""
    from scipy import signal

    return np.asarray(signal.oaconvolve(x.astype(float), taps, mode="same"))
