"""Kernels that project sounds on modes that start at any shift, Q and K of `_shift_kernels.py`.

With A the columns of the modes at a shift and A'A = L L', Q = A L^-1 is orthonormal. It is not
needed itself: |Q'y|^2 = |L^-1 A'y|^2. From one whole shift to the next, A'A gains the products of
one sample and loses those of another. L is found for all shifts side by side.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .._lane_kernels import fused, reordered, sum_of_products
from ._edge_kernels import LANE, PARTS, SIDE

DEPENDENT = 1e-10  # of the greatest square of a column, up to which what others leave is nothing


class Basis(NamedTuple):
    """Modes at a number of shifts, an impulse and its slope."""

    columns: np.ndarray  # result of `step_modes`
    modes: int  # the columns of modes; the next two are those of the impulse and its slope
    places: np.ndarray  # of the first sample of each shift: its part, and parts for each before it
    size: int  # samples
    factors: np.ndarray  # (modes + 2, modes + 2, shifts), L below; roots' reciprocals between
    grams: np.ndarray  # (3, shifts), K'K on its diagonal, and beside it


@reordered
def factor(columns, modes, places, size):
    """The basis of columns at these places."""
    rows, count = modes + 2, len(places)
    factors, grams = np.empty((rows, rows, count)), np.empty((3, count))
    put_products(columns, places, size, factors)
    nothing = 0.0
    for c in range(modes):
        nothing = max(nothing, DEPENDENT * factors[c, c].max())
    for c in range(rows):
        pivot = factors[c, c]
        for d in range(min(c, modes)):
            row, scale = factors[c, d], factors[d, d]
            take_off(factors[c], factors[d], d, row)
            for j in range(count):
                row[j] *= scale[j]
                pivot[j] -= row[j] * row[j]
        if c < modes:
            for j in range(count):
                left = pivot[j]
                pivot[j] = 1.0 / math.sqrt(left) if left > nothing else 0.0
    impulse, slope, both = factors[modes, modes], factors[modes + 1, modes + 1], factors[modes + 1]
    take_off(both, factors[modes], modes, both[modes])
    for j in range(count):
        grams[0, j], grams[1, j] = max(impulse[j], 0.0), max(slope[j], 0.0)
        grams[2, j] = both[modes, j]
    return Basis(columns, modes, places, size, factors, grams)


@reordered
def put_products(columns, places, size, out):
    """Products of any two columns at each place, out[c, d, j] with d <= c."""
    rows = len(out)
    products, last = np.empty((PARTS, rows, rows)), np.full(PARTS, -1)
    enters, leaves = np.empty(rows), np.empty(rows)
    for j in range(len(places)):
        part, first = places[j] % PARTS, places[j] // PARTS
        own, values = products[part], columns[part]
        follows = last[part] == first + 1
        for c in range(rows):
            row = own[c]
            if follows:
                enter, leave = values[c, first], values[c, first + size]
                enters[c], leaves[c] = enter, leave
                for d in range(c + 1):
                    row[d] += enter * enters[d] - leave * leaves[d]
            else:
                for d in range(c + 1):
                    row[d] = sum_of_products(values[c, first : first + size], values[d, first:])
            for d in range(c + 1):
                out[c, d, j] = row[d]
        last[part] = first


@fused
def take_off(factors, others, count, row):
    """Subtract the products of the first so many rows of both from a row."""
    done = count // 4 * 4
    for o in range(0, done, 4):
        a, b, c, d = factors[o], factors[o + 1], factors[o + 2], factors[o + 3]
        w, x, y, z = others[o], others[o + 1], others[o + 2], others[o + 3]
        for j in range(np.uint64(len(row))):
            row[j] -= (a[j] * w[j] + b[j] * x[j]) + (c[j] * y[j] + d[j] * z[j])
    for o in range(done, count):
        a, w = factors[o], others[o]
        for j in range(np.uint64(len(row))):
            row[j] -= a[j] * w[j]


@fused
def project(sounds, which, first, basis, energy, projections):
    """Energy of some sounds from sample first[i] on, and projections of them over its root.

    A projection is the power in the modes, |Q'y|^2, and the two products K'y, at each shift. SIDE
    sounds are projected side by side; none depends on the others.
    """
    modes, size, factors = basis.modes, basis.size, basis.factors
    count, rows = len(basis.places), basis.columns.shape[1]
    block, products = np.zeros((SIDE, -(-size // LANE) * LANE)), np.empty((SIDE, rows, count))
    for at in range(0, len(which), SIDE):
        some = min(SIDE, len(which) - at)
        for i in range(some):
            sound = sounds[which[at + i], first[at + i] : first[at + i] + size]
            energy[at + i] = sum_of_products(sound, sound)
            scale = 1.0 / math.sqrt(energy[at + i]) if energy[at + i] > 0.0 else 0.0
            for k in range(size):
                block[i, k] = scale * sound[k]
        put_sums(block, basis.columns, basis.places, products)
        for i in range(some):
            own, power = products[i], projections[at + i, 0]
            power[:] = 0.0
            for c in range(modes):
                row, scale = own[c], factors[c, c]
                take_off(factors[c], own, c, row)
                for j in range(count):
                    row[j] *= scale[j]
                    power[j] += row[j] * row[j]
            for c in range(modes, modes + 2):
                row = projections[at + i, c - modes + 1]
                row[:] = own[c]
                take_off(factors[c], own, modes, row)


@fused
def put_sums(block, columns, places, out):
    """Products of SIDE sounds of a block with each column at each place, out[i, c, j]."""
    for j in range(len(places)):
        values, first = columns[places[j] % PARTS], places[j] // PARTS
        for c in range(0, len(values), SIDE):
            add_up(block, values, c, first, j, out)


@reordered
def add_up(sounds, columns, row, first, j, out):
    """Products of SIDE sounds with as many columns from a row on."""
    p, q, r, s = sounds[0], sounds[1], sounds[2], sounds[3]
    a, b = columns[row, first:], columns[row + 1, first:]
    c, d = columns[row + 2, first:], columns[row + 3, first:]
    pa = pb = pc = pd = qa = qb = qc = qd = ra = rb = rc = rd = sa = sb = sc = sd = 0.0
    for k in range(np.uint64(len(p))):
        w, x, y, z = a[k], b[k], c[k], d[k]
        pa, pb, pc, pd = pa + p[k] * w, pb + p[k] * x, pc + p[k] * y, pd + p[k] * z
        qa, qb, qc, qd = qa + q[k] * w, qb + q[k] * x, qc + q[k] * y, qd + q[k] * z
        ra, rb, rc, rd = ra + r[k] * w, rb + r[k] * x, rc + r[k] * y, rd + r[k] * z
        sa, sb, sc, sd = sa + s[k] * w, sb + s[k] * x, sc + s[k] * y, sd + s[k] * z
    o = out[0]
    o[row, j], o[row + 1, j], o[row + 2, j], o[row + 3, j] = pa, pb, pc, pd
    o = out[1]
    o[row, j], o[row + 1, j], o[row + 2, j], o[row + 3, j] = qa, qb, qc, qd
    o = out[2]
    o[row, j], o[row + 1, j], o[row + 2, j], o[row + 3, j] = ra, rb, rc, rd
    o = out[3]
    o[row, j], o[row + 1, j], o[row + 2, j], o[row + 3, j] = sa, sb, sc, sd
