"""What must hold of a repair whatever the train."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from impactsig import Impacts, repair_intervals
from impactsig.simulation.instruments.measuring import measure

SHARE = st.sampled_from([0.0, 0.02, 0.1])


@settings(max_examples=15, deadline=None)
@given(
    st.lists(st.floats(0.1, 0.9), max_size=2),
    st.floats(0.001, 10),
    st.integers(8, 150),
    SHARE,
    SHARE,
    st.integers(0, 2**32),
)
def test_the_sum_is_kept_and_so_is_what_was_not_changed(phases, period, count, missed, false, seed):
    phases = np.unique([0.0, *phases])
    time = np.sort(((np.arange(count)[:, None] + phases) * period).ravel())
    train = measure(Impacts(time), missed=missed, spurious=false, seed=seed).impacts
    isi = train.intervals()
    of_train, of_array = repair_intervals(train, period), repair_intervals(isi, period)
    for found in (of_train, of_array):
        assert np.isclose(found.intervals.sum(), isi.sum(), rtol=1e-12)
        assert len(found.intervals) == len(isi) + len(found.splits) - len(found.joins)
        assert (found.intervals >= 0).all()
        touched = {split.after for split in found.splits}
        touched |= {join.impact - k for join in found.joins for k in (0, 1)}
        untouched = np.delete(isi, sorted(touched))
        assert np.isin(untouched, found.intervals).all()
    assert len(of_train.impacts) == len(of_train.intervals) + (len(train) > 0)


@settings(max_examples=12, deadline=None)
@given(st.lists(st.floats(0.1, 0.9), max_size=2), st.floats(0, 0.003), st.integers(0, 2**32))
def test_a_clean_periodic_train_is_untouched(phases, jitter, seed):
    rng = np.random.default_rng(seed)
    phases = np.unique(np.round([0.0, *phases], 1))  # apart by more than they scatter
    time = ((np.arange(120)[:, None] + phases) * 0.05).ravel()
    train = Impacts(time + 0.05 * jitter * rng.uniform(-1.7, 1.7, len(time)))
    found = repair_intervals(train, 0.05)
    assert found.impacts is train
