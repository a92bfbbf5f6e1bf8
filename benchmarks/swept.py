"""The thesis beam swept in frequency: how far from the steady beam's its jumps are.

    python -m benchmarks.swept [--rate HZ_PER_S] [--restitution R] [--damping D] [--seed N]

The forcing goes from 18 to 26 Hz and back in two recordings; a load cell hears it at 20 dB. Steady
jumps are those of the simulator at steps of 0.01 Hz, each begun where the last ended. Printed with
each jump: as it is seen, and less its delay, from both recordings and from its own alone.
"""

from __future__ import annotations

import argparse
from functools import partial
from itertools import pairwise

import numpy as np

import impactsig as im
from impactsig.experiment._sweep import swept
from impactsig.experiment._transitions import Jump, jumps_in_sweeps

from .experiments import BEAM, CONTACT, DECIBELS, RATE, VOLTS_PER_VELOCITY, motion_in

SPAN = (18.0, 26.0)
STEP, SETTLED = 0.01, 1500  # [Hz], and forcing periods before what is looked at
SHORTEST = 0.1  # [Hz]; what the steady motion does for less, windows of a sweep do not show


def train_of(beam, first: float, last: float, rate: float) -> im.Impacts:
    """The impacts of a sweep, begun from the steady motion."""
    settled = SETTLED / first
    sweep = im.Swept(beam(first), rate, start=settled)
    motion = im.simulate(sweep, duration=(last - first) / rate, transient=settled)
    velocity = motion.impacts.approach_velocity
    return im.Impacts(
        motion.impacts.time - motion.start, start=0.0, duration=motion.duration, unit="V",
        contact_time=CONTACT * velocity**-0.2, peak=VOLTS_PER_VELOCITY * velocity,
    )  # fmt: skip


def steady_jumps(beam, branch: str) -> list[tuple[float, str, str]]:
    """Where the steady motion changes, of motions that last; others pass for aperiodic."""
    values = np.round(np.arange(SPAN[0], SPAN[1] + STEP / 2, STEP), 3)
    order = values if branch == "up" else values[::-1]
    diagram = im.bifurcation_diagram(beam, order, carry=True, transient=SETTLED)
    motions = [motion_in(diagram, k) for k in range(len(order))]
    runs = np.split(np.arange(len(order)), np.flatnonzero(_changes(motions)) + 1)
    for run in runs:
        if len(run) * STEP < SHORTEST:
            for k in run:
                motions[k] = "aperiodic"
    return [
        (float(order[k] + order[k + 1]) / 2, motions[k], motions[k + 1])
        for k in np.flatnonzero(_changes(motions))
    ]


def _changes(motions: list[str]) -> list[bool]:
    return [a != b for a, b in pairwise(motions)]


def measured(beam, branch: str, rate: float, seed: int) -> tuple[dict, str]:
    """What is read of the recording of a branch."""
    first, last = SPAN if branch == "up" else SPAN[::-1]
    pace = rate if branch == "up" else -rate
    train = train_of(beam, first, last, pace)
    noise = float(np.median(train.peak)) * 10 ** (-DECIBELS / 20)
    made = im.synthesize(train, im.LoadCell(noise=noise, unit="V"), rate=RATE, seed=seed)
    law = {"from": "law", "start": first, "rate": pace}
    rig = im.Rig(channel=[{"number": 0}], sweep=law)
    return swept(im.detect_impacts(made), rig, None), branch


def main() -> None:
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("--rate", type=float, default=0.02)
    given.add_argument("--restitution", type=float, default=0.2)
    given.add_argument("--damping", type=float, default=0.03)
    given.add_argument("--seed", type=int, default=0)
    chosen = given.parse_args()
    beam = partial(BEAM, restitution=chosen.restitution, damping_ratio=chosen.damping)
    sweeps = [measured(beam, one, chosen.rate, chosen.seed) for one in ("up", "down")]
    alone = {one[1]: jumps_in_sweeps([one]) for one in sweeps}
    together = jumps_in_sweeps(sweeps)
    print("| branch | jump | steady | seen | both sweeps | off | this sweep alone | off |")
    print("|---|---|---|---|---|---|---|---|")
    for branch in ("up", "down"):
        own = [one for one in together if one.branch == branch]
        for value, before, after in steady_jumps(beam, branch):
            near = min(own, key=partial(_apart, value=value), default=None)
            if near is None or _apart(near, value) > 0.5:
                print(f"| {branch} | {before} to {after} | {value:.3f} | not seen | | | | |")
                continue
            other = alone[branch][own.index(near)]
            cells = [
                f"{one.value:.3f} ± {one.error:.3f} | {one.value - value:+.3f}"
                for one in (near, other)
            ]
            seen = near.value + near.delay
            row = f"{branch} | {near.before} to {near.after} | {value:.3f} | {seen:.3f}"
            print(f"| {row} | {' | '.join(cells)} |")


def _apart(jump: Jump, value: float) -> float:
    return abs(jump.value - value)


if __name__ == "__main__":
    main()
