"""Logarithms, exponentials and the greatest of numbers in vector lanes."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from impactsig.detect.sound._lane_kernels import (
    exponentials,
    greatest_of,
    logarithms,
    median_energy,
)


def in_last_places(found, exact):
    """Greatest error in units of the last place."""
    places = [abs(f - e) / np.spacing(abs(float(e))) for f, e in zip(found, exact, strict=True)]
    return float(max(places))


@pytest.mark.parametrize("count", [1, 7, 1000])
def test_logarithms(count):
    rng = np.random.default_rng(1)
    x = np.concatenate((10 ** rng.uniform(-300, 300, count), 1 + 1e-3 * rng.standard_normal(count)))
    x = np.concatenate((x, [2.0, 0.5, np.sqrt(0.5), np.sqrt(2), 1 - 2**-53, 1 + 2**-52, 1e-307]))
    found = x.copy()
    logarithms(found)
    assert in_last_places(found, [mpmath.log(mpmath.mpf(v)) for v in x]) <= 2.0
    one = np.ones(3)
    logarithms(one)
    assert not one.any()


@pytest.mark.parametrize("count", [1, 7, 1000])
def test_exponentials(count):
    rng = np.random.default_rng(2)
    x = np.concatenate((rng.uniform(-700, 700, count), 1e-3 * rng.standard_normal(count)))
    x = np.concatenate((x, [0.0, -0.0, np.log(2.0) / 2, -np.log(2.0) / 2, 1e-300, -700.0]))
    found = x.copy()
    exponentials(found)
    assert in_last_places(found, [mpmath.exp(mpmath.mpf(v)) for v in x]) <= 2.0
    far = np.array([-701.0, -1e9, -np.inf])
    exponentials(far)
    assert ((far >= 0.0) & (far < 1e-303)).all()


@pytest.mark.parametrize("count", [1, 3, 64, 1001])
def test_greatest(count):
    rng = np.random.default_rng(3)
    for x in (rng.standard_normal(count), -(10 ** rng.uniform(-300, 300, count))):
        assert greatest_of(x) == x.max()
    assert greatest_of(np.array([-np.inf, -0.0, -5e-324])) == 0.0
    assert greatest_of(np.full(5, -np.inf)) == -np.inf
    assert greatest_of(np.array([1.0, np.inf])) == np.inf


def test_nothing_is_done_with_no_numbers():
    for function in (logarithms, exponentials):
        function(np.empty(0))


@pytest.mark.parametrize("count", [1, 4, 7])
def test_median_energy_of_parts_of_sounds(count):
    sounds = np.random.default_rng(3).standard_normal((count, 30))
    expected = np.median(np.sum(sounds[:, 4:25] ** 2, axis=1))
    assert median_energy(sounds, 4, 25) == pytest.approx(expected, rel=1e-13)
