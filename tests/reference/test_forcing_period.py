"""The forcing period under several frequencies, and all that is counted by it."""

from __future__ import annotations

import math

import numpy as np
import pytest

import impactsig
from impactsig import (
    OGY,
    BaseMotion,
    Controlled,
    FixedStep,
    Flow,
    Force,
    Hertz,
    InvalidInput,
    Oscillator,
    Rigid,
    RungeKutta,
    Stop,
    basins_of_attraction,
    bifurcation_diagram,
    continue_orbit,
    find_periodic_orbit,
    find_periodic_orbits,
    lyapunov_spectrum,
    orbit_period,
    periodicity_chart,
    simulate,
)

FAR = (Stop(50.0, Rigid(0.7)),)
NEAR = (Stop(1.0, Rigid(0.7)),)
DAMPING = 0.06
PAIR = (Force(0.5, 0.9), Force(0.2, 0.45, 0.3))


def machine(forces=PAIR, stops=FAR, **rest):
    return Oscillator(damping=DAMPING, forces=forces, stops=stops, **rest)


def steady(forces, time):
    """Displacement and velocity of the steady response without contact, in closed form."""
    x = v = 0.0
    for force in forces:
        w = force.angular_frequency
        response = force.amplitude * np.exp(1j * force.phase) / complex(1 - w * w, DAMPING * w)
        turned = response * np.exp(1j * w * np.asarray(time))
        x, v = x + turned.real, v + (1j * w * turned).real
    return x, v


# -- the period itself -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("frequencies", "expected"),
    [
        ((0.9,), 0.9),
        ((0.9, 0.9), 0.9),
        ((0.9, 2.7), 0.9),
        ((0.9, 0.45), 0.45),
        ((0.2, 0.3), 0.1),
        ((1.0, 3 / 4, 7 / 2), 1 / 4),
        ((2 * math.pi * 20, 2 * math.pi * 50), 2 * math.pi * 10),
        ((0.9, 0.9 / 8), 0.9 / 8),
        ((0.9, 0.9 / 9), None),
        ((1.0, 3 / 4, 5 / 6), None),
        ((0.9, 0.9 * math.sqrt(2)), None),
        ((0.9, 0.45 * (1 + 1e-10)), None),
        ((1.0, 3 / 25, 5 / 9), None),
    ],
)
def test_the_period_is_the_least_common_one(frequencies, expected):
    oscillator = machine(tuple(Force(0.1, w) for w in frequencies))
    on_base = machine(
        tuple(Force(0.1, w) for w in frequencies[:-1]), base=BaseMotion(0.1, frequencies[-1])
    )
    for one in (oscillator, on_base):
        assert one.forcing_recurs == (expected is not None)
        found = frequencies[0] if expected is None else expected
        assert one.angular_forcing_frequency == pytest.approx(found, rel=1e-14)
        assert one.forcing_period == pytest.approx(2 * math.pi / found, rel=1e-14)


def still(t, x, v):
    return -0.1 * x**3


def parametric(t, x, v):
    return -0.1 * math.cos(1.8 * t) * x


def subharmonic(t, x, v):
    return -0.1 * math.cos(0.3 * t) * x


def apart(t, x, v):
    return 0.1 * math.cos(math.sqrt(2) * t)


def wearing(t, x, v):
    return -0.1 * (1 + 1e-3 * t) * x


def square(t, x, v):
    return 0.1 if math.sin(0.9 * t) > 0 else -0.1


def raising(t, x, v):
    raise ValueError


@pytest.mark.parametrize(
    ("law", "timed", "expected"),
    [
        (still, False, 0.9),
        (parametric, True, 0.9),
        (square, True, 0.9),
        (subharmonic, True, 0.3),
        (apart, True, None),
        (wearing, True, None),
        (raising, True, None),
    ],
)
def test_a_law_has_a_share_in_the_period(law, timed, expected):
    oscillator = machine((Force(0.5, 0.9),), law=law)
    assert oscillator.law_depends_on_time == timed
    assert oscillator.forcing_recurs == (expected is not None)
    assert oscillator.angular_forcing_frequency == pytest.approx(expected or 0.9, rel=1e-14)


def test_without_forcing_there_is_no_period():
    free = Oscillator()
    assert (free.forcing_period, free.forcing_recurs, free.law_depends_on_time) == (
        None, False, False,
    )  # fmt: skip


# -- motions ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", [None, RungeKutta(1e-12), FixedStep(3000)])
def test_motions_are_counted_by_it(method):
    motion = simulate(machine(), periods=3, transient=120, phase=0.7, method=method)
    period = 2 * math.pi / 0.45
    assert motion.duration == pytest.approx(3 * period, rel=1e-13)
    assert motion.final[2] == pytest.approx(0.7, abs=1e-12)
    time = np.linspace(motion.start, motion.stop, 40)
    for got, expected in zip(motion.sample(time), steady(PAIR, time + 0.7 / 0.45), strict=True):
        np.testing.assert_allclose(got, expected, atol=1e-9)
    x, _ = motion.stroboscopic(2.0)
    np.testing.assert_allclose(x, steady(PAIR, 2.0 / 0.45)[0], atol=1e-9)
    assert len(x) == 3


def test_a_motion_goes_on_from_where_it_ended():
    """After one period of the faster force the slower one is half way round."""
    oscillator = machine(stops=NEAR)
    whole = simulate(oscillator, duration=40.0)
    first = simulate(oscillator, duration=2 * math.pi / 0.9)
    x, v, phase = first.final
    rest = simulate(oscillator, duration=40.0 - first.duration, initial=(x, v), phase=phase)
    assert phase == pytest.approx(math.pi)
    assert rest.final == pytest.approx(whole.final, abs=1e-9)


def test_a_spectrum_has_the_lines_of_all_forces():
    motion = simulate(machine(), periods=32, transient=120)
    found = motion.power_spectrum()
    assert found.rate == pytest.approx(128 * 0.9 / (2 * math.pi))
    for force in PAIR:
        w = force.angular_frequency
        response = force.amplitude / abs(complex(1 - w * w, DAMPING * w))
        line, width = w / (2 * math.pi), 1.1 * found.resolution
        assert found.power(line - width, line + width) == pytest.approx(response**2 / 2, rel=1e-9)


# -- periodic orbits -------------------------------------------------------------------------------


@pytest.mark.parametrize("method", [None, RungeKutta(1e-12)])
def test_the_linear_orbit_in_closed_form(method):
    orbit = find_periodic_orbit(machine(), 1, phase=1.1, method=method)
    assert orbit.found
    assert orbit.stable
    np.testing.assert_allclose(orbit.state, steady(PAIR, 1.1 / 0.45), atol=1e-9)
    root = complex(-DAMPING / 2, math.sqrt(1 - DAMPING**2 / 4))
    multiplier = np.exp(root * 2 * math.pi / 0.45)
    assert np.abs(orbit.multipliers) == pytest.approx(np.abs(multiplier), rel=1e-7)
    assert np.abs(orbit.multipliers.imag) == pytest.approx(abs(multiplier.imag), rel=1e-6)
    assert orbit.exponents == pytest.approx([-DAMPING / 2] * 2, rel=1e-7)


def test_an_orbit_with_impacts_returns_for_as_long_as_it_is_followed():
    oscillator = machine((Force(0.5, 0.9), Force(0.2, 0.45)), NEAR)
    orbit = find_periodic_orbit(oscillator, 1)
    assert orbit.found
    assert orbit.impacts > 0
    motion = orbit.motion(60 if orbit.stable else 3)
    for got, expected in zip(motion.stroboscopic(0.0), orbit.state, strict=True):
        np.testing.assert_allclose(got, expected, atol=1e-9)
    for other in find_periodic_orbits(oscillator, 1, guesses=4):
        x, _ = other.motion(2).stroboscopic(0.0)
        np.testing.assert_allclose(x, other.state[0], atol=1e-8)


def test_an_orbit_under_a_law_of_twice_the_period():
    """x'' + 0.06 x' + x = 0.5 cos 0.9t + 0.2 cos(0.45 t), the latter as a law."""
    slow = (Force(0.5, 0.9), Force(0.2, 0.45))
    oscillator = machine(slow[:1], law=lambda t, x, v: 0.2 * math.cos(0.45 * t))
    orbit = find_periodic_orbit(oscillator, 1)
    assert orbit.found
    np.testing.assert_allclose(orbit.state, steady(slow, 0.0), atol=1e-8)
    assert orbit_period(orbit.motion(4)).periods == 1


NEVER = {
    "two forces": machine((Force(0.5, 0.9), Force(0.2, 0.9 * math.sqrt(2)))),
    "a force and the base": machine((Force(0.5, 0.9),), base=BaseMotion(0.1, 0.9 * math.sqrt(2))),
    "a law": machine((Force(0.5, 0.9),), law=apart),
}


@pytest.mark.parametrize("oscillator", NEVER.values(), ids=NEVER)
@pytest.mark.parametrize(
    ("ask", "argument"),
    [
        (lambda one: find_periodic_orbit(one), "system"),
        (lambda one: find_periodic_orbits(one), "oscillator"),
        (lambda one: continue_orbit(lambda _: one, (0.0, 1.0)), "scene_of_parameter"),
        (lambda one: orbit_period(simulate(one, periods=4)), "motion"),
    ],
)
def test_what_never_recurs_has_no_periodic_orbits(oscillator, ask, argument):
    with pytest.raises(InvalidInput, match="common period") as caught:
        ask(oscillator)
    assert caught.value.argument == argument


def test_basins_of_what_never_recurs_are_refused():
    with pytest.raises(InvalidInput, match="common period"):
        basins_of_attraction(NEVER["two forces"], [0.0], [0.0])


def test_basins_under_two_frequencies():
    (only,) = basins_of_attraction(machine(), [0.0, 0.5], [0.0, 1.0]).attractors
    assert (only.periods, only.impacts) == (1, 0)
    np.testing.assert_allclose(only.strobe[0], steady(PAIR, 0.0), atol=1e-6)


@pytest.mark.parametrize(
    ("second", "periods"), [(0.45, 1), (2.7, 1), (0.9 * math.sqrt(2), 0), (0.45 * (1 + 1e-9), 0)]
)
def test_diagrams_and_charts_close_only_what_recurs(second, periods):
    def scene(amplitude, _=None):
        return machine((Force(amplitude, 0.9), Force(0.1, second)))

    chart = periodicity_chart(scene, [0.2, 0.4], [0.0], periods=300)
    assert set(chart.periods.ravel()) == {periods}
    diagram = bifurcation_diagram(scene, [0.2, 0.4], periods=20, transient=300)
    assert set(diagram.periods) == {periods}
    assert {len(strobe) for strobe in diagram.strobe} == {periods or 20}


def test_stepped_diagrams_close_only_what_recurs():
    def scene(second):
        return machine((Force(0.3, 0.9), Force(0.1, second)), stops=(Stop(50.0, Hertz(10.0)),))

    diagram = bifurcation_diagram(scene, [0.45, 0.5001], periods=4, transient=250)
    assert diagram.periods.tolist() == [1, 0]


def test_a_branch_has_no_bifurcations_that_two_frequencies_feign():
    """Along the linear response nothing happens, whatever the second amplitude."""
    branch = continue_orbit(
        lambda amplitude: machine((Force(0.5, 0.9), Force(amplitude, 0.45))), (0.1, 0.3)
    )
    assert branch.status == "end of range"
    assert branch.special == ()
    forces = (Force(0.5, 0.9), Force(0.3, 0.45))
    np.testing.assert_allclose(branch.state[-1], steady(forces, branch.phase[-1] / 0.45), atol=1e-8)


def test_exponents_need_no_common_period():
    found = lyapunov_spectrum(NEVER["two forces"], periods=3000)
    assert found.exponents == pytest.approx([-DAMPING / 2] * 2, abs=2e-3)
    assert found.sum == pytest.approx(-DAMPING, rel=1e-11)


# -- control, and flows ----------------------------------------------------------------------------


def test_the_force_of_ogy_has_the_frequency_of_the_force_that_it_moves():
    """The control force is what the equation of motion lacks."""
    forces = (Force(0.25, 0.9065, 0.4), Force(0.05, 0.9065 / 2))
    oscillator = machine(forces, (Stop(1.0, Rigid(0.2)),))
    orbit = find_periodic_orbit(oscillator, 1, phase=2.0)
    assert orbit.multipliers[0] < -1
    start = orbit.state + np.array([1e-3, 0.0])
    course = simulate(Controlled(oscillator, OGY(orbit, 0.05)), periods=3, initial=start.tolist())
    h = 1e-3
    time = np.linspace(1.0, course.stop - 1.0, 400)
    clear = np.abs(time[:, None] - course.impacts.time).min(axis=1) > 3 * h
    edges = np.arange(4) * oscillator.forcing_period
    clear &= np.abs(time[:, None] - edges).min(axis=1) > 3 * h
    time = time[clear]
    x, v = course.sample(time)
    a = (course.sample(time + h)[1] - course.sample(time - h)[1]) / (2 * h)
    at = time + 2.0 / oscillator.angular_forcing_frequency
    pull = sum(f.amplitude * np.cos(f.angular_frequency * at + f.phase) for f in forces)
    lacking = a + DAMPING * v + x - pull
    assert np.abs(course.force(time)).max() > 1e-4
    np.testing.assert_allclose(course.force(time), lacking, atol=1e-6)


def pushed(t, y):
    return (-0.5 * y[0] + math.cos(t),)


def test_a_forced_flow_has_no_orbit_of_another_period():
    flow = Flow(pushed, (0.0,))
    orbit = find_periodic_orbit(flow, period=4 * math.pi, guess=(0.0,))
    assert orbit.state[0] == pytest.approx(0.5 / 1.25, abs=1e-10)
    with pytest.raises(InvalidInput, match="rates") as caught:
        find_periodic_orbit(flow, period=5.0, guess=(0.0,))
    assert caught.value.argument == "period"


def test_what_cannot_be_tested_says_what_is_required():
    with pytest.raises(InvalidInput) as caught:
        impactsig.find_periodic_orbit(NEVER["a law"])
    assert "law that depends on time" in str(caught.value)
    assert "8 periods" in str(caught.value)
