"""The disturbed records carry the impacts that they say, and the same ones each time."""

import numpy as np
import pytest

from benchmarks.disturbances import converted, few_samples, records, step
from benchmarks.robustness import score

CASES = {case.name: case for case in records(2.0) if case.allowed != 1}  # ten minutes are too long


def test_names_differ():
    assert len({case.name for case in records()}) == len(records())


@pytest.mark.parametrize("name", CASES)
def test_seed_decides(name):
    truth, again, other = (CASES[name].make(seed) for seed in (1, 1, 2))
    assert np.isfinite(truth.samples).all()
    assert np.array_equal(truth.samples, again.samples)
    assert np.array_equal(truth.time, again.time)
    assert (len(truth.time) == 0) == (CASES[name].allowed is not None)
    if len(truth.time):
        assert len(truth.time) == len(truth.contact_time) == len(truth.amplitude)
        assert not np.array_equal(truth.samples, other.samples)
        assert 0 < truth.time[0] < truth.time[-1] < len(truth.samples) / truth.rate


def test_step_points_both_ways():
    for seed, sign in ((1, 1), (2, -1)):
        truth = step(seed, 2.0, strength=5)
        rise = np.median(truth.samples[-1000:]) - np.median(truth.samples[:1000])
        assert sign * rise == pytest.approx(5 * truth.amplitude.max(), rel=0.01)


def test_codes_are_whole():
    truth = converted(1, 2.0, peak=10, noise=0.1, gain=0.00123, offset=0.4567)
    codes = (truth.samples - 0.4567) / 0.00123
    assert np.abs(codes - np.rint(codes)).max() < 1e-6
    assert len(np.unique(np.rint(codes))) > 10


def test_samples_a_contact():
    truth = few_samples(1, 2.0, count=1.5)
    assert truth.rate * truth.contact_time[0] == pytest.approx(1.5)


def test_score_of_the_truth_and_of_errors():
    truth = CASES["stationary, 20 dB"].make(1)
    perfect = score(truth.time + 0.4e-3, truth.contact_time, truth)  # a latency is no error
    assert perfect.f1 == 1
    assert perfect.timing < 1e-12
    half = score(truth.time[::2], truth.contact_time[::2] + 1e-5, truth)
    kept = len(truth.time[::2])
    assert half.f1 == pytest.approx(2 * kept / (kept + len(truth.time)))
    assert half.contact == pytest.approx(1e-5)
    assert score([], [], truth).f1 == 0
