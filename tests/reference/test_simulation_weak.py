"""Springs and dampers that hardly act cost no digits."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

import impactsig
from impactsig import Force, Oscillator, Rigid, Stop

START, SPEED = 0.25, 0.5


def closed_form(damping, stiffness, load, time):
    """x and x' of x'' + c x' + k x = cos t + load from (START, SPEED), in 80 digits."""
    with mp.workdps(80):
        c, k, t = mp.mpf(damping), mp.mpf(stiffness or "1e-45"), mp.mpf(time)
        response = 1 / (k - 1 + 1j * c)
        rest, root = load / k, mp.sqrt(mp.mpc(c * c / 4 - k))
        slow, fast = root - c / 2, -root - c / 2
        z, w = START - rest - response.real, SPEED - (1j * response).real
        late = (w - fast * z) / (slow - fast)
        early = z - late
        late, early, forced = (
            late * mp.exp(slow * t),
            early * mp.exp(fast * t),
            mp.expj(t) * response,
        )
        x = rest + forced + late + early
        return float(x.real), float((1j * forced + slow * late + fast * early).real)


@pytest.mark.parametrize("load", [0.0, 1.0, -2.0])
@pytest.mark.parametrize("stiffness", [0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.2, 0.9, 3.0])
@pytest.mark.parametrize("damping", [0.0, 1e-9, 1e-6, 1e-3, 0.3, 1.0, 2.0, 10.0, 1000.0])
def test_motion_on_weak_springs_and_dampers_in_many_digits(damping, stiffness, load):
    machine = Oscillator(damping=damping, stiffness=stiffness, load=load, forces=Force(1, 1))
    motion = impactsig.simulate(machine, periods=3, initial=(START, SPEED))
    time = np.array([0.1, 0.26, 0.3, 0.5, 0.75, 1.0, 1.5, 3.0, 6.0, 12.0])
    x, v = motion.sample(time)
    exact = np.array([closed_form(damping, stiffness, load, t) for t in time])
    # A forced response and a free motion as large add up, at angles that are known to 2e-15.
    response = 1 / abs(stiffness - 1 + 1j * damping)
    digits = 2e-15 * (1 + response + np.abs(exact).max(axis=0))
    assert np.all(np.abs(np.stack([x, v], axis=1) - exact) <= digits)


@pytest.mark.parametrize(("damping", "stiffness"), [(1e-9, 0.0), (0.0, 1e-9), (1e-4, 1e-10)])
def test_the_first_impact_far_from_where_a_weak_spring_would_rest(damping, stiffness):
    machine = Oscillator(
        damping=damping,
        stiffness=stiffness,
        load=1.0,
        forces=Force(1, 1),
        stops=(Stop(2.0, Rigid(0.5)),),
    )
    impacts = impactsig.simulate(machine, periods=1, initial=(START, SPEED)).impacts
    time = impacts.time[0]
    x, v = closed_form(damping, stiffness, 1.0, time)
    assert x == pytest.approx(2, abs=4 * np.spacing(2.0))
    assert impacts.approach_velocity[0] == pytest.approx(v, rel=4e-16)
