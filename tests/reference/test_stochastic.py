"""Ensembles against stationary densities in closed form, identities, and orders of convergence."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import solve_continuous_lyapunov
from scipy.special import erf

from impactsig import (
    BaseMotion,
    Force,
    Friction,
    Hertz,
    KelvinVoigt,
    Noise,
    Oscillator,
    Rigid,
    Stop,
    simulate,
    simulate_ensemble,
)
from impactsig.stochastic.paths import _splitting
from impactsig.stochastic.paths.equation import COLUMNS, V
from impactsig.stochastic.paths.running import Mover, key_of

METHODS = ("splitting", "runge-kutta", "zhuravlev", "gaussian")
FLOOR = Stop(0.0, Rigid(1.0), "lower")
AT_REST = Oscillator(damping=0.5, stops=(FLOOR,), noise=Noise(0.5))
"""Linear, with elastic impacts where the spring is at rest: temperature D / c = 1."""


def agree(found, error, exact, bias=0.0, sigmas=4.5):
    """Whether a mean is what it should be, within its standard error and a bias allowed."""
    assert abs(found - exact) < sigmas * error + bias, (found, error, exact)


@pytest.mark.parametrize("method", METHODS)
def test_elastic_impacts_leave_half_a_gaussian_and_equipartition(method):
    """p = (2 / pi) exp(-(x^2 + v^2) / 2) for x > 0: an energy of mean 1, exponential."""
    found = simulate_ensemble(
        AT_REST, paths=400, duration=1000.0, transient=20.0, seed=1, method=method,
        bins=32, displacement_range=(0.0, 3.2), energy_range=(0.0, 6.4),
        step=None if method == "splitting" else 0.1,
    )  # fmt: skip
    assert found.status == "complete"
    for got, exact in (
        (found.energy.mean, 1.0),
        (found.velocity.sd**2, 1.0),
        (found.displacement.mean, math.sqrt(2 / math.pi)),
        (found.displacement.sd, math.sqrt(1 - 2 / math.pi)),
        (found.impact_rate, 1 / (2 * math.pi) * 2),
    ):
        # Zhuravlev's coordinate may pass 0 and back within a step: slow pairs are not counted.
        assert abs(got / exact - 1) < (0.02 if method == "zhuravlev" else 0.01)
    # Cell by cell, with the bias of the step.
    edges = found.displacement.edges
    exact = np.diff(erf(edges / math.sqrt(2))) / np.diff(edges)
    off = np.abs(found.displacement.density - exact)
    assert np.all(off < 4.5 * found.displacement.standard_error + 0.01 * exact)
    edges = found.energy.edges
    exact = -np.diff(np.exp(-edges)) / np.diff(edges)
    off = np.abs(found.energy.density - exact)
    assert np.all(off < 4.5 * found.energy.standard_error + 0.015 * exact)
    # Displacement and velocity are independent.
    joint = found.joint
    alone = joint.density.sum(axis=0) * np.diff(joint.v_edges)[0]
    across = joint.density.sum(axis=1) * np.diff(joint.x_edges)[0]
    off = np.abs(joint.density - np.outer(across, alone))
    assert np.all(off < 5 * joint.standard_error + 0.01 * joint.density.max())


@pytest.mark.parametrize("damping", [0.5, 3.0])
def test_the_correlation_time_of_the_energy_is_that_of_a_linear_oscillator(damping):
    """The energy's autocorrelation is the sum of squares of exp(A t), by 2.

    x and v are Gaussian, independent and of one variance, so that the covariances of their squares
    are twice the squares of theirs; its integral is tr P / 2, where A' P + P A = -1.
    """
    rates = np.array([[0.0, 1.0], [-1.0, -damping]])
    integral = np.trace(solve_continuous_lyapunov(rates.T, -np.eye(2))) / 2
    assert integral == pytest.approx(1 / damping + damping / 4)
    found = simulate_ensemble(
        Oscillator(damping=damping, noise=Noise(damping)), paths=4000, duration=200.0,
        transient=20.0, method="gaussian", step=0.2, every=0.2, seed=3,
    )  # fmt: skip
    # The variance of the mean energy comes from 4000 independent ones.
    assert found.correlation_time == pytest.approx(integral, rel=4.5 * math.sqrt(2 / 4000))
    independent = 4000 * 200 / (2 * integral)
    assert found.effective_size == pytest.approx(independent, rel=4.5 * math.sqrt(2 / 4000))


def ball(x):
    return 0.6 * x


def duffing(x):
    return x**4 / 4 - 0.5 * x**2


GIBBS = {
    "barometer": (Oscillator(stiffness=0.0, load=-0.6, stops=(FLOOR,)), ball, (0.0, 40.0)),
    "two walls": (
        Oscillator(load=0.4, stops=(FLOOR, Stop(1.5, Rigid(1.0)))),
        lambda x: x**2 / 2 - 0.4 * x,
        (0.0, 1.5),
    ),
    "double well": (
        Oscillator(stiffness=0.0, law=lambda t, x, v: x - x**3),
        duffing,
        (-5.0, 5.0),
    ),
    "soft stop": (
        Oscillator(stops=(Stop(0.5, KelvinVoigt(80.0)),)),
        lambda x: x**2 / 2 + 40 * max(x - 0.5, 0.0) ** 2,
        (-6.0, 3.0),
    ),
    "Hertz": (
        Oscillator(stops=(Stop(0.5, Hertz(60.0)), Stop(-1.0, Rigid(1.0), "lower"))),
        lambda x: x**2 / 2 + 24 * max(x - 0.5, 0.0) ** 2.5,
        (-1.0, 3.0),
    ),
}


@pytest.mark.parametrize("name", GIBBS)
def test_gibbs_density_of_any_potential(name):
    """With linear damping c, and impacts without loss, p ~ exp(-H / T), T = D / c."""
    machine, potential, (low, high) = GIBBS[name]
    temperature = 0.8
    machine = replace(machine, damping=0.5, noise=Noise(0.5 * temperature))
    points = [0.5] if low < 0.5 < high else None

    def mean(function):
        top = quad(lambda x: function(x) * math.exp(-potential(x) / temperature), low, high,
                   points=points, limit=200)[0]  # fmt: skip
        return top / quad(lambda x: math.exp(-potential(x) / temperature), low, high,
                          points=points, limit=200)[0]  # fmt: skip

    found = simulate_ensemble(
        machine, paths=256, duration=400.0, transient=40.0, seed=2, initial=(0.4, 0.0)
    )
    agree(found.velocity.sd**2, 2 * found.velocity.sd * found.velocity.sd_error, temperature, 0.008)
    agree(found.displacement.mean, found.displacement.mean_error, mean(lambda x: x), 0.008)
    energy = mean(potential) + temperature / 2
    agree(found.energy.mean, found.energy.mean_error, energy, 0.01 * abs(energy))


def test_friction_alone_leaves_laplaces_density():
    """v' = -f sgn v + noise: p(v) ~ exp(-f |v| / D), by the Fokker-Planck equation."""
    machine = Oscillator(stiffness=0.0, friction=Friction(0.8, 2.0), noise=Noise(0.5))
    found = simulate_ensemble(
        machine, paths=256, duration=400.0, transient=30.0, seed=3, step=0.05, bins=40,
        velocity_range=(-4.0, 4.0),
    )  # fmt: skip
    scale = 0.5 / 0.8
    agree(found.velocity.sd, found.velocity.sd_error, math.sqrt(2) * scale, 0.01 * scale)
    edges = found.velocity.edges
    below = np.where(edges < 0, np.exp(edges / scale) / 2, 1 - np.exp(-edges / scale) / 2)
    exact = np.diff(below) / np.diff(edges)
    off = np.abs(found.velocity.density - exact)
    assert np.all(off < 4.5 * found.velocity.standard_error + 0.01 * exact)


@pytest.mark.parametrize("method", ["splitting", "runge-kutta"])
def test_filtered_noise_on_a_linear_oscillator(method):
    """The stationary covariance of (x, v, f) solves Lyapunov's equation."""
    mass, c, k, intensity, tau = 1.5, 0.6, 2.0, 0.7, 0.8
    machine = Oscillator(mass=mass, damping=c, stiffness=k, noise=Noise(intensity, tau))
    found = simulate_ensemble(
        machine, paths=256, duration=400.0, transient=30.0, seed=4, method=method
    )
    drift = np.array([[0, 1, 0], [-k / mass, -c / mass, 1 / mass], [0, 0, -1 / tau]])
    covariance = solve_continuous_lyapunov(drift, -np.diag([0, 0, 2 * intensity / tau**2]))
    for quantity, exact in zip(
        (found.displacement, found.velocity), np.sqrt(np.diag(covariance)), strict=False
    ):
        agree(quantity.sd, quantity.sd_error, exact, 0.005 * exact)


@pytest.mark.parametrize("method", METHODS)
def test_power_in_is_power_out(method):
    """D / m = c <v^2> + (1 - r^2) / 2 <rate of impacts times their squared velocity>."""
    machine = Oscillator(
        damping=0.2, load=-0.3, stops=(Stop(0.0, Rigid(0.6), "lower"),), noise=Noise(0.5)
    )
    step = 0.2 if method == "gaussian" else 0.05
    gain = []
    for path in range(24):
        options = {"duration": 1500.0, "seed": 6, "path": path, "method": method, "step": step}
        seen = simulate(machine, transient=20.0, **options)
        lost = 0.5 * (1 - 0.36) * np.sum(seen.impacts.approach_velocity**2) / seen.impacts.duration
        gain.append(0.2 * np.mean(seen.v**2) + lost)
    agree(np.mean(gain), np.std(gain, ddof=1) / math.sqrt(len(gain)), 0.5, 0.003)


def test_methods_agree_where_impacts_lose_energy():
    """On the exact transition, whose steps differ; and the others on it, at small steps."""
    machine = Oscillator(
        damping=0.2, load=-0.3, stops=(Stop(0.0, Rigid(0.7), "lower"),), noise=Noise(0.5)
    )
    options = {"paths": 256, "duration": 500.0, "transient": 30.0}
    truth = simulate_ensemble(machine, method="gaussian", step=0.1, seed=1, **options)
    for seed, (method, step) in enumerate(
        [("gaussian", 0.4), ("splitting", 0.05), ("runge-kutta", 0.1), ("zhuravlev", 0.05)]
    ):
        found = simulate_ensemble(machine, method=method, step=step, seed=7 + seed, **options)
        for one, two in (
            (found.energy, truth.energy),
            (found.displacement, truth.displacement),
        ):
            agree(one.mean, math.hypot(one.mean_error, two.mean_error), two.mean, 0.006)


def test_the_noise_averages_out_of_a_linear_motion():
    """The mean over the paths is the motion without noise, phase by phase of a moving base."""
    machine = Oscillator(
        damping=0.4, forces=(Force(0.8, 1.3, 0.2),), base=BaseMotion(0.3, 0.7, 0.4, stops=True),
        noise=Noise(0.02),
    )  # fmt: skip
    options = {"periods": 3.0, "transient": 1.0, "initial": (0.5, -0.2), "phase": 2.0}
    truth = simulate(replace(machine, noise=None), **options)
    for method in ("splitting", "runge-kutta", "gaussian"):
        period = machine.forcing_period
        found = simulate_ensemble(
            machine, paths=800, every=period, seed=1, method=method, **options
        )
        x, v = truth.sample(period * np.array([2.0, 3.0, 4.0 - 1e-12]))
        agree(found.displacement.mean, found.displacement.mean_error, x.mean(), 2e-3)
        agree(found.velocity.mean, found.velocity.mean_error, v.mean(), 2e-3)


def biases(machine, mean, method, steps, paths=192):
    """How far the mean energy is from what it should be with each step, and the standard error."""
    found = [
        simulate_ensemble(
            machine, paths=paths, duration=2000.0, transient=20.0, seed=11 + k, method=method,
            step=step, every=2 * step,
        ).energy
        for k, step in enumerate(steps)
    ]  # fmt: skip
    return [one.mean / mean - 1 for one in found], [one.mean_error / mean for one in found]


def test_the_splitting_has_no_error_where_the_stop_is_at_the_rest_position():
    """Of the harmonic oscillator it is the exact density, whatever the step; folded, too."""
    for off, error in zip(*biases(AT_REST, 1.0, "splitting", (0.3, 0.6)), strict=True):
        assert abs(off) < 4.5 * error + 0.001


def test_the_splitting_is_of_weak_order_two_under_lossy_impacts():
    lossy = replace(AT_REST, load=-0.5, stops=(Stop(0.0, Rigid(0.8), "lower"),))
    truth = simulate_ensemble(
        lossy, paths=500, duration=2000.0, transient=20.0, seed=1, method="gaussian", step=0.5
    ).energy
    (small, large), (error, _) = biases(lossy, truth.mean, "splitting", (0.45, 0.9), paths=800)
    error = math.hypot(error, truth.mean_error / truth.mean)
    assert abs(large) > 15 * error
    order = math.log2(large / small)
    assert 1.7 - 4.5 * error / abs(small) < order < 3.2 + 4.5 * error / abs(small)


def test_noise_held_through_an_impact_would_be_of_order_one():
    """The bridge at the stop leaves Runge and Kutta's method less than a fifth of that bias.

    Without it each impact takes sigma^2 h (2 / 3) of the energy's 1 / pi of rate: 2 c <H> is short
    by 0.21 h of 1 there.
    """
    (small, large), (error, other) = biases(AT_REST, 1.0, "runge-kutta", (0.2, 0.4))
    assert abs(small) < 0.21 * 0.2 / 5 + 4.5 * error
    assert abs(large) < 0.21 * 0.4 / 3 + 4.5 * other


def strong_errors(machine, steps, span=4.0, paths=400):
    """Mean distance of paths from those of the finest step, driven by the same noise."""
    fine = steps[-1] / 2  # kicks stand for a step from middle to middle
    normal = np.random.default_rng(5).standard_normal((paths, round((span + steps[0]) / fine)))
    brownian = math.sqrt(fine) * np.cumsum(normal, axis=1)
    sigma = math.sqrt(2 * machine.noise.intensity)
    ends = []
    for step in steps:
        last, half = round(span / step), round(step / 2 / fine)
        middles = brownian[:, half - 1 :: 2 * half][:, : last + 1]
        mover = Mover(machine, step, "splitting", 0.0, key_of(1))
        group = mover.start(np.full(paths, 1.0), np.zeros(paths), np.arange(paths))
        group.state[V] = -step / 2 + sigma * middles[:, 0]  # in both machines the force is -1
        seen = np.empty((paths, 1, 2))
        normal = np.ascontiguousarray(np.diff(middles, axis=1).T) / math.sqrt(step)
        _splitting.advance(
            mover.problem, mover.functions, group.scratch, normal, normal, group.state, group.count,
            0, last, last, 0, seen, np.empty((0, COLUMNS)),
        )  # fmt: skip
        ends.append(seen[:, 0])
    return [np.mean(np.abs(end - ends[-1])[:, 0]) for end in ends[:-1]]


def test_strong_orders_of_the_splitting():
    """Order 1 of a smooth motion; impacts, which turn the noise of their step, leave less."""
    steps = (0.1, 0.05, 0.025, 0.025 / 32)
    smooth = strong_errors(
        Oscillator(damping=0.3, stiffness=0.0, law=lambda t, x, v: -(x**3), noise=Noise(0.2)), steps
    )
    assert 0.85 < math.log2(smooth[0] / smooth[2]) / 2 < 1.6
    hit = strong_errors(replace(AT_REST, noise=Noise(0.2)), steps)
    assert 0.35 < math.log2(hit[0] / hit[2]) / 2 < 1.3
