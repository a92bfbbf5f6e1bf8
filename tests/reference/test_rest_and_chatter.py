"""Rest and chatter in closed form: where a mass sets off, and when it has come to rest."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from scipy.optimize import brentq

from impactsig import (
    Controlled,
    DelayedFeedback,
    Force,
    Friction,
    KelvinVoigt,
    Oscillator,
    Rigid,
    RungeKutta,
    Stop,
    simulate,
)
from impactsig.simulation.basis.events import DONE, MARK, START
from tests.drive import drive

EXACT, STEPPED = None, RungeKutta(1e-12)
BOTH = pytest.mark.parametrize("method", [EXACT, STEPPED], ids=["exact", "stepped"])
SIDES = pytest.mark.parametrize("sign", [1, -1])


# -- energy ----------------------------------------------------------------------------------------


@BOTH
@pytest.mark.parametrize("loss", [0.0, 1.5])
def test_two_springs_one_behind_the_other_lose_what_the_mass_has_lost(method, loss):
    """A free mass is touched and left twice; only the last part ends the contact."""
    stops = (Stop(0.5, KelvinVoigt(20.0, loss)), Stop(0.6, KelvinVoigt(30.0, loss / 2)))
    free = Oscillator(mass=1.3, stiffness=0, stops=stops)
    motion = simulate(free, duration=3.0, initial=(0.0, 1.0), method=method)
    assert motion.impact_count == 2
    v = motion.final[1]
    assert -1 <= v < 0
    assert motion.energy_lost == pytest.approx(1.3 * (1 - v * v) / 2, abs=1e-9)
    assert (motion.energy_lost > 0.1) == (loss > 0)


# -- setting off -----------------------------------------------------------------------------------


def pressed(forces, load, friction=None, stops=(), sign=1):
    """A free mass at rest under a load and forces, all of them turned by the sign."""
    forces = tuple(Force(sign * f.amplitude, f.angular_frequency, f.phase) for f in forces)
    return Oscillator(stiffness=0, load=sign * load, forces=forces, friction=friction, stops=stops)


@BOTH
@SIDES
def test_a_force_that_rises_from_the_limit_of_friction_moves_the_mass_at_once(method, sign):
    """x'' = 0.5 sin t."""
    machine = pressed([Force(0.5, 1, -math.pi / 2)], 0.25, Friction(0.25), sign=sign)
    motion = simulate(machine, duration=6.0, method=method)
    time = np.linspace(0, 6, 13)
    np.testing.assert_allclose(sign * motion.sample(time)[0], (time - np.sin(time)) / 2, atol=1e-9)
    assert motion.stick_count == 0


@BOTH
@SIDES
def test_friction_falls_where_the_mass_sets_off(method, sign):
    """x'' = 0.15 + 0.5 sin t."""
    machine = pressed([Force(0.5, 1, -math.pi / 2)], 0.25, Friction(0.1, 0.25), sign=sign)
    motion = simulate(machine, duration=6.0, method=method)
    time = np.linspace(0, 6, 13)
    expected = 0.075 * time**2 + (time - np.sin(time)) / 2
    np.testing.assert_allclose(sign * motion.sample(time)[0], expected, atol=1e-9)
    assert motion.stick_count == 0


@SIDES
@pytest.mark.parametrize("beside_a_stop", [False, True])
def test_rounding_does_not_turn_a_mass_that_sets_off_at_the_limit(beside_a_stop, sign):
    """At that phase 0.5 cos t is -9e-17, which 4 does not feel, but their difference does.

    It must not press the mass against a stop that the mass leaves either.
    """
    stops = (Stop(0.0, Rigid(0.5), "lower" if sign > 0 else "upper"),) if beside_a_stop else ()
    machine = pressed([Force(0.5, 1)], 4.0, Friction(4.0), stops, sign)
    run = drive(machine, STEPPED, 6.0, phase=1.5 * math.pi, legs=1000)
    assert run.status == DONE
    assert set(run.kind) <= {START, MARK}
    time = np.linspace(0.5, 6, 12)
    np.testing.assert_allclose(sign * run.at(time)[0], (time - np.sin(time)) / 2, atol=1e-9)


@SIDES
def test_what_a_force_lacks_to_the_limit_but_for_rounding_does_not_hold_the_mass(sign):
    """x'' = 0.5 sin t, where the load lacks two units in its last place to the friction."""
    load = 0.25 - 2 * math.ulp(0.2)
    machine = pressed([Force(0.5, 1, -math.pi / 2)], load, Friction(0.25), sign=sign)
    motion = simulate(machine, duration=6.0)
    time = np.linspace(0, 6, 13)
    np.testing.assert_allclose(sign * motion.sample(time)[0], (time - np.sin(time)) / 2, atol=1e-12)
    assert motion.stick_count == 0


@BOTH
@SIDES
def test_a_mass_sets_off_just_before_the_crest_of_the_force(method, sign):
    """x'' = 0.25 + 0.4 cos(t - 0.001) - 0.1: the force rises from the limit, and soon falls."""
    wave = 0.4 * cmath.exp(-0.001j)
    limit = 0.25 + abs(wave) * math.cos(cmath.phase(wave))
    machine = pressed([Force(0.4, 1, -0.001)], 0.25, Friction(0.1, limit), sign=sign)
    motion = simulate(machine, duration=1.5, method=method)
    assert motion.stick_count == 0
    c, s = math.cos(0.001), -math.sin(0.001)
    time = np.linspace(0, 1.5, 7)
    expected = 0.075 * time**2 + 0.4 * (c - np.cos(time - 0.001) - s * time)
    np.testing.assert_allclose(sign * motion.sample(time)[0], expected, atol=1e-9)


@BOTH
@SIDES
def test_a_force_that_falls_from_the_limit_holds_until_it_passes_the_other(method, sign):
    """0.25 - 0.5 sin t passes -0.25 at t = pi / 2; with 0.6 for 0.5 at asin(5 / 6)."""
    machine = pressed([Force(-0.6, 1, -math.pi / 2)], 0.25, Friction(0.25), sign=sign)
    motion = simulate(machine, duration=2.0, method=method)
    assert motion.stick_count == 1
    np.testing.assert_allclose(motion.sticks[0], [0, math.asin(5 / 6)], atol=1e-9)
    assert sign * motion.final[0] < 0


@SIDES
def test_a_force_that_bends_away_from_the_limit_decides_by_its_second_derivative(sign):
    """x'' = 0.4 (1 - cos t) from the limit, or the mass is held until 0.4 (1 - cos t) = 0.5."""
    leaves = pressed([Force(-0.4, 1)], 0.25 + 0.4, Friction(0.25), sign=sign)
    motion = simulate(leaves, duration=4.0)
    time = np.linspace(0, 4, 9)
    expected = 0.4 * (time**2 / 2 - 1 + np.cos(time))
    np.testing.assert_allclose(sign * motion.sample(time)[0], expected, atol=1e-12)
    assert motion.stick_count == 0
    stays = pressed([Force(0.4, 1)], 0.25 - 0.4, Friction(0.25), sign=sign)
    motion = simulate(stays, duration=2.0)
    np.testing.assert_allclose(motion.sticks[0], [0, math.acos(-0.25)], atol=1e-12)


@SIDES
@pytest.mark.parametrize("bends", [False, True])
def test_a_mass_leaves_a_rigid_stop_as_the_force_does(bends, sign):
    """From f = 0 at a stop: f = -0.4 sin t, or -0.4 (1 - cos t), takes it away at once."""
    stop = Stop(0.0, Rigid(0.5), "upper" if sign > 0 else "lower")
    forces, load = ([Force(0.4, 1)], -0.4) if bends else ([Force(-0.4, 1, -math.pi / 2)], 0.0)
    motion = simulate(pressed(forces, load, stops=(stop,), sign=sign), duration=3.0)
    time = np.linspace(0, 3, 7)
    expected = time**2 / 2 - 1 + np.cos(time) if bends else time - np.sin(time)
    np.testing.assert_allclose(-sign * motion.sample(time)[0], 0.4 * expected, atol=1e-12)
    assert motion.stick_count == motion.impact_count == 0


@pytest.mark.parametrize("law", [Rigid(0.5), KelvinVoigt(30.0)])
def test_a_gap_of_rounding_is_not_a_gap_of_many_roundings(law):
    """2e-11 before the stop, at 1e-3: it is hit 2e-8 later."""
    x = 1 - 2e-11
    motion = simulate(
        Oscillator(stiffness=0, stops=(Stop(1.0, law),)), duration=1e-3, initial=(x, 1e-3)
    )
    assert motion.impacts.time[0] == pytest.approx((1 - x) / 1e-3, rel=1e-9)


def kicked(t, x, v):
    return 0.3 + (1.2 if 0.02 < t % (2 * math.pi) - 20 * 2 * math.pi / 64 < 0.069 else 0.0)


def test_a_short_pulse_of_a_law_lets_a_held_mass_go():
    """It lasts half of what lies between two looks at a force of period 2 pi alone."""
    forces = (Force(0.02, 1), Force(0.01, 3))
    machine = Oscillator(stiffness=0, forces=forces, friction=Friction(1.0), law=kicked)
    motion = simulate(machine, duration=3.0)
    np.testing.assert_allclose(motion.sticks[0], [0, 20 * 2 * math.pi / 64 + 0.02], atol=1e-9)


# -- chatter ---------------------------------------------------------------------------------------


@BOTH
@SIDES
@pytest.mark.parametrize("chatter", [1e-2, 1e-6])
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_rubbing_bounce_ends_when_the_series_does(friction, chatter, sign, method):
    """Falls with 1 - F and rises with 1 + F: a geometric series of flights."""
    r, height = 0.7, 0.5
    up, down = 1 + friction, 1 - friction
    kept = math.sqrt(down / up)
    first = math.sqrt(2 * height / down)
    speed = math.sqrt(2 * height * down)
    rest = first + r * speed * (1 / up + kept / down) / (1 - r * kept)
    stop = Stop(0.0, Rigid(r), "upper" if sign > 0 else "lower")
    ball = pressed([], 1.0, Friction(friction) if friction else None, (stop,), sign)
    motion = simulate(
        ball, duration=10.0, initial=(-sign * height, 0), method=method, chatter=chatter
    )
    assert motion.sticks[:, 0].tolist() == pytest.approx([rest], rel=1e-9)
    assert motion.energy_lost == pytest.approx(height, rel=1e-9)


def early_and_late(machine, **run):
    """How far off the first stick is where its chatter is summed early, and how long that lasts."""
    early, late = (simulate(machine, chatter=share, **run) for share in (1e-2, 1e-9))
    if not (early.stick_count and late.stick_count):
        return 0.0, 0.0
    end = early.sticks[0, 0]
    left = end - early.impacts.time[early.impacts.time <= end][-1]
    return abs(end - late.sticks[0, 0]), left


@BOTH
@pytest.mark.parametrize("frequency", [0.3, 1.0, 3.0])
def test_a_chatter_is_summed_only_while_the_force_hardly_changes(frequency, method):
    """Its end then is off by no more than the hundredth that the force may change by."""
    machine = pressed([Force(0.28, frequency)], 0.3, stops=(Stop(0.0, Rigid(0.7)),))
    ends = np.array([
        early_and_late(
            machine, duration=12.0, initial=(-0.5, 0.0), phase=phase, method=method
        )
        for phase in np.arange(12) * math.pi / 6
    ])  # fmt: skip
    off, left = ends.T
    assert np.count_nonzero(left > 1e-3) >= 2
    assert np.all(off <= 0.01 * left + 1e-9)


@BOTH
def test_a_chatter_is_not_summed_where_the_force_is_least(method):
    """Its rate is 0 there, but it has risen by a tenth when the chatter would have ended."""
    machine = pressed([Force(-0.28, 1.0)], 0.3, stops=(Stop(0.0, Rigid(0.009)),))
    out = 0.13 * 0.009
    run = {"duration": 0.3, "initial": (-1e-9, 0.13), "method": method}
    ends = [simulate(machine, chatter=share, **run).sticks[0, 0] for share in (1e-2, 1e-9)]
    # The first rebound in the force 0.3 - 0.28 cos t; all others take a hundredth of it.
    time = brentq(lambda t: out * t - 0.15 * t * t + 0.28 * (1 - math.cos(t)), 0.01, 0.3)
    assert ends[1] == pytest.approx(time * (1 + 0.009), rel=2e-3)
    assert ends[0] == pytest.approx(ends[1], rel=1e-4)


def test_a_chatter_under_control_is_summed_only_while_what_is_fed_back_is_smooth():
    """Impacts one delay ago are jumps of the control force."""
    machine = Oscillator(
        damping=0.05, load=0.3, forces=(Force(0.6, 0.8),), stops=(Stop(0.0, Rigid(0.7)),)
    )
    ends = np.array([
        early_and_late(
            Controlled(machine, DelayedFeedback(0.3, delay, signal="velocity")),
            periods=6.5, initial=(-0.5, 0.0), phase=phase,
        )
        for delay in (0.01, 0.03, 0.1, 1)
        for phase in (1.8, 2.1, 2.6, 3.1)
    ])  # fmt: skip
    off, left = ends.T
    assert np.count_nonzero(left > 1e-3) >= 4
    assert np.all(off <= 0.01 * left + 1e-9)


def test_a_run_under_control_that_ends_within_a_chatter_ends_in_time():
    """The chatter is then gone through impact by impact, as with a smaller share."""
    machine = Oscillator(
        damping=0.05, load=0.3, forces=(Force(0.6, 0.8),), stops=(Stop(0.0, Rigid(0.7)),)
    )
    feedback = DelayedFeedback(0.05, 0.1, signal="velocity")
    run = {"initial": (-0.5, 0.0), "phase": 2.1}
    whole = simulate(Controlled(machine, feedback), periods=4, chatter=1e-2, **run)
    stick = whole.sticks[0, 0]
    before = whole.impacts.time[whole.impacts.time <= stick][-1]
    assert stick - before > 1e-3
    run["periods"] = (before + stick) / 2 / machine.forcing_period
    cut, fine = (
        simulate(Controlled(machine, feedback), chatter=share, **run) for share in (1e-2, 1e-9)
    )
    assert cut.stop == pytest.approx((before + stick) / 2, rel=1e-13)
    assert cut.stick_count == fine.stick_count == 0
    assert cut.impact_count == fine.impact_count
    assert cut.final == pytest.approx(fine.final, abs=1e-10)
