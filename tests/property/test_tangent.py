"""Tangent maps of random machines against differences of neighbouring motions.

Every kind of event must have come by often enough, alone or among others.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

import impactsig
from impactsig import (
    BaseMotion,
    Force,
    Friction,
    Hertz,
    KelvinVoigt,
    Oscillator,
    Rigid,
    RungeKutta,
    Stop,
)
from impactsig.simulation.basis.events import IMPACT, PART, RELEASE, REVERSE, STICK, TOUCH
from tests.neighbours import derivative, events


def fading(v):
    return 0.9 / (1 + 0.1 * v)


def bent(t, x, v):
    return -0.4 * x**3 - 0.05 * v * x * x + 0.1 * np.sin(2 * t) * x


def rigid(rng):
    return Rigid(rng.uniform(0.1, 1.0))


def function(rng):
    return Rigid(fading)


def spring(rng):
    return KelvinVoigt(10 ** rng.uniform(0.5, 3.5), 10 ** rng.uniform(-1, 1.3))


def pusher(rng):
    return KelvinVoigt(10 ** rng.uniform(0.5, 3.5), 10 ** rng.uniform(-1, 1.3), "force")


def hertz(rng):
    return Hertz(10 ** rng.uniform(1, 3), damping=rng.uniform(0, 0.5))


def lankarani(rng):
    return Hertz(10 ** rng.uniform(1, 3), exponent=rng.uniform(1.5, 2.5), restitution=0.8)


def random_machine(rng, law, rubs=False, force=None):
    """Two stops about a forced mass, some of them carried by a moving base, and a start."""
    omega = 10 ** rng.uniform(-0.5, 0.6)
    base = None
    if rng.random() < 0.5:
        base = BaseMotion(rng.uniform(0, 0.3), omega, rng.uniform(0, 6), stops=rng.random() < 0.7)
    stops = [Stop(rng.uniform(0.0, 0.6), law(rng))]
    if rng.random() < 0.3 and not isinstance(stops[0].law, Rigid):
        stops.append(Stop(stops[0].position + rng.uniform(0.02, 0.2), Rigid(0.7)))
    if rng.random() < 0.5:
        stops.append(Stop(-rng.uniform(0.2, 0.8), law(rng), "lower"))
    friction = None
    if rubs:
        kinetic = rng.uniform(0.05, 0.5)
        friction = Friction(kinetic, kinetic * rng.choice([1.0, 1.3]))
    machine = Oscillator(
        mass=rng.uniform(0.5, 2),
        damping=rng.choice([0.0, 10 ** rng.uniform(-2, 1)]),
        stiffness=rng.choice([0.0, rng.uniform(0.3, 3)]),
        forces=(Force(1.0, omega, rng.uniform(0, 6)), Force(0.3, 1.7 * omega)),
        load=rng.normal() * 0.2,
        base=base,
        stops=tuple(stops),
        friction=friction,
        law=force,
    )
    start = -0.1 + (base.amplitude * np.cos(base.phase) if base and base.stops else 0.0)
    return machine, (start, rng.normal() * omega)


CASES = {
    "rigid": (rigid, {}, {IMPACT: 60}),
    "function": (function, {}, {IMPACT: 60}),
    "spring": (spring, {}, {TOUCH: 60, PART: 40, IMPACT: 5}),
    "pusher": (pusher, {}, {TOUCH: 60, PART: 40, IMPACT: 5}),
    "rubbing": (rigid, {"rubs": True}, {IMPACT: 30, STICK: 15, RELEASE: 8, REVERSE: 15}),
    "rubbing springs": (spring, {"rubs": True}, {TOUCH: 30, STICK: 15, RELEASE: 8, REVERSE: 15}),
}
STEPPED = {
    **CASES,
    "hertz": (hertz, {}, {TOUCH: 40, PART: 30}),
    "lankarani": (lankarani, {}, {TOUCH: 40, PART: 30}),
    "law": (rigid, {"force": bent}, {IMPACT: 40}),
}


def compare(seeds, case, method, noise):
    law, options, wanted = case
    seen, compared = Counter(), 0
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        machine, start = random_machine(rng, law, **options)
        run = {"periods": rng.uniform(0.3, 1.5), "method": method}
        found = impactsig.tangent_map(machine, initial=start, **run)
        told = derivative(machine, start, (1e-3, 1e-3 * machine.angular_forcing_frequency), **run)
        if told is None or found.grazings:
            continue
        matrix, error = told
        size = np.abs(matrix).max()
        if error + noise > 2.5e-7 * size:  # where neighbours all but meet, they tell little
            continue
        assert np.abs(found.matrix - matrix).max() <= 1e-6 * size, seed
        compared += 1
        seen.update(kind for kind, _ in events(impactsig.simulate(machine, initial=start, **run)))
    assert compared > seeds / 3
    for kind, count in wanted.items():
        assert seen[kind] >= count, kind


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_saltations_are_the_derivatives_of_the_simulator(case):
    kind, options, wanted = case
    compare(24, (kind, options, {k: n // 4 for k, n in wanted.items()}), None, 3e-11)


# Their laws and their friction are among the others, in other machines.
SLOW = ("pusher", "rubbing springs")


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id=name, marks=pytest.mark.slow if name in SLOW else ())
        for name, case in STEPPED.items()
    ],
)
def test_stepped_saltations_are_the_derivatives_of_the_stepper(case):
    kind, options, wanted = case
    compare(8, (kind, options, {k: n // 15 for k, n in wanted.items()}), RungeKutta(1e-13), 3e-9)
