"""Two pulses that overlap are two; one pulse of any shape is one."""

from __future__ import annotations

import numpy as np
import pytest

import impactsig
from benchmarks.disturbances import bump, records
from benchmarks.recordings import add_pulses, score
from impactsig.detect.pulses._fit import fit_pair
from impactsig.impacts import UNRESOLVED
from tests import naive_force
from tests.halves import half

RATE = 50_000.0
PLACES = np.arange(0.05, 3.9, 0.053)
SHAPES = {
    "half-sine": lambda u: np.sin(np.pi * u),
    "skewed": lambda u: np.sin(np.pi * u**0.7),
    "very skewed": lambda u: np.sin(np.pi * u**0.4),
    "late": lambda u: np.sin(np.pi * u**1.6),
    "flat-topped": lambda u: np.minimum(1.0, 1.6 * np.sin(np.pi * u)),
    "steep": lambda u: np.minimum(1.0, 3.0 * np.sin(np.pi * u)),
    "raised cosine": lambda u: 0.5 - 0.5 * np.cos(2 * np.pi * u),
    "Hertz": lambda u: np.sin(np.pi * u) ** 1.5,
    "triangle": lambda u: 1.0 - np.abs(2 * u - 1),
    "falling": lambda u: 1.0 - u,
    "trapezium": lambda u: np.minimum(1.0, 4 * np.minimum(u, 1 - u)),
    "ripple": lambda u: np.sin(np.pi * u) * (1 + 0.1 * np.sin(6 * np.pi * u)),
}


def record(starts, contact, height, noise, shape=SHAPES["half-sine"], seed=0):
    x = noise * np.random.default_rng(seed).standard_normal(round(4 * RATE))
    count = len(starts)
    add_pulses(x, RATE, starts, np.full(count, contact), np.broadcast_to(height, count), shape)
    return impactsig.Recording(x, RATE, units="N", sensor="force")


@pytest.mark.parametrize(
    ("noise", "apart", "part", "contact"),
    half((0.0, 0.02, 0.05), (0.7, 0.75, 1.0), (0.6, 1.0), (2e-3, 3e-3)),
)
def test_two_pulses_that_overlap_are_measured_as_what_they_are(noise, apart, part, contact):
    starts = np.column_stack((PLACES, PLACES + apart * contact)).ravel()
    heights = np.tile([1.0, part], len(PLACES))
    found = impactsig.detect_impacts(record(starts, contact, heights, noise))
    assert len(found) == len(starts)
    assert not np.any(found.flags & UNRESOLVED)
    assert not found.notes
    off = noise * contact
    np.testing.assert_allclose(found.time, starts, atol=max(0.006 * contact, 2 * off))
    np.testing.assert_allclose(found.contact_time, contact, atol=max(0.01 * contact, 3 * off))
    np.testing.assert_allclose(found.peak, heights, atol=max(0.008, 1.5 * noise))
    impulse = 2 / np.pi * contact * heights
    np.testing.assert_allclose(found.impulse, impulse, atol=max(0.01, 2 * noise) * impulse[0])


def test_contact_times_of_a_pair_at_a_level():
    contact = 2e-3
    starts = np.column_stack((PLACES, PLACES + 0.75 * contact)).ravel()
    heights = np.tile([1.0, 0.7], len(PLACES))
    rec = record(starts, contact, heights, 0.0)
    found = impactsig.detect_impacts(rec, contact_level="20 %")
    np.testing.assert_allclose(
        found.contact_time, contact * (1 - 2 / np.pi * np.arcsin(0.2)), rtol=5e-3
    )
    found = impactsig.detect_impacts(rec, contact_level=0.35)
    np.testing.assert_allclose(
        found.contact_time, contact * (1 - 2 / np.pi * np.arcsin(0.35 / heights)), rtol=5e-3
    )


@pytest.mark.parametrize(("noise", "shape"), half((0.05, 0.02, 0.005, 0.0), tuple(SHAPES)))
def test_one_pulse_of_any_shape_is_one(shape, noise):
    found = impactsig.detect_impacts(record(PLACES, 2e-3, 1.0, noise, SHAPES[shape]))
    assert len(found) == len(PLACES)


@pytest.mark.parametrize(
    ("noise", "sensor"), half((0.05, 0.02, 0.005, 0.0), ((0.2, 0.1), (0.35, 0.3), (0.5, 0.3)))
)
def test_a_sensor_that_rings_makes_no_second_pulse(noise, sensor):
    period, damping = sensor
    # The sensor's period in contacts; its overshoot after the pulse is weak.
    contact, steps = 2e-3, 20
    omega, dt = 2 * np.pi / (period * contact), 1 / (steps * RATE)
    t = np.arange(round(0.02 * RATE) * steps) * dt
    force = np.where(t < contact, np.sin(np.pi * t / contact), 0.0)
    seen = np.zeros(len(t) // steps)
    x = v = 0.0
    for i, f in enumerate(force):
        v += dt * (omega**2 * (f - x) - 2 * damping * omega * v)
        x += dt * v
        if i % steps == 0:
            seen[i // steps] = x
    wave = noise * np.random.default_rng(1).standard_normal(round(4 * RATE))
    for start in PLACES:
        first = round(start * RATE)
        wave[first : first + len(seen)] += seen
    found = impactsig.detect_impacts(impactsig.Recording(wave, RATE, units="N", sensor="force"))
    assert len(found) == len(PLACES)


def test_the_pair_fit_finds_the_least_squares():
    rng = np.random.default_rng(10)
    t = np.arange(70.0)
    for _ in range(40):
        truth = np.array([20.0, 6.0, np.log(30.0), rng.uniform(10, 25), 28.0, np.log(30.0)])
        x = naive_force.pair_shape(t, *truth) + rng.standard_normal(70)
        first = truth + rng.normal(0, [2, 1, 0.05, 2, 1, 0.05])
        p = first.copy()
        misfit = fit_pair(t, x, p)
        residuals = naive_force.pair_residuals(p, t, x)
        assert misfit == pytest.approx(np.sum(residuals[:-1] ** 2) / 70)
        assert np.sum(residuals**2) <= naive_force.fit_pair(t, x, first)[1] + 0.05


@pytest.mark.parametrize(("apart", "least"), [("1.5", 0.95), ("2.0", 0.99)])
def test_touching_pulses_of_all_heights(apart, least):
    case = next(case for case in records() if case.name == f"touching 2 ms, {apart} ms")
    truth = case.make(203)
    rec = impactsig.Recording(truth.samples, truth.rate, sensor="force")
    found = impactsig.detect_impacts(rec)
    f1, _, pairs = score(found.time, truth.time)
    assert f1 >= least
    error = found.contact_time[pairs[:, 0]] - truth.contact_time[pairs[:, 1]]
    assert abs(error.mean()) < 0.05 * 2e-3


def test_a_pair_that_the_samples_do_not_determine_is_measured_one_by_one():
    truth = bump(71, length=0.5, strength=5.0)  # a place where the second of two is next to nothing
    rec = impactsig.Recording(truth.samples, truth.rate, sensor="force")
    assert score(impactsig.detect_impacts(rec).time, truth.time)[0] >= 0.99


def test_faint_pulses_with_a_flat_top_are_one_each():
    # Narrow crests of noise on the shoulders of 12 of these passed for impacts on top of them.
    rng = np.random.default_rng(9)
    starts = 0.05 + np.cumsum(1e-3 * rng.uniform(6, 9, 1500))
    x = rng.standard_normal(round((starts[-1] + 0.05) * 2e5))
    add_pulses(x, 2e5, starts, np.full(1500, 1e-3), np.full(1500, 10**0.5), SHAPES["flat-topped"])
    found = impactsig.detect_impacts(impactsig.Recording(x, 2e5, sensor="force"))
    assert abs(len(found) - 1500) <= 1
    inside = np.searchsorted(starts, found.time + 0.3e-3)
    assert len(np.unique(inside)) == len(found)
