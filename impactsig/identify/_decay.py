"""Maximum-likelihood fit of a decaying oscillation in noise, in a band of its spectrum."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ._band import Band
from ._climbing import climb


class Fit(NamedTuple):
    """Pole -alpha + i omega [rad/s] and the covariance of (alpha, omega); the model of the band."""

    alpha: float
    omega: float
    covariance: np.ndarray
    model: np.ndarray  # of the transform (decay) or of its expected power (noise)
    noise: float  # standard deviation of a sample
    ratio: float  # power of the resonance in the record by that of the noise
    evidence: float  # how much likelier than without a resonance, as a logarithm


def fit_decay(band: Band, frequency: float) -> Fit:
    """Least-squares fit in the band, which is maximum likelihood in white noise.

    ``x_n = Re(A z^n)``, ``z = exp((-alpha + i omega) / rate)`` transforms to

        X_k = (A G_k(z) + conj(A) G_k(conj z)) / 2,
        G_k(z) = (1 - z^N) / (1 - z exp(-2 pi i k / N)),

    to which a complex straight line is added: that is all that oscillations far outside of the
    band, and a step from the record's end to its beginning, are in it. All but the pole is linear
    and solved for; the pole by Gauss' and Newton's method.
    """
    data = _real(band.values)
    least, most = 0.2 / band.duration, 2 * math.pi * (band.frequency[-1] - band.frequency[0])
    edges = 2 * math.pi * band.frequency[[0, -1]]

    def evaluate(pole: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        _, residual, jacobian = _project(*_columns(band, *pole), data)
        return -float(residual @ residual), jacobian.T @ residual, jacobian.T @ jacobian

    def limited(pole: np.ndarray, step: np.ndarray) -> np.ndarray:
        alpha = min(max(pole[0] + step[0], 0.05 * pole[0], 1e-3 * least), most)
        return np.array([alpha, min(max(pole[1] + step[1], edges[0]), edges[1])])

    centre = 2 * math.pi * frequency
    starts = (min(max(centre * ratio, least), most) for ratio in (0.002, 0.01, 0.04, 0.15))
    value, (alpha, omega) = climb(
        (np.array([alpha, centre]) for alpha in starts), evaluate, limited,
        lambda pole, new: abs(new - pole).sum() <= 1e-12 * pole[1], most=60,
    )  # fmt: skip
    cost = -value
    columns, slopes = _columns(band, alpha, omega)
    coefficients, residual, jacobian = _project(columns, slopes, data)
    free = len(data) - columns.shape[1] - 2
    variance = cost / max(free, 1)  # of the real part of a value: N / 2 times that of a sample
    covariance = variance * np.linalg.inv(jacobian.T @ jacobian)
    without = columns[:, 2:]
    rest = data - without @ np.linalg.lstsq(without, data, rcond=None)[0]
    model = data - residual
    half = len(model) // 2
    amplitude = math.hypot(*coefficients[:2])
    lasts = -math.expm1(-2 * alpha * band.duration) / (2 * alpha * band.duration)
    noise = math.sqrt(2 * variance / band.count)
    return Fit(
        alpha, omega, covariance, model[:half] + 1j * model[half:], noise,
        amplitude**2 / 2 * lasts / noise**2 if noise > 0 else math.inf,
        free / 2 * math.log(float(rest @ rest) / cost) if cost > 0 else math.inf,
    )  # fmt: skip


def _columns(band: Band, alpha: float, omega: float) -> tuple[np.ndarray, np.ndarray]:
    """Linear regressors of the model, and derivatives of the first two by alpha and omega."""
    angle = 2 * math.pi * (band.first + np.arange(len(band.values))) / band.count
    dt, duration = 1 / band.rate, band.duration
    parts = []
    for sign in (1.0, -1.0):
        pole = complex(-alpha, sign * omega)
        z = np.exp(pole * dt - 1j * angle)
        lost = np.exp(pole * duration)
        value = (1 - lost) / (1 - z)
        slope = (-duration * lost + value * dt * z) / (1 - z)
        parts.append((value, -slope, 1j * sign * slope))
    (g, ga, go), (h, ha, ho) = parts
    across = np.linspace(-1.0, 1.0, len(band.values))
    linear = [(g + h) / 2, 1j * (g - h) / 2]
    linear += [1 + 0j * across, 1j + 0j * across, across + 0j, 1j * across]
    slopes = [(ga + ha) / 2, 1j * (ga - ha) / 2, (go + ho) / 2, 1j * (go - ho) / 2]
    return np.column_stack([_real(c) for c in linear]), np.column_stack([_real(c) for c in slopes])


def _project(
    columns: np.ndarray, slopes: np.ndarray, data: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coefficients, residual, and derivatives by the pole orthogonal to the regressors."""
    q, r = np.linalg.qr(columns)
    coefficients = np.linalg.solve(r, q.T @ data)
    a, b = coefficients[:2]
    jacobian = np.column_stack(
        [a * slopes[:, 0] + b * slopes[:, 1], a * slopes[:, 2] + b * slopes[:, 3]]
    )
    return coefficients, data - q @ (q.T @ data), jacobian - q @ (q.T @ jacobian)


def _real(values: np.ndarray) -> np.ndarray:
    return np.concatenate([values.real, values.imag])
