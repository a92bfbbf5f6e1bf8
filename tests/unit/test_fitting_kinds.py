"""Soft stops, second stops and echoes: their orbits, and which of them many trains tell."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks import machine_kinds
from impactsig import (
    InvalidInput,
    KelvinVoigt,
    Rigid,
    Stop,
    fit_oscillator,
    measure,
    scenes,
    simulate,
)
from impactsig.fitting._machine import PARAMETERS
from impactsig.fitting.orbits._contact_kernels import bounce, contacts
from impactsig.fitting.orbits._path_kernels import Chain
from impactsig.fitting.orbits.followed import Followed, Laid, Seen
from impactsig.fitting.orbits.orbit import machine_of
from impactsig.fitting.orbits.orbit_kernels import leg
from impactsig.fitting.searching.simulated import chained
from impactsig.fitting.together import _together, joint
from impactsig.fitting.together._like_kernels import distances
from impactsig.fitting.together._steps import (
    PHASE,
    WIDEST,
    Layout,
    covariance_of,
    disagreement,
)
from impactsig.fitting.together._together import Joint
from impactsig.fitting.together._valleys import turned_trains
from impactsig.fitting.together.joint import _without_echoes, mirrored
from impactsig.fitting.trains.echoes import _dithered, echoes, without
from impactsig.fitting.trains.partition import Train
from impactsig.simulation.batches.trains import Impacting

FREQUENCY, RESTITUTION, DAMPING, AMPLITUDE = 20.3, 0.4, 0.03, 0.3
FAR, STIFFNESS = 0.8, 30.0
STOPS = {
    "two-sided": (Stop(1.0, Rigid(RESTITUTION)), Stop(-FAR, Rigid(RESTITUTION), "lower")),
    "soft": (Stop(1.0, KelvinVoigt.equivalent(RESTITUTION, STIFFNESS)),),
}
OWN = {"two-sided": FAR, "soft": STIFFNESS}


def impacts_of(kind):
    scene = scenes.karpodinis(FREQUENCY, damping_ratio=DAMPING, amplitude=AMPLITUDE)
    impacts = simulate(replace(scene, stops=STOPS[kind]), periods=20, transient=100).impacts
    assert len(impacts) >= 15
    side = np.where(impacts.stop_index == 0, 1.0, -1.0)
    return impacts.time * FREQUENCY, impacts.approach_velocity, side


def theta_of(kind):
    logs = DAMPING, AMPLITUDE, scenes.NATURAL_FREQUENCY / FREQUENCY
    return np.array([RESTITUTION, *np.log(logs), 0.0, math.log(OWN[kind])])


def off_of(kind, theta, side, point, full=False):
    off, slopes = np.zeros((2, 5)), np.zeros((2, 7))
    leg(machine_of(theta, kind), side[0], *point[:2], side[1], *point[2:], off, slopes, full)
    return off, slopes


@pytest.mark.parametrize("kind", ["two-sided", "soft"])
def test_legs_of_a_simulation_are_not_off(kind):
    x, speed, side = impacts_of(kind)
    off = [
        off_of(kind, theta_of(kind), side[k:], (x[k], speed[k], x[k + 1], speed[k + 1]))[0][:, 4]
        for k in range(len(x) - 1)
    ]
    assert np.abs(off).max() < 1e-11
    assert kind == "soft" or set(side) == {1.0, -1.0}


@pytest.mark.parametrize("kind", ["two-sided", "soft"])
def test_slopes_of_a_leg_are_its_differences(kind):
    x, speed, side = impacts_of(kind)
    theta, step = theta_of(kind), 1e-5
    for k in range(8):
        point = np.array([x[k] + 3e-3, speed[k] + 0.02, x[k + 1] - 4e-3, speed[k + 1] + 0.01])
        whole = np.concatenate((point, theta))

        def off(whole, own=side[k:]):
            return off_of(kind, whole[4:], own, whole[:4])[0][:, 4]

        moves = step * np.eye(10)
        expected = np.array([off(whole + move) - off(whole - move) for move in moves]) / 2 / step
        found, slopes = off_of(kind, theta, side[k:], point, True)
        np.testing.assert_allclose(found[:, :4], expected[:4].T, atol=1e-6)
        np.testing.assert_allclose(slopes[:, [0, 1, 2, 3, 4, 6]], expected[4:].T, atol=1e-6)


def test_a_contact_ends_as_that_of_a_free_mass_does():
    # Against a spring 1e6 times as stiff the forcing and the mass' own spring are nothing.
    theta = np.array([0.6, math.log(0.01), math.log(1e-3), 0.0, 0.0, math.log(1e6)])
    late, away, *_ = bounce(contacts(theta)[0], 0.3, 1.0)
    share = -math.log(0.6) / math.hypot(math.pi, math.log(0.6))
    assert away == pytest.approx(-0.6, abs=2e-3)
    expected = math.pi / 1e3 / math.sqrt(1 - share**2)
    assert late * 2 * math.pi == pytest.approx(expected, rel=2e-3)


# -- echoes ------------------------------------------------------------------------------------


def train_with_echoes(share, delay=0.004, count=400, seed=0, jitter=1e-4):
    rng = np.random.default_rng(seed)
    time = np.cumsum(0.02 + 0.03 * rng.random(count))
    echo = time[rng.random(count) < share] + delay
    whole = np.concatenate((time, echo))
    order = np.argsort(whole)
    which = (np.arange(len(whole)) >= count)[order]
    whole = whole[order] + jitter * rng.standard_normal(len(whole))
    return Train(whole * FREQUENCY, None, np.ones(len(whole) - 1, bool)), which


def test_echoes_of_two_trains_are_found():
    trains, which = zip(*(train_with_echoes(0.4, seed=seed) for seed in (1, 2)), strict=True)
    found = echoes(list(trains), [FREQUENCY] * 2)
    assert found.delay == pytest.approx(0.004, abs=2e-5)
    assert found.spread == pytest.approx(1.4e-4, rel=0.2)
    assert found.share == pytest.approx(0.4, abs=0.05)
    wrong = sum(int(np.sum(one != other)) for one, other in zip(found.which, which, strict=True))
    assert wrong <= 3
    left = without(trains[0], found.which[0])
    assert len(left.x) == np.sum(~found.which[0])
    assert left.joined.all()


@pytest.mark.parametrize("jitter", [1e-5, 1e-4, 3e-4])
def test_the_spread_of_echoes_is_that_of_their_delay(jitter):
    # Of a period of 50 ms, 3e-4 is 0.6 %: the window that most agree in holds half of the echoes.
    trains = [train_with_echoes(0.4, seed=seed, jitter=jitter)[0] for seed in (1, 2, 3)]
    found = echoes(trains, [FREQUENCY] * 3)
    assert found.spread == pytest.approx(jitter * math.sqrt(2), rel=0.15)


@pytest.mark.parametrize("tick", [1e-4, 4e-4, 6e-4])
def test_echoes_are_found_on_a_coarse_clock(tick):
    """Most delays are the same number of ticks, and their median deviation was 0."""
    trains = []
    for seed in (1, 2, 3):
        train, _ = train_with_echoes(0.4, seed=seed)
        ticks = np.unique(np.round(train.x / FREQUENCY / tick))
        trains.append(Train(ticks * tick * FREQUENCY, None, np.ones(len(ticks) - 1, bool)))
    found = echoes(trains, [FREQUENCY] * 3)
    assert found.delay == pytest.approx(0.004, abs=tick / 4)
    assert found.share == pytest.approx(0.4, abs=0.06)
    seen = math.sqrt(2e-8 + tick**2 / 6)  # jitter and rounding of two instants
    assert seen < found.spread * 1.15 < 1.8 * seen


def test_only_delays_in_ticks_are_laid_out():
    rng = np.random.default_rng(8)
    late = rng.random(40)
    np.testing.assert_array_equal(_dithered(late, 1e-10), late)
    assert len(_dithered(np.empty(0), 1e-10)) == 0
    ticks = np.round(10 * rng.random(400)) / 10
    found = _dithered(ticks, 1e-10)
    assert np.abs(found - ticks).max() <= 0.05 + 1e-12
    shares = np.histogram(found - ticks, 10, (-0.05, 0.05))[0] / 400
    np.testing.assert_allclose(shares, 0.1, atol=0.01)


def test_impacts_that_chatter_are_no_echoes():
    # Most impacts are followed by another at once, more than have an echo.
    rng = np.random.default_rng(8)
    trains = []
    for seed in (1, 2):
        train, _ = train_with_echoes(0.3, seed=seed)
        close = train.x[rng.random(len(train.x)) < 0.8] + 1e-3
        x = np.sort(np.concatenate((train.x, close)))
        trains.append(Train(x, None, np.ones(len(x) - 1, bool)))
    assert echoes(trains, [FREQUENCY] * 2).delay == pytest.approx(0.004, abs=5e-5)


def test_echoes_are_simulated_and_taken_out_again():
    train = train_with_echoes(0.4, seed=1)[0]
    heard = echoes([train, train_with_echoes(0.4, seed=2)[0]], [FREQUENCY] * 2)
    rng = np.random.default_rng(3)
    x = np.cumsum(0.5 + rng.random(500))
    truth = Impacting(x, np.arange(500.0), np.array([0, 200, 200]), np.zeros(500, int))
    whole = heard.again(truth, FREQUENCY, rng)
    counts = np.diff(whole.starts, append=len(whole.x))
    assert counts[1] == 0
    assert counts[[0, 2]] / [200, 300] == pytest.approx(1 + heard.share, abs=0.1)
    for part in np.split(whole.x, whole.starts[1:]):
        assert (np.diff(part) > 0).all()
    np.testing.assert_allclose(np.setdiff1d(x, whole.x), [])
    joined = np.ones(len(whole.x) - 1, bool)
    joined[counts[0] - 1] = False
    left = heard.taken_out(Train(whole.x, None, joined, whole.starts), FREQUENCY)
    np.testing.assert_array_equal(left.x, x)
    np.testing.assert_array_equal(left.starts, truth.starts)
    assert np.flatnonzero(~left.joined).tolist() == [199]


def test_shares_of_missed_and_of_false_instants_are_those_of_all_with_their_echoes():
    missed, spurious, jitter, count = 0.04, 0.03, 1e-4 * FREQUENCY, 20_000
    every = [train_with_echoes(0.6, seed=seed)[0] for seed in (1, 2)]
    heard = echoes(every, [FREQUENCY] * 2)
    rng = np.random.default_rng(5)
    x = np.cumsum((0.02 + 0.03 * rng.random(count)) * FREQUENCY)
    truth = Impacting(x, np.ones(count), np.zeros(1, int), np.zeros(count, int))
    chain = {"missed": missed, "jitter": jitter, "spurious": spurious}
    chain |= {"strength_floor": 0.0, "strength_noise": 0.0}
    values = {name: np.array([value]) for name, value in chain.items()}
    whole = chained(heard.again(truth, FREQUENCY, rng), math.ceil(x[-1]), values, rng)
    left = heard.taken_out(whole, FREQUENCY)
    nearest = left.x[np.clip(np.searchsorted(left.x, x), 1, len(left.x) - 1) - np.array([[0], [1]])]
    hit = int(np.sum(np.abs(nearest - x).min(axis=0) < 5 * jitter))
    found = np.array([1 - hit / count, 1 - hit / len(left.x)])
    alone = Train(x, None, np.ones(count - 1, bool))
    problem = SimpleNamespace(simulate=lambda psi: alone, forcing_frequency=FREQUENCY)
    assert found[1] > 1.5 * spurious
    mended = _without_echoes(problem, heard, found)
    np.testing.assert_allclose(mended, [missed, spurious], rtol=0.15)


def test_irregular_trains_have_no_echoes():
    trains = [train_with_echoes(0.0, seed=seed)[0] for seed in (1, 2)]
    assert echoes(trains, [FREQUENCY] * 2) is None


def test_a_gap_stays_one_where_an_echo_beside_it_is_taken_out():
    joined = np.array([True, False, True, True])
    train = Train(np.arange(5.0), None, joined)
    left = without(train, np.array([False, False, True, False, False]))
    assert left.joined.tolist() == [True, False, True]


# -- where the search begins -------------------------------------------------------------------


def test_distances_of_pairs_are_those_of_all():
    rng = np.random.default_rng(4)
    seen = 0.2 * rng.random((30, 2))
    x = np.cumsum(0.2 * rng.random(60))
    ends, apart = np.array([0, 40, 44, 60]), np.empty(3)
    distances(seen, x, ends, apart)
    for k, (begin, end) in enumerate(((0, 40), (40, 44), (44, 60))):
        step = np.diff(x[begin:end])
        pairs = np.column_stack((step[:-1], step[1:]))
        square = np.minimum(np.sum((pairs[:, None] - seen[None]) ** 2, axis=2), 0.15**2)
        expected = square.min(axis=1).mean() + square.min(axis=0).mean()
        assert apart[k] == pytest.approx(expected if len(pairs) >= 10 else 2 * 0.15**2)


def test_a_machine_with_two_stops_may_be_seen_from_either():
    layout = Layout((0, 1, 5), (2, 4), 1)
    x, speed, side = impacts_of("two-sided")
    seen = Seen(FREQUENCY, x, np.ones(len(x) - 1, bool), "two-sided", Chain(1e-3, 0.02, 0.01))
    node = np.column_stack((x, speed))
    orbit = Followed(seen, np.ones(len(x), bool), side, np.ones(len(x) - 1, bool), node, 0, 0)
    root = np.random.default_rng(1).standard_normal((5, 5))
    theta = theta_of("two-sided")[None]
    joint = Joint(theta, [seen], [orbit], root @ root.T, 0.0)
    found = mirrored(layout, joint)
    assert found.theta[0, 5] == pytest.approx(-math.log(FAR))
    other = found.orbits[0]
    for k in range(len(x) - 1):
        point = np.concatenate((other.node[k], other.node[k + 1]))
        off = off_of("two-sided", found.theta[0], other.side[k:], point)[0]
        assert np.abs(off[:, 4]).max() < 1e-11
    # What both leave uncertain is the same: the amplitude by the distance between the stops.
    apart = (1 / FAR + 1) ** -1, (FAR + 1) ** -1 * FAR
    variances = [
        np.array([-share, 1]) @ one.covariance[np.ix_((2, 3), (2, 3))] @ [-share, 1]
        for one, share in ((found, apart[0] / FAR), (joint, apart[1]))
    ]
    assert variances[0] == pytest.approx(variances[1])
    assert mirrored(layout, found) is found


def test_trains_seen_from_the_wrong_stop_are_turned():
    """Impacts that alternate between two stops look alike half a forcing period later."""
    layout, thetas, trains = Layout((0, 1, 5), (2, 4), 2), [], []
    for seed, amplitude in ((1, 8.0), (2, 12.0)):
        scene = scenes.karpodinis(60.0, damping_ratio=DAMPING, amplitude=amplitude)
        scene = replace(scene, stops=STOPS["two-sided"])
        impacts = simulate(scene, periods=300, transient=200).impacts[:250]
        seen = measure(impacts, jitter=0.005 / 60, missed=0.02, spurious=0.01, seed=seed).impacts
        x, chain = (seen.time - seen.start) * 60, Chain(0.005, 0.02, 0.01)
        trains.append(Seen(60.0, x, np.ones(len(x) - 1, bool), "two-sided", chain))
        logs = np.log((DAMPING, amplitude, scenes.NATURAL_FREQUENCY / 60))
        phase = 2 * math.pi * seen.start * 60
        thetas.append([RESTITUTION, *logs, phase, math.log(FAR)])
    true = np.array(thetas)
    anywhere = np.full(true.shape, -np.inf), np.full(true.shape, np.inf)
    for wrong in ([], [1], [0, 1]):
        theta = true.copy()
        theta[wrong, PHASE] += math.pi
        rng = np.random.default_rng(1)
        found, turned = turned_trains(layout, theta, trains, anywhere, rng)
        assert turned == bool(wrong)
        off = (found - true)[:, PHASE] / (2 * math.pi)
        np.testing.assert_allclose(off, np.rint(off), atol=0.02)


def told(estimate, error, coupling=0.0, own=4e4):
    """What a train tells of a shared parameter beside one of its own, away from its estimate."""
    precision = 1 / error**2 + coupling**2 / own  # so that the error stands with its own free
    information = np.zeros((6, 6))
    information[np.ix_((0, 4), (0, 4))] = [[precision, coupling], [coupling, own]]
    return Laid(0.0, information @ [-estimate, 0, 0, 0, 0, 0], information, None, 0.01)


@pytest.mark.parametrize("coupling", [0.0, 3e3])
def test_disagreement_of_trains_is_chi_squared(coupling):
    """Of two estimates their difference by its error, squared; whatever they have in common."""
    layout = Layout((0,), (4,), 3)
    first, second = told(-0.004, 0.01, coupling), told(0.036, 0.03, coupling)
    squares, freedom = disagreement(layout, [first, None, second])
    assert freedom == 1
    assert squares == pytest.approx(0.04**2 / (0.01**2 + 0.03**2), rel=2e-3)
    same, freedom = disagreement(layout, [told(0.02, 0.01), told(0.02, 0.03), told(0.02, 0.02)])
    assert (same, freedom) == (pytest.approx(0.0, abs=1e-3), 2)
    assert disagreement(Layout((), (4,), 2), [first, second]) == (0.0, 0)


def test_errors_grow_where_trains_contradict_each_other():
    agreeing, not_agreeing = (
        Joint(np.zeros((2, 6)), [], [], np.eye(3), 0.0, squares, 2) for squares in (13.0, 14.0)
    )
    assert agreeing.agreement == pytest.approx(math.exp(-6.5))  # of two degrees of freedom
    assert (agreeing.widening, not_agreeing.widening) == (1.0, 7.0)


# -- which kind it is --------------------------------------------------------------------------


@pytest.mark.parametrize(("ahead", "given_up"), [(0.0, False), (2.1, True)])
def test_kinds_are_given_up_by_the_score_of_all_instants(monkeypatch, ahead, given_up):
    """That of the echoes, which no orbit follows, once was not counted, and the right kind went."""
    trains = [train_with_echoes(0.4, seed=seed)[0] for seed in (1, 2)]
    heard = echoes(trains, [FREQUENCY] * 2)
    apart = sum(heard.cost(k, FREQUENCY) for k in (0, 1))
    near = joint.NEAR * sum(int(np.sum(~which)) for which in heard.which)
    assert apart < -2 * near
    enough = []
    monkeypatch.setattr(joint, "simulated_like", lambda *_: [])
    monkeypatch.setattr(joint, "balanced", lambda _: [])
    monkeypatch.setattr(joint, "nearest", lambda *_: SimpleNamespace(score=500.0, theta=None))
    monkeypatch.setattr(joint, "together", lambda *given: enough.append(given[-1]))
    names = ("restitution", "damping", "amplitude")
    limits = {name: (PARAMETERS[name].low, PARAMETERS[name].high) for name in names}
    rng = {"echo": np.random.default_rng(1)}
    asked = joint.Asked(names, {"natural_frequency": 22.2}, limits, False, ("rigid", "echo"), rng)
    better = SimpleNamespace(first=500.0 + apart - ahead * near, evidence=300.0, kind="rigid")
    found = joint._candidate("echo", trains, [FREQUENCY] * 2, asked, heard, None, better)
    assert (found is not None) == given_up
    assert enough == ([] if given_up else [pytest.approx(near - apart - 300.0)])


def test_what_one_kind_draws_changes_no_other(monkeypatch):
    drawn = []

    def candidate(kind, trains, frequencies, asked, *others):
        drawn.append((kind, asked.rng[kind].random()))

    monkeypatch.setattr(joint, "_candidate", candidate)
    train = simulate(scenes.karpodinis(20.1), periods=300, transient=100).impacts
    for kinds in (("rigid", "two-sided"), ("two-sided",)):
        with pytest.raises(InvalidInput, match="one oscillator"):
            fit_oscillator([train] * 2, [1 / 20.1] * 2, natural_frequency=22.2, kinds=kinds, seed=3)
    (rigid, first), (_, both), (_, alone) = drawn
    assert rigid == "rigid"
    assert first != both == alone


@pytest.mark.slow
@pytest.mark.parametrize("seed", [12, 13, 22, 15])
def test_the_kind_of_machine_is_told(seed):
    kind, truth, runs = machine_kinds.machine(seed)
    found = fit_oscillator(
        [impacts for *_, impacts in runs[:4]], [1 / frequency for frequency, *_ in runs[:4]],
        natural_frequency=scenes.NATURAL_FREQUENCY, kinds=machine_kinds.KINDS, seed=1,
    )  # fmt: skip
    assert (found.kind, found.decided) == (kind, True)
    assert found.values["restitution"] == pytest.approx(truth["restitution"], abs=0.03)


@pytest.mark.parametrize("kinds", [(), ("rigid", "rigid"), ("hard",)])
def test_kinds_that_are_none_are_refused(kinds):
    trains = [measure(simulate(scenes.karpodinis(20.1), periods=5).impacts).impacts] * 2
    with pytest.raises(InvalidInput, match="kinds"):
        fit_oscillator(trains, [1 / 20.1] * 2, natural_frequency=22.2, kinds=kinds)


def test_one_train_tells_a_soft_stop_from_a_rigid_one_only():
    impacts = simulate(scenes.karpodinis(20.1), periods=400, transient=300).impacts
    with pytest.raises(InvalidInput, match="list of trains"):
        fit_oscillator(impacts, 1 / 20.1, natural_frequency=22.2, kinds=("rigid", "two-sided"))
    for kinds in (("rigid", "soft"), "soft"):
        with pytest.raises(InvalidInput, match="without strengths"):
            fit_oscillator(impacts, 1 / 20.1, natural_frequency=22.2, kinds=kinds, strengths=None)


@pytest.mark.parametrize(
    ("pace", "further", "rounds"), [(0.0, 0.0, 11), (0.25, 0.25, 13), (0.02, 0.0, 23)]
)
def test_rounds_go_on_while_the_parameters_drift(monkeypatch, pace, further, rounds):
    """Restitution and damping still crept along their ridge when a fixed number of rounds ended."""
    layout = Layout((0, 1), (2, 4), 2)
    done = []

    def round_(layout, theta, seen, box, seeds):
        theta = theta + pace - further * theta
        done.append(theta)
        return Joint(theta, seen, [None, None], 0.05**2 * np.eye(6), 0.0)

    monkeypatch.setattr(_together, "_round", round_)
    monkeypatch.setattr(_together, "elsewhere", lambda layout, theta, *_: theta)
    found = _together.together(
        layout, np.zeros((2, 6)), [None, None], (None, None), np.random.default_rng(1), None
    )
    assert len(done) == rounds
    np.testing.assert_allclose(found.theta, np.mean(done[-6:], axis=0))


def test_a_covariance_is_positive_whatever_orbits_far_off_say():
    layout = Layout((0, 1), (2, 4), 2)
    odd = np.diag([-50.0, 4.0, 0.0, 1e4, 0.0])  # of restitution, damping, amplitude, ...
    lost = Laid(math.inf, np.full(5, np.nan), np.full((5, 5), np.nan), None, 0.01)
    found = covariance_of(layout, [Laid(1.0, np.zeros(5), odd, None, 0.01), lost])
    size = np.linalg.eigvalsh(found)
    assert 0 < size[0] <= size[-1] <= WIDEST.max() ** 2 * (1 + 1e-9)
