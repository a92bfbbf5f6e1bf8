"""What must hold of a measured train whatever the truth and the instrument."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from impactsig import Impacts
from impactsig.simulation.instruments.measuring import measure
from tests import naive

SHARE = st.floats(0, 1)
TIME = st.sampled_from([0.0, 1e-6, 0.01, 0.1, 1.0, 10.0])


@settings(max_examples=200, deadline=None)
@given(
    st.lists(st.floats(0, 10), max_size=60),
    TIME,
    TIME,
    SHARE,
    st.floats(0, 3),
    SHARE,
    st.integers(0, 2**32),
)
def test_measured_trains_are_trains(instants, jitter, dead_time, missed, spurious, echoes, seed):
    instants = np.sort(instants)
    truth = Impacts(instants, start=0.0, duration=10.0, peak=1.0 + instants)
    settings = {"jitter": jitter, "missed": missed, "spurious": spurious, "echoes": echoes}
    alive = measure(truth, **settings, echo_delay=0.01, seed=seed)
    seen = measure(truth, **settings, echo_delay=0.01, dead_time=dead_time, seed=seed)
    for one in (alive, seen):
        time = one.impacts.time
        assert len(one.source) == len(time)
        assert np.all((time >= 0) & (time <= 10))
        real = one.source[one.source >= 0]
        assert len(np.unique(real)) == len(real)
        assert len(real) + len(one.missed) == len(truth)
        np.testing.assert_array_equal(one.impacts.peak[one.source >= 0], truth.peak[real])
        assert bool(one.impacts.reason) == (len(time) == 0)
    np.testing.assert_array_equal(
        seen.impacts.time, naive.outside_dead_time(alive.impacts.time, dead_time)
    )
