"""The stepping engine against closed forms, forty digits, and the exact engine."""

from __future__ import annotations

from math import atan2, cos, exp, log, pi, sqrt

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import beta, ellipk

import impactsig
from impactsig import BaseMotion, Force, KelvinVoigt, Oscillator, Rigid, Stop, scenes
from impactsig.oscillators import Friction, Hertz
from impactsig.simulation.basis.events import (
    DONE,
    IMPACT,
    PART,
    RELEASE,
    REVERSE,
    STICK,
    TOUCH,
)
from impactsig.simulation.stepping.runge_kutta import FixedStep, RungeKutta
from tests import naive_simulate
from tests.drive import drive

FINE = RungeKutta(1e-13)


def contact(law, *, mass=1.0, speed=1.0, side="upper", method=FINE, duration=20.0):
    """The one contact of a free mass with a soft stop."""
    sign = 1 if side == "upper" else -1
    free = Oscillator(mass=mass, stiffness=0, stops=(Stop(0.5 * sign, law, side),))
    return drive(free, method, duration, 0.0, sign * speed)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.5])
@pytest.mark.parametrize("side", ["upper", "lower"])
def test_an_undamped_hertz_contact(exponent, side):
    """m v dv = -k y^n dy: depth, time 2 y/v B(1/(n+1), 1/2)/(n+1), and no loss."""
    m, k, v, n = 3.0, 1e5, 0.7, exponent
    run = contact(Hertz(k, n), mass=m, speed=v, side=side)
    depth = ((n + 1) * m * v * v / (2 * k)) ** (1 / (n + 1))
    lasts = 2 * depth / v * beta(1 / (n + 1), 0.5) / (n + 1)
    (touch,), (part,) = run.of(TOUCH), run.of(PART)
    assert run.time[touch] == pytest.approx(0.5 / v, rel=1e-13)
    assert run.time[part] - run.time[touch] == pytest.approx(lasts, rel=1e-10)
    assert abs(run.end[1]) == pytest.approx(v, rel=1e-11)
    assert run.state[3] == pytest.approx(0, abs=1e-11)
    peak = run.engine.peaks(run.rows, np.array([touch]), np.array([part]), (0.0, 0.0))
    assert peak[0] == pytest.approx(k * depth**n, rel=1e-10)
    middle = abs(run.at([run.time[touch] + lasts / 2])[0][0]) - 0.5
    assert middle == pytest.approx(depth, rel=1e-9)


def hunt_crossley_exit(loss, v):
    """Speed v' at which a contact ends: L v - ln(1 + L v) = -L v' - ln(1 - L v').

    From m u du / (1 + L u) = -k y^n dy, whose right side is 0 over the contact.
    """
    u = loss * v
    spent = u - log(1 + u)
    return brentq(lambda w: -w - log(1 - w) - spent, 0, 1 - 1e-15, xtol=1e-16) / loss


@pytest.mark.parametrize("speed", [0.01, 1.0, 5.0])
def test_a_hunt_crossley_contact(speed):
    loss = 0.8
    run = contact(Hertz(1e4, damping=loss), speed=speed, duration=2 / speed, method=RungeKutta())
    assert -run.end[1] == pytest.approx(hunt_crossley_exit(loss, speed), rel=1e-8)


@pytest.mark.parametrize("restitution", [0.3, 0.9])
def test_lankarani_and_nikravesh_take_the_velocity_of_the_contact(restitution):
    """Any approach velocity keeps the same share: the loss is 3 (1 - r^2) / 4 of its inverse."""
    factor = 0.75 * (1 - restitution**2)
    for speed in (0.02, 3.0):
        run = contact(Hertz(1e4, restitution=restitution), speed=speed, duration=2 / speed)
        kept = hunt_crossley_exit(factor, 1.0)
        assert -run.end[1] / speed == pytest.approx(kept, rel=1e-9)


@pytest.mark.parametrize("half", [0.05, 0.4, 0.9])
def test_a_stop_that_only_pushes(half):
    """Contact ends at zero force: r = exp(-b / root atan2(2 b root, 2 b^2 - 1)), root^2 = 1 - b^2.

    The mass is then still beyond the stop's place of rest, where it moves freely.
    """
    k = 400.0
    run = contact(KelvinVoigt(k, 2 * half * sqrt(k), ends="force"))
    root = sqrt(1 - half**2)
    expected = exp(-half / root * atan2(2 * half * root, 2 * half**2 - 1))
    assert -run.end[1] == pytest.approx(expected, rel=1e-11)
    (part,) = run.of(PART)
    assert run.x[part] > 0.5
    assert run.v[part] == pytest.approx(-expected, rel=1e-11)


def test_contacts_one_behind_the_other_follow_the_same_law_as_a_function():
    k1, k2 = 50.0, 3000.0

    def law(t, x, v):
        return -k1 * max(x - 1, 0.0) - k2 * max(x - 1.1, 0.0)

    stops = (Stop(1.1, KelvinVoigt(k2)), Stop(1.0, KelvinVoigt(k1)))
    run = drive(Oscillator(stiffness=0, stops=stops), FINE, 3.0, 0.0, 2.0)
    other = drive(Oscillator(stiffness=0, law=law), RungeKutta(1e-12), 3.0, 0.0, 2.0)
    kinds = [TOUCH, TOUCH, PART, PART]
    seen = np.flatnonzero(np.isin(run.kind, kinds))
    assert run.kind[seen].tolist() == kinds
    assert run.stop[seen].tolist() == [1, 0, 0, 1]
    assert run.end[1] == pytest.approx(-2, rel=1e-12)
    assert run.end[0] == pytest.approx(other.end[0], rel=1e-9)
    times = np.linspace(0.4, 1.2, 50)
    assert run.at(times)[0] == pytest.approx(other.at(times)[0], abs=1e-9)
    # The greatest force is that where all energy is in the springs.
    top = brentq(lambda x: k1 * (x - 1) ** 2 + k2 * max(x - 1.1, 0) ** 2 - 4, 1, 3, xtol=1e-15)
    peak = run.engine.peaks(run.rows, seen[:2], seen[[3, 2]], (0.0, 0.0))
    assert peak == pytest.approx([k1 * (top - 1), k2 * (top - 1.1)], rel=1e-10)


def test_friction_takes_two_f_over_k_of_every_swing():
    rubbing = Oscillator(mass=2.0, stiffness=8.0, friction=Friction(0.8))  # f/k = 0.1
    run = drive(rubbing, FINE, 20.0, 1.05, 0.0)
    half = pi / 2
    assert run.time[run.of(REVERSE)] == pytest.approx(half * np.arange(1, 5), rel=1e-12)
    assert run.x[run.of(REVERSE)] == pytest.approx([-0.85, 0.65, -0.45, 0.25], rel=1e-12)
    (stick,) = run.of(STICK)
    assert run.stop[stick] == -1
    assert run.time[stick] == pytest.approx(5 * half, rel=1e-12)
    assert run.end == (pytest.approx(-0.05, abs=1e-12), 0.0)
    lost = run.state[3] * 2.0 * run.engine.omega**2
    assert lost == pytest.approx(4 * (1.05**2 - 0.05**2), rel=1e-12)


@pytest.mark.parametrize("as_law", [False, True])
def test_static_friction_holds_until_the_forcing_exceeds_it(as_law):
    def law(t, x, v):
        return np.sin(2 * t)

    pushed = Oscillator(
        friction=Friction(0.3, 0.5),
        forces=() if as_law else Force(1.0, 2.0, -pi / 2),
        law=law if as_law else None,
    )
    run = drive(pushed, RungeKutta(1e-12), 1.0)
    assert run.kind[1] == STICK
    (release,) = run.of(RELEASE)
    assert run.time[release] == pytest.approx(pi / 12, rel=1e-13)
    # Then x'' + x = sin 2t - 0.3 from rest.
    t0 = pi / 12
    a = np.array([[np.cos(t0), np.sin(t0)], [-np.sin(t0), np.cos(t0)]])
    start = [0.3 + np.sin(2 * t0) / 3, 2 * np.cos(2 * t0) / 3]
    c, s = np.linalg.solve(a, start)
    assert run.end[0] == pytest.approx(
        c * cos(1) + s * np.sin(1) - np.sin(2) / 3 - 0.3, rel=1e-9
    )  # fmt: skip


def test_the_duffing_oscillator_has_its_period():
    """x'' + x + b x^3 = 0 from rest at A: 4 K(m) / sqrt(1 + b A^2), 2 m = b A^2 / (1 + b A^2)."""
    b, amplitude = 3.0, 1.7

    def law(t, x, v):
        return -b * x**3

    stiff = 1 + b * amplitude**2
    period = 4 * ellipk(b * amplitude**2 / (2 * stiff)) / sqrt(stiff)
    run = drive(Oscillator(law=law), RungeKutta(1e-13), 10 * period, amplitude, 0.0)
    assert run.end[0] == pytest.approx(amplitude, rel=1e-10)
    assert run.end[1] == pytest.approx(0, abs=1e-9)
    x, _ = run.at(period * np.array([7.25, 0.25, 3.5]))
    assert x == pytest.approx([0, 0, -amplitude], abs=1e-9)


def exact_impacts(oscillator, duration, **options):
    motion = impactsig.simulate(oscillator, duration=duration, **options)
    return motion, motion.impacts.time, motion.impacts.approach_velocity


SCENES = {
    "beam": (scenes.karpodinis(22.1), 0.0, 0.0),
    "soft moving stop": (scenes.okolewski(3, 0.6, "soft", stop_stiffness=2000.0), 0.001, 0.0),
    "chatter on a moving stop": (scenes.okolewski(3, 0.6), 0.005, 0.0),
    "two sides, two forces": (
        Oscillator(
            damping=0.2,
            load=0.3,
            forces=(Force(1.0, 1.3, 0.4), Force(0.7, 2.9)),
            stops=(Stop(0.4, Rigid(0.7)), Stop(-0.5, KelvinVoigt(300.0, 4.0), "lower")),
        ),
        0.1,
        0.3,
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_linear_scenes_are_those_of_the_exact_engine(name):
    oscillator, x, v = SCENES[name]
    base, omega = oscillator.base, oscillator.angular_forcing_frequency
    duration = 12 * 2 * pi / omega
    motion, time, approach = exact_impacts(
        oscillator, duration * oscillator.time_unit, initial=(x, v), phase=0.6
    )
    moving = base is not None and base.stops
    at = base.amplitude * cos(0.6 + base.phase) if moving else 0.0
    rate = -base.amplitude * base.angular_frequency * np.sin(0.6 + base.phase) if moving else 0.0
    run = drive(oscillator, FINE, duration, x - at, v - rate, phase=0.6)
    assert run.status == DONE
    hits = np.flatnonzero(np.isin(run.kind, (IMPACT, TOUCH)))
    assert len(time) == len(hits) > 5
    assert run.time[hits] * oscillator.time_unit == pytest.approx(time, rel=1e-9)
    assert run.approach[hits] == pytest.approx(approach, rel=1e-7, abs=1e-9 * approach.max())
    assert len(motion.sticks) == len(run.of(STICK))
    assert run.state[3] * oscillator.mass * run.engine.omega**2 == pytest.approx(
        motion.energy_lost, rel=1e-8
    )
    times = np.random.default_rng(1).uniform(0, duration, 200)
    q, u = run.at(times)
    if moving:
        angle = base.angular_frequency * times + 0.6 + base.phase
        q = q + base.amplitude * np.cos(angle)
        u = u - base.amplitude * base.angular_frequency * np.sin(angle)
    expected, velocity = motion.sample(times * oscillator.time_unit)
    assert q == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())
    near = np.abs(u - velocity) > 1e-6 * np.abs(velocity).max()
    assert near.sum() == 0


def test_a_law_knows_the_time_since_the_start_and_the_ground():
    """Spring, damper and one of two forces as a law, beside stops that move."""
    base = BaseMotion(0.3, 2.0, 0.2, spring=False, damper=False, stops=True)
    stops = (Stop(0.5, Rigid(0.7)), Stop(-0.6, Rigid(0.5), "lower"))
    phase, late = 0.7, 0.7 / 2.7
    linear = Oscillator(
        mass=2.0, damping=0.2, forces=(Force(2.0, 2.7), Force(0.5, 1.3)), base=base, stops=stops
    )

    def law(t, x, v):
        return -x - 0.2 * v + 0.5 * np.cos(1.3 * (t + late))

    by_law = Oscillator(
        mass=2.0, stiffness=0, forces=Force(2.0, 2.7), base=base, stops=stops, law=law
    )
    angle = 2.0 * late + 0.2
    x, v = 0.1 - 0.3 * cos(angle), 0.6 * np.sin(angle)
    _, time, approach = exact_impacts(linear, 30.0, initial=(0.1, 0.0), phase=phase)
    for oscillator in (linear, by_law):
        run = drive(oscillator, FINE, 30.0, x, v, phase=phase)
        hits = run.of(IMPACT)
        assert run.time[hits][:12] == pytest.approx(time[:12], abs=1e-7)
        assert run.approach[hits][:12] == pytest.approx(approach[:12], abs=1e-6)


CHAOS = Oscillator(damping=0.1, forces=Force(9.435, 2.7), stops=(Stop(1, Rigid(0.8)),))


def test_impacts_of_a_chaotic_run_converge_with_the_tolerance():
    machine = naive_simulate.one_sided(0.05, 9.435, 2.7, restitution=0.8)
    truth = np.array([float(t) for t in naive_simulate.impacts(machine, 10)[0]])
    error = []
    for tolerance in (1e-8, 1e-10, 1e-13):
        run = drive(CHAOS, RungeKutta(tolerance), 60.0)
        error.append(np.abs(run.time[run.of(IMPACT)][:10] - truth).max())
    assert error[1] < error[0] / 10
    assert error[2] < error[1] / 10
    assert error[2] < 1e-10
    run = drive(CHAOS, FixedStep(3000), 60.0)
    assert run.time[run.of(IMPACT)][:10] == pytest.approx(truth, abs=1e-8)


def test_the_classical_steps_are_of_order_four():
    swing = Oscillator(damping=0.1, forces=Force(1.0, 1.7))
    end = impactsig.simulate(swing, periods=10, initial=(0.3, 0.2)).final[:2]
    error = []
    for steps in (40, 80, 160):
        run = drive(swing, FixedStep(steps), 10 * 2 * pi / 1.7, 0.3, 0.2)
        error.append(np.hypot(run.end[0] - end[0], run.end[1] - end[1]))
    assert np.log2(np.divide(error[:-1], error[1:])) == pytest.approx([4, 4], abs=0.15)


@pytest.mark.parametrize("beyond", [1e-9, -1e-9])
def test_grazing_is_decided(beyond):
    """The steady response with a crest that is a billionth too high, or too low, for the stop."""
    omega, damping = 2.2, 0.1
    size = 1 / np.hypot(1 - omega**2, damping * omega)
    response = 1 / complex(1 - omega**2, damping * omega)
    start = (response.real, -omega * response.imag)
    graze = Oscillator(
        damping=damping, forces=Force(1.0, omega), stops=(Stop(size * (1 - beyond), Rigid(0.5)),)
    )
    run = drive(graze, FINE, 2.9, *start)
    assert len(run.of(IMPACT)) == (beyond > 0)


def test_a_moment_after_rest_where_forces_cancel():
    """a = A w t at first: their rounding is no error of a step. x = A w t^3 / 6."""
    force, stop = Force(1.0, 0.9, -pi / 2), Stop(0.0, Hertz(1e4, restitution=0.5))
    machine = Oscillator(damping=0.1, forces=(force,), stops=(stop,))
    motion = impactsig.simulate(machine, periods=1e-9)
    assert motion.status == "complete"
    assert motion.final[0] == pytest.approx(0.9 * motion.stop**3 / 6, rel=1e-6)
