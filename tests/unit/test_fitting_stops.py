"""Whether one train with strengths comes from a rigid or from a soft stop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks import misfit
from impactsig import KelvinVoigt, Rigid, Stop, fit_oscillator, scenes, simulate
from impactsig.fitting import _outcome
from impactsig.fitting._asked import limits_of
from impactsig.fitting._machine import as_train
from impactsig.fitting.orbits.orbit_kernels import OWN
from impactsig.fitting.result import DECIDED
from impactsig.fitting.searching.problem import Problem
from impactsig.fitting.searching.refine import orbits
from tests.fitting import measured


def strong(stop, seed=1):
    """A fit's problem: the thesis' beam, with a stop of its own, whose impulses are known."""
    beam = replace(scenes.karpodinis(20.1), stops=(stop,))
    truth = simulate(beam, periods=700, transient=300).impacts[:400]
    truth = replace(truth, duration=float(truth.time[-1] - truth.start))
    train = measured(truth, seed)
    names, known = ("restitution", "damping", "amplitude"), {"natural_frequency": 22.2}
    return Problem(
        names, known, limits_of(names, known, None), 20.1,
        as_train(train, 20.1, train.impulse), np.random.default_rng(seed),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("restitution", "stiffness"),
    # The stiffer it is, the nearer to a rigid one, and the harder to tell.
    [pytest.param(0.4, 100.0, marks=pytest.mark.slow), (0.3, 800.0)],
)
def test_the_orbit_of_a_soft_stop_tells_its_stiffness(restitution, stiffness):
    found = orbits(strong(Stop(1.0, KelvinVoigt.equivalent(restitution, stiffness))))
    assert found["soft"].evidence > found["rigid"].evidence + 2 * DECIDED
    best = found["soft"].best
    deviation = np.sqrt(np.diag(np.linalg.inv(best.orbit.information)))[:4]
    true = np.array([restitution, *np.log([0.03, 0.25, stiffness])])
    assert np.all(np.abs(best.theta[[0, 1, 2, OWN]] - true) < 3 * deviation)
    assert np.all(deviation < [0.03, 0.06, 0.01, 0.15])


def test_a_rigid_stop_is_not_taken_for_a_soft_one():
    found = orbits(strong(Stop(1.0, Rigid(0.3))))
    assert found["rigid"].evidence > found["soft"].evidence + DECIDED
    assert found["rigid"].best.theta[0] == pytest.approx(0.3, abs=0.05)


@pytest.mark.parametrize(("rigid", "said"), [(0.0, ""), (-19.0, "not told"), (-21.0, "misfit")])
def test_a_fit_says_that_the_other_stop_is_likelier(rigid, said):
    odds = {"rigid": rigid, "soft": 0.0 if rigid else -400.0}
    words = " ".join(_outcome.warnings_of_stop("rigid", odds))
    assert said in words
    assert bool(words) == bool(said)
    assert _outcome.warnings_of_stop("rigid", {}) == ()


@pytest.mark.slow
def test_the_likelier_stop_of_one_train_is_fitted():
    kind, frequency, truth, impacts = misfit.draw(3001)
    assert kind == "soft"
    asked = (misfit.measured(impacts, 3001), 1 / frequency)
    rigid = fit_oscillator(*asked, natural_frequency=misfit.NATURAL, seed=1)
    assert rigid.misfit
    assert any("soft stop explains" in one for one in rigid.warnings)
    soft = fit_oscillator(*asked, natural_frequency=misfit.NATURAL, kinds=("rigid", "soft"), seed=1)
    assert soft.kind == "soft"
    assert not soft.misfit
    assert str(soft).startswith("soft stop (log odds of a rigid one -")
    for name, true in truth.items():
        low, high = soft.intervals[name]
        assert abs(soft.values[name] - true) < 1.5 * (high - low), name
