"""The forcing period: the least time after which all forcing of an oscillator recurs."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

LARGEST = 8  # periods of the first frequency that the forcing period may have
ROUNDING = 1e-13  # relative: frequencies in a ratio of whole numbers have it but for rounding
INSTANTS = 64  # at which a law is compared with itself a period later, in one of some states
STATES = (0.0, 0.0), (0.7, 0.4), (-0.3, 1.1), (1.3, -0.6), (-1.6, -0.9)
SAME = 1e-9  # of the greatest force of a law: what its values one period apart may differ by
GOLDEN = (math.sqrt(5) - 1) / 2

Law = Callable[[float, float, float], float]


class Recurrence(NamedTuple):
    """The angular frequency of the forcing period, and whether the forcing does recur after it."""

    frequency: float
    recurs: bool


@lru_cache(maxsize=256)
def recurrence(frequencies: tuple[float, ...], law: Law | None, size: float) -> Recurrence:
    """Least common period of some frequencies and a law; that of the first if there is none.

    The period has a whole number of periods of every frequency, and at most `LARGEST` of the
    first. A law is evaluated at displacements and velocities of the order of `size`.
    """
    first = frequencies[0]
    periods = 1
    for frequency in frequencies[1:]:
        quotient = frequency / first
        if not 0.0 < quotient < math.inf:  # too far apart for a float
            return Recurrence(first, False)
        ratio = Fraction(quotient).limit_denominator(LARGEST)
        if abs(quotient - float(ratio)) > ROUNDING * quotient:
            return Recurrence(first, False)
        periods = math.lcm(periods, ratio.denominator)
    if law is None:
        return Recurrence(first / periods, True) if periods <= LARGEST else Recurrence(first, False)
    for several in range(periods, LARGEST + 1, periods):
        if repeats(law, several * math.tau / first, size, size * first):
            return Recurrence(first / several, True)
    return Recurrence(first, False)


def repeats(law: Law, period: float, length: float, speed: float) -> bool:
    """Whether a law has the same values one period later, at all instants and states tried.

    Where it has no value it is not compared; a law without any does not repeat.
    """
    greatest = [0.0] * len(STATES)
    differences = []
    for k in range(INSTANTS):
        # Irregular, so that no instant falls on a jump of the law but for bad luck.
        t = period * (k % 8 + (k + 1) * GOLDEN % 1)
        state = k % len(STATES)
        x, v = STATES[state]
        now, later = (_value(law, at, x * length, v * speed) for at in (t, t + period))
        if math.isfinite(now) != math.isfinite(later):
            return False
        if math.isfinite(now):
            greatest[state] = max(greatest[state], abs(now), abs(later))
            differences.append((state, abs(later - now)))
    return bool(differences) and all(off <= SAME * greatest[own] for own, off in differences)


def _value(law: Law, t: float, x: float, v: float) -> float:
    try:
        return float(law(t, x, v))
    except Exception:  # what a simulation calls a broken law
        return math.nan
