"""What a fit is made of, where a fault in a part would hardly show in the whole."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks import misfit
from impactsig import InvalidInput, fit_oscillator
from impactsig.fitting._asked import limits_of
from impactsig.fitting._machine import as_train
from impactsig.fitting.searching.narrow import beside, narrow
from impactsig.fitting.searching.problem import Problem
from impactsig.fitting.searching.refine import _first
from impactsig.fitting.searching.search import begin, chain
from impactsig.fitting.trains.moments import Moments
from impactsig.fitting.trains.partition import Train
from tests.fitting import NATURAL, Linear, chaos

# -- moments -----------------------------------------------------------------------------------


def test_a_word_is_told_by_its_middle_impact():
    rng = np.random.default_rng(3)
    symbols = rng.integers(1, 3, 500)
    x = 0.3 + np.concatenate(([0], np.cumsum(symbols))) + 0.005 * rng.standard_normal(501)
    strength = rng.uniform(0.5, 1.5, 501)
    moments = Moments.of(Train(x, strength, np.ones(500, bool)))
    phase = x - np.rint(x - 0.3)
    phase = phase - np.angle(np.exp(2j * np.pi * x).sum()) / (2 * np.pi)
    expected = {code: [] for code in range(16)}
    for k in range(497):  # words of four intervals, between five impacts
        code = int("".join(str(s - 1) for s in symbols[k : k + 4]), 2)
        expected[code].append((phase[k + 2], strength[k + 2] / strength.mean()))
    means = np.array([np.mean(expected[code], axis=0) for code in range(16)]).T
    np.testing.assert_allclose(moments.words, means, atol=1e-12)


# -- the local fit -----------------------------------------------------------------------------


def near(problem):
    psi = problem.truth + problem.rng.normal(0, [0.1, 0.5, 0.03], (200, 3))
    return psi, problem.look(psi)


def test_a_longer_train_tells_more():
    whole, longer = Linear(3), Linear(3)
    longer.share = 0.25  # four times as long as the simulated ones
    short = narrow(whole, *near(whole))
    found = narrow(longer, *near(longer))
    np.testing.assert_array_equal(found.psi, short.psi)
    # The variance of the measured train, and 7 coefficients from nearly 300 trains.
    regression = 7 / 300
    ratio = (0.25 + regression) / (1 + regression)
    np.testing.assert_allclose(found.covariance, ratio * short.covariance, rtol=0.02)


class Followed(Linear):
    """A problem in which an orbit beside a train tells the same as its moments."""

    def tell(self, psi):
        return self.look(psi)


def test_an_estimate_beyond_its_cloud_moves_the_cloud():
    problem = Followed(5)
    best = np.linalg.inv(problem.slopes.T @ problem.slopes)
    deviation = np.sqrt(np.diag(best))
    start = problem.truth + 7 * deviation * [1, -1, 1]  # a cloud reaches 3 of these
    found = beside(problem, start, np.diag(deviation**2))
    off = (found.psi - problem.truth) / np.sqrt(np.diag(found.covariance))
    assert np.abs(off).max() < 3.5
    np.testing.assert_array_less(np.sqrt(np.diag(found.covariance)), 1.6 * deviation)


class Silent(Linear):
    """A problem at whose optimum the oscillator never reaches the stop."""

    def look(self, psi):
        return np.full((len(psi), 12), np.nan)

    tell = look


def test_without_trains_there_is_no_estimate():
    psi, y = near(Linear(0))
    assert narrow(Silent(0), psi, y) is None
    assert beside(Silent(0), psi[0], np.diag([0.1, 0.5, 0.03]) ** 2) is None


class Fading(Linear):
    """A problem in whose last cloud no train has moments."""

    seen = 0

    def look(self, psi):
        self.seen += len(psi)
        whole = super().look(psi)
        return whole if self.seen <= self.until else np.full_like(whole, np.nan)


def test_a_last_cloud_without_trains_gives_no_estimate():
    whole = Fading(0)
    whole.until = math.inf
    assert narrow(whole, *near(whole)) is not None
    fading = Fading(0)
    fading.until = whole.seen - 300  # the trains of the last cloud
    assert narrow(fading, *near(fading)) is None


# -- the search --------------------------------------------------------------------------------


def problem_of(train):
    """One with a free restitution coefficient; the rest is as in `chaos`."""
    free = ("restitution",)
    known = {"damping": 0.03, "amplitude": 0.25, "natural_frequency": NATURAL}
    limits = limits_of(free, known, None)
    return Problem(free, known, limits, 20.1, train, np.random.default_rng(0))


def test_the_balance_leads_to_states_on_the_motion():
    truth = chaos(count=400)
    found = begin(problem_of(as_train(truth, 20.1, truth.approach_velocity)))
    assert found.free == pytest.approx([0.2], abs=0.01)
    phase = 2 * math.pi * (truth.time * 20.1)
    states = np.column_stack((np.cos(phase), np.sin(phase), truth.approach_velocity))
    led = found.beginnings
    there = np.column_stack((np.cos(led.phase), np.sin(led.phase), led.approach))
    apart = np.linalg.norm(there[:, None] - states, axis=2).min(axis=1)
    assert len(led.phase) > 20
    assert np.median(apart) < 0.01
    assert apart.max() < 0.1


def test_false_impacts_outside_the_window_tell_how_many_there_are():
    # True impacts at four tenths of all phases, false ones at all alike.
    rng = np.random.default_rng(1)
    true = np.cumsum(rng.integers(1, 3, 3000)) + rng.uniform(0.1, 0.5, 3000)
    false = np.linspace(true[0], true[-1], 62)[1:-1] // 1 + np.arange(60) / 60
    x = np.sort(np.concatenate((true, false)))
    train = Train(x, None, np.ones(len(x) - 1, bool))
    problem = problem_of(train)
    guess = dict(zip(problem.names[1:], chain(problem), strict=True))
    assert problem.moments.partition.window.mean() == pytest.approx(0.45, abs=0.04)
    assert guess["spurious"] == pytest.approx(60 / 3060, rel=0.1)
    # The phases are uniform, 0.4 wide, but for the false ones in the window.
    assert guess["jitter"] == pytest.approx(math.log(0.5 * 0.4 / math.sqrt(12)), abs=0.05)


def test_a_train_whose_parts_cannot_be_read_is_refused():
    # Two stops, whose impacts follow each other too differently for one: it ended in an IndexError.
    _, frequency, _, impacts = misfit.draw(995)
    seen = misfit.measured(impacts, 995)
    with pytest.raises(InvalidInput, match=r"^impacts: got 590 .* 11 parts 0 can be read"):
        fit_oscillator(seen, 1 / frequency, natural_frequency=misfit.NATURAL, seed=995)


def test_information_that_rounding_made_less_than_nothing_ends_in_no_fault():
    truth = chaos(count=250)
    problem = problem_of(as_train(truth, 20.1, truth.approach_velocity))
    rough = np.array([[1e4, 6e4, 0], [6e4, 1e5, 0], [0, 0, 1e5]])
    assert np.linalg.eigvalsh(rough)[0] < 0
    orbit = SimpleNamespace(information=rough, explained=0.97)
    noise = SimpleNamespace(instant=0.01, strength=0.05)
    best = SimpleNamespace(theta=np.full(6, 0.1), noise=noise, orbit=orbit)
    centre, covariance = _first(problem, best, 250)
    assert np.isfinite(centre).all()
    assert np.linalg.eigvalsh(covariance)[0] > 0
