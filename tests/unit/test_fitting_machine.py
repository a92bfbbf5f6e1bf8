"""One oscillator for many trains of instants."""

from __future__ import annotations

import math
from dataclasses import replace
from decimal import Decimal

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from matplotlib import pyplot
from scipy.special import chdtri

from benchmarks import joint_fit
from impactsig import InvalidInput, fit_oscillator, measure, scenes, simulate
from impactsig.fitting import fit
from impactsig.fitting.machine import Aside, machine_of_runs
from impactsig.fitting.orbits._path import course
from impactsig.fitting.orbits._path_kernels import Chain
from impactsig.fitting.orbits.followed import Followed, Seen
from impactsig.fitting.together import _together, joint
from impactsig.fitting.trains.balance import Courses, Values, forcings
from tests.fitting import NATURAL, chaos

FREQUENCIES = (20.1, 20.3355)
JITTER = 0.01  # forcing periods
TRUTH = {"restitution": 0.2, "damping": 0.03, "amplitude": 0.25}


def theta(frequency=20.1, **changed):
    values = TRUTH | changed
    logs = (math.log(values[name]) for name in ("damping", "amplitude"))
    return np.array([values["restitution"], *logs, math.log(NATURAL / frequency), 0.0, 0.0])


def instants(frequency, seed, count=300):
    truth = chaos(frequency)[:count]
    truth = replace(truth, duration=float(truth.time[-1] - truth.start))
    seen = measure(truth, jitter=JITTER / frequency, missed=0.02, spurious=0.01, seed=seed).impacts
    return replace(seen, approach_velocity=None)


@pytest.fixture(scope="module")
def fitted():
    trains = [instants(frequency, 1) for frequency in FREQUENCIES]
    periods = [1 / frequency for frequency in FREQUENCIES]
    return fit_oscillator(
        trains, periods, ["restitution", "amplitude"], scene=scenes.karpodinis(), seed=1
    )


# -- the course through a train ----------------------------------------------------------------


def spoiled(missed=(40, 41, 90), false=((60, 0.4), (130, 1.1))):
    """Instants of the beam in forcing periods, their velocities, and which are false."""
    truth = chaos()[:200]
    x, speed = truth.time * 20.1, truth.approach_velocity
    x = x + 0.005 * np.random.default_rng(3).standard_normal(len(x))
    added = np.array([x[k] + off for k, off in false])
    kept = np.delete(np.arange(len(x)), missed)
    whole = np.concatenate((x[kept], added))
    order = np.argsort(whole)
    speed = np.concatenate((speed[kept], np.full(len(added), np.nan)))[order]
    return whole[order], speed


def test_the_likeliest_course_tells_what_is_false_and_what_was_missed():
    x, speed = spoiled()
    joined = np.ones(len(x) - 1, bool)
    path = course(theta(), "rigid", 20.1, x, joined, Chain(0.006, 0.02, 0.01), 1)
    np.testing.assert_array_equal(path.real, np.isfinite(speed))
    assert path.missed == 3
    assert path.broken == 0
    assert np.sum(~path.joined) == 2  # one leg over two missed impacts, one over one
    off = path.node[:, 1] - speed[path.real]
    assert np.abs(off).mean() < 0.03  # 0.3 on average


@pytest.mark.parametrize("jitter", [1e-2, 1e-3, 1e-4])
def test_impacts_known_better_than_a_course_resolves_are_not_taken_for_false(jitter):
    truth = chaos()[:300]
    x = truth.time * 20.1 + jitter * np.random.default_rng(3).standard_normal(len(truth))
    seen = Seen(20.1, x, np.ones(299, bool), "rigid", Chain(jitter, 0.02, 0.01))
    orbit = Followed.of(seen, theta(), 1)
    assert np.mean(~orbit.real) < 0.02
    assert orbit.led.sum() > 0.9 * 299


def test_no_course_leads_over_a_gap():
    x, _ = spoiled((), ())
    joined = np.ones(len(x) - 1, bool)
    joined[70] = False
    x = np.concatenate((x[:71], x[71:] + 50.0))
    path = course(theta(), "rigid", 20.1, x, joined, Chain(0.006, 0.02, 0.01), 1)
    assert path.broken == 0
    np.testing.assert_array_equal(path.joined, joined[path.real[1:]])


def test_an_oscillator_that_does_not_reach_the_stop_has_no_course():
    x, _ = spoiled()
    weak = theta(amplitude=0.01)
    assert (
        course(weak, "rigid", 20.1, x, np.ones(len(x) - 1, bool), Chain(0.006, 0.02, 0.01), 1)
        is None
    )


def test_an_orbit_tells_parameters_by_the_slope_of_its_loss():
    x, _ = spoiled()
    seen = Seen(20.1, x, np.ones(len(x) - 1, bool), "rigid", Chain(0.006, 0.02, 0.01))
    orbit = Followed.of(seen, theta(), 1)
    here = orbit.laid(theta())
    orbit = here.orbit
    for place, step in ((0, 1e-4), (2, 1e-5), (4, 1e-4)):
        sides = []
        for sign in (-1, 1):
            moved = theta()
            moved[place] += sign * step
            sides.append(orbit.laid(moved).loss)
        slope = (sides[1] - sides[0]) / (2 * step)
        assert slope == pytest.approx(orbit.laid(theta()).gradient[place], rel=0.02)


def test_the_forcing_is_what_balances_exact_courses():
    motion = chaos()[:200]
    x = motion.time * 20.1
    steps = np.arange(0, 190, 5)[:, None] + np.arange(5)
    instant = x[steps] - np.floor(x[steps[:, :1]])
    exact = Courses(instant, None, np.full((len(steps), 1), 1 / len(steps)))
    values = Values(np.array([0.2]), np.array([0.03]), None, 20.1 / NATURAL, None)
    off, amplitude, phase = forcings(values, exact)
    np.testing.assert_allclose(amplitude, 0.25, rtol=1e-6)
    np.testing.assert_allclose(phase, 0, atol=1e-6)
    assert off < 1e-6


# -- many trains -------------------------------------------------------------------------------


def test_two_trains_tell_what_they_share_and_their_own(fitted):
    low, high = fitted.intervals["restitution"]
    assert low < 0.2 < high
    assert high - low < 0.2
    assert fitted.free == ("restitution",)
    assert fitted.values["damping"] == 0.03
    for run, frequency in zip(fitted.runs, FREQUENCIES, strict=True):
        assert run.forcing_period == pytest.approx(1 / frequency, rel=1e-4)
        assert run.values["amplitude"] == pytest.approx(0.25, rel=0.03)
        assert run.values["restitution"] == fitted.values["restitution"]
        assert run.intervals["restitution"] == pytest.approx(fitted.intervals["restitution"])
        assert run.chain["jitter"] * frequency == pytest.approx(JITTER, rel=0.15)
        assert run.chain["missed"] == pytest.approx(0.02, abs=0.012)
        assert run.chain["spurious"] == pytest.approx(0.01, abs=0.01)
    assert not fitted.misfit
    assert "amplitudes" in fitted.describe()


def test_what_was_found_is_drawn(fitted):
    axes = fitted.plot()
    assert len(axes[0].patches) == 0  # one parameter is free: no region
    assert axes[1].get_ylabel().startswith("amplitude")
    pyplot.close("all")


def test_periodic_trains_are_left_aside_and_amplitudes_may_be_the_same():
    periodic = simulate(scenes.karpodinis(22.1), periods=300, transient=300).impacts
    trains = [instants(20.1, 3, 150), periodic, instants(20.3355, 4, 150)]
    found = fit_oscillator(
        trains, [1 / 20.1, 1 / 22.1, 1 / 20.3355], ["amplitude"], scene=scenes.karpodinis(),
        same_amplitude=True, seed=1,
    )  # fmt: skip
    assert found.periodic == (1,)
    assert any("1 periodic trains" in one for one in found.warnings)
    low, high = found.intervals["amplitude"]
    assert low < 0.25 < high
    assert {run.values["amplitude"] for run in found.runs} == {found.values["amplitude"]}


def test_runs_that_are_no_train_of_the_oscillator_are_a_misfit(fitted):
    runs = tuple(replace(run, p_value=1 / 41) for run in fitted.runs)
    found = machine_of_runs(
        runs, fitted.free, fitted.covariance, Aside((), ()), "rigid", {"rigid": 0.0}, None, 1.0
    )
    assert found.p_value == pytest.approx((1 + 2 * math.log(41)) / 41**2)  # of Fisher's two
    assert found.misfit
    assert "misfit" in found.warnings[-1]
    compared = replace(found, log_odds={"rigid": 0.0, "soft": -500.0})
    assert compared.describe().startswith("none explains the trains; likeliest rigid (log odds")
    right = replace(compared, p_value=0.5)
    assert right.describe().startswith("rigid (log odds")


def test_errors_are_those_by_which_the_trains_contradict_each_other(fitted, monkeypatch):
    assert fitted.agreement > 1e-3
    assert not any("contradict" in one for one in fitted.warnings)
    monkeypatch.setattr(_together, "CONTRADICTED", 1.0)  # as if any trains did
    monkeypatch.setattr(joint, "AGAIN", 0)
    trains = [instants(frequency, 1) for frequency in FREQUENCIES]
    periods = [1 / frequency for frequency in FREQUENCIES]
    found = fit_oscillator(
        trains, periods, ["restitution", "amplitude"], scene=scenes.karpodinis(), seed=1
    )
    squares = chdtri(1, found.agreement)  # of two trains that share one parameter
    np.testing.assert_allclose(found.covariance, squares * fitted.covariance)
    for wide, one in zip(found.runs, fitted.runs, strict=True):
        assert wide.p_value == one.p_value
        np.testing.assert_allclose(wide.covariance, squares * one.covariance)


def test_trains_that_contradict_each_other_are_told(fitted):
    given = fitted.runs, fitted.free, fitted.covariance, Aside((), ()), "rigid", {"rigid": 0.0}
    found = machine_of_runs(*given, None, 1e-9)
    assert found.agreement == 1e-9
    assert "contradict each other" in found.warnings[-1]
    assert "1e-09" in found.warnings[-1]


FULL = {"natural_frequency": NATURAL}
BAD = {
    "one": (lambda: [chaos()], [1 / 20.1], FULL, "two or more"),
    "other period": (lambda: [chaos()[:500]] * 2, [1 / 800] * 2, FULL, "all of its phases"),
    "too few": (lambda: [chaos(), chaos()[:90]], [1 / 20.1] * 2, FULL, "100 or more"),
    "one period": (lambda: [chaos(), chaos()], 1 / 20.1, FULL, "each of 2 trains"),
    "numbers": (lambda: [1.0, 2.0], [1 / 20.1] * 2, FULL, "impacts"),
    "no damping": (
        lambda: [chaos(), chaos()], [1 / 20.1] * 2,
        {"free": ["amplitude"], "scene": scenes.karpodinis(damping_ratio=0.0)}, "damping",
    ),
    "same": (lambda: [chaos(), chaos()], [1 / 20.1] * 2, FULL | {"same_amplitude": 2}, "same_am"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_named(case):
    trains, periods, options, told = BAD[case]
    with pytest.raises(InvalidInput, match=told):
        fit_oscillator(trains(), periods, **options)


def test_trains_that_keep_no_phase_are_left_aside(monkeypatch):
    seen = []

    def kept(trains, frequencies, aside, asked):
        seen[:] = [len(trains), aside]

    monkeypatch.setattr(fit, "fit_trains", kept)
    trains = [instants(20.1, 3, 150), instants(20.1, 5, 150), instants(20.3355, 4, 150)]
    fit_oscillator(trains, [1 / Decimal("20.1"), 1 / 21.7, 1 / 20.3355], **FULL)
    assert seen == [2, ((), (1,))]
    with pytest.raises(InvalidInput, match=r"forcing_period: .*all of its phases"):
        fit_oscillator(trains, [1 / 21.7] * 3, **FULL)


def test_periodic_trains_alone_are_refused():
    periodic = simulate(scenes.karpodinis(22.1), periods=300, transient=300).impacts
    with pytest.raises(InvalidInput, match="3 of them periodic"):
        fit_oscillator([periodic] * 3, [1 / 22.1] * 3, **FULL)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2000, 2004))
def test_fresh_machines_are_found(seed):
    truth, runs = joint_fit.machine(seed, "period")
    found = fit_oscillator(
        [impacts for *_, impacts in runs], [1 / frequency for frequency, *_ in runs],
        natural_frequency=NATURAL, seed=seed,
    )  # fmt: skip
    assert found.values["restitution"] == pytest.approx(truth["restitution"], abs=0.06)
    assert found.values["damping"] == pytest.approx(truth["damping"], rel=0.3)
    for run, (_, amplitude, _) in zip(found.runs, runs, strict=True):
        assert run.values["amplitude"] == pytest.approx(amplitude, rel=0.15)
