"""What the tails of impacts explain, on loudness that decays as it should."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig.detect.sound._kernels import SAMPLED
from impactsig.detect.sound.deciding._tails import beyond_tails, decay_rate

SECONDS = 0.4e-3  # a frame
PLACE = np.arange(100, 5000, 450)
STEPS = np.arange(0, 5400, SAMPLED)


def passage(rate, heights):
    since = (STEPS[:, None] - PLACE) * SECONDS
    loudness = np.where(since >= 0, heights - rate * since, 0.0).max(axis=1, initial=0.0)
    return Passage(0, loud=[heights], loudness=[loudness], place=[PLACE])


@pytest.mark.parametrize("rate", [14.0, 46.0])
def test_the_rate_is_that_of_an_even_decay(rate):
    one = passage(rate, np.linspace(3.0, 4.0, len(PLACE)))
    found = decay_rate(PLACE, one.loud[0], one.loudness[0], SECONDS)
    assert found == pytest.approx(rate, rel=1e-9)


def test_a_crest_exceeds_the_loudest_tail_before_it():
    heights = np.full(len(PLACE), 4.0)
    one = passage(14.0, heights)
    gap = 450 * SECONDS
    beyond = beyond_tails(one, PLACE, SECONDS)
    assert beyond[0] == np.inf
    np.testing.assert_allclose(beyond[1:], 14.0 * gap)
    # A fade that ends adds a crest; it is as loud as the decay, and nothing is left of it.
    place = np.sort(np.append(PLACE, PLACE[3] + 40))
    one.loud = [np.insert(heights, 4, 4.0 - 14.0 * 40 * SECONDS)]
    assert beyond_tails(one, place, SECONDS)[4] == pytest.approx(0.0, abs=0.2)


def test_too_few_tails_explain_nothing():
    one = passage(14.0, np.full(len(PLACE), 4.0))
    assert decay_rate(PLACE[:2], one.loud[0][:2], one.loudness[0][:200], SECONDS) == np.inf
    assert (
        beyond_tails(Passage(0, loud=[np.ones(1)], loudness=[np.ones(9)]), PLACE[:1], 1.0) == np.inf
    ).all()
