"""Averaging over several wells, against Gibbs' density, a quadrature of its own, and motions."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

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
    p_bifurcation,
    plot,
    simulate_ensemble,
)


def double(x):
    return x**4 / 4 - x * x / 2


def tilted(x):
    return x**4 / 4 - x * x / 2 - 0.1 * x


def triple(x):
    return 0.3 * (x**6 / 6 - 5 * x**4 / 4 + 2 * x * x)


FORCES = {
    double: lambda t, x, v: x - x**3,
    tilted: lambda t, x, v: x - x**3 + 0.1,
    triple: lambda t, x, v: -0.3 * x * (x * x - 1) * (x * x - 4),
}
WELLS = {
    "two alike": (double, ()),
    "a deeper one": (tilted, ()),
    "three": (triple, ()),
    "a stop in one": (double, (Stop(1.2, Rigid(1.0)),)),
    "a stop below the saddle": (tilted, (Stop(0.5, Rigid(1.0)),)),
    "a soft stop": (double, (Stop(1.1, KelvinVoigt(20.0)),)),
    "a Hertz stop": (double, (Stop(0.4, Hertz(30.0)),)),
}


@pytest.mark.parametrize(
    ("case", "temperature"),
    # Between the wells; then in them, and high above what parts them.
    [(case, 0.2) for case in WELLS]
    + [("three", t) for t in (0.02, 2.0)]
    + [
        pytest.param(case, t, marks=pytest.mark.slow)
        for case in ("a deeper one", "a soft stop")
        for t in (0.02, 2.0)
    ],
)
def test_with_a_linear_damper_the_density_is_gibbs(case, temperature):
    spring, stops = WELLS[case]
    machine = Oscillator(
        stiffness=0, damping=0.1, law=FORCES[spring], stops=stops, noise=Noise(0.1 * temperature)
    )
    density = averaged_density(machine)
    high = min((s.position for s in stops if isinstance(s.law, Rigid)), default=5.0)

    def height(x):
        found = spring(x)
        for stop in stops:
            if not isinstance(stop.law, Rigid):
                n = getattr(stop.law, "exponent", 1.0)
                depth = max(x - stop.position, 0.0)
                found += stop.law.stiffness * depth ** (n + 1) / (n + 1)
        return found

    ground = min(height(x) for x in density.wells)
    points = sorted({*density.wells, *(s.position for s in stops), 0.0, -0.5, 0.7} - {high})

    def integral(function):
        return quad(
            lambda x: function(x) * math.exp((ground - height(x)) / temperature),
            -5, high, points=points, epsabs=0, epsrel=1e-11, limit=400,
        )[0]  # fmt: skip

    whole = integral(lambda x: 1.0)
    energy = integral(lambda x: height(x) - ground) / whole + temperature / 2
    assert density.mean == pytest.approx(energy, rel=1e-8)
    here = math.exp((ground - height(0.3)) / temperature) / whole
    assert density.displacement_density([0.3])[0] == pytest.approx(here, rel=1e-7)
    speed = math.exp(-0.045 / temperature) / math.sqrt(2 * math.pi * temperature)
    assert density.velocity_density([0.3])[0] == pytest.approx(speed, rel=1e-7)
    joint = here * math.exp(-0.5 * 0.4**2 / temperature) / math.sqrt(2 * math.pi * temperature)
    assert density.joint_density(0.3, 0.4) == pytest.approx(joint, rel=1e-7)
    assert density.cumulative(density.greatest) == pytest.approx(1, abs=1e-12)
    assert len(density.wells) == (3 if spring is triple else 2)
    assert density.accuracy < 1e-9


def test_the_probability_of_a_well_is_that_of_its_phase_space():
    """Of Gibbs' density, over -sqrt(2 (saddle - U)) < v < sqrt(2 (saddle - U))."""
    machine = Oscillator(stiffness=0, damping=0.1, law=FORCES[tilted], noise=Noise(0.01))
    density = averaged_density(machine)
    saddle = float(np.sort(np.roots([1, 0, -1, -0.1]).real)[1])
    shares = []
    ends = np.sort(np.roots([0.25, 0, -0.5, -0.1, -tilted(saddle)]).real)
    for low, high in ((ends[0], saddle), (saddle, ends[-1])):

        def inside(x):
            left = max(tilted(saddle) - tilted(x), 0.0)
            return math.exp(-tilted(x) / 0.1) * math.erf(math.sqrt(left / 0.1))

        shares.append(quad(inside, low, high, epsrel=1e-11, limit=400)[0])
    whole = quad(lambda x: math.exp(-tilted(x) / 0.1), -4, 4, points=[-1, 0, 1])[0]
    assert density.within == pytest.approx(np.array(shares) / whole, rel=1e-7)
    level = density.potential(saddle)
    assert density.cumulative(level) == pytest.approx(sum(shares) / whole, rel=1e-7)
    assert density.cumulative(level / 2) < density.cumulative(level)


POINTS, WEIGHTS = np.polynomial.legendre.leggauss(300)
# Shares of the way from one end to the other, from either, crowded twice at both ends.
NEAR = np.sin(math.pi / 2 * np.sin(math.pi / 4 * (POINTS + 1)) ** 2) ** 2
FAR = NEAR[::-1]
SLOPE = (math.pi / 2) ** 2 * np.sin(math.pi * np.sin(math.pi / 4 * (POINTS + 1)) ** 2)
SLOPE *= np.sin(math.pi / 2 * (POINTS + 1)) * WEIGHTS / 2


def orbit(turns, low, high):
    """Period, area and work of -(0.1 + x^2) v - 0.03 sgn v there and back, by Gauss's rule.

    The square of the speed is the product of the distances from the turns, by 2.
    """
    x = low + (high - low) * NEAR
    square = np.full(x.shape, -0.5 + 0j)
    for turn in turns:
        if turn == low:
            square *= (high - low) * NEAR
        elif turn == high:
            square *= -(high - low) * FAR
        else:
            square *= x - turn
    v, dx = np.sqrt(square.real), (high - low) * SLOPE
    return np.array([(dx / v).sum(), v @ dx, -((0.1 + x * x) * v + 0.03) @ dx]) * 2


def test_two_wells_with_friction_and_a_damper_of_their_own():
    machine = Oscillator(
        stiffness=0, law=lambda t, x, v: x - x**3 + 0.1 - (0.1 + x * x) * v,
        friction=Friction(0.03), noise=Noise(0.05),
    )  # fmt: skip
    density = averaged_density(machine)
    left, saddle, right = np.sort(np.roots([1, 0, -1, -0.1]).real)
    top, ground = tilted(saddle), tilted(right)

    def cycle(level, well):
        turns = np.roots([0.25, 0, -0.5, -0.1, -level])
        # Above the saddle two are a pair, and so they are below the bottom of the other well.
        ends = np.sort(turns[turns.imag == 0].real)
        if level > top:
            return orbit(turns, ends[0], saddle) + orbit(turns, saddle, ends[-1])
        return orbit(turns, *(ends[:2] if well < 0 else ends[-2:]))

    z, w = np.polynomial.legendre.leggauss(16)
    order = np.arange(16)
    wide = np.polynomial.legendre.legvander(z, 16)
    fit = (order[:, None] + 0.5) * wide[:, :16].T * w
    rises = [z + 1, *((wide[:, k + 1] - wide[:, k - 1]) / (2 * k + 1) for k in order[1:])]
    sums = np.column_stack(rises) @ fit

    def branch(side, well, depth):
        """Integrals of 1 and of H over one branch, the exponent 0 at the saddle, from there."""
        found, psi = np.zeros(2), 0.0
        for a, b in pairwise(np.linspace(0, 1, 9)):
            s = (a + b) / 2 + (b - a) / 2 * z  # crowded twice at the saddle and the bottom
            inner = np.sin(math.pi / 2 * s) ** 2
            level = top + side * depth * np.sin(math.pi / 2 * inner) ** 2
            slope = depth * (math.pi / 2) ** 2 * np.sin(math.pi * inner)
            slope *= np.sin(math.pi * s) * (b - a) / 2
            T, A, D = np.array([cycle(one, well) for one in level]).T
            rate = side * D / (0.05 * A) * slope
            weight = T * np.exp(psi + sums @ rate) * slope * w
            found += weight.sum(), weight @ (level - ground)
            psi += rate @ w
        return found

    parts = branch(-1, -1, top - tilted(left)) + branch(-1, 1, top - ground) + branch(1, 0, 6.0)
    assert density.mean == pytest.approx(parts[1] / parts[0], rel=2e-7)


@pytest.mark.slow
@pytest.mark.parametrize(
    "stop", [None, Stop(1.2, Hertz(30.0, damping=0.05)), Stop(1.2, KelvinVoigt(30.0, 0.2))]
)
def test_simulated_motions(stop):
    machine = Oscillator(
        stiffness=0, damping=0.01, law=lambda t, x, v: x - x**3 + 0.05 - 0.02 * x * x * v,
        stops=stop or (), noise=Noise(0.006),
    )  # fmt: skip
    density = averaged_density(machine)
    assert density.holds
    found = simulate_ensemble(
        machine, paths=256, duration=4000, transient=800, step=0.02, every=0.4, seed=5,
        initial=(0.5, 0.0),
    )  # fmt: skip
    ground = density.potential(0.0)
    assert density.mean - ground == pytest.approx(
        found.energy.mean, abs=3 * found.energy.mean_error
    )
    assert found.energy.mean_error < 0.02 * density.mean
    x = found.displacement
    of = np.array([density.displacement_density([at])[0] for at in x.centers[::8]])
    off = np.abs(of - x.density[::8])
    assert np.all(off < 4.5 * x.standard_error[::8] + 0.01 * of.max())


TWO = Oscillator(stiffness=0, damping=0.1, law=FORCES[tilted], noise=Noise(0.02))


def test_below_the_saddle_each_well_has_its_own_orbits():
    density = averaged_density(TWO)
    saddle = float(density.potential(np.sort(np.roots([1, 0, -1, -0.1]).real)[1]))
    with pytest.raises(InvalidInput, match="above the saddle"):
        density.period(0.9 * saddle)
    assert density.period(1.5 * saddle) > 0
    assert density.drift(1.5 * saddle) == pytest.approx(
        0.02 - 0.1 * density.diffusion(1.5 * saddle) / (2 * 0.02), rel=1e-9
    )
    low, high = density.reach(0.01)
    assert low > 0  # in the deeper well alone
    assert density.reach(0.9 * saddle)[0] < -1 < 1 < density.reach(0.9 * saddle)[1]
    assert high < 1.3
    assert "2 wells" in density.describe()


def test_the_class_of_a_shape_is_that_of_one_well():
    with pytest.raises(InvalidInput, match="one well"):
        _ = averaged_density(TWO).shape
    with pytest.raises(InvalidInput, match="one well"):
        p_bifurcation(lambda d: replace(TWO, damping=d), [0.1, 0.2])


def test_two_wells_are_drawn():
    axes = plot.averaged_density(averaged_density(TWO))
    assert len(axes) == 3
    assert axes[2].get_title(loc="left") == "2 wells"


def test_two_wells_that_lose_the_mass_over_the_outer_edge():
    leaky = replace(TWO, law=lambda t, x, v: x - x**3 + 0.1 * x**5, noise=Noise(1.0))
    with pytest.raises(InvalidInput, match="contains the motion"):
        averaged_density(leaky)
    quiet = averaged_density(replace(leaky, noise=Noise(1e-3)))
    assert quiet.within.sum() == pytest.approx(1, abs=1e-6)
