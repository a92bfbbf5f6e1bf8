"""Which measured instants are impacts of the oscillator, and which of its states each one is.

States near the attractor, from short simulated orbits, represent all states of the oscillator. One
is followed by the next of its orbit, or by a state close to that; a measured instant belongs to a
state within the jitter, or is false; between two there may be missed impacts. The most likely
course through the whole train is found by Viterbi's algorithm.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import njit

kernel = njit(nogil=True, error_model="numpy")

AHEAD = 3  # further states of each simulated orbit: a leg may pass over two missed impacts
BESIDE = 16  # states beside the next one that it may go on to
WIDE = 0.3  # how wide they count: of the jitter, and of `NEAR` in velocity
NEAR = 0.06  # of gap and natural time: moves the next impacts by about a jitter
FARTHEST = 5.0  # standard deviations that an instant may be off
FORGET = 25.0  # logarithm of the likelihood below the best, from which a state is given up
LOST = 1e-3  # chance that the course breaks off, and begins anew anywhere
FALSE, BEGINS = -1, 9  # kinds of instants; others: how many impacts were missed before


class Chain(NamedTuple):
    """What the measuring chain does."""

    jitter: float  # forcing periods
    missed: float
    spurious: float


@kernel
def _beside(phase, approach, live, jitter, near, weight):
    """The live states nearest to each, and logarithms of how much they count."""
    n, count = near.shape
    best = np.empty(count)
    for i in range(n):
        best[:] = 1e30
        near[i] = 0
        for j in range(n):
            if not live[j]:
                continue
            off = phase[i] - phase[j]
            off -= np.rint(off)
            square = (off / jitter) ** 2
            if square >= best[count - 1]:
                continue
            square += ((approach[i] - approach[j]) / NEAR) ** 2
            if square >= best[count - 1]:
                continue
            place = count - 1
            while place > 0 and best[place - 1] > square:
                best[place] = best[place - 1]
                near[i, place] = near[i, place - 1]
                place -= 1
            best[place] = square
            near[i, place] = j
        total = 0.0
        for place in range(count):
            best[place] = -0.5 * best[place] / (WIDE * WIDE)
            total += math.exp(best[place])
        for place in range(count):
            weight[i, place] = best[place] - math.log(max(total, 1e-300))


@kernel
def likeliest(x, approach, seen, joined, chain, node, kind):
    """The likeliest course of an oscillator through a train.

    Parameters
    ----------
    x, approach : ndarray, shape (orbits, steps + AHEAD)
        Instants in forcing periods, with the phase of the measured ones, and approach velocities.
    seen : ndarray, shape (n,)
        Measured instants.
    joined : ndarray of bool, shape (n - 1,)
    chain : Chain
    node : ndarray, shape (n, 2)
        Gets instants and approach velocities.
    kind : ndarray of int, shape (n,)
        Gets FALSE, BEGINS where no orbit leads there, or how many impacts were missed before.
    """
    sigma, steps = chain.jitter, x.shape[1]
    x, approach = x.ravel(), approach.ravel()
    states, n = len(x), len(seen)
    phase = x - np.floor(x)
    live = np.arange(states) % steps < steps - AHEAD
    near = np.empty((states, BESIDE), np.int64)
    weight = np.empty((states, BESIDE))
    _beside(phase, approach, live, sigma, near, weight)
    even = -math.log(live.sum())
    density = -math.log(math.sqrt(2 * math.pi) * sigma)
    passed = np.empty(AHEAD)
    for s in range(AHEAD):
        passed[s] = s * math.log(chain.missed) + math.log((1 - chain.missed) * (1 - chain.spurious))
    score = np.full((3, states), -np.inf)  # of the last three instants, in turn
    best = np.zeros(n, np.int64)
    back, code = np.full((n, states), -1, np.int32), np.zeros((n, states), np.int8)
    for k in range(n):
        now = score[k % 3]
        now[:] = -np.inf
        for layer in range(2):  # the instant before, or the one before that if that is false
            last = k - 1 - layer
            if last < 0 or not joined[last] or not joined[k - 1]:
                continue
            old = score[last % 3]
            least = old[best[last]] - FORGET
            paid = layer * math.log(chain.spurious)
            for j in range(states):
                if not old[j] >= least:
                    continue
                off = seen[last] - phase[j]
                start = seen[last] - (off - np.rint(off))
                for s in range(AHEAD):
                    image = j + 1 + s
                    late = seen[k] - (start + x[image] - x[j])
                    if late < -2 * FARTHEST * sigma:
                        break
                    if late > 2 * FARTHEST * sigma:
                        continue
                    for q in range(BESIDE):
                        i = near[image, q]
                        off = phase[i] - phase[image]
                        off = late - (off - np.rint(off))
                        if abs(off) > FARTHEST * sigma:
                            continue
                        reached = old[j] + paid + passed[s] + weight[image, q]
                        reached += density - 0.5 * (off / sigma) ** 2
                        if reached > now[i]:
                            now[i] = reached
                            back[k, i] = j + layer * states
                            code[k, i] = s
        anew = even + density
        if k > 0:
            anew += score[(k - 1) % 3, best[k - 1]] + math.log(LOST)
        for i in range(states):
            if not live[i]:
                continue
            off = seen[k] - phase[i]
            reached = anew - 0.5 * ((off - np.rint(off)) / sigma) ** 2
            if reached > now[i]:
                now[i] = reached
                back[k, i] = best[k - 1] if k > 0 else -1
                code[k, i] = BEGINS
        best[k] = np.argmax(now)
    k, i = n - 1, best[n - 1]
    while k >= 0:
        off = seen[k] - phase[i]
        node[k, 0], node[k, 1] = seen[k] - (off - np.rint(off)), approach[i]
        kind[k] = code[k, i]
        before = back[k, i]
        k -= 1
        if before >= states:
            kind[k] = FALSE
            k -= 1
            before -= states
        i = before
