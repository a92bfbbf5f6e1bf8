"""Van der Pol-Duffing with friction and impacts under noise: averaged densities in closed form.

With H the energy, s = H^(1/4), tau = B(1/4, 1/2), kappa_1 = 4 sqrt(2) / tau,
kappa_2 = 4 B(3/4, 3/2) / tau, and b what an impact takes of the energy, times 2:

U = epsilon [4/3 c1 H - kappa_2 c2 H^(3/2) - kappa_1 f H^(1/2) + D] - b/tau H^(5/4)
V^2 = 8/3 epsilon D H,   T = tau/2 H^(-1/4)

the joint density is exp{3/(4 D) [4/3 c1 H - 2/3 kappa_2 c2 H^(3/2) - 2 kappa_1 f H^(1/2)
- 4 b/(5 epsilon tau) H^(5/4)]} and p(H) that by H^(-1/4).
"""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from mpmath import mpf

from impactsig import averaged_density, p_bifurcation, scenes

EPSILON, C1, C2 = 0.01, 3, 1
TAU = mpmath.beta(mpf(1) / 4, mpf(1) / 2)
KAPPA_1 = 4 * mpmath.sqrt(2) / TAU
KAPPA_2 = 4 * mpmath.beta(mpf(3) / 4, mpf(3) / 2) / TAU
LOSS = {
    "linearised": lambda r: 4 * (1 - r),
    "exact": lambda r: 2 * (1 - r**2),
    "logarithmic": lambda r: -4 * mpmath.log(r),
}


def exponent(s, r, f, d, impact):
    """Of the joint density, at H = s^4."""
    b = LOSS[impact](mpf(r))
    terms = (
        mpf(4) / 3 * C1 * s**4
        - mpf(2) / 3 * KAPPA_2 * C2 * s**6
        - 2 * KAPPA_1 * f * s**2
        - 4 * b / (5 * mpf(EPSILON) * TAU) * s**5
    )
    return mpf(3) / (4 * mpf(d)) * terms


def mean_and_sd(r, f, d, impact):
    with mpmath.workdps(25):
        # With H = s^4 the pole of p(H) at 0 is gone: H^(-1/4) dH = 4 s^2 ds.
        def moment(k):
            return mpmath.quad(
                lambda s: s ** (2 + 4 * k) * mpmath.exp(exponent(s, r, f, d, impact)),
                [0, 0.5, 1, 1.5, 2, 2.5, 3, 4],
            )

        whole, first, second = map(moment, range(3))
        mean = first / whole
        return float(mean), float(mpmath.sqrt(second / whole - mean**2))


def extrema(r, f, impact):
    """Energies above 0 at which the joint density has an extremum: roots of a quartic in s."""
    b = float(LOSS[impact](mpf(r)) / (EPSILON * TAU))
    roots = np.roots([-float(KAPPA_2) * C2, -b, 4 / 3 * C1, 0, -float(KAPPA_1) * f])
    real = roots[(np.abs(roots.imag) < 1e-9) & (roots.real > 1e-9)].real
    return np.sort(real**4)


def fold(r, impact):
    """Friction at which a maximum and a minimum meet: the quartic has a double root."""
    b = float(LOSS[impact](mpf(r)) / (EPSILON * TAU))
    roots = np.roots([4 * float(KAPPA_2) * C2, 3 * b, -8 / 3 * C1])
    s = roots[roots > 0][0]
    return (4 / 3 * C1 * s**2 - float(KAPPA_2) * C2 * s**4 - b * s**3) / float(KAPPA_1)


@pytest.mark.parametrize("impact", LOSS)
@pytest.mark.parametrize(
    ("r", "f", "d"),
    [(0.99, 1, 1), pytest.param(0.95, 1, 1, marks=pytest.mark.slow), (0.99, 0, 1), (0.8, 2, 0.3)],
)
def test_mean_and_deviation_of_the_energy(r, f, d, impact):
    density = averaged_density(scenes.van_der_pol_duffing(r, f, d), impact=impact)
    assert (density.mean, density.sd) == pytest.approx(mean_and_sd(r, f, d, impact), rel=1e-12)
    assert density.accuracy < 1e-12


@pytest.mark.parametrize(
    ("r", "mean", "sd", "digit"),
    [(0.99, 9.8676, 3.1942, 1e-4), (0.95, 0.56534, 0.57321, 1e-5)],
)
def test_the_reference_values(r, mean, sd, digit):
    density = averaged_density(scenes.van_der_pol_duffing(r, 1), impact="linearised")
    assert (density.mean, density.sd) == pytest.approx((mean, sd), abs=digit / 2)


@pytest.mark.parametrize("impact", LOSS)
def test_period_drift_diffusion_and_density(impact):
    r, f, d = 0.97, 1.3, 0.7
    density = averaged_density(scenes.van_der_pol_duffing(r, f, d), impact=impact)
    H = np.array([1e-9, 1e-3, 0.4, 3.0, 20.0])
    tau, b = float(TAU), float(LOSS[impact](mpf(r)))
    assert density.period(H) == pytest.approx(tau / 2 * H**-0.25, rel=1e-12)
    assert density.diffusion(H) == pytest.approx(8 / 3 * EPSILON * d * H, rel=1e-12)
    gained = 4 / 3 * C1 * H - float(KAPPA_2) * C2 * H**1.5 - float(KAPPA_1) * f * H**0.5 + d
    assert density.drift(H) == pytest.approx(EPSILON * gained - b / tau * H**1.25, rel=1e-11)
    shape = [float(h**-0.25 * mpmath.exp(exponent(h**0.25, r, f, d, impact))) for h in H]
    p = density.energy_density(H)
    assert p / p[2] == pytest.approx(np.array(shape) / shape[2], rel=1e-11)
    # p(x, v) = p(H) / T(H), the velocity being of either sign.
    assert density.joint_density(0.0, np.sqrt(2 * H)) == pytest.approx(p / (tau / 2 * H**-0.25))


@pytest.mark.parametrize("impact", LOSS)
@pytest.mark.parametrize(("r", "f"), [(0.99, 1), (0.99, 2.5), (0.98, 0.01), (0.95, 0)])
def test_extrema_of_the_joint_density(r, f, impact):
    shape = averaged_density(scenes.van_der_pol_duffing(r, f), impact=impact).shape
    assert shape.energy[1:] == pytest.approx(extrema(r, f, impact), rel=1e-9)
    assert shape.name == ("crater with peak" if f else "crater")
    for low, high in zip(shape.height[:-1], shape.height[1:], strict=True):
        assert low != high


def test_the_reference_extrema():
    shape = averaged_density(scenes.van_der_pol_duffing(0.99), impact="linearised").shape
    assert shape.energy == pytest.approx([0, 0.105, 9.928], abs=5e-4)
    assert shape.maximum.tolist() == [True, False, True]


def test_noise_changes_heights_and_no_shape():
    diagram = p_bifurcation(
        lambda intensity: scenes.van_der_pol_duffing(0.99, 2, intensity), [0.03, 0.3, 1, 10]
    )
    assert diagram.transitions == ()
    for shape in diagram.shapes:
        assert shape.energy == pytest.approx(diagram.shapes[0].energy, rel=1e-9)
    contrast = [shape.height[1] / shape.height[0] for shape in diagram.shapes]
    assert np.all(np.diff(contrast) > 0)  # the hollow fills


@pytest.mark.parametrize("impact", LOSS)
def test_transitions_are_where_the_quartic_has_a_double_root(impact):
    over_friction = p_bifurcation(
        lambda friction: scenes.van_der_pol_duffing(0.99, friction), [0, 1.5, 3], impact=impact
    )
    begins, ends = over_friction.transitions
    assert begins.value == pytest.approx(0, abs=1e-9)
    assert (begins.before, begins.after) == ("crater", "crater with peak")
    assert ends.value == pytest.approx(fold(0.99, impact), rel=1e-9)
    assert (ends.before, ends.after) == ("crater with peak", "peak")
    over_restitution = p_bifurcation(
        lambda restitution: scenes.van_der_pol_duffing(restitution, 1), [0.95, 0.99], impact=impact
    )
    (found,) = over_restitution.transitions
    assert fold(found.value, impact) == pytest.approx(1, rel=1e-8)


@pytest.mark.parametrize("impact", LOSS)
def test_the_papers_sequences(impact):
    """One peak, three, two over r; over f_k a crater, a new central peak, that peak alone."""
    over_restitution = p_bifurcation(
        lambda restitution: scenes.van_der_pol_duffing(restitution, 1),
        [0.95, 0.975, 0.98, 0.99], impact=impact, least=0.02, tolerance=0.05,
    )  # fmt: skip
    assert over_restitution.peaks.tolist() == [1, 3, 3, 2]
    over_friction = p_bifurcation(
        lambda friction: scenes.van_der_pol_duffing(0.99, friction),
        [0, 2, 2.5, 3], impact=impact, least=0.02, tolerance=0.05,
    )  # fmt: skip
    assert over_friction.peaks.tolist() == [2, 3, 3, 1]
    assert over_friction.classes == ("crater", "crater with peak", "crater with peak", "peak")
