"""Detection in further kinds of sound, beside onset pickers.

No constant of the detector was chosen on these kinds, except those of `deciding/gradual.py`, which
were fitted to other seeds of most of them: judge on seeds from 901 on.

Every function draws one record from a generator of random numbers: samples, rate, and the instants
of its impacts. Impacts less than `apart` after the last one kept are one, as are detections; one
counts within `window`. Prints the mean F1 of each kind and method, with their defaults, and the
least of ours.

    python -m benchmarks.other_sounds --seeds 1:9 [--only drums ball] [--ours]
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable
from typing import NamedTuple

import mir_eval
import numpy as np
from scipy import signal

from .recordings import coloured
from .seeds import add_seeds
from .sound_passage import methods
from .varied_disturbances import added

RATES = (16_000, 22_050, 44_100)


class Sound(NamedTuple):
    """A record with its impacts."""

    samples: np.ndarray
    rate: float
    time: np.ndarray


def ring(rng, rate, tones, decays, shares) -> np.ndarray:
    """Decaying tones in random phases, of peak 1."""
    since = np.arange(int(7 * np.max(decays) * rate) + 8) / rate
    angle = 2 * np.pi * np.outer(tones, since) + rng.uniform(0, 2 * np.pi, len(tones))[:, None]
    out = np.asarray(shares) @ (np.exp(-since / np.asarray(decays)[:, None]) * np.sin(angle))
    return out / np.abs(out).max()


def burst(rng, rate, low, high, decay) -> np.ndarray:
    """Decaying noise of a band, of peak 1."""
    noise = rng.standard_normal(int(7 * decay * rate) + 64)
    band = signal.butter(2, (low, min(high, 0.48 * rate)), "bandpass", fs=rate, output="sos")
    out = signal.sosfilt(band, noise) * np.exp(-np.arange(len(noise)) / (decay * rate))
    return out / np.abs(out).max()


def put(x, rate, start, sound, height) -> None:
    first = int(np.ceil(start * rate))
    part = x[first : first + len(sound)]
    part += height * sound[: len(part)]


def loud(rng, decibels) -> float:
    """A height of up to so many decibels below 1."""
    return float(10 ** (-rng.uniform(0, decibels) / 20))


def in_room(rng, x, rate, time, share) -> np.ndarray:
    """With reverberation of this energy beside the direct sound, 60 dB down after `time`."""
    k = np.arange(int(time * rate))
    room = rng.standard_normal(len(k)) * 10 ** (-3.0 * k / rate / time)
    room[: int(3e-3 * rate)] = 0.0
    return x + share * signal.fftconvolve(x, room / np.sqrt(np.sum(room**2)))[: len(x)]


def drums(rng) -> Sound:
    """A beat of bass drum, snare drum and soft strokes on a long ride, crashes now and then."""
    rate, beat = 44_100, 60.0 / rng.uniform(80, 170)
    x, every = np.zeros(12 * rate), []
    tones = np.exp(rng.uniform(np.log(400), np.log(12_000), 40))
    swing = rng.uniform(0.5, 0.66)
    softness = rng.uniform(6, 18)
    lasting = rng.uniform(0.3, 1.5)

    def stroke(at, sound, height):
        at = max(at + 0.006 * rng.standard_normal(), 0.05)
        put(x, rate, at, sound, height)
        every.append(at)

    for k in range(int(11.5 / beat)):
        at = 0.1 + k * beat
        for half in (0.0, swing):
            shares = rng.uniform(0.2, 1.0, 40)
            ride = 0.4 * ring(rng, rate, tones, rng.uniform(0.3, 1, 40) * lasting, shares)
            put(ride, rate, 0.0, burst(rng, rate, 2000, 12_000, 4e-3), 0.3)
            stroke(at + half * beat, ride, 0.35 * 10 ** (-softness / 20) * loud(rng, 8))
        if k % 2 == 0 or rng.random() < 0.2:
            bass = ring(
                rng, rate, (rng.uniform(50, 80), 140, 900), (0.12, 0.03, 4e-3), (1, 0.4, 0.2)
            )
            stroke(at, bass, loud(rng, 4))
        else:
            snare = 0.7 * burst(rng, rate, 800, 9000, 0.06)
            put(snare, rate, 0.0, ring(rng, rate, (190, 330), (0.05, 0.03), (1, 0.6)), 0.5)
            stroke(at, snare, 0.8 * loud(rng, 4))
        if rng.random() < 0.06:
            stroke(at, burst(rng, rate, 2500, 15_000, rng.uniform(0.5, 1.2)), 0.5)
        if rng.random() < 0.15:
            stroke(at + 0.75 * beat, 0.5 * burst(rng, rate, 800, 9000, 0.04), 0.25 * loud(rng, 8))
    x = in_room(rng, x, rate, rng.uniform(0.2, 0.6), 0.3)
    return Sound(x + 1e-3 * coloured(rng, len(x), rate), rate, np.sort(every))


def workshop(rng) -> Sound:
    """Hammering on steel with rebounds, in a hall in which a compressor runs."""
    rate = int(rng.choice(RATES))
    x, every, at = np.zeros(15 * rate), [], 0.3
    tones = np.exp(rng.uniform(np.log(500), np.log(0.4 * rate), 12))
    decays = np.exp(rng.uniform(np.log(0.01), np.log(0.25), 12))
    while at < 14.5:
        height = loud(rng, 10)
        put(x, rate, at, ring(rng, rate, tones, decays, rng.uniform(0.1, 1, 12)), height)
        every.append(at)
        if rng.random() < 0.4:
            again = at + rng.uniform(0.06, 0.12)
            put(x, rate, again, ring(rng, rate, tones, decays, rng.uniform(0.1, 1, 12)), height / 3)
            every.append(again)
        at += rng.uniform(0.3, 0.8)
    x = in_room(rng, x, rate, rng.uniform(0.6, 1.8), rng.uniform(0.3, 1.0))
    t, turn = np.arange(len(x)) / rate, rng.uniform(10, 25)
    pump = np.exp(2.0 * np.sin(2 * np.pi * turn * t)) * coloured(rng, len(x), rate)
    hum = sum(np.sin(2 * np.pi * 50 * m * t + m) / m for m in (1, 2, 4, 6))
    level = 10 ** (-rng.uniform(20, 34) / 20)
    return Sound(x + level * (0.3 * pump + hum), rate, np.array(every))


def gears(rng) -> Sound:
    """Rattle of 40 to 80 impacts a second, stronger once a turn."""
    rate, pace = int(rng.choice(RATES)), rng.uniform(40, 80)
    time = 0.1 + np.cumsum((1 + 0.08 * rng.standard_normal(int(8 * pace))).clip(0.6) / pace)
    x = np.zeros(int((time[-1] + 0.2) * rate))
    tones, decays = rng.uniform(1500, 0.4 * rate, 4), rng.uniform(0.7e-3, 3e-3, 4)
    turn, depth = rng.uniform(3, 12), rng.uniform(0, 0.6)
    for at in time:
        height = (1 + depth * np.sin(2 * np.pi * turn * at)) * np.exp(0.2 * rng.standard_normal())
        put(x, rate, at, ring(rng, rate, tones, decays, rng.uniform(0.2, 1, 4)), height)
    level = 10 ** (-rng.uniform(18, 35) / 20)
    return Sound(x + level * coloured(rng, len(x), rate), rate, time)


def ball(rng) -> Sound:
    """Balls dropped one after the other, each bouncing until its impacts are 30 ms apart."""
    rate = int(rng.choice(RATES))
    x, every, at = np.zeros(20 * rate), [], 0.3
    tones = np.exp(rng.uniform(np.log(250), np.log(3000), 5))
    decays = rng.uniform(2e-3, 15e-3, 5)
    restitution = rng.uniform(0.7, 0.9)
    while at < 18:
        flight, height = rng.uniform(0.4, 0.7), loud(rng, 6)
        while flight > 0.03 and at < 19.8:
            put(x, rate, at, ring(rng, rate, tones, decays, rng.uniform(0.3, 1, 5)), height)
            every.append(at)
            at, flight, height = at + flight, restitution * flight, restitution * height
        at += rng.uniform(0.3, 1.0)
    x = in_room(rng, x, rate, rng.uniform(0.2, 0.6), rng.uniform(0.1, 0.5))
    level = 10 ** (-rng.uniform(40, 55) / 20)
    return Sound(x + level * coloured(rng, len(x), rate), rate, np.array(every))


def typewriter(rng) -> Sound:
    """Typing, each key with a bar that falls back, while somebody speaks."""
    rate = int(rng.choice(RATES))
    x, every, at = np.zeros(15 * rate), [], 0.3
    pace = rng.uniform(3, 8)
    while at < 14.5:
        tones = rng.uniform(700, 0.42 * rate, 8)
        key = 0.6 * ring(rng, rate, tones, rng.uniform(2e-3, 2e-2, 8), rng.uniform(0.2, 1, 8))
        put(key, rate, 0.0, burst(rng, rate, 1500, 9000, 5e-3), 0.6)
        height = loud(rng, 8)
        put(x, rate, at, key, height)
        every.append(at)
        if rng.random() < 0.02:
            put(x, rate, at + 0.2, ring(rng, rate, (2700, 5300), (0.5, 0.3), (1, 0.3)), 0.3)
            every.append(at + 0.2)
        at += max(rng.gamma(4, 0.25 / pace), 0.06)
    x += added(rng, x, rate, rng.uniform(0.5, 2.0), "speech")
    x = in_room(rng, x, rate, 0.3, 0.3)
    return Sound(x + 3e-3 * coloured(rng, len(x), rate), rate, np.sort(every))


def footsteps(rng) -> Sound:
    """Heels on a floor, the sole rolling off after each, in wind."""
    rate = int(rng.choice(RATES))
    x, every, at = np.zeros(20 * rate), [], 0.4
    tones, decays = rng.uniform(70, 900, 6), rng.uniform(8e-3, 40e-3, 6)
    hard = rng.uniform(0.05, 0.5)
    pace = rng.uniform(0.45, 0.65)
    while at < 19.3:
        heel = ring(rng, rate, tones, decays, rng.uniform(0.2, 1, 6))
        put(heel, rate, 0.0, burst(rng, rate, 800, 5000, 4e-3), hard)
        put(x, rate, at, heel, loud(rng, 8))
        sole = burst(rng, rate, 400, 4000, 0.05)
        sole *= np.minimum(np.arange(len(sole)) / (0.05 * rate), 1.0)
        put(x, rate, at + rng.uniform(0.08, 0.14), sole, 0.15 * hard)
        every.append(at)
        at += pace * (1 + 0.04 * rng.standard_normal())
    wind = coloured(rng, len(x), rate, 2.0) * np.exp(0.4 * np.sin(np.arange(len(x)) / rate))
    level = 10 ** (-rng.uniform(22, 34) / 20)
    return Sound(x + level * (wind + 0.2 * coloured(rng, len(x), rate)), rate, np.array(every))


def gusts(rng) -> Sound:
    """Knocks in wind, whose level changes by some decibels up to 6 times a second."""
    rate = int(rng.choice(RATES))
    x = np.zeros(15 * rate)
    tones = np.exp(rng.uniform(np.log(500), np.log(0.4 * rate), 8))
    decays = np.exp(rng.uniform(np.log(3e-3), np.log(0.05), 8))
    pace = rng.uniform(1, 6)
    every = 0.2 + np.cumsum(0.06 + rng.gamma(2, 0.5 * (1 / pace - 0.06), 100))
    every = every[every < 14.5]
    for at in every:
        knock = ring(rng, rate, tones, decays, rng.uniform(0.2, 1, 8))
        put(knock, rate, 0.0, burst(rng, rate, 1000, 9000, 2e-3), 0.4)
        put(x, rate, at, knock, loud(rng, 10))
    slow = signal.butter(2, rng.uniform(0.5, 6), fs=1000, output="sos")
    level = signal.sosfilt(slow, rng.standard_normal(16_000))[500:]
    grown = np.interp(np.arange(len(x)) / rate, np.arange(len(level)) / 1000, level / level.std())
    wind = np.exp(rng.uniform(0.5, 1.2) * grown) * coloured(rng, len(x), rate, rng.uniform(1, 2.5))
    return Sound(x + 10 ** (-rng.uniform(18, 32) / 20) * wind, rate, every)


def bells(rng) -> Sound:
    """Strokes on a bell that still rings, in pairs of modes that beat."""
    rate = int(rng.choice(RATES))
    x, every, at = np.zeros(15 * rate), [], 0.3
    tones = np.exp(rng.uniform(np.log(500), np.log(0.4 * rate), 10))
    tones = np.concatenate((tones, tones + rng.uniform(1, 15, 10)))
    decays = np.tile(np.exp(rng.uniform(np.log(0.1), np.log(1.5), 10)), 2)
    pace = rng.uniform(2, 6)
    while at < 14.5:
        stroke = ring(rng, rate, tones, decays, rng.uniform(0.2, 1, 20))
        put(stroke, rate, 0.0, burst(rng, rate, 1000, 9000, 2e-3), 0.15)
        put(x, rate, at, stroke, loud(rng, 10))
        every.append(at)
        at += 0.08 + rng.gamma(2, 0.5 * (1 / pace - 0.08))
    level = 10 ** (-rng.uniform(35, 50) / 20)
    return Sound(x + level * coloured(rng, len(x), rate), rate, np.array(every))


KINDS: dict[Callable, tuple[float, float]] = {
    drums: (0.025, 0.03),
    workshop: (0.025, 0.03),
    gears: (0.005, 0.0),
    ball: (0.01, 0.0),
    typewriter: (0.025, 0.03),
    footsteps: (0.025, 0.2),
    gusts: (0.025, 0.03),
    bells: (0.025, 0.03),
}
"""With the window in which an impact counts, and the time within which impacts are one [s]."""


def kept(time: np.ndarray, apart: float) -> np.ndarray:
    """Instants without those less than `apart` after the last one kept."""
    out: list[float] = []
    for one in time:
        if not out or one - out[-1] >= apart:
            out.append(float(one))
    return np.array(out)


def f1(found: np.ndarray, truth: np.ndarray, window: float, apart: float) -> float:
    found, truth = kept(np.sort(found), apart), kept(truth, apart)
    return float(mir_eval.onset.f_measure(truth, found, window=window)[0])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_seeds(parser, "1:9")
    names = [make.__name__ for make in KINDS]
    parser.add_argument("--only", nargs="+", default=names, choices=names)
    parser.add_argument("--ours", action="store_true", help="impactsig only")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    every = {name: make() for name, (make, _) in methods().items()}
    if given.ours:
        every = {"impactsig": every["impactsig"]}
    print(" " * 12, *(f"{name:>10}" for name in every), "     least of ours")
    for make, (window, apart) in KINDS.items():
        if make.__name__ not in given.only:
            continue
        scores: dict[str, list[float]] = {name: [] for name in every}
        for seed in given.seeds:
            made = make(np.random.default_rng([seed, names.index(make.__name__)]))
            for name, find in every.items():
                found = np.asarray(find(made.samples, made.rate)[0])
                scores[name].append(f1(found, made.time, window, apart))
        means = (f"{np.mean(values):10.3f}" for values in scores.values())
        print(f"{make.__name__:12}", *means, f"{min(scores['impactsig']):18.3f}", flush=True)


if __name__ == "__main__":
    main()
