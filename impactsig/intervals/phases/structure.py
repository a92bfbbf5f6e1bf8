"""Structure below the jitter about slots: a tone, or a map from one impact to the next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .locking import Lock, due

SLOWEST = 0.042  # [per cycle] tones below it pass for drift
LINE_PRIOR = 10.4  # a line as improbable as 3e-5 under the null is as probable as none
LEAST_BACKGROUND = 0.8  # of that of white noise
GRID = 32  # instants of the periodogram per impact due
FEWEST = 30  # residuals of which anything is asked
MOST_HARMONICS = 8  # of a tone, the first included
EXCLUDED = 0.05  # likelihood ratio at which a band is excluded
LOGISTIC = 0.707  # E[y' (y^2 - 1)] of y' = (1 - y^2)/sd, as for the logistic map


class Tone(NamedTuple):
    """The strongest line in the spectrum of the residuals."""

    frequency: float  # [per cycle]
    rms: float  # [cycles]
    log_odds: float  # against none
    wave: np.ndarray  # what it makes of the residuals
    waves: np.ndarray  # the same with the harmonics that it has


class Structure(NamedTuple):
    """Tone, map and bands found in the residuals of a lock."""

    tone: Tone | None
    band: float  # log-odds of a map, the tone taken out where there is one
    hidden: float  # share of the narrower bands that the residuals do not exclude
    below: float  # [cycles] rms of the widest band that they do not


def residuals(lock: Lock) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Number and time [cycles] of the instants that were hit, and the residuals of the hits."""
    fit = lock.fit
    m = len(fit.centre)
    instant, offset = fit.instant[fit.hit], fit.offset[fit.hit]
    slot = instant % m
    mean = np.bincount(slot, offset, m) / np.maximum(np.bincount(slot, minlength=m), 1)
    return instant, due(fit)[fit.hit], offset - mean[slot]


def structure(lock: Lock, floor: float, slowest: float = SLOWEST) -> Structure:
    """Search the residuals of a lock for a tone and bands larger than `floor` [cycles]."""
    instant, at, z = residuals(lock)
    deviation = float(z.std())
    if len(z) < FEWEST or deviation < floor:
        return Structure(None, -np.inf, 1.0, deviation)
    m = len(lock.fit.centre)
    tone = strongest_line(at, z, m / lock.fit.fold, slowest)
    if tone is not None and tone.rms < floor:
        tone = None
    left = z
    if tone is not None and tone.log_odds > 0:
        left = z - tone.waves
    lags = sorted({1, m})
    pairs = [_pairs(instant, left, lag) for lag in lags]
    odds = [test for before, after in pairs for test in _map_odds(before, after)]
    band = float(np.logaddexp.reduce(odds) - np.log(len(odds)))
    hidden, below = _hidden(*pairs[0], float(left.std()))
    return Structure(tone, band, hidden, below)


def strongest_line(at: np.ndarray, z: np.ndarray, density: float, slowest: float) -> Tone | None:
    """The spectral line that is highest above the background around it.

    Anticorrelated noise has a spectrum that rises; the background of a line is the median about it.
    """
    from scipy.ndimage import median_filter

    fastest, span = 0.51 * density, float(at[-1] - at[0])
    slowest = max(slowest, 2 / span)
    independent = span * (fastest - slowest)
    if independent < 4 or not z.any():
        return None
    step = 1 / (GRID * density)
    bins = np.bincount(np.round((at - at[0]) / step).astype(np.intp), z)
    size = 1 << int(np.ceil(np.log2(4 * len(bins))))
    frequency = np.arange(size // 2 + 1) / (size * step)
    inside = (frequency >= slowest) & (frequency <= fastest)
    power = np.abs(np.fft.rfft(bins, size)[inside]) ** 2
    frequency = frequency[inside]
    over = size * step / span
    width = int(max(25, independent / 6) * over) | 1
    # broad peaks are background, but no dip may make a line of what is beside it
    background = np.maximum(
        median_filter(power, min(width, len(power)), mode="reflect") / np.log(2),
        LEAST_BACKGROUND * float(z @ z),
    )
    height = power / background
    best = int(np.argmax(height))
    line = _refined(at, z, float(frequency[best]), 1 / span)
    columns = _waves(at, line, 2)
    weights, *_ = np.linalg.lstsq(columns, z, rcond=None)
    fundamental = columns[:, :2] @ weights[:2]
    odds = float(height[best] - np.log(independent / 2) - LINE_PRIOR)
    return Tone(
        line, float(fundamental.std()), odds, fundamental, _with_harmonics(at, z, line, 1 / span)
    )


def _with_harmonics(at: np.ndarray, z: np.ndarray, line: float, resolution: float) -> np.ndarray:
    """What a line and its harmonics make of z, as many as the Bayesian criterion allows.

    A quasi-periodic motion is a smooth function on a circle, seldom a sine.
    """
    n, best, waves = len(z), np.inf, np.zeros(len(z))
    for harmonics in range(2, min(MOST_HARMONICS, n // 6) + 1):
        columns = _waves(at, _refined(at, z, line, resolution, harmonics), harmonics)
        fitted = columns @ np.linalg.lstsq(columns, z, rcond=None)[0]
        rest = max(float(np.sum((z - fitted) ** 2)), 1e-12 * n * float(z.var()))
        criterion = n * np.log(rest) + 2 * harmonics * np.log(n)
        if criterion < best:
            best, waves = criterion, fitted
    return waves


def _refined(
    at: np.ndarray, z: np.ndarray, line: float, resolution: float, harmonics: int = 1
) -> float:
    """Frequency near `line` at which a fitted sine leaves the least residual."""
    from scipy.optimize import minimize_scalar

    def left(frequency: float) -> float:
        columns = _waves(at, frequency, harmonics)
        rest = z - columns @ np.linalg.lstsq(columns, z, rcond=None)[0]
        return float(rest @ rest)

    found = minimize_scalar(
        left,
        bounds=(line - 0.3 * resolution, line + 0.3 * resolution),
        method="bounded",
        options={"xatol": 1e-4 * resolution},
    )
    return float(found.x)


def _waves(at: np.ndarray, frequency: float, harmonics: int) -> np.ndarray:
    waves = [2 * np.pi * k * frequency * at for k in range(1, harmonics + 1)]
    return np.column_stack([part(wave) for wave in waves for part in (np.cos, np.sin)])


def _pairs(instant: np.ndarray, z: np.ndarray, lag: int) -> tuple[np.ndarray, np.ndarray]:
    """Standardised residuals of hits that are `lag` due instants apart."""
    order = np.argsort(instant)
    instant, z = instant[order], z[order] / max(float(z.std()), 1e-300)
    place = np.searchsorted(instant, instant + lag)
    place[place == len(instant)] = 0
    both = instant[place] == instant + lag
    return z[both], z[place[both]]


def _map_odds(before: np.ndarray, after: np.ndarray) -> list[float]:
    """Log-odds of a nonlinear map against a linear one, by the Bayesian criterion."""
    n = len(before)
    if n < FEWEST:
        return [-0.5 * np.log(max(n, 2))]
    powers = before[:, None] ** np.arange(5)
    rest = []
    for degree in (1, 2, 4):
        columns = powers[:, : degree + 1]
        weights, *_ = np.linalg.lstsq(columns, after, rcond=None)
        rest.append(max(float(np.sum((after - columns @ weights) ** 2)), 1e-12 * n))
    return [
        0.5 * n * np.log(rest[0] / rest[k]) - 0.5 * more * np.log(n) for k, more in ((1, 1), (2, 3))
    ]


def _hidden(before: np.ndarray, after: np.ndarray, deviation: float) -> tuple[float, float]:
    """Mean likelihood ratio of hidden bands, and the widest band that is not excluded.

    Of a band of rms a under jitter s the square of a residual is correlated with the next one by

        0.707 a^3 / sqrt((a^4/2 + 4 a^2 s^2 + 2 s^4) (a^2 + s^2))

    for the logistic map, or minus that; a^2 + s^2 is what is observed.
    """
    n = len(before)
    if n < FEWEST:
        return 1.0, deviation
    columns = np.column_stack((np.ones(n), before))
    square = before**2
    square = square - columns @ np.linalg.lstsq(columns, square, rcond=None)[0]
    rest = after - columns @ np.linalg.lstsq(columns, after, rcond=None)[0]
    r = float(square @ rest) / max(float(np.sqrt((square @ square) * (rest @ rest))), 1e-300)
    a = np.linspace(0.005, 0.995, 100)
    s = np.sqrt(1 - a**2)
    expected = LOGISTIC * a**3 / np.sqrt(0.5 * a**4 + 4 * a**2 * s**2 + 2 * s**4)
    mean, seen = np.arctanh(expected), np.arctanh(np.clip(r, -0.999999, 0.999999))
    # of either sign, against none
    gain = n * (mean * abs(seen) - 0.5 * mean**2) + np.log(
        0.5 + 0.5 * np.exp(-2 * n * mean * abs(seen))
    )
    ratio = np.exp(np.minimum(gain, 50.0))
    open_ = np.flatnonzero(ratio >= EXCLUDED)
    below = float(a[open_[-1]]) if len(open_) else 0.0
    return float(ratio.mean()), below * deviation
