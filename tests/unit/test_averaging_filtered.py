"""Averaging under filtered noise and that of the stiffness: series, moments, simulated motions."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from impactsig import (
    Hertz,
    InvalidInput,
    KelvinVoigt,
    Noise,
    Oscillator,
    Rigid,
    Stop,
    averaged_density,
    simulate_ensemble,
)
from impactsig.stochastic.averaging._cycles import orbits
from impactsig.stochastic.averaging._families import families
from impactsig.stochastic.averaging._feeding import band_of, fed
from impactsig.stochastic.averaging._well import conservative

BANDS = [
    (1e-3, 0.0), (0.5, 0.0), (5.0, 0.0), (5.0, 1.3), (20.0, 6.0), (1e-3, 3e3), (3e3, 0.0),
    (1e6, 0.0),
]  # fmt: skip
MACHINE = Oscillator(damping=0.05, noise=Noise(0.01))  # a mean energy of 0.2


def passed(u, tau, w):
    """Share of the spectrum of white noise that the filter passes."""
    return (1 / (1 + ((u - w) * tau) ** 2) + 1 / (1 + ((u + w) * tau) ** 2)) / 2


def noise(tau, w=0.0, parametric=False):
    return Noise(0.01, tau, w, parametric)


@pytest.mark.parametrize(("tau", "w"), BANDS)
@pytest.mark.parametrize("place", [0.5, 0.0])
def test_between_impacts_the_diffusion_is_the_sum_over_harmonics(place, tau, w):
    """x = -a cos t from the lower turn to the stop, so all coefficients have a closed form."""
    machine = replace(MACHINE, noise=noise(tau, w), stops=(Stop(place, Rigid(0.99)),))
    density = averaged_density(machine)
    energies = np.array([0.2, 1.0])
    amplitude = np.sqrt(2 * energies)[:, None]
    half = math.pi - np.arccos(place / amplitude)
    pace = np.arange(1, 100_001) * math.pi / half
    sines = np.sin((pace - 1) * half) / (pace - 1) - np.sin((pace + 1) * half) / (pace + 1)
    terms = (amplitude * sines / half) ** 2 * 2 * 0.01 * passed(pace, tau, w) / 2
    # What is left falls as the fourth power of the number, once the filter passes little.
    expected = terms.sum(axis=1) + terms[:, -1] * pace.shape[1] / 3
    assert density.diffusion(energies) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("tau", "w", "parametric"),
    [(1e-3, 0.0, False), (0.5, 0.0, True), (5.0, 1.3, False), (20.0, 6.0, True)],
)
def test_in_and_above_two_wells_too(tau, w, parametric):
    """v is a Jacobi function of the time on x'' = x - x^3; beside the saddle as elsewhere."""
    two = Oscillator(
        stiffness=0.0, damping=0.05, law=lambda t, x, v: x - x**3, noise=noise(tau, w, parametric)
    )
    part = conservative(two)
    root = families(part)
    for family, energies in ((root, [0.2501, 2.0]), (root.children[0], [0.1, 0.249])):
        along = orbits(part, np.array(energies), family=family)
        found = fed(part, family, band_of(two.noise), along.energy, along.area)
        for energy, period, own in zip(energies, along.period, found, strict=True):
            level = energy - 0.25
            high, low = 1 + 2 * math.sqrt(energy), 1 - 2 * math.sqrt(energy)  # squares of turns
            t = np.arange(2**14) / 2**14
            if level < 0:
                m, pace = (high - low) / high, math.sqrt(high / 2)
                expected = 2 * ellipk(m) / pace
                sn, cn, dn, _ = ellipj(pace * expected * t, m)
                x, v = math.sqrt(high) * dn, -math.sqrt(high) * pace * m * sn * cn
            else:
                m, pace = high / (high - low), math.sqrt((high - low) / 2)
                expected = 4 * ellipk(m) / pace
                sn, cn, dn, _ = ellipj(pace * expected * t, m)
                x, v = math.sqrt(high) * cn, -math.sqrt(high) * pace * sn * dn
            assert period == pytest.approx(expected, rel=1e-9)
            lines = np.abs(np.fft.rfft(v * x if parametric else v) / len(t)) ** 2
            u = 2 * math.pi / period * np.arange(len(lines))
            total = 2 * period * (lines * passed(u, tau, w)).sum()
            assert own == pytest.approx(total, rel=1e-7)


def test_a_very_wide_band_is_white():
    for machine in (MACHINE, replace(MACHINE, stops=(Stop(0.4, Rigid(0.97)),))):
        white = averaged_density(machine)
        off = [
            averaged_density(replace(machine, noise=noise(tau))).mean / white.mean - 1
            for tau in (1e-3, 1e-5)
        ]
        assert abs(off[0]) < 1e-3
        assert off[1] == pytest.approx(off[0] / (100 if machine.stops else 1e4), rel=0.02, abs=1e-9)


@pytest.mark.parametrize("tau", [0.2, 3.0])
def test_linear_motions_have_the_moments_of_the_filtered_equations(tau):
    """With x'' + c x' + x = f the mean energy is (I / c) (1 + c tau / 2) / (1 + c tau + tau^2)."""
    for damping in (0.01, 0.001):
        machine = Oscillator(damping=damping, noise=noise(tau))
        density = averaged_density(machine)
        assert density.mean == pytest.approx(0.01 / damping / (1 + tau**2), rel=1e-12)
        assert density.memory == pytest.approx(damping * tau, rel=1e-9)
        exact = 0.01 / damping * (1 + damping * tau / 2) / (1 + damping * tau + tau**2)
        assert density.mean == pytest.approx(exact, rel=0.5 * density.memory)
        assert density.mean != pytest.approx(exact, rel=0.3 * density.memory)


def test_holds_where_the_noise_forgets_before_the_energy_changes():
    short, long = (
        averaged_density(Oscillator(damping=0.01, noise=noise(tau))) for tau in (1.9, 2.1)
    )
    assert short.holds
    assert not long.holds
    assert "a correlation time of the noise 2.1%: too much to rely on" in long.describe()
    assert averaged_density(MACHINE).memory == 0


@pytest.mark.parametrize("damping", [0.02, 0.2])
def test_under_a_load_noise_of_the_stiffness_has_the_moments_of_its_equations(damping):
    """<v^2> = I <x^2> / c and <x^2> = L <x> + <v^2>: averaging is exact, whatever the damper."""
    machine = Oscillator(damping=damping, load=0.8, noise=Noise(damping / 4, parametric=True))
    square = 0.64 / (1 - 1 / 4)
    assert averaged_density(machine).mean == pytest.approx(1.25 * square / 2 - 0.32, rel=1e-9)


@pytest.mark.parametrize("own", [noise(0.7), noise(2.0, 1.6), noise(0.4, 0.0, True)])
def test_there_is_no_current(own):
    """U p = (V^2 p)' / 2, by a five-point difference; below and above grazing."""
    machine = replace(
        MACHINE, load=0.3, noise=own, stops=(Stop(0.8, Rigid(0.95)),), law=lambda t, x, v: -(x**3)
    )
    density = averaged_density(machine)
    H, step = np.array([0.02, 0.1, 0.4, 1.0]), 2e-4
    steps = step * np.array([-2, -1, 1, 2])
    flux = [density.diffusion(H + d) * density.energy_density(H + d) / 2 for d in steps]
    slope = (flux[0] - 8 * flux[1] + 8 * flux[2] - flux[3]) / (12 * step)
    current = density.drift(H) * density.energy_density(H)
    assert slope == pytest.approx(current, abs=1e-5 * np.abs(current).max())


def test_units():
    machine = replace(MACHINE, load=0.2, stops=(Stop(0.4, Rigid(0.95)),))
    for own in (noise(0.7, 1.2), noise(0.3, 0.0, True)):
        here = replace(machine, noise=own)
        there = here.in_units(time=0.1, length=0.02, mass=5.0)
        factor = 5.0 * 0.02**2 / 0.1**2
        assert averaged_density(there).mean * factor == pytest.approx(
            averaged_density(here).mean, rel=1e-9
        )


def test_noise_of_the_stiffness_needs_a_place_of_rest_that_it_reaches():
    with pytest.raises(InvalidInput, match="give it a load") as caught:
        averaged_density(replace(MACHINE, noise=noise(0.0, parametric=True)))
    assert caught.value.argument == "oscillator"


def test_filtered_noise_keeps_up_no_bounces_of_a_pressed_mass():
    pressed = replace(MACHINE, stops=(Stop(-0.3, Rigid(1.0)),))
    averaged_density(pressed)
    with pytest.raises(InvalidInput, match=r"pressed against the rigid stop at -0\.3"):
        averaged_density(replace(pressed, noise=noise(0.1)))


def height(machine, x):
    """Potential of a linear spring, a load and the law of these tests."""
    cubic = 0.0 if machine.law is None else -machine.law(0.0, 1.0, 0.0)
    bent = cubic * x**4 / 4
    return machine.stiffness * x * x / 2 - machine.load * x + bent


SIMULATED = {
    "a stop": replace(MACHINE, damping=0.03, noise=noise(0.3), stops=(Stop(0.4, Rigid(0.98)),)),
    "a stop at the bottom": replace(MACHINE, noise=noise(0.2), stops=(Stop(0.0, Rigid(0.99)),)),
    "a band and a stop": replace(
        MACHINE, damping=0.01, noise=noise(0.8, 1.5), stops=(Stop(0.5, Rigid(0.995)),)
    ),
    "two stops": replace(
        MACHINE, damping=0.01, noise=noise(0.3),
        stops=(Stop(0.4, Rigid(0.99)), Stop(-0.7, Rigid(0.99), "lower")),
    ),
    "a soft stop": replace(
        MACHINE, damping=0.01, noise=noise(0.3), stops=(Stop(0.4, KelvinVoigt(20.0, 0.01)),)
    ),
    "a Hertz stop": replace(
        MACHINE, damping=0.02, noise=noise(0.3), stops=(Stop(0.4, Hertz(30.0)),)
    ),
    "a stiffening spring": replace(
        MACHINE, damping=0.01, noise=noise(1.0, 1.5), law=lambda t, x, v: -(x**3)
    ),
    "the stiffness": replace(
        MACHINE, load=0.8, noise=noise(0.3, 0.0, True), stops=(Stop(1.4, Rigid(0.98)),)
    ),
    "the stiffness in a band": replace(
        MACHINE, damping=0.01, load=0.8, noise=Noise(0.004, 1.0, 1.0, True)
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    "case",
    ["a stop", *(pytest.param(k, marks=pytest.mark.slow) for k in [*SIMULATED][1:])],
)
def test_simulated_motions(case):
    machine = SIMULATED[case]
    density = averaged_density(machine)
    assert density.holds
    found = simulate_ensemble(
        machine, paths=1500, duration=2000, transient=400 + 3 / machine.damping, seed=2206,
        step=0.05, initial=(density.bottom, 0.0), workers=1,
    )  # fmt: skip
    assert found.energy.mean_error < 0.01 * density.mean
    above = found.energy.mean - height(machine, density.bottom)
    assert density.mean == pytest.approx(above, abs=3 * found.energy.mean_error)
