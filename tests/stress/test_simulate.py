"""Random machines over the whole range of parameters, and the invariants of every motion."""

from __future__ import annotations

import numpy as np
import pytest

import impactsig
from impactsig import BaseMotion, Force, KelvinVoigt, Oscillator, Rigid, Stop

RESTITUTIONS = (0.0, 1e-6, 0.2, 0.6, 0.9, 1 - 1e-12, 1.0)


def random_machine(rng):
    """An oscillator, a start on the right side of its stops, and its scale of velocity."""
    stiffness = rng.choice([0.0, 1.0, 10 ** rng.uniform(-3, 3)])
    damping = rng.choice([0.0, 10 ** rng.uniform(-4, 2)])
    omega = 10 ** rng.uniform(-3, 3)
    # An acceleration a displaces a / omega^2 in a period: keep the numbers of one size.
    size = 10 ** rng.uniform(-2, 2) * max(1.0, omega**2)
    forces = [Force(size, omega, rng.uniform(0, 7))]
    if rng.random() < 0.3:
        forces.append(Force(size * rng.uniform(0, 1), omega * rng.uniform(0.3, 3)))
    base = None
    if rng.random() < 0.3:
        base = BaseMotion(
            10 ** rng.uniform(-2, 0), omega, rng.uniform(0, 7), stops=rng.random() < 0.5
        )
    upper = rng.choice([0.0, 10 ** rng.uniform(-6, 1)])
    stops = []
    for side in ("upper", "lower"):
        law = Rigid(rng.choice(RESTITUTIONS))
        if rng.random() < 0.3:
            law = KelvinVoigt(10 ** rng.uniform(0, 12), rng.choice([0, 10 ** rng.uniform(-3, 5)]))
        at = upper if side == "upper" else upper - 10 ** rng.uniform(-3, 1)
        if side == "upper" or rng.random() < 0.5:
            stops.append(Stop(at, law, side))
    machine = Oscillator(
        damping=damping,
        stiffness=stiffness,
        forces=tuple(forces),
        load=rng.choice([0.0, size * rng.normal()]),
        base=base,
        stops=tuple(stops),
    )
    lowest = stops[1].position if len(stops) > 1 else upper - 1
    start = rng.uniform(lowest, upper)
    if base is not None and base.stops:
        start += base.amplitude * np.cos(base.phase)
    return machine, (start, rng.normal() * omega)


def check(machine, motion):
    """What no motion may break."""
    impacts = motion.impacts
    assert motion.status in ("complete", "work limit")
    assert np.all(np.isfinite(motion.final))
    assert np.all(np.diff(impacts.time) >= 0)
    assert np.all(impacts.approach_velocity >= 0)
    assert np.all(motion.sticks[:, 1] >= motion.sticks[:, 0])
    rigid = all(isinstance(stop.law, Rigid) for stop in machine.stops)
    if rigid:
        assert motion.energy_lost >= 0
    time = np.linspace(motion.start, motion.stop, 400)
    x, v = motion.sample(time)
    assert np.all(np.isfinite(x))
    assert np.all(np.isfinite(v))
    base = machine.base
    at = 0.0
    if base is not None and base.stops:
        at = base.amplitude * np.cos(base.frequency * time + base.phase)
    scale = 1e-12 * (np.abs(x).max() + np.abs(v).max() * motion.duration * 1e-3)
    for stop in machine.stops:
        if isinstance(stop.law, Rigid):
            sign = 1 if stop.side == "upper" else -1
            assert np.all(sign * (x - at - stop.position) <= scale)


def run(seed):
    rng = np.random.default_rng(seed)
    try:
        machine, initial = random_machine(rng)
    except impactsig.InvalidInput:  # undamped resonance, so seldom that the tests count them
        return None
    motion = impactsig.simulate(machine, periods=12, initial=initial)
    check(machine, motion)
    return motion


def test_no_random_machine_breaks_an_invariant():
    motions = [run(seed) for seed in range(600)]
    status = [motion.status for motion in motions if motion is not None]
    assert len(status) > 590
    assert sum(motion.impact_count for motion in motions if motion) > 10_000
    assert sum(motion.stick_count for motion in motions if motion) > 50


@pytest.mark.slow
def test_no_random_machine_of_many_breaks_an_invariant():
    for seed in range(10_000, 30_000):
        run(seed)
