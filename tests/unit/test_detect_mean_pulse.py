"""Pulses that no shape of the family follows, against the shapes that they were made of."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.errors import errors
from impactsig.detect.pulses.shape._ends import LEVELS, read_end


@pytest.mark.parametrize("power", [0.6, 1.0, 1.5, 2.0])
def test_an_edge_of_any_power_begins_where_it_does(power):
    noise, begin = 0.003, 0.3
    u = np.linspace(-2.0, 2.0, 400)
    y = np.maximum(u - begin, 0.0) ** power
    first = np.array([np.argmax(y >= level) for level in LEVELS])
    z, stated = [], []
    for seed in range(20):
        seen = y + noise * np.random.default_rng(seed).standard_normal(len(u))
        at, variance = read_end(u, seen, np.full(len(u), noise**-2.0), first)
        z.append((at - begin) / variance**0.5)
        stated.append(variance**0.5)
    assert np.sqrt(np.mean(np.square(z))) < 1.5
    assert np.median(stated) < 0.06


def test_of_a_step_no_more_is_known_than_between_which_places_it_lies():
    u = np.linspace(-1.0, 1.0, 200)
    y = np.where(u > 0.2, 1.0, 0.0)
    at, variance = read_end(u, y, np.full(len(u), 1e6), np.full(3, np.argmax(y > 0.5)))
    apart = u[1] - u[0]
    assert abs(at - 0.2) < apart
    assert 0.1 * apart < variance**0.5 < 1.1 * apart


# The family followed no fall that is much softer than the rise: instants were 0.3 to 3 samples off
# for a stated 0.1 to 0.3, and contact times up to 10 for 1.
@pytest.mark.parametrize("pulse", ["Hunt-Cr. .5", "two exponentials", "u exp(-6 u)", "two humps"])
def test_pulses_far_from_the_family_are_measured_by_their_mean(pulse):
    rows = errors(pulse, 20e3, 91, count=80, levels=(30.0, 40.0))
    time, contact = (np.array([[r[m], r[f"{m}_error"]] for r in rows]).T for m in NAMES)
    assert np.sqrt(np.mean(time[0] ** 2)) * 20e3 < 0.4
    assert np.sqrt(np.mean((time[0] / time[1]) ** 2)) < 1.7
    assert np.median(time[1]) * 20e3 < 0.4
    assert np.sqrt(np.mean((contact[0] / contact[1]) ** 2)) < 1.7


def test_a_jump_lies_between_two_samples():
    rows = errors("exponential", 20e3, 91, count=80, levels=(30.0, 40.0))
    off, stated = np.array([[r["time"], r["time_error"]] for r in rows]).T * 20e3
    assert np.sqrt(np.mean(off**2)) < 0.6
    assert np.all((stated > 0.25) & (stated < 0.8))


NAMES = ("time", "contact_time")
