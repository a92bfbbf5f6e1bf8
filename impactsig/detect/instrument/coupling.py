"""Time constant of an AC-coupled sensor, from the decay after pulses.

Behind a high-pass filter of the first order (a charge amplifier, a coupling capacitor) with the
time constant tau, a force x is recorded as y, where y' = x' - y / tau. So

    x = y + I / tau,    I the integral of y,

and where nothing presses, y lies on c + b t - I / tau: c is what was there before, b t the
integral of an offset that comes in behind the filter. That is linear in 1 / tau. Pulses lie on no
such line; they are what is left out.
"""

from __future__ import annotations

import numpy as np

from ..._numerics.spread import DEVIATION_BY_MEDIAN
from ..signal.ladder import FACTOR
from ..signal.order_kernels import centre_of
from .coupling_kernels import OFF, regress

QUIET = 2e-4
"""Of the range: the least noise that is assumed."""
WINDOWS = (256, 1024, 2048)
"""Means of FACTOR samples in which c and b are constant: for long ones, integrated noise bends
the line; short ones do not show a long time constant."""
SHORT = 10.0 * 1.5 ** np.arange(9)
"""Time constants [samples] to begin with as well: where they are shorter than a contact, most of
what is recorded is off the baseline."""
FEW = 12
"""Values off the baseline on either side that are looked into."""
LEFT = 0.15
"""Share of them that the time constant may leave."""
OUTSIDE = 0.5
"""Share of the values that may lie on no line: more are no pulses on a background, but motion."""
MOST = 0.6
"""Share of the windows with SOME values more off the baseline than the mean in which it must
explain some of them: a baseline that settles does once."""
SOME = 3.0


def time_constant(parts: list[np.ndarray], scale: float) -> float:
    """Time constant in samples, from stretches with strong pulses; 0 if none shows.

    Squares of the samples times `scale` must be numbers.
    """
    seen = [_means(part, scale) for part in parts if len(part) >= WINDOWS[0] * FACTOR]
    if np.mean([_swings(values) for values, _ in seen] or [False]) < MOST:
        return 0.0
    best, constant = 0.0, 0.0
    for length in WINDOWS:
        cut = [_windows(values, length) for values in seen]
        if not sum(one.shape[1] for one in cut):
            continue
        values, integrals = np.concatenate(cut, axis=1)
        noise = np.concatenate([np.full(one.shape[1], _noise(one[0])) for one in cut])
        if not noise.all():
            continue
        bare = _Fit(values, integrals, noise, 0.0, 0)
        if bare.weaker < FEW:
            continue
        moved = bare.off > SOME + np.mean(bare.off)
        if not moved.any():
            continue
        fits = [_Fit(values, integrals, noise, 0.0, 2)]
        # Hum leaves no line to begin from.
        if bare.off.mean() <= OUTSIDE * length and fits[0].weaker > LEFT * bare.weaker:
            for tau in SHORT:
                fits.append(_Fit(values, integrals, noise, FACTOR / tau, 1))
                if fits[-2].rate <= 0 and fits[-1].rate <= 0:
                    break  # both grow: there is no coupling, and others would end as they do
        for fit in fits:
            gain = bare.off - fit.off
            good = fit.rate > 0 and fit.weaker <= LEFT * bare.weaker
            good = good and fit.off.mean() <= OUTSIDE * length
            if good and np.mean(gain[moved] > 0.5) >= MOST and gain.sum() > best:
                best, constant = float(gain.sum()), FACTOR / fit.rate
    return constant


class _Fit:
    """Residuals of fits with one time constant, and with none."""

    def __init__(
        self, values: np.ndarray, integrals: np.ndarray, noise: np.ndarray, rate: float, free: int
    ) -> None:
        left = np.empty(values.shape)
        self.rate = regress(values, integrals, noise, rate, free, left)
        left /= OFF * noise[:, None]
        self.off = np.minimum(left**2, 1.0).sum(axis=1)
        sides = np.count_nonzero(left > 1.0), np.count_nonzero(left < -1.0)
        self.weaker, self.stronger = min(sides), max(sides)


def _means(part: np.ndarray, scale: float) -> np.ndarray:
    """Means over FACTOR samples each of a stretch and of its integral."""
    y = part[: len(part) // FACTOR * FACTOR].astype(np.float64) * scale
    y -= y.mean()
    integral = (np.cumsum(y) - 0.5 * y) / FACTOR
    return np.stack((y, integral)).reshape(2, -1, FACTOR).mean(axis=2)


def _swings(values: np.ndarray) -> bool:
    """Whether values deviate from their median to both sides."""
    above, limit = values - centre_of(values.copy(), len(values)), OFF * _noise(values)
    return bool(min(np.count_nonzero(above > limit), np.count_nonzero(above < -limit)) > 1)


def _windows(values: np.ndarray, length: int) -> np.ndarray:
    count = values.shape[1] // length
    return values[:, : count * length].reshape(2, count, length)


def _noise(values: np.ndarray) -> float:
    """Standard deviation, from differences of successive values."""
    if not values.size:
        return 0.0
    moves = np.abs(np.diff(values)).ravel()
    spread = DEVIATION_BY_MEDIAN * centre_of(moves, len(moves)) / np.sqrt(2.0)
    return max(spread, QUIET * float(np.ptp(values)))
