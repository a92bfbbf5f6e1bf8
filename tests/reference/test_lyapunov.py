"""Lyapunov exponents and tangent maps against closed forms and published values."""

from __future__ import annotations

import math

import numpy as np
import pytest

import impactsig
from impactsig import (
    Flow,
    Force,
    Friction,
    Hertz,
    KelvinVoigt,
    Oscillator,
    Rigid,
    RungeKutta,
    Stop,
    flows,
    scenes,
)
from tests import naive


def one_impact_multipliers(omega, damping=0.03, amplitude=0.25, restitution=0.2):
    """Period and multipliers of Shaw's and Holmes' orbit: S exp(A T), A and S by hand."""
    period = 2 * math.pi / omega
    speed = naive.one_impact_orbit(omega)
    damped = math.sqrt(1 - damping**2)
    c, s = math.cos(damped * period), math.sin(damped * period) / damped
    flow = math.exp(-damping * period) * np.array([[c + damping * s, s], [-s, c - damping * s]])
    # The impact's phase, from what is left of the velocity: x - free is the forced response.
    response = amplitude / complex(1 - omega**2, 2 * damping * omega)
    gain = np.linalg.solve(flow - np.eye(2), [0, (1 + restitution) * speed])
    forced = complex(1 - gain[0], -(-restitution * speed - gain[1]) / omega)
    phase = np.angle(forced / response)
    push = amplitude * math.cos(phase) - 1
    before, after = push - 2 * damping * speed, push + 2 * damping * restitution * speed
    saltation = np.array(
        [[-restitution, 0], [(after + restitution * before) / speed, -restitution]]
    )
    return period, np.linalg.eigvals(saltation @ flow)


def test_the_exponents_of_a_period_one_orbit_are_its_multipliers():
    period, multipliers = one_impact_multipliers(naive.frequency_ratio(22.1))
    closed = np.sort(np.log(np.abs(multipliers)) / period)[::-1]
    beam = scenes.karpodinis(22.1)
    found = impactsig.lyapunov_spectrum(beam, periods=20_000, transient=2000)
    spread = 0 if np.isreal(multipliers).all() else 3 / (20_000 * period)
    assert found.exponents == pytest.approx(closed, abs=1e-9 + spread)
    assert found.per_second == pytest.approx(found.exponents / beam.time_unit, rel=1e-15)
    motion = impactsig.simulate(beam, periods=1, transient=2000)
    once = impactsig.tangent_map(beam, periods=1, initial=motion.final[:2])
    order = np.argsort(-np.abs(multipliers))
    assert once.multipliers == pytest.approx(multipliers[order], rel=1e-10)


@pytest.mark.parametrize("zeta", [0.0, 0.03, 0.4])
@pytest.mark.parametrize("restitution", [0.2, 0.8, 1.0])
def test_one_impact_shrinks_areas_by_the_restitution_squared_and_the_damping(zeta, restitution):
    machine = Oscillator(
        damping=2 * zeta, forces=Force(1.3, 0.8), stops=Stop(0.9, Rigid(restitution))
    )
    motion = impactsig.simulate(machine, periods=40)
    time = motion.impacts.time
    n = int(np.argmax(np.diff(time)[:-1]))
    start, end = (time[n : n + 2] + time[n + 1 : n + 3]) / 2
    found = impactsig.tangent_map(
        machine,
        duration=end - start,
        initial=motion.sample(start),
        phase=0.8 * start,
    )
    closed = restitution**2 * math.exp(-2 * zeta * (end - start))
    assert math.exp(found.log_determinant) == pytest.approx(closed, rel=1e-12)
    assert np.linalg.det(found.matrix) == pytest.approx(closed, rel=1e-12)


@pytest.mark.parametrize("stop", ["hard", "soft"])
@pytest.mark.parametrize("eta", [2.0, 3.0, 4.0, 5.5, 8.0, 10.0])
def test_okolewski_exponents_without_loss_add_up_to_the_damping(eta, stop):
    """Printed to six digits; at 4 and 8 the multipliers are complex and the limits equal."""
    found = impactsig.lyapunov_spectrum(scenes.okolewski(eta, 1.0, stop), periods=4000)
    assert found.sum == pytest.approx(-0.23, abs=1e-9)
    assert found.expected_sum == pytest.approx(-0.23, abs=1e-12)
    if eta in (4.0, 8.0):
        length = found.time[-1]
        assert abs(np.diff(found.exponents)[0]) < 20 / length
        assert found.exponents == pytest.approx([-0.115, -0.115], abs=20 / length)


def test_the_exponents_of_the_chaotic_beam():
    """The thesis' scene at 20.3355 Hz: 0.0204 and -0.3375."""
    beam = scenes.karpodinis(20.3355)
    found = impactsig.lyapunov_spectrum(beam, periods=200_000)
    assert found.error.max() < 3e-4
    assert found.exponents == pytest.approx([0.0204, -0.3375], abs=1e-3)
    rate = found.impacts / found.time[-1]
    assert found.sum == pytest.approx(-0.06 + rate * math.log(0.04), abs=1e-11)
    assert found.expected_sum == pytest.approx(found.sum, abs=1e-11)
    assert found.impacts / 200_000 == pytest.approx(0.548, abs=0.003)


def test_the_error_by_batch_means_is_that_of_repeated_runs():
    beam = scenes.karpodinis(20.1)
    runs = [
        impactsig.lyapunov_spectrum(beam, periods=4000, phase=float(phase), transient=300)
        for phase in range(40)
    ]
    scatter = np.std([run.exponents for run in runs], axis=0, ddof=1)
    told = np.mean([run.error for run in runs], axis=0)
    assert np.all((told / scatter > 0.6) & (told / scatter < 2))


def test_a_stick_to_a_rigid_stop_leaves_nothing_of_the_neighbours():
    scene = scenes.okolewski(3, 0.6)
    found = impactsig.lyapunov_spectrum(scene, periods=400)
    motion = impactsig.simulate(scene, periods=400, transient=40)
    assert np.all(found.exponents == -math.inf)
    assert found.expected_sum == -math.inf
    assert found.collapses == motion.stick_count > 90
    sticks = motion.sticks[:, 0] if motion.sticks[0, 0] > motion.start else motion.sticks[1:, 0]
    assert found.collapse_time == pytest.approx(sticks, rel=1e-12)
    assert set(found.collapse_dimensions) == {0}
    assert np.isfinite(found.between_collapses).all()
    assert "2 of 2 directions vanish" in found.describe()


def test_friction_that_holds_leaves_one_direction():
    """The displacement at rest; it goes on with the motion, so the first exponent is finite."""
    machine = Oscillator(damping=0.1, forces=Force(1.0, 0.3), friction=Friction(0.5, 0.6))
    found = impactsig.lyapunov_spectrum(machine, periods=300)
    assert found.exponents[1] == -math.inf
    assert math.isfinite(found.exponents[0])
    assert set(found.collapse_dimensions) == {1}
    # One period's map has rank one, and its one multiplier is the exponent.
    motion = impactsig.simulate(machine, periods=1, transient=300)
    once = impactsig.tangent_map(machine, periods=1, initial=motion.final[:2])
    assert once.multipliers[1] == 0
    period = machine.forcing_period
    assert math.log(abs(once.multipliers[0])) / period == pytest.approx(
        found.exponents[0], rel=1e-6
    )


@pytest.mark.parametrize(
    ("machine", "left"),
    [
        (Oscillator(damping=0.1, forces=Force(0.2, 0.3), friction=Friction(0.5)), 1),
        (Oscillator(load=3.0, forces=Force(0.2, 0.3), stops=Stop(0.4, Rigid(0.5))), 0),
    ],
)
def test_what_is_held_for_ever_differs_for_ever_or_not_at_all(machine, left):
    """Friction keeps a difference of displacement as it is, a rigid stop none."""
    found = impactsig.lyapunov_spectrum(machine, periods=50, transient=20)
    assert found.exponents == pytest.approx([0.0, -math.inf] if left else [-math.inf] * 2)
    assert found.collapses == 1
    assert list(found.collapse_dimensions) == [left]


def test_an_impact_without_rebound_leaves_the_instant_of_the_next():
    machine = Oscillator(damping=0.1, forces=Force(1.0, 0.7), stops=Stop(0.3, Rigid(0.0)))
    found = impactsig.lyapunov_spectrum(machine, periods=300)
    assert found.exponents[1] == -math.inf
    assert found.collapses >= found.impacts


@pytest.mark.parametrize(
    ("damping", "stiffness", "closed"),
    [
        (0.2, 1.0, [-0.1, -0.1]),
        (2.0, 1.0, [-1.0, -1.0]),
        (2.5, 1.0, [-0.5, -2.0]),
        (40.0, 3.0, [-20 + math.sqrt(397), -20 - math.sqrt(397)]),
        (0.3, 0.0, [0.0, -0.3]),
    ],
)
def test_without_events_the_exponents_are_the_eigenvalues(damping, stiffness, closed):
    """In spans of any length: what is fast must not be lost beside what is slow."""
    machine = Oscillator(damping=damping, stiffness=stiffness, forces=Force(1.0, 0.7))
    found = impactsig.lyapunov_spectrum(machine, periods=30_000)
    slack = 1e-3 if closed[0] == closed[1] else 1e-10
    assert found.exponents == pytest.approx(closed, abs=slack, rel=1e-12)
    assert found.sum == pytest.approx(-damping, rel=1e-11)
    assert found.collapses == 0


def test_the_stepped_exponents_are_the_exact_ones():
    """Of periodic orbits, on which both methods meet; with and without a linear `law`."""
    omega = naive.frequency_ratio(22.1)
    period, multipliers = one_impact_multipliers(omega)
    closed = np.sort(np.log(np.abs(multipliers)) / period)[::-1]
    beam = scenes.karpodinis(22.1)
    stepped = impactsig.lyapunov_spectrum(
        beam, periods=500, transient=500, method=RungeKutta(1e-12)
    )
    spread = 0 if np.isreal(multipliers).all() else 3 / (500 * period)
    assert stepped.exponents == pytest.approx(closed, abs=1e-8 + spread)
    half = Oscillator(
        damping=0.03,
        stiffness=0.4,
        forces=Force(0.25, omega),
        stops=Stop(1.0, Rigid(0.2)),
        law=lambda t, x, v: -0.6 * x - 0.03 * v,
    )
    with_law = impactsig.lyapunov_spectrum(half, periods=500, transient=500)
    assert with_law.exponents == pytest.approx(closed, abs=1e-6 + spread)
    assert with_law.sum == pytest.approx(np.log(np.abs(np.prod(multipliers))) / period, abs=1e-8)


@pytest.mark.parametrize("law", [Hertz(300.0, damping=0.4), KelvinVoigt(300.0, 6.0)])
def test_the_sum_is_the_mean_divergence(law):
    machine = Oscillator(damping=0.1, forces=Force(1.0, 0.7), stops=Stop(0.2, law))
    found = impactsig.lyapunov_spectrum(machine, periods=300, method=RungeKutta(1e-10))
    assert found.sum == pytest.approx(found.expected_sum, abs=1e-8)
    assert found.sum < -0.1


@pytest.mark.parametrize("duration", [2000, pytest.param(8000, marks=pytest.mark.slow)])
def test_lorenz_exponents_are_the_published_ones(duration):
    """0.906, 0, -14.572 (Sprott); the divergence is -sigma - 1 - beta everywhere."""
    found = impactsig.lyapunov_spectrum(flows.lorenz(), duration=duration)
    assert found.sum == pytest.approx(-(10 + 1 + 8 / 3), abs=1e-9)
    assert found.exponents == pytest.approx([0.9056, 0.0, -14.5723], abs=0.72 / math.sqrt(duration))
    assert abs(found.exponents[1]) < 3 * found.error[1] + 1e-4
    assert found.kaplan_yorke_dimension == pytest.approx(2.062, abs=0.09 / math.sqrt(duration))


@pytest.mark.parametrize("duration", [5000, pytest.param(20_000, marks=pytest.mark.slow)])
def test_rossler_exponents_are_the_published_ones(duration):
    """0.0714, 0, -5.3943 (Sprott)."""
    found = impactsig.lyapunov_spectrum(flows.rossler(), duration=duration)
    assert found.exponents == pytest.approx([0.0714, 0.0, -5.3943], abs=0.85 / math.sqrt(duration))
    assert found.sum == pytest.approx(found.expected_sum, abs=1e-8)


def shear(t, y, a, b, c):
    return a * y[0] + 3.0 * y[1], b * y[1] - y[2], c * y[2]


def test_a_linear_flow_has_its_eigenvalues():
    flow = Flow(shear, initial=(1e-3, 1.0, -2.0), parameters=(0.02, -0.5, -7.0))
    found = impactsig.lyapunov_spectrum(flow, duration=200, transient=30)
    assert found.exponents == pytest.approx([0.02, -0.5, -7.0], abs=1e-7)
    assert found.status == "complete"


def explode(t, y):
    return (y[0] ** 2,)


def test_a_flow_that_diverges_says_so():
    found = impactsig.lyapunov_spectrum(Flow(explode, initial=(1.0,)), duration=3, transient=0)
    assert found.status == "diverged"
    assert len(found.time) < 64
