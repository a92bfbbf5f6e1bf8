"""Kernel that finds the crossings of a displacement by a piecewise linear motion."""

from __future__ import annotations

from ..._compiling.compiled import kernel
from ...simulation.basis.events import PHASE, ROW_KIND, ROW_MODE, ROW_Q, ROW_V, STICK, TURN, TURNS
from ...simulation.exact.flow import begin, bounds, locate
from ...simulation.exact.gap import close, stays_open

# Columns of a crossing: the row before it, time since that, side come from, velocity.
AFTER, SINCE, FROM, SPEED = range(4)
LEAST = 1e-12  # step, relative, where rounding would stop the search


@kernel
def crossings(p, scratch, rows, end_turns, end_phase, level, found, most):
    """Write row, time since it, side come from and velocity of every crossing; how many there are.

    The way to the level is a gap, and is followed as the engine follows those to the stops: by
    steps for which it is certain to stay open, so that none is missed. Those beyond the length of
    `found` are counted, not written. A crossing where a leg meets the next one is the latter's.
    """
    number = 0
    came = 0.0  # the side on which the leg before was
    for k in range(len(rows)):
        row = rows[k]
        i = int(row[ROW_MODE])
        turns, phase, meets = end_turns, end_phase, False
        if k + 1 < len(rows):
            after = rows[k + 1]
            turns, phase = after[TURNS], after[PHASE]
            meets = level - p.origin[int(after[ROW_MODE])] - after[ROW_Q] == 0.0
        end = (turns - row[TURNS]) * TURN + (phase - row[PHASE])
        if row[ROW_KIND] == STICK or end <= 0:
            continue
        last = end * (1 - 1e-9) if meets else end
        leg = begin(p, scratch, i, row[TURNS], row[PHASE], 0.0, row[ROW_Q], row[ROW_V])
        b = leg.drift - 2 * leg.delta * leg.w - leg.kappa * leg.z
        limit, third = bounds(leg, b, -2 * leg.delta * b - leg.kappa * leg.w)
        room = level - p.origin[i] - row[ROW_Q]
        # The first derivative that is not zero tells to which side a start at the level leaves.
        side = room if room != 0.0 else -row[ROW_V]
        side = side if side != 0.0 else -leg.series[2]
        side = 1.0 if side >= 0 else -1.0
        if room == 0.0 and came * side < 0:
            if number < len(found):
                found[number, AFTER], found[number, SINCE] = k, 0.0
                found[number, FROM], found[number, SPEED] = came, row[ROW_V]
            number += 1
        tau, x, v, a, jerk = 0.0, 0.0, row[ROW_V], 2 * leg.series[2], 6 * leg.series[3]
        leaves = room == 0.0
        for _ in range(most):
            gap, speed, bend = side * (room - x), -side * v, -side * a
            gap = 0.0 if leaves else max(gap, 0.0)
            if speed < 0 and not leaves:
                reach = -2 * gap / speed
                if 2 * max(bend + third * reach / 2, 0.0) * gap <= speed * speed:
                    at = tau
                    if gap > 0:
                        ahead = (-side, 0.0, side * room)
                        at, x, v = close(leg, tau, ahead, x, v, a, jerk, gap, speed, reach, third)
                    if at > last:
                        break
                    if number < len(found):
                        found[number, AFTER], found[number, SINCE] = k, at
                        found[number, FROM], found[number, SPEED] = side, v
                    number += 1
                    side, leaves, tau = -side, True, at
                    x, v, a, jerk, b, b1 = locate(leg, tau)
                    if b == b:
                        limit, third = bounds(leg, b, b1)
                    continue
            if gap > 0 or speed > 0:
                h = stays_open(gap, speed, bend, limit, third, limit, 0.0, third, 0.0)
            else:
                h = 1.5 * max(bend, 0.0) / (third + 1e-300)
            tau += max(h, LEAST * max(tau, 1e-3))
            if tau >= end:
                break
            leaves = False
            x, v, a, jerk, b, b1 = locate(leg, tau)
            if b == b:
                limit, third = bounds(leg, b, b1)
        came = side
    return number
