"""From experiment to model: each step against a closed form or a slow twin, then fits to truth."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from matplotlib import pyplot

from impactsig import (
    Friction,
    Impacts,
    InvalidInput,
    KelvinVoigt,
    Stop,
    fit_oscillator,
    measure,
    scenes,
    simulate,
)
from impactsig.fitting import _asked, _outcome, fit
from impactsig.fitting._judging import Judgement
from impactsig.fitting._machine import PARAMETERS, as_train, parameters_of
from impactsig.fitting.orbits import orbit_kernels
from impactsig.fitting.orbits.orbit import Sight, approach, floor_of, follow, machine_of
from impactsig.fitting.orbits.orbit_kernels import Noise
from impactsig.fitting.searching.narrow import Cloud, Regression, narrow, whitening
from impactsig.fitting.searching.problem import Problem
from impactsig.fitting.trains.balance import Courses, Values, badness, courses, imbalance
from impactsig.fitting.trains.moments import Moments
from impactsig.fitting.trains.partition import Partition, Train
from tests.fitting import NATURAL, Linear, chaos, measured

TRUTH = {"restitution": 0.2, "damping": 0.03, "amplitude": 0.25}


# -- the balance of three impacts --------------------------------------------------------------


def exact_course(frequency=20.1, count=200):
    truth = chaos(frequency, count)
    x = (truth.time - truth.start) * frequency
    steps = np.arange(count - 4)[:, None] + np.arange(5)
    # The phase of the forcing at the instant that x counts from.
    phase = 2 * np.pi * ((truth.start * frequency) % 1.0)
    values = Values(0.2, 0.03, 0.25, frequency / NATURAL, phase)
    return values, x[steps], truth.approach_velocity[steps[:, 1:-1]]


def test_impacts_of_a_simulation_are_in_balance_and_their_velocities_follow():
    values, course, velocity = exact_course()
    distance, approach = imbalance(values, course)
    assert np.abs(distance).max() < 1e-9
    np.testing.assert_allclose(approach, velocity, atol=1e-8)


def test_distance_from_balance_is_the_length_of_the_least_move():
    values, course, _ = exact_course(count=60)
    step = 1e-6
    slopes = []
    for k in range(5):
        moved = course.copy()
        moved[:, k] += step * values.frequency / (2 * np.pi)  # of natural time, as the distance
        slopes.append(imbalance(values, moved)[0] / step)
    np.testing.assert_allclose(np.linalg.norm(slopes, axis=0), 1.0, atol=1e-3)


def test_the_balance_tells_the_truth_from_others():
    values, course, velocity = exact_course()
    strength = np.hstack((velocity[:, :1], velocity, velocity[:, :1])) / 0.4
    whole = Courses(course, strength, np.full((len(course), 1), 1 / len(course)))
    assert badness(values, whole) < 1e-12
    for name, other in {"restitution": 0.3, "damping": 0.04, "amplitude": 0.26}.items():
        assert badness(values._replace(**{name: other}), whole) > 1e-5
    # A stop that would have to pull costs more than any time could.
    assert badness(values._replace(phase=values.phase + math.pi), whole) > 0.05


# -- the orbit beside the impacts --------------------------------------------------------------

FREE = np.array([0, 1, 2, 4, 5])
BOX = np.array([0, -7, -5, -9, -99, -99.0]), np.array([1, -0.5, 3, 9, 99, 99.0])


def orbit_of(count, jitter=0.0, strength_noise=0.0, seed=0, **chain):
    """A sight of the beam at 20.1 Hz, and the parameters that it is of; strengths are 2 v."""
    truth = chaos(20.1, count)
    measured = measure(truth, jitter=jitter / 20.1, seed=seed, **chain)
    seen, rng = measured.impacts, np.random.default_rng(seed)
    strength = 2 * seen.approach_velocity
    strength = strength * (1 + strength_noise * rng.standard_normal(len(seen)))
    x = seen.time * 20.1
    theta = [0.2, math.log(0.03), math.log(0.25), math.log(NATURAL / 20.1), 0.0, math.log(2)]
    joined = np.ones(len(seen) - 1, bool)
    return (
        Sight(np.column_stack((x, strength, strength, np.ones(len(x)))), joined),
        np.array(theta),
        measured,
    )


def leg(theta, start, end):
    off, slopes = np.zeros((2, 5)), np.zeros((2, 7))
    orbit_kernels.leg(machine_of(theta), 1.0, *start, 1.0, *end, off, slopes, True)
    return off, slopes[:, :5]


def test_legs_of_a_simulation_are_not_off():
    sight, theta, _ = orbit_of(100)
    node = sight.seen[:, :2] / [1, 2]
    off = [leg(theta, *pair)[0][:, 4] for pair in pairwise(node)]
    assert np.abs(off).max() < 1e-7


def test_slopes_of_a_leg_are_its_differences():
    sight, theta, _ = orbit_of(12, jitter=0.02, strength_noise=0.1)
    node, step = sight.seen[:, :2] / [1, 2], 1e-6
    for start, end in pairwise(node):
        point = np.concatenate((start, end, theta))

        def off(point):
            return leg(point[4:], point[:2], point[2:4])[0][:, 4]

        moves = step * np.eye(10)[:9]
        expected = np.array([off(point + move) - off(point - move) for move in moves]) / 2 / step
        found = leg(theta, start, end)
        np.testing.assert_allclose(found[0][:, :4], expected[:4].T, atol=1e-7)
        np.testing.assert_allclose(found[1], expected[4:].T, atol=1e-7)


def residuals(point, sight, noise, slack, joined):
    """All that `smooth` makes least, in nodes and parameters; slow."""
    node, theta = point[:-6].reshape(-1, 2), point[-6:]
    spread = noise.strength * sight.seen[:, 2] / np.exp(theta[5])
    parts = [
        (sight.seen[:, 0] - node[:, 0]) / noise.instant,
        (sight.seen[:, 1] / np.exp(theta[5]) - node[:, 1]) / spread,
    ]
    for k in np.flatnonzero(joined):
        parts.append(leg(theta, node[k], node[k + 1])[0][:, 4] / slack)
    return np.concatenate(parts)


def dense(sight, theta, noise, slack, joined):
    """The slow twin: node, objective, residuals and their derivatives."""
    from scipy.optimize import least_squares

    start = (sight.seen[:, :2] / [1, np.exp(theta[5])]).ravel()

    def off(node):
        return residuals(np.concatenate((node, theta)), sight, noise, slack, joined)

    found = least_squares(off, start, xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale=0.01).x
    point, step = np.concatenate((found, theta)), 1e-6
    rows = [
        residuals(point + move, sight, noise, slack, joined)
        - residuals(point - move, sight, noise, slack, joined)
        for move in step * np.eye(len(point))
    ]
    return found.reshape(-1, 2), off(found), np.array(rows).T / 2 / step


@pytest.mark.parametrize("slack", [0.03, 0.003])
def test_smoothing_is_what_the_slow_twin_finds(slack):
    sight, theta, _ = orbit_of(9, jitter=0.01, strength_noise=0.03, seed=3)
    theta = np.add(theta, [0.02, 0.1, 0.01, 0, 0.02, 0.01])
    noise, machine, scale = Noise(0.012, 0.04), machine_of(theta), math.exp(theta[5])
    joined = sight.joined.copy()
    joined[4] = False
    node = sight.seen[:, :2] / [1, scale]
    given = (machine, scale, noise, slack, sight.seen, joined, node)
    found = orbit_kernels.smooth(*given, 30, 1e-9)
    gradient, information = orbit_kernels.project(*given)
    expected, off, slopes = dense(sight, theta, noise, slack, joined)
    np.testing.assert_allclose(node, expected, atol=1e-6)
    assert found.objective == pytest.approx(off @ off, rel=1e-6)
    # Schur's complement of the normal matrix, and what is left of each residual's variance.
    own, by = slopes[:, :-6], slopes[:, -6:]
    by[9:18, 5] = -node[:, 1] * scale / sight.seen[:, 2] / noise.strength
    hat = own @ np.linalg.solve(own.T @ own, own.T)
    np.testing.assert_allclose(information[:6, :6], by.T @ (by - hat @ by), rtol=1e-4, atol=1e-3)
    np.testing.assert_allclose(gradient[:6], by.T @ (off - hat @ off), rtol=1e-4, atol=1e-3)
    left = np.eye(len(hat)) - hat
    freedom = np.trace(left[:9, :9]), np.trace(left[9:18, 9:18])
    np.testing.assert_allclose(found.freedom, freedom, rtol=1e-4)
    share = 1 - node[:, 1] * scale / sight.seen[:, 2]
    squares = np.sum((sight.seen[:, 0] - node[:, 0]) ** 2), np.sum(share**2)
    np.testing.assert_allclose(found.squares, squares, rtol=1e-9)
    for place, k in enumerate(np.flatnonzero(joined)):
        two = slice(18 + 2 * place, 20 + 2 * place)
        release = off[two] @ np.linalg.solve(left[two, two], off[two])
        assert found.release[k] == pytest.approx(release, rel=1e-3)
    assert found.release[4] == 0


def test_release_is_by_what_the_objective_falls():
    sight, theta, _ = orbit_of(30, jitter=0.002, strength_noise=0.005, seed=1)
    noise = Noise(0.002, 0.005)
    given = machine_of(theta), math.exp(theta[5]), noise, 1e-3, sight.seen
    node = sight.seen[:, :2] / [1, 2]
    whole = orbit_kernels.smooth(*given, sight.joined, node, 30, 1e-9)
    for k in (3, 11, 20):
        joined = sight.joined.copy()
        joined[k] = False
        freed = orbit_kernels.smooth(*given, joined, node.copy(), 30, 1e-9)
        fall = whole.objective - freed.objective
        assert whole.release[k] == pytest.approx(fall, rel=0.1, abs=0.02)


def test_legs_that_an_impact_is_missing_from_are_left_out():
    sight, theta, measured = orbit_of(600, 0.016, 0.03, seed=2, missed=0.03)
    orbit = follow(theta, Noise(0.016, 0.03), sight, FREE)
    broken = np.diff(measured.source) > 1
    assert broken.sum() > 10
    assert orbit.joined[broken].sum() <= 1  # of a missed impact so weak that it hardly matters
    assert np.sum(~orbit.joined & ~broken) <= 3
    assert orbit.explained == pytest.approx(orbit.joined.mean())
    assert orbit.noise.instant == pytest.approx(0.016, rel=0.1)
    assert orbit.noise.strength == pytest.approx(0.03, rel=0.1)


def test_a_false_impact_costs_its_two_legs():
    sight, theta, _ = orbit_of(200, 0.005, 0.02, seed=2)
    false = 0.4 * sight.seen[99] + 0.6 * sight.seen[100]
    seen = np.insert(sight.seen, 100, false, axis=0)
    orbit = follow(theta, Noise(0.005, 0.02), Sight(seen, np.ones(200, bool)), FREE)
    assert np.flatnonzero(~orbit.joined).tolist() == [99, 100]


@pytest.mark.parametrize("floor", [0.05, 0.4, 3.2])
def test_the_floor_of_the_noise_is_found(floor):
    sight, theta, _ = orbit_of(800, 0.016)
    strength = sight.seen[:, 1] / sight.seen[:, 1].mean()
    theta[5] -= math.log(sight.seen[:, 1].mean())
    size = np.hypot(strength, floor if floor > 0.05 else 0)
    noise = 0.03 / np.hypot(1, floor)
    strength = strength + noise * size * np.random.default_rng(1).standard_normal(800)
    seen = (sight.seen[:, 0], strength, strength, np.ones(800))
    sight = Sight(np.column_stack(seen), sight.joined)
    orbit = follow(theta, Noise(0.016, 0.03), sight, FREE)
    found = floor_of(orbit, sight, math.exp(theta[5]))
    assert floor / 2 <= found <= 2 * floor


def test_the_loss_tells_an_orbit_from_none():
    sight, theta, _ = orbit_of(300, 0.016, 0.03)
    noise = Noise(0.016, 0.03)
    order = np.random.default_rng(0).permutation(299)
    x = np.concatenate(([0], np.cumsum(np.diff(sight.seen[:, 0])[order])))
    mixed = np.column_stack((x, *sight.seen[:, 1:].T))
    lost = follow(theta, noise, Sight(mixed, sight.joined), FREE).loss
    assert lost > follow(theta, noise, sight, FREE).loss + 200


def test_the_orbit_finds_the_parameters_and_how_uncertain_they_are():
    scaled, deviations = [], []
    for seed in range(10):
        sight, theta, _ = orbit_of(800, 0.016, 0.03, seed, missed=0.02)
        begin = np.add(theta, [0.15, -0.7, -0.04, 0, 0.3, 0.1])
        found = approach(begin, Noise(0.01, 0.05), sight, FREE, BOX)
        deviation = np.sqrt(np.diag(np.linalg.inv(found.orbit.information)))
        scaled.append((found.theta - theta)[FREE] / deviation)
        deviations.append(deviation[:3])
        assert found.noise.strength == pytest.approx(0.03, rel=0.1)
    assert np.all(np.array(deviations) < [0.03, 0.04, 0.006])
    assert 0.7 < np.sqrt(np.mean(np.square(scaled))) < 1.35
    assert np.abs(np.mean(scaled, axis=0)).max() < 1.2


# -- words and moments -------------------------------------------------------------------------


def symbolic(symbols, seed=0):
    """A train whose intervals are whole periods but for a little jitter, at phase 0.3."""
    rng = np.random.default_rng(seed)
    x = (
        0.3
        + np.concatenate(([0], np.cumsum(symbols)))
        + 0.005 * rng.standard_normal(1 + len(symbols))
    )
    return Train(x, None, np.ones(len(symbols), bool))


def test_words_are_counted_as_they_stand():
    symbols = np.random.default_rng(1).integers(1, 3, 400)
    train = symbolic(symbols)
    moments = Moments.of(train)
    partition = moments.partition
    assert len(partition.classes) == 2
    assert partition.length == 4
    expected = np.zeros(16)
    for k in range(397):
        expected[int("".join(str(s - 1) for s in symbols[k : k + 4]), 2)] += 1 / 397
    (found,) = moments(train)
    np.testing.assert_allclose(found[:16], expected, atol=1e-12)
    np.testing.assert_allclose(found[16:32], 0, atol=1e-12)  # about their own means
    assert found[-1] == pytest.approx(401 / (train.x[-1] - train.x[0]))


def test_false_impacts_are_sifted_out_and_missed_ones_break_words():
    symbols = np.random.default_rng(2).integers(1, 3, 400)
    clean = symbolic(symbols)
    partition = Partition.of(clean)
    false = np.sort(np.append(clean.x, [50.7, 200.8]))
    sifted = partition.sift(Train(false, None, np.ones(len(false) - 1, bool)))
    assert sifted.off == pytest.approx(2 / 403)
    assert len(partition.words(sifted).code) == 397
    at = int(np.flatnonzero((symbols[:-1] == 2) & (symbols[1:] == 2))[0]) + 1
    lost = np.delete(clean.x, at)  # leaves an interval of four periods
    sifted = partition.sift(Train(lost, None, np.ones(len(lost) - 1, bool)))
    assert (sifted.symbol < 0).sum() == 1
    assert len(partition.words(sifted).code) == 396 - min(4, at)


def test_of_many_classes_of_intervals_as_many_are_kept_as_words_can_hold():
    # Six that are equally frequent: words of one interval tell nothing of the balance of three.
    steps = np.tile([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], 20)
    partition = Partition.of(Train(np.cumsum(steps), None, np.ones(len(steps) - 1, bool)))
    assert len(partition.classes) == 5
    assert partition.length >= 2


def test_no_word_reaches_across_a_gap():
    train = symbolic(np.random.default_rng(3).integers(1, 3, 400))
    joined = train.joined.copy()
    joined[200] = False
    partition = Partition.of(train)
    words = partition.words(partition.sift(train._replace(joined=joined)))
    assert len(words.code) == 397 - 4
    assert not np.isin(np.arange(197, 201), words.first).any()


def test_moments_move_with_strengths_and_phases():
    symbols = np.random.default_rng(4).integers(1, 3, 2000)
    train = symbolic(symbols)
    strength = 1 + 0.1 * np.random.default_rng(5).random(2001)
    moments = Moments.of(train._replace(strength=strength))
    own = moments(train._replace(strength=strength))
    scaled = moments(train._replace(strength=7 * strength))
    np.testing.assert_allclose(scaled, own, atol=1e-12)  # relative to their mean
    assert np.abs(moments(train._replace(strength=strength**2)) - own).max() > 0.002
    assert np.isnan(moments(Train(train.x[:3], strength[:3], train.joined[:2]))).all()


def test_strengths_are_cut_into_fifths_of_each_class():
    symbols = np.random.default_rng(4).integers(1, 3, 2000)
    strength = np.random.default_rng(5).random(2001) + (np.append(symbols, 1) == 2)
    train = symbolic(symbols)._replace(strength=strength)
    moments = Moments.of(train)
    shares = moments(train)[0, 48:58]  # after shares, phases and strengths of 16 words
    for symbol in (1, 2):
        own = shares[5 * (symbol - 1) : 5 * symbol]
        np.testing.assert_allclose(own, np.mean(symbols == symbol) / 5, atol=1.01 / 2000)
    first = strength[:-1][symbols == 1]
    third = (first > np.quantile(first, 0.4)) & (first <= np.quantile(first, 0.6))
    later = (strength[1:][symbols == 1])[third] / strength.mean()
    assert moments.steps[2, 2] == pytest.approx(later.mean())


def test_mean_courses_keep_the_beat_and_lose_the_jitter():
    symbols = np.random.default_rng(5).integers(1, 3, 3000)
    train = symbolic(symbols)
    found = courses(train, Partition.of(train))
    assert found.instant.shape == (16, 5)
    assert found.weight.sum() == pytest.approx(1)
    beats = np.diff(found.instant, axis=1)
    assert np.abs(beats - np.rint(beats)).max() < 5 * 0.005 * math.sqrt(2 / (3000 / 16))


# -- the local fit -----------------------------------------------------------------------------


def test_whitened_moments_are_independent():
    rng = np.random.default_rng(6)
    mix = np.eye(5) + 0.3 * rng.standard_normal((5, 5))
    covariance = mix @ mix.T
    covariance = np.block([[covariance, covariance[:, :1]], [covariance[:1], covariance[:1, :1]]])
    white = whitening(covariance)  # the last is the first again
    assert white.shape == (5, 6)
    np.testing.assert_allclose(white @ covariance @ white.T, np.eye(5), atol=1e-6)


def test_estimates_scatter_as_they_say():
    scaled, sizes = [], []
    for seed in range(12):
        problem = Linear(seed)
        psi = problem.truth + problem.rng.normal(0, [0.1, 0.5, 0.03], (200, 3))
        found = narrow(problem, psi, problem.look(psi))
        deviation = np.sqrt(np.diag(found.covariance))
        scaled.append((found.psi - problem.truth) / deviation)
        sizes.append(deviation)
    best = np.sqrt(np.diag(np.linalg.inv(problem.slopes.T @ problem.slopes)))
    assert 0.75 < np.sqrt(np.mean(np.square(scaled))) < 1.3
    assert np.all(np.median(sizes, axis=0) < 1.25 * best)  # and hardly more than they must


def test_a_regression_leaves_out_trains_of_another_kind():
    problem = Linear(0)
    cloud = Cloud(problem.truth, np.diag([0.05, 0.3, 0.02]), 2)
    psi, y = cloud.draw(200, problem, problem.look)
    clean = Regression.of(cloud, psi, y)
    y[::20] = 40.0
    y[1] = np.nan
    found = Regression.of(cloud, psi, y)
    assert found.trains <= 189
    assert np.abs(found.slopes - clean.slopes).max() < 0.6


# -- the whole ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def fitted():
    return fit_oscillator(
        measured(chaos(count=500), 1), 1 / 20.1, natural_frequency=NATURAL, seed=1
    )


def test_a_fit_finds_the_truth_within_its_intervals(fitted):
    for name, true in TRUTH.items():
        low, high = fitted.intervals[name]
        reach = 1.5 * (high - low)  # three times the half: this is one draw
        assert abs(fitted.values[name] - true) < reach, name
        assert low < fitted.values[name] < high
    assert fitted.values["damping"] == pytest.approx(0.03, rel=0.1)
    assert fitted.values["amplitude"] == pytest.approx(0.25, rel=0.02)
    assert fitted.warnings == ()
    assert fitted.p_value > 0.03
    assert fitted.strengths == "impulse"
    assert fitted.explained == pytest.approx(0.98, abs=0.02)
    assert fitted.intervals["restitution"][1] - fitted.intervals["restitution"][0] < 0.1


def test_a_fit_finds_what_the_measuring_chain_did(fitted):
    assert fitted.chain["jitter"] == pytest.approx(0.01 * chaos().intervals().mean(), rel=0.15)
    assert fitted.chain["strength_noise"] == pytest.approx(0.03, rel=0.15)
    assert fitted.chain["strength_floor"] == 0
    assert fitted.chain["missed"] == pytest.approx(0.02, abs=0.015)
    assert fitted.chain["spurious"] == pytest.approx(0.01, abs=0.01)
    assert 1 / fitted.forcing_period == pytest.approx(20.1, rel=1e-5)


def test_a_fit_can_be_simulated_described_and_drawn(fitted):
    motion = simulate(fitted.oscillator, periods=300, transient=100)
    rate = len(motion.impacts) / 300
    assert rate == pytest.approx(len(chaos()) / (chaos().duration * 20.1), abs=0.1)
    words = str(fitted)
    assert "restitution 0." in words
    assert "95 % interval" in words
    assert "missed" in words
    assert "one orbit follows 9" in words
    panels = fitted.plot()
    assert panels.shape == (2, 2)
    assert panels[1, 1].get_xlabel() == "restitution"
    assert fitted.comparison.a.impacts is fitted.measured
    assert fitted.comparison.b.impacts is fitted.simulated
    assert fitted.comparison.interval.wasserstein < 0.1 * fitted.measured.intervals().mean()
    untold = dict.fromkeys(fitted.free, (-math.inf, math.inf))
    unsure = replace(fitted, intervals=untold, warnings=("why",))
    assert "not determined" in str(unsure)
    assert unsure.plot()[1, 1].texts[0].get_text() == "why"
    pyplot.close("all")


@pytest.mark.slow
def test_one_parameter_is_found_from_instants_alone():
    train = replace(measured(chaos(count=400), 2), impulse=None)
    scene = scenes.karpodinis(20.1)
    found = fit_oscillator(train, 1 / 20.1, ("restitution",), scene=scene, seed=2)
    low, high = found.intervals["restitution"]
    assert abs(found.values["restitution"] - 0.2) < 1.5 * (high - low)
    assert high - low < 0.12
    assert found.values["damping"] == pytest.approx(0.03)
    assert found.strengths is None
    assert "strength_noise" not in found.chain
    assert found.explained is None
    assert found.plot()[1, 1].get_xlabel() == "restitution"
    pyplot.close("all")


@pytest.mark.slow
def test_jitter_that_hides_a_period_does_not_make_it_a_measurement(monkeypatch):
    """`identify_period` sees this one, and it is refused; what it does not see the fit must."""
    truth = simulate(scenes.karpodinis(20.1, restitution=0.4), periods=2500, transient=300).impacts
    train = measured(truth, 1)
    with pytest.raises(InvalidInput, match=r"period\(1,3\)"):
        fit_oscillator(train, 1 / 20.1, natural_frequency=NATURAL)
    monkeypatch.setattr(fit, "refuse_periodic", lambda *_: None)
    found = fit_oscillator(train, 1 / 20.1, natural_frequency=NATURAL)
    assert found.warnings
    assert not any(math.isfinite(low) for low, _ in found.intervals.values())


# -- what cannot be fitted ---------------------------------------------------------------------


def test_what_a_motion_cannot_tell_has_no_interval():
    covariance = np.diag([0.3**2, 0.02**2])
    problem = SimpleNamespace(names=("restitution", "damping"), kind=fit.__dict__.get)
    problem.kind = PARAMETERS.__getitem__
    told = _outcome.intervals_of(problem, np.array([0.5, math.log(0.03)]), covariance)
    assert told["restitution"] == (-math.inf, math.inf)
    low, high = told["damping"]
    assert (low * high) ** 0.5 == pytest.approx(0.03)
    assert math.log(high / low) == pytest.approx(2 * 1.959964 * 0.02)


def test_warnings_say_what_is_not_told():
    alike, unlike = Judgement(1.0, 0.5, np.empty(0), 0), Judgement(9.0, 1 / 41, np.empty(0), 3)
    assert _outcome.warnings_of((), False, True, alike) == ()
    (why,) = _outcome.warnings_of(("damping",), False, True, alike)
    assert why.startswith("these impacts do not tell the damping: ")
    (why,) = _outcome.warnings_of((), False, False, alike)
    assert "do not tell a soft stop from a rigid one" in why
    assert "moves periodically" in _outcome.warnings_of(("damping",), True, True, alike)[0]
    assert "3 of 40 simulated trains" in _outcome.warnings_of(("damping",), False, True, unlike)[1]
    assert "does not explain" in _outcome.warnings_of((), False, False, unlike)[-1]


def test_where_one_parameter_is_not_told_the_others_have_no_interval(monkeypatch):
    """They make up for it: of soft stops the damping found was 0.001, the restitution 0.2 off."""
    psi = np.array([0.5, math.log(1.4e-3), math.log(0.7), math.log(0.01), 0.02, 0.01])
    covariance = np.diag([0.01, 3.0, 0.01, 0.01, 0.01, 0.01]) ** 2

    def estimate(problem):
        problem.beginnings = None
        return fit.Estimate(psi, covariance)

    monkeypatch.setattr(fit, "_estimate", estimate)
    monkeypatch.setattr(fit, "judged", lambda *_: Judgement(1.0, 0.5, np.empty((3, 0)), 0))
    monkeypatch.setattr(_outcome, "settles", lambda _: False)
    train = chaos(count=250)
    monkeypatch.setattr(
        Problem,
        "simulate",
        lambda problem, _: problem.train._replace(
            x=problem.train.x[:200], joined=problem.train.joined[:199]
        ),
    )
    found = fit_oscillator(train, 1 / 20.1, scene=scenes.karpodinis(20.1), strengths=None)
    assert set(found.intervals.values()) == {(-math.inf, math.inf)}
    assert "do not tell the damping: another value" in found.warnings[0]
    assert math.isfinite(found.chain_intervals["missed"][0])
    covariance[1, 1] = 0.1**2
    told = fit_oscillator(train, 1 / 20.1, scene=scenes.karpodinis(20.1), strengths=None)
    assert all(math.isfinite(low) for low, _ in told.intervals.values())


def test_a_periodic_optimum_is_known_for_one():
    assert _outcome.settles(scenes.karpodinis(22.1))
    assert not _outcome.settles(scenes.karpodinis(20.1))


def test_the_frequency_is_refined_on_the_phases():
    train = chaos()
    assert _asked.refined(train, 20.1 * 1.0015) == pytest.approx(20.1, rel=2e-6)
    rng = np.random.default_rng(0)
    noise = Impacts.from_times(np.cumsum(rng.exponential(0.08, 500)))
    assert _asked.refined(noise, 20.1) == 20.1


@pytest.mark.parametrize("side", ["upper", "lower"])
def test_the_parameters_of_a_scene_do_not_depend_on_its_units(side):
    scene = scenes.karpodinis(20.1, damping_ratio=0.04, amplitude=0.3, restitution=0.35)
    if side == "lower":
        scene = replace(scene, stops=(Stop(-1.0, scene.stops[0].law, "lower"),))
    scaled = replace(scene, length_unit=2e-3, mass_unit=0.7).in_units()
    for one in (scene, scaled):
        found = parameters_of(one)
        expected = {"restitution": 0.35, "damping": 0.04, "amplitude": 0.3}
        assert found == pytest.approx(expected | {"natural_frequency": NATURAL})


def periodic():
    return measure(simulate(scenes.karpodinis(22.1), periods=400, transient=200).impacts,
                   jitter=2e-4, seed=0).impacts  # fmt: skip


FULL = {"natural_frequency": NATURAL}
BAD = {
    "no impacts": (lambda: [1.0, 2.0], 1 / 20.1, FULL, "impacts"),
    "too few": (lambda: chaos()[:150], 1 / 20.1, FULL, "200 or more"),
    "periodic": (periodic, 1 / 22.1, FULL, r"period\(1,1\)"),
    "no period": (chaos, -1.0, FULL, "forcing_period"),
    "no natural frequency": (chaos, 1 / 20.1, {}, "natural_frequency"),
    "unknown parameter": (chaos, 1 / 20.1, {**FULL, "free": ("mass",)}, "free"),
    "a parameter twice": (chaos, 1 / 20.1, {**FULL, "free": ("damping", "damping")}, "free"),
    "a frequency": (chaos, 20.1, FULL, "1 / frequency"),
    "nothing free": (chaos, 1 / 20.1, {**FULL, "free": ()}, "free"),
    "one that is not known": (chaos, 1 / 20.1, {**FULL, "free": ("damping",)}, "restitution among"),
    "a bound of none": (chaos, 1 / 20.1, {**FULL, "bounds": {"mass": (0, 1)}}, "bounds"),
    "bounds in disorder": (chaos, 1 / 20.1, {**FULL, "bounds": {"damping": (0.1, 0.01)}}, "bounds"),
    "no such strength": (chaos, 1 / 20.1, {**FULL, "strengths": "loudness"}, "strengths"),
    "strength not measured": (chaos, 1 / 20.1, {**FULL, "strengths": "peak"}, "measured peak"),
    "strengths all alike": (
        lambda: replace(chaos(), peak=np.ones(len(chaos()))), 1 / 20.1,
        {**FULL, "strengths": "peak"}, "strengths=None",
    ),
    "no strengths to speak of": (
        lambda: replace(chaos(), impulse=np.zeros(len(chaos()))), 1 / 20.1, FULL, "differ",
    ),
    "no scene": (chaos, 1 / 20.1, {"scene": "beam"}, "scene"),
    "a soft stop": (
        chaos, 1 / 20.1,
        {"scene": replace(scenes.karpodinis(), stops=(Stop(1.0, KelvinVoigt(1e3, 1.0)),))},
        "rigid stop",
    ),
    "friction": (
        chaos, 1 / 20.1, {"scene": replace(scenes.karpodinis(), friction=Friction(0.1))}, "scene",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD, ids=list(BAD))
def test_bad_input_is_named(case):
    impacts, period, options, told = BAD[case]
    with pytest.raises(InvalidInput, match=told):
        fit_oscillator(impacts(), period, **options)


def test_inferred_impacts_do_not_count():
    train = chaos()
    flags = np.zeros(len(train), np.uint8)
    flags[150:] = 16
    with pytest.raises(InvalidInput, match="150 impacts"):
        fit_oscillator(replace(train, flags=flags), 1 / 20.1, **FULL)


def test_as_train_counts_in_periods():
    train = Impacts.from_times([1.0, 1.5, 3.0], gaps=[(1.6, 2.0)])
    found = as_train(train, 4.0, None)
    np.testing.assert_allclose(found.x, [0, 2, 8])
    assert found.joined.tolist() == [True, False]
