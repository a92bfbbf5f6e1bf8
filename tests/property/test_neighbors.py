"""Nearest neighbours are exact, whatever the points: ties, duplicates, windows included."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import impactsig
from impactsig.reconstruct import _neighbors
from tests import naive_reconstruct_embed as naive

values = st.one_of(
    st.lists(st.integers(-3, 3), min_size=4, max_size=70),
    st.lists(st.floats(-1e3, 1e3), min_size=4, max_size=70),
)


@given(values, st.integers(1, 3), st.integers(0, 5), st.booleans())
def test_distances_are_those_of_the_slow_twin(x, m, theiler, maximum):
    vectors = impactsig.delay_embed(x, m)
    index, distance = _neighbors.nearest(_neighbors.tree(vectors), theiler, maximum)
    expected = naive.nearest(vectors, theiler, maximum)
    assert np.allclose(distance, expected, rtol=1e-12)
    assert np.array_equal(index == _neighbors.NOBODY, np.isinf(expected))
    for i in np.flatnonzero(index != _neighbors.NOBODY):
        gap = np.abs(vectors[i] - vectors[index[i]])
        assert abs(i - index[i]) > theiler
        assert np.isclose(gap.max() if maximum else np.linalg.norm(gap), distance[i], rtol=1e-12)


@given(values, st.integers(1, 3), st.integers(0, 5), st.floats(0.1, 10))
def test_all_neighbours_within_a_radius_are_found(x, m, theiler, radius):
    vectors = impactsig.delay_embed(x, m)
    found = _neighbors.tree(vectors)
    one, start, who = _neighbors.within(
        found, np.arange(len(vectors)), radius, theiler, False, 10_000
    )
    for r, i in enumerate(one):
        assert set(who[start[r] : start[r + 1]].tolist()) == naive.within(
            vectors, radius, theiler, i
        )


@given(st.integers(0, 1000), st.floats(0.01, 100), st.floats(-10, 10))
def test_exponent_and_dimension_do_not_depend_on_unit_and_origin(seed, unit, origin):
    x = naive.henon(400, 0.001 * (seed % 300))
    one = impactsig.lyapunov_exponent(x, dimension=2, theiler=4)
    other = impactsig.lyapunov_exponent(unit * x + origin, dimension=2, theiler=4)
    assert np.isclose(one.exponent or 0, other.exponent or 0, rtol=1e-3)
    assert (
        impactsig.false_nearest_neighbors(x, 3, theiler=4).dimension
        == impactsig.false_nearest_neighbors(unit * x + origin, 3, theiler=4).dimension
    )
