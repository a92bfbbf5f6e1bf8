"""The probability that what was found in a force record is an impact."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

import impactsig
from benchmarks.disturbances import stationary
from benchmarks.recordings import PULSES, add_pulses, score
from impactsig.detect.search.spans import Spans
from impactsig.detect.signal.probability import (
    CRESTS,
    GAUSSIAN,
    LEFT,
    LOWEST,
    excursions,
    probabilities,
    trials_about,
)

WIDTHS = 20_000.0


def chances(upward, downward, certain, trials=1.0):
    both = np.empty(len(upward) + len(certain))
    probabilities(
        np.asarray(upward, float),
        np.asarray(downward, float),
        np.asarray(certain, float),
        WIDTHS,
        WIDTHS if len(downward) else 0.0,
        trials,
        trials_about(10.0),
        both,
    )
    return both[: len(upward)]


def noise_crests(rng, mean=GAUSSIAN):
    """Heights above the lowest one: half their squares are exponentially distributed."""
    over = rng.exponential(mean, rng.poisson(CRESTS * WIDTHS))
    return np.sqrt(LOWEST**2 + 2.0 * over)


def detect(truth, **options):
    rec = impactsig.Recording(truth.samples, truth.rate, sensor="force")
    return impactsig.detect_impacts(rec, **options)


@pytest.mark.parametrize("u", [3.2, 5.5])
def test_excursions_of_a_sliding_mean_are_those_of_rice(u):
    assert excursions(u) == pytest.approx(u**2 * norm.sf(u), rel=1e-9)


def test_the_kernel_is_compiled_for_one_layout():
    """Columns of a table of crests are not contiguous, and an array of none is."""
    detect(stationary(605, 6.0, noise=10**-0.5))
    layouts = {kind.layout for one in probabilities.signatures for kind in one[:3]}
    assert layouts == {"C"}


def test_a_crest_is_likelier_among_impacts_of_about_its_height():
    rng = np.random.default_rng(1)
    faint, noise = np.r_[4.5, noise_crests(rng)], noise_crests(rng)
    near = np.geomspace(4.8, 9.0, 30)
    assert chances(faint, noise, 10 * near)[0] < 0.05
    assert chances(faint, noise, near)[0] > 0.8


def test_crests_of_noise_are_no_impacts():
    rng = np.random.default_rng(2)
    for _ in range(50):
        p = chances(noise_crests(rng), noise_crests(rng), np.full(8, 80.0))
        assert np.sum(p >= 0.5) <= 1
        assert p.mean() < 0.05


def test_longer_tails_of_the_noise_are_seen_on_the_other_side():
    rng = np.random.default_rng(3)
    near = np.geomspace(5.5, 20.0, 40)
    gaussian, long = noise_crests(rng), noise_crests(rng, 4.0)
    assert chances([5.2], gaussian, near)[0] > 0.95
    assert chances([5.2], long, near)[0] < 0.8


def test_few_crests_tell_how_many_the_noise_has():
    rng = np.random.default_rng(5)
    near = np.geomspace(5.5, 20.0, 40)
    noise = noise_crests(rng)
    assert len(noise) > 30
    usual, rare = (chances([4.4], those, near)[0] for those in (noise, noise[::3]))
    assert rare / (1.0 - rare) > 2.1 * usual / (1.0 - usual)


def test_more_faint_impacts_than_certain_ones():
    rng = np.random.default_rng(6)
    heights = np.exp(rng.normal(np.log(3.5), 0.2, 400)) + rng.standard_normal(400)
    faint, noise = heights[(heights > LOWEST) & (heights < 5.5)], noise_crests(rng)
    stated = chances(np.r_[faint, noise], noise_crests(rng), heights[heights >= 5.5])
    assert abs(stated.sum() - len(faint)) < 0.2 * len(faint)


def test_what_is_not_certain_is_weighed_beside_what_is():
    rate, rng = 20_000.0, np.random.default_rng(7)
    wave, start = rng.standard_normal(round(20 * rate)), 0.05 + np.arange(1300) * 0.015
    contact, peak = np.full(len(start), 1e-4), rng.uniform(3.0, 30.0, len(start))
    add_pulses(wave, rate, start, contact, peak, PULSES["half-sine"])
    found = impactsig.detect_impacts(
        impactsig.Recording(wave, rate, sensor="force"), least_probability=0.05
    )
    matched = impactsig.match_impacts(found, impactsig.Impacts(start), 1e-3, delay=None)
    assert len(matched.pairs) >= len(found) - 2  # what noise has at this height are few
    assert np.count_nonzero(found.probability >= 0.5) > 0.98 * len(found)


def test_the_share_of_impacts_among_crests_is_the_probability():
    rng = np.random.default_rng(4)
    p, y = [], []
    for _ in range(200):
        # A crest of an impact has the noise in it, too.
        heights = np.exp(rng.normal(np.log(4.8), 0.5, 100)) + rng.standard_normal(100)
        heights, noise = heights[heights > LOWEST], noise_crests(rng)
        faint, left = heights[heights < 5.5], rng.random(len(noise)) < LEFT
        both = chances(np.r_[faint, noise], noise_crests(rng), heights[heights >= 5.5])
        p.append(both[np.r_[np.full(len(faint), True), left]])
        y.append(np.r_[np.ones(len(faint)), np.zeros(left.sum())])
    p, y = np.concatenate(p), np.concatenate(y)
    for low in (0.0, 0.2, 0.4, 0.6, 0.8):
        chosen = (p >= low) & (p < low + 0.2)
        error = np.sqrt(np.sum(p[chosen] * (1 - p[chosen]))) / chosen.sum()
        assert abs(p[chosen].mean() - y[chosen].mean()) <= 0.05 + 2 * error


def test_few_faint_impacts_among_many_clear_ones():
    rng, trials, level = np.random.default_rng(8), trials_about(10.0), 5.6
    p, y = [], []
    for _ in range(1500):
        heights = np.exp(rng.normal(np.log(25.0), 0.5, 120))
        faint = heights[(heights > 5.0) & (heights < level)]
        noise = noise_crests(rng)
        for _ in range(7):
            noise = np.r_[noise, noise_crests(rng)]
        noise = noise[(noise > 5.0) & (rng.random(len(noise)) < LEFT)]
        stated = chances(np.r_[faint, noise], [], heights[heights >= level], trials)
        p.append(stated)
        y.append(np.r_[np.ones(len(faint)), np.zeros(len(noise))])
    p, y = np.concatenate(p), np.concatenate(y)
    for low, high in ((0.0, 0.2), (0.2, 0.5), (0.5, 1.0)):
        chosen = (p >= low) & (p < high)
        error = np.sqrt(np.sum(p[chosen] * (1 - p[chosen]))) / chosen.sum()
        assert abs(p[chosen].mean() - y[chosen].mean()) <= 0.05 + 2 * error


@pytest.mark.parametrize("rate", [10_000.0, 50_000.0])
def test_what_impacts_draw_down_is_no_noise(rate):
    rng = np.random.default_rng(9)
    wave, start = (
        rng.standard_normal(400_000),
        np.arange(0.05, 400_000 / rate - 0.05, 500 / rate),
    )
    contact, peak = np.full(len(start), 4.2 / rate), np.full(len(start), 40.0)
    peak[::6] = np.geomspace(3.5, 10.0, len(peak[::6]))
    add_pulses(wave, rate, start, contact, peak, PULSES["half-sine"])
    found = impactsig.detect_impacts(impactsig.Recording(wave, rate, sensor="force"))
    matched = impactsig.match_impacts(found, impactsig.Impacts(start), 2 * contact[0], delay=None)
    assert len(matched.pairs) > 0.993 * len(start)
    assert len(found) - len(matched.pairs) <= 5


@pytest.mark.parametrize(("decibels", "least"), [(10, 0.88), (6, 0.72)])
def test_faint_impacts_are_found(decibels, least):
    truth = stationary(601, noise=10 ** (-decibels / 20))
    assert score(detect(truth).time, truth.time)[0] >= least


def test_no_fainter_ones_among_impacts_of_one_height():
    rate, rng = 50_000.0, np.random.default_rng(6)
    wave, start = rng.standard_normal(round(20 * rate)), np.arange(0.05, 19.9, 0.1)
    contact, peak = np.full(len(start), 3e-4), np.full(len(start), 30.0)
    add_pulses(wave, rate, start, contact, peak, PULSES["half-sine"])
    found = impactsig.detect_impacts(impactsig.Recording(wave, rate, sensor="force"))
    assert len(found) == len(start)
    assert found.probability.min() > 0.95


def test_one_dial_of_sensitivity():
    truth = stationary(605, 6.0, noise=10**-0.5)
    counts = [len(detect(truth, least_probability=p)) for p in (0.05, 0.5)]
    strict = detect(truth, least_probability=0.95)
    assert counts[0] > counts[1] > len(strict)
    assert strict.probability.min() >= 0.95
    assert strict.settings["least_probability"] == 0.95


def test_a_threshold_takes_the_place_of_the_dial():
    truth = stationary(605, 6.0, noise=10**-0.5)
    found = detect(truth, threshold="4.5 sigma")
    assert len(found) == len(detect(truth, threshold="4.5 sigma", least_probability=0.9))
    assert found.probability.min() < 0.5


def test_nothing_is_looked_for_again_where_no_impact_stands_near_the_level(monkeypatch):
    looks = []
    look = Spans.faint
    monkeypatch.setattr(Spans, "faint", lambda *span: looks.append(span) or look(*span))
    detect(stationary(601, noise=0.03))
    assert not looks
    detect(stationary(601, noise=0.3))
    assert looks
