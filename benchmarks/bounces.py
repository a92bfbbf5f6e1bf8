"""Restitution coefficients from bounces: how often the stated interval holds the truth.

    python -m benchmarks.bounces [--drops N] [--seed S]

Bodies are dropped from 5 to 80 cm on a load cell, or beside a microphone, with coefficients of 0.5
to 0.9; contact times are those of a linear spring, the same at every speed, or of Hertz.
"""

from __future__ import annotations

import argparse
import math

import numpy as np

import impactsig as im

GRAVITY = 9.81


def drop(rng: np.random.Generator, hertz: bool) -> tuple[float, im.Impacts]:
    """A coefficient, and the touches of a body that has it."""
    restitution, height = rng.uniform(0.5, 0.9), rng.uniform(0.05, 0.8)
    speed, contact = math.sqrt(2 * GRAVITY * height), rng.uniform(0.5e-3, 3e-3)
    first, time = speed, rng.uniform(0.1, 0.3)
    touches, speeds, contacts = [], [], []
    while speed > 0.02 * first and len(touches) < 12:
        touches.append(time)
        speeds.append(speed)
        contacts.append(contact * (speed / first) ** (-0.2 if hertz else 0))
        speed *= restitution
        time += contacts[-1] + 2 * speed / GRAVITY
    train = im.Impacts(
        np.array(touches), contact_time=np.array(contacts), peak=np.array(speeds), unit="N",
        start=0.0, duration=touches[-1] + 0.3,
    )  # fmt: skip
    return restitution, train


def recorded(
    train: im.Impacts, sensor: str, decibels: float, seed: np.random.SeedSequence
) -> im.Impacts:
    """What is detected of a drop; the noise is that far below the median bounce."""
    noise = float(np.median(train.peak)) * 10 ** (-decibels / 20)
    if sensor == "force":
        made = im.synthesize(train, im.LoadCell(noise=noise, unit="N"), rate=50_000.0, seed=seed)
    else:
        made = im.synthesize(
            train, im.Microphone(distance=0.3, gain=0.3, noise=noise / 3), seed=seed
        )
    return im.detect_impacts(made)


def coverage(sensor: str, decibels: float, hertz: bool, drops: int, seed: int):
    """Shares of drops answered and held, and the median of the error of those answered."""
    answered, held, errors = 0, 0, []
    for k in range(drops):
        rng = np.random.default_rng((seed, k))
        seeds = np.random.SeedSequence([seed, k, 1])
        truth, train = drop(rng, hertz)
        try:
            found = im.restitution_from_bounces(recorded(train, sensor, decibels, seeds))
        except im.InvalidInput:
            continue
        answered += 1
        held += found.interval[0] <= truth <= found.interval[1]
        errors.append(abs(found.restitution - truth))
    return answered / drops, held / max(answered, 1), float(np.median(errors))


def main() -> None:
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("--drops", type=int, default=200)
    given.add_argument("--seed", type=int, default=0)
    asked = given.parse_args()
    print("| sensor | contact | noise | answered | held | median error |")
    print("|---|---|---|---|---|---|")
    for sensor in ("force", "sound"):
        for hertz in (False, True):
            for decibels in (10.0, 20.0, 30.0):
                share, held, error = coverage(sensor, decibels, hertz, asked.drops, asked.seed)
                law = "Hertz" if hertz else "spring"
                row = f"{share:.1%} | {held:.1%} | {error:.1e}"
                print(f"| {sensor} | {law} | {decibels:g} dB | {row} |", flush=True)


if __name__ == "__main__":
    main()
