"""Impact trains of known dynamics, with jitter, missed and spurious impacts.

Instants are in seconds; the forcing period is `PERIOD`, and the recording's clock differs from it
by up to 0.1 %. The noise "worst" is a jitter of 2.5 % of the forcing period, 10 % missed and 10 %
spurious impacts, "mild" a jitter of 0.2 to 1 % with up to 5 % of each. Of a "skipping" train 10 to
60 % of the impacts are missed.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from impactsig import Impacts, scenes, simulate

PERIOD = 1 / 22.1
ORBITS = ((1, 1), (1, 2), (1, 3), (1, 4), (2, 1), (2, 2), (2, 3), (2, 4), (3, 2), (3, 3), (4, 4))
KINDS = (
    "periodic", "drifting", "quasi-periodic", "banded", "chaotic", "irregular", "echo", "skipping",
)  # fmt: skip


@dataclass(frozen=True)
class Train:
    """Impacts, and what made them."""

    impacts: Impacts
    kind: str
    orbit: tuple[int, int] | None  # (m, n), where there is one
    spread: float  # rms of the modulation of the phase [forcing periods]
    what: str


@dataclass(frozen=True)
class Noise:
    jitter: float
    missed: float
    spurious: float


def noise_of(name: str, rng: np.random.Generator) -> Noise:
    if name == "worst":
        return Noise(0.025, 0.1, 0.1)
    if name == "mild":
        return Noise(rng.uniform(0.002, 0.01), rng.uniform(0, 0.05), rng.uniform(0, 0.05))
    raise ValueError(name)


def phases(orbit: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    """Instants of the impacts of an orbit, in forcing periods."""

    def off(low: float, high: float) -> float:
        return rng.uniform(low, high) * rng.choice([-1, 1])

    if orbit[0] == 1:
        return np.zeros(1)
    return np.array(
        {
            (2, 1): [0, rng.uniform(0.15, 0.45)],
            (2, 2): [0, 1 + off(0.08, 0.3)],
            (2, 3): [0, 1 + off(0, 0.2)],
            (2, 4): [0, rng.choice([1, 3]) + off(0, 0.4)],
            (3, 2): [0, 0.3 + off(0, 0.1), 1.2],
            (3, 3): [0, 1 + off(0.08, 0.15), 2 + off(0.2, 0.3)],
            (4, 4): [0, 1 + off(0.08, 0.12), 2 + off(0.08, 0.2), 3 + off(0.25, 0.3)],
        }[orbit]
    )


def steady(orbit: tuple[int, int], count: int, rng: np.random.Generator) -> np.ndarray:
    """About `count` instants of an orbit, in forcing periods."""
    m, n = orbit
    turns = np.arange(-(-count // m))[:, None] * n
    return (turns + phases(orbit, rng)).ravel()


def spoilt(cycles: np.ndarray, noise: Noise, rng: np.random.Generator) -> np.ndarray:
    """With impacts missed, jittered and strewn in."""
    kept = cycles[rng.random(len(cycles)) >= noise.missed]
    kept = kept + noise.jitter * rng.standard_normal(len(kept))
    extra = rng.uniform(cycles[0], cycles[-1], rng.poisson(noise.spurious * len(cycles)))
    return np.sort(np.concatenate((kept, extra)))


def train(kind: str, count: int, noise: str | Noise, seed: int | list[int]) -> Train:
    """One train of a kind, drawn from the seed."""
    rng = np.random.default_rng(seed)
    spoil = noise_of(noise, rng) if isinstance(noise, str) else noise
    orbit, spread, what = None, 0.0, ""
    if kind == "chaotic":
        beam = chaotic_beam()
        first = rng.integers(len(beam) - count)
        cycles = beam[first : first + count] - beam[first]
    elif kind == "irregular":
        shape = rng.choice([1.0, 2.0, 4.0, 8.0])
        cycles = np.cumsum(rng.gamma(shape, rng.uniform(0.6, 2.0) / shape, count))
        what = f"gamma {shape:g}"
    else:
        orbit = ORBITS[rng.integers(len(ORBITS))]
        cycles = steady(orbit, count, rng)
        if kind == "drifting":
            cycles, what = drifted(cycles, rng)
        elif kind == "quasi-periodic":
            spread, tone = rng.uniform(0.01, 0.04), irrational(rng, orbit)
            wave = np.sqrt(2) * np.sin(2 * np.pi * (tone * cycles + rng.random()))
            cycles, what = cycles + spread * wave, f"rms {spread:.3f}, {tone:.4f} per period"
        elif kind == "banded":
            spread, law = rng.uniform(0.01, 0.04), str(rng.choice(list(MAPS)))
            cycles = cycles + spread * orbit_of(law, len(cycles), rng)
            what = f"rms {spread:.3f}, {law}"
        elif kind == "skipping":
            share = rng.uniform(0.1, 0.6)
            cycles, what = steady(orbit, round(count / (1 - share)), rng), f"{share:.2f}"
            spoil = Noise(spoil.jitter, share, spoil.spurious * (1 - share))
        elif kind == "echo":
            share, delay = rng.uniform(0.2, 0.5), rng.uniform(0.03, 0.1)
            cycles = jittered(cycles, spoil, rng)
            echoes = cycles[rng.random(len(cycles)) < share] + delay
            echoes = echoes + 0.002 * rng.standard_normal(len(echoes))
            cycles, what = np.sort(np.concatenate((cycles, echoes))), f"{share:.2f}, {delay:.3f}"
            spoil = Noise(0.0, spoil.missed, spoil.spurious)
    time = spoilt(cycles, spoil, rng)
    time = (time - time[0]) * PERIOD * (1 + 1e-3 * rng.uniform(-1, 1)) + rng.uniform(0, 10)
    return Train(Impacts.from_times(np.sort(time)), kind, orbit, spread, what)


def jittered(cycles: np.ndarray, noise: Noise, rng: np.random.Generator) -> np.ndarray:
    return np.sort(cycles + noise.jitter * rng.standard_normal(len(cycles)))


def drifted(cycles: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, str]:
    """Under a speed that rises by 0.2 to 2 %, or wanders by 0.5 % rms."""
    grid = np.arange(np.floor(cycles[0]) - 1, np.ceil(cycles[-1]) + 2)
    if rng.random() < 0.5:
        size = rng.uniform(0.002, 0.02) * rng.choice([-1, 1])
        rate, what = size * ((grid - grid[0]) / np.ptp(grid) - 0.5), f"ramp {size:.4f}"
    else:
        memory = rng.uniform(20, 100)
        keep = np.exp(-1 / memory)
        rate = np.empty(len(grid))
        rate[0] = rng.standard_normal()
        kick = np.sqrt(1 - keep**2) * rng.standard_normal(len(grid))
        for k in range(1, len(grid)):
            rate[k] = keep * rate[k - 1] + kick[k]
        rate, what = 0.005 * rate, f"wander over {memory:.0f}"
    return cycles + np.interp(cycles, grid, np.cumsum(rate)), what


def irrational(rng: np.random.Generator, orbit: tuple[int, int]) -> float:
    """A frequency per forcing period, fast enough not to be drift, away from simple fractions."""
    m, n = orbit
    shares = np.array([k / (q * n) for q in range(1, 9) for k in range(q * n + 1)])
    while True:
        tone = rng.uniform(0.05, 0.45 * min(m / n, 1))
        if np.min(np.abs(shares - tone)) > 0.002:
            return tone


MAPS = {
    "logistic": lambda x: 1 - 2 * x * x,
    "tent": lambda x: 1 - 1.99999 * abs(x),
    "henon": None,
}


def orbit_of(law: str, count: int, rng: np.random.Generator) -> np.ndarray:
    """Values of a chaotic map, of mean 0 and variance 1."""
    x, y = rng.uniform(-0.3, 0.3, 2)
    values = np.empty(count + 100)
    for k in range(len(values)):
        if law == "henon":
            x, y = 1 - 1.4 * x * x + y, 0.3 * x
        else:
            x = MAPS[law](x)
        values[k] = x
    values = values[100:]
    return (values - values.mean()) / values.std()


@functools.cache
def chaotic_beam() -> np.ndarray:
    """Instants of the chaotic beam at 20.1 Hz, in forcing periods."""
    found = simulate(scenes.karpodinis(frequency=20.1), periods=6000, transient=300)
    return found.impacts.time * 20.1
