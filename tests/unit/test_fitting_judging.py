"""Whether simulated trains explain the measured one: ranks, and trains without moments."""

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
from impactsig.fitting._judging import judge
from impactsig.fitting.result import OscillatorFit
from tests.fitting import NATURAL, chaos, measured

TRAINS, MOMENTS = 40, 12


def problem(share=1.0):
    """One whose measured moments are 0 by definition; the first three are shares of words."""
    words = np.array([0.5, 0.3, 0.2])
    return SimpleNamespace(
        share=share,
        moments=SimpleNamespace(shares=3),
        measured=np.concatenate((words, np.zeros(MOMENTS - 3))),
        scale=np.full(MOMENTS, 0.01),
    )


def looks(seed=0, off=0.0, scatter=1.0, failed=0):
    rng = np.random.default_rng(seed)
    found = off + scatter * rng.standard_normal((TRAINS, MOMENTS))
    found[:failed] = np.nan
    return found


def test_the_p_value_is_a_rank():
    simulated = np.array([1.0, 2.0, 3.0, 4.0])
    assert _judging.p_value(5.0, simulated, 4) == 1 / 5
    assert _judging.p_value(3.5, simulated, 4) == 2 / 5
    assert _judging.p_value(3.0, simulated, 4) == 3 / 5  # a tie counts as farther
    assert _judging.p_value(0.0, simulated, 4) == 1


def test_a_train_far_from_all_is_not_explained_and_ones_amid_them_are():
    far = judge(problem(), looks(off=8.0))
    assert far.p_value == _judging.LEAST_P
    assert far.distance > 20
    rng = np.random.default_rng(1)
    near = [judge(problem(), looks(seed) - rng.standard_normal(MOMENTS)) for seed in range(60)]
    assert np.mean([one.distance for one in near]) == pytest.approx(1, abs=0.2)
    assert np.mean([one.p_value for one in near]) == pytest.approx(0.5, abs=0.15)


@pytest.mark.parametrize("failed", [1, 20, 38])
def test_trains_without_moments_do_not_hide_a_misfit(failed):
    found = judge(problem(), looks(off=8.0, failed=failed))
    assert found.p_value == _judging.LEAST_P
    assert found.failed == failed


def test_without_two_trains_there_is_no_judgement():
    assert judge(problem(), looks(failed=39)) is None
    assert judge(problem(), looks(failed=40)) is None


@pytest.mark.parametrize("chance", [0.0, 0.5])
def test_the_test_has_the_size_that_it_claims(chance):
    # Of trains of one kind, some without moments, the measured one drawn among them.
    rng = np.random.default_rng(7)
    rejected, draws, level = 0, 2000, 4 / (TRAINS + 1)
    for _ in range(draws):
        found = rng.standard_normal((TRAINS + 1, MOMENTS))
        found[rng.random(TRAINS + 1) < chance] = np.nan
        if np.isfinite(found[0, 0]):  # others have no moments to compare
            rejected += judge(problem(), found[1:] - found[0]).p_value <= level
    deviation = np.sqrt(draws * level * (1 - level))
    assert abs(rejected - draws * level) < 4 * deviation


@pytest.mark.parametrize("scatter", [0.0, 1e-9, 1e-6, 1e-2])
def test_trains_that_hardly_scatter_are_not_infinitely_far(scatter):
    # 12 scatters of the measured moments is as far as `Problem.look` goes: 2 * 12^2.
    found = judge(problem(), looks(off=12.0, scatter=scatter))
    assert 100 < found.distance < 300
    assert found.p_value == _judging.LEAST_P


def test_a_longer_train_must_lie_nearer():
    off = looks() - looks().mean(0) + 0.8  # the measured one is 0.8 from the mean, in each moment
    same, longer = judge(problem(), off), judge(problem(share=0.1), off)
    assert longer.distance / same.distance == pytest.approx((1 + 1 / 40) / (0.1 + 1 / 40))
    assert longer.p_value < same.p_value


def test_word_shares_are_in_shares():
    given = looks(off=2.0)
    measured, mean, scatter = judge(problem(), given).shares
    np.testing.assert_allclose(measured, [0.5, 0.3, 0.2])
    np.testing.assert_allclose(mean, measured + 0.01 * given[:, :3].mean(0))
    np.testing.assert_allclose(scatter, 0.01 * given[:, :3].std(0))


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
    found = fit_oscillator(measured(chaos(count=250), 2), 1 / 20.1, ("restitution",), scene=wrong)
    assert found.p_value <= 0.05
    assert found.distance > 2
    assert "does not explain" in found.warnings[-1]
    assert found.misfit
    assert len(estimates) == 2  # it began anew


@pytest.mark.parametrize(("rank", "misfit"), [(1, True), (3, True), (5, False), (30, False)])
def test_a_misfit_is_reported_before_all_trains_are_nearer(rank, misfit):
    """Ranks of 41: soft stops, fitted with a rigid one, come third as often as first."""
    verdict = SimpleNamespace(p_value=rank / 41, failed=0)
    said = _outcome.warnings_of((), False, True, verdict)
    assert any("does not explain" in one for one in said) == misfit
    fields = dict.fromkeys(OscillatorFit.__dataclass_fields__)
    assert OscillatorFit(**fields | {"p_value": rank / 41}).misfit == misfit


def test_where_no_search_ends_at_impacts_the_fit_is_refused(monkeypatch):
    monkeypatch.setattr(fit, "_estimate", lambda problem: None)
    with pytest.raises(InvalidInput, match="one rigid stop") as caught:
        fit_oscillator(chaos(count=250), 1 / 20.1, natural_frequency=22.2)
    assert caught.value.argument == "impacts"
    assert "second stop" in str(caught.value)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("frequency", "amplitude", "restitution", "lower"),
    [(17.3, 0.5, 0.6, -1.0), (20.1, 0.25, 0.4, -1.2)],
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
