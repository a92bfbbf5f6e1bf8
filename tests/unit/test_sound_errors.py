"""Standard errors of the instants of impacts in sound, against the errors that are made."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import impactsig
from benchmarks import strange_sounds
from benchmarks.recordings import load_cell
from benchmarks.sound_errors import errors, record
from benchmarks.spread import contradicted, spread_over_records, within
from impactsig.detect.sound._attack_kernels import (
    DEPENDENT,
    MOST_TOGETHER,
    counting_as_one,
    samples_that_tell,
    split_variance,
    variance_change,
)
from impactsig.detect.sound._growth import Growth
from impactsig.detect.sound._growth_kernels import VARIED, spread_of
from impactsig.detect.sound.timing._shift_errors import ATTACKS, beyond

# Seeds that nothing was chosen on.


def z_scores(kind, rate, level, seed, **options):
    off, error = errors(record(kind, rate, level, seed, count=60, **options)).T
    assert len(off) > 50
    return off / error


@pytest.mark.parametrize(
    ("rate", "kind"),
    [(8000, "shared"), (11_025, "own"), (11_025, "alike"), (22_050, "alike"), (44_100, "own")],
)
def test_errors_are_as_large_as_their_standard_errors(rate, kind):
    # What a waveform leaves unexplained counts as noise, so that some are stated too large.
    assert 0.4 < np.std(z_scores(kind, rate, 30.0, 401)) < 1.4


def test_modes_of_noise_beside_a_sound_are_allowed_for():
    # Attacks are known to 0.3 to 1 ms; one in twenty of the modes fitted there is 1 to 2 ms off.
    truths = [record("shared", 22_050, 10.0, seed, noise="white") for seed in (15_111, 15_114)]
    off, error = np.concatenate([errors(truth) for truth in truths]).T
    assert np.std(off / error) < 1.6
    assert np.median(error) < 3e-4


def test_a_sound_that_is_clear_late_began_later_than_its_attack():
    off, error = errors(record("own", 22_050, 40.0, 431, count=60)).T
    assert np.corrcoef(np.abs(off), error)[0, 1] > 0.5
    assert 0.8 < np.std(off / error) < 1.3


@pytest.mark.parametrize(
    ("kind", "rate", "least"),
    [("shared", 22_050, 0.75), ("alike", 11_025, 0.7)],  # 5.2 kHz, near half the rate
)
def test_errors_of_clear_sounds_are_not_stated_too_large(kind, rate, least):
    z = [z_scores(kind, rate, 40.0, seed) for seed in (434, 437)]
    assert least < np.std(np.concatenate(z)) < 1.3


def test_louder_noise_makes_errors_larger():
    stated = {}
    for level in (20.0, 40.0):
        truth = record("own", 22_050, level, 402, decimator="", noise="white", count=60)
        stated[level] = np.median(errors(truth)[:, 1])
    assert stated[20.0] > 2.0 * stated[40.0]
    # Between two samples nothing is known.
    assert stated[40.0] > 1.0 / 22_050 / np.sqrt(12)


def test_variance_of_a_split_is_that_of_its_probability():
    gains = -np.ones(9)
    gains[2:7] = np.log([1.0, 3.0, 6.0, 3.0, 1.0]) + 2.0
    # Of 14 parts, six lie at the split, six one away and two two away.
    assert split_variance(gains, 0, 4, 1.0, np.empty(9)) == pytest.approx(
        (6 * 1 + 2 * 4) / 14 + 1 / 12
    )
    assert split_variance(-np.ones(9), 0, 4, 1.0, np.empty(9)) == pytest.approx(4**2 / 3)


@pytest.mark.parametrize("rise", [1.1, 4.0, 300.0])
def test_no_better_is_an_attack_known_than_its_rise_tells(rise):
    normal, root = stats.norm(), np.sqrt(rise)
    louder = stats.norm(scale=root)
    told = normal.expect(lambda x: normal.logpdf(x) - louder.logpdf(x))
    squares = np.concatenate((np.full(30, 2.0), np.full(70, 2.0 * rise)))
    assert samples_that_tell(squares, 30, 1.5) == pytest.approx(1.5 / told)
    assert samples_that_tell(squares[::-1].copy(), 70, 1.5) == np.inf
    assert samples_that_tell(np.zeros(9), 4, 1.0) == np.inf


def test_where_nothing_rises_no_attack_is_known_well():
    # One is 2.8 ms late, where the power rises by 2 %, and stated a fifth of a millisecond.
    off, error = errors(record("own", 22_050, 6.0, 462, noise="white")).T
    assert np.abs(off / error).max() < 8.0


def test_dependent_squares_count_as_fewer():
    rng = np.random.default_rng(5)
    for times in (1, 2, 4):
        # The correlation of values repeated so often falls in a line: twice its sum is times - 1.
        squares = np.repeat(rng.standard_normal(40_000 // times) ** 2, times)
        squares[20_000:] *= 1.2
        alike = counting_as_one(squares, 20_000, 0.0, 6, 1.0)
        assert alike == pytest.approx(DEPENDENT * times**MOST_TOGETHER, rel=0.03)
        # A strong rise shows in a single one.
        strong = counting_as_one(squares, 20_000, 20.0 * len(squares), 6, 1.0)
        assert strong == pytest.approx(DEPENDENT, rel=0.01)
        # Where twice as many are dense, all that depends on time alone is twice as much.
        twice = counting_as_one(np.repeat(squares, 2), 40_000, 0.0, 12, 2.0)
        assert twice == pytest.approx(2.0 * alike, rel=0.03)
    assert counting_as_one(np.zeros(9), 4, 1.0, 3, 2.0) == 2.0 * DEPENDENT


@pytest.mark.parametrize("rate", [96_000, 192_000])
def test_errors_of_attacks_at_high_rates(rate):
    parts = [errors(record("shared", rate, 20.0, seed, decimator="")) for seed in (471, 472)]
    off, error = np.concatenate(parts).T
    assert 0.7 < np.std(off / error) < 1.3  # 1.9 at 192 kHz if a single square tells


def test_gains_are_those_of_every_split():
    squares = np.random.default_rng(3).standard_normal(40) ** 2
    squares[25:] *= 9.0
    scratch = np.empty((3, 11))
    split, gain = variance_change(squares, 23, 5, scratch)
    gains = scratch[0]
    for i, found in enumerate(gains):
        before, after = squares[: 18 + i], squares[18 + i :]
        slow = 40 * np.log(squares.mean())
        slow -= len(before) * np.log(before.mean()) + len(after) * np.log(after.mean())
        assert found == pytest.approx(slow)
    assert gain == gains.max()
    assert split == 18 + np.argmax(gains)


def test_intervals_of_a_sound_have_their_errors():
    truth = record("own", 22_050, 30.0, 403, count=30)
    rec = impactsig.Recording(truth.samples, truth.rate, sensor="sound")
    found = impactsig.detect_impacts(rec)
    assert np.isfinite(found.time_error).all()
    intervals, covariance = found.intervals(errors=True)
    assert len(intervals) == len(found) - 1
    square = found.time_error**2
    np.testing.assert_allclose(covariance.diagonal(), square[:-1] + square[1:])
    merged = impactsig.detect_impacts(rec, merge_within=0.06)
    assert len(merged) < len(found)
    np.testing.assert_array_equal(
        merged.time_error, found.time_error[np.searchsorted(found.time, merged.time)]
    )
    np.testing.assert_array_equal(found.to_frame()["time_error"], found.time_error)


def test_of_load_cell_and_microphone_the_exact_one_counts():
    truth = load_cell(duration=10.0, noise=0.02, drift=False, doubles=False, seed=404)
    force = impactsig.detect_impacts(impactsig.Recording(truth.samples, truth.rate, sensor="force"))
    heard = impactsig.synthesize(force, "sound", rate=22_050.0, seed=404)
    sound = impactsig.detect_impacts(heard)
    both = impactsig.combine_impacts([force, sound]).impacts
    assert np.isfinite(both.time_error).all()
    near = np.searchsorted(both.time, force.time - 1e-4)
    matched = np.abs(both.time[near] - force.time) < 2e-6
    assert matched.mean() > 0.95
    assert (both.time_error[near[matched]] <= (1 + 1e-9) * force.time_error[matched]).all()


def strange(seeds, **asked):
    """Errors and standard errors of impacts in strange sounds."""
    parts = [errors(strange_sounds.record(seed, **asked)[0]) for seed in seeds]
    return np.concatenate(parts).T


@pytest.mark.parametrize("beginning", ["soft", "very soft"])
def test_attacks_of_gradual_sounds_are_less_certain(beginning):
    asked = {"rate": 44_100, "level": 20.0, "kind": "own", "in": "white", "filter": "sox"}
    off, error = strange((3001, 3002), beginning=beginning, **asked)
    assert 0.6 < np.std(off / error) < 1.4


def test_crossings_of_gradual_sounds_are_less_certain():
    asked = {"rate": 11_025, "level": 40.0, "kind": "own", "in": "white", "filter": "sox"}
    off, error = strange((3001, 3002), beginning="very soft", **asked)
    assert 0.6 < np.std(off / error) < 1.4


def test_waveforms_that_differ_in_modes_are_shifted_by_more_than_noise():
    asked = {"rate": 44_100, "level": 30.0, "kind": "nearly alike", "in": "white", "filter": ""}
    off, error = strange((3001, 3002, 3004), beginning="at once", **asked)
    assert np.median(error) < 10e-6  # by their waveform
    assert 0.6 < np.std(off / error) < 1.8


def test_waveforms_of_one_mode_may_be_shifted_by_its_phase():
    asked = {"rate": 44_100, "level": 30.0, "kind": "nearly alike", "in": "white", "filter": ""}
    off, error = strange((3003,), beginning="at once", **asked)  # a single mode
    assert 0.4 < np.std(off / error) < 1.6


def test_phases_that_vary_by_less_than_attacks_show_are_allowed_for():
    off, error = errors(strange_sounds.record(250_081)[0]).T  # 0.2 rad of one mode at 1.5 kHz
    assert 0.8 < np.std(off / error) < 2.5


@pytest.mark.parametrize("total", [0.3, 0.7, 1.4])
def test_what_shifts_have_beyond_attacks_whose_errors_are_not_exact(total):
    attacks = np.linspace(ATTACKS, 1.0, 10_001)
    expected = np.mean(np.maximum(total - attacks, 0.0))
    assert beyond(2.0 * total, 2.0) == pytest.approx(2.0 * expected, rel=1e-3)


def test_growth_of_the_mean_power_limits_attacks():
    rate, before = 44_100.0, 200
    k = np.arange(1000) - before
    growing = np.where(k < 0, 1.0, 1.0 + 1e3 * np.exp(np.minimum(k, 300) / 60.0))
    # VARIED / g, with g = 1/60 a sample, for power that grows by a factor far above 1.
    assert spread_of(growing, before, rate) == pytest.approx(VARIED * 60.0, rel=0.05)
    falling = np.where(k < 0, 1.0, 1.0 + 1e3 * np.exp(-np.maximum(k, 0) / 60.0))
    assert spread_of(falling, before, rate) == 0.0
    # What is in the sum is the mean, whatever the strengths of sounds are.
    sums = Growth(rate, before)
    sounds = np.sqrt(growing - 1.0) * np.geomspace(1.0, 1e3, 9)[:, None]
    sounds[4] = 1.0  # is no likely impact
    sums.add(sounds, np.arange(9) != 4)
    assert sums.spread() == pytest.approx(VARIED * 60.0, rel=0.05)
    assert spread_of(np.ones(10), 5, rate) == 0.0


def test_intervals_over_records_hold_as_often_as_stated():
    # Deviations differ from record to record, as the modes of records do.
    rng, held = np.random.default_rng(3), []
    for _ in range(400):
        groups = [np.exp(0.25 * a) * rng.standard_normal(80) for a in rng.standard_normal(5)]
        spread, least, most = spread_over_records(groups)
        assert spread == pytest.approx(np.std(np.concatenate(groups)))
        held.append(least < np.exp(0.25**2) < most)
    assert 0.9 < np.mean(held) < 0.98
    assert spread_over_records(groups[:1])[1:] == (0.0, np.inf)


def test_a_spread_is_contradicted_where_its_whole_interval_is_outside():
    assert contradicted(1.26, 2.0) == "above"
    assert contradicted(0.5, 0.79) == "below"
    assert contradicted(0.5, 0.81) == contradicted(1.24, 2.0) == contradicted(0.5, 2.0) == ""
    np.testing.assert_array_equal(within(np.array([0.79, 0.8, 1.25, 1.26])), [0, 1, 1, 0])
