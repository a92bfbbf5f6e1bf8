"""Two kinds of sound, of which faint ones sound more like the noise."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig.detect._kinds_by_strength import kinds_by_strength


def kinds(seed, count=300, second=0.4, bend=1.5):
    """Colours that bend as sounds get faint, their loudness, kinds, and shares without it."""
    rng = np.random.default_rng(seed)
    loud, kind = rng.standard_normal(count), (rng.random(count) < second).astype(int)
    ends = np.array([[3.0, 0.0, 0.0], [-3.0, 0.0, 0.0]])
    bent = np.array([1.0, 2.0, 0.0]) * (bend * loud + 0.5 * loud**2)[:, None]
    places = ends[kind] + bent + rng.standard_normal((count, 3))
    # As if by a line halfway that knows of no bend.
    first = 1.0 / (1.0 + np.exp(-6.0 * places[:, 0]))
    return places, loud, kind, np.column_stack((first, 1.0 - first))


@pytest.mark.parametrize("count", [80, 300])
def test_what_is_stated_is_so(count):
    stated, right, before = [], [], []
    for seed in range(9000 // count):
        places, loud, kind, share = kinds(seed, count)
        probability = kinds_by_strength(places, loud, share)
        np.testing.assert_allclose(probability.sum(axis=1), 1.0)
        stated.append(probability.max(axis=1))
        right.append(probability.argmax(axis=1) == kind)
        before.append(share.argmax(axis=1) == kind)
    stated, right, before = map(np.concatenate, (stated, right, before))
    assert np.mean(stated) == pytest.approx(np.mean(right), abs=0.01)
    assert np.mean(right) > np.mean(before) + 0.02
    doubtful = stated < 0.9
    assert np.mean(stated[doubtful]) == pytest.approx(np.mean(right[doubtful]), abs=0.08)


def test_few_impacts_are_no_worse_than_without_loudness():
    for seed in range(20):
        places, loud, kind, share = kinds(seed, 20)
        probability = kinds_by_strength(places, loud, share)
        assert np.isfinite(probability).all()
        lost = (probability.argmax(axis=1) == kind).sum() - (share.argmax(axis=1) == kind).sum()
        assert lost >= -2


def test_equal_loudness_tells_nothing():
    places, _, kind, share = kinds(1, bend=0.0)
    alike = kinds_by_strength(places, np.full(len(places), 2.5), share)
    assert np.isfinite(alike).all()
    assert np.mean(alike.argmax(axis=1) == kind) > 0.98


def test_it_depends_on_neither_scale_nor_origin_of_either():
    places, loud, _, share = kinds(2)
    found = kinds_by_strength(places, loud, share)
    moved = kinds_by_strength(1e3 * places + 7.0, 10.0 * loud - 3.0, share)
    np.testing.assert_allclose(moved, found, atol=1e-5)


def test_sounds_without_any_scatter():
    kind = np.arange(30) % 2
    share = np.column_stack((1.0 - kind, kind))
    for places in (np.outer(kind, [1.0, 2.0, 0.0]), np.zeros((30, 3)), np.outer(kind, [1e-90])):
        probability = kinds_by_strength(places, np.linspace(0.0, 1.0, 30), share)
        assert np.isfinite(probability).all()
        if places.max() == 2.0:
            np.testing.assert_allclose(probability, share, atol=1e-9)
