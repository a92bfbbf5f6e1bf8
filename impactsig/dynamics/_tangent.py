"""Kernels: how the neighbours of a piecewise linear motion move with it, from event to event.

Between events the tangent flow is the homogeneous flow of the mode, whatever the state. At an
event with the normal n of its surface and the derivative R of its reset it jumps by the saltation
matrix [Muller1995]_

    S = R + (f+ - R f-) n' / (n' f-),

f = (v, a) before and after, in coordinates in which the stops rest, so that the acceleration of the
base is in a. This gives

- impact, v+ = -r v-:      [[-r, 0], [(a+ + rho a-) / v-, -rho]],  rho = d(r v)/dv
- touch, part at zero gap: [[1, 0], [-2 (delta+ - delta-), 1]], since but for the damper all is
  continuous there; at zero force nothing jumps
- friction turns, v = 0:   [[1, 0], [0, a+ / a-]]
- friction sticks:         [[1, 0], [0, 0]]: one dimension is lost
- it lets go, where the forcing f reaches what holds q: [[1, 0], [-a+ kappa / f', 0]]
- sticks to a rigid stop: 0. Both dimensions are lost: the release does not depend on what was.
"""

from __future__ import annotations

import math

from ..simulate._events import IMPACT, PART, RELEASE, REVERSE, START, STICK, TOUCH
from ..simulate._flow import TURN, inlined, inner, kernel, phase_of
from ..simulate._passing import touches

# What `place` holds: turns, phase and mode up to which the columns have been carried; whether the
# mass is held, and by what; the kind of the last event; the instant to take the totals at next.
TURNS, PHASE, MODE, HELD, KIND, NEXT = range(6)
FREE, BY_FRICTION, BY_STOP = range(3)
# What `totals` hold: logarithms of the growth of the first and the second column (or of the common
# scale of both, where they are not made orthonormal), of the determinant; collapses to a line and
# to a point; events that graze so closely that they have no derivative; impacts.
FIRST, SECOND, DETERMINANT, LINES, POINTS, SINGULAR, IMPACTS = range(7)
TOTALS = 7
FAR = 4.0  # 2 root tau within which both eigenvectors of an overdamped mode keep their digits


@inlined
def multiply(columns, a, b, c, d):
    """[[a, b], [c, d]] times the columns."""
    for j in range(2):
        q, v = columns[0, j], columns[1, j]
        columns[0, j], columns[1, j] = a * q + b * v, c * q + d * v


@inlined
def list_collapse(collapses, totals, row, left):
    """Write down when how many dimensions were left, as long as there is room."""
    n = int(totals[LINES] + totals[POINTS])
    if n < len(collapses):
        collapses[n, 0], collapses[n, 1], collapses[n, 2] = row[0], row[1], left
    totals[LINES if left == 1 else POINTS] += 1
    totals[DETERMINANT] = -math.inf


@inlined
def orthonormalize(columns, totals):
    """Gram and Schmidt's; a column that is gone begins anew.

    The area between the columns keeps its digits where their scales differ by orders.
    """
    a, b, c, d = columns[0, 0], columns[1, 0], columns[0, 1], columns[1, 1]
    area = abs(a * d - b * c)
    norm = math.hypot(a, b)
    if norm == 0.0:
        a, b = c, d
        norm = math.hypot(a, b)
    if norm == 0.0:
        columns[0, 0], columns[1, 0], columns[0, 1], columns[1, 1] = 1.0, 0.0, 0.0, 1.0
        return
    totals[FIRST] += math.log(norm)
    if area > 0:
        totals[SECOND] += math.log(area / norm)
    columns[0, 0], columns[1, 0] = a / norm, b / norm
    columns[0, 1], columns[1, 1] = -b / norm, a / norm


@inlined
def rescale(columns, totals):
    """Take the common scale out of columns that have grown or shrunk too far."""
    size = 0.0
    for j in range(2):
        size = max(size, abs(columns[0, j]), abs(columns[1, j]))
    if size > 0 and not 1e-100 < size < 1e100:
        for j in range(2):
            columns[0, j] /= size
            columns[1, j] /= size
        totals[FIRST] += math.log(size)


@inlined
def flow(columns, totals, delta, kappa, root, sort, tau, orthonormal):
    """Carry the columns over a span of a mode, the greatest factor taken out as a logarithm."""
    scale = -delta * tau
    if sort > 0:
        c, s = math.cos(root * tau), math.sin(root * tau) / root
    elif sort < 0:
        scale = -kappa / (delta + root) * tau
        gone = -math.expm1(-2 * root * tau)
        c, s = 1 - gone / 2, gone / (2 * root)
    else:
        c, s = 1.0, tau
    totals[FIRST] += scale
    if orthonormal:
        totals[SECOND] += scale
    multiply(columns, c + delta * s, s, -kappa * s, c - delta * s)


@inner
def span(p, i, tau, columns, totals, orthonormal):
    """Carry the columns over a span of mode i; far from critical damping in pieces."""
    delta, kappa, root, sort = p.delta[i], p.kappa[i], p.root[i], p.sort[i]
    totals[DETERMINANT] -= 2 * delta * tau
    if orthonormal and sort < 0:
        piece = FAR / (2 * root)
        for _ in range(10):
            if tau <= piece:
                break
            flow(columns, totals, delta, kappa, root, sort, piece, orthonormal)
            orthonormalize(columns, totals)
            tau -= piece
        if tau > piece:  # by now the first is the slow eigenvector to the last digit
            fast = delta + root
            slow = kappa / fast
            totals[FIRST] -= slow * tau
            totals[SECOND] -= fast * tau
            return
    flow(columns, totals, delta, kappa, root, sort, tau, orthonormal)


@inlined
def force(p, turns, phase):
    """Forcing and its first derivative."""
    f = f1 = 0.0
    for j in range(len(p.ratio)):
        angle = phase_of(p.ratio[j], turns, phase)
        c, s = math.cos(angle), math.sin(angle)
        f += p.force_cos[j] * c + p.force_sin[j] * s
        f1 += p.ratio[j] * (p.force_sin[j] * c - p.force_cos[j] * s)
    return f, f1


@inlined
def acceleration(p, i, f, q, v):
    """In mode i, where the forcing is f."""
    return f + p.constant[i] - p.kappa[i] * q - 2 * p.delta[i] * v


@inner
def slope_of_return(p, stop, v, upper, lower):
    """Derivative of r(v) v, where a function tells r: by differences of order 4, to 1e-12."""
    law = upper if p.side[stop] > 0 else lower
    h = 1e-3 * v
    near = law((v + h) * p.speed) * (v + h) - law((v - h) * p.speed) * (v - h)
    far = law((v + 2 * h) * p.speed) * (v + 2 * h) - law((v - 2 * h) * p.speed) * (v - 2 * h)
    return (8 * near - far) / (12 * h)


@inner
def by_force(p, i, stop, beyond):
    """Whether a contact in mode i changes where a force is zero, and not a gap."""
    for s in range(p.gaps[i]):
        if p.means[i, s, 1] == stop and p.means[i, s, 2] == beyond:
            return p.gap[i, s, 1] != 0.0
    return False


@inlined
def jump(p, row, place, columns, totals, collapses, at_once, upper, lower):
    """Saltation at an impact, a change of contact or of the direction of friction."""
    before, after = int(place[MODE]), int(row[4])
    kind, stop, q, v = int(row[2]), int(row[3]), row[5], row[6]
    if kind == IMPACT:
        totals[IMPACTS] += 1
        come = p.side[stop] * row[7]
        if come == 0.0:
            totals[SINGULAR] += 1
            return
        r = -v / come
        rho = r
        if p.restitution[stop] == -2.0:
            rho = slope_of_return(p, stop, abs(come), upper, lower)
        f, _f1 = force(p, row[0], row[1])
        a, b = acceleration(p, before, f, q, come), acceleration(p, after, f, q, v)
        multiply(columns, -r, 0.0, (b + rho * a) / come, -rho)
        if r * rho == 0.0:
            list_collapse(collapses, totals, row, 1)
        else:
            totals[DETERMINANT] += math.log(abs(r * rho))
    elif kind in (TOUCH, PART):
        change = -2 * (p.delta[after] - p.delta[before])
        if by_force(p, before, stop, after):
            change = 0.0
            if at_once and place[KIND] == IMPACT and v != 0.0:
                # The impact has turned the velocity, and with it what a stop that only pushes does.
                f, _f1 = force(p, row[0], row[1])
                place_before = q + p.origin[after] - p.origin[before]
                a = acceleration(p, before, f, place_before, v)
                change = (acceleration(p, after, f, q, v) - a) / v
        multiply(columns, 1.0, 0.0, change, 1.0)
        totals[IMPACTS] += kind == TOUCH
    elif kind == REVERSE and not (at_once and place[KIND] == START):
        f, _f1 = force(p, row[0], row[1])
        a, b = acceleration(p, before, f, q, 0.0), acceleration(p, after, f, q, 0.0)
        if a == 0.0 or b == 0.0:
            totals[SINGULAR] += 1
            return
        multiply(columns, 1.0, 0.0, 0.0, b / a)
        totals[DETERMINANT] += math.log(abs(b / a))


@inlined
def let_go(p, row, place, columns, totals, orthonormal):
    """Saltation where a mass held by friction sets off; the column that was lost begins anew."""
    after = int(row[4])
    f, f1 = force(p, row[0], row[1])
    if f1 == 0.0:
        totals[SINGULAR] += 1
        return
    off = 0.0
    if p.static != p.kinetic:
        off = -acceleration(p, after, f, row[5], 0.0) * p.kappa[after] / f1
    multiply(columns, 1.0, 0.0, off, 0.0)
    if orthonormal:
        norm = math.hypot(columns[0, 0], columns[1, 0])
        totals[FIRST] += math.log(norm)
        columns[0, 0], columns[1, 0] = columns[0, 0] / norm, columns[1, 0] / norm
        columns[0, 1], columns[1, 1] = -columns[1, 0], columns[0, 0]


@inlined
def due(turns, phase, place, instants):
    """Whether totals are to be taken before that instant, or at it."""
    k = int(place[NEXT])
    if k >= len(instants):
        return False
    return (instants[k, 0] - turns) * TURN + (instants[k, 1] - phase) <= 0


@inlined
def take(taken, place, totals):
    """Take the totals, and go on to the next instant."""
    n = int(place[NEXT])
    for k in range(TOTALS):
        taken[n, k] = totals[k]
    place[NEXT] += 1


@inner
def carry_to(p, turns, phase, place, columns, totals, orthonormal):
    """Carry the columns to an instant without event."""
    if place[HELD] == FREE:
        tau = (turns - place[TURNS]) * TURN + (phase - place[PHASE])
        if tau > 0:
            span(p, int(place[MODE]), tau, columns, totals, orthonormal)
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
    """Carry the columns through events to the turns and phase `end`; take totals at instants."""
    for k in range(len(rows)):
        row = rows[k]
        while due(row[0], row[1], place, instants):
            n = int(place[NEXT])
            carry_to(p, instants[n, 0], instants[n, 1], place, columns, totals, orthonormal)
            take(taken, place, totals)
        kind, i = int(row[2]), int(row[4])
        tau = (row[0] - place[TURNS]) * TURN + (row[1] - place[PHASE])
        stops = kind == STICK and touches(p, i, row[5])
        if place[HELD] == FREE and not stops and tau > 0:
            span(p, int(place[MODE]), tau, columns, totals, orthonormal)
        place[TURNS], place[PHASE] = row[0], row[1]
        if kind == STICK and place[HELD] == FREE:
            place[HELD] = BY_STOP if stops else BY_FRICTION
            list_collapse(collapses, totals, row, 0 if stops else 1)
            multiply(columns, 0.0 if stops else 1.0, 0.0, 0.0, 0.0)
        elif kind == RELEASE:
            if place[HELD] == BY_FRICTION:
                let_go(p, row, place, columns, totals, orthonormal)
            place[HELD] = FREE
            place[MODE], place[KIND] = i, kind
            continue
        else:
            jump(p, row, place, columns, totals, collapses, tau <= 0, upper, lower)
        place[MODE], place[KIND] = i, kind
        if orthonormal:
            orthonormalize(columns, totals)
        else:
            rescale(columns, totals)
    while due(end[0], end[1], place, instants):
        n = int(place[NEXT])
        carry_to(p, instants[n, 0], instants[n, 1], place, columns, totals, orthonormal)
        take(taken, place, totals)
    carry_to(p, end[0], end[1], place, columns, totals, orthonormal)
