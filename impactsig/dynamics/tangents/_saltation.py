"""Kernels for saltation: the effect of events on differences of neighbouring motions.

At an event with the normal n of its surface and the derivative R of its reset they jump by the
saltation matrix [Muller1995]_

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

from ..._compiling.compiled import inlined, kernel
from ...simulation.basis.events import ROW_APPROACH, ROW_V
from .columns import (
    BY_FRICTION,
    BY_STOP,
    DETERMINANT,
    FIRST,
    HELD,
    IMPACTS,
    SINGULAR,
    list_collapse,
    multiply,
)


@kernel
def slope_of_return(law, v, unit):
    """Derivative of r(v) v for a restitution function, by differences of order 4, to 1e-12."""
    h = 1e-3 * v
    near = law((v + h) * unit) * (v + h) - law((v - h) * unit) * (v - h)
    far = law((v + 2 * h) * unit) * (v + 2 * h) - law((v - 2 * h) * unit) * (v - 2 * h)
    return (8 * near - far) / (12 * h)


@inlined
def hit(columns, totals, collapses, row, come, rho, a, b):
    """Saltation at an impact with approach velocity `come`; a, b: accelerations before, after."""
    r = -row[ROW_V] / come
    multiply(columns, -r, 0.0, (b + rho * a) / come, -rho)
    if r * rho == 0.0:
        list_collapse(collapses, totals, row, 1)
    else:
        totals[DETERMINANT] += math.log(abs(r * rho))


@inlined
def turn(columns, totals, a, b):
    """Saltation at a reversal of friction, from the accelerations before and after."""
    if a == 0.0 or b == 0.0:
        totals[SINGULAR] += 1
        return
    multiply(columns, 1.0, 0.0, 0.0, b / a)
    totals[DETERMINANT] += math.log(abs(b / a))


@inlined
def stick(columns, totals, collapses, row, place, by_stop):
    """Saltation when a stop or friction holds the mass."""
    place[HELD] = BY_STOP if by_stop else BY_FRICTION
    list_collapse(collapses, totals, row, 0 if by_stop else 1)
    multiply(columns, 0.0 if by_stop else 1.0, 0.0, 0.0, 0.0)


@inlined
def set_off(columns, totals, off, orthonormal):
    """Saltation when friction releases the mass; the lost column begins anew."""
    multiply(columns, 1.0, 0.0, off, 0.0)
    if orthonormal:
        norm = math.hypot(columns[0, 0], columns[1, 0])
        totals[FIRST] += math.log(norm)
        columns[0, 0], columns[1, 0] = columns[0, 0] / norm, columns[1, 0] / norm
        columns[0, 1], columns[1, 1] = -columns[1, 0], columns[0, 0]


@inlined
def approach_of(row, side, totals):
    """Approach velocity of an impact; 0 if it grazes, which has no derivative."""
    come = side * row[ROW_APPROACH]
    totals[IMPACTS] += 1
    totals[SINGULAR] += come == 0.0
    return come
