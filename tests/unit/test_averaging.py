"""Stochastic averaging, against closed forms, high precision and simulated motions."""

from __future__ import annotations

import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from scipy.stats import norm

from impactsig import (
    Force,
    Friction,
    InvalidInput,
    Noise,
    Oscillator,
    Rigid,
    Stop,
    averaged_density,
    scenes,
)
from impactsig.stochastic.averaging._cycles import orbits
from impactsig.stochastic.averaging._well import conservative

NOISY = Oscillator(damping=0.1, noise=Noise(0.02))  # a mean energy of 0.2


def stop(position, restitution=1.0, side="upper"):
    return Stop(position, Rigid(restitution), side)


def test_linear_is_gibbs():
    density = averaged_density(NOISY)
    H = np.array([0.0, 1e-25, 1e-3, 0.1, 1.0, 5.0])
    assert density.energy_density(H) == pytest.approx(5 * np.exp(-5 * H), rel=1e-12)
    assert density.cumulative(H) == pytest.approx(1 - np.exp(-5 * H), rel=1e-12)
    assert (density.mean, density.sd) == pytest.approx((0.2, 0.2), rel=1e-13)
    assert density.moment(4) == pytest.approx(24 * 0.2**4, rel=1e-12)
    assert density.period(H[2:]) == pytest.approx(np.full(4, 2 * math.pi), rel=1e-12)


def test_energies_that_cannot_be_have_no_density():
    density = averaged_density(NOISY)
    assert density.energy_density([-1, 1e3]).tolist() == [0, 0]
    assert density.cumulative([-1, 0, 1e3]) == pytest.approx([0, 0, 1], abs=1e-14)
    assert np.all(np.diff(density.cumulative(np.linspace(-1, 12, 1001))) >= 0)


@pytest.mark.parametrize(
    "stops",
    [(), (stop(0.7),), (stop(0.0),), (stop(-0.4),), (stop(0.2), stop(-0.9, side="lower"))],
)
def test_without_loss_at_stops_displacement_is_a_cut_normal(stops):
    machine = replace(NOISY, mass=2.0, stiffness=3.0, load=0.15, stops=stops)
    density = averaged_density(machine)
    theory = norm(0.15 / 3, math.sqrt(0.2 / 3))
    high = stops[0].position if stops else math.inf
    low = stops[1].position if len(stops) > 1 else -math.inf
    x = np.array([-1.1, -0.85, -0.4, 0.0, 0.19, 0.8])
    expected = np.where((x >= low) & (x <= high), theory.pdf(x), 0) / (
        theory.cdf(high) - theory.cdf(low)
    )
    assert density.displacement_density(x) == pytest.approx(expected, rel=1e-9)
    v = np.array([-1.5, 0.0, 0.02, 0.4])
    gauss = norm(0, math.sqrt(0.2 / 2)).pdf(v)
    assert density.velocity_density(v) == pytest.approx(gauss, rel=1e-9)
    joint = density.joint_density(x, v[:, None])
    assert joint == pytest.approx(expected * gauss[:, None], rel=1e-9)
    assert density.accuracy < 1e-9


@pytest.mark.parametrize("position", [0.7, 1e-3, -0.3])
def test_period_and_area_before_and_beyond_grazing(position):
    part = conservative(replace(NOISY, stops=(stop(position),)))
    # Energy above the bottom, which is the stop where the spring presses the mass against it.
    over = np.array([1e-9, 1e-6, 1e-3, 0.1, 1.0, 100.0])
    spare = over * (position**2 / 2 if position > 0 else 1)
    energy = spare + (position**2 / 2 if position > 0 else 0)
    to_stop = np.arctan2(np.sqrt(2 * spare), position)  # phase from the upper turn to the stop
    period = 2 * (math.pi - to_stop)
    area = (2 * spare + position**2) * (math.pi - to_stop) + position * np.sqrt(2 * spare)
    hits = orbits(part, energy)
    assert hits.period == pytest.approx(period, rel=1e-11)
    assert hits.area[2:] == pytest.approx(area[2:], rel=1e-11)  # the closed form cancels below
    assert np.all(hits.error < 1e-10)
    if position > 0:
        free = orbits(part, energy[0] * np.array([1e-9, 0.5, 0.999999]))
        assert free.period == pytest.approx(np.full(3, 2 * math.pi), rel=1e-12)
        assert free.spare.tolist() == [[0, 0, 0]] * 2


def test_bouncing_ball():
    """A = 2 (2H)^(3/2) / (3 g), so p(H) = sqrt(H) exp(-k sqrt(H)) and the mean is 12 / k^2."""
    r, gravity, intensity = 0.9, 2.0, 0.3
    ball = Oscillator(
        stiffness=0, load=-gravity, stops=(stop(0, r, "lower"),), noise=Noise(intensity)
    )
    loss = {"logarithmic": -2 * math.log(r), "exact": 1 - r**2, "linearised": 2 * (1 - r)}
    for impact, share in loss.items():
        k = 2 * share * 3 * gravity / (intensity * 2 * 2**1.5)
        density = averaged_density(ball, impact=impact)
        assert density.mean == pytest.approx(12 / k**2, rel=1e-12)
        assert density.moment(2) == pytest.approx(360 / k**4, rel=1e-12)
    assert density.period([2.0]) == pytest.approx([2 * math.sqrt(4) / gravity], rel=1e-12)


def test_ball_between_two_stops():
    """Without a force T = 2 L / v, A = 2 L v, and Psi' = -(2 loss) H / (2 I L v)."""
    between = (stop(1.5, 0.9), stop(-0.5, 0.8, "lower"))
    box = Oscillator(stiffness=0, damping=0.05, stops=between, noise=Noise(0.1))
    density = averaged_density(box)
    loss = -2 * math.log(0.9) - 2 * math.log(0.8)

    def weight(h, k):
        lost = loss / (0.1 * 4 * math.sqrt(2)) * 2 / 3 * h**1.5
        return h ** (k - 0.5) * math.exp(-0.5 * h - lost)

    whole, first = (
        2 * mpmath.quad(lambda s, k=k: s * weight(s * s, k), [0, 0.5, 1, 2, 4, 8]) for k in (0, 1)
    )
    assert density.mean == pytest.approx(float(first / whole), rel=1e-10)
    assert density.velocity_density([0.3])[0] == pytest.approx(
        2.0 * density.joint_density(0.1, 0.3), rel=1e-9
    )


def test_general_orbits_to_high_precision():
    """A stiffening spring, damping of two kinds, friction, and a stop that half of them meet."""

    def law(t, x, v):
        return -(x**3) + (0.2 - 0.3 * x**2) * v - 0.1 * v**3

    machine = Oscillator(
        mass=1.5, damping=0.04, stiffness=0.7, load=0.1, law=law,
        friction=Friction(0.02), stops=(stop(0.6, 0.95),), noise=Noise(0.05),
    )  # fmt: skip
    density = averaged_density(machine)
    energies = [0.01, 0.1, 0.25, 2.0]
    with mpmath.workdps(25):
        bottom = mpmath.findroot(lambda x: 0.1 - 0.7 * x - x**3, 0.1)
        at_stop = None
        for energy, period, drift, diffusion in zip(
            energies, density.period(energies), density.drift(energies),
            density.diffusion(energies), strict=True,
        ):  # fmt: skip

            def height(x):
                return mpmath.mpf("0.35") * x**2 + x**4 / 4 - mpmath.mpf("0.1") * x

            def speed(x, energy=energy):
                left = energy + height(bottom) - height(x)
                return mpmath.sqrt(2 * abs(left) / mpmath.mpf("1.5"))

            level = energy + height(bottom)
            rough = np.roots([0.25, 0, 0.35, -0.1, -float(level)])
            low, high = (
                mpmath.findroot(lambda x, level=level: height(x) - level, near)
                for near in sorted(rough[np.abs(rough.imag) < 1e-9].real)
            )
            top = mpmath.mpf("0.6")
            at_stop = max(level - height(top), 0) if high > top else mpmath.mpf(0)
            high = min(high, top)
            ends = [low, bottom, high]
            T = 2 * mpmath.quad(lambda x: 1 / speed(x), ends)
            A = 2 * mpmath.quad(speed, ends)
            drag = 2 * mpmath.quad(
                lambda x: (0.2 - 0.3 * x**2 - 0.04) * speed(x) - 0.1 * speed(x) ** 3, ends
            )
            gained = drag - 2 * 0.02 * (high - low) + 2 * mpmath.log(0.95) * at_stop
            assert period == pytest.approx(float(T), rel=1e-8)  # of mpmath's own at the turns
            assert diffusion == pytest.approx(float(2 * 0.05 * A / T), rel=1e-8)
            assert drift == pytest.approx(float(0.05 / 1.5 + gained / T), rel=1e-8)
    assert at_stop > 0


def test_there_is_no_current():
    """U p = (V^2 p)' / 2, by a five-point difference; through the energy of grazing as well."""
    machine = replace(
        NOISY, friction=Friction(0.01), stops=(stop(0.5, 0.9),), law=lambda t, x, v: 0.3 * v - v**3
    )
    density = averaged_density(machine)
    H = np.array([0.02, 0.1, 0.124, 0.13, 0.4, 1.0])
    step = 2e-4
    steps = step * np.array([-2, -1, 1, 2])
    flux = [density.diffusion(H + d) * density.energy_density(H + d) / 2 for d in steps]
    slope = (flux[0] - 8 * flux[1] + 8 * flux[2] - flux[3]) / (12 * step)
    current = density.drift(H) * density.energy_density(H)
    assert slope == pytest.approx(current, abs=1e-5 * np.abs(current).max())


def test_cumulative_is_the_integral_of_the_density():
    density = averaged_density(scenes.van_der_pol_duffing(0.99, 2.5))
    points, weights = np.polynomial.legendre.leggauss(200)
    for low, high in ((0.1, 1.0), (1.0, 9.0)):
        h = (low + high) / 2 + (high - low) / 2 * points
        part = density.energy_density(h) @ weights * (high - low) / 2
        assert np.diff(density.cumulative([low, high]))[0] == pytest.approx(part, rel=1e-10)


def test_marginals_and_joint_density_agree():
    density = averaged_density(
        replace(NOISY, stops=(stop(0.4, 0.9),), law=lambda t, x, v: (0.3 - x * x) * v - x**3)
    )
    assert density.shape.name == "crater"
    points, weights = np.polynomial.legendre.leggauss(400)
    v = 4 * points
    assert density.displacement_density([-0.6, 0.3]) == pytest.approx(
        density.joint_density(np.array([[-0.6], [0.3]]), v) @ weights * 4, rel=1e-6
    )
    x = -1 + 1.4 * points
    assert density.velocity_density([0.0, 0.7]) == pytest.approx(
        density.joint_density(x, np.array([[0.0], [0.7]])) @ weights * 1.4, rel=1e-6
    )
    low, high = density.reach(1.0)
    assert high == 0.4
    assert density.potential(low) == pytest.approx(1.0, rel=1e-12)


def test_a_law_that_takes_no_arrays_is_called_point_by_point():
    def branching(t, x, v):
        spring = -math.sinh(x)
        return spring if v > 0 else spring + 0.0 * v

    slow = averaged_density(replace(NOISY, stiffness=0, law=branching))
    fast = averaged_density(replace(NOISY, stiffness=0, law=lambda t, x, v: -np.sinh(x)))
    assert (slow.mean, slow.sd) == pytest.approx((fast.mean, fast.sd), rel=1e-13)
    expected = np.exp(-(np.cosh(0.7) - 1) / 0.2)
    assert fast.displacement_density([0.7])[0] / fast.displacement_density([0.0])[0] == (
        pytest.approx(expected, rel=1e-9)
    )


def test_a_force_even_in_the_velocity_falls_out():
    plain = averaged_density(replace(NOISY, law=lambda t, x, v: -(x**3)))
    even = averaged_density(replace(NOISY, law=lambda t, x, v: -(x**3) + 0.1 * v * v))
    assert even.mean == pytest.approx(plain.mean, rel=1e-13)


def test_restitution_may_be_a_function():
    number = averaged_density(replace(NOISY, stops=(stop(0.2, 0.9),)))
    function = averaged_density(replace(NOISY, stops=(stop(0.2, lambda speed: 0.9),)))
    assert function.mean == pytest.approx(number.mean, rel=1e-14)
    falling = averaged_density(
        replace(NOISY, stops=(stop(0.2, lambda speed: 0.9 / (1 + 0.1 * speed)),))
    )
    assert falling.mean < number.mean
    # Where the density does not reach it may be anything.
    linear = replace(NOISY, stops=(stop(0.2, lambda speed: 0.9 - 0.01 * speed),))
    assert averaged_density(linear).mean < number.mean
    with pytest.raises(InvalidInput, match="density reaches"):
        averaged_density(replace(NOISY, stops=(stop(0.2, lambda speed: 0.9 - speed),)))


def test_units():
    machine = replace(NOISY, stops=(stop(0.2, 0.9),), friction=Friction(0.003))
    there = machine.in_units(time=0.1, length=0.02, mass=5.0)
    factor = 5.0 * 0.02**2 / 0.1**2  # joules in a unit of energy
    assert averaged_density(there).mean * factor == pytest.approx(
        averaged_density(machine).mean, rel=1e-12
    )


def simulated_energy(r, friction, *, start, paths, settle, span, dt=0.02, epsilon=0.01, seed=8):
    """Mean energy of the scene, with its standard error, by leapfrog in Zhuravlev's coordinate."""
    rng = np.random.default_rng(seed)
    y, v = np.zeros(paths), np.full(paths, math.sqrt(2 * start))
    total, count = np.zeros(paths), 0
    for step in range(round((settle + span) / dt)):
        for half in (0, 1):
            moved = y + v * dt / 2
            v = np.where(moved * y < 0, r * v, v)
            y = moved
            if half == 0:
                v = v + dt * (epsilon * (3 - y * y) * v - y**3)
                v += math.sqrt(2 * epsilon * dt) * rng.standard_normal(paths)
                v = np.sign(v) * np.maximum(np.abs(v) - epsilon * friction * dt, 0)
        if step * dt >= settle:
            total += v * v / 2 + y**4 / 4
            count += 1
    mean = total / count
    return float(mean.mean()), float(mean.std(ddof=1) / math.sqrt(paths))


@pytest.mark.slow
def test_simulated_motions_and_impact_terms():
    """An impact that takes a third of the energy: the logarithmic term still holds."""
    mean, error = simulated_energy(0.8, 1.0, start=0.1, paths=2500, settle=40, span=100)
    scene = scenes.van_der_pol_duffing(0.8, 1.0)
    logarithmic, linearised, exact = (
        averaged_density(scene, impact=impact).mean
        for impact in ("logarithmic", "linearised", "exact")
    )
    assert logarithmic == pytest.approx(mean, abs=3 * error + 0.02 * mean)
    assert linearised > mean + 4 * error
    assert exact > mean + 12 * error
    assert not averaged_density(scene).holds  # and so it is said, as it may be further off


@pytest.mark.slow
def test_where_averaging_holds_and_where_not():
    mean, error = simulated_energy(0.99, 1.0, start=10.0, paths=4000, settle=500, span=400)
    density = averaged_density(scenes.van_der_pol_duffing(0.99, 1.0))
    assert density.holds
    assert density.mean == pytest.approx(mean, abs=3 * error)
    mean, error = simulated_energy(0.5, 1.0, start=0.05, paths=2000, settle=100, span=200)
    density = averaged_density(scenes.van_der_pol_duffing(0.5, 1.0))
    assert not density.holds
    assert density.mean < 0.95 * mean


@pytest.mark.parametrize("intensity", [1e-2, 1e-5, 1e-9])
def test_noise_so_weak_that_the_ridge_is_thin(intensity):
    """About a ridge the energy is normal, of variance -1 / Psi''."""
    density = averaged_density(scenes.van_der_pol_duffing(0.99, 1.0, intensity))
    ridge = density.shape.energy[-1]
    step = 1e-3 * ridge

    def pull(h):  # Psi', from drift and diffusion less what the noise alone does
        return 2 * (density.drift(h) - 0.01 * intensity) / density.diffusion(h)

    steepness = (pull(ridge - step) - pull(ridge + step)) / (2 * step)
    assert density.sd == pytest.approx(steepness**-0.5, rel=20 * intensity + 1e-5)
    assert density.mean == pytest.approx(ridge, rel=intensity + 1e-9)
    assert density.cumulative(density.greatest) == pytest.approx(1, abs=1e-12)


REFUSED = {
    "no oscillator": (3.0, "an Oscillator"),
    "no noise": (Oscillator(damping=0.1), "positive intensity"),
    "noise of no intensity": (replace(NOISY, noise=Noise(0.0)), "positive intensity"),
    "forcing": (replace(NOISY, forces=(Force(1.0, 2.0),)), "without forcing"),
    "sticks to its stop": (replace(NOISY, stops=(stop(1.0, 0.0),)), "above 0"),
    "law of time": (replace(NOISY, law=lambda t, x, v: 0.1 * t * x), "depend on time"),
    "no well": (replace(NOISY, stiffness=0, load=1.0), "a well between the stops"),
    "a force that is no number": (
        replace(NOISY, law=lambda t, x, v: math.nan * x), "finite values",
    ),
    "a well with an edge": (
        replace(NOISY, law=lambda t, x, v: x**3, noise=Noise(1.0)), "contains the motion",
    ),
    "nothing that damps": (replace(NOISY, damping=0), "damping at great energies"),
    "more gain than loss": (
        replace(NOISY, law=lambda t, x, v: 0.2 * v), "damping at great energies",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_averaged_is_refused(case):
    given, required = REFUSED[case]
    with pytest.raises(InvalidInput, match=required) as caught:
        averaged_density(given)
    assert caught.value.argument == "oscillator"


def test_a_well_with_an_edge_far_from_the_noise():
    """Softening: the motion hardly ever comes near the edge, and has a density below it."""
    machine = replace(NOISY, law=lambda t, x, v: x**3, noise=Noise(1e-4))
    density = averaged_density(machine)
    assert density.greatest < 0.25  # the energy of the edge
    assert density.displacement_density([0.1])[0] / density.displacement_density([0.0])[0] == (
        pytest.approx(math.exp(-(0.1**2 / 2 - 0.1**4 / 4) / 1e-3), rel=1e-8)
    )


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda density: density.energy_density("x"), "energy"),
        (lambda density: density.joint_density(math.nan, 0.0), "x"),
        (lambda density: density.velocity_density([math.inf]), "v"),
        (lambda density: density.drift(0.0), "energy"),
        (lambda density: density.period([-1.0, 1.0]), "energy"),
        (lambda density: density.reach(-1.0), "energy"),
        (lambda density: density.moment(0), "order"),
        (lambda density: averaged_density(density.oscillator, impact="soft"), "impact"),
    ],
)
def test_bad_input(call, argument):
    with pytest.raises(InvalidInput) as caught:
        call(averaged_density(NOISY))
    assert caught.value.argument == argument
