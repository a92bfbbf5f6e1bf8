"""How exactly a waveform gives the shift of a sound, in noise and where sounds differ."""

from __future__ import annotations

import numpy as np

from ._alike_kernels import ROWS, SHIFTS, unexplained
from .laying import BESIDE, Laying

ATTACKS = 0.5  # variance of attacks, at least, over the one that is stated
ONE_LAGS, ONE_LEFT = (1, 2, 3), 0.04  # lags, and power unexplained at most, of a single mode
INTERPOLATED = 5e-4  # fraction of its power that interpolation may leave of a sound
COMPARED = 64  # sounds that show how all differ
LEAST_COLOUR = 0.1  # variance of a shift, over that in white noise, that is believed


def noise_gain(laying: Laying, shifts: np.ndarray, sounds: np.ndarray) -> tuple[float, float]:
    """Variance of the shift of a sound equal to the wave, in unit noise.

    The noise is as coloured as what precedes the sounds. Beside it the variance of a response
    to it over that in white noise.
    """
    by_sample = _by_sample(laying, shifts)
    wave = shifts[ROWS // 2]
    quiet = sounds[:, : laying.lengths.first - laying.lengths.far]
    count = quiet.shape[1]
    power = np.abs(np.fft.rfft(quiet, 2 * count)) ** 2
    pairs = len(quiet) * np.arange(count, count - count // 2, -1)
    alike = np.fft.irfft(power.sum(axis=0))[: count // 2] / pairs
    return _variance(by_sample, alike), _variance(laying.taper * wave, alike, white=True)


def lever_of(laying: Laying, shifts: np.ndarray) -> float:
    """Variance of the shift of a sound of factor 1, over that of what the wave leaves of it."""
    by_sample, some = _by_sample(laying, shifts), laying.weight > 0.0
    return float(np.sum(by_sample[some] ** 2 / laying.weight[some]))


def misfit_of(laying: Laying, wave: np.ndarray, sounds: np.ndarray, laid: np.ndarray) -> float:
    """Variance of a sound of factor 1 in any of the directions in which sounds differ.

    With r what the wave leaves of a sound, C its covariance, less that of the noise, it is
    tr C^2 / tr C: the trace over the number of directions. As sounds of a few modes differ in
    a few, it is much more than the power of a sample, and one of them is that of a shift. What
    lies beside the attack, or is as little as INTERPOLATED, is not theirs.
    """
    some = slice(None, None, -(-len(sounds) // COMPARED))
    sounds, (shift, factor, _, _, noise, _) = sounds[some], laid[some].T
    count, quiet = len(sounds), laying.lengths.first - laying.lengths.far
    late = laying.lengths.reach + laying.lengths.edges[-1] + BESIDE
    whole, wave, weight = wave, wave[late:], laying.weight[late:]
    left = np.empty((count, len(wave)))
    unexplained(sounds, shift, factor, laying.lengths.first + late, wave, weight, left)
    before = sounds[:, :quiet] / factor[:, None]
    pairs = ~np.eye(count, dtype=bool)
    products, by_noise = left @ left.T, before @ before.T
    scale, energy = float(weight.sum()) / quiet, float(np.sum(weight * wave**2))
    squares = (products**2 - scale * by_noise**2).sum(axis=1, where=pairs) / (count - 1)
    heard = float(weight.sum() / laying.weight.sum())
    total = float(np.mean(np.diag(products) - heard * noise / factor**2))
    certain = float(np.mean(squares) - 2.0 * np.std(squares) / np.sqrt(count))
    if not (certain > 0.0 and total > INTERPOLATED * energy):
        return 0.0
    return certain / total * laying.sum_of(whole, whole) / energy


def is_one_mode(laying: Laying, wave: np.ndarray) -> bool:
    """Whether each sample of the wave follows from two earlier ones, as in a decaying tone."""
    ringing = wave[laying.lengths.reach + laying.lengths.edges[-1] + BESIDE :]
    for lag in ONE_LAGS:
        if len(ringing) < 4 * lag:
            return False
        last = ringing[2 * lag :]
        earlier = np.stack((ringing[: -2 * lag], ringing[lag:-lag]))
        (a, b), gram = earlier @ last, earlier @ earlier.T
        square = gram[1, 1] * a * a - 2.0 * gram[0, 1] * a * b + gram[0, 0] * b * b
        det = gram[0, 0] * gram[1, 1] - gram[0, 1] ** 2
        if not square > (1.0 - ONE_LEFT) * det * float(last @ last):
            return False
    return True


def slope_of(shifts: np.ndarray) -> np.ndarray:
    """Derivative of a wave by its shift."""
    middle = ROWS // 2
    return np.asarray(0.5 * SHIFTS * (shifts[middle + 1] - shifts[middle - 1]))


def _by_sample(laying: Laying, shifts: np.ndarray) -> np.ndarray:
    """What each sample of a sound of factor 1 contributes to its shift."""
    wave, slope = shifts[ROWS // 2], slope_of(shifts)
    tt, ts, ss = (laying.sum_of(a, b) for a, b in ((wave, wave), (wave, slope), (slope, slope)))
    return np.asarray(laying.weight * (tt * slope - ts * wave) / (tt * ss - ts * ts))


def _variance(weights: np.ndarray, covariance: np.ndarray, white: bool = False) -> float:
    """Variance of a weighted sum of coloured noise, scaled to unit power."""
    of_white = float(np.sum(weights**2))
    if not covariance[0] > 0.0:
        return 1.0 if white else of_white
    products = np.correlate(weights, weights, "full")[len(weights) - 1 :]
    lags = min(len(weights), len(covariance))
    total = 2.0 * float(covariance[:lags] @ products[:lags]) - covariance[0] * of_white
    colour = max(float(total / (covariance[0] * of_white)), LEAST_COLOUR)
    return colour if white else colour * of_white


def beyond(total: float, known: float) -> float:
    """Mean of what a variance has beyond that of attacks, which is at least ATTACKS of `known`."""
    least, most = max(total - known, 0.0), max(total - ATTACKS * known, 0.0)
    return (most**2 - least**2) / (2.0 * (1.0 - ATTACKS) * known)
