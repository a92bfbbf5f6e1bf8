"""Periodic orbits and sections against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import impactsig
from impactsig import (
    BaseMotion,
    Force,
    KelvinVoigt,
    Oscillator,
    Rigid,
    RungeKutta,
    Stop,
    scenes,
)
from tests import naive
from tests.naive_simulate import one_impact_orbit


@pytest.mark.parametrize("frequency", [20.1, 20.3355, 21.0, 22.1, 23.0])
def test_the_orbit_of_shaw_and_holmes_is_found_whether_stable_or_not(frequency):
    pytest.importorskip("mpmath")
    beam = scenes.karpodinis(frequency)
    orbit = impactsig.find_periodic_orbit(beam, impacts=1)
    omega = frequency / scenes.NATURAL_FREQUENCY
    velocity, phase = one_impact_orbit(0.03, 0.25, omega, 0.2)
    assert orbit.found
    assert orbit.stable == (frequency > 20.5)
    assert orbit.approach_velocity == pytest.approx([float(velocity)], abs=1e-12)
    assert orbit.impact_phase == pytest.approx([float(phase)], abs=1e-12)
    # Areas shrink by r^2 exp(-2 zeta T).
    shrinks = 0.04 * math.exp(-0.06 * 2 * math.pi / omega)
    assert np.prod(orbit.multipliers) == pytest.approx(shrinks, rel=1e-12)
    assert orbit.residual < 1e-14
    assert orbit.exponents.sum() == pytest.approx(
        -0.06 + math.log(0.04) * omega / (2 * math.pi), rel=1e-12
    )


def test_the_orbit_at_22_1_hz_has_the_published_velocity():
    orbit = impactsig.find_periodic_orbit(scenes.karpodinis(22.1), guess=(0.9, 0.7))
    assert orbit.approach_velocity == pytest.approx([0.5810258993557], abs=1e-12)
    assert "stable" in repr(orbit)


def test_without_impacts_the_orbit_is_the_forced_response():
    """And its multipliers are those of the free motion, exp(lambda T)."""
    zeta, omega, amplitude, phase = 0.05, 0.7, 0.3, 0.8
    machine = Oscillator(damping=2 * zeta, forces=Force(amplitude, omega))
    orbit = impactsig.find_periodic_orbit(machine, guess=(2, -3), phase=phase)
    response = amplitude / complex(1 - omega**2, 2 * zeta * omega)
    turned = response * np.exp(1j * phase)
    assert orbit.state == pytest.approx([turned.real, -omega * turned.imag], abs=1e-14)
    eigenvalue = complex(-zeta, math.sqrt(1 - zeta**2))
    multiplier = np.exp(eigenvalue * 2 * math.pi / omega)
    assert abs(orbit.multipliers[0].imag) == pytest.approx(abs(multiplier.imag), abs=1e-13)
    assert orbit.multipliers[0].real == pytest.approx(multiplier.real, abs=1e-13)


def test_unstable_orbits_within_the_chaos_return():
    beam = scenes.karpodinis(20.1)
    seen = set()
    for n in (1, 2, 4, 5):
        for orbit in impactsig.find_periodic_orbits(beam, n, guesses=40):
            assert orbit.found
            assert not orbit.stable
            x, v = orbit.motion().stroboscopic()
            assert (x[-1], v[-1]) == pytest.approx(tuple(orbit.state), abs=1e-11)
            # It closes no sooner.
            assert all(abs(x[k] - x[0]) + abs(v[k] - v[0]) > 1e-4 for k in range(1, n))
            shrinks = 0.04**orbit.impacts * math.exp(
                -0.06 * 2 * math.pi * n / naive.frequency_ratio(20.1)
            )
            assert np.prod(orbit.multipliers) == pytest.approx(shrinks, rel=1e-11)
            # The multiplier is what a neighbour is stretched by.
            seen.add((orbit.impacts, n))
    assert {(1, 1), (1, 2), (3, 4), (4, 5)} <= seen


@pytest.mark.parametrize(
    ("point", "impacts"), [((-0.22939, -1.65387), 0), ((-0.13229, 1.55535), 2)]
)
def test_the_published_orbits_of_begley_and_virgin_are_stable(point, impacts):
    """And their exponents are their multipliers', complex ones: equal in modulus."""
    scene = scenes.begley_virgin(1.338, 1.6, 0.05)
    orbit = impactsig.find_periodic_orbit(scene, guess=point)
    assert orbit.found
    assert orbit.stable
    assert orbit.impacts == impacts
    assert orbit.state == pytest.approx(point, abs=5e-6)
    spectrum = impactsig.lyapunov_spectrum(scene, periods=2000, initial=point)
    assert spectrum.sum == pytest.approx(orbit.exponents.sum(), rel=1e-9)
    assert spectrum.exponents == pytest.approx(orbit.exponents, abs=3 / spectrum.time[-1])


def test_a_sticking_orbit_is_found_at_once_and_forgets():
    orbit = impactsig.find_periodic_orbit(scenes.okolewski(3, 0.6), 4)
    assert orbit.found
    assert orbit.stable
    assert orbit.multipliers == pytest.approx([0, 0])
    assert np.all(orbit.exponents == -math.inf)


def test_a_stepped_orbit_is_the_exact_one():
    beam = scenes.karpodinis(20.1)
    exact = impactsig.find_periodic_orbit(beam)
    stepped = impactsig.find_periodic_orbit(
        beam, guess=exact.state + 0.01, method=RungeKutta(1e-12)
    )
    assert stepped.found
    assert stepped.state == pytest.approx(exact.state, abs=1e-9)
    assert stepped.multipliers == pytest.approx(exact.multipliers, rel=1e-6)


@pytest.mark.parametrize(
    ("scene", "impacts", "periods", "sticks"),
    [
        (scenes.karpodinis(22.1), 1, 1, 0),
        (scenes.okolewski(4, 1.0), 1, 2, 0),
        (scenes.okolewski(8, 1.0), 1, 4, 0),
        (scenes.okolewski(4, 1.0, "soft"), 1, 2, 0),
        (scenes.okolewski(8, 1.0, "soft"), 1, 4, 0),
        (scenes.okolewski(3, 0.6, "soft"), 9, 4, 0),
        (scenes.okolewski(3, 0.6), None, 4, 1),
        (scenes.karpodinis(20.1), None, None, None),
    ],
)
def test_the_periods_of_the_papers_motions(scene, impacts, periods, sticks):
    motion = impactsig.simulate(scene, periods=140, transient=4000)
    found = impactsig.orbit_period(motion)
    assert found.periods == periods
    assert bool(found) == (periods is not None)
    assert found.sticks == sticks
    if impacts is not None:
        assert found.impacts == impacts
        assert str(found) == f"period({impacts}, {periods})"
        assert found.residual < 1e-9


def test_a_motion_that_settles_is_not_closed_yet():
    machine = Oscillator(damping=0.02, forces=Force(1.0, 0.7))
    motion = impactsig.simulate(machine, periods=20)
    found = impactsig.orbit_period(motion)
    assert not found
    assert 1e-9 < found.residual < 1
    assert impactsig.orbit_period(motion, tolerance=2 * found.residual)


@pytest.mark.parametrize("method", [None, RungeKutta(1e-12)])
@pytest.mark.parametrize("level", [-1.2, 0.0, 0.4, 1.9])
def test_a_sine_is_crossed_where_it_must(level, method):
    """The steady motion is |X| cos(t w + angle), its crossings those of a cosine."""
    zeta, omega = 0.05, 0.7
    response = 1.0 / complex(1 - omega**2, 2 * zeta * omega)
    machine = Oscillator(damping=2 * zeta, forces=Force(1.0, omega))
    start = response.real, -omega * response.imag
    motion = impactsig.simulate(machine, periods=25, initial=start, method=method)
    size, angle = abs(response), np.angle(response)
    for direction, sign in (("up", -1), ("down", 1)):
        section = impactsig.displacement_section(motion, level, direction)
        if abs(level) > size:
            assert len(section) == 0
            continue
        at = (sign * math.acos(level / size) - angle) % (2 * math.pi)
        assert len(section) == 25
        assert section.phase == pytest.approx(at, abs=1e-9)
        speed = -sign * omega * math.sqrt(size**2 - level**2)
        assert section.velocity == pytest.approx(speed, abs=1e-9)


def test_crossings_near_a_turning_point_are_not_missed():
    """Two of them, 2 acos(1 - 1e-9) = 9e-5 rad apart, in each of a thousand periods."""
    omega = 0.7
    machine = Oscillator(forces=Force(1 - omega**2, omega))
    motion = impactsig.simulate(machine, periods=1000, phase=1.0, initial=(
        math.cos(1), -omega * math.sin(1)))  # fmt: skip
    section = impactsig.displacement_section(motion, 1 - 1e-9, "both")
    assert len(section) == 2000
    width = np.diff(section.phase)[::2] % (2 * math.pi)
    assert np.minimum(width, 2 * math.pi - width) == pytest.approx(
        2 * math.acos(1 - 1e-9), rel=1e-4
    )


@pytest.mark.parametrize("method", [None, RungeKutta(1e-11)])
def test_a_soft_stop_is_crossed_where_it_is_touched(method):
    machine = Oscillator(
        damping=0.1, forces=Force(1.0, 0.7), stops=Stop(0.3, KelvinVoigt(50.0, 5.0))
    )
    motion = impactsig.simulate(machine, periods=40, method=method)
    up = impactsig.displacement_section(motion, 0.3)
    hits = impactsig.impact_map(motion)
    assert len(hits) == motion.impact_count == len(up) > 40
    assert up.time == pytest.approx(motion.impacts.time, abs=1e-12)
    assert hits.time == pytest.approx(motion.impacts.time, abs=1e-12)
    assert up.velocity == pytest.approx(hits.velocity, abs=1e-10)


def test_crossings_between_impacts_on_a_moving_base():
    """Against samples, of what the stops see: x less the base."""
    base = BaseMotion(0.3, 1.1, 0.2, stops=True)
    machine = Oscillator(
        damping=0.1, forces=Force(1.0, 0.7), base=base, stops=Stop(0.3, Rigid(0.7))
    )
    motion = impactsig.simulate(machine, periods=50)
    time = np.unique(
        np.concatenate([np.linspace(motion.start, motion.stop, 100_001), motion.impacts.time])
    )
    for level in (-0.4, 0.0, 0.2):
        section = impactsig.displacement_section(motion, level, "both")
        x, _ = motion.sample(time)
        below = x - 0.3 * np.cos(1.1 * time + 0.2) < level
        seen = np.flatnonzero(below[1:] != below[:-1])
        assert len(section) == len(seen) > 50
        assert np.all((section.time >= time[seen]) & (section.time <= time[seen + 1]))
        x, _ = motion.sample(section.time)
        assert x - 0.3 * np.cos(1.1 * section.time + 0.2) == pytest.approx(level, abs=1e-11)
    assert len(impactsig.displacement_section(motion, 0.3, "both")) == 0


def test_the_impact_map_of_a_period_one_orbit_is_one_point():
    beam = scenes.karpodinis(22.1)
    motion = impactsig.simulate(beam, periods=30, transient=2000)
    section = impactsig.impact_map(motion, stop=0)
    velocity, phase = one_impact_orbit(0.03, 0.25, naive.frequency_ratio(22.1), 0.2)
    assert len(section) == 30
    assert section.phase == pytest.approx(float(phase), abs=1e-12)
    assert section.velocity == pytest.approx(float(velocity), abs=1e-12)
    assert section.time == pytest.approx(motion.impacts.time, rel=1e-14)
