"""Viscous damping and Coulomb friction from one decay, against simulated machines."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from impactsig import (
    Friction,
    ImpactsigWarning,
    InvalidInput,
    Recording,
    identify_friction,
    identify_resonance,
    scenes,
    simulate,
)
from impactsig.identify._swings import Machine, decrement, swings

RATIO, FRICTION = 0.02, 0.05
BARE = replace(scenes.begley_virgin(1.0, 100.0, FRICTION, damping_ratio=RATIO), base=None, stops=())


def ring_down(start, rate, duration=60.0, machine=BARE):
    """Displacement of the simulated machine, let go at a place."""
    motion = simulate(machine, duration=duration, initial=(start, 0.3))
    return motion.sample(np.arange(0, duration, 1 / rate))[0]


def noisy(samples, rate, decibels, seed):
    sd = math.sqrt(np.var(samples) / 10 ** (decibels / 10))
    return Recording(samples + sd * np.random.default_rng(seed).standard_normal(len(samples)), rate)


def test_the_closed_form_is_the_motion_to_its_rest():
    time = np.arange(0, 60, 0.02)
    model = swings(Machine(1.0, RATIO, FRICTION, 0.0, 1.7, 0.3), time)
    assert model == pytest.approx(ring_down(1.7, 50), abs=1e-12)


def test_exact_extrema_give_both_dampings():
    """The closed form of a half swing, from which Feeny and Liang's decrement follows."""
    beta = math.exp(-math.pi * RATIO / math.sqrt(1 - RATIO**2))
    levels = [2.0]
    for k in range(8):
        side = 1 if k % 2 == 0 else -1
        levels.append(-beta * (levels[-1] - 0.1) + (1 + beta) * side * FRICTION + 0.1)
    found = decrement(np.array(levels))
    assert found == pytest.approx((RATIO, FRICTION, 0.1), rel=1e-12)


@pytest.mark.parametrize("offset", [0.0, 0.4])
def test_a_clean_decay_is_read_to_many_digits(offset):
    found = identify_friction(Recording(ring_down(1.7, 20) + offset, 20))
    assert found.damping_ratio.value == pytest.approx(RATIO, rel=1e-6)
    assert found.friction.value == pytest.approx(FRICTION, rel=1e-6)
    assert found.centre.value == pytest.approx(offset, abs=1e-6)
    assert found.natural_frequency.value == pytest.approx(1 / (2 * math.pi), rel=1e-6)
    assert found.decrement == pytest.approx((RATIO, FRICTION), rel=0.03)
    assert not found.misfit


@pytest.mark.parametrize("seed", [3, 6013, 6032])
def test_at_twenty_decibels_both_are_within_two_per_cent(seed):
    """Twenty swings at 600 samples a swing, of which the error is 0.7 %."""
    clean = ring_down(6.0, 100, 110)
    found = identify_friction(noisy(clean, 100, 20, seed))
    assert found.damping_ratio.value == pytest.approx(RATIO, rel=0.02)
    assert found.friction.value == pytest.approx(FRICTION, rel=0.02)


@pytest.mark.parametrize("seed", [7128, 7129, 7144])
def test_the_best_of_several_minima_is_found(seed):
    """The sum of squares has one for each number of swings until the mass rests."""
    record = noisy(ring_down(1.7, 20), 20, 20, seed)
    found = identify_friction(record)
    time = np.arange(len(record.samples)) / 20
    truth = swings(Machine(1.0, RATIO, FRICTION, 0.0, 1.7, 0.3), time) - record.samples
    assert found.noise**2 * (len(time) - 6) < float(truth @ truth)
    assert abs(found.friction.value - FRICTION) < 4 * found.friction.error


@pytest.mark.slow
def test_intervals_hold_as_often_as_they_say():
    clean = ring_down(1.7, 20)
    held = []
    for seed in range(9000, 9200):
        found = identify_friction(noisy(clean, 20, 20, seed))
        held.append([
            low < truth < high
            for (_, _, (low, high)), truth in
            ((found.damping_ratio, RATIO), (found.friction, FRICTION))
        ])  # fmt: skip
    assert np.all(np.mean(held, axis=0) >= 0.90)
    assert np.all(np.mean(held, axis=0) <= 0.99)


def test_without_friction_there_is_none():
    machine = replace(BARE, friction=None)
    found = identify_friction(noisy(ring_down(1.7, 20, machine=machine), 20, 30, 1))
    low, high = found.friction.interval
    assert low < 0 < high or abs(found.friction.value) < 3 * found.friction.error
    assert found.damping_ratio.value == pytest.approx(RATIO, rel=0.1)


def test_a_greater_static_friction_does_not_matter():
    machine = replace(BARE, friction=Friction(FRICTION, 1.8 * FRICTION))
    found = identify_friction(Recording(ring_down(1.7, 20, machine=machine), 20))
    assert found.friction.value == pytest.approx(FRICTION, rel=1e-6)
    assert found.damping_ratio.value == pytest.approx(RATIO, rel=1e-6)


def test_one_viscous_mode_does_not_pass_for_it():
    record = noisy(ring_down(1.7, 50), 50, 40, 1)
    with pytest.warns(ImpactsigWarning, match="identify_friction"):
        found = identify_resonance(record, "decay")
    assert found.misfit


def test_another_law_is_a_misfit():
    """Air resistance, of which neither damping knows."""
    time = np.arange(0, 120, 0.05)
    swing = 1 / (1 + 0.1 * time) * np.cos(time + 0.3 / (1 + 0.1 * time))
    rng = np.random.default_rng(0)
    with pytest.warns(ImpactsigWarning, match="do not explain"):
        found = identify_friction(Recording(swing + 1e-3 * rng.standard_normal(len(time)), 20))
    assert found.misfit
    assert "misfit" in repr(found)


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda: identify_friction(np.zeros(100)), "recording"),
        (lambda: identify_friction(Recording(np.linspace(0, 1, 100), 10)), "recording"),
        (lambda: identify_friction(Recording(np.sin(np.arange(100)), 10), level=2), "level"),
    ],
)
def test_bad_input_is_named(call, argument):
    with pytest.raises(InvalidInput) as caught:
        call()
    assert caught.value.argument == argument
