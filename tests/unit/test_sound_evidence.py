"""Probabilities of rises, against a twin, where each of the rules decides."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig.detect.sound._kernels import BLOCK, GROUP, SAMPLED, STEP
from impactsig.detect.sound._scale import scale_at
from impactsig.detect.sound._survey import Passage
from impactsig.detect.sound.deciding._dense_kernels import put_dense_odds
from impactsig.detect.sound.deciding._octave_evidence import rattling
from impactsig.detect.sound.deciding._tone_kernels import put_onsets, put_tone_odds
from impactsig.detect.sound.deciding._voice_kernels import lower_pulses
from impactsig.detect.sound.deciding.crest_kernels import heights_reached
from impactsig.detect.sound.deciding.crests import audible_rise, octave_crests
from impactsig.detect.sound.deciding.decision import candidates
from tests import naive_sound

RATE, SPREAD = 22_050, 0.05
SCALE = scale_at(RATE)
FRAME = SCALE.hop / RATE
COUNT = round(3.0 / FRAME / BLOCK) * BLOCK
LEAST = 0.05
"""Probability from which on rules of those that are hopeless do not matter."""


def rises(seed, pace, *, bands=0.02, mean=1.0, spread=0.7, rattle=1.0, pulses=0, tones=0, ring=0.0):
    """Rises of three seconds: so many impacts a second, in rattling noise, and other things.

    Parameters
    ----------
    bands : what narrow bands have of a rise in octaves, at most
    mean, spread : of the heights of impacts, geometric, and of their logarithms
    rattle : height of a tenth of the noise over that of the rest
    pulses : bursts of eight, as a voice makes them
    tones : impacts in one octave alone
    ring : what is left of a rise in the next frame: noise makes few crests beside it
    """
    rng = np.random.default_rng(seed)
    c = 0.6 * SPREAD * np.abs(rng.standard_normal(COUNT))
    c *= rng.choice([1.0, rattle], COUNT, p=[0.9, 0.1])
    b = 0.02 * rattle**1.5 * rng.random(COUNT // GROUP)
    growth = rng.random(len(b))
    likelihood = 8.0 * rng.random(len(b)) ** 4
    h = 15.0 * rng.random(COUNT // STEP) ** 3
    for j in rng.integers(0, COUNT, round(3 * pace)):
        height = mean * np.exp(spread * rng.standard_normal())
        c[j] += height
        b[min(round(j / GROUP), len(b) - 1)] += bands * height * rng.random()
    for j in rng.integers(0, COUNT, pulses):
        near = np.minimum(j + np.cumsum(rng.integers(12, 30, 8)), COUNT - 1)
        c[near] += 0.5 + rng.random(8)
        b[near // GROUP] += 0.2 + 0.3 * rng.random(8)
    for k in range(1, COUNT if ring else 0):
        c[k] = max(c[k], ring * c[k - 1])
    for i in rng.integers(0, len(h), tones):
        h[i] = 16.0 + 64.0 * rng.random() ** 3
    loud = np.maximum(c, 0.2 * rng.random(COUNT))
    for k in range(1, COUNT):  # tails
        loud[k] = max(loud[k], loud[k - 1] - 0.002)
    return c, loud, b, likelihood, h, growth


def passage_of(c, loud, b, likelihood, h, growth, known):
    place = naive_sound.crests(c, SCALE.spacing)
    place = place[c[place] >= 0.5 * SPREAD]
    none = np.zeros(len(b), np.bool_)
    return Passage(
        0, c[::SAMPLED], b, likelihood, h, growth, known, place, c[place],
        loud[place], loud[::SAMPLED], none, none,
    )  # fmt: skip


REGIMES = {
    "sparse": {"pace": 5, "bands": 1.0},
    "little in narrow bands": {"pace": 5, "bands": 0.15},
    "little in octaves": {"pace": 5, "mean": 0.12, "bands": 6.0},
    "rattle": {"pace": 20, "rattle": 3.0, "bands": 0.3},
    "dense": {"pace": 60, "spread": 0.1, "tones": 20},
    "dense and faint": {"pace": 60, "spread": 0.2, "mean": 0.15},
    "dense, of many heights": {"pace": 90, "spread": 0.5, "bands": 0.1, "tones": 20},
    "a room that rings": {"pace": 8, "bands": 0.3, "ring": 0.996},
    "pulses": {"pace": 3, "pulses": 6, "bands": 0.1, "tones": 20},
}


@pytest.mark.parametrize("regime", REGIMES)
def test_twin(regime):
    c, loud, b, likelihood, h, growth = rises(20, **REGIMES[regime])
    known = np.ones(len(b), np.bool_)
    known[:3] = known[-3:] = False
    passage = passage_of(c, loud, b, likelihood, h, growth, known)
    found = candidates(passage, SPREAD, SCALE, RATE)
    slow = naive_sound.probability(
        c, loud, b, likelihood, known, SCALE.spacing, SPREAD, RATE, SCALE.hop, growth
    )
    slow = naive_sound.by_rises(slow, c, h, b, known, SPREAD, FRAME)
    slow = {j: p for j, p in sorted(slow.items()) if p > LEAST}
    likely = found.probability > LEAST
    assert found.frame[likely].tolist() == list(slow)
    np.testing.assert_allclose(found.probability[likely], list(slow.values()), atol=1e-6)


@pytest.mark.parametrize("regime", [one for one in REGIMES if one.startswith("dense")])
def test_dense_crests(regime):
    c, loud, b, *rest = rises(20, **REGIMES[regime])
    passage = passage_of(c, loud, b, *rest, np.ones(len(b), np.bool_))
    crests, a = octave_crests(passage, FRAME), audible_rise(SPREAD)
    odds, alike = np.empty(len(crests.place)), np.empty(len(crests.place), np.bool_)
    put_dense_odds(crests.place, crests.height, crests.loudest, crests.clear, a, FRAME, odds, alike)
    slow = [
        naive_sound.dense_odds(c, crests.place, j, clear, a, FRAME)
        for j, clear in zip(crests.place, crests.clear, strict=True)
    ]
    assert np.isfinite(slow).any()
    np.testing.assert_allclose(odds, slow, atol=1e-9)
    # What is as high as noise is left to noise; what lies above it is a crowd, found or not.
    assert not alike[crests.height <= a].any()
    assert alike[(odds > 0.0) & (crests.height > a)].all()
    crowded = candidates(passage, SPREAD, SCALE, RATE).crowded
    assert crowded.any() == (regime == "dense and faint")


def test_digital_silence_says_nothing_of_the_rattle():
    rise = np.abs(np.random.default_rng(1).standard_normal(COUNT // SAMPLED))
    silent = np.zeros(len(rise), np.bool_)
    at, middle = COUNT // 2 // BLOCK, len(rise) // 2

    def rattle():
        return rattling(rise, silent, FRAME)[at]

    heard = rattle()
    silent[middle - 60 : middle + 60] = True
    # The same is heard beside it, whatever the silence holds.
    for level in (0.0, 1e3):
        rise[silent] = level
        assert rattle() == pytest.approx(heard, rel=0.15)


def test_the_rattle_by_sorting_what_is_heard():
    rng = np.random.default_rng(2)
    rise = rng.random(COUNT // SAMPLED).astype(np.float32)
    silent = np.repeat(rng.random(len(rise) // 8) < 0.3, 8)
    per, reach = BLOCK // SAMPLED, round(1.0 / (BLOCK * FRAME))
    for k, level in enumerate(rattling(rise, silent, FRAME)):
        near = slice(per * max(k - reach, 0), per * (k + reach + 1))
        heard = np.sort(rise[near][~silent[near]])
        low, high = (heard[int(share * len(heard))] for share in (0.75, 0.9))
        assert level == pytest.approx(max(50.0 * low, 12.0 * high))


def test_heights_that_many_crests_reach_where_part_is_heard():
    rng = np.random.default_rng(3)
    place, height = np.sort(rng.choice(COUNT, 900, replace=False)), rng.exponential(1.0, 900)
    silent = np.repeat(rng.random(COUNT // GROUP // 8) < 0.3, 8)
    total, reach, near = np.append(0.0, np.cumsum(silent)), 30, round(0.5 / FRAME)
    first, last = place.searchsorted(place - near), place.searchsorted(place + near)
    asked, out = rng.random(900) < 0.5, np.full(900, -1.0)
    order = np.argsort(height)
    heights_reached(place, height, order, first, last, total, reach, 0.5, asked, out)
    assert (out[~asked] == -1.0).all()
    for k in np.flatnonzero(asked):
        at = min(round(place[k] / GROUP), len(silent) - 1)
        heard = 1.0 - silent[max(at - reach, 0) : at + reach + 1].mean()
        number = max(round(40.0 * np.sqrt(heard)), 1)
        highest = np.sort(height[first[k] : last[k]])[::-1]
        assert out[k] == (highest[number - 1] if number <= len(highest) else 0.0)


def test_a_crowd_that_silence_ends_is_no_voice():
    place = np.arange(0, round(0.5 / FRAME), round(8e-3 / FRAME))
    ones, groups = np.ones(len(place)), round(3.0 / FRAME / GROUP)

    def lowered(silence):
        odds = 2.0 * ones
        lower_pulses(odds, ones > 0.0, place, ones, 0.1 * ones, groups, silence, FRAME)
        return odds < 2.0

    assert lowered(np.empty(0))[:10].all()
    quiet = np.maximum(np.arange(groups + 1.0) - place[-1] // GROUP - 1, 0.0)
    assert not lowered(quiet)[10:-10].any()


def test_odds_of_low_tones():
    per, reach = GROUP * FRAME, round(1.0 / (GROUP * FRAME))
    g, b = np.ones(3 * reach), np.full(3 * reach, 0.1)
    at = 3 * reach // 2
    crest, none, least = np.array([at]), np.empty(0, np.int64), np.array([-np.inf])
    g[at] = 40.0

    def odds(weak=none):
        found = np.empty(1)
        put_tone_odds(crest, weak, g, b, g <= 0.0, reach, least, found)
        return found[0]

    alone = 0.7 * np.log(40.0) + 1.7 * np.log(0.1) + 12.1 - 5.4 * np.log(6.0) - 1.5 * np.log(0.15)
    alone -= 40.0 * max(g[at + round(0.016 / per)] / 40.0 - 0.1, 0.0)
    assert odds() == pytest.approx(alone)
    # What noise reaches: 24, and 2 more for each weak crest a second, 5 at most.
    g[at], b[:] = 25.0, 10.0
    assert odds() == pytest.approx(1.0)
    assert odds(at + 5 * np.arange(1, 5)) == pytest.approx(1.0 - 2.0 * 2.0)
    assert odds(at + 5 * np.arange(1, 15)) == pytest.approx(1.0 - 2.0 * 5.0)
    # A tone that goes on swells.
    g[at], b[:] = 40.0, 0.1
    g[at + round(0.016 / per)] = 8.0
    assert odds() == pytest.approx(alone - 40.0 * (0.2 - 0.1))


def test_a_low_tone_begins_at_the_likeliest_crest_nearby():
    place, height = np.array([900, 1000, 1004, 1500]), np.array([9.0, 0.3, 0.4, 9.0])
    near, seconds, audible = np.array([1001.5, 1300.2, -2.0]), 0.5e-3, 0.2
    frame, off = np.empty(3, np.int64), np.empty(3)
    put_onsets(place, height, audible, near, seconds, frame, off)
    # Of 0.75 and 1.25 ms away, with a normal distribution of 2 ms.
    first, second = 0.3 * np.exp(-0.5 * 0.375**2), 0.4 * np.exp(-0.5 * 0.625**2)
    assert frame.tolist() == [1004, 1300, 0]
    expected = 2e-3 * np.sqrt(first / (first + second)), 2e-3, 2e-3
    np.testing.assert_allclose(off, expected)
    put_onsets(place, height, 0.41, near, seconds, frame, off)  # none is audible
    assert frame[0] == 1001


@pytest.mark.parametrize("goes_on", [False, True])
def test_bands_that_go_on_to_rise_are_no_low_tone(goes_on):
    count = COUNT // GROUP
    c, b, likelihood = np.full(COUNT, 1e-3), np.full(count, 0.01), np.zeros(count)
    likelihood[count // 2], b[count // 2] = 60.0, 0.3
    growth = np.full(count, 0.7 if goes_on else 0.5)
    passage = passage_of(
        c, c, b, likelihood, np.full(COUNT // STEP, 13.0), growth, likelihood >= 0.0
    )
    found = candidates(passage, SPREAD, SCALE, RATE)
    near = np.abs(found.frame - COUNT // 2) < 10 * GROUP
    assert (found.probability[near] > 0.5).any() == (not goes_on)
    assert found.narrow[near].all() == (not goes_on)
