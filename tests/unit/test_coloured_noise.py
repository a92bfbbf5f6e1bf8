"""Noise in a band, and noise of the stiffness, against moments in closed form and slow twins."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import expm

from impactsig import (
    BaseMotion,
    Friction,
    InvalidInput,
    KelvinVoigt,
    Noise,
    Oscillator,
    Rigid,
    Stop,
    lyapunov_spectrum,
    simulate,
    simulate_ensemble,
)
from impactsig.stochastic.paths.running import key_of
from tests import naive_stochastic

BAND = Noise(0.1, 5.0, 1.3)


def energy_of(machine):
    """Mean energy of a linear oscillator under filtered noise, from its spectrum."""
    k, c, noise = machine.stiffness, machine.damping, machine.noise
    tau, w = noise.correlation_time, noise.angular_frequency

    def density(u):
        lines = 1 / (1 + ((u - w) * tau) ** 2) + 1 / (1 + ((u + w) * tau) ** 2)
        return noise.intensity * lines / ((k - u * u) ** 2 + (c * u) ** 2) / (2 * math.pi)

    edges = [0.0, 0.5, 0.9, 1.0, 1.1, 1.3, 1.6, 2.0, 4.0, 50.0]
    squares = [
        2 * sum(quad(lambda u, n=n: density(u) * u**n, a, b, epsabs=1e-12)[0]
                for a, b in pairwise(edges))
        for n in (0, 2)
    ]  # fmt: skip
    return (k * squares[0] + squares[1]) / 2


@pytest.mark.parametrize(
    "noise", [Noise(0.1, 0.5), Noise(0.1, 5.0, 1.0), BAND, Noise(0.4, 1.0, 0.7)]
)
def test_a_linear_oscillator_has_the_energy_that_the_spectrum_tells(noise):
    machine = Oscillator(damping=0.2, noise=noise)
    found = simulate_ensemble(
        machine, paths=1500, duration=400, transient=100, seed=11, step=0.05, workers=1
    )
    assert found.energy.mean_error < 0.01 * found.energy.mean
    assert found.energy.mean == pytest.approx(energy_of(machine), abs=3 * found.energy.mean_error)


def test_a_band_of_frequency_zero_is_the_filtered_noise():
    machine = Oscillator(damping=0.2, noise=Noise(0.1, 0.5))
    run = {"duration": 20.0, "seed": 2}
    there = simulate(replace(machine, noise=Noise(0.1, 0.5, 0.0)), **run)
    np.testing.assert_array_equal(simulate(machine, **run).x, there.x)


@pytest.mark.parametrize(("stiffness", "damping", "intensity"), [(1, 0.3, 0.1), (1.5, 0.5, 0.2)])
def test_under_a_load_noise_of_the_stiffness_has_the_moments_of_its_equations(
    stiffness, damping, intensity
):
    """<v^2> = D <x^2> / c and k <x^2> = L <x> + <v^2>, as d<v^2>/dt and d<x v>/dt vanish."""
    machine = Oscillator(
        stiffness=stiffness, damping=damping, load=0.8, noise=Noise(intensity, parametric=True)
    )
    square = 0.8**2 / (stiffness * (stiffness - intensity / damping))
    energy = (stiffness + intensity / damping) * square / 2 - 0.8**2 / stiffness
    found = simulate_ensemble(
        machine, paths=2000, duration=300, transient=100, seed=5, step=0.05, workers=1
    )
    assert found.displacement.mean == pytest.approx(0.8 / stiffness, rel=0.002)
    assert found.energy.mean_error < 0.02
    assert found.energy.mean == pytest.approx(energy, abs=3 * found.energy.mean_error)


def mean_energy_of(machine, span, order=14):
    """Mean over a time of the mean energy from x = 1, by moments with Hermite functions.

    The filtered noise is the real part of sigma (a + i b), a and b normal and independent; the
    moments <y H_m(a) H_n(b)> of y = (x^2, x v, v^2) fulfil linear equations, cut off at an order.
    White noise leaves the equations of y alone.
    """
    k, c, noise = machine.stiffness, machine.damping, machine.noise
    free = np.array([[0, 2, 0], [-k, -c, 1], [0, -2 * k, -2 * c]], float)
    pull = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0]], float)  # of a force f x
    tau, w = noise.correlation_time, noise.angular_frequency
    if not tau:
        free[2, 0] += 2 * noise.intensity
        whole = free
    else:
        many = order if w else 1
        up = np.diag(np.sqrt(np.arange(1, order)), 1)  # of normalised functions
        across = np.diag(np.sqrt(np.arange(1, many)), 1)
        one, other = np.eye(order), np.eye(many)
        place = np.kron(up + up.T, other)
        fade = np.kron(np.diag(np.arange(order)), other) + np.kron(one, np.diag(np.arange(many)))
        turn = np.kron(up.T, across) - np.kron(up, across.T)
        sigma = math.sqrt(noise.intensity / tau)
        whole = np.kron(np.eye(len(place)), free) + sigma * np.kron(place, pull)
        whole = whole + np.kron(w * turn - fade / tau, np.eye(3))
    start = np.zeros(len(whole))
    start[0] = 1.0
    both = np.zeros((len(whole) + 1,) * 2)  # and the integral
    both[:-1, :-1], both[-1, 0], both[-1, 2] = whole, k / 2, 0.5
    return (expm(both * span) @ np.append(start, 0.0))[-1] / span


@pytest.mark.parametrize(
    "noise",
    [
        Noise(0.05, parametric=True),
        Noise(0.12, 0.7, parametric=True),
        Noise(0.15, 3.0, 2.0, parametric=True),
    ],
)
def test_energy_grows_under_noise_of_the_stiffness_as_its_moments_say(noise):
    machine = Oscillator(damping=0.05, noise=noise)
    expected = mean_energy_of(machine, 25.0)
    assert mean_energy_of(machine, 25.0, 12) == pytest.approx(expected, rel=1e-5)
    quiet = mean_energy_of(replace(machine, noise=Noise(0.0)), 25.0)
    assert expected > 1.3 * quiet
    found = simulate_ensemble(
        machine, paths=12_000, duration=25.0, initial=(1.0, 0.0), seed=8, step=0.025, workers=1
    )
    assert found.energy.mean_error < 0.02 * expected
    assert found.energy.mean == pytest.approx(expected, abs=3 * found.energy.mean_error)


@pytest.mark.parametrize(
    ("noise", "friction"),
    [
        (BAND, 0.0),
        (replace(BAND, parametric=True), 0.0),
        (Noise(0.1, parametric=True), 0.0),
        (Noise(0.1, parametric=True), 0.02),
    ],
)
def test_the_splitting_is_its_twin(noise, friction):
    """Above a stop at -0.4, where the stiffness still varies while the mass hits."""
    h, steps, key = 0.05, 640, key_of(4)
    machine = Oscillator(
        damping=0.0, friction=Friction(friction) if friction else None, noise=noise,
        stops=(Stop(-0.4, Rigid(0.8), "lower"),), law=lambda t, x, v: -0.05 * v * v * v,
    )  # fmt: skip
    found = simulate(machine, duration=steps * h, step=h, seed=4, path=7, initial=(0.9, -0.5))
    sigma, deviation = 0.0, math.sqrt(2 * noise.intensity * h)
    if noise.correlation_time:
        sigma, deviation = math.sqrt(noise.intensity / noise.correlation_time), 0.0
    values = naive_stochastic.filtered(
        sigma, noise.correlation_time or 1.0, noise.angular_frequency, h, key, 7, steps // 64
    )

    def force(t, y, v):
        n, x = round(2 * t / h), y - 0.4
        own = values[n // 2] if n % 2 or not n else (values[n // 2 - 1] + values[n // 2]) / 2
        return -x - 0.05 * v**3 + own * (x if noise.parametric else 1.0)

    z = np.concatenate([naive_stochastic.normals(key, 7, block) for block in range(steps // 64)])
    tossed = [coin for k in range(steps // 64) for coin in naive_stochastic.coins(key, 7, k)]
    expected = naive_stochastic.split(
        force, deviation, z, tossed, 0.8, friction, 1.3, -0.5, h, key, 7,
        times=(lambda y: y - 0.4) if noise.parametric else (lambda y: 1.0),
    )  # fmt: skip
    assert len(found.impacts) > 3
    apart = np.column_stack([found.x + 0.4, found.v])[:200] - expected[:200]
    assert abs(apart).max() < 1e-9


def test_units_scale_the_noise_with_the_rest():
    machine = Oscillator(
        mass=2.0, stiffness=50.0, damping=0.4, load=3.0, noise=Noise(4.0, 0.3, 6.0, parametric=True)
    )
    own = machine.in_units(time=0.5, length=0.1, mass=3.0)
    one, other = (
        simulate(each, duration=4.0, seed=1, step=0.01, initial=(at, 0.0))
        for each, at in ((machine, 0.2), (own, 2.0))
    )
    np.testing.assert_allclose(one.x, 0.1 * other.x, rtol=1e-9)


def test_what_cannot_be_is_named():
    stiff = Oscillator(damping=0.1, noise=Noise(0.1, parametric=True))
    cases = [
        (lambda: Noise(0.1, 0.0, 1.0), "angular_frequency", "flat"),
        (lambda: Noise(0.1, 1.0, -1.0), "angular_frequency", ""),
        (lambda: Noise(0.1, parametric="yes"), "parametric", ""),
        (lambda: Oscillator(base=BaseMotion(1.0, 1.0), noise=stiff.noise), "noise", "base"),
        (lambda: lyapunov_spectrum(stiff, periods=2, seed=1), "system", "stiffness"),
        (
            lambda: simulate(Oscillator(noise=BAND), duration=1, method="runge-kutta"),
            "method", "in a band",
        ),
        (lambda: simulate(stiff, duration=1, method="gaussian"), "method", "parametric"),
    ]  # fmt: skip
    for call, argument, told in cases:
        with pytest.raises(InvalidInput) as caught:
            call()
        assert caught.value.argument == argument
        assert told in str(caught.value)


def test_soft_stops_feel_the_same_noise():
    """A stop that is never met changes nothing, to the last digit."""
    machine = Oscillator(damping=0.2, noise=replace(BAND, parametric=True), load=0.5)
    far = replace(machine, stops=(Stop(1e6, KelvinVoigt(1.0)),))
    run = {"duration": 20.0, "seed": 3, "step": 0.05}
    np.testing.assert_array_equal(simulate(machine, **run).x, simulate(far, **run).x)
