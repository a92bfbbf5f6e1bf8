"""Neighbours, exponents, orbits and branches of controlled oscillators."""

from __future__ import annotations

import math

import numpy as np
import pytest

import impactsig as im
from impactsig import InvalidInput, scenes

BEAM = scenes.karpodinis(20.3355)


@pytest.fixture(scope="module")
def saddle():
    return im.find_periodic_orbit(BEAM, 1, impacts=1)


@pytest.fixture(scope="module")
def nudged(saddle):
    return im.Controlled(BEAM, im.OGY(saddle, limit=0.02))


def ends(system, start, **run):
    return np.array(im.simulate(system, initial=tuple(start), **run).final[:2])


@pytest.mark.parametrize("off", [(2e-4, 0.0), (2e-2, 0.1)])  # nudged; left alone at first
def test_the_map_of_a_nudged_machine_is_that_of_its_neighbours(nudged, saddle, off):
    size = np.array([1.0, saddle.system.angular_forcing_frequency])
    start = saddle.state + np.array(off) * np.abs(saddle.state)
    found = im.tangent_map(nudged, periods=2.3, initial=tuple(start))
    np.testing.assert_allclose(found.final[:2], ends(nudged, start, periods=2.3), rtol=1e-9)
    for k in range(2):
        h = 1e-7 * size[k] * abs(saddle.state[0]) * np.eye(2)[k]
        parted = ends(nudged, start + h, periods=2.3) - ends(nudged, start - h, periods=2.3)
        expected = parted / (2 * h[k])
        np.testing.assert_allclose(
            found.matrix[:, k] / size, expected / size, atol=2e-4 * np.abs(expected / size).max()
        )


def test_the_orbit_held_by_ogy_has_the_multipliers_of_its_gains(nudged, saddle):
    orbit = im.find_periodic_orbit(nudged, guess=saddle.state)
    assert orbit.found
    assert orbit.stable
    np.testing.assert_allclose(orbit.state, saddle.state, rtol=1e-9)
    np.testing.assert_allclose(orbit.multipliers, nudged.controller.multipliers, atol=1e-6)
    assert orbit.motion(50).impact_count == 50


@pytest.mark.slow
def test_the_close_returns_of_a_nudged_motion_lead_to_its_orbit(nudged, saddle):
    without = im.find_periodic_orbit(nudged)
    np.testing.assert_allclose(without.state, saddle.state, rtol=1e-8)


def test_a_locked_machine_has_the_exponents_of_its_multipliers(nudged, saddle):
    start = tuple(saddle.state * (1 + 1e-5))
    found = im.lyapunov_spectrum(nudged, periods=12, transient=3, initial=start)
    period = 2 * math.pi / BEAM.angular_forcing_frequency
    large = math.log(abs(nudged.controller.multipliers[0])) / period
    assert found.exponents[0] == pytest.approx(large, rel=1e-4)
    assert found.impacts == 12
    start = tuple(saddle.state * 1.01)  # whose second exponent is not all rounding
    found = im.lyapunov_spectrum(nudged, periods=5, transient=0, initial=start)
    assert found.expected_sum == pytest.approx(found.sum, rel=1e-9)


def test_a_branch_of_held_orbits_stays_stable_where_the_machine_alone_is_not(saddle):
    start = saddle.state

    def near(frequency):
        beam = scenes.karpodinis(frequency)
        orbit = im.find_periodic_orbit(beam, 1, guess=start)
        return im.Controlled(beam, im.OGY(orbit, limit=0.02))

    branch = im.continue_orbit(near, (20.3355, 20.34), guess=start, most=2)
    own = im.find_periodic_orbit(scenes.karpodinis(branch.parameter[-1]), guess=start)
    np.testing.assert_allclose(branch.state[-1], own.state, rtol=1e-6)
    assert np.abs(own.multipliers).max() > 1 > np.abs(branch.multipliers).max()


def test_an_orbit_on_which_feedback_is_silent_is_one_of_the_machine_alone(saddle):
    feedback = im.DelayedFeedback(0.1, 2, signal="displacement")
    orbit = im.find_periodic_orbit(im.Controlled(BEAM, feedback), guess=saddle.state)
    np.testing.assert_array_equal(orbit.state, saddle.state)
    told = im.orbit_stability(saddle, feedback)
    np.testing.assert_array_equal(orbit.multipliers, told.multipliers)
    assert orbit.system.controller == feedback
    spiked = im.IntervalFeedback.fastest(saddle, 0.02)
    orbit = im.find_periodic_orbit(im.Controlled(BEAM, spiked), guess=saddle.state)
    told = im.orbit_stability(saddle, spiked)
    np.testing.assert_array_equal(orbit.multipliers, told.multipliers)
    assert orbit.stable
    assert not saddle.stable


def test_a_branch_under_feedback_is_that_of_the_machine_with_other_multipliers():
    def scene(frequency):
        feedback = im.DelayedFeedback(0.05, 1, signal="displacement")
        return im.Controlled(scenes.karpodinis(frequency), feedback)

    branch = im.continue_orbit(scene, (22.1, 22.0), most=3)
    alone = im.continue_orbit(scenes.karpodinis, (22.1, 22.0), most=3)
    np.testing.assert_allclose(branch.state, alone.state, rtol=1e-9)
    beam = scenes.karpodinis(branch.parameter[-1])
    own = im.find_periodic_orbit(beam, guess=branch.state[-1], phase=branch.phase[-1])
    told = im.orbit_stability(own, im.DelayedFeedback(0.05, 1, signal="displacement"))
    np.testing.assert_allclose(branch.multipliers[-1][:2], told.multipliers[:2], rtol=1e-5)


@pytest.mark.parametrize(
    ("controller", "periods", "argument", "required"),
    [
        (im.DelayedFeedback(0.1, 1, signal="displacement"), 2, "periods", "delay of 1"),
        (im.DelayedFeedback(0.1, 1), 1, "system", "linear"),
        (im.IntervalFeedback(0.1, 0.02, target=2.0), 1, "target", "which has 1"),
        ([(0, im.IntervalFeedback(0.1, 0.02)), (9, None)], 1, "system", "for good"),
    ],
)
def test_orbits_that_have_no_finite_map_are_refused(
    saddle, controller, periods, argument, required
):
    with pytest.raises(InvalidInput, match=required) as caught:
        im.find_periodic_orbit(im.Controlled(BEAM, controller), periods, guess=saddle.state)
    assert caught.value.argument == argument


def test_delayed_feedback_has_no_finite_tangent():
    flow = im.flows.rossler()
    for system in (
        im.Controlled(BEAM, im.DelayedFeedback(0.1)),
        im.Controlled(BEAM, im.IntervalFeedback(0.1, 0.02)),
        im.Controlled(flow, im.DelayedFeedback(0.1, 5.8, signal="y")),
    ):
        for ask in (im.tangent_map, im.lyapunov_spectrum):
            with pytest.raises(InvalidInput, match="required: ") as caught:
                ask(system, duration=1.0)
            assert caught.value.argument == "system"
    with pytest.raises(InvalidInput, match="orbit_stability"):
        im.find_periodic_orbit(system)


def test_a_machine_under_ogy_keeps_the_section_of_its_orbit(nudged, saddle):

    with pytest.raises(InvalidInput, match="orbit's section") as caught:
        im.find_periodic_orbit(nudged, guess=saddle.state, phase=1.0)
    assert caught.value.argument == "phase"


def test_a_diagram_of_a_held_machine_has_its_exponents(nudged):
    look = {"periods": 20, "transient": 150, "exponents": True, "workers": 1}
    found = im.bifurcation_diagram(lambda frequency: nudged, [1.0], **look)
    period = 2 * math.pi / BEAM.angular_forcing_frequency
    expected = math.log(abs(nudged.controller.multipliers[0])) / period
    assert found.periods[0] == 1
    assert found.exponents[0, 0] == pytest.approx(expected, rel=1e-4)
