"""Soft stops made equivalent to rigid ones, against Tian's printed optimum and exact contacts."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from scipy.optimize import differential_evolution

from impactsig import (
    ContactSamples,
    InvalidInput,
    KelvinVoigt,
    equivalence_error,
    fit_soft_stop,
    stop_damping,
)
from impactsig.dynamics.contacts._annealed_evolution import minimise

PRINTED = KelvinVoigt(1e4, 10.3288336)


def exact(stop, samples, n):
    """Contact time and velocity after it, at 30 digits, from the closed form of the motion."""
    with mpmath.workdps(30):
        z, w, a, phi, v = (
            mpmath.mpf(float(x[n]))
            for x in (
                samples.damping_ratio, samples.angular_frequency, samples.amplitude, samples.phase,
                samples.velocity,
            )
        )  # fmt: skip
        kappa, drag = 1 + mpmath.mpf(stop.stiffness), 2 * z + mpmath.mpf(stop.damping)
        rest = -mpmath.mpf(samples.gap) / kappa
        response = a * mpmath.expj(phi) / (kappa - w * w + 1j * w * drag)

        def steady(t):
            return rest + mpmath.im(response * mpmath.expj(w * t))

        def steady_speed(t):
            return w * mpmath.re(response * mpmath.expj(w * t))

        root = mpmath.sqrt(drag * drag - 4 * kappa + 0j)
        one, other = (-drag + root) / 2, (-drag - root) / 2
        # Free motion from what the forced response leaves over.
        x0, v0 = -steady(0), v - steady_speed(0)
        p = (v0 - other * x0) / (one - other)
        q = x0 - p

        def depth(t):
            return mpmath.re(p * mpmath.exp(one * t) + q * mpmath.exp(other * t)) + steady(t)

        def speed(t):
            free = p * one * mpmath.exp(one * t) + q * other * mpmath.exp(other * t)
            return mpmath.re(free) + steady_speed(t)

        step = 2 * mpmath.pi / mpmath.sqrt(kappa) / 400
        low = step / 1000
        while depth(low + step) > 0:
            low += step
        end = mpmath.findroot(depth, (low, low + step), solver="anderson", tol=1e-45)
        return float(end), float(speed(end))


@pytest.mark.parametrize(("stiffness", "damping"), [(1e4, 10.3), (100, 1.0), (10, 30.0), (2, 0)])
def test_contacts_are_exact(stiffness, damping):
    stop, samples = KelvinVoigt(stiffness, damping), ContactSamples.draw(8, seed=3)
    error = equivalence_error(stop, 0.85, samples)
    for n in range(len(samples)):
        lasts, leaves = exact(stop, samples, n)
        assert error.contact_time[n] == pytest.approx(lasts, rel=1e-13)
        assert error.velocity[n] == pytest.approx(
            leaves + 0.85 * samples.velocity[n], abs=1e-13 * samples.velocity[n]
        )
    e_g = np.sqrt(np.mean(error.velocity**2 + error.contact_time**2))
    assert error.value == pytest.approx(e_g, rel=1e-14)


def test_printed_optimum_has_the_error_of_the_reference():
    errors = [
        equivalence_error(PRINTED, 0.85, ContactSamples.draw(4000, seed=seed)).value
        for seed in range(3)
    ]
    assert min(errors) > 0.0310
    assert max(errors) < 0.0314


def test_fit_finds_the_printed_optimum_within_the_spread_of_the_boxes():
    fit = fit_soft_stop(0.85, seed=0)
    assert fit.converged
    assert fit.stop.stiffness == 1e4
    assert fit.at_edge == ("stiffness",)
    assert 10.285 <= fit.stop.damping <= 10.454
    assert fit.stop.damping == pytest.approx(stop_damping(0.85, 1e4), rel=0.01)
    assert fit.error.value <= equivalence_error(PRINTED, 0.85).value
    assert np.all(np.diff(fit.course) <= 0)
    assert fit.course[-1] == pytest.approx(fit.error.value, rel=1e-12)


def test_no_worse_than_scipy_in_no_more_evaluations():
    samples = ContactSamples.draw(300, seed=0)

    def objective(x):
        return equivalence_error(KelvinVoigt(*np.exp(x)), 0.85, samples).value

    box = np.log([(10.0, 1e4), (0.1, 1e3)])
    ours = [fit_soft_stop(0.85, samples=samples, seed=seed) for seed in range(2)]
    peers = [differential_evolution(objective, box, rng=seed) for seed in range(2)]
    assert max(fit.error.value for fit in ours) <= min(peer.fun for peer in peers) * (1 + 1e-8)
    assert sum(fit.evaluations for fit in ours) <= sum(peer.nfev for peer in peers)


def test_evolution_finds_the_lowest_of_many_hollows():
    def rastrigin(x):
        return float(np.sum((x - 0.7) ** 2 + 1 - np.cos(2 * np.pi * (x - 0.7))))

    edges = np.full(2, 5.0)
    found = [
        minimise(rastrigin, -edges, edges, np.random.default_rng(seed), 1e-9, 5000)
        for seed in range(10)
    ]
    at_the_bottom = [np.allclose(minimum.x, 0.7, atol=1e-5) for minimum in found]
    assert sum(at_the_bottom) >= 8


def test_same_seed_same_fit():
    samples = ContactSamples.draw(50, seed=0)
    one, other = (fit_soft_stop(0.7, seed=5, samples=samples) for _ in range(2))
    assert one.stop == other.stop


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda: equivalence_error("soft", 0.8), "stop"),
        (lambda: equivalence_error(KelvinVoigt(1e4, 10, "force"), 0.8), "stop"),
        (lambda: equivalence_error(PRINTED, 1.5), "restitution"),
        (lambda: equivalence_error(PRINTED, 0.8, samples=[1]), "samples"),
        (lambda: fit_soft_stop(0.8, stiffness=(0, 1)), "stiffness"),
        (lambda: fit_soft_stop(0.8, damping=(3, 1)), "damping"),
        (lambda: fit_soft_stop(0.8, evaluations=3), "evaluations"),
        (lambda: fit_soft_stop(0.8, seed="a"), "seed"),
        (lambda: ContactSamples.draw(0), "count"),
        (lambda: ContactSamples.draw(angular_frequency=(0, 1)), "angular_frequency"),
        (lambda: ContactSamples.draw(gap=-1.0), "gap"),
        (lambda: ContactSamples([1.0], [1.0], [0.0], [-1.0], [0.1]), "velocity"),
        (lambda: ContactSamples([1.0, 2.0], [1.0], [0.0], [1.0], [0.1]), "amplitude"),
        (lambda: ContactSamples([1.0], [1.0], [np.nan], [1.0], [0.1]), "phase"),
    ],
)
def test_bad_input_is_named(call, argument):
    with pytest.raises(InvalidInput) as caught:
        call()
    assert caught.value.argument == argument
