"""Delayed feedback on machines, gains and delays at random."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import (
    Controlled,
    DelayedFeedback,
    Friction,
    Hertz,
    KelvinVoigt,
    Oscillator,
    Rigid,
    RungeKutta,
    Stop,
    simulate,
)
from impactsig.oscillators import Force

MACHINES = 40  # for each seed


def machine(rng):
    """An oscillator with one stop or two, perhaps with friction."""
    laws = (
        Rigid(rng.uniform(0, 0.9)),
        KelvinVoigt(10 ** rng.uniform(0, 4), rng.uniform(0, 2)),
        KelvinVoigt(10 ** rng.uniform(0, 3), rng.uniform(0.1, 2), "force"),
        Hertz(10 ** rng.uniform(1, 3)),
    )
    stops = [Stop(rng.uniform(0.2, 1.5), laws[rng.integers(len(laws))])]
    if rng.random() < 0.4:
        stops.append(Stop(-rng.uniform(0.2, 1.5), Rigid(rng.uniform(0, 0.9)), "lower"))
    return Oscillator(
        damping=10 ** rng.uniform(-2, 0),
        forces=(Force(10 ** rng.uniform(-1, 0.7), rng.uniform(0.4, 2.5)),),
        stops=tuple(stops),
        friction=Friction(rng.uniform(0, 0.3), 0.35) if rng.random() < 0.25 else None,
    )


def feedback(rng):
    return DelayedFeedback(
        rng.choice([-1, 1]) * 10 ** rng.uniform(-2, 0.7),
        float(rng.integers(1, 4)) if rng.random() < 0.6 else rng.uniform(0.1, 2.5),
        None if rng.random() < 0.3 else 10 ** rng.uniform(-2, 1),
        str(rng.choice(["velocity", "displacement"])),
        0.0 if rng.random() < 0.6 else rng.uniform(0.05, 0.9),
    )


@pytest.mark.parametrize("seed", range(4))
def test_motion_and_force_at_random(seed):
    rng = np.random.default_rng([8, seed])
    converged = 0
    for _ in range(MACHINES):
        oscillator, own = machine(rng), feedback(rng)
        given = {"periods": 9, "initial": (0.0, rng.uniform(-1, 1))}
        rough, fine, finest = (
            simulate(Controlled(oscillator, own, start=3), method=RungeKutta(tolerance), **given)
            for tolerance in (1e-9, 1e-12, 1e-13)
        )
        if any(motion.status == "diverged" for motion in (rough, fine, finest)):
            continue
        assert {rough.status, fine.status, finest.status} == {"complete"}
        period = oscillator.forcing_period
        time = np.sort(rng.uniform(3.001, 8.999, 200)) * period
        states = [motion.sample(time)[0] for motion in (rough, fine, finest)]
        size = max(1.0, np.abs(states[2]).max())
        apart = [np.abs(x - states[2]).max() / size for x in states[:2]]
        # What neighbours part by multiplies both; what is left falls with the tolerance.
        assert apart[1] < 1e-7 or apart[1] < 0.02 * apart[0], (oscillator, own)
        converged += apart[1] < 1e-8
        for stop in oscillator.stops:
            if isinstance(stop.law, Rigid):
                side = 1 if stop.side == "upper" else -1
                assert (side * (states[1] - stop.position)).max() < 1e-12
        force = fine.force(time)
        if own.limit is not None:
            assert np.abs(force).max() <= own.limit * (1 + 1e-6)
        if own.memory == 0:
            which = 0 if own.signal == "displacement" else 1
            late, now = (fine.sample(t)[which] for t in (time - own.delay * period, time))
            told = own.gain * (late - now)
            if own.limit is not None:
                told = np.clip(told, -own.limit, own.limit)
            scale = abs(own.gain) * max(np.abs(now).max(), 1e-3)
            # Beside an impact the two may lie on either side of it.
            off = np.abs(told - force) > 1e-7 * scale
            assert np.count_nonzero(off) <= 1, (oscillator, own)
    assert converged > 0.8 * MACHINES
