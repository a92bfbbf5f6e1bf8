"""Which radii a dimension is read from: the level of the noise, and the largest correlation sum."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import correlation_dimension
from impactsig.reconstruct import _scaling
from impactsig.reconstruct._counting import pair_counts_by_block

RADII = 2.0 ** (np.arange(-96, 1) / 8)


@pytest.mark.parametrize("level", [0.005, 0.02])
@pytest.mark.parametrize("dimensions", [(2, 3), (2, 3, 4)])
def test_noise_about_separate_values_is_measured_without_bias(level, dimensions):
    """Seven values drawn independently: C_(m+1) / C_m is erf(r / 2 s) / 7, to the letter."""
    found = []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        x = rng.integers(0, 7, 2000) + level * rng.standard_normal(2000)
        extent = np.ptp(x)
        counts = [pair_counts_by_block(x / extent, m, 1, 12, RADII, 11, 1) for m in dimensions]
        found.append(_scaling.noise_level(counts, RADII, dimensions).level * extent)
    # One is known to some 4 %.
    assert np.mean(found) == pytest.approx(level, rel=0.05)
    assert found == pytest.approx([level] * 10, rel=0.15)


def test_scales_end_where_a_tenth_of_the_pairs_is_nearer():
    """Independent values, uniform from 0 to 1: C(r) is (2 r - r^2)^m."""
    x = np.random.default_rng(0).uniform(size=2000)
    found = correlation_dimension(x, 3)
    step = found.correlation.radii[1] / found.correlation.radii[0]
    for m, one in enumerate(found.by_dimension, start=1):
        tenth = 1 - np.sqrt(1 - 0.1 ** (1 / m))
        # The first radius of the grid beyond it, by a C known to 2 %.
        assert tenth / 1.02 <= one.region[1] <= 1.02 * step * tenth
