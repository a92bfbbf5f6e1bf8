"""Hum in octaves: low tones that the wavelet lets through, and the filter that stops them.

The 5/3 wavelet rejects tones below an octave by only 12 dB per octave. Hum 60 dB above the noise
exceeds it in octaves above 1 kHz, most at the crests of its waveform: each is a rise of some
milliseconds, 100 a second, and the background of the octave, a low quantile of its power, lies
between them. With N_b the noise of narrow bands (`floor.py`), H the response of the wavelet to a
tone at the centre f_b of a band, and w the window of K samples, bands contribute

    p = 2 / (K sum_n w_n^2) sum_b N_b |H(f_b)|^2

to the mean power of an octave, and at crests of hum about four times as much. Where 4 p of the
bands below the octaves is more than twice the background of one, so that it counts, octaves are
read and attacks are timed behind a high-pass filter. In white, pink and brown noise 4 p is less
than the background. Impacts raise N_b only if they are dense; then, as with a buzz, tones between
pulses or tones that beat, 4 p of the bands within the octaves is more than 5 times the background,
4 times in noise. No filter separates these from impacts, and none is used.

The filter has linear phase: a causal one delays sounds by their frequencies, and instants by 0.1
ms. It stops no more bands than it must, and narrow bands are read before it.
"""

from __future__ import annotations

import functools

import numpy as np

from .._kernels import EDGE, Scale, octave_powers
from .band_kernels import TIMES_BACKGROUND
from .bands import Bands, bands_at
from .filtering import Filter

CRESTS = 4.0  # times its mean: power of hum at the crests of its waveform
PULSES = 1.25  # times the mean in noise: power within the octaves that is not steady
LENGTH = 1 << 13  # samples, about, of the tones that the wavelet is asked about
HEARD = 0.5  # of what counts: crests that a filter may leave
STOPPED = 90.0  # [dB]
NARROWEST = 150.0  # [Hz], between what the filter stops and what it passes


@functools.lru_cache(maxsize=8)
def crests_at(scale: Scale, rate: float, hop: int) -> np.ndarray:
    """Power in octaves (octaves, bands) at crests of hum of unit power in narrow bands."""
    bands = bands_at(rate, hop)
    count = LENGTH // scale.hop * scale.hop
    scratch, power = np.empty((3, count // 2)), np.empty((scale.octaves, count // scale.hop))
    out = np.zeros((scale.octaves, len(bands.first)))
    for b, each in enumerate(centres(bands)):
        tone = np.sqrt(2.0) * np.cos(2.0 * np.pi * each * np.arange(count))
        octave_powers(tone, scale.octaves, *scratch, power)
        out[:, b] = power[:, EDGE:-EDGE].mean(axis=1)
    squares = float(np.sum(bands.window.astype(float) ** 2))
    return CRESTS * 2.0 / (len(bands.window) * squares) * out


def centres(bands: Bands) -> np.ndarray:
    """Centres of the narrow bands, per sample."""
    begin = np.cumsum(bands.width) - bands.width
    index = np.arange(len(bands.weights)) + np.repeat(bands.first - begin, bands.width)
    weighted = np.add.reduceat(bands.weights * index, begin)
    return np.asarray(weighted / np.add.reduceat(bands.weights, begin) / len(bands.window))


def lowest(scale: Scale) -> float:
    """Frequency per sample at which the octaves begin."""
    return float(2.0 ** -(scale.octaves + 1.0))


@functools.lru_cache(maxsize=8)
def bands_below(scale: Scale, rate: float, hop: int) -> int:
    """Number of narrow bands below the octaves."""
    return int(np.count_nonzero(centres(bands_at(rate, hop)) < lowest(scale)))


def hum_bands(octaves: np.ndarray, bands: np.ndarray, crests: np.ndarray, below: int) -> int:
    """Number of bands, from the lowest up, that must be stopped for octaves not to hear hum.

    `octaves` and `bands` are the noise of both, `crests` those of unit power; so many bands lie
    `below` the octaves. It is 0 if there is no hum, or nothing to be gained.
    """
    level = TIMES_BACKGROUND * octaves
    if not (crests[:, :below] @ bands[:below] > level).any():  # as nearly always
        return 0
    if (crests[:, below:] @ bands[below:] > PULSES * CRESTS * octaves).any():
        return 0
    hum = crests[:, :below] * bands[:below]
    above = np.cumsum(hum[:, ::-1], axis=1)[:, ::-1]
    return int(np.count_nonzero(above > HEARD * level[:, None], axis=1).max())


def high_pass(scale: Scale, rate: float, bands: Bands, stopped: int) -> Filter:
    """Symmetric filter that passes the octaves and stops so many narrow bands."""
    from scipy import signal

    passed = lowest(scale)
    stop = min(float(centres(bands)[stopped - 1]), passed - NARROWEST / rate)
    count, beta = signal.kaiserord(STOPPED, 2.0 * (passed - stop))
    taps = signal.firwin(count | 1, passed + stop, window=("kaiser", beta), pass_zero=False)
    return Filter(taps, len(taps) // 2)
