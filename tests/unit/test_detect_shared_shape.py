"""The shape that impacts share, against integrals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate

from impactsig.detect.pulses._model import LENGTH, SKEW, WIDER
from impactsig.detect.pulses.edges import FIT
from impactsig.detect.pulses.fit_errors import KEPT, SQUARE
from impactsig.detect.pulses.shape._shared_shape_kernels import (
    LEAST,
    ROUNDS,
    SHAPES,
    Shape,
    estimate_shape,
    set_free,
)

CONTACT = LENGTH - SKEW


def variance_used(level, error):
    """Variance of contacts that faint pulses are measured with, where level +- error is told."""
    rows = np.zeros((8, FIT + KEPT))
    rows[:, FIT + SQUARE : FIT + SQUARE + WIDER**2] = np.eye(WIDER).ravel()
    told = np.zeros((2, SHAPES))
    told[:, CONTACT] = level * error**-2.0, error**-2.0
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
