"""The exact engine for an oscillator: its modes and gaps as tables, and calls of the kernels."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..oscillators import KelvinVoigt, Oscillator, Rigid, Stop
from ._events import COUNTERS
from ._frame import forcing, reference_frequency
from ._user import compiled

if TYPE_CHECKING:
    from ._flow import Problem, Scratch


class ExactEngine:
    """Moves a piecewise linear oscillator; fulfils `_events.Engine`."""

    def __init__(self, oscillator: Oscillator, chatter: float, skip: bool) -> None:
        from ._flow import COMPLETE, Scratch
        from ._passing import constant_law

        self.oscillator = oscillator
        self.omega = reference_frequency(oscillator)
        self.regions = _regions(oscillator, self.omega)
        self.problem = _problem(oscillator, self.omega, self.regions, chatter, skip)
        self.scratch: Scratch = Scratch(
            np.empty((len(self.problem.ratio), 5)),
            np.empty(COMPLETE + 1),
            np.empty((self.problem.gap.shape[1], 4)),
        )
        self.laws = [constant_law, constant_law]
        for stop in oscillator.stops:
            if isinstance(stop.law, Rigid) and callable(stop.law.restitution):
                law = compiled("restitution", stop.law.restitution, 1)
                self.laws[stop.side == "lower"] = law

    def begin(self, q: float, v: float, phase: float) -> tuple[np.ndarray, np.ndarray]:
        """State and counters of a start; the stops that are pressed on follow from it."""
        p, oscillator = self.problem, self.oscillator
        side, level, lifted = 0, 0, frozenset[int]()
        for name, sign in (("upper", 1), ("lower", -1)):
            for stop in oscillator.stops_on(name):
                depth = sign * (q - stop.position)
                if depth <= 0:
                    break
                if isinstance(stop.law, Rigid):
                    q = stop.position
                    break
                side, level = sign, level + 1
                force = stop.law.stiffness * depth + stop.law.damping * self.omega * sign * v
                if force < 0 and _only_pushes(stop):
                    lifted |= {level - 1}
        names = [(region.side, region.level, region.lifted) for region in self.regions]
        mode = names.index((side, level, lifted))
        if p.rubs:
            mode = 2 * mode + (v < 0)
        count = np.zeros(COUNTERS, np.int64)
        count[0] = mode
        # A first touch at next to no speed must not set the scale of chatter.
        slow = 1e-6 * (p.force_bound[0] + abs(oscillator.load) / (oscillator.mass * self.omega**2))
        return np.array([q - p.origin[mode], v, slow, 0.0]), count

    def run(
        self,
        clock: np.ndarray,
        state: np.ndarray,
        count: np.ndarray,
        events: np.ndarray,
        end_turns: float,
        end_phase: float,
        legs: int,
    ) -> int:
        """Move to the end, writing events until they are full; a status."""
        from ._engine import run

        return run(
            self.problem, self.scratch, clock, state, count, events, end_turns, end_phase, legs,
            *self.laws,
        )  # fmt: skip

    def place(self, mode: Any, q: Any) -> Any:
        """Position in the coordinates of the stops, of positions from the origins of modes."""
        return self.problem.origin[np.asarray(mode, int)] + q

    def sample(
        self, rows: np.ndarray, where: np.ndarray, turns: np.ndarray, phase: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity at instants, each after the row that `where` names."""
        from ._look import sample

        q, v = np.empty(len(turns)), np.empty(len(turns))
        sample(self.problem, self.scratch, rows, where, turns, phase, q, v)
        return q, v

    def peaks(
        self, rows: np.ndarray, first: np.ndarray, last: np.ndarray, end: tuple[float, float]
    ) -> np.ndarray:
        """Greatest force of contacts, from the TOUCH in row `first` to row `last` or the end."""
        from ._look import peaks

        stops = self.oscillator.stops
        soft = [s.law if isinstance(s.law, KelvinVoigt) else KelvinVoigt(1.0) for s in stops]
        springs = np.array([law.stiffness for law in soft])
        dampers = np.array([law.damping for law in soft]) * self.omega
        positions = np.array([stop.position for stop in stops])
        peak = np.empty(len(first))
        peaks(self.problem, self.scratch, rows, first, last, end, springs, dampers, positions, peak)
        return peak


@dataclass
class _Region:
    """Soft stops pressed on: `level` of that side reached, those in `lifted` not pressed."""

    side: int
    level: int
    lifted: frozenset[int]
    origin: float
    stiffness: float
    damping: float
    load: float
    gaps: list[tuple[float, float, float, int, int, Any, float]] = field(default_factory=list)


def _only_pushes(stop: Stop) -> bool:
    return isinstance(stop.law, KelvinVoigt) and stop.law.ends == "force" and stop.law.damping > 0


def _regions(oscillator: Oscillator, omega: float) -> list[_Region]:
    """Every combination of stops that can be pressed on, with its gaps.

    A gap is alpha, beta, gamma, meaning, stop, region beyond, and position there.
    """
    from ._passing import CLEAR, ENTER, HIT, LEAVE, LIFT, PRESS

    rows = {1: oscillator.stops_on("upper"), -1: oscillator.stops_on("lower")}
    regions = [_region(oscillator, 0, 0, frozenset(), ())]
    for side, row in rows.items():
        soft = [stop for stop in row if isinstance(stop.law, KelvinVoigt)]
        for level in range(1, len(soft) + 1):
            able = [m for m in range(level) if _only_pushes(soft[m])]
            for mask in range(2 ** len(able)):
                lifted = frozenset(m for n, m in enumerate(able) if mask >> n & 1)
                regions.append(_region(oscillator, side, level, lifted, tuple(soft[:level])))
    known = {(r.side, r.level, r.lifted): k for k, r in enumerate(regions)}

    def origin(side: int, level: int) -> float:
        return rows[side][level - 1].position if level else 0.0

    for region in regions:
        here, level, lifted = region.origin, region.level, region.lifted
        for side in (1, -1) if level == 0 else (region.side,):
            row = rows[side]
            if level < len(row):
                stop = row[level]
                number = oscillator.stops.index(stop)
                room = side * (stop.position - here)
                if isinstance(stop.law, Rigid):
                    region.gaps.append((-side, 0.0, room, HIT, number, None, 0.0))
                else:
                    beyond = known[side, level + 1, lifted]
                    region.gaps.append((-side, 0.0, room, ENTER, number, beyond, 0.0))
        if level == 0:
            continue
        side, row = region.side, rows[region.side]
        last = level - 1
        left = lifted - {last}
        beyond = known[(side, last, left) if last else (0, 0, left)]
        land = here - origin(side, last)
        number = oscillator.stops.index(row[last])
        meaning = CLEAR if last in lifted else LEAVE
        region.gaps.append((side, 0.0, 0.0, meaning, number, beyond, land))
        for m in range(level):
            if not _only_pushes(row[m]):
                continue
            law: Any = row[m].law
            sign = -side if m in lifted else side
            lag = law.damping * omega / law.stiffness
            offset = here - row[m].position
            number = oscillator.stops.index(row[m])
            meaning = PRESS if m in lifted else LIFT
            beyond = known[side, level, lifted ^ {m}]
            gap = (sign, sign * lag, sign * offset, meaning, number, beyond, 0.0)
            region.gaps.append(gap)
    return regions


def _region(
    oscillator: Oscillator, side: int, level: int, lifted: frozenset[int], soft: tuple[Stop, ...]
) -> _Region:
    origin = soft[-1].position if soft else 0.0
    stiffness, damping = oscillator.stiffness, oscillator.damping
    load = oscillator.load - stiffness * origin
    for m, stop in enumerate(soft):
        if m not in lifted:
            law: Any = stop.law
            stiffness += law.stiffness
            damping += law.damping
            load -= law.stiffness * (origin - stop.position)
    return _Region(side, level, lifted, origin, stiffness, damping, load)


def _problem(
    oscillator: Oscillator, omega: float, regions: list[_Region], chatter: float, skip: bool
) -> Problem:
    """The kernel's tables; with friction every region is two modes, for motion up and down."""
    from ._flow import Problem
    from ._passing import HALT

    inertia = oscillator.mass * omega**2
    friction = oscillator.friction
    kinetic = friction.kinetic / inertia if friction else 0.0
    static = friction.static / inertia if friction else 0.0  # type: ignore[operator]
    rubs = static > 0
    ways = (1, -1) if rubs else (0,)
    modes = [(region, way) for region in regions for way in ways]

    ratio, force = forcing(oscillator)
    kappa = np.array([region.stiffness / inertia for region, _ in modes])
    delta = np.array([region.damping / (2 * oscillator.mass * omega) for region, _ in modes])
    constant = np.array([region.load / inertia - way * kinetic for region, way in modes])
    # (sqrt kappa - delta)(sqrt kappa + delta) keeps the digits that kappa - delta^2 would lose.
    difference = (np.sqrt(kappa) - delta) * (np.sqrt(kappa) + delta)
    impedance = kappa[:, None] - ratio**2 + 2j * delta[:, None] * ratio
    # Without forcing the clock may well run at the natural frequency.
    response = np.divide(force, impedance, out=0 * impedance, where=force != 0)
    root = np.sqrt(np.abs(difference))

    size = max(len(region.gaps) for region in regions) + rubs
    gap, means = np.zeros((len(modes), size, 3)), np.zeros((len(modes), size, 3), np.int64)
    land, gaps = np.zeros((len(modes), size)), np.zeros(len(modes), np.int64)
    for i, (region, way) in enumerate(modes):
        for s, (alpha, beta, gamma, meaning, stop, beyond, at) in enumerate(region.gaps):
            gap[i, s] = alpha, beta, gamma
            target = i if beyond is None else len(ways) * beyond + (way < 0)
            means[i, s] = meaning, stop, target
            land[i, s] = at
        gaps[i] = len(region.gaps) + rubs
        if rubs:
            gap[i, gaps[i] - 1] = 0.0, way, 0.0
            means[i, gaps[i] - 1] = HALT, -1, i
    laws = [stop.law for stop in oscillator.stops]
    return Problem(
        kappa=kappa,
        delta=delta,
        root=root,
        sort=np.sign(difference),
        constant=constant,
        rest=np.divide(constant, kappa, out=np.zeros(len(modes)), where=kappa >= 1),
        drift=np.where(kappa >= 1, 0.0, constant),
        cosine=np.ascontiguousarray(response.real),
        sine=np.ascontiguousarray(-response.imag),
        reach=np.stack([np.abs(response) @ ratio**n for n in range(5)], axis=1),
        rate=np.maximum(ratio.max(), delta + root),
        ratio=ratio,
        force_cos=np.ascontiguousarray(force.real),
        force_sin=np.ascontiguousarray(-force.imag),
        force_bound=np.array([np.abs(force) @ ratio**n for n in range(4)]),
        pressed=np.array([region.level - len(region.lifted) for region, _ in modes]),
        gaps=gaps,
        leans=np.any(gap[:, :, 1], axis=1),
        gap=gap,
        means=means,
        land=land,
        origin=np.array([region.origin for region, _ in modes]),
        side=np.array([1 if stop.side == "upper" else -1 for stop in oscillator.stops] or [0]),
        restitution=np.array([_restitution(law) for law in laws] or [0.0]),
        speed=omega,
        kinetic=kinetic,
        static=static,
        rubs=rubs,
        chatter=chatter,
        skip=skip,
    )


def _restitution(law: Any) -> float:
    if not isinstance(law, Rigid):
        return -1.0
    return -2.0 if callable(law.restitution) else law.restitution
