"""The thesis beam as an experiment: recorded at many frequencies, up and down, and read again.

    python -m benchmarks.experiments [--step HZ] [--seconds S] [--folder FOLDER] [--seed N]

Prints the share of runs whose period is right, how far jumps are from the simulator's, and the
error of contact times, in words. For recordings in which the frequency was swept see
`benchmarks/swept.py`.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import impactsig as im

RATE = 50_000.0
CONTACT = 300e-6  # [s], of an impact of unit approach velocity
VOLTS_PER_VELOCITY = 0.6
SETTLED = 400  # forcing periods before what is recorded
DECIBELS = 20.0
BEAM = im.scenes.karpodinis
RIG = im.Rig(
    channel=[{"number": 0, "sensor": "force", "unit": "V"}],
    parameter={
        "name": "frequency",
        "unit": "Hz",
        "from": "file name",
        "pattern": r"(?P<branch>up|down)/(?P<value>[0-9.]+)Hz",
    },
    forcing={"frequency": "parameter"},
)


@dataclass(frozen=True)
class Truth:
    """What the simulator did along a branch: its diagram and the train of every value."""

    branch: str
    diagram: im.results.BifurcationDiagram
    trains: tuple[im.Impacts, ...]


def simulated(values: np.ndarray, branch: str, seconds: float) -> Truth:
    """A branch of the beam, each value begun where the last one ended."""
    order = np.sort(values) if branch == "up" else np.sort(values)[::-1]
    diagram = im.bifurcation_diagram(BEAM, order, carry=True, transient=SETTLED)
    trains = []
    for value, strobe in zip(order, diagram.strobe, strict=True):
        scene = BEAM(float(value))
        motion = im.simulate(scene, periods=seconds * float(value), initial=tuple(strobe[-1]))
        found = motion.impacts
        trains.append(
            replace(
                found,
                time=found.time - motion.start,
                start=0.0,
                duration=seconds,
                contact_time=CONTACT * found.approach_velocity**-0.2,
                peak=VOLTS_PER_VELOCITY * found.approach_velocity,
                unit="V",
            )
        )
    return Truth(branch, diagram, tuple(trains))


def noise_of(trains) -> float:
    """Noise [V] at which the median peak of all runs stands DECIBELS above it."""
    peaks = np.concatenate([train.peak for train in trains])
    return float(np.median(peaks)) * 10 ** (-DECIBELS / 20)


def record(truth: Truth, folder: Path, noise: float, seed: int = 0) -> None:
    """The recordings of a branch, in a folder of its name."""
    import soundfile

    place = folder / truth.branch
    place.mkdir(parents=True, exist_ok=True)
    cell = im.LoadCell(noise=noise, unit="V")
    for number, (value, train) in enumerate(zip(truth.diagram.values, truth.trains, strict=True)):
        one = im.synthesize(train, cell, rate=RATE, seed=np.random.SeedSequence((seed, number)))
        soundfile.write(place / f"{value:06.3f}Hz.wav", one.samples / 2, int(RATE), "PCM_24")


def motion_in(diagram: im.results.BifurcationDiagram, k: int) -> str:
    """The motion of the simulator, in the words of an experiment."""
    if not diagram.periods[k]:
        return "aperiodic"
    if not diagram.impacts[k]:
        return "no impacts"
    return f"period({diagram.impacts[k]},{diagram.periods[k]})"


def judged(experiment: im.Experiment, truths) -> dict:
    """Share of right periods, errors of contact times, and how many steps off the jumps are."""
    runs = {
        (branch, round(float(value), 3)): k
        for k, (branch, value) in enumerate(
            zip(experiment.branches, experiment.values, strict=True)
        )
    }
    points, frame = experiment.points(), experiment.to_frame()
    measured_contact, contact_error = frame["contact_time"], frame["contact_time_error"]
    right, wrong, contacts, stated, off = 0, [], [], [], []
    for truth in truths:
        motions = [motion_in(truth.diagram, k) for k in range(len(truth.trains))]
        measured = []
        for k, value in enumerate(truth.diagram.values):
            run = runs[truth.branch, round(float(value), 3)]
            measured.append(points[run].motion)
            right += measured[-1] == motions[k]
            if measured[-1] != motions[k]:
                wrong.append((truth.branch, float(value), motions[k], measured[-1]))
            if len(truth.trains[k]) and len(found := experiment.impacts(run)):
                pairs = im.match_impacts(found, truth.trains[k]).pairs
                contact = truth.trains[k].contact_time[pairs[:, 1]].mean()
                contacts.append(measured_contact[run] / contact - 1)
                stated.append(contact_error[run] / contact)
        off += _steps_off(motions, measured)
    return {
        "right": right / len(runs), "wrong": wrong, "contacts": np.array(contacts),
        "stated": np.array(stated), "off": off,
    }  # fmt: skip


def _steps_off(motions: list[str], measured: list[str]) -> list[float]:
    """Of every jump of either the steps to the nearest of the other; inf where there is none."""
    own, other = (
        [k for k in range(len(of) - 1) if of[k] != of[k + 1]] for of in (motions, measured)
    )
    return [
        min((abs(k - j) for j in others), default=np.inf)
        for ones, others in ((own, other), (other, own))
        for k in ones
    ]


def main() -> None:
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("--step", type=float, default=0.05)
    given.add_argument("--seconds", type=float, default=10.0)
    given.add_argument("--folder", type=Path)
    given.add_argument("--seed", type=int, default=0)
    chosen = given.parse_args()
    values = np.round(np.arange(18.0, 26.0 + chosen.step / 2, chosen.step), 3)
    truths = [simulated(values, branch, chosen.seconds) for branch in ("up", "down")]
    noise = noise_of([train for truth in truths for train in truth.trains])
    with tempfile.TemporaryDirectory() as temporary:
        folder = chosen.folder or Path(temporary)
        for seed, truth in enumerate(truths, chosen.seed):
            record(truth, folder, noise, seed)
        experiment = im.Experiment.read(folder, RIG)
        print(experiment)
        found = judged(experiment, truths)
        print(f"period right in {100 * found['right']:.2f} % of {len(experiment)} runs")
        for one in found["wrong"]:
            print("  ", *one)
        off, contacts = np.array(found["off"]), abs(found["contacts"])
        print(f"jumps: {len(off)}, {np.mean(off <= 1):.0%} at most one step off: {off.tolist()}")
        print(
            f"contact time: within 2 % in {np.mean(contacts < 0.02):.1%} of runs, median "
            f"{np.median(contacts):.2%}, worst {contacts.max():.2%}; "
            f"{np.mean(contacts < 1.96 * found['stated']):.1%} within 1.96 standard errors"
        )
        for jump in experiment.jumps():
            print("  ", jump)


if __name__ == "__main__":
    main()
