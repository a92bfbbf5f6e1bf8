"""Tails of distributions, by scipy's."""

import itertools

import pytest
from scipy.special import betaincc, ndtr

from impactsig.intervals.phases._tails import beta_above, normal_below


@pytest.mark.parametrize("n", [0, 1, 7, 300, 20_000])
def test_tails_of_beta_distributions(n):
    shares = (0.0, 1e-3, 0.2, 0.5, 0.71, 0.999, 1.0)
    for share, x in itertools.product(shares, (0.0, 1e-9, 0.2, 0.25, 0.65, 0.72, 0.9999, 1.0)):
        a = round(share * n) + 1
        b = n - a + 2
        expected = float(betaincc(a, b, x))
        assert beta_above(a, b, x) == pytest.approx(expected, rel=1e-10, abs=1e-290)


def test_tails_of_normal_distributions():
    for x in (-37.0, -8.0, -1.0, 0.0, 0.3, 5.0, 40.0):
        assert normal_below(x) == pytest.approx(float(ndtr(x)), rel=1e-13)
