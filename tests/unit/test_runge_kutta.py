"""The stepping engine: cut runs, functions that fail, samples, roots that are not missed."""

from __future__ import annotations

import math

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from impactsig import Force, InvalidInput, KelvinVoigt, Oscillator, Rigid, Stop
from impactsig.oscillators import Friction, Hertz
from impactsig.simulation.basis.contract import Moment
from impactsig.simulation.basis.events import (
    BROKEN,
    DIVERGED,
    DONE,
    EXHAUSTED,
    IMPACT,
    MARK,
    PART,
    RELEASE,
    REVERSE,
    START,
    STICK,
    TOUCH,
)
from impactsig.simulation.stepping.runge_kutta import FixedStep, RungeKutta, SteppingEngine
from tests.drive import drive

METHODS = [RungeKutta(1e-9), FixedStep(200)]
# All kinds of stops and forces at once.
EVERYTHING = Oscillator(
    mass=1.3,
    damping=0.05,
    forces=(Force(3.0, 1.1), Force(1.0, 1.1 * math.sqrt(2), 0.3)),
    load=0.1,
    stops=(
        Stop(1.0, KelvinVoigt(10.0, 2.0, ends="force")),
        Stop(0.6, Hertz(5.0, restitution=0.7)),
        Stop(1.2, Rigid(lambda v: 0.6)),
        Stop(-0.8, Hertz(50.0, 2.0, damping=0.2), "lower"),
        Stop(-0.5, KelvinVoigt(10.0, 0.5), "lower"),
    ),
    friction=Friction(0.3, 0.8),
    law=lambda t, x, v: -0.1 * x**3 + 0.05 * math.sin(0.3 * t),
)
BALL = Oscillator(stiffness=0, load=1.0, stops=(Stop(0.0, Rigid(0.5)),))


@pytest.mark.parametrize(
    ("make", "argument"),
    [
        (lambda: RungeKutta(0), "tolerance"),
        (lambda: RungeKutta(math.nan), "tolerance"),
        (lambda: RungeKutta("fine"), "tolerance"),
        (lambda: RungeKutta(1e-15), "tolerance"),
        (lambda: FixedStep(7), "steps"),
        (lambda: FixedStep(100.5), "steps"),
    ],
)
def test_options_out_of_range_are_refused_by_name(make, argument):
    with pytest.raises(InvalidInput) as caught:
        make()
    assert caught.value.argument == argument


@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_a_run_in_pieces_is_the_whole_run_to_the_last_bit(method):
    whole = drive(EVERYTHING, method, 300.0, 0.2, 0.5, phase=0.4, room=100_000)
    assert whole.status == DONE
    for kind in (IMPACT, STICK, RELEASE, TOUCH, PART, REVERSE, MARK):
        assert len(whole.of(kind)) > 0
    for room in (12, 37, 0):
        cut = drive(EVERYTHING, method, 300.0, 0.2, 0.5, phase=0.4, room=room)
        assert (cut.state == whole.state).all()
        assert (cut.clock == whole.clock).all()
        assert (cut.count[:5] == whole.count[:5]).all()
        if room:
            assert (cut.rows == whole.rows).all()


@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_a_run_whose_work_ends_goes_on_as_it_would_have(method):
    engine = SteppingEngine(EVERYTHING, method)
    ends = []
    for legs in (10**6, 7):
        state, count = engine.begin(0.2, 0.5, 0.0)
        clock, events = np.zeros(3), np.empty((10_000, 8))
        rows = []
        while engine.run(Moment(clock, state, count), events, (20.0, 0.0), legs) == EXHAUSTED:
            rows.append(events[: count[5]].copy())
        rows.append(events[: count[5]].copy())
        ends.append((state, clock, np.concatenate(rows)))
    for one, other in zip(*ends, strict=True):
        assert (one == other).all()


@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_rows_tell_a_motion_that_can_be(method):
    run = drive(EVERYTHING, method, 300.0, 0.2, 0.5)
    assert (np.diff(run.time) >= 0).all()
    assert np.isfinite(run.rows).all()
    hits = run.of(IMPACT)
    assert (run.x[hits] == 1.2).all()
    assert -run.v[hits] == pytest.approx(0.6 * run.approach[hits], rel=1e-14)
    where = {k: stop.position for k, stop in enumerate(EVERYTHING.stops)}
    for k, position in where.items():
        begins = run.of(TOUCH)[run.stop[run.of(TOUCH)] == k]
        ends = run.of(PART)[run.stop[run.of(PART)] == k]
        assert 0 <= len(begins) - len(ends) <= 1
        assert (run.time[ends] > run.time[begins[: len(ends)]]).all()
        if k != 0:  # that one parts at no force, and is touched again there
            assert run.x[np.concatenate([begins, ends])] == pytest.approx(position, abs=0)
    assert (run.v[run.of(STICK)] == 0).all()
    assert (run.v[run.of(REVERSE)] == 0).all()
    assert run.count[2] == len(hits) + len(run.of(TOUCH))
    assert run.count[3] == len(run.of(STICK))
    # A state to go on from is never far, but where it sticks.
    moving = run.kind[:-1] != STICK
    assert np.diff(run.time)[moving].max() < 1.3 * 2 * math.pi / 1.1


@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_samples_meet_the_events_on_both_sides(method):
    run = drive(EVERYTHING, method, 100.0, 0.2, 0.5)
    x, _ = run.at(run.time)
    assert x == pytest.approx(run.x, abs=1e-7)
    x, v = run.at(run.time[1:] - 1e-10)
    assert x == pytest.approx(run.x[1:], abs=1e-5)
    hits = np.flatnonzero(np.isin(run.kind[1:], (IMPACT, TOUCH)))
    assert np.abs(v[hits]) == pytest.approx(run.approach[1:][hits], abs=1e-5)
    shuffled = np.random.default_rng(2).permutation(np.linspace(0, 100, 999))
    sampled = run.at(shuffled)
    again = run.at(np.sort(shuffled))
    assert (sampled[0][np.argsort(shuffled)] == again[0]).all()
    assert (sampled[1][np.argsort(shuffled)] == again[1]).all()


def test_the_greatest_force_is_at_least_any_sampled():
    run = drive(EVERYTHING, RungeKutta(1e-9), 100.0, 0.2, 0.5)
    begins = run.of(TOUCH)[run.stop[run.of(TOUCH)] == 4]
    ends = np.array([
        next((r for r in run.of(PART) if r > b and run.stop[r] == 4), len(run.rows)) for b in begins
    ])  # fmt: skip
    peak = run.engine.peaks(run.rows, begins, ends, tuple(run.clock[:2]))
    last = np.append(run.time, 100.0)
    for b, e, top in zip(begins, ends, peak, strict=True):
        x, v = run.at(np.linspace(run.time[b], last[e], 400)[:-1])
        force = 10 * (-0.5 - x) - 0.5 * v
        assert top == pytest.approx(force.max(), rel=1e-3)
        assert top >= force.max() * (1 - 1e-7)


def test_a_contact_under_way_when_rows_begin_keeps_its_approach_velocity():
    stop = (Stop(0.5, Hertz(100.0, restitution=0.5)),)
    engine = SteppingEngine(Oscillator(stiffness=0, stops=stop), RungeKutta(1e-12))
    state, count = engine.begin(0.0, 1.0, 0.0)
    clock, none, events = np.zeros(3), np.empty((0, 8)), np.empty((64, 8))
    assert engine.run(Moment(clock, state, count), none, (0.0, 0.6), 10**6) == DONE
    first = [*clock[:2], START, -1, count[0], state[0], state[1], 0.0]
    assert engine.run(Moment(clock, state, count), events, (0.0, 1.4), 10**6) == DONE
    rows = np.concatenate([[first], events[: count[5]]])
    assert rows[1, 2] == MARK
    assert rows[1, 7] == pytest.approx(1.0, rel=1e-12)
    (part,) = np.flatnonzero(rows[:, 2] == PART)
    q, v = engine.sample(rows, np.array([1]), rows[[part], 0], rows[[part], 1])
    assert q + 0 == pytest.approx(0.5, abs=1e-10)
    assert v == pytest.approx(rows[[part], 6], rel=1e-9)


@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_a_bouncing_ball_comes_to_rest(method):
    """From height 1/2 under g = 1: at rest after sqrt(2 H / g) (1 + r) / (1 - r)."""
    run = drive(BALL, method, 10.0, -0.5, 0.0)
    (stick,) = run.of(STICK)
    assert run.time[stick] == pytest.approx(3.0, rel=1e-12)
    assert run.end == (0.0, 0.0)
    assert run.state[3] == pytest.approx(0.5, rel=1e-12)


def test_a_restitution_that_is_a_function_is_what_it_returns():
    def half(v):
        return 0.5

    def weak(v):
        return 0.9 if v > 0.3 else 0.2

    same = drive(Oscillator(stiffness=0, load=1.0, stops=(Stop(0.0, Rigid(half)),)),
                 RungeKutta(), 10.0, -0.5, 0.0)  # fmt: skip
    assert same.time[same.of(STICK)] == pytest.approx([3.0], rel=1e-12)
    run = drive(Oscillator(stiffness=0, load=1.0, stops=(Stop(0.0, Rigid(weak), "upper"),)),
                RungeKutta(), 40.0, -0.5, 0.0)  # fmt: skip
    hits = run.of(IMPACT)
    kept = np.where(run.approach[hits] > 0.3, 0.9, 0.2)
    assert -run.v[hits] == pytest.approx(kept * run.approach[hits], rel=1e-14)
    assert set(kept) == {0.9, 0.2}


@pytest.mark.parametrize("restitution", [lambda v: 1.01, lambda v: -0.1, lambda v: math.nan])
def test_a_restitution_that_cannot_be_ends_the_run(restitution):
    ball = Oscillator(stiffness=0, load=1.0, stops=(Stop(0.0, Rigid(restitution)),))
    run = drive(ball, RungeKutta(), 10.0, -0.5, 0.0)
    assert run.status == BROKEN
    assert run.clock[1] / run.engine.omega == pytest.approx(1.0, rel=1e-12)


def nan_law(t, x, v):
    return math.nan if t > 2.5 else 0.0


def raising_law(t, x, v):
    if t > 2.5:
        raise ValueError("no more")
    return 0.0


@pytest.mark.parametrize("law", [nan_law, raising_law, numba.njit(nan_law)])
@pytest.mark.parametrize("method", METHODS, ids=repr)
def test_a_law_that_fails_ends_the_run_and_keeps_what_was(method, law):
    ball = Oscillator(stiffness=0, load=1.0, stops=(Stop(0.0, Rigid(0.9)),), law=law)
    run = drive(ball, method, 10.0, -0.5, 0.0)
    assert run.status == BROKEN
    assert run.time[run.of(IMPACT)] == pytest.approx([1.0], rel=1e-12)
    reached = (run.clock[0] * 2 * math.pi + run.clock[1]) / run.engine.omega
    step = 2 * math.pi / 200 if isinstance(method, FixedStep) else 1e-9
    assert 2.5 - step < reached <= 2.5 + 1e-12
    assert np.isfinite(run.state[:4]).all()


def test_functions_that_numba_cannot_compile_are_named():
    bad = Oscillator(law=lambda t, x, v: object())
    with pytest.raises(InvalidInput, match="numba") as caught:
        SteppingEngine(bad, RungeKutta())
    assert caught.value.argument == "law"
    bad = Oscillator(stops=(Stop(1.0, Rigid(lambda v: object())),))
    with pytest.raises(InvalidInput) as caught:
        SteppingEngine(bad, RungeKutta())
    assert caught.value.argument == "restitution"


def test_a_motion_without_bound_says_so():
    run = drive(Oscillator(law=lambda t, x, v: 900.0 * x), RungeKutta(), 100.0, 1.0, 0.0)
    assert run.status == DIVERGED


def test_nothing_moves_that_rests():
    run = drive(Oscillator(load=2.0), RungeKutta(), 100.0, 2.0, 0.0)
    assert run.end == (2.0, 0.0)
    assert run.count[6] < 1000


def test_late_periods_are_as_exact_as_early_ones():
    swing = Oscillator(damping=0.1, forces=(Force(1.0, 1.7), Force(1.0, 1.7 * 1.25)))
    engine = SteppingEngine(swing, RungeKutta(1e-12))
    ends = []
    for turns in (0.0, 4e12):
        state, count = engine.begin(0.3, 0.1, 0.0)
        clock = np.array([turns, 0.0, 0.0])
        engine.run(Moment(clock, state, count), np.empty((0, 8)), (turns + 4, 1.0), 10**6)
        ends.append(state[:2].copy())
    assert ends[0] == pytest.approx(ends[1], rel=1e-13)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=1, max_size=7), st.floats(-3, 0))
def test_no_root_of_a_polynomial_is_missed(roots, power):
    """Products of (r - x): the first root in (0, 1) is found, or found to be of even order."""
    from impactsig.simulation.basis.roots import first_root

    # Apart, so that which is first and of which order is clear in double precision.
    roots = sorted({round(r, 1) + 0.05 for r in roots})
    x = np.array([r for r in roots if 0 < r < 1])
    n = len(roots)
    monomial = np.polynomial.polynomial.polyfromroots(roots) * 10**power
    monomial *= np.sign(monomial[0])
    stack = np.empty((64, 10))
    for i in range(n + 1):
        stack[0, i] = sum(
            math.comb(i, k) / math.comb(n, k) * monomial[k] for k in range(i + 1)
        )  # fmt: skip
    expected = x.min() if len(x) else 2.0
    assert first_root(stack, n) == pytest.approx(expected, abs=1e-9)
