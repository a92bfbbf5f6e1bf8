"""simulate: what is refused, what is kept, sampling, and going on from where one stopped."""

from __future__ import annotations

import copy
import math
import pickle

import numpy as np
import pytest

import impactsig
from impactsig import Force, InvalidInput, Oscillator, Rigid, Stop, scenes
from impactsig.impacts import Impacts

BEAM = scenes.karpodinis(20.1)


@pytest.mark.parametrize(
    ("argument", "options"),
    [
        ("periods, duration", {}),
        ("periods, duration", {"periods": 1, "duration": 1}),
        ("periods", {"periods": 0}),
        ("periods", {"periods": "ten"}),
        ("duration", {"duration": math.inf}),
        ("transient", {"periods": 1, "transient": -1}),
        ("phase", {"periods": 1, "phase": math.nan}),
        ("keep", {"periods": 1, "keep": "some"}),
        ("chatter", {"periods": 1, "chatter": 0}),
        ("initial", {"periods": 1, "initial": (0, math.nan)}),
        ("initial", {"periods": 1, "initial": 3}),
        ("initial", {"periods": 1, "initial": (1.001, 0)}),
    ],
)
def test_what_cannot_be_is_refused_by_name(argument, options):
    with pytest.raises(InvalidInput) as caught:
        impactsig.simulate(BEAM, **options)
    assert caught.value.argument == argument


def test_periods_need_a_forcing():
    with pytest.raises(InvalidInput, match="a system with forcing"):
        impactsig.simulate(Oscillator(), periods=1)
    with pytest.raises(InvalidInput, match=r"system: got beam; required: an Oscillator"):
        impactsig.simulate("beam", periods=1)


def test_the_package_and_the_function_are_one():
    from impactsig.simulation import simulate

    assert repr(simulate(BEAM, periods=50)) == repr(impactsig.simulate(BEAM, periods=50))


def test_counting_finds_what_keeping_finds():
    kept = impactsig.simulate(BEAM, periods=3000, transient=100)
    counted = impactsig.simulate(BEAM, periods=3000, transient=100, keep="counts")
    assert counted.impacts is None
    assert counted.sticks is None
    assert len(kept.impacts) == kept.impact_count == counted.impact_count
    assert counted.energy_lost == kept.energy_lost
    assert counted.final == kept.final
    with pytest.raises(InvalidInput, match="keep"):
        counted.sample([counted.stop])


def test_events_beyond_one_buffer_are_all_kept(monkeypatch):
    from impactsig.simulation import run as _run

    whole = impactsig.simulate(BEAM, periods=500)
    monkeypatch.setattr(_run, "CHUNK", 8)
    np.testing.assert_array_equal(impactsig.simulate(BEAM, periods=500).impacts.time,
                                  whole.impacts.time)  # fmt: skip


def test_the_span_and_the_times_are_in_seconds():
    motion = impactsig.simulate(BEAM, periods=40, transient=10, initial=(0.5, 0))
    assert motion.start == pytest.approx(10 / 20.1, rel=1e-14)
    assert motion.duration == pytest.approx(40 / 20.1, rel=1e-14)
    assert motion.impacts.start == motion.start
    again = impactsig.simulate(BEAM, duration=40 / 20.1, transient=10 / 20.1, initial=(0.5, 0))
    np.testing.assert_allclose(again.impacts.time, motion.impacts.time, rtol=1e-9)


def test_samples_meet_the_stop_at_the_impacts():
    motion = impactsig.simulate(BEAM, periods=300, transient=20)
    x, v = motion.sample(motion.impacts.time)
    np.testing.assert_allclose(x, 1, atol=1e-11)
    omega = 2 * math.pi * scenes.NATURAL_FREQUENCY
    _, before = motion.sample(motion.impacts.time - 1e-9)
    slack = 3 * 1e-9 * omega * 3
    np.testing.assert_allclose(before, motion.impacts.approach_velocity, atol=slack)
    assert x.max() <= 1
    assert np.all((v < 0) | (v > 0))


def test_samples_obey_the_equation_of_motion():
    motion = impactsig.simulate(BEAM, periods=60)
    step = 1e-6
    time = np.linspace(0.01, motion.stop - 0.01, 997)
    near = np.abs(time[:, None] - motion.impacts.time).min(axis=1) < 3 * step
    time = time[~near]
    omega = 2 * math.pi * scenes.NATURAL_FREQUENCY
    x, v = motion.sample(time)
    a = (motion.sample(time + step)[1] - motion.sample(time - step)[1]) / (2 * step * omega)
    drive = 0.25 * np.cos(2 * math.pi * 20.1 * time)
    np.testing.assert_allclose(a + 0.06 * v + x, drive, atol=1e-7)


def test_stroboscopic_points_are_samples_at_whole_periods():
    motion = impactsig.simulate(BEAM, periods=30, transient=5, phase=1.0)
    x, v = motion.stroboscopic(1.5)
    assert len(x) == 30
    when = (5 + np.arange(30) + 0.5 / (2 * math.pi)) / 20.1
    np.testing.assert_allclose(motion.sample(when), (x, v), atol=1e-10)


def test_a_run_goes_on_from_its_final_state():
    whole = impactsig.simulate(BEAM, periods=40)
    half = impactsig.simulate(BEAM, periods=20)
    x, v, phase = half.final
    rest = impactsig.simulate(BEAM, periods=20, initial=(x, v), phase=phase)
    time = np.append(half.impacts.time, half.stop + rest.impacts.time)
    np.testing.assert_allclose(time, whole.impacts.time, rtol=1e-9)


def test_a_motion_that_cannot_reach_the_stop_is_not_stepped():
    """The answer is the same with and without the skip."""
    quiet = Oscillator(damping=0.1, forces=Force(0.1, 0.5), stops=(Stop(1, Rigid(0.5)),))
    fast = impactsig.simulate(quiet, periods=1000.25, initial=(0.9, 2.0))
    slow = impactsig.simulate(quiet, periods=1000.25, initial=(0.9, 2.0), skip_unreachable=False)
    assert fast.impact_count == slow.impact_count > 0
    np.testing.assert_allclose(fast.final, slow.final, atol=1e-13)
    steady = impactsig.simulate(quiet, periods=1e12, keep="counts")
    response = 0.1 / (0.75 + 0.05j)
    assert steady.final[0] == pytest.approx(response.real, abs=1e-15)


def test_work_is_bounded():
    """A perfectly elastic ball thrown low bounces for ever, ever the same."""
    ball = Oscillator(stiffness=0, load=-1, stops=(Stop(0, Rigid(1), "lower"),))
    motion = impactsig.simulate(ball, duration=100.0, initial=(0, 1e-6), keep="counts")
    assert motion.status == "work limit"
    assert 0 < motion.duration < 100
    assert motion.impact_count > 1000


def test_approach_velocities_survive_the_table(tmp_path):
    impacts = impactsig.simulate(BEAM, periods=50).impacts
    impacts.to_csv(tmp_path / "a.csv")
    again = Impacts.read_csv(tmp_path / "a.csv")
    np.testing.assert_array_equal(again.approach_velocity, impacts.approach_velocity)
    assert again[3:5].approach_velocity.tolist() == impacts.approach_velocity[3:5].tolist()
    pytest.importorskip("pyarrow")
    impacts.to_parquet(tmp_path / "a.parquet")
    again = Impacts.read_parquet(tmp_path / "a.parquet")
    np.testing.assert_array_equal(again.approach_velocity, impacts.approach_velocity)


def test_a_gap_of_next_to_nothing_is_no_endless_chatter():
    """Of a gap of 1e-300 the first flights are below any scale; the run is that without a gap."""
    ends = []
    for gap in (0.0, 1e-300):
        machine = Oscillator(
            damping=0.1, forces=Force(0.5, 0.9), load=0.3, stops=(Stop(gap, Rigid(0.5)),)
        )
        motion = impactsig.simulate(machine, periods=20, keep="counts")
        assert motion.status == "complete"
        ends.append(motion.final)
    assert ends[0] == pytest.approx(ends[1], abs=1e-12)


def test_numbers_too_large_to_square_end_the_run():
    machine = Oscillator(forces=Force(1e300, 2.0), stops=(Stop(1, Rigid(0.5)),))
    assert impactsig.simulate(machine, periods=5).status == "diverged"


@pytest.mark.parametrize("method", [None, impactsig.RungeKutta()])
def test_a_motion_goes_to_other_processes_whole(method):
    motion = impactsig.simulate(BEAM, periods=30, method=method)
    t = np.linspace(motion.start, motion.stop, 50)
    for again in (pickle.loads(pickle.dumps(motion)), copy.deepcopy(motion)):
        np.testing.assert_array_equal(again.impacts.time, motion.impacts.time)
        np.testing.assert_array_equal(again.sample(t), motion.sample(t))
        assert again.final == motion.final
