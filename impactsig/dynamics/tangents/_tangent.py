"""Kernels for the tangent map of a piecewise linear motion, from event to event.

Between events the tangent flow is the homogeneous flow of the mode, whatever the state; at an event
the columns jump (`_saltation`). At a touch or a part all but the damper is continuous.
"""

from __future__ import annotations

import math

from ..._compiling.compiled import inlined, kernel
from ...simulation.basis.events import (
    IMPACT,
    PART,
    PHASE,
    RELEASE,
    REVERSE,
    ROW_KIND,
    ROW_MODE,
    ROW_Q,
    ROW_STOP,
    ROW_V,
    START,
    STICK,
    TOUCH,
    TURN,
    TURNS,
)
from ...simulation.exact.flow import push
from ...simulation.exact.passing import touches
from ._saltation import approach_of, hit, set_off, slope_of_return, stick, turn
from .columns import (
    BY_FRICTION,
    DETERMINANT,
    FIRST,
    FREE,
    HELD,
    IMPACTS,
    IN_MODE,
    LAST,
    NEXT,
    SECOND,
    SINGULAR,
    due,
    multiply,
    orthonormalize,
    rescale,
    take,
)

FAR = 4.0  # 2 root tau within which both eigenvectors of an overdamped mode keep their digits


@inlined
def flow(columns, totals, delta, kappa, root, damping_kind, tau, orthonormal):
    """Advance the columns over a span of a mode; the greatest factor is kept as a logarithm."""
    scale = -delta * tau
    if damping_kind > 0:
        c, s = math.cos(root * tau), math.sin(root * tau) / root
    elif damping_kind < 0:
        scale = -kappa / (delta + root) * tau
        gone = -math.expm1(-2 * root * tau)
        c, s = 1 - gone / 2, gone / (2 * root)
    else:
        c, s = 1.0, tau
    totals[FIRST] += scale
    if orthonormal:
        totals[SECOND] += scale
    multiply(columns, c + delta * s, s, -kappa * s, c - delta * s)


@kernel
def span(p, i, tau, columns, totals, orthonormal):
    """Advance the columns over a span of mode i, in pieces if strongly overdamped."""
    delta, kappa, root, damping_kind = p.delta[i], p.kappa[i], p.root[i], p.damping_kind[i]
    totals[DETERMINANT] -= 2 * delta * tau
    if orthonormal and damping_kind < 0:
        piece = FAR / (2 * root)
        for _ in range(10):
            if tau <= piece:
                break
            flow(columns, totals, delta, kappa, root, damping_kind, piece, orthonormal)
            orthonormalize(columns, totals)
            tau -= piece
        if tau > piece:  # by now the first is the slow eigenvector to the last digit
            fast = delta + root
            slow = kappa / fast
            totals[FIRST] -= slow * tau
            totals[SECOND] -= fast * tau
            return
    flow(columns, totals, delta, kappa, root, damping_kind, tau, orthonormal)


@inlined
def acceleration(p, i, f, q, v):
    """Acceleration in mode i under the forcing f."""
    return f + p.constant[i] - p.kappa[i] * q - 2 * p.delta[i] * v


@kernel
def by_force(p, i, stop, beyond):
    """Whether a contact in mode i changes at zero force rather than at zero gap."""
    for s in range(p.gaps[i]):
        if p.meanings[i, s, 1] == stop and p.meanings[i, s, 2] == beyond:
            return p.gap[i, s, 1] != 0.0
    return False


@inlined
def jump(p, row, place, columns, totals, collapses, at_once, upper, lower):
    """Saltation at an impact, a change of contact or of the direction of friction."""
    before, after = int(place[IN_MODE]), int(row[ROW_MODE])
    kind, stop, q, v = int(row[ROW_KIND]), int(row[ROW_STOP]), row[ROW_Q], row[ROW_V]
    if kind == IMPACT:
        come = approach_of(row, p.side[stop], totals)
        if come == 0.0:
            return
        rho = -v / come
        if p.restitution[stop] == -2.0:
            rho = slope_of_return(upper if p.side[stop] > 0 else lower, abs(come), p.speed)
        f, _f1, _f2 = push(p, row, 0.0)
        a, b = acceleration(p, before, f, q, come), acceleration(p, after, f, q, v)
        hit(columns, totals, collapses, row, come, rho, a, b)
    elif kind in (TOUCH, PART):
        change = -2 * (p.delta[after] - p.delta[before])
        if by_force(p, before, stop, after):
            change = 0.0
            if at_once and place[LAST] == IMPACT and v != 0.0:
                # The impact has turned the velocity, and with it what a stop that only pushes does.
                f, _f1, _f2 = push(p, row, 0.0)
                place_before = q + p.origin[after] - p.origin[before]
                a = acceleration(p, before, f, place_before, v)
                change = (acceleration(p, after, f, q, v) - a) / v
        multiply(columns, 1.0, 0.0, change, 1.0)
        totals[IMPACTS] += kind == TOUCH
    elif kind == REVERSE and not (at_once and place[LAST] == START):
        f, _f1, _f2 = push(p, row, 0.0)
        a, b = acceleration(p, before, f, q, 0.0), acceleration(p, after, f, q, 0.0)
        turn(columns, totals, a, b)


@inlined
def let_go(p, row, columns, totals, orthonormal):
    """Saltation when friction releases the mass; the lost column begins anew."""
    after = int(row[ROW_MODE])
    f, f1, _f2 = push(p, row, 0.0)
    if f1 == 0.0:
        totals[SINGULAR] += 1
        return
    off = 0.0
    if p.static != p.kinetic:
        off = -acceleration(p, after, f, row[ROW_Q], 0.0) * p.kappa[after] / f1
    set_off(columns, totals, off, orthonormal)


@kernel
def carry_to(p, turns, phase, place, columns, totals, orthonormal):
    """Advance the columns to an instant without an event."""
    if place[HELD] == FREE:
        tau = (turns - place[TURNS]) * TURN + (phase - place[PHASE])
        if tau > 0:
            span(p, int(place[IN_MODE]), tau, columns, totals, orthonormal)
    place[TURNS], place[PHASE] = turns, phase
    if orthonormal:
        if place[HELD] == FREE:
            orthonormalize(columns, totals)
    else:
        rescale(columns, totals)


@kernel
def carry(
    p, rows, end, instants, taken, place, columns, totals, collapses, orthonormal, upper, lower
):
    """Advance the columns through events to `end`; take totals at instants."""
    for k in range(len(rows)):
        row = rows[k]
        while due(row[TURNS], row[PHASE], place, instants):
            n = int(place[NEXT])
            carry_to(p, instants[n, TURNS], instants[n, PHASE], place, columns, totals, orthonormal)
            take(taken, place, totals)
        kind, i = int(row[ROW_KIND]), int(row[ROW_MODE])
        tau = (row[TURNS] - place[TURNS]) * TURN + (row[PHASE] - place[PHASE])
        stops = kind == STICK and touches(p, i, row[ROW_Q])
        if place[HELD] == FREE and not stops and tau > 0:
            span(p, int(place[IN_MODE]), tau, columns, totals, orthonormal)
        place[TURNS], place[PHASE] = row[TURNS], row[PHASE]
        if kind == STICK and place[HELD] == FREE:
            stick(columns, totals, collapses, row, place, stops)
        elif kind == RELEASE:
            if place[HELD] == BY_FRICTION:
                let_go(p, row, columns, totals, orthonormal)
            place[HELD] = FREE
            place[IN_MODE], place[LAST] = i, kind
            continue
        else:
            jump(p, row, place, columns, totals, collapses, tau <= 0, upper, lower)
        place[IN_MODE], place[LAST] = i, kind
        if orthonormal:
            orthonormalize(columns, totals)
        else:
            rescale(columns, totals)
    while due(end[0], end[1], place, instants):
        n = int(place[NEXT])
        carry_to(p, instants[n, TURNS], instants[n, PHASE], place, columns, totals, orthonormal)
        take(taken, place, totals)
    carry_to(p, end[0], end[1], place, columns, totals, orthonormal)
