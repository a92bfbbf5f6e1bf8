"""Accumulate counts and sums over sampled states, which are not stored."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..._compiling.compiled import inlined, kernel
from ...oscillators.laws import EXPONENT, HERTZ, LAW, PLACE, SIDE, STIFFNESS
from .equation import ground_at

# Columns of `Kept.sums`.
ENERGY, ENERGY2, DISPLACEMENT, DISPLACEMENT2, VELOCITY, VELOCITY2, SUMS = range(7)
SIMPSON = 32  # parts of an integral of the law beyond its table


class Potential(NamedTuple):
    """Potential energy per mass of spring, load and law."""

    kappa: float
    constant: float
    start: float
    width: float  # of a cell of the table; 0 where there is no law
    value: np.ndarray  # of the law's part at the nodes
    slope: np.ndarray
    mass: float


class Kept(NamedTuple):
    """Counts of one group of paths, and sums for each of its paths."""

    edges: np.ndarray  # shape (3, 2): least value and cells per unit, of energy, x and v
    energy: np.ndarray  # int32, shape (lanes, n)
    x: np.ndarray
    v: np.ndarray
    joint: np.ndarray  # int32, shape (lanes, m, m), over x and v
    sums: np.ndarray  # float64, shape (lanes, SUMS)
    course: np.ndarray  # float64, shape (lanes, slices): sums of the energy
    looks: np.ndarray  # int64, shape (lanes,)


@kernel
def forces(law, x, out):
    """Static force of the law at t = 0."""
    for i in range(len(x)):
        out[i] = law(0.0, x[i], 0.0)


@inlined
def potential_at(u, law, x):
    """Potential energy per mass, 0 at x = 0."""
    energy = (0.5 * u.kappa * x - u.constant) * x
    if u.width == 0.0 or not math.isfinite(x):  # what has run away has no place in the table
        return energy
    last = len(u.value) - 1
    place = (x - u.start) / u.width
    i = int(min(max(place, 0.0), last - 1.0))
    s = min(max(place - i, 0.0), 1.0)
    left, right = u.width * u.slope[i], u.width * u.slope[i + 1]
    rise = u.value[i + 1] - u.value[i]
    cubic = left + s * (3 * rise - 2 * left - right + s * (left + right - 2 * rise))
    energy += u.value[i] + s * cubic
    if 0.0 <= place <= last:
        return energy
    edge = u.start if place < 0 else u.start + last * u.width
    part = (x - edge) / SIMPSON
    total = law(0.0, edge, 0.0) + law(0.0, x, 0.0)
    for j in range(1, SIMPSON):
        total += (4 if j % 2 else 2) * law(0.0, edge + j * part, 0.0)
    return energy - total * part / 3 / u.mass


@kernel
def contact_energy(p, q):
    """Elastic energy of the soft stops, per mass."""
    energy = 0.0
    for k in range(len(p.soft)):
        depth = p.soft[k, SIDE] * (q - p.soft[k, PLACE])
        if depth > 0:
            n = p.soft[k, EXPONENT] if p.soft[k, LAW] == HERTZ else 1.0
            energy += p.soft[k, STIFFNESS] * depth ** (n + 1) / (n + 1)
    return energy


@kernel
def energies(p, u, law, seen, first, apart, out):
    """Energy of every sampled state, in the oscillator's units."""
    for lane in range(seen.shape[0]):
        for i in range(seen.shape[1]):
            x, v = seen[lane, i, 0], seen[lane, i, 1]
            energy = 0.5 * v * v + potential_at(u, law, x)
            if len(p.soft) > 0:
                at, _ = ground_at(p, first + i * apart)
                energy += contact_energy(p, x - at)
            out[lane, i] = p.mass * energy


@kernel
def cell(value, edges, size):
    """Index of the histogram cell of a value; -1 if outside."""
    place = (value - edges[0]) * edges[1]
    return int(place) if 0 <= place < size else -1


@kernel
def keep(kept, seen, energy, total):
    """Add sampled states to counts and sums; each path has `total` samples."""
    slices, coarse = kept.course.shape[1], kept.joint.shape[1]
    share = coarse / kept.x.shape[1]
    for lane in range(seen.shape[0]):
        # Sums as numbers, and no division, which would take longer than all else.
        sums = kept.sums[lane]
        e1, e2, x1 = sums[ENERGY], sums[ENERGY2], sums[DISPLACEMENT]
        x2, v1, v2 = sums[DISPLACEMENT2], sums[VELOCITY], sums[VELOCITY2]
        part = (kept.looks[lane] * slices) // total
        over = kept.looks[lane] * slices - part * total
        for i in range(seen.shape[1]):
            x, v, e = seen[lane, i, 0], seen[lane, i, 1], energy[lane, i]
            one = cell(e, kept.edges[0], kept.energy.shape[1])
            if one >= 0:
                kept.energy[lane, one] += 1
            one = cell(x, kept.edges[1], kept.x.shape[1])
            two = cell(v, kept.edges[2], kept.v.shape[1])
            if one >= 0:
                kept.x[lane, one] += 1
            if two >= 0:
                kept.v[lane, two] += 1
            if one >= 0 and two >= 0:
                row = int((x - kept.edges[1, 0]) * kept.edges[1, 1] * share)
                column = int((v - kept.edges[2, 0]) * kept.edges[2, 1] * share)
                kept.joint[lane, min(row, coarse - 1), min(column, coarse - 1)] += 1
            kept.course[lane, part] += e
            over += slices
            while over >= total:
                over -= total
                part += 1
            e1, e2, x1 = e1 + e, e2 + e * e, x1 + x
            x2, v1, v2 = x2 + x * x, v1 + v, v2 + v * v
        kept.looks[lane] += seen.shape[1]
        sums[ENERGY], sums[ENERGY2], sums[DISPLACEMENT] = e1, e2, x1
        sums[DISPLACEMENT2], sums[VELOCITY], sums[VELOCITY2] = x2, v1, v2


@kernel
def local_rates(law, t, x, v, dx, dv, mass):
    """Greatest rates of the law along a motion: root of its slope in x, and slope in v."""
    stiff, drag = 0.0, 0.0
    for i in range(len(x)):
        over_x = law(t[i], x[i] + dx, v[i]) - law(t[i], x[i] - dx, v[i])
        over_v = law(t[i], x[i], v[i] + dv) - law(t[i], x[i], v[i] - dv)
        stiff = max(stiff, abs(over_x) / (2 * dx * mass))
        drag = max(drag, abs(over_v) / (2 * dv * mass))
    return math.sqrt(stiff), drag
