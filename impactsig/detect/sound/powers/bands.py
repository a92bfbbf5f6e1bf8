"""Power of a sound in narrow bands: 24 per octave, in Hann windows of 23 ms.

A frame is centred on its first sample. With Y_k the Fourier coefficients of the windowed samples,
less their weighted mean, the power of a band is sum_k W_bk |Y_k|^2. W_b is a triangle: 1 at the
band's centre and 0 at those of its neighbours. Centres follow 1/24 octave and at least one
coefficient apart, from 30 Hz to 17 kHz or half the rate.

Transforms are taken in single precision, the samples scaled by a power of 2
(`_spectrum_kernels.py`).
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from ._radix_kernels import LANES, order_after, radices_of, turns
from ._spectrum_kernels import band_powers, to_single

WINDOW = 23.2e-3  # [s]
PER_OCTAVE = 24
LOWEST, HIGHEST = 30.0, 17e3  # [Hz]
FAINTEST = -500  # power of 2 whose square is still a number; less is silence


class Bands(NamedTuple):
    """Narrow bands at a sampling rate, in frames of `hop` samples.

    Band b weighs the width[b] coefficients from first[b] on; `weights` are those of all, in turn.
    """

    hop: int
    window: np.ndarray
    first: np.ndarray
    width: np.ndarray
    weights: np.ndarray
    gain: np.ndarray  # power in each band of white noise of power 1
    transform: tuple[np.ndarray, ...]  # what `power_spectra` needs to know of its passes


@functools.lru_cache(maxsize=8)
def bands_at(rate: float, hop: int) -> Bands:
    """The bands at a sampling rate."""
    from scipy import fft

    size = 2 * fft.next_fast_len(round(WINDOW * rate / 2), real=True)
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(size) / size)
    step = rate / size
    centre = [LOWEST]
    while True:
        upper = max(centre[-1] * 2 ** (1 / PER_OCTAVE), centre[-1] + step)
        if upper > min(HIGHEST, 0.5 * rate):
            break
        centre.append(upper)
    frequency = step * np.arange(size // 2 + 1)
    middle = np.array(centre)[:, None]
    rising = (frequency - middle[:-2]) / (middle[1:-1] - middle[:-2])
    falling = (middle[2:] - frequency) / (middle[2:] - middle[1:-1])
    rows = np.maximum(np.minimum(rising, falling), 0.0)
    first = np.argmax(rows > 0.0, axis=1)
    width = np.count_nonzero(rows, axis=1)
    weights = rows[rows > 0.0].astype(np.float32)
    gain = np.sum(rows, axis=1) * np.sum(window**2)
    half = size // 2
    passes = radices_of(half)
    transform = passes, turns(half, half), turns(half, size), order_after(passes)
    return Bands(hop, window.astype(np.float32), first, width, weights, gain, transform)


@functools.lru_cache(maxsize=16)
def degrees_of_freedom(rate: float, hop: int, frames: int) -> np.ndarray:
    """Effective degrees of freedom of the mean power of `frames` frames of white noise.

    2 mean^2 / variance, with the covariance |sum_n w[n] w[n + s] exp(2 pi i d n / N)|^2 of the
    squared coefficients that are d apart, in windows that are s samples apart.
    """
    bands = bands_at(rate, hop)
    size, widest = len(bands.window), bands.width.max()
    window = bands.window.astype(float)
    together = np.zeros(widest)
    for lag in range(frames):
        s = lag * bands.hop
        if s >= size:
            break
        overlap = np.zeros(size)
        overlap[: size - s] = window[: size - s] * window[s:]
        share = (1 if lag == 0 else 2) * (frames - lag) / frames**2
        together += share * np.abs(np.fft.fft(overlap)[:widest]) ** 2
    index = np.arange(widest)
    covariance = together[np.abs(np.subtract.outer(index, index))]
    weights = np.zeros((len(bands.width), widest))
    weights[index < bands.width[:, None]] = bands.weights
    variance = np.einsum("bi,ij,bj->b", weights, covariance, weights, optimize=True)
    return np.asarray(2.0 * bands.gain**2 / variance)


class Spectrum:
    """Powers of the bands, window by window; the scratch that they need is kept."""

    def __init__(self, bands: Bands) -> None:
        half = len(bands.window) // 2
        self.bands = bands
        self._single = np.empty(0, np.float32)
        columns = LANES + (len(bands.window) - 1) // bands.hop
        self._columns = np.empty(bands.hop * columns, np.float32)
        self._rows = np.empty((2, half * 2 * LANES), np.float32)
        self._square = np.empty((half + 1) * LANES, np.float32)

    def powers(self, x: np.ndarray, left: int, frames: int) -> np.ndarray:
        """Powers (bands, frames); the first frame is centred on x[left], the window fits into x."""
        bands = self.bands
        size = len(bands.window)
        begin = left - size // 2
        used = x[begin : begin + (frames - 1) * bands.hop + size]
        whole = (-(-frames // LANES) * LANES + (size - 1) // bands.hop) * bands.hop
        if len(self._single) < whole:
            self._single = np.empty(whole, np.float32)
        single = self._single[:whole]
        scale = to_single(used, FAINTEST, single)
        power = np.empty((len(bands.first), frames))
        band_powers(
            single, bands.hop, bands.window, *bands.transform, self._columns, self._rows,
            self._square, scale**2, bands.first, bands.width, bands.weights, power,
        )  # fmt: skip
        return power
