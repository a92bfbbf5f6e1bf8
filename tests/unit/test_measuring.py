"""The measuring chain on trains: each effect alone against what it should do, then all together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from impactsig import (
    Force,
    Impacts,
    InvalidInput,
    Oscillator,
    Rigid,
    Stop,
    impact_map,
    scenes,
    simulate,
)
from impactsig.simulation.instruments.measuring import ECHO_STRENGTH, Measured, measure


def train(count=20_000, interval=0.05, **known):
    time = interval * (1 + np.arange(count))
    return Impacts.from_times(time, start=0.0, duration=interval * (count + 1), **known)


def graded(count=20_000):
    """Peaks that rise evenly from 0 to 1 through the run."""
    peak = np.linspace(0, 1, count)
    return train(count, peak=peak, contact_time=1e-4 + 1e-4 * peak, impulse=2e-4 * peak)


def near(observed, expected, trials):
    """Within five standard deviations of a binomial share."""
    assert abs(observed - expected) < 5 * np.sqrt(max(expected * (1 - expected), 1e-9) / trials)


def test_a_perfect_instrument_changes_nothing():
    truth = graded(500)
    seen = measure(truth, seed=1)
    assert isinstance(seen, Measured)
    assert seen.truth is truth
    for name in ("time", "peak", "contact_time", "impulse", "flags"):
        np.testing.assert_array_equal(getattr(seen.impacts, name), getattr(truth, name))
    np.testing.assert_array_equal(seen.source, np.arange(500))
    assert len(seen.missed) == len(seen.spurious) == 0


def test_a_share_is_missed_whatever_the_strength():
    seen = measure(graded(), missed=0.1, seed=2)
    near(len(seen.missed) / 20_000, 0.1, 20_000)
    near(np.mean(seen.missed < 10_000), 0.5, len(seen.missed))
    assert len(measure(graded(), missed=1.0, seed=2).impacts) == 0


def test_weak_impacts_are_missed_by_the_logistic_law():
    truth = graded()
    lost = np.zeros(len(truth), bool)
    lost[measure(truth, missed_weak=(0.3, 0.05), seed=3).missed] = True
    for low in np.arange(0, 1, 0.1):
        inside = (truth.peak >= low) & (truth.peak < low + 0.1)
        expected = np.mean(1 / (1 + np.exp((truth.peak[inside] - 0.3) / 0.05)))
        near(lost[inside].mean(), expected, inside.sum())
    # Without peaks it is the approach velocity that tells the weak.
    hard = train(peak=None, approach_velocity=truth.peak)
    assert set(measure(hard, missed_weak=(0.3, 0.05), seed=3).missed) == set(np.flatnonzero(lost))
    # A scale that is next to nothing is a threshold, and must not overflow.
    sharp = measure(truth, missed_weak=(0.3, 1e-9), seed=3)
    np.testing.assert_array_equal(sharp.missed, np.flatnonzero(truth.peak < 0.3))


def test_jitter_is_gaussian_and_keeps_order_and_identity():
    truth = graded()
    seen = measure(truth, jitter=1e-3, seed=4)
    off = seen.impacts.time - truth.time[seen.source]
    assert off.mean() == pytest.approx(0, abs=5e-3 / np.sqrt(20_000))
    assert off.std() == pytest.approx(1e-3, rel=5 / np.sqrt(2 * 20_000))
    near(np.mean(np.abs(off) < 1e-3), 0.682689, 20_000)
    np.testing.assert_array_equal(seen.impacts.peak, truth.peak[seen.source])
    # Large enough to change the order: still a train, and still told which is which.
    mixed = measure(truth, jitter=0.1, seed=4)
    assert sorted(mixed.source) == list(range(20_000))
    assert np.any(np.diff(mixed.source) < 0)
    np.testing.assert_array_equal(mixed.impacts.peak, truth.peak[mixed.source])
    assert mixed.impacts.time[0] >= truth.start
    assert mixed.impacts.time[-1] <= truth.stop


def test_spurious_spikes_are_a_poisson_process_outside_the_gaps():
    gaps = np.array([[700.0, 900.0], [100.0, 400.0]])
    inside = [(100.0, 400.0), (700.0, 900.0)]
    time = 0.05 * (1 + np.arange(20_000))
    for low, high in inside:
        time = time[(time < low) | (time > high)]
    truth = Impacts.from_times(time, start=0.0, duration=1000.05, gaps=gaps)
    count = 0
    for seed in range(20):
        seen = measure(truth, spurious=0.2, seed=seed)
        false = seen.impacts.time[seen.spurious]
        for low, high in inside:
            assert not np.any((false > low) & (false < high))
        near(np.mean(false < 100), 100 / 500.05, len(false))
        near(np.mean((false > 400) & (false < 700)), 300 / 500.05, len(false))
        count += len(false)
    expected = 20 * 0.2 * len(truth)
    assert abs(count - expected) < 5 * np.sqrt(expected)


def test_spurious_spikes_look_like_impacts():
    truth = graded(1000)
    seen = measure(truth, spurious=0.5, seed=5)
    pairs = set(zip(truth.peak, truth.contact_time, truth.impulse, strict=True))
    false = seen.impacts[seen.spurious]
    assert len(false) > 300
    assert set(zip(false.peak, false.contact_time, false.impulse, strict=True)) <= pairs


def test_echoes_follow_impacts_at_the_delay_and_weaker():
    truth = graded()
    seen = measure(truth, echoes=0.25, echo_delay=3e-3, seed=6)
    near(len(seen.spurious) / 20_000, 0.25, 20_000)
    before = seen.spurious - 1
    np.testing.assert_allclose(
        seen.impacts.time[seen.spurious] - seen.impacts.time[before], 3e-3, atol=1e-12
    )
    np.testing.assert_allclose(
        seen.impacts.peak[seen.spurious], ECHO_STRENGTH * seen.impacts.peak[before]
    )
    np.testing.assert_array_equal(
        seen.impacts.contact_time[seen.spurious], seen.impacts.contact_time[before]
    )
    # No echo of what was not heard, none after the end of the run.
    assert len(measure(truth, missed=1.0, echoes=1.0, seed=6).impacts) == 0
    late = measure(truth, echoes=1.0, echo_delay=0.06, seed=6)
    assert len(late.spurious) == 19_999


def test_dead_time_counts_from_the_last_impact_that_was_counted():
    truth = Impacts.from_times([0.0, 0.4, 0.9, 1.0, 1.1, 5.0, 5.5, 6.0, 6.1, 9.0])
    seen = measure(truth, dead_time=0.9)
    # 0.9 after one that counts is still dead, as in detect_impacts; 1.0 is free, 0.4 and 0.9 lost.
    np.testing.assert_array_equal(truth.time[seen.source], [0.0, 1.0, 5.0, 6.0, 9.0])


def test_an_effect_does_not_change_what_the_others_do():
    truth = graded(2000)
    lost = set(measure(truth, missed=0.1, seed=7).missed)
    assert set(measure(truth, missed=0.1, jitter=1e-4, echoes=0.3, seed=7).missed) == lost
    # A larger share misses the same impacts and more.
    assert lost < set(measure(truth, missed=0.2, seed=7).missed)
    false = measure(truth, spurious=0.1, seed=7)
    both = measure(truth, spurious=0.1, missed=0.3, jitter=1e-4, seed=7)
    np.testing.assert_array_equal(
        false.impacts.time[false.spurious], both.impacts.time[both.spurious]
    )
    jitter = measure(truth, jitter=1e-4, seed=7)
    off = dict(zip(jitter.source, jitter.impacts.time, strict=True))
    for source, time in zip(both.source, both.impacts.time, strict=True):
        assert source < 0 or off[source] == time


EVERYTHING = {
    "jitter": 1e-4,
    "dead_time": 1e-3,
    "missed": 0.05,
    "missed_weak": (0.1, 0.02),
    "spurious": 0.05,
    "echoes": 0.1,
}


def test_seeds():
    truth = graded(2000)
    one = measure(truth, **EVERYTHING, seed=8)
    sequence = np.random.SeedSequence(8)
    for seed in (8, sequence, sequence):  # a sequence is read, not used up
        again = measure(truth, **EVERYTHING, seed=seed)
        np.testing.assert_array_equal(one.impacts.time, again.impacts.time)
        np.testing.assert_array_equal(one.source, again.source)
    other = measure(truth, **EVERYTHING, seed=9)
    assert not np.array_equal(one.source, other.source)
    generator = np.random.default_rng(8)
    first, second = (measure(truth, **EVERYTHING, seed=generator) for _ in range(2))
    assert not np.array_equal(first.source, second.source)
    replayed = measure(truth, **EVERYTHING, seed=np.random.default_rng(8))
    np.testing.assert_array_equal(first.impacts.time, replayed.impacts.time)


def test_an_empty_train_stays_empty_and_says_why():
    seen = measure(Impacts([], reason="never touched"), **{**EVERYTHING, "missed_weak": None})
    assert len(seen.impacts) == 0
    assert seen.impacts.reason == "never touched"
    gone = measure(graded(10), missed=1.0)
    assert "missed" in gone.impacts.reason
    assert len(gone.missed) == 10


@pytest.mark.parametrize(
    ("argument", "value"),
    [
        ("jitter", -1e-3),
        ("jitter", np.nan),
        ("dead_time", -1.0),
        ("dead_time", np.inf),
        ("missed", 1.1),
        ("missed", "few"),
        ("spurious", -0.1),
        ("echoes", 2.0),
        ("echo_delay", 0.0),
        ("missed_weak", 0.3),
        ("missed_weak", (0.3, 0.0)),
        ("missed_weak", (np.nan, 0.1)),
        ("seed", -1),
        ("seed", "one"),
    ],
)
def test_what_cannot_be_used_is_named(argument, value):
    with pytest.raises(InvalidInput, match=argument):
        measure(graded(10), **{argument: value})


def test_weak_needs_a_strength():
    with pytest.raises(InvalidInput, match="missed_weak"):
        measure(train(10), missed_weak=(0.3, 0.1))


def test_what_an_instrument_did_stands_beside_the_impacts():
    truth = graded(5000)
    seen = measure(truth, jitter=1e-4, spurious=0.1, echoes=0.05, seed=4)
    real = seen.source >= 0
    z = (seen.impacts.time - truth.time[seen.source])[real] / seen.impacts.time_error[real]
    assert z.std() == pytest.approx(1.0, rel=5 / np.sqrt(2 * 5000))
    np.testing.assert_array_equal(seen.impacts.probability, np.full(len(real), real.mean()))
    # What was uncertain before stays so.
    twice = measure(replace(truth, time_error=np.full(5000, 1e-4)), jitter=1e-4, seed=4)
    np.testing.assert_allclose(twice.impacts.time_error, np.sqrt(2) * 1e-4)


def test_noise_on_the_displacement_counts_as_an_error_of_the_instants():
    motion = simulate(scenes.karpodinis(20.1), periods=200, keep="all")
    seen = measure(motion, noise=0.02, seed=1)
    real = seen.source >= 0
    off = (seen.impacts.time - seen.truth.time[seen.source])[real]
    np.testing.assert_allclose(seen.impacts.time_error, np.sqrt(np.mean(off**2)))


def test_each_impact_keeps_the_stop_it_hit():
    machine = Oscillator(
        damping=0.05,
        forces=(Force(1.0, 0.9),),
        stops=(Stop(0.5, Rigid(0.7)), Stop(-0.4, Rigid(0.7), side="lower")),
    )
    motion = simulate(machine, periods=100, keep="all")
    np.testing.assert_array_equal(motion.impacts.stop_index, impact_map(motion).stop)
    assert set(motion.impacts.stop_index) == {0, 1}
    seen = measure(motion, noise=0.05, jitter=0.01, missed=0.2, spurious=0.1, echoes=0.1, seed=5)
    real = seen.source >= 0
    assert len(seen.missed) > 0
    assert len(seen.spurious) > 0
    np.testing.assert_array_equal(
        seen.impacts.stop_index[real], motion.impacts.stop_index[seen.source[real]]
    )
