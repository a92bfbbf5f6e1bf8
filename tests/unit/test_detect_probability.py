"""The probability that an event of a force record is an impact."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

import impactsig
from benchmarks.disturbances import stationary
from benchmarks.recordings import score
from impactsig.detect._probability import LOWEST, excursions, level_of, probabilities

SAMPLES = 250_000.0


def judged(u, widths):
    out = np.empty(len(u))
    return out, probabilities(np.asarray(u, float), np.asarray(widths, float), SAMPLES, out)


def detect(truth, **options):
    rec = impactsig.Recording(truth.samples, truth.rate, sensor="force")
    return impactsig.detect_impacts(rec, **options)


@pytest.mark.parametrize("u", [4.0, 5.5])
def test_excursions_of_a_sliding_mean_are_those_of_rice(u):
    above = quad(lambda v: excursions(v) / v, u, np.inf)[0]
    assert above == pytest.approx(u**2 * norm.sf(u), rel=1e-6)


def test_an_event_is_likelier_among_others_like_it():
    alone, _ = judged([5.5], [11.0])
    heights = np.geomspace(4.5, 30.0, 100)
    among, crowd = judged(np.r_[5.5, 5.5, heights], np.r_[11.0, 2.0, np.full(100, 11.0)])
    assert alone[0] < 0.1
    assert among[0] > 0.9
    assert among[1] < among[0]
    assert level_of(crowd, 11.0, 0.5) < level_of(crowd, 2.0, 0.5)
    assert level_of(crowd, 2.0, 0.1) < level_of(crowd, 2.0, 0.9)


def test_noise_makes_no_impacts_of_itself():
    rng = np.random.default_rng(2)
    for _ in range(100):
        # About as high as noise has them: exponential above the lowest, at its slope there.
        u = LOWEST + rng.exponential(1 / LOWEST, rng.poisson(35))
        p, _ = judged(u, np.exp(rng.uniform(0, 3, len(u))))
        assert p[u < 5.5].max(initial=0.0) < 0.5


def test_no_events_at_all():
    p, crowd = judged([], [])
    assert len(p) == 0
    assert 6.0 < level_of(crowd, 11.0, 0.5) < 7.0


@pytest.mark.parametrize(("decibels", "least"), [(10, 0.90), (6, 0.74)])
def test_faint_impacts_are_found(decibels, least):
    truth = stationary(601, noise=10 ** (-decibels / 20))
    assert score(detect(truth).time, truth.time)[0] >= least


def test_the_probability_is_the_share_that_is_right():
    chance, right = [], []
    for seed in (602, 603, 604):
        truth = stationary(seed, noise=10**-0.5)
        found = detect(truth, least_probability=0.02)
        hit = np.zeros(len(found), bool)
        hit[score(found.time, truth.time, 0.4e-3)[2][:, 0]] = True
        chance.append(found.probability)
        right.append(hit)
    p, y = np.concatenate(chance), np.concatenate(right)
    assert p.min() >= 0.02
    assert np.mean((p - y) ** 2) <= 0.5 * y.mean() * (1 - y.mean())
    for low, high in ((0.0, 0.3), (0.3, 0.9), (0.9, 1.01)):
        chosen = (p >= low) & (p < high)
        chance_of_it = np.sqrt(np.sum(p[chosen] * (1 - p[chosen]))) / chosen.sum()
        assert abs(p[chosen].mean() - y[chosen].mean()) <= 0.05 + 2 * chance_of_it


def test_one_dial_of_sensitivity():
    truth = stationary(605, 6.0, noise=10**-0.5)
    counts = [len(detect(truth, least_probability=p)) for p in (0.05, 0.5)]
    given = detect(truth, least_probability=0.95)
    assert counts[0] > counts[1] > len(given)
    assert given.probability.min() >= 0.95
    assert given.settings["least_probability"] == 0.95
    assert detect(truth, threshold="5 sigma").probability.min() < 0.95  # in place of the dial
