"""A run past its transient, which ends where its orbit has closed or is seen to close."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import InvalidInput
from ..oscillators import Oscillator
from ..simulate import Motion
from ..simulate._columns import columns_of, form_of
from ..simulate._events import (
    COLUMNS,
    DONE,
    IMPACT_COUNT,
    LEG_COUNT,
    LOST,
    MODE,
    PHASE,
    STATUS,
    STROBE,
    STROBE_IMPACTS,
    TURNS,
    Q,
    V,
)
from ..simulate._exact import ExactEngine, piecewise_linear, room
from ..simulate._frame import base_motion, first_phase, pace, reference_frequency
from ..simulate._modes import Stack, stacks
from ..simulate._moving import Moving
from ..simulate._run import Run
from ._strobing import FOUND, closing, follow, follow_machines, least
from .tangent import tangent_map

LONGEST = 32  # periods of an orbit that are told
LEGS = 100_000  # work in one forcing period after which a motion is given up
NEAR = 1e-2  # returns of a motion that may yet close, as a share of its size
TRIES = 4  # periods that a motion may be about to close with; chaos comes near itself after many
UNTOLD = 0.2  # of what a motion goes nearer in a return, the share its derivative may not tell
EXACT = 1e-9  # what an orbit may be off by after its periods, as a share of its size
ALIKE = 1e-6  # points of an orbit closer than this share of its size are one

CHATTER = 1e-6  # as that of `simulate`

NOTHING_KNOWN = np.empty((0, 2)), np.empty(0, np.int64), np.empty(0)


def ground(oscillator: Oscillator, phase: float) -> tuple[np.ndarray, np.ndarray]:
    """Where a run's displacement and velocity are zero, and their units, seen from the ground."""
    at = base_motion(oscillator, pace(oscillator) * phase)
    return np.array([float(at[0]), float(at[1])]), np.array([1.0, reference_frequency(oscillator)])


@dataclass
class Settled:
    """Where a run is.

    Attributes
    ----------
    oscillator : Oscillator
        What moves.
    start : dict
        Where it started: `initial` and `phase`, as `simulate` takes them.
    strobes : numpy.ndarray
        Position and velocity in the engine's units once a period, impacts and energy lost in the
        period before; shape (periods followed + 1, 4).
    closed : int
        Periods of the orbit that it has closed, 0 if it has not, as where the forcing does not
        recur.
    status : str
        As that of a Motion.
    where : tuple of numpy.ndarray
        Clock, state and counters of the engine at the end of what was followed.
    """

    oscillator: Oscillator
    start: dict[str, Any]
    strobes: np.ndarray
    closed: int
    status: str
    where: tuple[np.ndarray, np.ndarray, np.ndarray]

    def closing(self) -> Settled:
        """On the orbit that the motion comes nearer to, if it has not closed yet; else itself.

        Of an orbit of m periods the last returns are small, and the derivative of the motion, all
        of whose multipliers are within the unit circle, tells each of them from the one before.
        Then Newton's method finds the orbit, which must be stable, have as many impacts, and draw
        the motion as its own derivative says. A chaotic motion that passes an unstable orbit does
        none of that.
        """
        if self.closed or self.status != STATUS[DONE] or not self.oscillator.forcing_recurs:
            return self
        points, impacts = self.strobes[:, :2], self.strobes[:, STROBE_IMPACTS]
        size = float(np.abs(points).max())
        tries = 0
        for m in range(1, min(LONGEST, (len(points) - 1) // 3) + 1):
            returns = points[-2 * m :] - points[-3 * m : -m]
            alike = np.array_equal(impacts[-m:], impacts[-2 * m : -m])
            if np.abs(returns).max() <= NEAR * size and alike:
                tries += 1
                found = self._approached(m)
                if found is not None or tries == TRIES:
                    return found or self
        return self

    def _approached(self, m: int) -> Settled | None:
        """The stable orbit of m periods, or a divisor of them, that draws the motion."""
        oscillator, phase = self.oscillator, self.start["phase"]
        origin, unit = ground(oscillator, phase)

        def returned(point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            """How far off its return is, and the derivative, in the run's units."""
            start = origin + unit * point
            found = tangent_map(
                oscillator, periods=m, initial=(float(start[0]), float(start[1])), phase=phase
            )
            return (found.final[:2] - start) / unit, found.matrix * unit / unit[:, None]

        def draws(off: np.ndarray, matrix: np.ndarray) -> bool:
            """Whether all neighbours come nearer, and these did as the derivative tells."""
            if not np.isfinite(matrix).all() or np.abs(np.linalg.eigvals(matrix)).max() >= 1:
                return False
            untold = np.linalg.norm(off[1:] - off[:-1] @ matrix.T, axis=1)
            return bool(np.all(untold <= UNTOLD * np.linalg.norm(off[:-1], axis=1)))

        last = self.strobes[-1 - 3 * m :: m, :2]
        point = last[-1]
        gap, matrix = returned(point)
        if not draws(np.diff(last, axis=0), matrix):
            return None
        least_gap = math.inf
        while np.abs(gap).max() < least_gap / 2:  # until rounding ends it
            least_gap, orbit, derivative = float(np.abs(gap).max()), point, matrix
            try:
                point = point + np.linalg.solve(np.eye(2) - matrix, gap)
                gap, matrix = returned(point)
            except (InvalidInput, np.linalg.LinAlgError):  # beyond a stop; a fold
                break
        if least_gap > EXACT * float(np.abs(orbit).max()) or not draws(last - orbit, derivative):
            return None
        x, v = (origin + unit * orbit).tolist()
        found = settle(oscillator, 2 * m, tolerance=1e-2, ends=False, initial=(x, v), phase=phase)
        if (
            found.status != STATUS[DONE]
            or found.strobes[-m:, STROBE_IMPACTS].sum() != self.strobes[-m:, STROBE_IMPACTS].sum()
        ):
            return None
        limit = ALIKE * float(np.abs(found.strobes[:, :2]).max())
        return replace(found, closed=least(found.strobes, 2 * m, m, limit))

    def motion(self, periods: int) -> Motion:
        """The next so many periods."""
        run = Run(self.oscillator, periods=1, **self.start)
        run.clock, run.state, run.count = self.where
        run.before = float(len(self.strobes) - 1)
        run.status = self.status
        return run.motion(periods)


def settle(oscillator: Oscillator, periods: int, **rule: Any) -> Settled:
    """One of `settle_all`."""
    return settle_all([oscillator], periods, **rule)[0]


def settle_all(
    oscillators: Sequence[Oscillator],
    periods: int,
    *,
    tolerance: float,
    ends: bool = True,
    initial: tuple[float, float] = (0.0, 0.0),
    phase: float = 0.0,
) -> list[Settled]:
    """Follow motions for so many forcing periods, or until an orbit has closed if that `ends`.

    Machines whose tables have the same shape are followed by one call of a kernel.
    """
    start = {"initial": initial, "phase": phase}
    found: dict[int, Settled] = {}
    alike: dict[Any, list[int]] = {}
    for k, oscillator in enumerate(oscillators):
        if not isinstance(oscillator, Oscillator):
            raise InvalidInput("scene", oscillator, "a function that makes an Oscillator")
        # Where the forcing does not recur, no motion closes.
        longest = LONGEST if oscillator.forcing_recurs else 0
        if piecewise_linear(oscillator):
            alike.setdefault((longest, form_of(oscillator)), []).append(k)
        else:
            rule = float(tolerance), longest, ends, LEGS
            found[k] = _stepped(oscillator, periods, rule, start)
    for (longest, _), members in alike.items():
        rule = float(tolerance), longest, ends, LEGS
        machines = [oscillators[k] for k in members]
        if len(machines) == 1:  # its tables are kept for what else is asked of it
            found[members[0]] = _alone(machines[0], periods, rule, start)
        else:
            for stack in stacks(columns_of(machines), CHATTER, skip=True):
                mine = [machines[k] for k in stack.which]
                places = [members[k] for k in stack.which]
                found |= zip(places, _together(stack, mine, periods, rule, start), strict=True)
    return [found[k] for k in range(len(oscillators))]


def _alone(oscillator: Oscillator, periods: int, rule: Any, start: dict[str, Any]) -> Settled:
    """One by the exact engine."""
    run = Run(oscillator, periods=1, **start)
    engine, where = run.engine, (run.clock, run.state, run.count)
    assert isinstance(engine, ExactEngine)
    strobes = np.empty((periods + 1, STROBE))
    strobes[0] = engine.place(run.count[MODE], run.state[Q]), run.state[V], 0, 0.0
    status, last, closed, _ = follow(
        engine.problem, engine.scratch, *engine.laws, *where, strobes, rule, NOTHING_KNOWN
    )
    return Settled(oscillator, start, strobes[: last + 1], closed, STATUS[status], where)


def _together(
    stack: Stack, oscillators: list[Oscillator], periods: int, rule: Any, start: dict[str, Any]
) -> Iterator[Settled]:
    """Those of one layout, by the exact engine."""
    n = len(oscillators)
    initial = np.broadcast_to(np.asarray(start["initial"], float), (n, 2))
    moving = Moving(stack, initial, np.full(n, first_phase(start["phase"])))
    strobes = np.empty((n, periods + 1, STROBE))
    ended = np.full((n, FOUND), -1, np.int64)
    many, clocks, states, counts = stack.problem, moving.clocks, moving.states, moving.counts
    follow_machines(many, room(many), *stack.laws, clocks, states, counts, strobes, rule, ended)
    for k, (status, closed, _caught, last) in enumerate(ended.tolist()):
        where = clocks[k], states[k], counts[k]
        yield Settled(oscillators[k], start, strobes[k, : last + 1], closed, STATUS[status], where)


def _stepped(oscillator: Oscillator, periods: int, rule: Any, start: dict[str, Any]) -> Settled:
    """One that is stepped."""
    tolerance, longest, ends, legs = rule
    run = Run(oscillator, periods=1, **start)
    engine, clock, state, count = run.engine, run.clock, run.state, run.count
    where = clock, state, count
    strobes = np.empty((periods + 1, STROBE))
    strobes[0] = engine.place(count[MODE], state[Q]), state[V], 0, 0.0
    none = np.empty((0, COLUMNS))
    closed = seen = 0
    for n in range(1, periods + 1):
        impacts, energy = count[IMPACT_COUNT], state[LOST]
        count[LEG_COUNT] = 0
        status = engine.run(clock, state, count, none, clock[TURNS] + 1.0, clock[PHASE], legs)
        if status != DONE:
            return Settled(oscillator, start, strobes[:n], 0, STATUS[status], where)
        place = engine.place(count[MODE], state[Q])
        strobes[n] = place, state[V], count[IMPACT_COUNT] - impacts, state[LOST] - energy
        m = closing(strobes, n, tolerance, longest)
        if m and ends:
            return Settled(oscillator, start, strobes[: n + 1], m, STATUS[DONE], where)
        closed, seen = (m, n) if m else (closed, seen)
    closed = closed if periods - seen <= 3 * longest else 0
    return Settled(oscillator, start, strobes, closed, STATUS[DONE], where)
