"""Spikes of flows against closed forms, what is refused, and runs that end early."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest
from scipy.optimize import brentq

import impactsig
from impactsig import (
    Flow,
    InvalidInput,
    flows,
    integrate_and_fire,
    simulate,
    threshold_crossings,
)
from impactsig.dynamics.tangents import lyapunov
from impactsig.simulation.flows import course


def turning(t, y, omega):
    return omega * y[1], -omega * y[0]


def biased(y):
    return 2 + y[0]


def wavering(y):
    return 0.1 + y[0]


def first(y):
    return y[0]


CIRCLE = Flow(turning, (1, 0), (1.0,))  # (cos t, -sin t)


def crossings_of_cosine(level, count):
    """All instants at which cos t = level."""
    turn = 2 * np.pi * np.arange(count)
    angle = math.acos(level)
    return np.sort(np.concatenate([turn + angle, turn + 2 * np.pi - angle]))[:count]


# -- closed forms ------------------------------------------------------------------------------


@pytest.mark.parametrize("level", [0.3, 0.0, -0.97])
def test_crossings_of_a_circle(level):
    exact = crossings_of_cosine(level, 100)
    both = threshold_crossings(CIRCLE, level, direction="both", count=100)
    np.testing.assert_allclose(both.time, exact, rtol=0, atol=1e-10)
    down = threshold_crossings(CIRCLE, level, direction="down", count=50)
    np.testing.assert_array_equal(down.time, both.time[::2])
    up = threshold_crossings(CIRCLE, level, count=50)
    np.testing.assert_array_equal(up.time, both.time[1::2])


@pytest.mark.parametrize("signal", ["x", first])
def test_a_visit_shorter_than_a_step_is_seen(signal):
    # cos t is above 1 - 1e-6 for 0.0028 at a time: a fiftieth of a step.
    level = 1 - 1e-6
    train = threshold_crossings(CIRCLE, level, signal=signal, direction="both", count=201)
    np.testing.assert_allclose(train.time, crossings_of_cosine(level, 201), rtol=0, atol=1e-8)


def test_what_is_out_of_reach_is_not_crossed():
    train = threshold_crossings(CIRCLE, 1 + 1e-9, direction="both", duration=500)
    assert len(train) == 0
    assert "no spike" in train.reason
    assert train.duration == 500


def test_starting_on_the_level_is_no_crossing():
    train = threshold_crossings(Flow(turning, (0, 1), (1.0,)), 0.0, direction="both", count=6)
    np.testing.assert_allclose(train.time, np.pi * np.arange(1, 7), rtol=0, atol=1e-12)


def test_a_coordinate_and_a_function_that_gives_it_agree_to_the_bit():
    # Steps in which a coordinate cannot reach the level are skipped, those of a function are not.
    options = {"level": 5.0, "direction": "both", "count": 300, "transient": 20}
    skipped = threshold_crossings(flows.rossler(), signal="x", **options)
    searched = threshold_crossings(flows.rossler(), signal=first, **options)
    np.testing.assert_array_equal(skipped.time, searched.time)


def test_a_signal_that_is_no_polynomial():
    # exp(cos t) = 2
    train = threshold_crossings(CIRCLE, 2.0, signal=_exponential, direction="both", count=50)
    np.testing.assert_allclose(train.time, crossings_of_cosine(math.log(2), 50), rtol=0, atol=1e-11)


def _exponential(y):
    return math.exp(y[0])


@pytest.mark.parametrize("threshold", [40.0, 1.0, 1e-3])
def test_firing_is_where_the_integral_is_a_multiple_of_the_threshold(threshold):
    # The integral of 2 + cos t is 2 t + sin t.
    train = integrate_and_fire(CIRCLE, threshold, signal=biased, count=2000)
    integral = 2 * train.time + np.sin(train.time)
    np.testing.assert_allclose(integral, threshold * np.arange(1, 2001), rtol=1e-13, atol=1e-12)


def test_a_signal_of_both_signs_fires_at_first_passages():
    # The integral of 0.1 + cos t rises and falls; its running maximum decides.
    def integral(t):
        return 0.1 * t + math.sin(t)

    train = integrate_and_fire(CIRCLE, 0.3, signal=wavering, count=60)
    fine = np.linspace(0, train.stop + 1, 400_000)
    highest = np.maximum.accumulate(0.1 * fine + np.sin(fine))
    for n, time in enumerate(train.time, start=1):
        after = np.searchsorted(highest, 0.3 * n)
        exact = brentq(lambda t, n=n: integral(t) - 0.3 * n, fine[after - 1], fine[after])
        assert time == pytest.approx(exact, abs=1e-9)


def test_time_may_stand_in_the_function():
    driven = Flow(lambda t, y: (math.cos(t),), (0.0,))
    train = threshold_crossings(driven, 0.5, count=20)
    np.testing.assert_allclose(
        train.time, np.pi / 6 + 2 * np.pi * np.arange(20), rtol=0, atol=1e-11
    )


def test_flows_of_other_dimensions_and_kinds_of_rates():
    # Four coordinates and the integral: more than one block of the kernel's loops.
    two = Flow(lambda t, y: np.array([y[1], -y[0], 2 * y[3], -2 * y[2]]), (1, 0, 1, 0))
    assert two.coordinates == ("y0", "y1", "y2", "y3")
    train = threshold_crossings(two, 0.3, signal="y2", direction="both", count=40)
    np.testing.assert_allclose(train.time, crossings_of_cosine(0.3, 40) / 2, rtol=0, atol=1e-11)
    fired = integrate_and_fire(two, 1.0, signal=biased, count=40)
    np.testing.assert_allclose(
        2 * fired.time + np.sin(fired.time), np.arange(1, 41), rtol=0, atol=1e-11
    )
    # A whole number among the rates, and one coordinate only.
    steady = Flow(lambda t, y: (y[0] * 0.0, 1), (2.0, 0.0))
    np.testing.assert_allclose(
        integrate_and_fire(steady, 3.0, signal="x", count=4).time, [1.5, 3, 4.5, 6], rtol=1e-13
    )


def test_states_on_a_circle():
    motion = simulate(CIRCLE, duration=30.0, transient=10.0)
    assert (motion.start, motion.stop, motion.status) == (10.0, 40.0, "complete")
    time = np.linspace(10, 40, 3001)
    exact = np.stack([np.cos(time), -np.sin(time)], axis=1)
    np.testing.assert_allclose(motion.sample(time), exact, rtol=0, atol=1e-11)
    np.testing.assert_allclose(motion.final, exact[-1], rtol=0, atol=1e-11)
    other = simulate(CIRCLE, duration=20.5, initial=(0, 1))
    asked = np.array([[20.5, 1], [0, 1]])  # in any order and shape
    np.testing.assert_allclose(other.sample(asked)[..., 0], np.sin(asked), rtol=0, atol=1e-11)
    np.testing.assert_array_equal(other.sample(0.0), [0, 1])
    assert other.sample([]).shape == (0, 2)
    assert "t = 0 to 20.5" in repr(other)


def test_states_do_not_depend_on_what_else_is_asked_for(monkeypatch):
    from impactsig.simulation.flows import flow_motion

    motion = simulate(flows.lorenz(), duration=30.0, transient=5.0)
    time = np.linspace(5, 35, 201)
    whole = motion.sample(time)
    np.testing.assert_array_equal(motion.sample(time[::-7]), whole[::-7])
    np.testing.assert_array_equal(motion.sample(motion.stop), motion.final)
    late = simulate(flows.lorenz(), duration=10.0, transient=25.0)
    np.testing.assert_array_equal(late.sample(time[time >= 25]), whole[time >= 25])
    monkeypatch.setattr(flow_motion, "STEPS", 7)
    pieces = simulate(flows.lorenz(), duration=30.0, transient=5.0)
    assert len(pieces._marks) > 20
    np.testing.assert_array_equal(pieces.sample(time), whole)


def test_a_flow_goes_on_from_where_it_ended():
    first = simulate(flows.lorenz(), duration=3.0)
    rest = simulate(flows.lorenz(), duration=2.0, initial=first.final)
    whole = simulate(flows.lorenz(), duration=5.0)
    np.testing.assert_allclose(rest.final, whole.final, rtol=1e-9)


# -- runs --------------------------------------------------------------------------------------


def test_count_and_duration_find_the_same():
    by_count = integrate_and_fire(flows.rossler(), 20, count=50, transient=30)
    assert len(by_count) == 50
    assert by_count.start == 30
    assert by_count.stop == by_count.time[-1]
    span = by_count.time[40] + 1e-9 - 30
    by_duration = integrate_and_fire(flows.rossler(), 20, duration=span, transient=30)
    assert len(by_duration) == 41
    assert by_duration.stop == pytest.approx(30 + span)
    np.testing.assert_allclose(by_duration.time, by_count.time[:41], rtol=0, atol=1e-11)


def test_a_transient_is_a_later_start():
    settled = simulate(flows.lorenz(), duration=5.0).final
    late = integrate_and_fire(flows.lorenz(), 20, count=20, transient=5.0)
    anew = integrate_and_fire(flows.lorenz(), 20, count=20, initial=settled)
    np.testing.assert_allclose(late.time - 5, anew.time, rtol=0, atol=1e-11)


def test_a_run_in_pieces_is_the_whole(monkeypatch):
    from impactsig.simulation.flows import course as _course

    def run():
        fired = integrate_and_fire(flows.lorenz(), 20, count=30)
        crossed = threshold_crossings(flows.lorenz(), 20, signal="z", duration=20.0)
        return fired.time, crossed.time

    whole = run()
    monkeypatch.setattr(_course, "STEPS", 7)
    monkeypatch.setattr(_course, "PATIENCE", 1000)
    for one, other in zip(whole, run(), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_flow_that_leaves_for_infinity_says_so():
    # y = 1 / (1 - t)
    bursting = Flow(lambda t, y: (y[0] ** 2,), (1.0,))
    train = threshold_crossings(bursting, 10.0, duration=5)
    assert train.time == pytest.approx([0.9], abs=1e-12)
    assert "left the finite numbers at t = 1" in train.reason
    assert train.stop == pytest.approx(1, abs=1e-6)
    motion = simulate(bursting, duration=2.0)
    np.testing.assert_allclose(motion.sample([0.0, 0.5])[:, 0], [1, 2], rtol=1e-12)
    assert motion.status == "diverged"
    assert motion.stop == pytest.approx(1, abs=1e-6)
    assert "diverged" in repr(motion)
    with pytest.raises(InvalidInput, match=r"time.*0 to 1, where the flow diverged"):
        motion.sample(1.5)
    gone = threshold_crossings(bursting, 10.0, count=3, transient=4)
    assert len(gone) == 0
    assert "t = 1" in gone.reason


def test_a_flow_whose_steps_shrink_without_end_is_not_followed_for_ever(monkeypatch):
    monkeypatch.setattr(course, "PATIENCE", 2)
    monkeypatch.setattr(lyapunov, "STEPS", 5000)
    # It turns faster and faster, within e^(1e8 t).
    whirling = Flow(lambda t, y: (-y[1] * y[2], y[0] * y[2], 1e8 * y[2]), (1.0, 0.0, 1.0))
    motion = simulate(whirling, duration=5.0)
    assert motion.status == "work limit"
    assert 0 < motion.stop < 1e-5
    with pytest.raises(InvalidInput, match="where its steps became too short to go on"):
        motion.sample(1.0)
    train = threshold_crossings(whirling, 2.0, duration=5.0)
    assert len(train) == 0
    assert "too short to go on" in train.reason
    assert impactsig.lyapunov_spectrum(flows.rossler(0.2, -1, -1), duration=5.0).status == (
        "work limit"
    )


def test_a_function_that_raises_ends_the_run():
    def falling(t, y):
        if y[0] < 0:
            raise ValueError
        return (-1.0,)

    def wary(y):
        return math.sqrt(y[0] - 0.5)

    train = threshold_crossings(Flow(falling, (1.0,)), 0.25, direction="down", duration=2)
    assert train.time == pytest.approx([0.75], abs=1e-12)
    assert "t = 1" in train.reason
    # The signal is not a number below 0.5.
    train = threshold_crossings(
        Flow(falling, (1.0,)), 0.6, signal=wary, direction="down", duration=0.9
    )
    assert "left the finite numbers" in train.reason


def test_a_flow_that_comes_to_rest_is_not_waited_for():
    still = Flow(lambda t, y: (0.0,), (0.0,))
    train = threshold_crossings(still, 1.0, count=3)
    assert len(train) == 0
    assert "no further spike" in train.reason
    assert integrate_and_fire(still, 1.0, signal=first, duration=10.0).reason


def test_the_kernels_are_found_in_the_cache_whatever_the_flow():
    threshold_crossings(CIRCLE, 0.5, count=2)
    simulate(CIRCLE, duration=1.0)
    probe = (
        "from impactsig import Flow, simulate, threshold_crossings\n"
        "flow = Flow(lambda t, y: (2 * y[1], -y[0]), (1, 0))\n"
        "threshold_crossings(flow, 0.5, signal=lambda y: y[0] + y[1], count=2)\n"
        "simulate(flow, duration=1.0)\n"
        "from impactsig.simulation.flows.flow_spikes import spikes\n"
        "from impactsig.simulation.flows.flow_steps import states\n"
        "print(*[sum(kernel.stats.cache_misses.values()) for kernel in (spikes, states)])\n"
    )
    run = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["0", "0"]


# -- refusals ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("argument", "options"),
    [
        ("threshold", {"threshold": 0, "count": 1}),
        ("threshold", {"threshold": -1, "count": 1}),
        ("threshold", {"threshold": math.nan, "count": 1}),
        ("count, duration", {"threshold": 1}),
        ("count, duration", {"threshold": 1, "count": 1, "duration": 1}),
        ("count", {"threshold": 1, "count": 0}),
        ("count", {"threshold": 1, "count": 1.5}),
        ("duration", {"threshold": 1, "duration": 0}),
        ("duration", {"threshold": 1, "duration": math.inf}),
        ("transient", {"threshold": 1, "count": 1, "transient": -1}),
        ("initial", {"threshold": 1, "count": 1, "initial": (1, 2)}),
        ("initial", {"threshold": 1, "count": 1, "initial": 1}),
        ("initial", {"threshold": 1, "count": 1, "initial": (1, 2, math.nan)}),
        ("signal", {"threshold": 1, "count": 1, "signal": "w"}),
        ("signal", {"threshold": 1, "count": 1, "signal": 3}),
        ("signal", {"threshold": 1, "count": 1, "signal": lambda y: y.unheard_of}),
        ("signal", {"threshold": 1, "count": 1, "signal": lambda y: y}),
    ],
)
def test_what_cannot_be_is_refused_by_name(argument, options):
    with pytest.raises(InvalidInput) as caught:
        integrate_and_fire(flows.lorenz(), **options)
    assert caught.value.argument == argument


def test_other_refusals():
    with pytest.raises(InvalidInput, match=r"direction.*sideways"):
        threshold_crossings(CIRCLE, 0.1, direction="sideways", count=1)
    with pytest.raises(InvalidInput, match="level"):
        threshold_crossings(CIRCLE, math.inf, count=1)
    with pytest.raises(InvalidInput, match="the flow has none"):
        integrate_and_fire(CIRCLE, 1.0, count=1)
    for wrong in ("lorenz", None):
        with pytest.raises(InvalidInput, match=r"flow.*impactsig.flows"):
            integrate_and_fire(wrong, 1.0, signal="x", count=1)
        with pytest.raises(InvalidInput, match=r"system.*a Flow"):
            simulate(wrong, duration=1.0)


def test_a_flow_that_numba_cannot_compile_says_what_numba_says():
    with pytest.raises(InvalidInput, match="numba says") as caught:
        simulate(Flow(lambda t, y: y.unheard_of, (1.0,)), duration=1.0)
    assert caught.value.argument == "function"
    with pytest.raises(InvalidInput, match="2 parameters"):
        simulate(Flow(turning, (1, 0), (1.0, 2.0)), duration=1.0)
    with pytest.raises(InvalidInput, match="3 rates"):
        simulate(Flow(turning, (1, 0, 0), (1.0,)), duration=1.0)


@pytest.mark.parametrize(
    ("argument", "options"),
    [
        ("function", {"function": 3, "initial": (1,)}),
        ("initial", {"initial": ()}),
        ("initial", {"initial": 1.0}),
        ("initial", {"initial": (1, math.inf)}),
        ("parameters", {"initial": (1,), "parameters": "a"}),
        ("coordinates", {"initial": (1, 2), "coordinates": ("x",)}),
        ("coordinates", {"initial": (1, 2), "coordinates": ("x", "x")}),
        ("signal", {"initial": (1,), "signal": "x"}),
    ],
)
def test_a_flow_is_checked_when_made(argument, options):
    with pytest.raises(InvalidInput) as caught:
        Flow(**({"function": turning} | options))
    assert caught.value.argument == argument


@pytest.mark.parametrize(
    ("argument", "options"),
    [
        ("duration", {}),
        ("duration", {"duration": 0}),
        ("transient", {"duration": 1, "transient": -1}),
        ("initial", {"duration": 1, "initial": (1, 2, 3)}),
        ("periods", {"periods": 3}),
        ("phase", {"duration": 1, "phase": 0.0}),
        ("method", {"duration": 1, "method": "splitting"}),
        ("chatter", {"duration": 1, "chatter": 1e-4}),
        ("seed", {"duration": 1, "seed": 1}),
        ("keep", {"duration": 1, "keep": "counts"}),
    ],
)
def test_a_run_of_a_flow_is_checked(argument, options):
    with pytest.raises(InvalidInput) as caught:
        simulate(CIRCLE, **options)
    assert caught.value.argument == argument


@pytest.mark.parametrize("time", [-0.1, 1.1, math.nan, "soon", [[0.5], [2.0]]])
def test_times_outside_the_span_are_refused(time):
    with pytest.raises(InvalidInput) as caught:
        simulate(CIRCLE, duration=1.0).sample(time)
    assert caught.value.argument == "time"


def test_what_is_shown():
    assert repr(flows.lorenz()) == "Flow(Lorenz, 10, 28, 2.66667; x, y, z)"
    assert flows.rossler().dimension == 3
    train = impactsig.integrate_and_fire(flows.rossler(), 20, count=3)
    assert train.source == "Rössler"
    assert train.threshold == 20
    assert train.settings["signal"] == "rossler_signal"
