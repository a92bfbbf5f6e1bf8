"""Kelvin-Voigt stops: free contacts in closed form, the hard limit, the published rate."""

from __future__ import annotations

from math import exp, pi, sqrt

import numpy as np
import pytest

import impactsig
from impactsig import Force, Hertz, KelvinVoigt, Oscillator, Rigid, Stop, scenes
from impactsig.impacts import OPEN_END


def contact(law, *, mass=1.0, speed=1.0, side="upper"):
    """The one contact of a free mass with a soft stop."""
    sign = 1 if side == "upper" else -1
    free = Oscillator(mass=mass, stiffness=0, stops=(Stop(0.5 * sign, law, side),))
    return impactsig.simulate(free, duration=20.0, initial=(0, sign * speed))


@pytest.mark.parametrize("restitution", [1e-3, 0.2, 0.85, 1.0])
@pytest.mark.parametrize("stiffness", [1e2, 1e4, 1e8, 1e12])
@pytest.mark.parametrize("side", ["upper", "lower"])
def test_the_equivalent_stop_returns_its_restitution(restitution, stiffness, side):
    motion = contact(KelvinVoigt.equivalent(restitution, stiffness, 3.0), mass=3.0, side=side)
    assert abs(motion.final[1]) == pytest.approx(restitution, rel=1e-12)
    assert motion.energy_lost == pytest.approx(1.5 * (1 - restitution**2), abs=1e-11)
    assert motion.impact_count == 1


def test_an_undamped_contact_is_half_a_sine():
    motion = contact(KelvinVoigt(400.0), mass=4.0, speed=0.3)
    assert motion.impacts.time[0] == pytest.approx(0.5 / 0.3, rel=1e-14)
    assert motion.impacts.contact_time[0] == pytest.approx(pi / 10, rel=1e-13)
    assert motion.impacts.peak[0] == pytest.approx(0.3 * sqrt(400 * 4), rel=1e-13)
    assert motion.impacts.flags[0] == 0


def test_the_peak_of_a_strongly_damped_contact_is_its_first_touch():
    motion = contact(KelvinVoigt(1.0, 1.99), speed=0.7)
    assert motion.impacts.peak[0] == pytest.approx(1.99 * 0.7, rel=1e-12)


def test_an_overdamped_stop_is_not_left():
    """y = v t exp(-t) at critical damping, and y = v (e^(-t/2) - e^(-2t)) / 1.5 beyond it."""
    for damping, depth in (
        (2.0, lambda t: t * exp(-t)),
        (2.5, lambda t: (exp(-t / 2) - exp(-2 * t)) / 1.5),
    ):
        motion = contact(KelvinVoigt(1.0, damping))
        assert motion.impacts.flags[0] == OPEN_END
        assert motion.impacts.contact_time[0] == pytest.approx(19.5, rel=1e-14)
        for after in (0.01, 1.0, 5.0):
            x, _ = motion.sample(0.5 + after)
            assert x - 0.5 == pytest.approx(depth(after), rel=1e-12, abs=1e-15)


def test_near_critical_damping_the_forms_meet():
    depth = [
        contact(KelvinVoigt(1.0, 2 + e)).sample(3.0)[0] for e in (-1e-7, -1e-12, 0, 1e-12, 1e-7)
    ]
    assert np.diff(depth) == pytest.approx(
        1e-7 * np.array([1 - 1e-5, 1e-5, 1e-5, 1 - 1e-5]) * (depth[4] - depth[0]) / 2e-7, abs=3e-15
    )


def test_okolewski_soft_stop_is_hit_nine_times_in_four_periods():
    motion = impactsig.simulate(scenes.okolewski(3, 0.6, "soft"), periods=400, transient=1000)
    assert motion.impacts_per_period == pytest.approx(2.25, abs=1e-12)
    assert motion.stick_count == 0
    assert motion.impacts.contact_time.min() > 0


def test_a_stiff_stop_becomes_a_rigid_one():
    """The contact time, and with it the difference, falls with the square root of the stiffness."""
    force = Force(0.25, 22.1 / 22.2)
    hard = impactsig.simulate(
        Oscillator(damping=0.06, forces=force, stops=(Stop(1, Rigid(0.2)),)),
        periods=20, transient=2000,
    )  # fmt: skip
    error = []
    for stiffness in (1e6, 1e8, 1e10, 1e12):
        law = KelvinVoigt.equivalent(0.2, stiffness)
        soft = impactsig.simulate(
            Oscillator(damping=0.06, forces=force, stops=(Stop(1, law),)),
            periods=20,
            transient=2000,
        )
        error.append(np.mean(soft.impacts.approach_velocity) - hard.impacts.approach_velocity[0])
    order = np.diff(np.log(np.abs(error))) / np.log(100)
    assert order == pytest.approx(-0.5, abs=0.01)


def test_contacts_agree_with_a_small_step():
    """Two soft stops and two forcings, against scipy's eighth order with events."""
    from scipy.integrate import solve_ivp

    laws = (KelvinVoigt(300.0, 2.0), KelvinVoigt(90.0, 0.0))
    machine = Oscillator(
        mass=2.0, damping=0.1, stiffness=3.0, load=0.4,
        forces=(Force(4.0, 1.7, 0.3), Force(2.0, 2.9)),
        stops=(Stop(0.6, laws[0]), Stop(-0.5, laws[1], "lower")),
    )  # fmt: skip
    motion = impactsig.simulate(machine, duration=20.0, initial=(0.1, -0.2), phase=0.5)

    def rate(t, y):
        force = 4 * np.cos(1.7 * t + 0.5 + 0.3) + 2 * np.cos(2.9 * (t + 0.5 / 1.7)) + 0.4
        force -= 0.1 * y[1] + 3 * y[0]
        if y[0] > 0.6:
            force -= 300 * (y[0] - 0.6) + 2 * y[1]
        elif y[0] < -0.5:
            force -= 90 * (y[0] + 0.5)
        return y[1], force / 2

    def upper(t, y):
        return y[0] - 0.6

    def lower(t, y):
        return -0.5 - y[0]

    upper.direction = lower.direction = 1
    slow = solve_ivp(
        rate, (0, 20), (0.1, -0.2), method="DOP853", rtol=1e-10, atol=1e-12, max_step=2e-3,
        events=(upper, lower),
    )  # fmt: skip
    touches = np.sort(np.concatenate(slow.t_events))
    assert motion.impact_count == len(touches) > 10
    np.testing.assert_allclose(motion.impacts.time, touches, atol=1e-5)
    x, _ = motion.sample(slow.t)
    np.testing.assert_allclose(x, slow.y[0], atol=1e-5)


@pytest.mark.parametrize("case", ["spring", "damper", "both", "moving stops"])
def test_a_moving_base_pulls_through_spring_and_damper(case):
    """Against the transmissibility, and against a force that does the same."""
    from impactsig import BaseMotion

    spring, damper = case != "damper", case in ("damper", "both", "moving stops")
    base = BaseMotion(0.3, 1.4, 0.2, spring=spring, damper=damper, stops=case == "moving stops")
    machine = Oscillator(mass=2, damping=0.5, stiffness=3, base=base, stops=(Stop(9, Rigid(0.5)),))
    motion = impactsig.simulate(machine, periods=3, transient=100)
    w = 1.4
    ratio = (3 * spring + 1j * w * 0.5 * damper) / (3 - 2 * w * w + 1j * w * 0.5)
    time = np.linspace(motion.start, motion.stop, 50)
    expected = ratio * 0.3 * np.exp(1j * (w * time + 0.2))
    x, v = motion.sample(time)
    np.testing.assert_allclose(x, expected.real, atol=1e-12)
    np.testing.assert_allclose(v, (1j * w * expected).real, atol=1e-12)


# -- from rest at the stop -------------------------------------------------------------------------

ENGINES = [None, impactsig.RungeKutta(), impactsig.FixedStep(3000)]
SPRING, ROOT = KelvinVoigt(5.0), sqrt(5)


@pytest.mark.parametrize("method", ENGINES)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_force_that_begins_as_a_sine_presses_on_a_stop_once(method, sign):
    """x'' + 5 x = 0.4 sin t from rest: 0.1 (sin t - sin(sqrt 5 t) / sqrt 5)."""
    stop = Stop(0.0, SPRING, "upper" if sign > 0 else "lower")
    pressed = Oscillator(stiffness=0, forces=(Force(0.4 * sign, 1, phase=-pi / 2),), stops=(stop,))
    motion = impactsig.simulate(pressed, duration=4, method=method)
    assert motion.impact_count == 1
    assert motion.impacts.time[0] == 0
    time = np.linspace(0.1, 1.5, 9)
    x, v = motion.sample(time)
    np.testing.assert_allclose(
        x, 0.1 * sign * (np.sin(time) - np.sin(ROOT * time) / ROOT), atol=1e-9
    )
    np.testing.assert_allclose(v, 0.1 * sign * (np.cos(time) - np.cos(ROOT * time)), atol=1e-9)


@pytest.mark.parametrize("method", ENGINES)
@pytest.mark.parametrize("place", [0.0, 0.3, -0.7])
def test_a_force_that_begins_as_a_square_of_time_presses_on_a_stop_once(method, place):
    """y'' + 5 y = 0.4 (1 - cos 1.5 t) of y = x - place, from rest."""
    stops = (Stop(place, KelvinVoigt(4.0)),)
    pressed = Oscillator(load=0.4 + place, forces=(Force(-0.4, 1.5),), stops=stops)
    w = 1.5
    motion = impactsig.simulate(pressed, duration=1.5, initial=(place, 0), method=method)
    assert motion.impact_count == 1
    assert motion.impacts.time[0] < 1e-6  # the push is less than rounding for as long
    time = np.linspace(0.2, 1.5, 9)
    x, _ = motion.sample(time)
    a = 0.4 / (5 - w * w)
    expected = 0.08 - a * np.cos(w * time) + (a - 0.08) * np.cos(ROOT * time)
    np.testing.assert_allclose(x - place, expected, atol=1e-9)


@pytest.mark.parametrize("method", ENGINES[:2])
@pytest.mark.parametrize(
    "law", [KelvinVoigt(5.0), KelvinVoigt(5.0, 0.3), KelvinVoigt(5.0, 0.3, "force"), Hertz(5.0)]
)
@pytest.mark.parametrize(("stiffness", "place"), [(1.0, 0.0), (0.0, 0.0), (0.7, 0.3), (1.9, -0.7)])
def test_a_mass_at_rest_where_a_stop_begins_stays_there(method, law, stiffness, place):
    """Its weight is borne by the spring but for rounding."""
    mass = Oscillator(stiffness=stiffness, load=stiffness * place, stops=(Stop(place, law),))
    motion = impactsig.simulate(mass, duration=30, initial=(place, 0), method=method)
    assert motion.status == "complete"
    assert motion.impact_count < 30
    assert motion.final[:2] == pytest.approx((place, 0), abs=1e-14)
