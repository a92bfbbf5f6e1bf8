"""The contact time of a run: the mean of its impacts, whatever one second is misread by."""

from dataclasses import replace

import numpy as np
import pytest

from impactsig import Impacts
from impactsig.experiment._contacts import COMMON, mean_contact

COUNT = 20  # impacts a second


def train(contact, error=None, start=0.0):
    """A run of impacts with such contact times and their errors [us]."""
    time = start + (np.arange(len(contact)) + 0.5) / COUNT
    bare = Impacts.from_times(time, start=start, duration=len(contact) / COUNT)
    errors = (
        None if error is None else 1e-6 * np.broadcast_to(error, np.shape(contact)).astype(float)
    )
    return replace(bare, contact_time=1e-6 * np.asarray(contact), contact_time_error=errors)


def measured(rng, seconds, error, true=300.0):
    """Contact times of which those of a second are off together, and those of a run a little."""
    off = COMMON * rng.normal(0, error) + np.sqrt(1 - COMMON**2) * rng.normal(0, error, seconds)
    return np.broadcast_to(true, seconds * COUNT) + np.repeat(off, COUNT)


def test_a_second_that_is_misread_hardly_counts():
    contact = measured(np.random.default_rng(1), 10, 6.0)
    right = contact.mean()
    contact[:COUNT] += 80.0
    mean, error = mean_contact(train(contact, 6.0))
    assert contact.mean() > right + 7.9
    assert 1e6 * mean == pytest.approx(right, abs=2.0)
    assert 6.0 / np.sqrt(10) <= 1e6 * error < 3.5


def test_it_is_the_mean_of_contacts_that_differ():
    contact = np.tile([200.0, 200.0, 200.0, 400.0], 5 * COUNT)
    assert mean_contact(train(contact, 1.0))[0] == pytest.approx(250e-6, rel=1e-12)
    drifting = np.linspace(250.0, 350.0, 10 * COUNT)  # far more than is stated
    assert mean_contact(train(drifting, 0.1))[0] == pytest.approx(300e-6, rel=1e-9)


def test_seconds_count_from_the_beginning_of_the_run_and_by_their_impacts():
    contact = np.concatenate([np.full(COUNT, 310.0), np.full(COUNT // 4, 300.0)])
    mean, error = mean_contact(train(contact, 20.0, start=7.5))
    assert mean == pytest.approx(308e-6, rel=1e-12)
    own = np.sqrt(1 - COMMON**2) * np.hypot(0.8, 0.2)
    assert error == pytest.approx(20e-6 * np.hypot(own, COMMON), rel=1e-12)


@pytest.mark.parametrize("seconds", [10, 90])
def test_standard_errors_hold_what_is_shared_within_a_second_and_a_run(seconds):
    rng = np.random.default_rng(2)
    z = []
    for _ in range(400):
        mean, error = mean_contact(train(measured(rng, seconds, 6.0), 6.0))
        z.append((mean - 300e-6) / error)
    assert 0.85 < np.std(z) < 1.05
    assert 0.93 < np.mean(np.abs(z) < 1.96) < 0.99


def test_where_errors_or_contact_times_are_missing():
    contact = np.full(3 * COUNT, 300.0)
    assert mean_contact(train(contact)) == (pytest.approx(300e-6), None)
    assert mean_contact(Impacts.from_times([0.1, 0.2])) == (None, None)
    assert mean_contact(train([])) == (None, None)
    mean, error = mean_contact(train(contact, 0.0))
    assert (mean, error) == (pytest.approx(300e-6, rel=1e-12), pytest.approx(0.0, abs=1e-15))
    unknown = np.full(3 * COUNT, np.inf)
    assert mean_contact(train(contact, unknown))[1] is None
    unknown[:5] = 2.0
    assert mean_contact(train(contact, unknown))[1] == pytest.approx(2e-6)
    one = mean_contact(train([300.0], 5.0))
    assert one == (pytest.approx(300e-6), pytest.approx(5e-6))
