"""What the tails of impacts explain, on loudness that decays as it should."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig.detect.sound._kernels import SAMPLED
from impactsig.detect.sound.deciding._tail_kernels import beyond_tails
from impactsig.detect.sound.deciding._tails import decay_rate

SECONDS = 0.4e-3  # a frame
PLACE = np.arange(100, 5000, 450)
STEPS = np.arange(0, 5400, SAMPLED)


def loudness_of(rate, heights):
    since = (STEPS[:, None] - PLACE) * SECONDS
    return np.where(since >= 0, heights - rate * since, 0.0).max(axis=1, initial=0.0)


def beyond(place, loud, rate):
    out = np.empty(len(place))
    beyond_tails(place, loud, rate * SECONDS, out)
    return out


@pytest.mark.parametrize("rate", [14.0, 46.0])
def test_the_rate_is_that_of_an_even_decay(rate):
    heights = np.linspace(3.0, 4.0, len(PLACE))
    found = decay_rate(PLACE, heights, loudness_of(rate, heights), SECONDS)
    assert found == pytest.approx(rate, rel=1e-9)


def test_a_crest_exceeds_the_loudest_tail_before_it():
    heights, gap = np.full(len(PLACE), 4.0), 450 * SECONDS
    found = beyond(PLACE, heights, 14.0)
    assert found[0] == np.inf
    np.testing.assert_allclose(found[1:], 14.0 * gap)
    # A fade that ends adds a crest; it is as loud as the decay, and nothing is left of it.
    place = np.sort(np.append(PLACE, PLACE[3] + 40))
    loud = np.insert(heights, 4, 4.0 - 14.0 * 40 * SECONDS)
    assert beyond(place, loud, 14.0)[4] == pytest.approx(0.0, abs=1e-9)


def test_too_few_tails_explain_nothing():
    heights = np.full(len(PLACE), 4.0)
    loudness = loudness_of(14.0, heights)
    assert decay_rate(PLACE[:2], heights[:2], loudness[:200], SECONDS) == np.inf
    assert decay_rate(PLACE[:0], heights[:0], loudness[:9], SECONDS) == np.inf
    assert (beyond(PLACE, heights, np.inf) == np.inf).all()
