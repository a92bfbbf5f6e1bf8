"""Restitution of a soft stop and its inverses, against integrated contacts and the simulator."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from impactsig import (
    InvalidInput,
    KelvinVoigt,
    Oscillator,
    Stop,
    simulate,
    stop_damping,
    stop_restitution,
    stop_stiffness,
)

FORMULAS = ("gap", "force", "work")


def returned(stiffness, damping, mass, ends):
    """What a contact returns, at 40 digits, from the roots of its characteristic equation."""
    with mpmath.workdps(40):
        k, c, m = (mpmath.mpf(x) for x in (stiffness, damping, mass))
        root = mpmath.sqrt(c * c - 4 * k * m + 0j)
        one, other = (-c + root) / (2 * m), (-c - root) / (2 * m)

        def depth(t):
            return (mpmath.exp(one * t) - mpmath.exp(other * t)) / (one - other)

        def speed(t):
            return (one * mpmath.exp(one * t) - other * mpmath.exp(other * t)) / (one - other)

        def over(t):
            return mpmath.re(depth(t) if ends == "gap" else k * depth(t) + c * speed(t))

        period = 2 * mpmath.pi * mpmath.sqrt(m / k)
        low, step = period / 1e6, period / 200
        while over(low + step) > 0:
            low += step
        end = mpmath.findroot(over, (low, low + step), solver="anderson", tol=1e-60)
        return float(-mpmath.re(speed(end)))


@pytest.mark.parametrize(
    ("stiffness", "damping"), [(2e5, 63.3704), (2000, 6.33704), (500, 3.16852), (100, 1.41701)]
)
def test_dampings_of_the_paper(stiffness, damping):
    assert stop_damping(0.8, stiffness) == pytest.approx(damping, rel=4e-6)


@pytest.mark.parametrize("ends", ["gap", "force"])
@pytest.mark.parametrize("ratio", [1e-3, 0.1, 0.7, 0.999, 1.5, 20.0])
def test_restitution_is_that_of_the_contact(ends, ratio):
    stiffness, mass = 3e4, 2.5
    damping = 2 * ratio * math.sqrt(stiffness * mass)
    r = stop_restitution(stiffness, damping, mass, formula=ends)
    if ends == "gap" and ratio >= 1:
        assert r == 0
    else:
        assert r == pytest.approx(returned(stiffness, damping, mass, ends), rel=1e-12)


def test_critical_damping_joins_both_sides():
    at = [stop_restitution(1, 2 * beta, formula="force") for beta in (1 - 1e-9, 1, 1 + 1e-9)]
    assert at == pytest.approx([math.exp(-2)] * 3, rel=1e-8)


def test_all_formulas_agree_where_little_is_lost():
    r = 1 - 1e-7
    dampings = [stop_damping(r, 1e4, formula=formula) for formula in FORMULAS]
    assert dampings == pytest.approx([2 * 1e-7 * 100 / math.pi] * 3, rel=1e-6)


@given(
    st.floats(1e-6, 1 - 1e-6),
    st.floats(1e-3, 1e12),
    st.floats(1e-3, 1e3),
    st.sampled_from(FORMULAS),
)
def test_inverses_invert(r, stiffness, mass, formula):
    damping = stop_damping(r, stiffness, mass, formula=formula)
    # Where nearly all is kept or lost, r hardly says what the damping was.
    slack = 1e-13 / r**2 if formula == "work" else 1e-13
    assert stop_restitution(stiffness, damping, mass, formula=formula) == pytest.approx(
        r, rel=slack
    )
    assert stop_stiffness(r, damping, mass, formula=formula) == pytest.approx(stiffness, rel=1e-12)


@pytest.mark.parametrize("ends", ["gap", "force"])
@pytest.mark.parametrize("r", [0.05, 0.6, 0.85, 1.0])
def test_a_simulated_contact_returns_it(ends, r):
    law = KelvinVoigt.equivalent(r, 1e8, 2.0, ends)
    free = Oscillator(mass=2.0, stiffness=0.0, stops=(Stop(1.0, law),))
    motion = simulate(free, duration=1.0, initial=(0.9, 0.7))
    assert motion.impact_count == 1
    assert motion.final[1] == pytest.approx(-0.7 * r, rel=1e-12)


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda: stop_damping(0.0, 1.0), "restitution"),
        (lambda: stop_damping(1.1, 1.0), "restitution"),
        (lambda: stop_damping(0.5, 0.0), "stiffness"),
        (lambda: stop_damping(0.5, 1.0, -1.0), "mass"),
        (lambda: stop_damping(0.5, 1.0, formula="D"), "formula"),
        (lambda: stop_stiffness(1.0, 1.0), "restitution"),
        (lambda: stop_stiffness(0.5, 0.0), "damping"),
        (lambda: stop_restitution(1.0, -1.0), "damping"),
        (lambda: stop_restitution(1.0, 0.4, formula="work"), "damping"),
        (lambda: stop_restitution(math.nan, 0.4), "stiffness"),
        (lambda: KelvinVoigt.equivalent(0.5, 1.0, ends="never"), "ends"),
        (lambda: KelvinVoigt.equivalent(np.sin, 1.0), "restitution"),
    ],
)
def test_bad_input_is_named(call, argument):
    with pytest.raises(InvalidInput) as caught:
        call()
    assert caught.value.argument == argument


def test_no_work_is_left_at_the_greatest_damping():
    assert stop_restitution(1.0, 1 / math.pi, formula="work") == pytest.approx(0, abs=1e-7)
    assert stop_damping(0.0, 1.0, formula="work") == pytest.approx(1 / math.pi, rel=1e-15)
