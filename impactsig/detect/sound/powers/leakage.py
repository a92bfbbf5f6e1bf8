"""Hum in octaves: the power of low tones that the wavelet lets through.

The 5/3 wavelet rejects a tone below an octave by only 12 dB per octave, so that hum 60 dB above the
noise exceeds it where the wavelet has no business with it, and more so at the crests of the hum's
waveform: each crest is a rise of 4 ms, 100 a second. The noise of the octave, a low quantile of its
power, lies between the crests. With N_b the noise of the narrow bands below an octave (`floor.py`),
hum contributes

    p = 2 / (K sum_n w_n^2) sum_b N_b |H(f_b)|^2

to its mean power, with H the response of the wavelet to a tone at the centre f_b of the band, K the
length of the window w. Where 4 p exceeds the noise of the octave, that is the 0.9-quantile of its
power, but no more than 4 p: impacts do not raise N_b, nor the quantile unless they are dense.
"""

from __future__ import annotations

import functools

import numpy as np

from .._kernels import EDGE, Scale, octave_powers
from .bands import bands_at

CRESTS = 4.0  # times its mean: power of hum at the crests of its waveform
OFTEN = 0.9  # quantile of the power that crests of hum reach
PERIODS = 1 << 14  # samples, at least, of a tone


@functools.lru_cache(maxsize=8)
def leakage_at(scale: Scale, rate: float, hop: int) -> np.ndarray:
    """Crests of power in octaves (octaves, bands) from unit power in narrow bands below them."""
    bands = bands_at(rate, hop)
    size = len(bands.window)
    ends = np.cumsum(bands.width)
    out = np.zeros((scale.octaves, len(bands.first)))
    count = -(-PERIODS // scale.hop) * scale.hop
    scratch, power = np.empty((3, count // 2)), np.empty((scale.octaves, count // scale.hop))
    for b, end in enumerate(ends):
        weights = bands.weights[end - bands.width[b] : end]
        bins = bands.first[b] + np.arange(bands.width[b])
        frequency = float(np.sum(weights * bins) / np.sum(weights)) / size  # per sample
        above = frequency < 2.0 ** -(2.0 + np.arange(scale.octaves))
        if not above.any():
            break
        tone = np.sqrt(2.0) * np.cos(2.0 * np.pi * frequency * np.arange(count))
        octave_powers(tone, scale.octaves, *scratch, power)
        out[above, b] = power[above, EDGE:-EDGE].mean(axis=1)
    return CRESTS * 2.0 / (size * float(np.sum(bands.window.astype(float) ** 2))) * out


def add_hum(noise: np.ndarray, hum: np.ndarray, means: np.ndarray, sounding: np.ndarray) -> None:
    """Raise the noise of octaves to the crests of hum where these exceed it.

    `means` (octaves, groups) are the powers that the noise is a low quantile of.
    """
    for b in np.flatnonzero(hum > noise):
        kept = means[b, sounding]
        if len(kept):
            place = int(OFTEN * len(kept))
            noise[b] = max(noise[b], min(hum[b], np.partition(kept, place)[place]))
