"""Ensembles: reproducible to the bit, honest about their errors, and what they refuse."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import impactsig
from impactsig import (
    BaseMotion,
    Force,
    Friction,
    Hertz,
    InvalidInput,
    KelvinVoigt,
    Noise,
    Oscillator,
    Rigid,
    Stop,
    scenes,
    simulate,
    simulate_ensemble,
)
from impactsig.stochastic import noisy_motion
from impactsig.stochastic.noisy_motion import move
from impactsig.stochastic.paths.running import Mover, key_of
from tests import naive_stochastic

SCENE = scenes.van_der_pol_duffing()
LINEAR = Oscillator(
    damping=0.5, stops=(Stop(0.0, Rigid(0.8), "lower"),), noise=Noise(0.5), name="linear"
)
METHODS = ("splitting", "runge-kutta", "zhuravlev", "gaussian")


def everything(ensemble):
    """All numbers of a result."""
    found = []
    for value in vars(ensemble).values():
        inner = vars(value).values() if hasattr(value, "edges") or hasattr(value, "x_edges") else ()
        for one in (value, *inner):
            if isinstance(one, (float, int, np.ndarray)):
                found.append(np.atleast_1d(one).astype(float).ravel())
    return np.concatenate(found)


@pytest.mark.parametrize("method", METHODS)
def test_same_bits_whatever_the_threads(method):
    options = {"paths": 37, "duration": 30.0, "transient": 3.0, "seed": 5, "method": method}
    one = everything(simulate_ensemble(LINEAR, workers=1, **options))
    assert len(one) > 500
    for workers in (2, 3):
        other = everything(simulate_ensemble(LINEAR, workers=workers, **options))
        np.testing.assert_array_equal(one, other)
    assert np.any(one != everything(simulate_ensemble(LINEAR, **options | {"seed": 6})))


@pytest.mark.parametrize("method", METHODS)
def test_a_sample_path_is_that_of_the_ensemble(method):
    options = {
        "duration": 20.0, "transient": 3.2, "seed": 5, "method": method, "every": 0.4,
        "initial": (1.0, 0.0),
    }  # fmt: skip
    ensemble = simulate_ensemble(LINEAR, paths=11, **options)
    paths = [simulate(LINEAR, path=k, **options) for k in range(11)]
    means = [path.x.mean() for path in paths]
    assert len(set(means)) == 11
    assert math.isclose(np.mean(means), ensemble.displacement.mean, rel_tol=1e-13)
    spread = math.sqrt(np.mean([np.mean(path.v**2) for path in paths]) - ensemble.velocity.mean**2)
    assert math.isclose(spread, ensemble.velocity.sd, rel_tol=1e-12)
    # What is counted, and in which cells.
    x = np.concatenate([path.x for path in paths])
    counts, _ = np.histogram(x, ensemble.displacement.edges)
    width = np.diff(ensemble.displacement.edges)
    np.testing.assert_allclose(ensemble.displacement.density * width * len(x), counts, atol=1.01)
    # Looked at as often, the path is the same; so it is looked at from the start on.
    finer = simulate(LINEAR, path=3, **options | {"every": 0.2, "step": paths[3].step})
    assert math.isclose(finer.step, paths[3].step)
    np.testing.assert_array_equal(finer.x[1::2], paths[3].x)
    whole = simulate(LINEAR, path=3, **options | {"transient": 0.0, "duration": 23.2})
    np.testing.assert_array_equal(whole.x[-50:], paths[3].x)
    later = whole.impacts.time > paths[3].impacts.start
    np.testing.assert_array_equal(whole.impacts.time[later], paths[3].impacts.time)


@pytest.mark.parametrize(("friction", "restitution"), [(0.0, 0.9), (0.3, 0.5)])
def test_the_splitting_is_its_twin(friction, restitution):
    def law(t, x, v):
        return 0.9 * math.cos(2 * t) - x * x * x - 0.8 - 0.05 * v * abs(v)

    machine = Oscillator(
        stiffness=0.0,
        friction=Friction(friction) if friction else None,
        stops=(Stop(0.0, Rigid(restitution), "lower"),),
        law=law,
        noise=Noise(0.08),
    )
    h, steps = 0.05, 640
    found = simulate(machine, duration=steps * h, step=h, seed=2, path=9, initial=(0.3, -0.5))
    key = key_of(2)
    z = np.concatenate([naive_stochastic.normals(key, 9, block) for block in range(steps // 64)])
    tossed = [coin for k in range(steps // 64) for coin in naive_stochastic.coins(key, 9, k)]
    deviation = math.sqrt(2 * 0.08 * h)
    expected = naive_stochastic.split(
        law, deviation, z, tossed, restitution, friction, 0.3, -0.5, h, key_of(2), 9
    )
    assert len(found.impacts) > 10
    # Roundings grow: the motion is chaotic under the force.
    np.testing.assert_allclose(np.column_stack([found.x, found.v])[:200], expected[:200], atol=1e-9)


def test_cells_moments_and_bands_are_those_of_the_paths():
    options = {"duration": 40.0, "transient": 10.0, "seed": 3, "step": 0.1, "every": 0.2}
    found = simulate_ensemble(LINEAR, paths=24, bins=32, **options)
    paths = [simulate(LINEAR, path=k, **options) for k in range(24)]
    energy = np.array([(path.x**2 + path.v**2) / 2 for path in paths])
    share = np.array([np.histogram(each, found.energy.edges)[0] for each in energy]) / 200
    width = found.energy.edges[1]
    np.testing.assert_allclose(found.energy.density * width, share.mean(axis=0), atol=1e-12)
    error = share.std(axis=0, ddof=1) / math.sqrt(24)
    np.testing.assert_allclose(found.energy.standard_error * width, error, atol=1e-10)
    joint = sum(
        np.histogram2d(path.v, path.x, (found.joint.v_edges, found.joint.x_edges))[0]
        for path in paths
    )
    area = np.diff(found.joint.x_edges)[0] * np.diff(found.joint.v_edges)[0]
    np.testing.assert_allclose(found.joint.density * area * 4800, joint, atol=1e-6)
    assert math.isclose(found.energy.mean, energy.mean(), rel_tol=1e-12)
    assert math.isclose(found.energy.sd, energy.std(), rel_tol=1e-12)
    mean_error = energy.mean(axis=1).std(ddof=1) / math.sqrt(24)
    assert math.isclose(found.energy.mean_error, mean_error, rel_tol=1e-10)
    assert math.isclose(found.effective_size, energy.var() / mean_error**2, rel_tol=1e-9)
    inside = found.energy.density.sum() * width
    assert math.isclose(inside + found.energy.outside, 1, rel_tol=1e-12)
    slices = energy.reshape(24, 200)
    sizes = np.bincount(np.arange(200) * 32 // 200)
    first = slices[:, : sizes[0]].mean()
    assert math.isclose(found.mean_energy[0], first, rel_tol=1e-10)
    counted = np.mean([len(simulate(LINEAR, path=k, **options | {"transient": 0.0, "duration":
                       50.0}).impacts) for k in range(24)]) / 50  # fmt: skip
    assert math.isclose(found.impact_rate, counted, rel_tol=1e-9)


def test_bands_hold_what_they_should():
    """Of 200 small ensembles of a known density 95 % hold it, and so do those of the mean."""
    held, means = [], []
    free = Oscillator(damping=1.0, noise=Noise(1.0))  # velocity is normal, of variance 1
    options = {"paths": 8, "duration": 30.0, "transient": 8.0, "bins": 16, "workers": 1}
    for seed in range(120):
        velocity = simulate_ensemble(
            free, seed=seed, velocity_range=(-2.0, 2.0), method="gaussian", step=0.5, every=0.5,
            **options,
        ).velocity  # fmt: skip
        edges = velocity.edges
        exact = np.diff([math.erf(edge / math.sqrt(2)) / 2 for edge in edges]) / np.diff(edges)
        held.append((velocity.low <= exact) & (exact <= velocity.high))
        means.append(abs(velocity.mean) < 2.365 * velocity.mean_error)  # t of 7 degrees, 95 %
    assert 0.92 < np.mean(held) < 0.975
    assert 0.88 < np.mean(means) <= 0.99


def test_energy_counts_load_law_and_soft_stops():
    def law(t, x, v):
        return -4 * x**3 + 0.7 * v + t

    machine = Oscillator(
        mass=2.0, stiffness=3.0, load=0.5, law=law, noise=Noise(0.0),
        stops=(Stop(0.2, KelvinVoigt(50.0, 1.0)), Stop(0.5, Hertz(80.0)),
               Stop(-0.3, KelvinVoigt(20.0), "lower")),
    )  # fmt: skip
    for x, v in ((0.0, 1.0), (0.7, -0.4), (-0.9, 0.3), (3.0, 0.0)):
        found = simulate_ensemble(
            machine, paths=2, duration=1e-6, step=1e-8, every=1e-8, initial=(x, v), seed=1
        )
        expected = v * v + 1.5 * x * x - 0.5 * x + x**4
        expected += 25 * max(x - 0.2, 0) ** 2 + 32 * max(x - 0.5, 0) ** 2.5
        expected += 10 * max(-0.3 - x, 0) ** 2
        assert math.isclose(found.energy.mean, expected, rel_tol=2e-5), (x, v)


def test_times_are_in_seconds_whatever_the_units():
    fast = replace(LINEAR, time_unit=1e-3)
    slow = simulate_ensemble(LINEAR, paths=9, duration=50.0, seed=1)
    quick = simulate_ensemble(fast, paths=9, duration=0.05, seed=1)
    assert math.isclose(quick.step * 1000, slow.step)
    np.testing.assert_array_equal(quick.energy.density, slow.energy.density)
    assert math.isclose(quick.impact_rate, 1000 * slow.impact_rate)
    assert math.isclose(1000 * quick.correlation_time, slow.correlation_time)


@pytest.mark.parametrize("method", METHODS)
def test_without_noise_it_moves_as_simulate_does(method):
    machine = Oscillator(
        damping=0.06, forces=(Force(0.25, 0.9), Force(0.1, 2.3, 0.4)), load=0.1,
        base=BaseMotion(0.05, 1.7, 0.3, stops=True), stops=(Stop(0.7, Rigid(0.7)),),
    )  # fmt: skip
    options = {"periods": 6, "transient": 2, "initial": (0.2, 0.4), "phase": 1.1}
    truth = simulate(machine, **options)
    assert truth.impact_count >= 3
    errors = []
    for step in (0.02, 0.01):
        path = move(replace(machine, noise=Noise(0.0)), method=method, step=step, **options)
        within = path.time < truth.start + truth.duration
        time, found = path.time[within], np.array([path.x, path.v])[:, within]
        # At an instant between an impact and its place in the path the velocity differs.
        near = np.abs(time[:, None] - truth.impacts.time).min(axis=1) < 0.02
        assert len(path.impacts) == truth.impact_count
        errors.append(np.abs(found - truth.sample(time))[:, ~near].max())
    assert errors[0] < (1e-5 if method == "gaussian" else 1e-2)
    if method != "gaussian":
        # Order 2, but for drag, which an impact turns amid a step.
        assert errors[0] / errors[1] > (1.5 if method == "splitting" else 2.5)


def test_friction_under_filtered_noise_holds_the_mass():
    machine = Oscillator(
        damping=0.1, friction=Friction(1.0, 1.5), noise=Noise(0.05, 2.0), stiffness=1.0
    )
    path = simulate(machine, duration=200.0, seed=1, initial=(0.5, 0.0))
    assert np.all(path.x == 0.5)
    path = simulate(replace(machine, noise=Noise(4.0, 2.0)), duration=200.0, seed=1)
    held = np.mean(path.v == 0)
    assert 0.05 < held < 0.95


def test_a_law_that_feeds_energy_in_ends_diverged():
    # Of this oscillator only paths beyond a barrier run away.
    runaway = Oscillator(damping=1.0, law=lambda t, x, v: x**3, noise=Noise(0.3), stiffness=1.0)
    starts = np.zeros((40, 2))
    starts[8:20] = 3.0, 0.0
    found = simulate_ensemble(runaway, paths=40, duration=3.0, initial=starts, seed=1)
    assert found.status == "diverged"
    assert 12 <= found.failed < 40
    assert found.paths + found.failed == 40
    assert np.isfinite(found.energy.mean)
    path = simulate(runaway, duration=3.0, initial=(0.9, 0.0), step=0.05, seed=4, path=2)
    assert path.status in ("complete", "diverged")
    with pytest.raises(InvalidInput, match="finite"):
        simulate_ensemble(runaway, paths=8, duration=5.0, initial=(3.0, 0.0))


def test_the_default_step_is_a_fifth_of_the_fastest_scale():
    stiff = KelvinVoigt(1e4, 3.0)
    cases = {
        Oscillator(stiffness=9.0, noise=Noise(1.0)): 1 / 3,
        Oscillator(noise=Noise(1.0), stops=(Stop(0.0, stiff),)): 1 / math.sqrt(1e4 + 1),
        Oscillator(noise=Noise(1.0, 0.01)): 0.01,
        Oscillator(noise=Noise(1.0), forces=(Force(1.0, 50.0),), damping=0.1): 1 / 50,
    }
    for machine, scale in cases.items():
        found = simulate_ensemble(machine, paths=2, duration=20.0, seed=1)
        assert 0.17 * scale < found.step <= 0.2 * scale * (1 + 1e-9)
        with pytest.raises(InvalidInput, match="time scale"):
            simulate_ensemble(machine, paths=2, duration=20.0, seed=1, step=1.01 * scale)
        simulate_ensemble(machine, paths=2, duration=20.0, seed=1, step=0.99 * scale)


@pytest.mark.parametrize(
    ("machine", "whose"),
    [
        (Oscillator(stiffness=9.0, noise=Noise(1.0)), "natural oscillation"),
        (Oscillator(noise=Noise(1.0), damping=30.0), "damping"),
        (
            Oscillator(noise=Noise(1.0), stops=(Stop(0.2, KelvinVoigt(1e4)),)),
            "contact with the stop at 0.2",
        ),
        (Oscillator(noise=Noise(1.0), stops=(Stop(0.2, Hertz(1e5)),)), "contact with the stop"),
        (
            Oscillator(noise=Noise(1.0), forces=(Force(1.0, 50.0),)),
            "forcing at angular frequency 50",
        ),
        (Oscillator(noise=Noise(1.0), base=BaseMotion(1.0, 50.0)), "motion of the base"),
        (Oscillator(noise=Noise(1.0, 0.01)), "filtered noise"),
        (SCENE, "law, by x"),
    ],
)
def test_a_step_beyond_the_fastest_scale_is_refused_with_its_name(machine, whose):
    with pytest.raises(InvalidInput, match=whose) as caught:
        simulate_ensemble(machine, paths=2, duration=300.0, step=3.0)
    assert caught.value.argument == "step"


@pytest.mark.parametrize(
    ("wrong", "argument"),
    [
        ({"paths": 1}, "paths"),
        ({"paths": 2.5}, "paths"),
        ({"duration": None}, "periods, duration"),
        ({"periods": 3}, "periods, duration"),
        ({"duration": -1.0}, "duration"),
        ({"transient": -1.0}, "transient"),
        ({"initial": (0.0,)}, "initial"),
        ({"initial": np.zeros((3, 2))}, "initial"),
        ({"initial": (-1.0, 0.0)}, "initial"),
        ({"phase": math.nan}, "phase"),
        ({"seed": -1}, "seed"),
        ({"method": "euler"}, "method"),
        ({"step": 0.0}, "step"),
        ({"every": 0.0}, "every"),
        ({"every": 300.0}, "every"),
        ({"bins": 4}, "bins"),
        ({"energy_range": (1.0, 1.0)}, "energy_range"),
        ({"displacement_range": "wide"}, "displacement_range"),
        ({"velocity_range": (0.0, math.inf)}, "velocity_range"),
        ({"workers": 0}, "workers"),
    ],
)
def test_bad_arguments_are_named(wrong, argument):
    with pytest.raises(InvalidInput) as caught:
        simulate_ensemble(LINEAR, **{"paths": 4, "duration": 10.0} | wrong)
    assert caught.value.argument == argument


def test_methods_refuse_what_they_cannot_move():
    soft = replace(LINEAR, stops=(Stop(0.0, KelvinVoigt(10.0), "lower"),))
    cases = [
        ("gaussian", SCENE, "law and friction"),
        ("gaussian", soft, "soft stops"),
        ("gaussian", replace(LINEAR, noise=Noise(1.0, 1.0)), "filtered noise"),
        ("zhuravlev", soft, "one rigid stop"),
        ("runge-kutta", replace(SCENE, noise=Noise(1.0, 1.0)), "filtered"),
    ]
    for method, machine, why in cases:
        with pytest.raises(InvalidInput, match=why) as caught:
            simulate_ensemble(machine, paths=2, duration=10.0, method=method)
        assert caught.value.argument == "method"
    with pytest.raises(InvalidInput, match="noise"):
        simulate_ensemble(replace(LINEAR, noise=None), paths=2, duration=10.0)
    with pytest.raises(InvalidInput, match="forcing"):
        simulate_ensemble(LINEAR, paths=2, periods=10.0)
    with pytest.raises(InvalidInput, match="Oscillator"):
        simulate("beam", duration=1.0)
    with pytest.raises(InvalidInput, match="path"):
        simulate(LINEAR, path=-1, duration=1.0)


def test_what_is_not_random_refuses_noise_and_says_where_to_go():
    noisy = replace(scenes.karpodinis(), noise=Noise(1e-3))
    for function in (
        lambda: impactsig.simulate_many(noisy, periods=1),
        lambda: impactsig.simulate_blocks(noisy, periods=1),
        lambda: impactsig.find_periodic_orbit(noisy),
        lambda: impactsig.basins_of_attraction(noisy, [0.0], [0.0]),
    ):
        with pytest.raises(InvalidInput, match="simulate_ensemble"):
            function()
    assert simulate(replace(noisy, noise=Noise(0.0)), periods=1).status == "complete"


def test_a_user_function_may_be_the_restitution():
    steady = replace(LINEAR, stops=(Stop(0.0, Rigid(lambda v: 0.8), "lower"),))
    options = {"paths": 4, "duration": 30.0, "seed": 1}
    for method in METHODS:
        one = simulate_ensemble(LINEAR, method=method, **options)
        other = simulate_ensemble(steady, method=method, **options)
        np.testing.assert_array_equal(one.joint.density, other.joint.density)


def test_figures_can_be_drawn():
    found = simulate_ensemble(LINEAR, paths=8, duration=20.0, seed=1)
    for result in (found, found.energy, found.displacement, found.velocity, found.joint):
        ax = result.plot()
        assert ax.get_xlabel()
        assert ax.get_ylabel()
    ax = simulate(LINEAR, duration=20.0, seed=1).plot()
    assert "displacement" in ax.get_ylabel()


def crooked(t, x, v):
    """A law that cannot be vectorised: it branches, calls, and raises beyond 3."""
    if x > 3.0:
        raise ValueError
    return math.sin(2 * x + t) - (v * v if v > 0.5 else 0.1 * math.exp(-abs(x)))


BASE = BaseMotion(0.1, 1.3, 0.2, stops=True)
SOFT = (Stop(0.6, KelvinVoigt(60.0, 0.5)), Stop(-0.5, Hertz(40.0, restitution=0.7), "lower"))
MACHINES = {
    "linear": LINEAR,
    "scene": SCENE,
    "law, two stops, base": replace(
        LINEAR, law=crooked, mass=1.7, base=BASE, stops=(*LINEAR.stops, Stop(1.1, Rigid(0.5)))
    ),
    "law that raises": replace(LINEAR, law=crooked, noise=Noise(2.0)),
    "soft stops, friction": replace(LINEAR, stops=SOFT, friction=Friction(0.2)),
    "filtered, friction, law": replace(
        LINEAR, noise=Noise(0.5, 0.3), friction=Friction(0.2, 0.3), law=crooked
    ),
    "filtered": replace(LINEAR, noise=Noise(0.5, 0.3), forces=(Force(0.5, 2.0),)),
}


@pytest.mark.parametrize("name", MACHINES)
def test_a_path_is_the_same_alone_and_among_others(name):
    """To the last bit: with its impacts, a law of any kind, and whatever the others come to."""
    mover = Mover(MACHINES[name], 0.05, "splitting", 0.4, key_of(3))
    n, steps = 37, 640
    q, v = np.linspace(0.05, 0.9, n), np.linspace(-1.0, 1.0, n)
    together = mover.start(q, v, np.arange(n))
    seen = together.move(steps, 2, steps // 2)
    for path in (0, 8, 31, 36):
        alone = mover.start(q[path : path + 1], v[path : path + 1], np.array([path]))
        np.testing.assert_array_equal(alone.move(steps, 2, steps // 2)[0], seen[path])
        assert alone.count[0] == together.count[path]
    lost = ~np.isfinite(seen).all(axis=(1, 2))
    assert (0 < lost.sum() < n) if name == "law that raises" else not lost.any()
    assert len(np.unique(seen[~lost, -1, 0])) == n - lost.sum()


def test_groups_can_be_cut_anywhere():
    mover = Mover(LINEAR, 0.05, "splitting", 0.0, key_of(3))
    whole = mover.start(np.ones(3), np.zeros(3), np.arange(3)).move(300, 1, 300)
    group = mover.start(np.ones(3), np.zeros(3), np.arange(3))
    parts = [group.move(steps, 1, steps) for steps in (1, 62, 2, 100, 135)]
    np.testing.assert_array_equal(np.concatenate(parts, axis=1), whole)


def test_a_path_keeps_all_impacts_however_many_a_call_meets(monkeypatch):
    held = Oscillator(damping=0.1, stops=(Stop(0.0, Rigid(0.0)),), noise=Noise(0.1))
    whole = simulate(held, duration=300, seed=3, method="gaussian")
    assert len(whole.impacts) > 1000
    monkeypatch.setattr(noisy_motion, "ROOM", 3)
    again = simulate(held, duration=300, seed=3, method="gaussian")
    assert np.array_equal(again.impacts.time, whole.impacts.time)
    assert np.array_equal(again.x, whole.x)
