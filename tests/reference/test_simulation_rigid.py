"""The exact engine with rigid stops, against closed forms, many digits and published values."""

from __future__ import annotations

import math
from math import pi, sqrt

import numpy as np
import pytest

import impactsig
from impactsig import Force, Oscillator, Rigid, Stop, scenes
from tests import naive

CHAOS = {"zeta": 0.05, "amplitude": 9.435, "omega": 2.7}


def one_sided(zeta, amplitude, omega, restitution):
    return Oscillator(
        damping=2 * zeta, forces=Force(amplitude, omega), stops=(Stop(1, Rigid(restitution)),)
    )


def test_the_period_one_orbit_is_that_of_shaw_and_holmes():
    motion = impactsig.simulate(scenes.karpodinis(22.1), periods=100, transient=2000)
    velocity = motion.impacts.approach_velocity
    closed = naive.one_impact_orbit(naive.frequency_ratio(22.1))
    assert velocity == pytest.approx(0.5810258993557, abs=1e-12)
    assert velocity == pytest.approx(closed, rel=1e-12)
    assert motion.impacts_per_period == pytest.approx(1, rel=1e-14)


@pytest.mark.parametrize(("frequency", "published"), [(20.1, 0.607), (20.3355, 0.548)])
def test_impacts_per_period_of_the_chaotic_runs(frequency, published):
    beam = scenes.karpodinis(frequency)
    x, v, phase = 0.0, 0.0, 0.0
    rates = []
    for _ in range(20):
        motion = impactsig.simulate(
            beam, periods=5000, transient=200, initial=(x, v), phase=phase, keep="counts"
        )
        x, v, phase = motion.final
        rates.append(motion.impacts_per_period)
    error = np.std(rates, ddof=1) / sqrt(len(rates))
    assert error < 0.002
    assert np.mean(rates) == pytest.approx(published, abs=0.0015 + 3 * error)


def test_the_first_impacts_of_a_chaotic_run_in_forty_digits():
    mp = pytest.importorskip("mpmath")
    from tests import naive_simulate

    machine = naive_simulate.one_sided(**CHAOS, restitution=0.8)
    instants, speeds = naive_simulate.impacts(machine, 20)
    impacts = impactsig.simulate(one_sided(**CHAOS, restitution=0.8), periods=60).impacts
    error = [abs(float(mp.mpf(float(t)) - s)) for t, s in zip(impacts.time, instants, strict=False)]
    assert error[0] <= 4 * np.spacing(float(instants[0]))
    assert max(error[:20]) < 2e-9
    assert impacts.approach_velocity[:20] == pytest.approx([float(v) for v in speeds], abs=1e-8)


@pytest.mark.parametrize("restitution", [0.3, 0.8, 0.99])
def test_a_bouncing_ball_comes_to_rest_when_it_must(restitution):
    """It falls for sqrt(2H/g), and all its rebounds end (1 + r)/(1 - r) times that later."""
    height, gravity = 1.7, 9.81
    ball = Oscillator(
        mass=2.5,
        stiffness=0,
        load=-2.5 * gravity,
        stops=(Stop(0, Rigid(restitution), "lower"),),
    )
    motion = impactsig.simulate(ball, duration=1000, initial=(height, 0))
    fall = sqrt(2 * height / gravity)
    assert motion.impacts.time[0] == pytest.approx(fall, rel=1e-15)
    ends = fall * (1 + restitution) / (1 - restitution)
    assert motion.sticks == pytest.approx(np.array([[ends, 1000]]), rel=1e-12)
    assert motion.energy_lost == pytest.approx(2.5 * gravity * height, rel=1e-13)
    expected = sqrt(2 * gravity * height) * restitution ** np.arange(motion.impact_count)
    assert motion.impacts.approach_velocity == pytest.approx(expected, rel=1e-11)
    assert motion.final[:2] == (0, 0)


def test_energy_is_kept_where_nothing_takes_it():
    """r = 1, no damping, no forcing: x'^2 + x^2 stays, over a million impacts."""
    free = Oscillator(stops=(Stop(1, Rigid(1)), Stop(-0.7, Rigid(1), "lower")))
    motion = impactsig.simulate(free, duration=1.2e6, initial=(0, 1.7))
    assert motion.impact_count > 1_000_000
    energy = motion.impacts.approach_velocity**2 + np.where(
        np.arange(motion.impact_count) % 2, 0.49, 1
    )
    assert abs(energy / 1.7**2 - 1).max() < 1e-10
    x, v, _ = motion.final
    assert x * x + v * v == pytest.approx(1.7**2, rel=1e-10)


@pytest.mark.parametrize("stop", ["hard", "soft"])
@pytest.mark.parametrize(("eta", "published"), [(4, 0.5), (8, 0.25)])
def test_okolewski_impacts_per_period_without_loss(stop, eta, published):
    motion = impactsig.simulate(scenes.okolewski(eta, 1.0, stop), periods=400, transient=4000)
    assert motion.impacts_per_period == pytest.approx(published, abs=1e-12)


def test_okolewski_hard_orbit_does_not_depend_on_where_chatter_is_cut():
    """Period 4 with two sticks, however many rebounds are listed one by one."""
    orbit, counts = [], []
    for cut in (1e-4, 1e-6, 1e-8, 1e-10):
        motion = impactsig.simulate(
            scenes.okolewski(3, 0.6), periods=80, transient=1000, chatter=cut
        )
        x, v = motion.stroboscopic()
        assert abs(x[4:] - x[:-4]).max() < 1e-15
        orbit.append((x[:4], v[:4]))
        counts.append(motion.impact_count)
        sticks = motion.sticks
    assert np.ptp(orbit, axis=0).max() < 1e-15
    assert np.all(np.diff(counts) > 0)
    period = 2 * pi / 3
    assert np.diff(sticks[:, 1]) == pytest.approx(
        np.resize(np.diff(sticks[:, 1])[:2], len(sticks) - 1), abs=1e-9
    )
    assert motion.stick_count == pytest.approx(motion.duration / (4 * period), abs=1)
    # It is let go where the base no longer pushes: the pressing force changes sign.
    release = 3 * sticks[:-1, 1]

    def pressing(angle):
        return 0.0025 * (9 * np.sin(angle) - 0.23 * 3 * np.cos(angle))

    assert abs(pressing(release)).max() < 1e-12


@pytest.mark.parametrize("restitution", [0.0, 1e-6, 0.5])
def test_a_plastic_stop_lets_go_when_the_force_turns(restitution):
    """Pressed by a load of 2 and a force 3 cos t, it is let go where the sum turns."""
    machine = Oscillator(
        stiffness=0.0,
        damping=0.4,
        load=2.0,
        forces=Force(3.0, 1.0),
        stops=(Stop(0, Rigid(restitution)),),
    )
    motion = impactsig.simulate(machine, periods=20, initial=(0, 0))
    release = motion.sticks[:-1, 1] % (2 * pi)
    assert release == pytest.approx(math.acos(-2 / 3), abs=1e-12)
    assert len(release) >= 19
