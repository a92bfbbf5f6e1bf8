"""Averaging with soft stops, against Gibbs' density and a quadrature of its own."""

from __future__ import annotations

import functools
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from impactsig import (
    Friction,
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
from impactsig.stochastic.averaging._contacts import logarithmic_loss

NOISY = Oscillator(damping=0.1, noise=Noise(0.02))  # a temperature of 0.2
CONTACTS = {
    "soft": (Stop(0.3, KelvinVoigt(80.0)),),
    "very stiff": (Stop(0.3, KelvinVoigt(1e6)),),
    "at the bottom": (Stop(0.0, KelvinVoigt(80.0)),),
    "pressed by the spring": (Stop(-0.3, KelvinVoigt(8.0)),),
    "Hertz": (Stop(0.3, Hertz(80.0)),),
    "Hertz, pressed": (Stop(-0.3, Hertz(8.0)),),
    "another exponent": (Stop(0.3, Hertz(50.0, 1.1)),),
    "one behind the other": (
        Stop(0.3, KelvinVoigt(20.0)), Stop(0.5, Hertz(100.0)), Stop(0.8, Rigid(1.0)),
        Stop(-0.4, Hertz(30.0), "lower"),
    ),
}  # fmt: skip


def potential(machine, x):
    """Of a linear spring and soft stops."""
    found = machine.stiffness * x * x / 2
    for stop in machine.stops:
        depth = max((x - stop.position) * (1 if stop.side == "upper" else -1), 0.0)
        if isinstance(stop.law, (KelvinVoigt, Hertz)):
            n = getattr(stop.law, "exponent", 1.0)
            found += stop.law.stiffness * depth ** (n + 1) / (n + 1)
    return found


@pytest.mark.parametrize("case", CONTACTS)
def test_with_a_linear_damper_the_density_is_gibbs(case):
    machine = replace(NOISY, stops=CONTACTS[case])
    density = averaged_density(machine)
    high = min((s.position for s in machine.stops if isinstance(s.law, Rigid)), default=3.0)
    ground = potential(machine, density.bottom)
    near = [s.position + d for s in machine.stops for d in (0, 1e-3, 1e-2)]
    points = sorted({x for x in [*near, density.bottom] if -5 < x < high})

    def mean(function):
        whole, part = (
            quad(
                lambda x, f=f: f(x) * math.exp(-(potential(machine, x) - ground) / 0.2),
                -5, high, points=points, epsabs=0, epsrel=1e-12, limit=500,
            )[0]
            for f in (lambda x: 1.0, function)
        )  # fmt: skip
        return part / whole

    energy = mean(lambda x: potential(machine, x) - ground) + 0.1
    assert density.mean == pytest.approx(energy, rel=1e-8)
    assert density.accuracy < 1e-9
    x = high - 0.02 if high < 3 else points[0] + 3e-4
    here, there = density.displacement_density([x, -0.1])
    ratio = math.exp((potential(machine, -0.1) - potential(machine, x)) / 0.2)
    assert here / there == pytest.approx(ratio, rel=1e-9)


def reference_mean(machine, place, spring, loss, greatest):
    """Mean energy of a unit mass on x = -x^3 with a soft stop, all integrals by Gauss's rule.

    Orbits are followed in the sine of an angle between their turns, energies in the root of what is
    beyond the touch, and ``loss(depth, v, v at the touch)`` is the force against the motion on the
    way in and out, added.
    """
    z, w = np.polynomial.legendre.leggauss(600)
    intensity = machine.noise.intensity
    touch = place**4 / 4

    def height(x):
        return x**4 / 4 + spring * np.maximum(x - place, 0) ** 2.5 / 2.5

    def cycle(energy):
        low = -((4 * energy) ** 0.25)
        high = -low
        if energy > touch:
            top = place, place + 3.0
            for _ in range(200):
                middle = sum(top) / 2
                top = (middle, top[1]) if height(middle) < energy else (top[0], middle)
            high = top[1]
        area = period = gain = 0.0
        for start, end in ((low, min(high, place)), (place, high)):
            if end <= start:
                continue
            turn = math.pi / 2 * z  # x = middle + half sin(turn)
            x = (start + end) / 2 + (end - start) / 2 * np.sin(turn)
            dx = (end - start) / 2 * np.cos(turn) * math.pi / 2 * w
            v = np.sqrt(2 * np.maximum(energy - height(x), 0))
            area += 2 * float(v @ dx)
            period += 2 * float((dx / v).sum())
            gain += 2 * float(((0.3 - x * x) * v - 0.02 * v**3) @ dx)
            gain -= 2 * machine.friction.kinetic * (end - start)
            if start == place:
                gain -= float(loss(x - place, v, math.sqrt(2 * (energy - touch))) @ dx)
        return area, period, gain

    # Energies: by their square root up to the touch, and of what is left beyond it.
    total = first = psi = 0.0
    nodes, weights = np.polynomial.legendre.leggauss(16)
    legendre = np.polynomial.legendre.legvander(nodes, 16)
    inner = np.polynomial.legendre.legvander(nodes, 15)
    order = np.arange(16)
    fit = (order[:, None] + 0.5) * inner.T * weights
    sums = (
        np.column_stack(
            [
                nodes + 1,
                *((legendre[:, k + 1] - legendre[:, k - 1]) / (2 * k + 1) for k in order[1:]),
            ]
        )
        @ fit
    )
    for origin, end in ((0.0, touch), (touch, greatest)):
        for a, b in np.sqrt(end - origin) * np.linspace(0, 1, 13)[[[k, k + 1] for k in range(12)]]:
            s = (a + b) / 2 + (b - a) / 2 * nodes
            energy, slope = origin + s * s, s * (b - a)
            area, period, gain = np.array([cycle(h) for h in energy]).T
            rate = gain / (intensity * area) * slope
            joint = np.exp(psi + sums @ rate)
            total += float((period * joint * slope) @ weights)
            first += float((energy * period * joint * slope) @ weights)
            psi += float(rate @ weights)
    return first / total


def kept_by_contact(restitution):
    """Share of the approach velocity that Lankarani and Nikravesh's law leaves, by its motion."""

    def motion(t, y):
        depth, v = y
        return [v, -(max(depth, 0) ** 1.5) * (1 + 0.75 * (1 - restitution**2) * v)]

    def leaves(t, y):
        return y[0] if t > 0.5 else 1.0

    leaves.terminal = True
    found = solve_ivp(motion, (0, 20), [0.0, 1.0], events=leaves, rtol=1e-11, atol=1e-13)
    return -found.y[1, -1]


KEPT = functools.cache(kept_by_contact)


@pytest.mark.parametrize("place", [0.0, 0.3])
def test_exchange_at_a_stop_is_by_the_energy_that_it_is_met_with(place):
    """All that is exchanged is at the stop, however seldom that is met."""
    hertz = Hertz(1e6, restitution=0.9)  # so stiff that the spring does nothing there
    for law, share in ((Rigid(0.9), -2 * math.log(0.9)), (hertz, -2 * math.log(KEPT(0.9)))):
        machine = replace(NOISY, damping=1e-12, noise=Noise(0.001), stops=(Stop(place, law),))
        assert averaged_density(machine).exchange == pytest.approx(share, rel=0.02)
    soft = replace(machine, stops=(Stop(0.0, KelvinVoigt(24.0, 0.5)),))
    assert averaged_density(soft).exchange == pytest.approx(math.pi * 0.5 / 5, rel=1e-6)


DAMPED = {
    "Hunt and Crossley's": (
        {"damping": 0.05}, lambda d, v, v0: 2 * 30 * d**1.5 * 0.05 * v,
    ),
    "by restitution": (
        {"restitution": 0.9},
        lambda d, v, v0: -2 * 30 * d**1.5 * 1.5 * math.log(KEPT(0.9)) / v0 * v,
    ),
}  # fmt: skip


@pytest.mark.parametrize("restitution", [0.999, 0.9, 0.5])
def test_a_contact_by_restitution_loses_what_its_motion_does(restitution):
    taken = 4 / 3 * logarithmic_loss(0.75 * (1 - restitution**2))
    assert taken == pytest.approx(-2 * math.log(kept_by_contact(restitution)), rel=1e-6)


@pytest.mark.parametrize("case", DAMPED)
def test_a_van_der_pol_duffing_oscillator_with_a_lossy_hertz_stop(case):
    given, loss = DAMPED[case]
    machine = Oscillator(
        stiffness=0, law=lambda t, x, v: -(x**3) + (0.3 - x * x) * v - 0.02 * v**3,
        friction=Friction(0.01), stops=(Stop(0.5, Hertz(30.0, **given)),), noise=Noise(0.02),
    )  # fmt: skip
    density = averaged_density(machine)
    expected = reference_mean(machine, 0.5, 30.0, loss, 1.2 * density.greatest)
    assert density.mean == pytest.approx(expected, rel=1e-7)
    free = averaged_density(replace(machine, stops=(Stop(0.5, Hertz(30.0)),)))
    assert density.mean < 0.99 * free.mean


@pytest.mark.parametrize("ends", ["gap", "force"])
def test_a_linear_contact_takes_what_its_damper_does_in_half_a_turn(ends):
    """At the bottom the orbit is half an ellipse in the stop: pi c a^2 w / 2, less the pull's.

    A stop that only pushes lets go at the depth d with c v = k d; so on the way out its force is
    less by min(c v, k d), with c v = k d at d = a sin(p), tan(p) = c w / k.
    """
    k, c, energy = 24.0, 0.9, 0.7
    w = math.sqrt(1 + k)
    stop = Stop(0.0, KelvinVoigt(k, c, ends))
    density = averaged_density(Oscillator(damping=0.01, stops=(stop,), noise=Noise(0.01)))
    a = math.sqrt(2 * energy) / w
    # Work of c v over a quarter turn: c w a^2 integral of cos^2.
    lost = 2 * c * w * a * a * math.pi / 4
    if ends == "force":
        p = math.atan(c * w / k)
        below = c * w * a * a * (p / 2 + math.sin(2 * p) / 4) - k * a * a * math.sin(p) ** 2 / 2
        lost -= below
    period = math.pi + math.pi / w
    area = math.pi * energy * (1 + 1 / w)
    assert density.period(energy) == pytest.approx(period, rel=1e-11)
    drift = 0.01 - (0.01 * area + lost) / period
    assert density.drift(energy) == pytest.approx(drift, rel=1e-9)


SIMULATED = {
    "soft": Stop(0.4, KelvinVoigt(20.0, 0.15)),
    "only pushes": Stop(0.4, KelvinVoigt(20.0, 0.15, "force")),
    "Hertz": Stop(0.4, Hertz(30.0, damping=0.05)),
    "Hertz by restitution": Stop(0.4, Hertz(30.0, restitution=0.97)),
    "elastic": Stop(0.4, Rigid(1.0)),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", SIMULATED)
def test_simulated_motions(case):
    machine = Oscillator(
        damping=0.004, stops=(SIMULATED[case],), noise=Noise(0.005),
        law=lambda t, x, v: -(x**3) - 0.01 * x * x * v,
    )  # fmt: skip
    density = averaged_density(machine)
    assert density.holds
    found = simulate_ensemble(
        machine, paths=256, duration=3000, transient=600, step=0.02, every=0.4, seed=3
    )
    assert density.mean == pytest.approx(found.energy.mean, abs=3 * found.energy.mean_error)
    assert density.sd == pytest.approx(found.energy.sd, abs=4 * found.energy.sd_error)
    assert found.energy.mean_error < 0.02 * density.mean


def test_a_mass_at_rest_in_a_stop_has_no_approach_velocity():
    pressed = replace(NOISY, stops=(Stop(-0.3, Hertz(8.0, restitution=0.9)),))
    with pytest.raises(InvalidInput, match="that the mass approaches"):
        averaged_density(pressed)
