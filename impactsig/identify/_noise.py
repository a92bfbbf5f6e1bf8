"""Fit of an oscillator under noise to a band of the periodogram."""

from __future__ import annotations

import math

import numpy as np

from ._band import Band
from ._climbing import climb
from ._decay import Fit

QUANTITIES = ("displacement", "velocity", "acceleration")


def fit_noise(band: Band, frequency: float, quantity: str) -> Fit:
    """Debiased Whittle likelihood [Sykulski2019]_ of an oscillator under white noise, with a floor.

    The periodogram ``I_k = |X_k|^2 / N`` is nearly exponential about its expectation, which is
    exact here for a record of any length: of the covariance ``c_n = Re(C z^n)``,

        E I_k = 2 Re(sum_n (1 - n / N) c_n exp(-2 pi i k n / N)) - c_0 + floor,

    a geometric sum. Fisher's scoring maximises ``-sum(ln E I_k + I_k / E I_k)``.
    """
    power = np.abs(band.values) ** 2 / band.count
    low, high = np.log(2 * math.pi * band.frequency[[0, -1]])

    def evaluate(theta: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        expected, slopes = _expected(band, theta, quantity)
        value = -float((np.log(expected) + power / expected).sum())
        return value, slopes.T @ (power / expected - 1), slopes.T @ slopes

    def limited(theta: np.ndarray, step: np.ndarray) -> np.ndarray:
        new = theta + np.clip(step, -1.0, 1.0)
        new[1] = min(max(new[1], low), high)
        new[0] = min(new[0], new[1])
        new[3] = max(new[3], new[2] - 40)
        return new

    value, theta = climb(
        (_start(band, power, frequency, ratio, quantity) for ratio in (0.003, 0.01, 0.03, 0.1)),
        evaluate, limited, lambda theta, new: abs(new - theta)[:3].max() < 1e-10, 80, least=1e-9,
    )  # fmt: skip
    expected, slopes = _expected(band, theta, quantity)
    information = slopes.T @ slopes
    alpha, omega = np.exp(theta[:2])
    scale = np.array([alpha, omega])
    covariance = np.linalg.pinv(information)[:2, :2] * scale[:, None] * scale
    flat = -len(power) * (math.log(power.mean()) + 1)
    floor, whole = math.exp(theta[3]), math.exp(theta[2])
    told = np.linalg.pinv(information)[3, 3] < 1 and information[3, 3] > 1
    return Fit(
        alpha, omega, covariance, expected * band.count, math.sqrt(floor),
        whole / floor if told else math.nan, value - flat,
    )  # fmt: skip


def _start(
    band: Band, power: np.ndarray, frequency: float, ratio: float, quantity: str
) -> np.ndarray:
    """Initial alpha, omega, variance of the resonance and floor, as logarithms."""
    omega = 2 * math.pi * frequency
    floor = float(np.quantile(power, 0.1)) * 5 + 1e-300
    theta = np.array([math.log(ratio * omega), math.log(omega), 0.0, -700.0])
    shape, _ = _expected(band, theta, quantity)
    theta[2] = math.log(max(float(power.sum() / shape.sum()), 1e-300))
    theta[3] = math.log(floor)
    return theta


def _expected(band: Band, theta: np.ndarray, quantity: str) -> tuple[np.ndarray, np.ndarray]:
    """Expected periodogram, and derivatives of its logarithm by the four parameters."""
    whole, floor = math.exp(theta[2]), math.exp(theta[3])
    shape = _shape(band, theta, quantity)
    expected = np.maximum(whole * shape + floor, 1e-300)
    slopes = np.empty((len(shape), 4))
    slopes[:, 2], slopes[:, 3] = whole * shape / expected, floor / expected
    for k in range(2):
        h = 1e-5 * (math.exp(theta[0] - theta[1]) if k == 1 else 1.0)  # of a width
        up, down = theta.copy(), theta.copy()
        up[k] += h
        down[k] -= h
        change = _shape(band, up, quantity) - _shape(band, down, quantity)
        slopes[:, k] = whole * change / (2 * h) / expected
    return expected, slopes


def _shape(band: Band, theta: np.ndarray, quantity: str) -> np.ndarray:
    """Expected periodogram of a resonance of unit variance."""
    alpha, omega = math.exp(theta[0]), math.exp(theta[1])
    pole = complex(-alpha, omega)
    # From displacement to velocity, and on to acceleration, the covariance is differentiated
    # twice and changes its sign; what noise adds to acceleration at one instant is in the floor.
    part = (1 - 1j * alpha / omega) * (-(pole**2)) ** QUANTITIES.index(quantity)
    part /= part.real
    angle = 2 * math.pi * (band.first + np.arange(len(band.values))) / band.count
    total = np.zeros(len(angle), complex)
    for c, p in ((part / 2, pole), (part.conjugate() / 2, pole.conjugate())):
        z = np.exp(p / band.rate - 1j * angle)
        lost = np.exp(p * band.duration)
        total += c * (1 / (1 - z) - z * (1 - lost) / (band.count * (1 - z) ** 2))
    return 2 * total.real - 1
