"""Free oscillation under viscous damping and Coulomb friction, in closed form."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

MOST_SWINGS = 100_000


class Machine(NamedTuple):
    """x'' + 2 ratio omega x' + omega^2 (x - centre + friction sgn x') = 0, from (start, speed)."""

    omega: float
    ratio: float
    friction: float
    centre: float
    start: float
    speed: float


def swings(machine: Machine, time: np.ndarray) -> np.ndarray:
    """Displacement at times from 0 on, ascending.

    Friction moves the position of equilibrium by itself, to either side, at each extremum; half a
    period passes between two of these. The mass rests at the first that is within the friction of
    the centre.
    """
    omega, ratio, friction, centre, start, speed = machine
    alpha, damped = ratio * omega, omega * math.sqrt(max(1 - ratio**2, 1e-12))
    half, kept = math.pi / damped, math.exp(-alpha * math.pi / damped)
    way = math.copysign(1.0, speed) if speed else math.copysign(1.0, centre - start)
    origin = centre - way * friction
    a = start - origin
    b = (speed + alpha * a) / damped
    # The first extremum: speed cos(wt) - (alpha b + damped a) sin(wt) = 0 with a factor.
    first = math.atan2(speed, alpha * b + damped * a) % math.pi / damped
    place = origin + math.exp(-alpha * first) * (
        a * math.cos(damped * first) + b * math.sin(damped * first)
    )
    out = np.empty(len(time))
    begun = int(np.searchsorted(time, first))
    t = time[:begun]
    out[:begun] = origin + np.exp(-alpha * t) * (a * np.cos(damped * t) + b * np.sin(damped * t))
    if begun == len(time):
        return out
    places, ways = [place], [-way]
    last = float(time[-1])
    while first + (len(places) - 1) * half <= last and len(places) < MOST_SWINGS:
        if abs(places[-1] - centre) <= friction:
            break
        origin = centre - ways[-1] * friction
        places.append(origin - kept * (places[-1] - origin))
        ways.append(-ways[-1])
    t = time[begun:] - first
    which = np.minimum((t / half).astype(int), len(places) - 1)
    t = t - which * half
    extremum, origins = np.array(places), centre - np.array(ways) * friction
    rests = (which == len(places) - 1) & (abs(places[-1] - centre) <= friction)
    wave = np.cos(damped * t) + alpha / damped * np.sin(damped * t)
    moving = origins[which] + (extremum - origins)[which] * np.exp(-alpha * t) * wave
    out[begun:] = np.where(rests, places[-1], moving)
    return out


def extrema(samples: np.ndarray, frequency: float, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Times and values of successive extrema, from parabolas over a fifth of an oscillation."""
    reach = max(2, round(0.1 * rate / frequency))
    offsets = np.arange(-reach, reach + 1)
    # Least squares: value, slope and curvature at every sample.
    fits = np.linalg.pinv(np.vander(offsets, 3, increasing=True))
    if len(samples) <= 2 * reach + 2:
        return np.empty(0), np.empty(0)
    value, slope, bend = (np.convolve(samples, row[::-1], "valid") for row in fits)
    crossed = np.flatnonzero((slope[:-1] > 0) != (slope[1:] > 0))
    share = slope[crossed] / (slope[crossed] - slope[crossed + 1])
    at = crossed + share
    level = value[crossed] - slope[crossed] ** 2 / (4 * bend[crossed])
    # Noise makes several crossings of one extremum: they alternate, half a swing apart.
    keep: list[int] = []
    for k in range(len(at)):
        if not keep or at[k] - at[keep[-1]] > 0.35 * rate / frequency:
            keep.append(k)
    return (at[keep] + reach) / rate, level[keep]


def decrement(levels: np.ndarray) -> tuple[float, float, float]:
    """Damping ratio, friction and centre from successive extrema [FeenyLiang1996]_.

    ``X_(k+1) = -beta X_k + (1 + beta) (centre + s_k friction)``, s_k = 1 after a maximum and -1
    after a minimum, beta = exp(-pi ratio / sqrt(1 - ratio^2)), by least squares.
    """
    maximum = np.where(levels[:-1] > levels[1:], 1.0, -1.0)
    table = np.column_stack([levels[:-1], np.ones(len(maximum)), maximum])
    slope, level, jump = np.linalg.lstsq(table, levels[1:], rcond=None)[0]
    beta = min(max(-slope, 1e-3), 1 - 1e-9)
    log = -math.log(beta) / math.pi
    return log / math.hypot(1.0, log), float(jump / (1 + beta)), float(level / (1 + beta))
