"""Spectra of short series: power in bands, and the exponent at the lowest frequencies."""

from __future__ import annotations

import numpy as np

BANDS, FEWEST = 12, 3


def band_powers(rows: np.ndarray) -> np.ndarray:
    """Log mean power in up to 12 bands of equal width in log f; shape (rows, bands)."""
    n = rows.shape[-1]
    edges = [1]
    for edge in np.geomspace(1, n // 2 + 1, BANDS + 1)[1:]:
        if edge >= edges[-1] + FEWEST:
            edges.append(int(edge))
    edges[-1] = n // 2 + 1
    taper = np.hanning(n + 2)[1:-1]
    centred = rows - rows.mean(axis=-1, keepdims=True)
    power = np.abs(np.fft.rfft(centred * taper)) ** 2
    means = np.add.reduceat(power[:, : edges[-1]], edges[:-1], axis=1) / np.diff(edges)
    return np.log(np.maximum(means, 1e-300))


def misfit(data: np.ndarray, surrogates: np.ndarray) -> float:
    """Distance of a spectrum from the mean of others, over the median of their distances.

    Each of the others is compared with the mean of the rest; about 1 where all are of one kind.
    """
    own, others = band_powers(data[None])[0], band_powers(surrogates)
    count = len(others)
    mean = others.mean(axis=0)
    rest = np.sqrt(np.mean((others - mean) ** 2, axis=1)) * count / (count - 1)
    return float(np.sqrt(np.mean((own - mean) ** 2)) / max(float(np.median(rest)), 1e-9))


def low_exponent(x: np.ndarray) -> tuple[float, float]:
    """Exponent alpha of a power 1/f^alpha at the n^0.6 lowest frequencies, and its standard error.

    Regression of the log-periodogram [Geweke1983]_.
    """
    count = min(int(len(x) ** 0.6), len(x) // 2)
    place = np.arange(1, count + 1)
    power = np.abs(np.fft.rfft(x - x.mean()))[place] ** 2
    slope = np.log(2 * np.sin(np.pi * place / len(x)))
    slope -= slope.mean()
    spread = float(slope @ slope)
    alpha = -float(slope @ np.log(np.maximum(power, 1e-300))) / spread
    return alpha, float(np.pi / np.sqrt(6 * spread))
