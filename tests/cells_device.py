"""Functions of one cell that run on CPUs and on a GPU; and some that do not."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from impactsig import scenes


class Orbit(NamedTuple):
    last: float
    mean: float
    above: int


class Impacts(NamedTuple):
    phases: tuple[float, float, float]
    velocity: float


def logistic(growth, start):
    """The logistic map: only operations that IEEE 754 rounds one way."""
    x, total, above = start, 0.0, 0
    for _ in range(100):
        x = growth * x * (1 - x)
        total += x
        if x > 0.5:
            above += 1
    return Orbit(x, total / 100, above)


compiled_logistic = njit(logistic)


def bouncing(restitution, amplitude, phase=0.3):
    """A ball on a table that shakes by little: the map of its impacts, from one to the next."""
    velocity = 1.0
    before = phase
    for _ in range(10):
        before, phase = phase, phase + velocity
        velocity = restitution * velocity + amplitude * math.cos(phase)
    return Impacts((before, phase, phase - before), velocity)


@njit
def scrambled(seed):
    """SplitMix64's output function."""
    z = np.uint64(seed)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@njit
def of_seed(a, seed):
    return a + float(scrambled(seed) >> np.uint64(11)) * 2.0**-53


def count(n, step):
    """Whole numbers, and a tuple of two types."""
    return n // step, n / step


def complex_power(a, n):
    z = complex(a, 1.0)
    for _ in range(n):
        z = z * z / 4
    return z


def quotient(a, b):
    if b == 3:
        raise ValueError("three")
    return a / b


def an_array(a):
    return np.array([a, a])


def no_number(a):
    return a, (a, a)


def maybe(a):
    if a > 1:
        return a
    return None


def of_strings(a):
    return float(f"{a:.3}")


def walls(gamma, friction):
    """A machine with friction between two rigid stops."""
    return scenes.begley_virgin(gamma, 1.5, friction)
