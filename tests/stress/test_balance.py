"""The checks of the batteries themselves: that they hold what is right, and notice what is not."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import impactsig
from impactsig import KelvinVoigt, Rigid
from tests.stress.balance import check
from tests.stress.quadrature import integrate
from tests.stress.test_random_machines import PERIODS, random_machine


@pytest.mark.parametrize(
    ("integrand", "exact"),
    [
        (np.cos, np.sin(2.0)),
        (lambda t: np.exp(-1e6 * t), 1e-6),
        (lambda t: np.abs(t - 0.3), (0.3**2 + 1.7**2) / 2),
        (lambda t: np.sign(t - 0.3), 1.4),
        (lambda t: np.cos(20 * t) ** 2, 1 + np.sin(80) / 80),
    ],
    ids=["smooth", "fast decay", "kink", "jump", "oscillation"],
)
def test_the_quadrature_is_as_exact_as_it_says(integrand, exact):
    def rates(time, _owner):
        value = integrand(time)[None]
        return value, 1e-14 * np.abs(value)

    edges = np.concatenate([[0.0], 16.0 ** np.arange(-8, 0), np.linspace(0.1, 2, 20)])
    owner = np.arange(len(edges) - 1) // 10
    value, error = integrate(rates, edges[:-1], edges[1:], owner, owner[-1] + 1, 1e-16, 10_000)
    assert abs(value.sum() - exact) <= error.sum()
    assert error.sum() < 1e-13


def with_law(change):
    def faulty(machine):
        return replace(
            machine, stops=tuple(replace(stop, law=change(stop.law)) for stop in machine.stops)
        )

    return faulty


def less_bouncy(law):
    return Rigid(law.restitution * (1 - 1e-9)) if isinstance(law, Rigid) else law


def stiffer(law):
    if isinstance(law, Rigid):
        return law
    return KelvinVoigt(law.stiffness * (1 + 1e-8), law.damping * (1 + 1e-8), law.ends)


def stickier(machine):
    friction = machine.friction
    if friction is None:
        return machine
    return replace(machine, friction=replace(friction, kinetic=friction.kinetic * (1 - 1e-9)))


FAULTS = {
    "restitution": with_law(less_bouncy),
    "damping": lambda machine: replace(machine, damping=machine.damping * (1 + 1e-9)),
    "stiffness": lambda machine: replace(machine, stiffness=machine.stiffness * (1 + 1e-9)),
    "load": lambda machine: replace(machine, load=machine.load * (1 + 1e-9)),
    "friction": stickier,
    "soft stops": with_law(stiffer),
}


@cache
def motions():
    """Motions of few impacts, each with its machine and phase."""
    found = []
    for seed in range(40):
        machine, initial, phase = random_machine(np.random.default_rng(seed), seed % 2 == 0, "gap")
        motion = impactsig.simulate(machine, periods=PERIODS, initial=initial, phase=phase)
        if motion.impact_count < 5000:
            found.append((machine, motion, phase))
    return found


@pytest.mark.parametrize("fault", FAULTS)
def test_the_checks_notice_a_billionth(fault):
    """Of the motions of another machine, nine digits like this one, many do not pass for its own.

    Some must: those in which what is wrong hardly acts, or beside forces that are huge.
    """
    wrong = [(FAULTS[fault](machine), motion, phase) for machine, motion, phase in motions()]
    wrong = [
        case for case, (machine, *_) in zip(wrong, motions(), strict=True) if case[0] != machine
    ]
    assert len(wrong) > 8
    noticed = 0
    for case in wrong:
        try:
            check(*case)
        except AssertionError:
            noticed += 1
    assert noticed > len(wrong) / 4
