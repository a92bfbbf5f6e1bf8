"""Trains simulated and measured many at once: each is what it is alone."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import simulate
from impactsig.fitting._judging import HOPELESS, Judgement
from impactsig.fitting._machine import oscillator
from impactsig.fitting.orbits._laying_kernels import leave_out
from impactsig.fitting.searching.simulated import Beginnings, chained, simulated
from impactsig.fitting.trains.moments import Moments
from impactsig.fitting.trains.partition import Train
from impactsig.simulation.batches.trains import Impacting, impacts_of_many

FREQUENCY = 20.1
MACHINES = {
    "restitution": np.array([0.2, 0.6, 0.95, 0.0, 0.3]),
    "damping": np.array([0.03, 0.02, 0.01, 0.05, 0.4]),
    "amplitude": np.array([0.25, 2.0, 0.8, 0.3, 0.001]),  # the last never reaches the stop
    "natural_frequency": np.full(5, 22.0),
}


def followed(legs):
    machines = oscillator(MACHINES, FREQUENCY)
    initial = np.column_stack((np.ones(5), [-0.1, -0.2, -0.3, 0.0, -0.1]))
    phase, transient = np.array([1.0, 2.0, 3.0, 4.0, -1.0]), np.array([60.0, 70, 80, 64, 90])
    found = impacts_of_many(machines, initial, phase, transient, 50, legs)
    return machines, initial, phase, transient, found


def parts(values, starts):
    return np.split(values, starts[1:])


def test_impacts_of_many_machines_are_those_of_each():
    machines, initial, phase, transient, found = followed(10**6)
    x, approach = parts(found.x, found.starts), parts(found.approach, found.starts)
    assert len(x[4]) == 0
    assert min(len(one) for one in x[:4]) > 20
    for k, machine in enumerate(machines):
        alone = simulate(
            machine, periods=50, transient=transient[k], initial=tuple(initial[k]), phase=phase[k]
        ).impacts
        np.testing.assert_allclose(x[k], (alone.time - alone.start) * FREQUENCY, atol=1e-11)
        np.testing.assert_array_equal(approach[k], alone.approach_velocity)


def test_a_machine_that_takes_too_much_work_has_no_impacts():
    # A leg for each of 50 impacts and one to the end; the first machine swings longer than one.
    assert np.diff(followed(51)[-1].starts).tolist() == [0, 50, 50, 50]
    assert len(followed(50)[-1].x) == 0


def test_a_chain_that_does_nothing_leaves_the_truth():
    *_, truth = followed(10**6)
    none = dict.fromkeys(
        ("jitter", "missed", "spurious", "strength_noise", "strength_floor"), np.zeros(5)
    )
    found = chained(truth, 50, none, np.random.default_rng(0))
    np.testing.assert_array_equal(found.x, truth.x)
    np.testing.assert_array_equal(found.strength, truth.approach)
    np.testing.assert_array_equal(found.starts, truth.starts)
    assert np.count_nonzero(~found.joined) == 3  # between four trains with impacts


def test_each_train_passes_a_chain_of_its_own():
    count, periods = 20_000, 30_000
    x = np.tile(np.linspace(5, periods - 5, count), 2)
    strength = np.tile([1.0, 3.0], count)
    truth = Impacting(x, strength, np.array([0, count]), np.zeros(len(x)))
    values = {
        "jitter": np.array([0.0, 0.01]),
        "missed": np.array([0.2, 0.0]),
        "spurious": np.array([0.0, 0.1]),
        "strength_noise": np.array([0.0, 0.05]),
        "strength_floor": np.zeros(2),
    }
    one, other = chained(truth, periods, values, np.random.default_rng(1)).split()
    assert np.isin(one.x, x).all()
    assert len(one.x) == pytest.approx(0.8 * count, abs=5 * np.sqrt(0.16 * count))
    assert set(one.strength) == {1.0, 3.0}
    assert len(other.x) - count == pytest.approx(0.1 * count, abs=5 * np.sqrt(0.1 * count))
    assert np.all(np.diff(other.x) >= 0)
    near = x[:count][np.clip(np.searchsorted(x[:count], other.x), 1, count - 1) - 1]
    off = np.minimum(np.abs(other.x - near), np.abs(other.x - near - np.diff(x[:2])))
    assert np.median(off) == pytest.approx(0.6745 * 0.01, rel=0.25)  # false ones are farther
    weak = other.strength[other.strength < 2]
    assert weak.std() == pytest.approx(0.05, rel=0.05)


def test_moments_of_many_trains_are_those_of_each():
    rng = np.random.default_rng(3)
    trains = []
    for count in (400, 300, 0, 2, 350):
        symbols = rng.integers(1, 3, max(count - 1, 0))
        x = 0.3 + np.concatenate(([0], np.cumsum(symbols)))[:count]
        x = x + 0.01 * rng.standard_normal(count) + rng.random()
        trains.append(Train(x, rng.uniform(0.5, 1.5, count), np.ones(max(count - 1, 0), bool)))
    moments = Moments.of(trains[0])
    counts = np.array([len(one.x) for one in trains])
    owner = np.repeat(np.arange(5), counts)
    whole = Train(
        np.concatenate([one.x for one in trains]),
        np.concatenate([one.strength for one in trains]),
        owner[1:] == owner[:-1],
        np.cumsum(counts) - counts,
    )
    found = moments(whole)
    assert np.isfinite(found[[0, 1, 4]]).all()
    assert np.isnan(found[[2, 3]]).all()
    for one, row in zip(whole.split(), found, strict=True):
        np.testing.assert_allclose(moments(one)[0], row, atol=1e-12)


def test_simulated_trains_have_the_values_of_their_row():
    values = {name: np.tile(MACHINES[name][[0, 4]], 10) for name in MACHINES}
    values |= {"jitter": np.full(20, 1e-3), "missed": np.tile([0.5, 0.0], 10)}
    values |= dict.fromkeys(("spurious", "strength_noise", "strength_floor"), np.zeros(20))
    begins = Beginnings(np.array([1.0, 2.0]), np.array([0.1, 0.4]))
    found = simulated(values, FREQUENCY, 60, 40, begins, np.random.default_rng(0))
    assert np.all(found.counts[1::2] == 0)
    assert np.all(found.counts[::2] > 5)
    assert len(np.unique(found.x)) == len(found.x)  # no two trains are the same


def test_the_worst_of_legs_that_contradict_each_other_is_left_out():
    release = np.ones(30)
    release[[4, 5, 20]] = [30.0, 40.0, np.inf]
    release[29] = 15.0  # below the cut
    joined = np.ones(30, bool)
    joined[5] = False  # left out before: its neighbour is the worst of those that are left
    assert leave_out(release, joined)
    assert np.flatnonzero(~joined).tolist() == [4, 5, 20]
    assert not leave_out(release, joined)
    assert not leave_out(release, np.zeros(30, bool))


@pytest.mark.parametrize(
    ("distance", "p_value", "hopeless"),
    [(2 * HOPELESS, 1 / 41, True), (2 * HOPELESS, 2 / 41, False), (0.5 * HOPELESS, 1 / 41, False)],
)
def test_what_is_hopeless_is_far_and_farther_than_all(distance, p_value, hopeless):
    assert Judgement(distance, p_value, np.empty(0), 0).hopeless == hopeless
