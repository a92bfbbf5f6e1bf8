"""Noise level of a signal, and local cubic smoothing of the signal and its slope."""

from __future__ import annotations

import math

import numpy as np

ORDER = 3
"""Of the polynomial that a window is fitted by."""
NARROWEST, WIDEST = 2, 4096
"""Samples to either side of the middle of a window."""
BIAS = 0.5
"""Of a window, over its noise, at which wider ones are not tried."""
CHANCE = 1.2
"""Times the variance that noise explains: its level is an estimate, and the steps of a converter
are not Gaussian (of the difference of two uniform errors the median says 1.13 of the variance)."""
FOURTH = math.sqrt(70.0)
"""Standard deviation of fourth differences of white noise of standard deviation 1."""
MAD = 0.6744897501960817
"""Median of the absolute value of a normal variable of standard deviation 1."""


def converter_step(values: np.ndarray) -> float:
    """Quantisation step of a signal; 0 if its values hardly repeat."""
    codes = np.unique(values)
    if len(codes) < 2 or 2 * len(codes) > len(values):
        return 0.0
    return float(np.diff(codes).min())


def noise_of(values: np.ndarray, step: float) -> float:
    """Standard deviation of white noise, from fourth differences; at least that of the step."""
    white = float(np.median(np.abs(np.diff(values, 4)))) / (MAD * FOURTH)
    return max(white, step / math.sqrt(12.0))


def smoothed(x: np.ndarray, half: int, derivative: int) -> np.ndarray:
    """The signal, or its slope per sample, by cubics in windows of 2 `half` + 1 samples."""
    from scipy.signal import savgol_filter

    return np.asarray(savgol_filter(x, 2 * half + 1, ORDER, deriv=derivative))


def gain(half: int, derivative: int) -> float:
    """Standard deviation of smoothed white noise of unit variance."""
    from scipy.signal import savgol_coeffs

    return float(np.linalg.norm(savgol_coeffs(2 * half + 1, ORDER, deriv=derivative)))


def half_width(x: np.ndarray, noise: float, derivative: int) -> int:
    """The widest window whose bias stays below the noise that it leaves.

    By how much two windows differ beyond what noise explains is the bias of the wider one: the
    window inside it has a quarter of that. Runs of one code, as a slow signal leaves behind a
    converter, must be shorter than the window.
    """
    most = min((len(x) - 1) // 2, WIDEST)
    runs = len(x) / (1 + np.count_nonzero(np.diff(x)))
    half = min(max(NARROWEST, math.ceil(runs)), most)
    narrow, of_narrow = smoothed(x, half, derivative), gain(half, derivative)
    while (wider := math.ceil(math.sqrt(2.0) * half)) <= most:
        wide, of_wide = smoothed(x, wider, derivative), gain(wider, derivative)
        differ = float(np.median(np.abs(wide - narrow))) / MAD / max(noise, 1e-300)
        # What both windows make of the noise is, nearly, what the wider one makes of it.
        expected = of_narrow**2 - of_wide**2
        if differ**2 > CHANCE * expected + (0.75 * BIAS * of_wide) ** 2:
            break
        half, narrow, of_narrow = wider, wide, of_wide
    return half
