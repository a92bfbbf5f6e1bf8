"""Contacts that only push, stops one behind the other, restitution that depends on velocity."""

from __future__ import annotations

from itertools import pairwise
from math import atan2, exp, log, nan, sqrt

import numpy as np
import pytest

import impactsig
from impactsig import Force, Friction, InvalidInput, KelvinVoigt, Oscillator, Rigid, Stop
from impactsig.impacts import OPEN_END


def thrown(*stops, mass=1.0, speed=1.0, friction=None, duration=20.0):
    """A free mass thrown from 0 at the stops of one side."""
    sign = 1 if stops[0].side == "upper" else -1
    free = Oscillator(mass=mass, stiffness=0, stops=stops, friction=friction)
    return impactsig.simulate(free, duration=duration, initial=(0, sign * speed))


@pytest.mark.parametrize("beta", [1e-3, 0.1, 0.5, sqrt(0.5), 0.9, 0.999])
@pytest.mark.parametrize("stiffness", [1e2, 1e6, 1e12])
@pytest.mark.parametrize("side", ["upper", "lower"])
def test_a_contact_that_ends_at_zero_force(beta, stiffness, side):
    """r = exp(-beta phi / sqrt(1 - beta^2)), over after phi / (omega sqrt(1 - beta^2))."""
    mass, speed = 3.0, 0.7
    at = 0.5 if side == "upper" else -0.5
    law = KelvinVoigt(stiffness, 2 * beta * sqrt(stiffness * mass), ends="force")
    motion = thrown(Stop(at, law, side), mass=mass, speed=speed)
    damped = sqrt((1 - beta) * (1 + beta))
    angle = atan2(2 * beta * damped, 2 * beta**2 - 1)
    restitution = exp(-beta / damped * angle)
    assert abs(motion.final[1]) == pytest.approx(restitution * speed, rel=1e-12)
    assert motion.energy_lost == pytest.approx(
        mass / 2 * speed**2 * (1 - restitution**2), rel=1e-12, abs=1e-15
    )
    time = angle / damped / sqrt(stiffness / mass)
    slack = 1e-15 / time  # of the instants, that are half a second and more
    assert motion.impacts.contact_time == pytest.approx([time], rel=1e-12 + slack)
    assert motion.impacts.flags[0] == 0


@pytest.mark.parametrize("damping", [2.0, 2.5, 40.0])
def test_a_damper_too_strong_to_swing_still_lets_go(damping):
    """The force -d'' is zero where s1^2 exp(-s1 t) = s2^2 exp(-s2 t); without "force" never."""
    law = KelvinVoigt(1.0, damping, ends="force")
    motion = thrown(Stop(0.5, law))
    fast = (damping + sqrt(damping**2 - 4)) / 2
    slow = 1 / fast
    time, out = 2.0, exp(-2)
    if fast > slow:
        time = 2 * log(fast / slow) / (fast - slow)
        out = (slow * exp(-slow * time) - fast * exp(-fast * time)) / (fast - slow)
    assert motion.impacts.contact_time == pytest.approx([time], rel=1e-13)
    assert motion.final[1] == pytest.approx(-out, rel=1e-12)
    stays = thrown(Stop(0.5, KelvinVoigt(1.0, damping)))
    assert stays.impacts.flags[0] == OPEN_END


def test_a_contact_that_only_pushes_never_pulls_and_is_pressed_again():
    """The force on the mass, from differences of the sampled velocity, under a lively forcing."""
    law = KelvinVoigt(40.0, 9.0, ends="force")
    machine = Oscillator(
        damping=0.1, load=0.6, forces=(Force(1.0, 1.1), Force(8.0, 23.0, 0.4)),
        stops=(Stop(0.1, law),),
    )  # fmt: skip
    motion = impactsig.simulate(machine, periods=40)
    step = 1e-6
    time = np.linspace(0.01, motion.stop - 0.01, 20_011)
    x, v = motion.sample(time)
    ahead, behind = motion.sample(time + step)[1], motion.sample(time - step)[1]
    force = (ahead - behind) / (2 * step) + 0.1 * v + x - 0.6
    force -= np.cos(1.1 * time) + 8 * np.cos(23 * time + 0.4)
    depth = x - 0.1
    spring = 40 * depth + 9 * v
    inside = depth > 1e-5
    sure = np.abs(spring) > 1e-3  # no event within the step
    pushes = inside & sure & (spring > 0)
    lifted = inside & sure & (spring < 0)
    assert pushes.sum() > 1000
    assert lifted.sum() > 100
    np.testing.assert_allclose(force[pushes], -spring[pushes], atol=1e-5)
    np.testing.assert_allclose(force[lifted], 0, atol=1e-5)
    entries = np.count_nonzero((depth[:-1] <= 0) & (depth[1:] > 0))
    assert motion.impact_count > entries + 3


@pytest.mark.parametrize("side", ["upper", "lower"])
def test_two_springs_one_behind_the_other(side):
    """Energy gives the depth and the peaks, quarter waves the times; it comes back as it came."""
    mass, speed, near, far, between = 2.0, 1.5, 50.0, 700.0, 0.1
    sign = 1 if side == "upper" else -1
    motion = thrown(
        Stop(sign * 0.3, KelvinVoigt(near), side),
        Stop(sign * 0.4, KelvinVoigt(far, ends="force"), side),
        mass=mass, speed=speed,
    )  # fmt: skip
    both = near + far
    middle = far * between / both
    swing = sqrt((mass * speed**2 - near * between**2) / both + (between - middle) ** 2)
    deepest = middle + swing
    stored = near * deepest**2 + far * (deepest - between) ** 2
    assert stored == pytest.approx(mass * speed**2)  # the same, by energy alone
    inner = sqrt(speed**2 - near * between**2 / mass)
    omega, fast = sqrt(near / mass), sqrt(both / mass)
    first = atan2(omega * between, inner) / omega
    second = atan2(inner, fast * (between - middle)) / fast
    impacts = motion.impacts
    assert impacts.approach_velocity == pytest.approx([speed, inner], rel=1e-13)
    assert impacts.contact_time == pytest.approx([2 * (first + second), 2 * second], rel=1e-12)
    assert impacts.peak == pytest.approx([near * deepest, far * (deepest - between)], rel=1e-12)
    assert motion.final[1] == pytest.approx(-sign * speed, rel=1e-13)
    assert motion.energy_lost == pytest.approx(0, abs=1e-13)
    turn = 0.3 / speed + first + second
    x, v = motion.sample(turn)
    assert sign * x - 0.3 == pytest.approx(deepest, rel=1e-13)
    assert v == pytest.approx(0, abs=1e-13)


@pytest.mark.parametrize("restitution", [0.0, 0.4, 1.0])
def test_a_rigid_stop_behind_a_spring(restitution):
    """v^2 less k h^2 / m arrives, r^2 of it returns, and the spring gives back what it took."""
    motion = thrown(
        Stop(0.3, KelvinVoigt(50.0)), Stop(0.4, Rigid(restitution)), mass=2.0, speed=1.5
    )
    stored = 50 * 0.1**2 / 2
    arrives = sqrt(1.5**2 - stored)
    assert motion.impacts.approach_velocity == pytest.approx([1.5, arrives], rel=1e-13)
    leaves = sqrt(restitution**2 * arrives**2 + stored)
    assert motion.final[1] == pytest.approx(-leaves, rel=1e-13)
    assert motion.energy_lost == pytest.approx((1 - restitution**2) * arrives**2, abs=1e-13)


def test_what_an_impact_makes_pull_lets_go_at_once():
    """Thrown back by a rigid stop, the mass is free of the damper before it: r times as fast."""
    motion = thrown(Stop(0.3, KelvinVoigt(0.1, 5.0, ends="force")), Stop(0.35, Rigid(1.0)))
    arrives = motion.impacts.approach_velocity[1]
    assert 0.5 < arrives < 0.9
    assert motion.final[1] == pytest.approx(-arrives, rel=1e-14)


@pytest.mark.parametrize("method", [None, impactsig.RungeKutta()])
def test_what_rubs_or_hits_within_a_contact_is_lost_once(method):
    """Thrown into a spring, against the stop behind it and back: all that is missing at the end."""
    free = Oscillator(
        stiffness=0, stops=(Stop(0.3, KelvinVoigt(5.0)), Stop(0.5, Rigid(0.7))),
        friction=Friction(0.1),
    )  # fmt: skip
    motion = impactsig.simulate(free, duration=1.5, initial=(0, 1), method=method)
    assert motion.impact_count == 2
    assert motion.final[1] < 0
    assert motion.energy_lost == pytest.approx(0.5 - motion.final[1] ** 2 / 2, rel=1e-11)


def half(_velocity):
    return 0.5


def softer(velocity):
    return 0.9 / (1 + velocity)


def between(law, other=None):
    """A free mass between two rigid walls."""
    walls = (Stop(1, Rigid(law)), Stop(-1, Rigid(other or law), "lower"))
    return Oscillator(mass=2.0, stiffness=0, stops=walls)


def test_a_constant_function_is_that_number():
    beam = {"damping": 0.06, "forces": Force(0.25, 20.1 / 22.2)}
    number, function = (
        impactsig.simulate(Oscillator(stops=(Stop(1, Rigid(r)),), **beam), periods=200)
        for r in (0.5, half)
    )
    np.testing.assert_array_equal(function.impacts.time, number.impacts.time)
    assert function.final == number.final


def test_a_function_gives_each_impact_its_restitution():
    motion = impactsig.simulate(between(softer, half), duration=100.0, initial=(0.2, 3.0))
    speed = motion.impacts.approach_velocity
    assert len(speed) > 5
    assert speed[0] == 3.0
    for n, (came, went) in enumerate(pairwise(speed)):
        assert went == pytest.approx((half if n % 2 else softer)(came) * came, rel=1e-14)


def test_the_function_is_of_the_velocity_in_the_oscillators_units():
    """And not in those of the forcing, which the engine counts in."""
    walls = (Stop(1, Rigid(softer)),)
    machine = Oscillator(stiffness=0, forces=Force(0.0, 50.0), stops=walls)
    motion = impactsig.simulate(machine, duration=5.0, initial=(0, 2.0))
    assert motion.final[1] == pytest.approx(-2 * softer(2.0), rel=1e-14)


def test_chatter_with_a_function_of_velocity_comes_to_rest_in_time():
    """Under g hops last 2 v / g each, v -> r(v) v: summed here one by one."""

    def firmer(v):
        return 0.5 + 0.3 / (1 + v)

    ball = Oscillator(stiffness=0, load=-1, stops=(Stop(0, Rigid(firmer), "lower"),))
    motion = impactsig.simulate(ball, duration=30.0, initial=(0, 1.0))
    v, time = 1.0, 0.0
    while v > 1e-18:
        time += 2 * v
        v *= firmer(v)
    assert motion.sticks[0, 0] == pytest.approx(time, rel=1e-11)
    assert motion.final[:2] == (0, 0)


def greedy(velocity):
    return 2.0 if velocity < 1 else 0.5


def undecided(velocity):
    return nan if velocity < 1 else 0.5


def stubborn(velocity):
    if velocity < 1:
        raise ValueError("too slow")
    return 0.5


@pytest.mark.parametrize("law", [greedy, undecided, stubborn])
def test_a_law_that_breaks_ends_the_run_with_what_there_was(law):
    motion = impactsig.simulate(between(law), duration=100.0, initial=(0, 3.0))
    assert motion.status == "broken law"
    assert motion.impacts.approach_velocity.tolist() == [3.0, 1.5]
    assert motion.stop == pytest.approx(1 / 3 + 2 / 1.5 + 2 / 0.75, rel=1e-14)
    assert motion.sample(motion.stop)[0] == pytest.approx(1, rel=1e-14)
    assert "broken law" in repr(motion)


def test_a_law_that_numba_cannot_compile_is_refused_by_name():
    def asks(v):
        return input("how much?") * v

    def takes_two(v, w):
        return v * w

    for law, told in ((asks, "input"), (takes_two, "'w'")):
        with pytest.raises(InvalidInput, match=told) as caught:
            impactsig.simulate(between(law), duration=1.0, initial=(0, 3.0))
        assert caught.value.argument == "restitution"
        assert "\n" not in str(caught.value)
