"""Every count is what comparing pair by pair gives, whatever the series, radii, kernel, threads."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import impactsig
from impactsig.reconstruct.sums import _counting
from tests import naive_reconstruct

KERNELS = ("pairs", "boxes", "trees", None)
few = settings(deadline=None, max_examples=60)

smooth = st.lists(st.floats(-10, 10), min_size=12, max_size=70)
quantised = st.lists(st.integers(-3, 3).map(lambda k: 0.1 * k), min_size=12, max_size=70)
stretches = st.lists(
    st.tuples(st.sampled_from([0.0, 0.5, 0.7, 1e-300, 1e3]), st.integers(1, 20)),
    min_size=12,
    max_size=16,
).map(lambda runs: [value for value, times in runs for _ in range(times)])
extreme = st.lists(st.floats(-8e307, 8e307), min_size=12, max_size=30)


@st.composite
def problems(draw):
    """(x, dimensions, delay, theiler, radii), some radii equal to a distance, or next to one."""
    x = np.array(draw(st.one_of(smooth, quantised, stretches, extreme)))
    delay = draw(st.integers(1, 3))
    most = (len(x) - 2) // delay + 1
    dimensions = tuple(sorted(draw(st.sets(st.integers(1, min(most, 7)), min_size=1))))
    vectors = len(x) - (dimensions[-1] - 1) * delay
    theiler = draw(st.integers(0, vectors - 2))
    places = st.tuples(*(st.integers(0, len(x) - 1),) * 2)
    distances = [abs(x[i] - x[j]) for i, j in draw(st.lists(places, max_size=8))]
    near = [step(d) for d in distances for step in (float, _above, _below)]
    radii = np.array([*near, *draw(st.lists(st.floats(1e-3, 30), min_size=1, max_size=8))])
    return x, dimensions, delay, theiler, np.unique(radii[(radii > 0) & (radii < np.inf)])


def _above(d):
    return float(np.nextafter(d, 1.7e308))


def _below(d):
    return float(np.nextafter(d, 0.0))


@few
@given(problems(), st.integers(1, 3))
def test_counts_are_those_of_comparing_pair_by_pair(problem, workers):
    expected = naive_reconstruct.correlation_counts(*problem)
    for kernel in KERNELS:
        found = _counting.count_pairs(*problem, workers, kernel)
        np.testing.assert_array_equal(found, expected, err_msg=str(kernel))


@few
@given(problems())
def test_a_share_of_pairs_grows_with_the_radius_and_falls_with_the_dimension(problem):
    x, dimensions, delay, theiler, radii = problem
    found = impactsig.correlation_sum(x, dimensions, delay=delay, theiler=theiler, radii=radii)
    assert np.all(np.diff(found.counts, axis=1) >= 0)
    assert np.all(np.diff(found.counts, axis=0) <= 0)
    assert np.all((found.sums >= 0) & (found.sums <= 1))
    n = len(x) - (np.array(dimensions) - 1) * delay - theiler
    np.testing.assert_array_equal(found.pairs, n * (n - 1) // 2)
