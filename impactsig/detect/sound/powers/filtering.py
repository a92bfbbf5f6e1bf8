"""Filters before the octaves of a sound."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np


class Filter(NamedTuple):
    """A filter of finite length: y[n] = sum_k taps[k] x[n + delay - k]."""

    taps: np.ndarray
    delay: int  # samples by which the taps, taken in order, are late
    predicts: bool = False  # whether it leaves what the past does not predict, in all bands
    modes: float = math.inf  # about how many it predicts

    @property
    def reach(self) -> int:
        """Samples beside one, on either side at most, that it is made of."""
        return max(self.delay, len(self.taps) - 1 - self.delay)

    def of(self, x: np.ndarray) -> np.ndarray:
        """Samples behind the filter, as if the first and the last of them went on."""
        from scipy import signal

        beside = len(self.taps) - 1 - self.delay, self.delay
        padded = np.pad(x.astype(float), beside, "edge")
        return np.asarray(signal.oaconvolve(padded, self.taps, mode="valid"))

    def gains(self, octaves: int) -> np.ndarray:
        """Power of white noise of power 1 in each octave, from the highest down."""
        size = 1 << max(len(self.taps), 2 << octaves).bit_length()
        power = np.abs(np.fft.rfft(self.taps, 2 * size)) ** 2
        return np.array([power[size >> k + 1 : size >> k].mean() for k in range(octaves)])
