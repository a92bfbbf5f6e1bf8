"""The measured train among simulated ones: its rank is a p-value, and tells what is unlike them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from matplotlib import pyplot

from impactsig import InvalidInput, Rigid, Stop, fit_oscillator, scenes, simulate
from impactsig.fitting import _judging, _outcome, fit
from impactsig.fitting._judging import compared, judged
from impactsig.fitting.result import OscillatorFit
from impactsig.fitting.trains.partition import Train
from tests.fitting import NATURAL, chaos, measured

TRAINS, COUNT = 20, 120


def test_the_p_value_is_a_rank():
    simulated = np.array([1.0, 2.0, 3.0, 4.0])
    assert _judging.p_value(5.0, simulated, 4) == 1 / 5
    assert _judging.p_value(3.5, simulated, 4) == 2 / 5
    assert _judging.p_value(3.0, simulated, 4) == 3 / 5  # a tie counts as farther
    assert _judging.p_value(0.0, simulated, 4) == 1


def alike(rng, trains, long=0.3, count=COUNT, false=0.02, hard=None):
    """Trains of one or two periods in turn, at one phase, some instants at any other.

    After a long step an impact is `hard` times as strong as after others, to 5 %.
    """
    x, strength = [], []
    for _ in range(trains):
        steps = np.where(rng.random(count) < long, 2.0, 1.0)
        at = np.cumsum(steps) + 0.02 * rng.standard_normal(count)
        extra = count * rng.random(rng.poisson(false * count))
        order = np.argsort(np.concatenate((at, extra)))
        x.append(np.concatenate((at, extra))[order])
        if hard is not None:
            size = np.where(steps > 1.5, hard, 1.0) * (1 + 0.05 * rng.standard_normal(count))
            strength.append(np.concatenate((size, np.ones(len(extra))))[order])
    counts = [len(one) for one in x]
    owner = np.repeat(np.arange(trains), counts)
    starts = np.cumsum(counts) - counts
    known = None if hard is None else np.concatenate(strength)
    return Train(np.concatenate(x), known, owner[1:] == owner[:-1], starts)


@pytest.mark.parametrize("hard", [None, 2.0])
def test_of_trains_of_one_kind_none_is_nearer_than_the_others(hard):
    # Had the measured one chosen the phases and classes, it would: 4 of 21 then come too seldom.
    rng = np.random.default_rng(1)
    draws, level, rejected, ranks = 400, 4 / (TRAINS + 1), 0, []
    for _ in range(draws):
        every = alike(rng, TRAINS + 1, hard=hard)
        measured = every.split()[0]
        first = len(measured.x)
        strength = None if hard is None else every.strength[first:]
        others = Train(every.x[first:], strength, every.joined[first:], every.starts[1:] - first)
        found = compared(measured, others)
        rejected += found.p_value <= level
        ranks.append(found.p_value)
    assert abs(rejected - draws * level) < 3 * np.sqrt(draws * level * (1 - level))
    mean = (TRAINS + 2) / (2 * (TRAINS + 1))
    assert abs(np.mean(ranks) - mean) < 3 * 0.29 / np.sqrt(draws)


def test_a_train_of_another_kind_is_farther_than_all():
    rng = np.random.default_rng(2)
    found = compared(alike(rng, 1, long=0.6), alike(rng, TRAINS))
    assert found.p_value == 1 / (TRAINS + 1)
    assert found.distance > 5
    measured, mean, scatter = found.shares
    assert np.max(np.abs(measured - mean) / scatter) > 3
    assert measured.sum() == pytest.approx(1)
    assert found.failed == 0


def test_strengths_tell_what_instants_do_not():
    rng = np.random.default_rng(6)
    other, some = alike(rng, 1, hard=2.5), alike(rng, TRAINS, hard=2.0)
    assert compared(other, some).p_value == 1 / (TRAINS + 1)
    assert compared(other._replace(strength=None), some).p_value > 2 / (TRAINS + 1)


def test_trains_without_impacts_count_as_nearer():
    rng = np.random.default_rng(3)
    some = alike(rng, TRAINS // 2)
    starts = np.concatenate((some.starts, np.full(TRAINS // 2, len(some.x))))
    found = compared(alike(rng, 1, long=0.6), some._replace(starts=starts))
    assert found.failed == TRAINS // 2
    assert found.p_value == 1 / (TRAINS + 1)


@pytest.mark.parametrize("count", [0, 1, 5])
def test_trains_that_are_too_short_explain_nothing(count):
    rng = np.random.default_rng(4)
    found = compared(alike(rng, 1), alike(rng, TRAINS, count=count, false=0.0))
    assert (found.p_value, found.failed) == (_judging.LEAST_P, TRAINS)
    assert not found.compared


def test_what_a_fit_leaves_open_is_drawn():
    """Shares of long steps that scatter: one at the edge is explained, with none open it is not."""
    rng = np.random.default_rng(5)

    def simulated(psi):
        drawn.append(psi)
        every = [alike(rng, 1, long=float(one)) for one in psi[:, 0]]
        starts = np.concatenate(([0], np.cumsum([len(one.x) for one in every])[:-1]))
        joined = np.concatenate([np.append(one.joined, False) for one in every])[:-1]
        return Train(np.concatenate([one.x for one in every]), None, joined, starts)

    drawn: list[np.ndarray] = []
    problem = SimpleNamespace(
        share=1.0, train=alike(rng, 1, long=0.5), rng=rng, simulate=simulated,
        box=(np.array([0.05]), np.array([0.95])),
    )  # fmt: skip
    sure = judged(problem, np.array([0.3]), np.zeros((1, 1)))
    unsure = judged(problem, np.array([0.3]), np.array([[0.15**2]]))
    assert sure.p_value <= 2 / (_judging.JUDGED + 1) < unsure.p_value
    assert np.ptp(drawn[0]) == 0
    assert drawn[1].std() == pytest.approx(0.15, rel=0.3)
    assert drawn[1].min() >= 0.05


# -- in a fit ----------------------------------------------------------------------------------


@pytest.fixture
def estimates(monkeypatch):
    """What every search of a fit led to."""
    found, estimate = [], fit._estimate

    def kept(problem):
        found.append(estimate(problem))
        return found[-1]

    monkeypatch.setattr(fit, "_estimate", kept)
    return found


def test_a_wrong_machine_is_not_believed(estimates, monkeypatch):
    monkeypatch.setattr(fit, "TRIES", 2)
    # It is 0.25; at 0.3 the last bits of the processor decide whether a train is as far.
    wrong = scenes.karpodinis(20.1, amplitude=0.35)
    found = fit_oscillator(
        measured(chaos(count=250), 2), 1 / 20.1, ("restitution",), scene=wrong, seed=0
    )
    assert found.p_value <= 0.05
    assert found.distance > 2
    assert any("does not explain" in one for one in found.warnings)
    assert found.misfit
    assert len(estimates) == 2  # it began anew


@pytest.mark.parametrize(("rank", "misfit"), [(1, True), (3, True), (5, False), (30, False)])
def test_a_misfit_is_reported_before_all_trains_are_nearer(rank, misfit):
    """Ranks of 41: soft stops, fitted with a rigid one, come third as often as first."""
    verdict = SimpleNamespace(p_value=rank / 41, failed=0)
    said = _outcome.warnings_of((), False, True, verdict)
    assert any("does not explain" in one for one in said) == misfit
    fields = dict.fromkeys(OscillatorFit.__dataclass_fields__)
    fields |= {"p_value": rank / 41, "kind": "rigid"}
    assert OscillatorFit(**fields | {"log_odds": {}}).misfit == misfit
    assert OscillatorFit(**fields | {"log_odds": {"rigid": 0.0, "soft": -50.0}}).misfit == misfit
    assert OscillatorFit(**fields | {"log_odds": {"rigid": -50.0, "soft": 0.0}}).misfit


def test_where_no_search_ends_at_impacts_the_fit_is_refused(monkeypatch):
    monkeypatch.setattr(fit, "_estimate", lambda problem: None)
    with pytest.raises(InvalidInput, match="one rigid stop") as caught:
        fit_oscillator(chaos(count=250), 1 / 20.1, natural_frequency=22.2)
    assert caught.value.argument == "impacts"
    assert "second stop" in str(caught.value)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("frequency", "amplitude", "restitution", "lower"),
    [(17.3, 0.5, 0.6, -1.0), (20.1, 0.3, 0.6, -1.1)],
)
def test_a_machine_with_two_stops_is_refused_or_warned_of(frequency, amplitude, restitution, lower):
    one = scenes.karpodinis(frequency, amplitude=amplitude, restitution=restitution)
    law = Rigid(restitution)
    machine = replace(one, stops=(Stop(1.0, law), Stop(lower, law, "lower")))
    truth = simulate(machine, periods=1000, transient=300).impacts[:500]
    truth = replace(truth, duration=float(truth.time[-1] - truth.start))
    train = replace(measured(truth, 1), impulse=None)
    found, refusal = None, ""
    try:
        found = fit_oscillator(train, 1 / frequency, natural_frequency=NATURAL, seed=1)
    except InvalidInput as error:
        refusal = str(error)
    if found is None:
        assert "one rigid stop" in refusal
        return
    assert found.warnings
    assert 0 < found.distance < 300
    assert _judging.LEAST_P <= found.p_value <= 1
    assert found.plot().shape == (2, 2)
    assert "distance" in str(found)
    pyplot.close("all")
