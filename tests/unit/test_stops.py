"""Two stops heard by one microphone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from impactsig import (
    Impacts,
    InvalidInput,
    Microphone,
    Recording,
    detect_impacts,
    match_impacts,
    measure,
    separate_stops,
    synthesize,
)
from impactsig.detect._merge import merge
from impactsig.report import tables

MODES = ((2140.0, 6e-3, 1.0), (3710.0, 4e-3, 0.6), (5930.0, 2e-3, 0.4))


def heard(seed, *, apart, noise, count=150, second=0.4):
    """Impacts on two stops, the modes of the second by a share higher, and their sound."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.03, 0.08, count))
    stop = (rng.random(count) < second).astype(int)
    truth = Impacts(
        time, stop_index=stop, start=0.0, duration=time[-1] + 0.1,
        peak=np.exp(0.5 * rng.standard_normal(count)),
    )  # fmt: skip
    other = tuple((f * (1 + apart), decay, share) for f, decay, share in MODES)
    microphones = Microphone(modes=MODES, noise=noise), Microphone(modes=other)
    return truth, synthesize(truth, microphones, seed=seed)


def right(found, truth, late=1 / 343):
    """Share of the impacts that were given the stop they hit, whichever is called 0."""
    matched = match_impacts(found, truth, 2e-3, delay=late).pairs
    same = found.stop_index[matched[:, 0]] == truth.stop_index[matched[:, 1]]
    return max(same.mean(), 1 - same.mean()), same


@pytest.mark.parametrize(("seed", "noise"), [(10, 0.01), (11, 0.1), (12, 0.3), (13, 0.3)])
def test_stops_that_sound_a_fifth_apart(seed, noise):
    truth, record = heard(seed, apart=0.2, noise=noise, count=100)
    found = separate_stops(record, detect_impacts(record))
    assert found.distance > 6
    assert right(found.impacts, truth)[0] >= 0.95
    assert found.impacts.stop_index[0] == 0
    np.testing.assert_allclose(found.probability.sum(axis=1), 1.0)


@pytest.mark.parametrize("noise", [0.01, 0.1, 0.5])
def test_one_sound_is_not_parted(noise):
    for seed in range(4):
        truth, record = heard(40 + seed, apart=0.0, noise=noise, count=(60, 120)[seed % 2])
        found = separate_stops(record, Impacts(truth.time + 1 / 343))
        assert found.impacts.stop_index is None
        assert found.probability is None
        assert "standard deviations apart" in found.reason


def test_stated_probabilities_hold():
    stated, same = [], []
    for seed in range(71, 75):  # in noise so loud that the sounds barely come apart
        truth, record = heard(seed, apart=0.2, noise=0.7, count=200)
        found = separate_stops(record, Impacts(truth.time + 1 / 343))
        if found.probability is not None:
            share, own = right(found.impacts, truth)
            same.append(own if own.mean() == share else ~own)
            stated.append(found.probability.max(axis=1))
    assert len(stated) >= 3
    assert np.mean(np.concatenate(stated)) == pytest.approx(np.mean(np.concatenate(same)), abs=0.03)


def test_the_probability_of_the_stop_is_a_column_that_goes_where_the_stop_goes(tmp_path):
    """Through tables, files, merging, corrections, repair, the measuring chain and the report."""
    truth, record = heard(71, apart=0.2, noise=0.7, count=120)
    found = separate_stops(record, Impacts(truth.time + 1 / 343, start=0.0, duration=truth.stop))
    train = found.impacts
    np.testing.assert_array_equal(train.stop_probability, found.probability.max(axis=1))
    assert 0.5 < train.stop_probability.min() < 1
    assert train.to_frame()["stop_probability"].tolist() == train.stop_probability.tolist()
    train.to_csv(tmp_path / "train.csv")
    again = Impacts.read_csv(tmp_path / "train.csv")
    np.testing.assert_array_equal(again.stop_probability, train.stop_probability)
    np.testing.assert_array_equal(train[3:9].stop_probability, train.stop_probability[3:9])
    added = train.edit(add=[0.001], reject=[train.time[5]])
    assert (added.stop_index[0], added.stop_probability[0]) == (-1, 0.0)
    np.testing.assert_array_equal(added.stop_probability[6:], train.stop_probability[6:])
    kept = measure(train, missed=0.2, seed=1)
    np.testing.assert_array_equal(
        kept.impacts.stop_probability, train.stop_probability[kept.source]
    )
    shown = tables.table(train, 4)
    assert shown.heads[-3:] == ("stop", "stop probability", "flags")
    assert [row[-2] for row in shown.rows] == [f"{p:.3f}" for p in train.stop_probability[:4]]
    assert separate_stops(record, train[:10]).impacts.stop_probability is None


def test_merged_impacts_have_the_stop_probability_of_the_first():
    columns = {
        "time": [0.0, 1e-4, 1.0],
        "peak": [1.0, 2.0, 1.0],
        "stop_probability": [0.6, 0.9, 1.0],
    }
    merged = merge({name: np.array(values) for name, values in columns.items()}, 1e-3)
    np.testing.assert_array_equal(merged["stop_probability"], [0.6, 1.0])


def test_refusals_and_few():
    truth, record = heard(1, apart=0.2, noise=0.1, count=30)
    assert "too few" in separate_stops(record, truth[:10]).reason
    silent = Recording(np.zeros(100_000), 22_050.0)
    assert "silent at the impacts" in separate_stops(silent, truth).reason
    with pytest.raises(InvalidInput, match="recording"):
        separate_stops(record.samples, truth)
    with pytest.raises(InvalidInput, match="impacts"):
        separate_stops(record, truth.time)
    two = Recording(np.zeros((100, 2)), 22_050.0, channels=("a", "b"), units=("", ""))
    with pytest.raises(InvalidInput, match="one of 0: 'a'"):
        separate_stops(two, truth)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_impacts_far_outside_of_the_recording_are_of_no_known_stop():
    noise = np.random.default_rng(0).standard_normal(3000)
    found = separate_stops(Recording(noise, 22_050.0), Impacts.from_times(1e150 * np.arange(1, 40)))
    assert found.impacts.stop_index is None
    assert found.reason


def test_samples_that_are_missing_or_of_any_size_do_not_hinder():
    truth, record = heard(10, apart=0.2, noise=0.01, count=100)
    impacts = Impacts(truth.time + 1 / 343)
    whole = separate_stops(record, impacts)
    for scale in (1e-160, 1e300):
        found = separate_stops(replace(record, samples=scale * record.samples), impacts)
        assert found.distance == pytest.approx(whole.distance, rel=1e-9)
    x = record.samples.copy()
    x[5000:9000], x[-100:] = np.nan, np.inf
    found = separate_stops(replace(record, samples=x), impacts)
    assert np.mean(found.impacts.stop_index == whole.impacts.stop_index) >= 0.95
    silent = separate_stops(replace(record, samples=np.full(len(x), np.nan)), impacts)
    assert silent.reason == "the recording is silent at the impacts"
    with pytest.raises(InvalidInput, match="2000 Hz"):
        separate_stops(replace(record, rate=500.0), impacts)
