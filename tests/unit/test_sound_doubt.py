"""A note where the probabilities of a sound record's rises say that much is missed or false."""

import numpy as np
import pytest
from scipy.special import logit

from benchmarks.recordings import microphone, score
from benchmarks.sound_disturbances import reverberant
from benchmarks.varied_sound import record
from impactsig import Recording, detect_impacts
from impactsig.detect.sound._clipping import Limits
from impactsig.detect.sound.deciding.calibrated import calibrated
from impactsig.detect.sound.deciding.doubt import Doubt


def test_expectation_of_probabilities():
    doubt = Doubt()
    for part in ([0.9, 0.05, 0.6], [0.5, 0.4, 0.2]):
        doubt.add(np.array(part), logit(part))
    assert (doubt.right, doubt.false, doubt.missed) == pytest.approx((2.0, 1.0, 0.6))
    assert doubt.f1 == pytest.approx(4.0 / 5.6)
    # Of log-odds: 2.2, -2.9, 0.4, 0, -0.4, -1.4.
    assert (doubt.improbable, doubt.below, doubt.above) == (1, 2, 2)
    # Likely ones whose probabilities fall count as missed by what is left of these.
    doubt.turn(np.array([0.9, 0.6, 0.4]), np.array([0.3, 0.05, 0.2]))
    assert (doubt.right, doubt.false, doubt.missed) == pytest.approx((0.5, 0.5, 0.9))


@pytest.mark.parametrize(
    ("expected", "noted"),
    [
        ((90.0, 10.0, 9.0), False),  # F1 of 180 / 199
        ((90.0, 10.0, 11.0), True),  # 180 / 201
        ((4.0, 1.0, 3.0), False),  # as noise without impacts has now and then
        ((0.0, 0.0, 0.0), False),
    ],
)
def test_a_note_where_an_f1_below_nine_tenths_is_expected(expected, noted):
    assert bool(Doubt(*expected).notes()) == noted


def test_a_record_that_is_hard_to_hear_says_so_and_a_clear_one_does_not():
    # Short sounds of 495 to 743 Hz in hum, of which narrow bands hear every second.
    hard = record(12001, "hum")
    found = detect_impacts(Recording(hard.samples, hard.rate, sensor="sound"))
    assert score(found.time, hard.time, 10e-3)[0] < 0.8
    assert "hard to tell" in found.notes[-1]
    # Whatever the dial says: it is the record that leaves doubt.
    found = detect_impacts(
        Recording(hard.samples, hard.rate, sensor="sound"), least_probability=0.9
    )
    assert "hard to tell" in found.notes[-1]
    clear = microphone(duration=10.0, seed=12)
    found = detect_impacts(Recording(clear.samples, clear.rate, sensor="sound"))
    assert score(found.time, clear.time, 10e-3)[0] > 0.98
    assert not found.notes


def test_a_clipped_record_says_so():
    x = microphone(duration=10.0, seed=13).samples
    for limit, noted in ((2.0, False), (0.15, True)):
        clipped = np.clip(x, -limit, limit)
        found = detect_impacts(Recording(clipped, 22_050.0, sensor="sound"))
        assert any("clipped" in note for note in found.notes) == noted


def test_the_share_at_the_limits():
    rng = np.random.default_rng(14)
    x = np.clip(rng.standard_normal(160_000), -1.0, 1.5)
    limits = Limits()
    for part in np.array_split(x, 7):  # the first of which need not reach the limits
        limits.add(part, part.min(), part.max())
    assert limits.share == pytest.approx(np.mean((x == -1.0) | (x == 1.5)), abs=0.01)
    silent = Limits()
    silent.add(np.maximum(x, 0.0), 0.0, 1.5)  # most of it is digital silence
    assert silent.share == pytest.approx(np.mean(x == 1.5), abs=0.01)


SPREAD = 0.1
ODDS = np.array([-np.inf, -2.0, -0.5, 0.0, 0.5, 2.0])


def test_odds_are_sharper_where_little_is_in_doubt():
    clear, doubtful = Doubt(100.0, 0.0, 0.0), Doubt(100.0, 4.0, 4.0)
    np.testing.assert_allclose(
        calibrated(ODDS, clear, 20.0, SPREAD), [-np.inf, -3.0, -0.75, 0.0, 0.875, 3.5], atol=1e-6
    )
    np.testing.assert_array_equal(calibrated(ODDS, doubtful, 20.0, SPREAD), ODDS)
    # Half of an expected share of errors of 0.03.
    half = calibrated(ODDS, Doubt(98.5, 1.5, 1.5), 1e9, SPREAD)
    np.testing.assert_allclose(half[1:], [-2.5, -0.625, 0.0, 0.6875, 2.75], atol=1e-6)
    # What seems even is rather an impact, the more the more come: 10 a second.
    half = calibrated(ODDS, Doubt(98.5, 1.5, 1.5), 9.85, SPREAD)
    assert half[3] == pytest.approx(0.8 * (1 - 2**-16) * 0.7 / 4 * 10.0 / 13.5)


@pytest.mark.parametrize(("seconds", "more"), [(8.0, 0.0), (6.0, 1.6857), (2.0, 3.0), (0.1, 3.0)])
def test_odds_are_higher_where_impacts_come_densely(seconds, more):
    # 100 likely impacts: 8 ln(16.7 / 13.5) at 16.7 a second, 3 at most, by no less than a second.
    doubtful = Doubt(100.0, 10.0, 10.0)
    np.testing.assert_allclose(calibrated(ODDS, doubtful, seconds, SPREAD), ODDS + more, atol=1e-4)
    # Not where nothing is in doubt.
    assert calibrated(ODDS, Doubt(100.0, 0.0, 0.0), seconds, SPREAD)[3] == 0.0


@pytest.mark.parametrize(
    ("errors", "pace", "share"),
    [
        (0.09, 10.0, 1.0),
        (0.09, 20.0, 1.0),
        (0.03, 10.0, 1.0),
        (0.03, 20.0, 0.0),
        (0.045, 15.684, 0.75),
    ],
)
def test_few_octaves_raise_odds_unless_impacts_are_dense_and_clear(errors, pace, share):
    # An expected F1 of 1 - errors; 15.684 is 13.5 e^0.15.
    wrong = 100.0 * errors / (1.0 - errors)
    doubt = Doubt(100.0, wrong, wrong)
    few, many = (calibrated(ODDS[1:], doubt, 100.0 / pace, spread) for spread in (0.21, SPREAD))
    np.testing.assert_allclose(few - many, share * 2.5 * np.log(0.21 / 0.16), atol=1e-4)


def test_a_record_without_a_likely_impact_keeps_its_odds():
    np.testing.assert_array_equal(calibrated(ODDS, Doubt(), 0.0, SPREAD), ODDS)


def test_where_crests_are_more_above_even_odds_than_below_they_are_impacts():
    falling, rising = (Doubt(120.0, 10.0, 10.0, 10, *counts) for counts in ((28, 11), (8, 29)))
    np.testing.assert_array_equal(calibrated(ODDS, falling, 10.0, SPREAD), ODDS)
    f1 = 240.0 / 260.0
    more = 2.5 + 0.6 * np.log((1.0 - f1) / 0.03) - 1.2 * np.log(1.02 / 0.82)
    known = calibrated(ODDS, rising, 10.0, SPREAD)
    np.testing.assert_allclose(known, np.where(ODDS < 0, 1.27, 1.0) * ODDS + more)
    # Those that come slowly do not hide each other.
    few, slow = (Doubt(n, n / 12, n / 12, 10, 8, 29) for n in (80.0, 60.0))
    assert calibrated(ODDS, few, 10.0, SPREAD)[3] == pytest.approx(more / 2)
    np.testing.assert_array_equal(calibrated(ODDS, slow, 10.0, SPREAD), ODDS)


def test_dense_impacts_in_a_room_are_found():
    """18 a second in a room of 0.3 s; 0.85 by the odds as they were fitted."""
    truth = reverberant(31, 20.0, time=0.3, density=18.0)
    noise = np.random.default_rng(3).standard_normal(len(truth.samples))
    found = detect_impacts(Recording(truth.samples + 0.15 * noise, truth.rate, sensor="sound"))
    assert score(found.time, truth.time, 10e-3)[0] > 0.9
