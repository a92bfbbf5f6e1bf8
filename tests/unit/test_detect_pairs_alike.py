"""Errors of pulses that touch or overlap, and of those of coarse converters."""

from __future__ import annotations

import numpy as np
import pytest

import impactsig
from benchmarks.recordings import add_pulses
from impactsig.detect.pulses.alike._alike_kernels import BOTH, KNOTS, fit_two
from impactsig.impacts import UNRESOLVED

RATE, CONTACT, NOISE = 50_000.0, 1e-3, 0.015
SHAPES = {
    "half-sine": lambda u: np.sin(np.pi * u),
    "soft": lambda u: np.sin(np.pi * u) ** 1.35,
    "softer": lambda u: np.sin(np.pi * u) ** 1.7,
    "with a jump": lambda u: 1.049 * np.exp(-0.1 * u) * np.sin(np.pi * (0.03 + 0.97 * u)),
}


def train(shape, apart, seed, share):
    """Record, starts and heights: a share of the impacts are pairs."""
    rng = np.random.default_rng(seed)
    places = 0.05 + np.cumsum(0.04 + rng.exponential(0.02, 100))
    heights = rng.uniform(0.7, 1.6, len(places))
    two = rng.random(len(places)) < share
    second = heights[two] * rng.uniform(0.5, 1.2, two.sum())
    starts = np.concatenate((places, places[two] + apart * CONTACT))
    heights = np.concatenate((heights, second))
    paired = np.concatenate((two, np.ones(two.sum(), bool)))
    order = np.argsort(starts)
    starts, heights = starts[order], heights[order]
    x = NOISE * rng.standard_normal(round((places[-1] + 0.1) * RATE))
    add_pulses(x, RATE, starts, np.full(len(starts), CONTACT), heights, SHAPES[shape])
    rec = impactsig.Recording(x, RATE, units="N", sensor="force")
    return rec, starts, heights, paired[order]


@pytest.mark.parametrize("share", [0.5, 1.0])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("apart", [0.85, 1.0])
def test_errors_of_pairs_hold(shape, apart, share):
    rec, starts, heights, paired = train(shape, apart, 7, share)
    found = impactsig.detect_impacts(rec)
    i, j = impactsig.match_impacts(found, impactsig.Impacts(starts), 0.3e-3).pairs.T
    assert len(i) > 0.97 * len(starts)
    keep = paired[j] & (found.flags[i] & UNRESOLVED == 0)
    assert keep.sum() > 0.95 * paired[j].sum()
    i, j = i[keep], j[keep]
    for name, truth in (("time", starts[j]), ("contact_time", CONTACT), ("peak", heights[j])):
        z = (getattr(found, name)[i] - truth) / getattr(found, f"{name}_error")[i]
        # That of a jump at the start is the one of single pulses; alone, it is not seen.
        assert np.sqrt(np.mean(z**2)) < (3.0 if shape == "with a jump" else 1.7), name
    off = found.time[i] - starts[j]
    assert np.median(np.abs(off)) < (0.04 if shape == "with a jump" else 0.02) * CONTACT


def test_a_pair_of_a_shape_is_found_where_it_is():
    rng = np.random.default_rng(3)
    knots = np.zeros(KNOTS)
    places = np.linspace(-3 / 64, 1 + 3 / 64, KNOTS)
    knots[3:-3] = np.sin(np.pi * places[3:-3]) ** 2
    truth = np.array([50.0, 20.3, np.log(60.0), 30.0, 71.9, np.log(55.0), 0.4])
    points = np.arange(160.0)
    clean = truth[6] + sum(
        truth[m] * np.interp((points - truth[m + 1]) / np.exp(truth[m + 2]), places, knots)
        for m in (0, 3)
    )
    z = []
    for _ in range(40):
        p = truth + np.array([5.0, 3.0, 0.05, -5.0, -3.0, 0.05, 0.0])
        covariance = np.empty((BOTH, BOTH))
        x = clean + rng.standard_normal(len(points))
        misfit = fit_two(points, x, knots, np.log(58.0), 1.0, p, covariance)
        assert 0.5 < misfit < 1.6
        z.append((p - truth) / np.sqrt(np.diag(covariance)))
    np.testing.assert_array_less(np.abs(np.mean(z, axis=0)), 0.6)
    np.testing.assert_allclose(np.std(z, axis=0), 1.0, atol=0.35)


@pytest.mark.parametrize("noise", [0.05, 0.25])
@pytest.mark.parametrize("power", [1.0, 1.3, 1.6])
def test_errors_hold_where_the_converter_hides_noise_and_feet(power, noise):
    step, rng = 0.1, np.random.default_rng(11)
    starts = 0.05 + np.cumsum(0.04 + 0.01 * rng.random(150))
    heights = rng.uniform(0.7, 1.6, len(starts))
    x = noise * step * rng.standard_normal(round((starts[-1] + 0.1) * RATE))
    contact = 1.2e-3
    add_pulses(
        x, RATE, starts, np.full(150, contact), heights, lambda u: np.sin(np.pi * u) ** power
    )
    rec = impactsig.Recording(step * np.round(x / step), RATE, units="N", sensor="force")
    found = impactsig.detect_impacts(rec)
    i, j = impactsig.match_impacts(found, impactsig.Impacts(starts), 0.5e-3).pairs.T
    assert len(i) > 0.97 * len(starts)
    for name, truth in (("contact_time", contact), ("peak", heights[j])):
        z = (getattr(found, name)[i] - truth) / getattr(found, f"{name}_error")[i]
        assert np.sqrt(np.mean(z**2)) < (2.0 if name == "contact_time" else 1.25), name
