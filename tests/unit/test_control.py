"""Control: what may be given, what comes back, and that nothing depends on how it is asked."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from impactsig import (
    OGY,
    Controlled,
    DelayedFeedback,
    FixedStep,
    Flow,
    Friction,
    Hertz,
    InvalidInput,
    KelvinVoigt,
    Oscillator,
    Rigid,
    RungeKutta,
    Stop,
    find_periodic_orbit,
    flows,
    impact_map,
    orbit_stability,
    plot,
    scenes,
    simulate,
    stability_chart,
)
from impactsig.control.running import delayed as _delayed
from impactsig.control.running.delays.line import cut
from impactsig.dynamics.periodic.collocation import chebyshev
from impactsig.oscillators import BaseMotion, Force
from impactsig.results import ControlledMotion
from impactsig.simulation.basis.delay import bernstein

BEAM = scenes.karpodinis(20.3355)
LOCK = DelayedFeedback(0.15, 1, limit=0.1)


@pytest.fixture(scope="module")
def locked():
    return simulate(Controlled(BEAM, LOCK, start=60), periods=120)


@pytest.fixture(scope="module")
def orbit():
    return find_periodic_orbit(BEAM, 1, impacts=1)


# -- machines of every kind ----------------------------------------------------------------------

FORCED = {"damping": 0.06, "forces": (Force(0.5, 0.9),)}
MACHINES = {
    "rigid, chattering and sticking": scenes.okolewski(3, 0.6),
    "soft": scenes.okolewski(4, 0.8, "soft", stop_stiffness=2000.0),
    "only pushes": Oscillator(**FORCED, stops=(Stop(1.0, KelvinVoigt(50.0, 2.0, "force")),)),
    "Hertz": Oscillator(**FORCED, stops=(Stop(1.0, Hertz(100.0, damping=0.3)),)),
    "friction": scenes.begley_virgin(1.338, 1.6, 0.05),
    "friction and a rigid stop": Oscillator(
        damping=0.04, forces=(Force(1.0, 1.3),), stops=(Stop(0.8, Rigid(0.6)),),
        friction=Friction(0.05),
    ),
}  # fmt: skip


@pytest.mark.parametrize("machine", MACHINES)
def test_without_gain_it_is_the_simulation(machine):
    oscillator = MACHINES[machine]
    plain = simulate(oscillator, periods=12, method=RungeKutta(1e-12))
    same = simulate(Controlled(oscillator, DelayedFeedback(0.0)), periods=12)
    time = np.linspace(0, plain.stop, 301)
    for a, b in zip(plain.sample(time), same.sample(time), strict=True):
        np.testing.assert_allclose(b, a, atol=1e-8)
    assert len(same.impacts) == len(plain.impacts)
    assert same.stick_count == plain.stick_count
    np.testing.assert_allclose(same.impacts.time, plain.impacts.time, atol=1e-8)
    assert same.energy_lost == pytest.approx(plain.energy_lost, rel=1e-8)
    if plain.impacts.peak is not None:
        np.testing.assert_allclose(same.impacts.peak, plain.impacts.peak, rtol=1e-6)
    assert not same.force(time).any()


@pytest.mark.parametrize("signal", ["velocity", "displacement"])
@pytest.mark.parametrize("machine", MACHINES)
def test_newtons_law_holds_under_control(machine, signal):
    """Between events the velocity gains what all forces add up to, the control force among them."""
    oscillator = MACHINES[machine]
    size = float(np.abs(simulate(oscillator, periods=12).sample(np.linspace(0, 1, 9))[1]).max())
    feedback = DelayedFeedback(0.3, 1, limit=0.05 * size, signal=signal)
    motion = simulate(Controlled(oscillator, feedback, start=3), periods=12)
    rows = motion._segments
    unit = oscillator.time_unit / motion._engine.omega
    line = motion._engine.line
    begins = (line.when[:, 0] * 2 * np.pi + line.when[:, 1] - motion._phase) * unit
    nodes, weights = np.polynomial.legendre.leggauss(12)
    events = rows[:, 0] * 2 * np.pi + rows[:, 1]
    spans = np.flatnonzero(line.when[:, 2] * unit > 1e-3)
    tried = 0
    for j in spans[len(spans) // 3 :: 7]:
        h = line.when[j, 2] * unit
        low, high = begins[j] + 1e-9 * h, begins[j] + (1 - 1e-9) * h
        time = (low + high) / 2 + (high - low) / 2 * nodes
        x, v = motion.sample(time)
        where = np.searchsorted(events, (line.when[j, 0] * 2 * np.pi + line.when[j, 1]) + 1e-9)
        if rows[where - 1, 2] == 2:  # sticks
            continue
        push = pushes(oscillator, time, x, v) + motion.force(time)
        ends = motion.sample([low, high])[1]
        gained = push @ weights * (high - low) / 2 / oscillator.mass
        assert ends[1] - ends[0] == pytest.approx(gained, abs=1e-8 * max(1, np.abs(push).max() * h))
        tried += 1
    assert tried > 5
    _, rms = motion.effort()
    assert rms[3:].max() > 0


def pushes(oscillator, time, x, v):
    """All forces but the controlling one (SI units, no moving stops but Okolewski's)."""
    total = oscillator.load - oscillator.damping * v - oscillator.stiffness * x
    base = oscillator.base
    at = moving = 0.0
    if base is not None:
        angle = base.angular_frequency * time + base.phase
        at = base.amplitude * np.cos(angle)
        moving = -base.amplitude * base.angular_frequency * np.sin(angle)
        total = total + base.spring * oscillator.stiffness * at
        total = total + base.damper * oscillator.damping * moving
    for force in oscillator.forces:
        total = total + force.amplitude * np.cos(force.angular_frequency * time + force.phase)
    if base is not None and not base.stops:
        at = moving = 0.0
    if oscillator.friction is not None:
        total = total - oscillator.friction.kinetic * np.sign(v - moving)
    for stop in oscillator.stops:
        side, law = (1 if stop.side == "upper" else -1), stop.law
        depth, inward = side * (x - at - stop.position), side * (v - moving)
        if isinstance(law, KelvinVoigt):
            push = law.stiffness * depth + law.damping * inward
            push = np.maximum(push, 0) if law.ends == "force" else push
            total = total - side * np.where(depth > 0, push, 0.0)
        elif isinstance(law, Hertz):
            push = law.stiffness * np.maximum(depth, 0.0) ** law.exponent
            total = total - side * push * (1 + law.damping * inward)
    return total


def test_what_takes_a_motion_takes_it(locked):
    assert isinstance(locked, ControlledMotion)
    assert len(impact_map(locked)) == len(locked.impacts)
    assert locked.plot() is not None
    assert "Controlled" in repr(locked)
    assert plot.phase_portrait(locked) is not None
    x, v = locked.stroboscopic()
    assert locked.final[0] == pytest.approx(x[-1], abs=1e-12)
    assert locked.final[1] == pytest.approx(v[-1], abs=1e-12)


def test_effort_is_the_mean_square_of_the_force(locked):
    period = BEAM.forcing_period
    end, rms = locked.effort(2.5)
    assert len(end) == len(rms) == 48
    k = 24  # 60 to 62.5 periods: the force is strong, limited and has jumps
    time = np.linspace(end[k] - 2.5 * period, end[k], 400_001)
    force = locked.force((time[1:] + time[:-1]) / 2)
    assert rms[k] == pytest.approx(math.sqrt(np.mean(force**2)), rel=1e-4)
    assert np.abs(force).max() <= 0.1
    assert not locked.force(np.linspace(0, 59.9 * period, 500)).any()


def test_a_phase_cut_in_two_is_the_whole_and_the_line_may_grow():
    whole = simulate(Controlled(BEAM, [(20, LOCK)]), periods=260)
    pieces = simulate(Controlled(BEAM, [(20, LOCK), (45.3, LOCK), (200, LOCK)]), periods=260)
    narrow = _delayed.DelayedRun(BEAM, [LOCK], (0.0, 0.0), 0.0, None, 1e-6, rows=64)
    narrow.to(20.0, None)
    narrow.to(260.0, LOCK)
    assert narrow.number == len(whole._engine.line.laps) > 1000
    assert tuple(narrow.motion()[0].final) == tuple(whole.final)
    time = np.linspace(0, 50, 400) * BEAM.forcing_period
    for a, b in zip(whole.sample(time), pieces.sample(time), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-9)
    np.testing.assert_allclose(whole.final, pieces.final, atol=1e-9)


def test_a_delay_that_is_no_whole_number_of_periods():
    motion = simulate(Controlled(BEAM, DelayedFeedback(0.2, 0.37, limit=0.1), start=2), periods=10)
    period = BEAM.forcing_period
    time = np.linspace(3, 9.99, 200) * period
    now, then = motion.sample(time)[1], motion.sample(time - 0.37 * period)[1]
    np.testing.assert_allclose(
        motion.force(time), np.clip(0.2 * (then - now), -0.1, 0.1), atol=1e-9
    )


def test_a_memory_is_the_sum_over_all_delays():
    feedback = DelayedFeedback(0.1, 1, memory=0.4)
    motion = simulate(Controlled(BEAM, feedback, start=1), periods=9)
    period = BEAM.forcing_period
    time = np.linspace(7.01, 7.99, 90) * period
    weights = 0.6 * 0.4 ** np.arange(7)
    weights[-1] = 0.4**6  # the first delay, before which the memory was empty
    late = sum(c * motion.sample(time - (n + 1) * period)[1] for n, c in enumerate(weights))
    expected = 0.1 * (late - motion.sample(time)[1])
    near = np.abs(expected - motion.force(time))
    # Beside an impact the sample and the polynomial may lie on either side of it.
    assert np.count_nonzero(near > 1e-9) <= 1


def test_a_duration_is_so_many_periods():
    by_time = simulate(Controlled(BEAM, LOCK, start=5), duration=10 * BEAM.forcing_period)
    by_periods = simulate(Controlled(BEAM, LOCK, start=5), periods=10)
    assert by_time.final == pytest.approx(by_periods.final, abs=1e-9)


def test_a_run_that_goes_on_from_the_end_of_another():
    first = simulate(Controlled(BEAM, LOCK, start=20), periods=80)
    again = simulate(
        Controlled(BEAM, LOCK), periods=20, initial=first.final[:2], phase=first.final[2]
    )
    assert again.effort()[1][-1] < 1e-6
    np.testing.assert_allclose(again.final[:2], first.final[:2], atol=1e-6)


# -- gains that blow up --------------------------------------------------------------------------


def test_a_gain_that_blows_up_says_so_and_keeps_what_there_was():
    motion = simulate(Controlled(BEAM, DelayedFeedback(-3.0, 1), start=20), periods=200)
    assert motion.status == "diverged"
    assert 20 < motion.stop / BEAM.forcing_period < 200
    plain = simulate(BEAM, periods=19)
    time = np.linspace(0, plain.stop, 50)
    np.testing.assert_allclose(motion.sample(time)[0], plain.sample(time)[0], atol=1e-8)
    course = simulate(
        Controlled(flows.rossler(), DelayedFeedback(-5.0, 5.88, signal="y"), start=100),
        duration=200,
    )
    assert course.status == "diverged"
    assert "diverged" in repr(course)
    assert 100 < course.duration < 200
    assert np.isfinite(course.sample(np.linspace(0, course.duration, 100))).all()


@pytest.mark.parametrize(
    "feedback", [DelayedFeedback(-1.0, 1), DelayedFeedback(20.0, 1, signal="displacement")]
)
def test_a_gain_that_blows_up_before_a_hertz_stop_diverges_and_spends_no_work(feedback):
    """At speeds of 1e51 contacts take as many steps as a run may, and are but rounding."""
    machine = Oscillator(damping=0.1, stops=(Stop(1.0, Hertz(30.0)),), forces=(Force(0.5, 1.1),))
    motion = simulate(Controlled(machine, feedback, start=2), periods=300)
    assert motion.status == "diverged"
    assert motion.duration / machine.forcing_period < 300
    assert motion.impact_count < 1500
    assert 1e15 < max(np.abs(motion.final[:2])) < 1e18


def test_a_fast_start_is_no_divergence():
    machine = Oscillator(damping=0.1, stops=(Stop(1.0, Hertz(30.0)),), forces=(Force(0.5, 1.1),))
    motion = simulate(machine, initial=(0.0, 1e17), periods=2)
    assert motion.status == "complete"


def test_a_law_that_is_broken_ends_the_run():
    def law(t, x, v):
        return math.nan if t > 30 else 0.0

    oscillator = Oscillator(damping=0.1, forces=(Force(1.0, 0.9),), law=law)
    motion = simulate(Controlled(oscillator, DelayedFeedback(0.1)), periods=20)
    assert motion.status == "broken law"
    assert 25 < motion.stop <= 30.1


# -- OGY on other machines -----------------------------------------------------------------------


def test_ogy_before_a_soft_stop_and_under_a_stepped_law(orbit):
    soft = replace(BEAM, stops=(Stop(1.0, KelvinVoigt.equivalent(0.2, 2000.0)),))
    own = find_periodic_orbit(soft, 1, guess=orbit.state)
    start = (float(own.state[0]) + 3e-3, float(own.state[1]))
    motion = simulate(Controlled(soft, OGY(own, 0.05)), periods=60, initial=start)
    assert motion.effort()[1][-1] < 1e-12
    x, v = motion.stroboscopic()
    assert math.hypot(x[-2] - own.state[0], v[-2] - own.state[1]) < 1e-10
    assert (motion.impacts.peak > 0).all()
    stepped = simulate(
        Controlled(BEAM, OGY(orbit, 0.05)),
        periods=40,
        method=RungeKutta(1e-12),
        initial=(float(orbit.state[0]) + 1e-3, float(orbit.state[1])),
    )
    exact = simulate(
        Controlled(BEAM, OGY(orbit, 0.05)),
        periods=40,
        initial=(float(orbit.state[0]) + 1e-3, float(orbit.state[1])),
    )
    time = np.linspace(0, 5, 100) * BEAM.forcing_period
    np.testing.assert_allclose(stepped.sample(time), exact.sample(time), atol=1e-7)
    assert exact.effort()[1][-1] < 1e-12


# -- bad input -------------------------------------------------------------------------------------

FREE = Oscillator(damping=0.1, stops=(Stop(1.0, Rigid(0.5)),))


@pytest.mark.parametrize(
    ("make", "argument"),
    [
        (lambda: DelayedFeedback(math.nan), "gain"),
        (lambda: DelayedFeedback(math.inf), "gain"),
        (lambda: DelayedFeedback("much"), "gain"),
        (lambda: DelayedFeedback(0.1, 0.0), "delay"),
        (lambda: DelayedFeedback(0.1, -1), "delay"),
        (lambda: DelayedFeedback(0.1, math.nan), "delay"),
        (lambda: DelayedFeedback(0.1, 1, limit=0), "limit"),
        (lambda: DelayedFeedback(0.1, 1, limit=-0.1), "limit"),
        (lambda: DelayedFeedback(0.1, memory=1.0), "memory"),
        (lambda: DelayedFeedback(0.1, memory=-0.1), "memory"),
        (lambda: simulate(Controlled("beam", LOCK), periods=10), "system"),
        (lambda: simulate(Controlled(FREE, LOCK), periods=10), "system"),
        (lambda: simulate(Controlled(BEAM, LOCK)), "periods, duration"),
        (lambda: simulate(Controlled(BEAM, LOCK), periods=0), "periods"),
        (lambda: simulate(Controlled(BEAM, LOCK), periods=10, duration=3), "periods, duration"),
        (lambda: simulate(Controlled(BEAM, "pyragas"), periods=10), "controller"),
        (lambda: simulate(Controlled(BEAM, []), periods=10), "controller"),
        (lambda: simulate(Controlled(BEAM, [(1, 0.15)]), periods=10), "controller"),
        (lambda: simulate(Controlled(BEAM, LOCK, start=0.5), periods=10), "start"),
        (lambda: simulate(Controlled(BEAM, LOCK, start=10), periods=10), "start"),
        (lambda: simulate(Controlled(BEAM, LOCK, start=-1), periods=10), "start"),
        (lambda: simulate(Controlled(BEAM, [(2, LOCK)], start=2), periods=10), "start"),
        (lambda: simulate(Controlled(BEAM, [(5, LOCK), (5, None)]), periods=10), "controller"),
        (lambda: simulate(Controlled(BEAM, [(5, LOCK), (3, None)]), periods=10), "controller"),
        (
            lambda: simulate(Controlled(BEAM, [(1, DelayedFeedback(0.1, 2))]), periods=10),
            "controller",
        ),
        (
            lambda: simulate(Controlled(BEAM, DelayedFeedback(0.1, signal="x")), periods=10),
            "signal",
        ),
        (lambda: simulate(Controlled(BEAM, LOCK), periods=10, initial=(2, 0)), "initial"),
        (lambda: simulate(Controlled(BEAM, LOCK), periods=10, initial=(0, math.nan)), "initial"),
        (lambda: simulate(Controlled(BEAM, LOCK), periods=10, method=FixedStep(300)), "method"),
        (lambda: simulate(Controlled(BEAM, LOCK), periods=10, chatter=0), "chatter"),
        (lambda: simulate(Controlled(BEAM, LOCK), periods=10, phase=math.inf), "phase"),
        (lambda: simulate(Controlled(flows.rossler(), LOCK), duration=10), "signal"),
        (lambda: simulate(Controlled(flows.rossler(), LOCK), periods=10), "periods"),
        (lambda: simulate(Controlled(flows.rossler(), LOCK)), "duration"),
        (lambda: simulate(Controlled(flows.rossler(), LOCK), duration=10, phase=0), "phase"),
        (
            lambda: simulate(
                Controlled(flows.rossler(), DelayedFeedback(0.1, 2, signal="y")),
                duration=10,
                initial=(1, 2),
            ),
            "initial",
        ),
    ],
)
def test_bad_input_names_the_argument(make, argument):
    with pytest.raises(InvalidInput) as error:
        make()
    assert error.value.argument == argument


@pytest.mark.parametrize("signal", [None, "", -1, 1.5, True])
def test_what_can_be_no_signal_is_refused_at_once(signal):
    with pytest.raises(InvalidInput, match='"velocity" or "displacement"') as error:
        DelayedFeedback(0.1, signal=signal)
    assert error.value.argument == "signal"
    assert "coordinate" in error.value.required


def test_a_signal_that_is_none_is_refused_before_anything_moves(orbit, monkeypatch):
    # The name might be one of a flow's coordinates; an oscillator has none of that name.
    other = DelayedFeedback(0.1, signal="interval")
    monkeypatch.delattr(_delayed.DelayedRun, "to")
    for make in (
        lambda: simulate(Controlled(BEAM, [(5, LOCK), (9, other)]), periods=10),
        lambda: orbit_stability(orbit, other),
    ):
        with pytest.raises(InvalidInput, match='got interval; required: "velocity" or'):
            make()


def test_bad_orbits_for_ogy(orbit):
    stable = find_periodic_orbit(scenes.karpodinis(22.1), 1, guess=(0.9, 0.4))
    assert stable.found
    assert stable.stable
    lost = replace(orbit, status="lost")
    based = Oscillator(damping=0.1, base=BaseMotion(0.5, 0.9), stops=BEAM.stops)
    cases = [
        (lambda: OGY("orbit", 0.02), "orbit"),
        (lambda: OGY(lost, 0.02), "orbit"),
        (lambda: OGY(stable, 0.02), "orbit"),
        (lambda: OGY(orbit, 0.0), "limit"),
        (lambda: OGY(orbit, 0.02, "gap"), "parameter"),
        (lambda: OGY(replace(orbit, system=based), 0.02), "parameter"),
        (lambda: Controlled(scenes.karpodinis(20.4), OGY(orbit, 0.02)), "orbit"),
        (lambda: simulate(Controlled(BEAM, OGY(orbit, 0.02)), periods=9, phase=1.0), "phase"),
        (lambda: Controlled(BEAM, [(1, OGY(orbit, 0.02)), (5, LOCK)]), "controller"),
        (lambda: Controlled(Flow(lambda t, y: (1.0,), (0.0,)), OGY(orbit, 0.02)), "controller"),
    ]  # fmt: skip
    for make, argument in cases:
        with pytest.raises(InvalidInput) as error:
            make()
        assert error.value.argument == argument


def test_bad_input_to_stability(orbit):
    lossy = replace(BEAM, stops=(Stop(1.0, Hertz(100.0, restitution=0.5)),))
    slips = Oscillator(forces=(Force(1.0, 0.3),), damping=0.1, friction=Friction(0.4, 0.6))
    sticking = find_periodic_orbit(slips, 1, guess=(0.85, 0.0))
    assert sticking.found
    assert sticking.motion().stick_count
    cycle = find_periodic_orbit(flows.rossler(), period=5.88, guess=(0.4, -8.4, 0.2))
    assert cycle.found
    cases = [
        (lambda: orbit_stability("orbit", LOCK), "orbit"),
        (lambda: orbit_stability(replace(orbit, status="lost"), LOCK), "orbit"),
        (lambda: orbit_stability(replace(orbit, system=lossy), LOCK), "orbit"),
        (lambda: orbit_stability(sticking, LOCK), "signal"),
        (lambda: orbit_stability(replace(cycle, status="not converged"), LOCK), "orbit"),
        (lambda: orbit_stability(cycle, DelayedFeedback(0.2, 5.88, signal="y")), "delay"),
        (lambda: orbit_stability(cycle, DelayedFeedback(0.2, cycle.period)), "signal"),
        (lambda: stability_chart("orbit", [0.1]), "orbit"),
        (lambda: orbit_stability(orbit, 0.15), "feedback"),
        (lambda: orbit_stability(orbit, DelayedFeedback(0.1, 1.5)), "delay"),
        (lambda: orbit_stability(orbit, DelayedFeedback(0.1, signal="y")), "signal"),
        (lambda: orbit_stability(orbit, LOCK, laps=3), "laps"),
        (lambda: stability_chart(orbit, []), "gains"),
        (lambda: stability_chart(orbit, [0.1], [math.nan]), "delays"),
        (lambda: stability_chart(orbit, [0.1], [1.5]), "delays"),
    ]
    for make, argument in cases:
        with pytest.raises(InvalidInput) as error:
            make()
        assert error.value.argument == argument


def test_times_outside_the_span(locked):
    for time in (-0.1, locked.stop + 0.1, math.nan):
        with pytest.raises(InvalidInput, match="time"):
            locked.force(time)
    for periods in (0, 500):
        with pytest.raises(InvalidInput, match="periods"):
            locked.effort(periods)
    course = simulate(Controlled(flows.rossler(), DelayedFeedback(0.1, 2, signal="y")), duration=5)
    with pytest.raises(InvalidInput, match="time"):
        course.sample(5.1)


# -- figures and pieces --------------------------------------------------------------------------


def test_figures(locked, orbit):
    period = BEAM.forcing_period
    for draw in (plot.control_strobe, plot.control_intervals, plot.control_effort):
        ax = draw(locked)
        assert ax.get_xlim() == (0.0, locked.stop)
        assert any("K 0.15" in text.get_text() for text in ax.texts)
    strobe = plot.control_strobe(locked).lines[0]
    np.testing.assert_array_equal(strobe.get_ydata(), locked.stroboscopic()[0])
    effort = plot.control_effort(locked).lines[0]
    assert np.nanmax(effort.get_ydata()) == locked.effort()[1].max()
    force = plot.control_force(locked, span=(59 * period, 65 * period))
    assert np.abs(force.lines[0].get_ydata()).max() <= 0.1
    chart = stability_chart(orbit, [0.0, 0.1], [1], limit=0.1, laps=100)
    ax = plot.stability_chart(chart)
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), chart["growth"][:, 0])
    course = simulate(Controlled(flows.rossler(), DelayedFeedback(0.1, 2, signal="y")), duration=5)
    assert course.plot(coordinate="y").get_ylabel() == "y"
    cycle = find_periodic_orbit(flows.rossler(), period=5.88, guess=(0.4, -8.4, 0.2))
    ax = cycle.plot(x="x", y="z")
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x", "z")
    np.testing.assert_allclose(ax.lines[0].get_xydata()[0], cycle.state[[0, 2]], atol=1e-12)
    quiet = simulate(Controlled(BEAM, DelayedFeedback(0.0)), periods=5, initial=(0.0, 0.0))
    assert "no control force" in plot.control_effort(quiet).texts[0].get_text()


def test_bernstein_polynomials_and_their_first_shares():
    c = np.array([0.3, -1.0, 2.0, 0.5, -0.7, 1.1, 0.2, -0.4])
    shares = np.linspace(0, 1, 11)
    binomial = np.array([math.comb(7, k) for k in range(8)])
    k = np.arange(8)
    naive = [(binomial * c * s**k * (1 - s) ** (7 - k)).sum() for s in shares]
    np.testing.assert_allclose([bernstein.py_func(c, s) for s in shares], naive, atol=1e-14)
    part = c.copy()
    cut.py_func(part, 0.4)
    np.testing.assert_allclose(
        [bernstein.py_func(part, s) for s in shares],
        [bernstein.py_func(c, 0.4 * s) for s in shares],
        atol=1e-14,
    )


def test_chebyshev_differentiates_polynomials():
    nodes, slope = chebyshev(12)
    assert nodes[0] == 0
    assert nodes[-1] == 1
    np.testing.assert_allclose(slope @ nodes**7, 7 * nodes**6, atol=1e-12)
