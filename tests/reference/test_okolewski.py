"""Okolewski and Blazejczyk-Okolewska 2021: the two energies of an impact on a moving base.

The body's kinetic energy is followed by an integration of its own (scipy), impact by impact.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from impactsig import InvalidInput, bifurcation_diagram, scenes, simulate, stop_damping

A, C = 0.0025, 0.23


def gained_and_lost(eta, restitution, stiffness, state, periods):
    """What the body gains against the ground and loses against the base; hard without stiffness."""

    def gap(t, y):
        return y[0] - A * math.sin(eta * t)

    gap.terminal = True
    damping = stop_damping(restitution, stiffness) if stiffness else 0.0
    t, end, touching = 0.0, 2 * math.pi * periods / eta, False
    gained = lost = 0.0
    y = np.array(state)
    while t < end:

        def rates(t, y, touching=touching):
            force = A * math.sin(eta * t) - y[0] - C * y[1]
            if touching:
                force -= stiffness * gap(t, y)
                force -= damping * (y[1] - A * eta * math.cos(eta * t))
            return [y[1], force]

        gap.direction = 1 if touching else -1
        found = solve_ivp(
            rates, (t, end), y, "DOP853", events=gap, rtol=1e-12, atol=1e-16, max_step=0.05
        )
        t, y = found.t[-1], found.y[:, -1]
        if found.status != 1:
            break
        base = A * eta * math.cos(eta * t)
        if stiffness:
            sign = 1 if touching else -1
            gained += sign * y[1] ** 2 / 2
            lost -= sign * (y[1] - base) ** 2 / 2
            touching = not touching
        else:
            after = base - restitution * (y[1] - base)
            gained += (after**2 - y[1] ** 2) / 2
            lost += ((y[1] - base) ** 2 - (after - base) ** 2) / 2
            y = np.array([A * math.sin(eta * t), after])
    return gained / periods, lost / periods


@pytest.mark.parametrize(
    ("eta", "restitution", "stiffness"), [(4, 1.0, None), (8, 0.8, None), (4, 0.8, 2000.0)]
)
def test_both_energies_are_those_of_an_integration(eta, restitution, stiffness):
    kind = {"stop": "soft", "stop_stiffness": stiffness} if stiffness else {}
    machine = scenes.okolewski(eta, restitution, **kind)
    motion = simulate(machine, periods=4, transient=400)
    state = motion.sample(motion.start)
    gained, lost = gained_and_lost(eta, restitution, stiffness, state, 4)
    assert motion.kinetic_energy_gained() / 4 == pytest.approx(gained, rel=1e-6)
    assert motion.energy_lost / 4 == pytest.approx(lost, rel=1e-6, abs=1e-16)


def test_an_elastic_base_dissipates_nothing_and_still_drives():
    """The sizes that the figure of the paper shows at r = 1, and nothing lost."""
    diagram = bifurcation_diagram(lambda eta: scenes.okolewski(eta, 1.0), [4.0, 8.0])
    assert diagram.energy_per_period == pytest.approx([0, 0], abs=1e-15)
    assert diagram.kinetic_energy_per_period == pytest.approx([5.7e-4, 9.5e-4], rel=0.01)


def test_of_counts_alone_it_is_not_known():
    motion = simulate(scenes.okolewski(4, 1.0), periods=4, keep="counts")
    with pytest.raises(InvalidInput) as caught:
        motion.kinetic_energy_gained()
    assert caught.value.argument == "keep"
