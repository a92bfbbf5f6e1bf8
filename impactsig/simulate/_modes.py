"""An oscillator in the units of the exact engine: its modes and their gaps, as tables."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..oscillators import KelvinVoigt, Oscillator, Rigid, Stop
from ._frame import forcing, reference_frequency
from ._user import compiled

if TYPE_CHECKING:
    from ._flow import Problem


class Tables(NamedTuple):
    """What the exact engine moves; all runs of an oscillator share it."""

    omega: float  # angular frequency of the reference
    modes: dict[tuple[int, int, frozenset[int]], int]  # by side, level and what is lifted; with
    # friction the mode for motion up, which is followed by that for motion down
    problem: Problem
    laws: tuple[Any, Any]  # restitution functions of the upper and of the lower stop


@lru_cache(maxsize=64)
def tables(oscillator: Oscillator, chatter: float, skip: bool) -> Tables:
    """The tables of an oscillator, kept for the next run of it.

    Raises
    ------
    InvalidInput
        If numba cannot compile a restitution that is a function.
    """
    from ._passing import constant_law

    omega = reference_frequency(oscillator)
    regions = _regions(oscillator, omega)
    laws = {"upper": constant_law, "lower": constant_law}
    for stop in oscillator.stops:
        if isinstance(stop.law, Rigid) and callable(stop.law.restitution):
            laws[stop.side] = compiled("restitution", stop.law.restitution, 1)
    problem = _problem(oscillator, omega, regions, chatter, skip)
    ways = 2 if problem.rubs else 1
    modes = {(r.side, r.level, r.lifted): ways * k for k, r in enumerate(regions)}
    return Tables(omega, modes, problem, (laws["upper"], laws["lower"]))


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


def only_pushes(stop: Stop) -> bool:
    """Whether the mass parts from a stop before the gap to it opens."""
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
            able = [m for m in range(level) if only_pushes(soft[m])]
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
            if not only_pushes(row[m]):
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
    # These arrays are so short that what they cost is being made: one for all columns, one for
    # all gaps, since an entry at a time took as long as all the rest.
    columns = [
        (
            region.stiffness / inertia,
            region.damping / (2 * oscillator.mass * omega),
            region.load / inertia - way * kinetic,
            region.origin,
        )
        for region, way in modes
    ]
    kappa, delta, constant, origin = np.array(columns).T.copy()
    # (sqrt kappa - delta)(sqrt kappa + delta) keeps the digits that kappa - delta^2 would lose.
    difference = (np.sqrt(kappa) - delta) * (np.sqrt(kappa) + delta)
    impedance = kappa[:, None] - ratio**2 + 2j * delta[:, None] * ratio
    # Without forcing the clock may well run at the natural frequency.
    response = np.divide(force, impedance, out=0 * impedance, where=force != 0)
    root = np.sqrt(np.abs(difference))

    powers = ratio[:, None] ** np.arange(5)
    size = max(len(region.gaps) for region in regions) + rubs
    rows, nothing = [], (0.0, 0.0, 0.0, 0, 0, 0, 0.0)
    for i, (region, way) in enumerate(modes):
        row = [
            (*known[:5], i if known[5] is None else len(ways) * known[5] + (way < 0), known[6])
            for known in region.gaps
        ]
        if rubs:
            row.append((0.0, way, 0.0, HALT, -1, i, 0.0))
        rows.append(row + [nothing] * (size - len(row)))
    table = np.array(rows, float).reshape(
        len(modes), size, 7
    )  # filled at once: an entry at a time took as long as the rest
    gap, means, land = (
        table[:, :, :3].copy(),
        table[:, :, 3:6].astype(np.int64),
        table[:, :, 6].copy(),
    )
    gaps = np.array([len(region.gaps) + rubs for region, _ in modes])
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
        reach=np.abs(response) @ powers,
        rate=np.maximum(ratio.max(), delta + root),
        ratio=ratio,
        force_cos=np.ascontiguousarray(force.real),
        force_sin=np.ascontiguousarray(-force.imag),
        force_bound=np.abs(force) @ powers[:, :4],
        pressed=np.array([region.level - len(region.lifted) for region, _ in modes]),
        gaps=gaps,
        leans=np.any(gap[:, :, 1], axis=1),
        gap=gap,
        means=means,
        land=land,
        origin=origin,
        side=np.array([1 if stop.side == "upper" else -1 for stop in oscillator.stops] or [0]),
        restitution=np.array([_restitution(law) for law in laws] or [0.0]),
        speed=omega,
        kinetic=kinetic,
        static=static,
        rubs=rubs,
        chatter=chatter,
        skip=bool(skip),
    )


def _restitution(law: Any) -> float:
    if not isinstance(law, Rigid):
        return -1.0
    return -2.0 if callable(law.restitution) else law.restitution
