"""The family of pulses and its linearization, against a slow twin and finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig.detect.pulses._model import (
    BY_POWER,
    POWERS,
    START,
    VALUE,
    WIDER,
    inside,
    linearize,
    parts_of,
    room_for,
)
from tests import naive_force

T = np.arange(60.0)


def drawn(p):
    """Samples of a pulse, its normal equations and its derivative by the power."""
    curve, normal = room_for(len(T)), np.zeros((WIDER, WIDER + 1))
    linearize(p, p[POWERS], T, np.ones(len(T)), curve, normal)
    first, _, last = inside(p, parts_of(p), T)
    samples, by_power = np.zeros(len(T)), np.zeros(len(T))
    samples[first:last] = p[0] * curve[VALUE, : last - first]
    by_power[first:last] = curve[BY_POWER, : last - first]
    return samples, normal, by_power


def some(seed):
    """Parameters of a pulse; its edges are neither steep nor between two samples."""
    rng = np.random.default_rng(seed)
    shape = rng.normal([0.0, -1.0, 0.5, 2.4, 0.0], [0.5, 0.8, 0.2, 0.2, 0.2])
    return np.concatenate(([rng.uniform(5, 50), 9.3], shape))


@pytest.mark.parametrize("seed", range(12))
def test_pulses_are_those_of_the_slow_twin(seed):
    p = some(seed)
    expected = naive_force.pulse_shape(T, *p[:2], *parts_of(p), np.exp(p[4]), p[POWERS])
    np.testing.assert_allclose(drawn(p)[0], expected, atol=2e-5 * p[0])


@pytest.mark.parametrize("seed", range(12))
def test_normal_equations_are_those_of_finite_differences(seed):
    p = some(seed)
    samples, normal, by_power = drawn(p)
    slopes = np.empty((WIDER, len(T)))
    for m in range(WIDER):
        step = 1e-4 * (np.arange(WIDER) == m)
        slopes[m] = (drawn(p + step)[0] - drawn(p - step)[0]) / 2e-4
    square = slopes @ slopes.T
    size = np.sqrt(np.diag(square))
    low = np.tril(normal[:, :WIDER] / np.outer(size, size))
    np.testing.assert_allclose(low, np.tril(square / np.outer(size, size)), atol=0.01)
    rest = slopes @ (np.ones(len(T)) - samples) / size
    np.testing.assert_allclose(normal[:, WIDER] / size, rest, atol=0.01 * np.linalg.norm(samples))
    np.testing.assert_allclose(by_power, slopes[4], atol=1e-3 * p[0])


@pytest.mark.parametrize("skew", [-0.8, 0.0, 0.5])
@pytest.mark.parametrize("apart", [-0.3, 0.0, 0.3])
def test_the_crest_is_smooth(skew, apart):
    # Without a flat top both sides have one curvature, whatever their lengths and powers.
    middle = np.log(20.0)
    rise, fall = np.exp(middle + skew / 2), np.exp(middle - skew / 2)
    p = np.array([1.0, 0.0, skew, -30.0, 0.3, middle, apart])
    bend = []
    for at in (-1.0, 1.0):
        p[START] = 30.0 - rise - at  # a sample lies one beside the crest
        bend.append(1.0 - drawn(p)[0][30])
    assert rise + fall > 30
    assert bend[0] == pytest.approx(bend[1], rel=0.15)
