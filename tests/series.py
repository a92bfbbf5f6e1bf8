"""Series whose dimension is known: maps, flows, integrate-and-fire intervals, closed forms."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numba import njit

ROESSLER, LORENZ = 0, 1


@njit(cache=True, nogil=True)
def _rate(system, state, out):
    """Rössler (a, b, c) = (0.2, 0.2, 5.7), S = x + 20; Lorenz (10, 28, 8/3), S = (x + 2)^2."""
    x, y, z = state[0], state[1], state[2]
    if system == 0:
        out[0], out[1], out[2] = -y - z, x + 0.2 * y, 0.2 + z * (x - 5.7)
        out[3] = x + 20
    else:
        out[0], out[1], out[2] = 10 * (y - x), x * (28 - z) - y, x * y - 8 / 3 * z
        out[3] = (x + 2) ** 2


@njit(cache=True, nogil=True)
def _step(system, state, h, k, mid, out):
    """One classical Runge-Kutta step of the flow and of the integral of its signal."""
    _rate(system, state, k[0])
    mid[:] = state + h / 2 * k[0]
    _rate(system, mid, k[1])
    mid[:] = state + h / 2 * k[1]
    _rate(system, mid, k[2])
    mid[:] = state + h * k[2]
    _rate(system, mid, k[3])
    out[:] = state + h / 6 * (k[0] + 2 * k[1] + 2 * k[2] + k[3])


@njit(cache=True, nogil=True)
def _fire(system, state, h, threshold, count, skip):
    """Intervals between the instants at which the integral of the signal gains `threshold`."""
    k, mid, out = np.empty((4, 4)), np.empty(4), np.empty(4)
    intervals = np.empty(count)
    elapsed = 0.0
    fired = -skip
    while fired < count:
        _step(system, state, h, k, mid, out)
        if out[3] < threshold:
            state[:] = out
            elapsed += h
            continue
        part = h * (threshold - state[3]) / (out[3] - state[3])
        for _ in range(4):
            _step(system, state, part, k, mid, out)
            _rate(system, out, k[0])
            if k[0][3] > 1e-6:
                part += (threshold - out[3]) / k[0][3]
        _step(system, state, part, k, mid, out)
        if fired >= 0:
            intervals[fired] = elapsed + part
        fired += 1
        elapsed = 0.0
        state[:] = out
        state[3] = 0.0
    return intervals


@njit(cache=True, nogil=True)
def _sample(system, state, h, every, count, skip):
    """The x coordinate every `every` steps of `h`."""
    k, mid, out = np.empty((4, 4)), np.empty(4), np.empty(4)
    x = np.empty(count)
    for i in range(-skip, count):
        for _ in range(every):
            _step(system, state, h, k, mid, out)
            state[:] = out
        if i >= 0:
            x[i] = state[0]
    return x


def _start(system: int, seed: int) -> np.ndarray:
    start = np.random.default_rng(seed).uniform(-1, 1, 4)
    start[3] = 0
    return start + ([1, 1, 0, 0] if system == ROESSLER else [1, 1, 20, 0])


def roessler_intervals(count: int, seed: int = 0) -> np.ndarray:
    """Integrate-and-fire intervals of Rössler's flow, threshold 20; about six an orbit."""
    return _fire(ROESSLER, _start(ROESSLER, seed), 0.01, 20.0, count, 500)


def lorenz_intervals(count: int, seed: int = 0) -> np.ndarray:
    """Integrate-and-fire intervals of Lorenz's flow, threshold 20; two to three an orbit."""
    return _fire(LORENZ, _start(LORENZ, seed), 0.002, 20.0, count, 500)


def lorenz(count: int, seed: int = 0) -> np.ndarray:
    """x of Lorenz's flow every 0.04."""
    return _sample(LORENZ, _start(LORENZ, seed), 0.004, 10, count, 1000)


def iterated(
    step: Callable[..., tuple[float, ...]],
    start: Iterable[float],
    seen: Callable[..., float],
    count: int,
    skip: int = 0,
) -> np.ndarray:
    """What is seen of the states of a map, after those that are skipped."""
    state, found = tuple(start), np.empty(count)
    for i in range(-skip, count):
        state = step(*state)
        if i >= 0:
            found[i] = seen(*state)
    return found


def first(x: float, *_: float) -> float:
    return x


def henon(count: int, seed: int = 0) -> np.ndarray:
    """x of Hénon's map, a = 1.4, b = 0.3."""
    start = np.random.default_rng(seed).uniform(-0.1, 0.1, 2)
    return iterated(lambda x, y: (1 - 1.4 * x * x + y, 0.3 * x), start, first, count, 500)


def ikeda(count: int, seed: int = 0) -> np.ndarray:
    """x of Ikeda's map, u = 0.9; D2 = 1.69 for the plane of (x, y)."""

    def step(x: float, y: float) -> tuple[float, float]:
        t = 0.4 - 6 / (1 + x * x + y * y)
        c, s = np.cos(t), np.sin(t)
        return 1 + 0.9 * (x * c - y * s), 0.9 * (x * s + y * c)

    start = np.random.default_rng(seed).uniform(-0.1, 0.1, 2)
    return iterated(step, start, first, count, 500)


def torus(count: int, seed: int = 0, frequencies: int = 2) -> np.ndarray:
    """Sum of cosines of incommensurable frequencies: a torus of that dimension."""
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, frequencies)
    rates = 2 * np.pi * np.array([(np.sqrt(5) - 1) / 2, np.sqrt(2) - 1, np.sqrt(3) - 1])
    k = np.arange(count)[:, None]
    return np.cos(k * rates[:frequencies] + phases).sum(axis=1)


def noisy(x: np.ndarray, share: float, seed: int = 0) -> np.ndarray:
    """`x` with Gaussian noise of `share` of its standard deviation."""
    return x + share * x.std() * np.random.default_rng([seed, 7]).standard_normal(len(x))


def cat(count: int, seed: int) -> np.ndarray:
    """cos 2 pi x + sin 2 pi y / 2 of Arnold's cat map, which fills the torus."""
    rng = np.random.default_rng(seed)

    def step(x: float, y: float) -> tuple[float, float]:
        return (2 * x + y + 1e-15 * rng.uniform()) % 1.0, (x + y) % 1.0

    def seen(x: float, y: float) -> float:
        return np.cos(2 * np.pi * x) + 0.5 * np.sin(2 * np.pi * y)

    return iterated(step, rng.uniform(size=2), seen, count)


def coloured(count: int, exponent: float, rng: np.random.Generator) -> np.ndarray:
    """Gaussian noise of the spectrum 1 / f^exponent."""
    frequency = np.fft.rfftfreq(count)
    frequency[0] = frequency[1]
    spectrum = rng.standard_normal((2, len(frequency))) * frequency ** (-exponent / 2)
    return np.fft.irfft(spectrum[0] + 1j * spectrum[1], count)


def autoregressive(count: int, weights: Iterable[float], rng: np.random.Generator) -> np.ndarray:
    """A linear process under Gaussian shocks."""
    from scipy.signal import lfilter

    shocks = rng.standard_normal(count + 200)
    return lfilter([1.0], [1.0, *(-np.array(weights))], shocks)[200:]
