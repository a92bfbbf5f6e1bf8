"""The shape that impacts share, against integrals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate

from benchmarks.errors import errors
from impactsig.detect.pulses._model import LENGTH, SKEW, WIDER
from impactsig.detect.pulses.edges import FIT
from impactsig.detect.pulses.fit_errors import KEPT, SQUARE
from impactsig.detect.pulses.shape._shared_shape_kernels import (
    ALONE,
    LEAST,
    ROUNDS,
    SHAPES,
    Shape,
    estimate_shape,
    set_free,
)
from impactsig.detect.pulses.shape.told import (
    FORGOTTEN,
    OF_REST,
    learn,
    nothing_told,
    told_by_last,
    with_told,
)

CONTACT = LENGTH - SKEW


def variance_used(level, error):
    """Variance of contacts that faint pulses are measured with, where level +- error is told."""
    rows = np.zeros((8, FIT + KEPT))
    rows[:, FIT + SQUARE : FIT + SQUARE + WIDER**2] = np.eye(WIDER).ravel()
    told = nothing_told()
    told[:ALONE, CONTACT] = level * error**-2.0, error**-2.0
    about = np.stack([np.zeros(SHAPES), np.ones(SHAPES)])
    fits = set_free(rows, np.arange(8))
    before = Shape(about[0].copy(), about[1].copy(), np.zeros((SHAPES, SHAPES)), told)
    estimate_shape(fits, about, told, before, ROUNDS)
    known = fits.information[CONTACT, CONTACT, 0]
    return 1.0 / (1.0 / fits.covariance[CONTACT, CONTACT, 0] - known)


@pytest.mark.parametrize("ratio", [-3.0, -1.0, 0.0, 0.5, 1.0, 2.0, 4.0, 10.0])
def test_pulses_are_measured_with_the_spread_that_is_expected(ratio):
    # Variance s^2, told as ratio +- 1, of any s as likely as another.
    error = 4e-7
    density = lambda s: np.exp(-0.5 * (s * s - ratio) ** 2 + 0.5 * min(ratio, 0.0) ** 2)  # noqa: E731
    top = integrate.quad(lambda s: s * s * density(s), 0.0, 6.0)[0]
    expected = top / integrate.quad(density, 0.0, 6.0)[0]
    used = variance_used(ratio * error, error) / error
    assert expected - 0.1 < used < expected + 0.45


def test_no_spread_is_less_than_the_least():
    assert variance_used(-1e-2, 1e-5) == pytest.approx(LEAST[CONTACT] ** 2, rel=1e-3)


def test_spans_tell_of_a_rest_by_their_information():
    told = nothing_told()
    for left, error in [(3.0, 1.0), (1.0, 0.5)]:
        mean, deviation = with_told(left, error, told)
        learn(told.copy(), told)
    # Weights 1 - FORGOTTEN for the first and 4 for the second.
    first = 1.0 - FORGOTTEN
    assert mean == pytest.approx((3.0 + 4.0 * 1.0) / 5.0)
    assert deviation == pytest.approx(5.0**-0.5)
    assert told[:, OF_REST] == pytest.approx([3.0 * first + 4.0, first + 4.0, 4.0, 4.0])
    assert told_by_last(told)[:, OF_REST] == pytest.approx([4.0, 4.0, 0.0, 0.0])
    # One that shows none does not take it back.
    assert with_told(-9.0, 1.0, told.copy())[0] > -1.0
    # One that shows more is on its own, and those after it begin with what it tells.
    assert with_told(90.0, 1.0, told) == pytest.approx((90.0, 1.0))
    assert told[:ALONE, OF_REST] == pytest.approx(0.0)


def test_a_span_that_shows_nothing_tells_nothing():
    told = nothing_told()
    assert with_told(0.0, np.inf, told) == (0.0, np.inf)
    assert not told.any()


def contacts_of_seconds(pulse, seed, contact):
    """Of each second, contact times' errors and standard errors in the median, at 30 dB and 40."""
    rows = errors(pulse, 20e3, seed, contact=contact, levels=(6.0, 10.0, 20.0, 30.0, 40.0))
    seconds = {}
    for row in rows:
        if row["level"] >= 30:
            seconds.setdefault(row["second"][1], []).append(
                (row["contact_time"], row["contact_time_error"])
            )
    return np.array([np.median(one, axis=0) for one in seconds.values()])


def test_a_second_whose_noise_hides_the_rest_of_the_shape_believes_those_before():
    # In the third second fits leave next to nothing. Contacts were taken to be known to 0.06
    # samples there, half as much as in the others, and were 0.57 off.
    off, stated = contacts_of_seconds("flat-topped", 61303, 1e-3).T
    assert np.abs(off / stated).max() < 4.0
    assert stated.min() > 0.7 * np.median(stated)


def test_the_first_second_believes_the_second():
    # Only the second shows that a foot of infinite slope is there.
    stated = contacts_of_seconds("asymmetric", 61303, 3e-4)[:, 1]
    assert stated[0] > 0.7 * stated[1]
