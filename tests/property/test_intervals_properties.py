"""What must hold of any train of impacts."""

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

import impactsig
from impactsig import Impacts

intervals = st.lists(st.floats(1e-6, 1e3), min_size=2, max_size=60)
trains = st.lists(st.floats(0, 1e3), min_size=0, max_size=60)


@given(intervals)
def test_the_density_always_integrates_to_1(values):
    histogram = impactsig.interval_histogram(values)
    assert histogram.count.sum() == len(values)
    assert np.isclose(np.sum(histogram.density * np.diff(histogram.edges)), 1, rtol=1e-9)


@given(intervals, st.floats(1e-3, 1e3))
def test_variation_does_not_depend_on_the_unit_of_time(values, unit):
    for measure in (
        impactsig.coefficient_of_variation,
        impactsig.cv2,
        impactsig.local_variation,
    ):
        scaled = measure(unit * np.array(values))
        assert np.isclose(measure(values), scaled, rtol=1e-9, atol=1e-9)


@given(intervals)
def test_the_local_measures_stay_in_their_range(values):
    assert 0 <= impactsig.cv2(values) <= 2
    assert 0 <= impactsig.local_variation(values) <= 3


@given(trains, st.integers(1, 5))
def test_every_pair_of_the_return_map_is_a_pair_of_intervals(time, lag):
    impacts = Impacts.from_times(time)
    x, y = impactsig.return_map(impacts, lag)
    isi = impacts.intervals()
    assert len(x) == len(y) == max(len(isi) - lag, 0)
    assert np.array_equal(x, isi[: len(x)])
    assert np.array_equal(y, isi[lag:])


@settings(deadline=None, max_examples=40)
@example([0.0, 0.0, 1.0, 2.0, 3.0, 1.125, 0.75, 2.3e-309], None)
@given(trains, st.one_of(st.none(), st.floats(1e-3, 1e3)))
def test_any_train_gets_an_answer(time, forcing_period):
    result = impactsig.identify_period(Impacts.from_times(time), forcing_period)
    assert 0 <= result.confidence <= 1
    assert result.describe()
    near = result.kind in ("quasi-periodic", "banded")
    assert (result.impacts is not None) == (result.recurs or near)
    total = sum(result.probability.values())
    assert np.isclose(total, 1) or (total == 0 and not result.recurs and not result.aperiodic)
    if result.impacts is not None:
        assert len(result.phases) == result.impacts
        assert np.all((result.phases >= 0) & (result.phases < 1))
        assert 0 <= result.missed <= 1
        assert 0 <= result.spurious <= 1


@settings(deadline=None, max_examples=30)
@given(
    st.sampled_from([[0.0], [0.0, 0.3], [0.0, 0.45, 0.6]]),
    st.floats(1e-3, 1e3),
    st.floats(-1e5, 1e5),
    st.integers(1, 3),
)
def test_neither_the_unit_nor_the_origin_of_time_matters(phases, unit, origin, periods):
    orbit = (np.arange(40)[:, None] + np.array(phases)).ravel() * periods
    impacts = Impacts.from_times(unit * orbit + unit * origin)
    result = impactsig.identify_period(impacts, unit)
    assert (result.impacts, result.periods) == (len(phases), periods)
