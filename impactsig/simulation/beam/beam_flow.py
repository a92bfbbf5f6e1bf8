"""The exact flow of a beam in one regime, and the first zero of the gap or the contact force.

A leg is a stretch of motion in one regime (`_beam_regimes`). What ends it is the first zero of a
signal, a sum of exponentials

    g(t) = g(0) + Re sum_k c_k (exp(lambda_k t) - 1),

the forcing one of them, with lambda = i. From any instant on |g''| <= sum |c_k lambda_k^2
exp(lambda_k t)| and likewise |g'''|, so that conservative advancement (`gap.stays_open`) cannot
step over a zero; near one, roots of parabolas finish in a bracket that is proven to hold it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import inlined, kernel
from ..basis.events import HEAD, LOW, PHASE, ROW_REGIME, TURN, TURNS
from ..exact.gap import stays_open

APART, TOUCHING, AT_REST, AT_BALANCE = range(4)
"""What is known of a leg's start: its signal is not 0; is 0; so is its rate; so is that's rate."""


class Beam(NamedTuple):
    """The tables of a beam and its stop, in the reference unit of time; one row per regime."""

    modes: int
    sizes: np.ndarray  # numbers of eigenvalues, shape (2,)
    rates: np.ndarray  # the eigenvalues lambda, shape (2, k)
    vectors: np.ndarray  # shape (2, 2 modes, k)
    inverse: np.ndarray  # shape (2, k, 2 modes)
    rest: np.ndarray  # shape (2, 2 modes)
    forced: np.ndarray  # complex amplitude, shape (2, 2 modes)
    signal: np.ndarray  # its row over the state, shape (2, 2 modes)
    offset: np.ndarray  # its constant, shape (2,)
    wave: np.ndarray  # complex amplitude of what the base adds to it, shape (2,)
    seen: np.ndarray  # the signal of each eigenvector, shape (2, k)
    beat: np.ndarray  # and of the forced response, shape (2,)
    side: float  # 1 upper, -1 lower
    restitution: float  # -1 for a soft stop
    chatter: float  # share of the greatest approach velocity below which rebounds are summed
    scratch: np.ndarray  # of a leg: coefficients of the signal and their rates, shape (k + 1, 2)


@kernel
def amplitude(beam, i, k, state, turn):
    """C_k of the free motion in regime i, from a state where the forcing is `turn`."""
    total = 0j
    for n in range(2 * beam.modes):
        left = state[n] - beam.rest[i, n] - (beam.forced[i, n] * turn).real
        total += beam.inverse[i, k, n] * left
    return total


@kernel
def begin(beam, i, state, clock):
    """Write the leg's sum of exponentials to scratch; the number of terms, and g at its start."""
    turn = turned(clock[PHASE] + clock[LOW])
    count = beam.sizes[i]
    value = beam.offset[i] + (beam.wave[i] * turn).real
    for n in range(2 * beam.modes):
        value += beam.signal[i, n] * state[n]
    for k in range(count):
        beam.scratch[k, 0] = beam.seen[i, k] * amplitude(beam, i, k, state, turn)
        beam.scratch[k, 1] = beam.rates[i, k]
    beam.scratch[count, 0] = beam.beat[i] * turn
    beam.scratch[count, 1] = 1j
    return count + 1, value


@inlined
def turned(phase):
    """exp(i phase)."""
    return complex(math.cos(phase), math.sin(phase))


@inlined
def evaluate(terms, count, tau):
    """Signal less its start, its three derivatives, and bounds of the last two from tau on."""
    d = g1 = g2 = g3 = most = third = 0.0
    for k in range(count):
        c, rate = terms[k, 0], terms[k, 1]
        gone = math.expm1(rate.real * tau)
        if gone == -1.0:
            d -= c.real
            continue
        sine, cosine = math.sin(rate.imag * tau / 2), math.cos(rate.imag * tau / 2)
        less = 2 * sine * sine
        step = complex(gone * (1 - less) - less, (gone + 1) * 2 * sine * cosine)
        d += (c * step).real
        now = c * (step + 1)
        now *= rate
        g1 += now.real
        now *= rate
        g2 += now.real
        size = abs(now)
        most += size
        third += size * abs(rate)
        g3 += (now * rate).real
    return d, g1, g2, g3, most, third


@inlined
def fourth_bound(terms, count):
    """Bound of the fourth derivative from the start of the leg on."""
    total = 0.0
    for k in range(count):
        square = terms[k, 1].real ** 2 + terms[k, 1].imag ** 2
        total += abs(terms[k, 0]) * square * square
    return total


@kernel
def close(terms, count, start, tau, width, third):
    """Instant in (tau, tau + width] at which g, which falls monotonically, vanishes."""
    low, high = tau, tau + width
    before = math.inf
    d, g1, g2, _g3, _most, _third = evaluate(terms, count, tau)
    gap = start + d
    for _ in range(60):
        square = g1 * g1 - 2 * g2 * gap
        step = 2 * gap / (math.sqrt(square) - g1) if square > 0 else math.inf
        if not (low <= tau + step <= high):
            step = (low + high) / 2 - tau
        elif third * abs(step) ** 3 <= -1e-17 * g1 * tau:
            return tau + step
        elif abs(step) >= before / 2 and abs(step) < 1e-9 * tau:
            return tau
        before = abs(step)
        tau += step
        d, g1, g2, _g3, _most, _third = evaluate(terms, count, tau)
        gap = start + d
        if gap > 0:
            low = tau
        else:
            high = tau
        if g1 >= 0 or high - low <= 2e-16 * high:
            break
    return tau


@kernel
def first_zero(terms, count, start, known, end):
    """Whether g vanishes before `end`, and when; or how far it certainly does not."""
    tau = 0.0
    if known != APART:
        start = 0.0
        _d, g1, g2, g3, _most, third = evaluate(terms, count, 0.0)
        if known == TOUCHING and g1 < 0:
            return True, 0.0
        if known == AT_REST:
            if g2 <= 0:
                return True, 0.0
            tau = 1.5 * g2 / (third + 1e-300)
        elif known == AT_BALANCE:
            if g3 <= 0:
                return True, 0.0
            tau = 2 * g3 / (fourth_bound(terms, count) + 1e-300)
    while tau < end:
        d, g1, g2, g3, most, third = evaluate(terms, count, tau)
        gap = start + d
        if gap <= 0.0 and tau > 0:
            if g1 < 0:
                return True, tau
            start, gap = start - gap, 0.0  # by rounding alone: it is on its way open
        if g1 < 0:
            reach = -2 * gap / g1
            turn = max(g2 + third * reach / 2, 0.0)
            if 2 * turn * gap <= g1 * g1:
                tau = close(terms, count, start, tau, reach, third)
                return tau <= end, min(tau, end)
        step = stays_open(gap, g1, g2, most, third, most, 0.0, third, 0.0)
        tau += max(step, 2e-16 * max(tau, 1e-3))
        if tau > TURN:  # anew, before rounding grows with tau
            break
    return False, min(tau, end)


@kernel
def advance(beam, i, state, phase, tau, after):
    """Write the state tau after a phase to `after`."""
    turn = turned(phase)
    later = turn * turned(tau)
    for n in range(2 * beam.modes):
        after[n] = beam.rest[i, n] + (beam.forced[i, n] * later).real
    for k in range(beam.sizes[i]):
        rate = beam.rates[i, k]
        grown = amplitude(beam, i, k, state, turn)
        grown *= math.exp(rate.real * tau) * turned(rate.imag * tau)
        for n in range(2 * beam.modes):
            after[n] += (beam.vectors[i, n, k] * grown).real


@kernel
def sample(beam, rows, which, turns, phase, states):
    """State at instants, each after the row that `which` names; shape (n, 2 modes)."""
    for k in range(len(turns)):
        row = rows[which[k]]
        tau = (turns[k] - row[TURNS]) * TURN + (phase[k] - row[PHASE])
        advance(beam, int(row[ROW_REGIME]), row[HEAD:], row[PHASE], tau, states[k])
