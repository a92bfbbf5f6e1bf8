"""The generator that counts: published answers, its twin, its distribution far into the tails."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from scipy import stats

from impactsig.stochastic.paths._random import (
    FORCE,
    draw,
    draw_all,
    draw_coins,
    draw_pair,
    normals,
    philox,
    room,
)
from tests import naive_stochastic

# kat_vectors of the Random123 distribution: philox4x32, 10 rounds.
ANSWERS = (
    ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
)


@pytest.mark.parametrize(("counter", "key", "answer"), ANSWERS)
def test_philox_gives_the_published_words(counter, key, answer):
    left, right = np.empty(1, np.uint64), np.empty(1, np.uint64)
    philox(np.array(key, np.uint32), *counter, left, right)
    words = [int(w) for pair in (left[0], right[0]) for w in (pair >> np.uint64(32), pair)]
    assert tuple(word & 0xFFFFFFFF for word in words) == answer
    assert naive_stochastic.philox(counter, key) == answer


def transformed(left, right):
    r = room(2 * len(left))
    r.radius[:], r.angle[:] = left, right
    cosine, sine = np.empty(len(left)), np.empty(len(left))
    normals(r, cosine, sine)
    return cosine, sine


def test_the_transformation_is_box_and_mullers_to_the_last_digits_and_far_out():
    rng = np.random.default_rng(1)
    left = rng.integers(0, 2**64, 2000, np.uint64)
    left[:200] >>= np.arange(200, dtype=np.uint64) % 64  # ever nearer to 0: the tail
    left[200:210] = np.uint64(2**64 - 1)  # and next to 1
    right = rng.integers(0, 2**64, 2000, np.uint64)
    right[:8] = np.arange(8)  # every octant, at its edge
    cosine, sine = transformed(left, right)
    with mpmath.workdps(40):
        for k in range(0, 2000, 7):
            # As doubles, which next to 1 have no room for the half.
            u = mpmath.mpf((int(left[k]) >> 11) + 0.5) / 2**53
            angle = mpmath.mpf((int(right[k]) >> 11) + 0.5) / 2**53 * mpmath.pi / 4
            radius = mpmath.sqrt(-2 * mpmath.log(u))
            c, s = radius * mpmath.cos(angle), radius * mpmath.sin(angle)
            bits = int(right[k])
            c, s = (s, c) if bits & 1 else (c, s)
            c, s = (-c if bits & 2 else c), (-s if bits & 4 else s)
            assert abs(cosine[k] - c) <= 1e-15 * abs(c)
            assert abs(sine[k] - s) <= 1e-15 * abs(s)
    assert np.hypot(cosine, sine).max() > 8.65  # 54 bits: sqrt(2 * 54 ln 2)


def test_the_distribution_is_normal_to_five_standard_deviations():
    key, r, z = np.array([7, 9], np.uint32), room(1 << 16), np.empty(1 << 16)
    drawn = []
    for path in range(4):
        for block in range(16):
            draw(r, key, path, block, z)
            drawn.append(z.copy())
    z = np.concatenate(drawn)
    n = len(z)
    assert stats.kstest(z[:500_000], "norm").pvalue > 1e-3
    for level in (1, 2, 3, 4, 4.5, 5):
        for count, side in ((np.count_nonzero(z > level), "above"), (np.sum(z < -level), "below")):
            expected = n * stats.norm.sf(level)
            assert stats.poisson.cdf(count, expected) > 1e-4, (level, side)
            assert stats.poisson.sf(count - 1, expected) > 1e-4, (level, side)
    # Neither neighbours nor the halves of a block, which share their radii, are correlated.
    for one, two in ((z[:-1], z[1:]), (drawn[0][: 1 << 15], drawn[0][1 << 15 :])):
        for power in (1, 2):
            found = np.corrcoef(one**power, two**power)[0, 1]
            assert abs(found) < 4.5 / math.sqrt(len(one))


def test_blocks_are_those_of_the_twin_and_differ_between_paths_and_purposes():
    key, r, z = np.array([3, 0xFFFFFFFF], np.uint32), room(64), np.empty(64)
    seen = []
    for path in (0, 1, 0xFFFFFFFF):
        for block in (0, 1, 12345):
            draw(r, key, path, block, z)
            np.testing.assert_allclose(z, naive_stochastic.normals(key, path, block), rtol=1e-14)
            seen.append(z.copy())
        pair = np.empty(2)
        draw_pair(r, key, path, 0, 0, pair)
        seen.append(pair)
    assert len({float(value) for values in seen for value in values}) == sum(map(len, seen))


@pytest.mark.parametrize("lanes", [1, 5, 32])
def test_numbers_of_many_paths_are_those_of_each(lanes):
    key, paths = np.array([3, 0xFFFFFFFF], np.uint32), np.arange(lanes, dtype=np.uint32) + 7
    many, z = np.empty((64, lanes)), np.empty(64)
    for block in (0, 5, 2**27 + 5):  # 32 counters a block: 2^32 of them later
        draw_all(room(64 * lanes), key, paths, block, FORCE, many)
        for lane in range(lanes):
            draw(room(64), key, paths[lane], block, z)
            np.testing.assert_array_equal(many[:, lane], z)


def test_coins_are_those_of_the_twin_and_as_distributed():
    key, paths = np.array([3, 4], np.uint32), np.arange(20, dtype=np.uint32) + 7
    found = np.empty((300, 64, 20))
    for block in range(300):
        draw_coins(room(64 * 20), key, paths, block, found[block])
    for block, lane in ((0, 0), (299, 19)):
        expected = [2 * e * side for e, side in naive_stochastic.coins(key, 7 + lane, block)]
        np.testing.assert_allclose(found[block, :, lane], expected, rtol=1e-14)
    found = found.ravel()
    assert stats.kstest(np.abs(found) / 2, "expon").pvalue > 1e-3
    assert abs(np.sign(found).sum()) < 4.5 * math.sqrt(len(found))
    assert abs(np.corrcoef(np.abs(found), np.sign(found))[0, 1]) < 4.5 / math.sqrt(len(found))
    assert len(np.unique(found)) > 0.999 * len(found)  # 32 bits: a few meet by chance


def test_counters_do_not_repeat_beyond_32_bits():
    key, r, one, two = np.array([3, 4], np.uint32), room(64), np.empty(64), np.empty(64)
    draw(r, key, 0, 5, one)
    draw(r, key, 0, 5 + 2**27, two)  # 32 counters a block: 2^32 of them later
    assert not np.any(one == two)
    draw_pair(r, key, 0, 5, 0, one[:2])
    draw_pair(r, key, 0, 5 + 2**32, 0, two[:2])
    assert not np.any(one[:2] == two[:2])
