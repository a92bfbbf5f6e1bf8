"""Log-odds where impacts are dense."""

import numpy as np
import pytest

from benchmarks.probability import outcomes
from impactsig.detect.sound.deciding.candidates import Candidates
from impactsig.detect.sound.deciding.overlapping import with_overlap
from tests import naive_sound


def candidates(odds, narrow=None, share=1.0):
    odds = np.asarray(odds, float)
    none = np.zeros(len(odds))
    no = none > 0.0
    narrow = no if narrow is None else narrow
    return Candidates(np.arange(len(odds)), no, none, odds, no, no, none, narrow, none + share)


@pytest.mark.parametrize("pace", [13.0, 17.0, 26.0, 90.0])
def test_twin(pace):
    rng = np.random.default_rng(7)
    every = [
        candidates(rng.normal(0.0, 3.0, n), rng.random(n) < 0.2, rng.random(n)) for n in (150, 40)
    ]
    likely = np.concatenate([found.probability[~found.narrow] for found in every])
    for found, turned in zip(every, with_overlap(every, pace), strict=True):
        slow = naive_sound.with_overlap(
            dict(enumerate(found.probability)), found.narrow, found.beyond_tails, likely, pace
        )
        np.testing.assert_allclose(turned.probability, list(slow.values()), rtol=1e-9)


def test_order_is_kept_and_tails_lower_odds():
    (found,) = with_overlap([candidates([-np.inf, -9.0, -5.0, -1.0, 1.0, 6.0, 9.0])], 30.0)
    assert found.odds[0] == -np.inf
    assert found.odds[3] > -0.5
    assert (np.diff(found.odds[1:]) > 0).all()
    share = np.array([1.0, 0.5, 0.05, 0.0])
    (found,) = with_overlap([candidates(np.full(4, 3.0), share=share)], 30.0)
    assert (np.diff(found.odds)[:2] < 0).all()
    assert found.odds[2] > found.odds[3] - 1e-9


def test_doubtful_crests_tell_of_each_other():
    def first(*others, narrow=False):
        odds = np.array([0.0, 5.0, *others])
        kinds = np.repeat([False, narrow], [2, len(others)])
        return with_overlap([candidates(odds, kinds)], 30.0)[0].odds[0]

    assert first(*[1.9] * 50) > first() > first(*[-1.9] * 50)
    # Not those that narrow bands show, nor those that are certain to be noise.
    assert first(*[1.9] * 50, narrow=True) == first() == first(*[-8.0] * 50)
    # The clearer most impacts are, the fewer are hidden, and none where all are clear.
    assert first() > first(9.0) > first(*[12.0] * 50) == 0.0


def test_sparse_impacts_keep_their_odds():
    found = candidates([-1.0, 0.0, 4.0])
    assert with_overlap([found], 14.0)[0] is found
    assert with_overlap([found], 15.0)[0].odds[1] > 0.0
    assert with_overlap([], 0.0) == []
    assert with_overlap([candidates([])], 50.0)[0].odds.size == 0


def test_probabilities_of_dense_impacts():
    """28 a second, 6 dB above noise, at 8 kHz: three of four stated as 0.5 were impacts before."""
    parts = [outcomes("sound", 6, seed, 30.0, rate=8000, density=28) for seed in (1, 2, 3)]
    stated, right = map(np.concatenate, zip(*parts, strict=True))
    share = right.mean()
    assert np.mean((stated - right) ** 2) <= share * (1.0 - share)
