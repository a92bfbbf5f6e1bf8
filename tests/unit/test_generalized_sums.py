"""Correlation sums of given vectors, in both norms, with both kernels, of any order."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from impactsig import InvalidInput, correlation_dimension, correlation_sum

from ..series import henon

RNG = np.random.default_rng(5)


def multiplicative(depth, weight):
    """Points of a Cantor set of thirds, as often as its binomial measure of 1 : weight says."""
    points, times = np.zeros(1), np.ones(1, int)
    for _ in range(depth):
        points = np.concatenate((points / 3, (points + 2) / 3))
        times = np.concatenate((times, weight * times))
    return np.repeat(points, times), times


def dimension_of_binomial(p, q):
    """D_q of the binomial measure of p and 1 - p on thirds."""
    if q == 1:
        return -(p * np.log(p) + (1 - p) * np.log(1 - p)) / np.log(3)
    return -np.log(p**q + (1 - p) ** q) / (q - 1) / np.log(3)


@pytest.mark.parametrize("q", [0, 0.5, 1, 2, 3, 8])
def test_the_binomial_measure_has_its_generalized_dimensions(q):
    """Points nearer than 3^-k are those of the same interval of depth k."""
    points, _ = multiplicative(6, 3)
    depths = np.arange(1, 5)
    found = correlation_sum(points[:, None], theiler=0, q=q, radii=3.0 ** -depths[::-1])
    slope = found.slope(1e-6, 1.0)[0]
    # Of the 4096 points the rarest intervals hold few, and a point is no partner of itself.
    assert slope == pytest.approx(dimension_of_binomial(0.25, q), rel=0.03 if q < 1 else 0.005)


@pytest.mark.parametrize("q", [-1, 0, 1, 2, 2.5])
def test_the_order_is_that_of_a_mean_over_intervals(q):
    """Exactly: C_i is the share of the other points that are in the same interval."""
    points, _ = multiplicative(5, 2)
    radii = 3.0 ** -np.arange(3.0)[::-1]
    found = correlation_sum(points[:, None], theiler=0, q=q, radii=radii)
    for radius, c in zip(radii, found.sums[0], strict=True):
        _, members = np.unique(np.floor(points / radius + 1e-9), return_counts=True)
        share, weight = (members - 1) / (len(points) - 1), members / len(points)
        expected = (
            np.exp(weight @ np.log(share))
            if q == 1
            else (weight @ share ** (q - 1)) ** (1 / (q - 1))
        )
        assert c == pytest.approx(expected, rel=1e-12)


def test_order_1_is_the_limit_of_those_beside_it():
    x = henon(400)
    near, at = (correlation_sum(x, [2], q=q, radii=[0.3, 0.5]).sums for q in (1 + 1e-6, 1))
    np.testing.assert_allclose(near, at, rtol=1e-5)


def test_a_vector_without_neighbours_makes_low_orders_0():
    points = np.array([[0.0], [0.1], [5.0]])
    for q in (0, 1):
        found = correlation_sum(points, theiler=0, q=q, radii=[1.0, 10.0])
        np.testing.assert_array_equal(found.sums, [[0, 1]])
        assert np.isnan(found.local_slopes()).all()
        assert np.isnan(found.slope(0.5, 20.0)).all()


@pytest.mark.parametrize(("norm", "counts"), [("max", [0, 1, 3]), ("euclidean", [0, 1, 2])])
def test_a_right_triangle_by_both_norms(norm, counts):
    triangle = [[0, 0], [3, 0], [0, 4]]
    found = correlation_sum(triangle, theiler=0, norm=norm, radii=[2.9, 3.0, 4.0])
    np.testing.assert_array_equal(found.counts, [counts])
    assert (found.pairs.tolist(), found.dimensions) == ([3], (2,))
    assert ("euclidean" in str(found)) == (norm == "euclidean")


@pytest.mark.parametrize("norm", ["max", "euclidean"])
@pytest.mark.parametrize("kernel", ["step", "gaussian"])
def test_vectors_are_compared_pair_by_pair(norm, kernel):
    vectors, radii = RNG.normal(size=(150, 3)), np.geomspace(0.2, 5, 300)
    found = correlation_sum(vectors, theiler=4, norm=norm, kernel=kernel, radii=radii, workers=2)
    i, j = np.triu_indices(150, 5)
    gaps = vectors[i] - vectors[j]
    d = np.abs(gaps).max(axis=1) if norm == "max" else np.sqrt((gaps**2).sum(axis=1))
    for radius, count in zip(radii, found.counts[0], strict=True):
        if kernel == "step":
            assert count == np.count_nonzero(d <= radius)
        else:
            assert count == pytest.approx(np.exp(-((d / (2 * radius)) ** 2)).sum(), rel=1e-12)
    assert found.pairs == len(i)


@pytest.mark.parametrize("m", [1, 2])
def test_the_gaussian_sum_of_a_normal_density_has_the_closed_form(m):
    """The mean of exp(-|d|^2 / 4 H^2) over d of variance 2 is (1 + 1 / H^2)^(-m / 2)."""
    count, radii = 40, np.array([0.4, 0.6, 1.0])
    one = norm.ppf(np.arange(0.5, count) / count)
    vectors = np.stack(np.meshgrid(*m * [one]), axis=-1).reshape(-1, m)
    found = correlation_sum(vectors, theiler=0, norm="euclidean", kernel="gaussian", radii=radii)
    n = len(vectors)
    with_itself = ((n - 1) * found.sums[0] + 1) / n
    np.testing.assert_allclose(with_itself, (1 + radii**-2) ** (-m / 2), rtol=0.02)


def test_delay_vectors_given_are_those_of_the_series():
    x, radii = henon(500), np.geomspace(0.05, 1, 9)
    vectors = np.column_stack((x[:-2], x[2:]))
    embedded = correlation_sum(x, [2], delay=2, theiler=3, radii=radii)
    np.testing.assert_array_equal(
        correlation_sum(vectors, theiler=3, radii=radii).counts, embedded.counts
    )
    # A vector at the end has fewer partners outside the window, but the same weight.
    other = correlation_sum(x, [2], delay=2, theiler=3, radii=radii, q=2 + 1e-9)
    np.testing.assert_allclose(other.sums, embedded.sums, rtol=1e-4)


def test_default_radii_of_vectors_hold_from_no_pair_to_all():
    vectors = RNG.normal(size=(200, 2))
    found = correlation_sum(vectors, norm="euclidean")
    assert found.counts[0, 0] == 0 < found.counts[0, 1]
    assert found.counts[0, -1] == found.pairs[0]
    assert correlation_sum(vectors, kernel="gaussian").counts[0, 0] >= 1


@pytest.mark.parametrize(
    ("x", "options", "argument"),
    [
        (np.ones((5, 2)), {"dimensions": 2}, "x"),
        (np.ones((5, 2)), {"delay": 1}, "x"),
        (np.ones((5, 2)), {}, "x"),
        (np.ones((1, 2)), {}, "x"),
        (np.ones((5, 0)), {}, "x"),
        ([[0.0, np.nan], [1, 2]], {}, "x"),
        ([[0.0], [1.0, 2.0]], {}, "x"),
        (np.eye(3), {"theiler": 2}, "theiler"),
        (np.eye(3), {"norm": "taxicab"}, "norm"),
        (np.eye(3), {"kernel": 2}, "kernel"),
        (np.eye(3), {"q": np.nan}, "q"),
        (np.eye(3), {"q": "two"}, "q"),
    ],
)
def test_what_cannot_be_summed_is_named(x, options, argument):
    with pytest.raises(InvalidInput) as refused:
        correlation_sum(x, **options)
    assert refused.value.argument == argument


# -- the rule of the slope -------------------------------------------------------------------


def test_the_slope_of_a_sum_is_read_by_any_rule():
    x, radii = henon(1000), np.geomspace(0.01, 0.1, 8)
    found = correlation_sum(x, [2], radii=radii)
    logs, y = np.log(radii), np.log(found.sums[0])
    assert found.slope(0.009, 0.2) == pytest.approx(np.polyfit(logs, y, 1)[0], rel=1e-9)
    assert found.slope(0.009, 0.2, "theil-sen") == pytest.approx(found.slope(0.009, 0.2), rel=0.05)
    two = found.slope(0.009, 0.2, lambda x, y: (y[-1] - y[0]) / (x[-1] - x[0]))
    assert two == pytest.approx((y[-1] - y[0]) / np.log(10))
    with pytest.raises(InvalidInput, match="two of the radii"):
        found.slope(0.011, 0.012)


def ends(x, y):
    return (y[-1] - y[0]) / (x[-1] - x[0])


def test_the_slope_of_the_dimension_is_read_by_any_rule():
    x = henon(800)
    default = correlation_dimension(x, 2, value_error=0.0)
    same = correlation_dimension(x, 2, value_error=0.0, fit=lambda x, y: np.polyfit(x, y, 1)[0])
    assert same.slope.value == pytest.approx(default.slope.value, rel=1e-9)
    assert same.slope.interval == pytest.approx(default.slope.interval, rel=1e-6)
    for fit in ("theil-sen", ends):
        other = correlation_dimension(x, 2, value_error=0.0, fit=fit).slope
        assert other.value == pytest.approx(default.slope.value, abs=0.15)
        assert other.value != default.slope.value
        assert other.interval[0] < default.slope.value < other.interval[1]
    logs, sums = np.log(default.scales), np.log(default.sums)
    assert other.value == pytest.approx(ends(logs, sums), rel=1e-9)


@pytest.mark.parametrize("fit", ["cubic", 2, None, lambda x, y: "steep", lambda x, y: np.nan])
def test_a_rule_that_gives_no_slope_is_refused(fit):
    with pytest.raises(InvalidInput) as refused:
        correlation_dimension(henon(300), 2, value_error=0.0, fit=fit)
    assert refused.value.argument == "fit"
