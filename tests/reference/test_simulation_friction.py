"""Coulomb friction: decay and rest in closed form, Den Hartog's response, chatter that rubs."""

from __future__ import annotations

import math

import numpy as np
import pytest

import impactsig
from impactsig import BaseMotion, Force, Friction, KelvinVoigt, Oscillator, Rigid, Stop


@pytest.mark.parametrize("friction", [0.01, 0.05, 0.3])
@pytest.mark.parametrize("start", [1.0, -7.3])
def test_free_decay_loses_four_f_over_k_in_a_cycle(friction, start):
    """And comes to rest at the first turning point where the spring is weaker than friction."""
    machine = Oscillator(mass=2.0, stiffness=3.0, friction=Friction(3.0 * friction))
    period = 2 * math.pi * math.sqrt(2 / 3)
    motion = impactsig.simulate(machine, duration=40 * period, initial=(start, 0))
    turns = math.ceil((abs(start) - friction) / (2 * friction) - 1e-9)
    rest = start * (1 - 2 * friction * turns / abs(start)) * (-1) ** turns
    sign = math.copysign(1, start)
    for n in range(min(turns, 60) + 1):
        x, v = motion.sample(n * period / 2)
        assert sign * (-1) ** n * x == pytest.approx(abs(start) - 2 * friction * n, rel=1e-12)
        assert v == pytest.approx(0, abs=1e-12 * abs(start))
    assert motion.stick_count == (turns < 80)
    if turns < 80:
        assert motion.sticks[0, 0] == pytest.approx(turns * period / 2, rel=1e-12)
        assert motion.final[0] == pytest.approx(rest, abs=1e-12 * abs(start))
        assert motion.final[1] == 0
        assert motion.sticks[0, 1] == motion.stop
        lost = 1.5 * (start**2 - rest**2)
        assert motion.energy_lost == pytest.approx(lost, rel=1e-12)


def test_a_damped_decay_with_friction_follows_the_half_cycles():
    """x - s f / k of each half cycle shrinks by exp(-zeta pi / sqrt(1 - zeta^2))."""
    zeta, f = 0.1, 0.02
    machine = Oscillator(damping=2 * zeta, friction=Friction(f))
    motion = impactsig.simulate(machine, duration=60.0, initial=(2.0, 0))
    shrink = math.exp(-zeta * math.pi / math.sqrt(1 - zeta**2))
    half = math.pi / math.sqrt(1 - zeta**2)
    x, n = 2.0, 0
    while abs(x) > f:
        x = -math.copysign(1, x) * ((abs(x) - f) * shrink - f)
        n += 1
        assert motion.sample(n * half)[0] == pytest.approx(x, abs=1e-12)
    assert motion.sticks[0, 0] == pytest.approx(n * half, rel=1e-13)
    assert motion.final[0] == pytest.approx(x, abs=1e-13)


def test_static_friction_holds_until_the_force_is_greater():
    """From rest under P cos(w t - pi/2): slides where P sin w t reaches the static limit."""
    f, static, amplitude, omega = 0.3, 0.8, 1.0, 0.7
    machine = Oscillator(forces=Force(amplitude, omega, -math.pi / 2), friction=Friction(f, static))
    motion = impactsig.simulate(machine, periods=1)
    assert motion.sticks[0, 0] == 0
    assert motion.sticks[0, 1] == pytest.approx(math.asin(static) / omega, rel=1e-14)
    held = impactsig.simulate(
        Oscillator(forces=Force(0.79, omega), friction=Friction(f, static)), periods=1000
    )
    assert held.final[:2] == (0, 0)
    assert held.stick_count == 1
    assert held.sticks[0, 1] == held.stop


@pytest.mark.parametrize("omega", [0.7, 1.3, 2.0])
@pytest.mark.parametrize("share", [0.1, 0.3])
def test_den_hartogs_response(omega, share):
    """Non-sticking motion [Den Hartog 1931], undamped: amplitude P sqrt(V^2 - (f/P)^2 U^2)."""
    machine = Oscillator(damping=1e-12, forces=Force(1.0, omega), friction=Friction(share))
    ratio = 1 / omega
    response = 1 / (1 - omega**2)
    damping = ratio * math.sin(math.pi * ratio) / (1 + math.cos(math.pi * ratio))
    amplitude = math.sqrt(response**2 - (share * damping) ** 2)
    motion = impactsig.simulate(machine, periods=20, transient=3000)
    time = np.linspace(motion.start, motion.stop, 40001)
    x, _ = motion.sample(time)
    if motion.stick_count:
        pytest.fail("the closed form is of motion that does not stick")
    found = np.sort(np.abs(x))[-20:].mean()
    assert found == pytest.approx(amplitude, rel=2e-6)


def test_a_rubbing_bounce_sums_to_rest():
    """A block thrown up an incline of friction f under g: hops shrink by r sqrt((g-f)/(g+f))."""
    g, f, r, v = 1.0, 0.3, 0.7, 1.0
    machine = Oscillator(
        stiffness=0, load=-g, friction=Friction(f), stops=(Stop(0, Rigid(r), "lower"),)
    )
    motion = impactsig.simulate(machine, duration=50.0, initial=(0, v))
    ratio = r * math.sqrt((g - f) / (g + f))
    hop = v / (g + f) * (1 + math.sqrt((g + f) / (g - f)))
    assert motion.sticks[0, 0] == pytest.approx(hop / (1 - ratio), rel=1e-12)
    assert motion.energy_lost == pytest.approx(0.5 * v * v, rel=1e-12)


def test_a_block_that_friction_holds_does_not_come_back():
    """f > g: it slides up and stays."""
    machine = Oscillator(
        stiffness=0, load=-1, friction=Friction(1.5), stops=(Stop(0, Rigid(0.7), "lower"),)
    )
    motion = impactsig.simulate(machine, duration=50.0, initial=(0, 1.0))
    assert motion.final[0] == pytest.approx(1 / (2 * 2.5), rel=1e-14)
    assert motion.impact_count == 0


def test_friction_on_a_moving_base_is_relative_to_it():
    """Held by friction, the mass moves with the base that carries the stops."""
    base = BaseMotion(0.01, 2.0, 0.3, stops=True)
    machine = Oscillator(base=base, friction=Friction(1.0), stops=(Stop(9, Rigid(0.5)),))
    at = 0.01 * math.cos(0.3)
    v = -0.02 * math.sin(0.3)
    motion = impactsig.simulate(machine, periods=5, initial=(at + 0.1, v))
    time = np.linspace(0, motion.stop, 50)
    np.testing.assert_allclose(
        motion.sample(time)[0] - 0.1, 0.01 * np.cos(2 * time + 0.3), atol=1e-15
    )


def test_rubbing_between_soft_stops_agrees_with_small_steps():
    """Two soft stops a side, static friction, two forcings: against steps of 1e-4 that stick."""
    f, static = 0.15, 0.25
    stops = (
        Stop(0.5, KelvinVoigt(20.0, 0.5)), Stop(0.8, KelvinVoigt(200.0, 1.0)),
        Stop(-0.6, KelvinVoigt(50.0, 0.0), "lower"),
    )  # fmt: skip
    machine = Oscillator(
        damping=0.05, forces=(Force(0.75, 0.4), Force(0.2, 1.9, 1.0)), stops=stops,
        friction=Friction(f, static),
    )  # fmt: skip
    motion = impactsig.simulate(machine, duration=30.0, initial=(0.2, 0.4))

    def net(t, x, v):
        force = 0.75 * math.cos(0.4 * t) + 0.2 * math.cos(1.9 * t + 1.0) - 0.05 * v - x
        if x > 0.5:
            force -= 20 * (x - 0.5) + 0.5 * v
        if x > 0.8:
            force -= 200 * (x - 0.8) + 1.0 * v
        if x < -0.6:
            force -= 50 * (x + 0.6)
        return force

    x, v, t, h = 0.2, 0.4, 0.0, 1e-4
    for n in range(300_000):
        if v == 0 and abs(net(t, x, 0)) <= static:
            t = (n + 1) * h
            continue
        way = math.copysign(1, v if v else net(t, x, 0))

        def rate(t, x, v, way=way):
            return v, net(t, x, v) - way * f

        k1 = rate(t, x, v)
        k2 = rate(t + h / 2, x + h / 2 * k1[0], v + h / 2 * k1[1])
        k3 = rate(t + h / 2, x + h / 2 * k2[0], v + h / 2 * k2[1])
        k4 = rate(t + h, x + h * k3[0], v + h * k3[1])
        x += h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
        u = v + h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
        v = 0.0 if v and u * v < 0 else u
        t = (n + 1) * h
    assert motion.stick_count > 2
    assert motion.impact_count > 5
    assert motion.final[0] == pytest.approx(x, abs=2e-3)
    assert motion.final[1] == pytest.approx(v, abs=2e-3)
