"""The spectrum around a resonance, and textbook estimates from it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

PADDING = 8


@dataclass(frozen=True, eq=False)
class Band:
    """Discrete Fourier transform ``X_k = sum_n x_n exp(-2 pi i k n / N)`` in a band.

    Attributes
    ----------
    values : ndarray of complex, shape (n,)
        X_k at successive k.
    first : int
        The first k.
    count : int
        N.
    rate : float
        Samples per second [Hz].
    """

    values: np.ndarray
    first: int
    count: int
    rate: float

    @property
    def step(self) -> float:
        """Frequency spacing [Hz]."""
        return self.rate / self.count

    @property
    def frequency(self) -> np.ndarray:
        """Frequencies [Hz]."""
        return (self.first + np.arange(len(self.values))) * self.step

    @property
    def duration(self) -> float:
        """Length of the record [s]."""
        return self.count / self.rate

    @property
    def window(self) -> np.ndarray:
        """Hann window over the band, 1 at its maximum."""
        window = np.hanning(len(self.values) + 2)[1:-1]
        return window / window[np.argmax(np.abs(self.values))]

    def envelope(self) -> tuple[np.ndarray, np.ndarray]:
        """Times [s] and envelope of the band-limited signal, at its own rate.

        The band is cut off smoothly, so that what begins abruptly rings for two values only.
        """
        count = len(self.values)
        size = np.abs(np.fft.ifft(self.window * self.values)) * (2 * count / self.count)
        return np.arange(count) * (self.duration / count), size


def band_of(samples: np.ndarray, rate: float, low: float, high: float) -> Band:
    """The band from `low` to `high` [Hz] of the samples minus their mean."""
    spectrum = np.fft.rfft(samples - samples.mean())
    step = rate / len(samples)
    first = max(math.ceil(low / step), 1)
    last = min(math.floor(high / step), (len(samples) - 1) // 2)
    return Band(spectrum[first : last + 1], first, len(samples), rate)


def padded(band: Band) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and |X|^2 with zero padding."""
    count = len(band.values)
    inner = np.fft.fft(np.fft.ifft(band.values), count * PADDING)
    inner = inner[: (count - 1) * PADDING + 1]
    frequency = (band.first + np.arange(len(inner)) / PADDING) * band.step
    return frequency, np.abs(inner) ** 2


def smooth(power: np.ndarray, width: int) -> np.ndarray:
    """Running mean over an odd number of values, shorter at the ends."""
    half = width // 2
    total = np.concatenate([[0.0], np.cumsum(power)])
    at = np.arange(len(power))
    high, low = np.minimum(at + half + 1, len(power)), np.maximum(at - half, 0)
    return (total[high] - total[low]) / (high - low)


def peak_and_width(frequency: np.ndarray, power: np.ndarray) -> tuple[float, float]:
    """Frequency of the peak, and its full width at half maximum [Hz]; NaN without flanks.

    The parabola through the logarithms of the greatest value and its neighbours has the peak.
    """
    k = int(np.argmax(power))
    if not 0 < k < len(power) - 1:
        return float(frequency[k]), math.nan
    left, top, right = np.log(np.maximum(power[k - 1 : k + 2], 1e-300))
    bend = left - 2 * top + right
    shift = (left - right) / (2 * bend) if bend < 0 else 0.0
    half = math.log(power[k]) - (left - right) * shift / 4 - math.log(2.0)
    peak = float(frequency[k] + shift * (frequency[1] - frequency[0]))
    edges = []
    for direction in (-1, 1):
        j = k
        while 0 <= j < len(power) and power[j] > 0 and math.log(power[j]) > half:
            j += direction
        if not 0 <= j < len(power):
            return peak, math.nan
        near, far = math.log(power[j - direction]), math.log(max(power[j], 1e-300))
        part = (near - half) / (near - far)
        edges.append(frequency[j - direction] + part * (frequency[j] - frequency[j - direction]))
    return peak, float(edges[1] - edges[0])


def log_decrement(time: np.ndarray, envelope: np.ndarray, noise: float) -> float:
    """Decay rate [1/s] of an envelope, by a line through its logarithms.

    From the third value, for the first two bear the beginning of the record, to where it comes near
    the noise; each weighs as its square, for that is what noise leaves of a logarithm.
    """
    low = np.flatnonzero(envelope[2:-2] < 4 * noise)
    last = 2 + int(low[0]) if len(low) else len(envelope) - 2
    if last < 5:
        return math.nan
    t, y = time[2:last], np.log(envelope[2:last])
    weight = envelope[2:last] ** 2
    weight = weight / weight.sum()
    t = t - weight @ t
    return -float((weight * t) @ y / ((weight * t) @ t))
