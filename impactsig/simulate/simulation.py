"""Oscillator -> Motion: the run, in chunks of bounded memory."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ..errors import InvalidInput
from ..oscillators import Oscillator, Rigid
from ._problem import base_motion, pose, reference_frequency
from .motion import Motion, assemble

if TYPE_CHECKING:
    from ._engine import Problem, Scratch

CHUNK = 65536  # events that are held at a time
LEGS_PER_PERIOD = 10_000  # work, on average, after which a run is given up
STATUS = {0: "complete", 2: "work limit", 3: "diverged"}


def simulate(
    oscillator: Oscillator,
    *,
    periods: float | None = None,
    duration: float | None = None,
    transient: float = 0.0,
    initial: tuple[float, float] = (0.0, 0.0),
    phase: float = 0.0,
    keep: Literal["all", "counts"] = "all",
    chatter: float = 1e-6,
    skip_unreachable: bool = True,
) -> Motion:
    """The motion of an oscillator between stops, exact up to rounding.

    Between events the motion is known in closed form; there is no time step and no tolerance. The
    first contact cannot be missed. Infinitely many rebounds in a finite time (chatter) are summed
    as the geometric series they are, and the mass sticks to the stop until the forcing lets go.

    Parameters
    ----------
    oscillator : Oscillator
        What moves.
    periods, duration : float
        How long to look: in forcing periods, or in seconds. Give one of them.
    transient : float
        How long to let it run before: in forcing periods with `periods`, in seconds with
        `duration`.
    initial : (float, float)
        Displacement and velocity at t = 0, in the oscillator's units, against the ground.
    phase : float
        Phase of the reference forcing at t = 0 [rad].
    keep : {"all", "counts"}
        "all" keeps what impacts, sticks and samples are made of, about 56 bytes an event;
        "counts" only counts, in constant memory.
    chatter : float
        Rebounds slower than this share of the greatest approach velocity so far are summed, where
        a rigid stop is pressed upon. It decides how many of them are listed one by one, not where
        the motion goes.
    skip_unreachable : bool
        End in one step a motion that can reach no stop any more.

    Returns
    -------
    Motion
        With a status: "complete", "work limit" after 10 000 legs a period on average, or
        "diverged" where a number overflowed; what was computed until then is kept.

    Raises
    ------
    InvalidInput
        If an argument is out of its range, or the mass starts beyond a rigid stop.
    """
    if not isinstance(oscillator, Oscillator):
        raise InvalidInput("oscillator", oscillator, "an Oscillator, as impactsig.scenes makes")
    if (periods is None) == (duration is None):
        raise InvalidInput(
            "periods, duration", f"{periods}, {duration}", "one of them, and only one"
        )
    if keep not in ("all", "counts"):
        raise InvalidInput("keep", keep, '"all" or "counts"')
    if not 0 < chatter <= 1e-2:
        raise InvalidInput("chatter", chatter, "0 < chatter <= 0.01")
    if periods is not None and oscillator.forcing_frequency is None:
        raise InvalidInput("periods", periods, "duration=, as there is no forcing to count by")
    name, wanted = ("periods", periods) if duration is None else ("duration", duration)
    length = _number(name, wanted, above=0.0)
    before = _number("transient", transient, least=0.0)
    phase = math.fmod(_number("phase", phase), 2 * math.pi) % (2 * math.pi)

    from ._engine import COLUMNS, ORDER, START, STICK, Scratch

    problem = pose(oscillator, chatter, skip_unreachable)
    omega = reference_frequency(oscillator)
    state, count = _begin(oscillator, problem, initial, phase, omega)
    clock = np.array([0.0, phase, 0.0])
    scratch = Scratch(np.empty((len(problem.ratio), 3)), np.empty(ORDER + 1))
    per_turn = 1.0 if duration is None else omega / (2 * math.pi * oscillator.time_unit)
    middle, end = _after(phase, before * per_turn), _after(phase, (before + length) * per_turn)

    none = np.empty((0, COLUMNS))
    status, _ = _run(problem, scratch, clock, state, count, none, middle)
    count[2:5], state[3] = 0, 0.0
    side = count[1] or {0: 0, 1: 1, 2: -1}[int(count[0])]
    first = [clock[0], clock[1], STICK if count[1] else START, side, state[0], state[1], 0.0]
    rows = none
    if status == "complete":
        buffer = none if keep == "counts" else np.empty((CHUNK, COLUMNS))
        status, rows = _run(problem, scratch, clock, state, count, buffer, end)
    if keep == "all":
        rows = np.concatenate([[first], rows])
    return assemble(oscillator, problem, phase, first, rows, clock, state, count, status)


def _run(
    problem: Problem,
    scratch: Scratch,
    clock: np.ndarray,
    state: np.ndarray,
    count: np.ndarray,
    buffer: np.ndarray,
    end: tuple[float, float],
) -> tuple[str, np.ndarray]:
    """Call the engine until it is done; its status, and the events of all calls."""
    from ._engine import FULL, run

    legs = 100_000 + int(min(LEGS_PER_PERIOD * max(end[0] - clock[0], 0), 2**62))
    parts = []
    count[6] = 0
    while True:
        found = run(
            problem, scratch, clock, state, count, buffer, end[0], end[1], legs - int(count[6])
        )
        parts.append(buffer[: count[5]].copy())
        if found != FULL:
            return STATUS[found], np.concatenate(parts)


def _begin(
    oscillator: Oscillator, problem: Problem, initial: Any, phase: float, omega: float
) -> tuple[np.ndarray, np.ndarray]:
    """State and counters of the engine at t = 0."""
    try:
        x, v = (float(value) for value in initial)
    except (TypeError, ValueError):
        raise InvalidInput("initial", initial, "displacement and velocity") from None
    if not (math.isfinite(x) and math.isfinite(v)):
        raise InvalidInput("initial", initial, "finite displacement and velocity")
    ratio = oscillator.base.frequency / omega if oscillator.base else 1.0
    at, moving = base_motion(oscillator, ratio * phase)
    q, u = x - float(at), (v - float(moving)) / omega
    region = 0
    for k, (side, sign) in enumerate((("upper", 1), ("lower", -1))):
        stop = next(iter(oscillator.stops_on(side)), None)
        depth = sign * (q - problem.stop[k])
        if stop is None or depth <= 0:
            continue
        if isinstance(stop.law, Rigid):
            swing = oscillator.base.amplitude if oscillator.base else 0.0
            if depth > 1e-12 * (abs(x) + abs(swing) + abs(stop.position)):
                raise InvalidInput(
                    "initial", f"x = {x:.9g}", f"a start on this side of the {side} rigid stop",
                    f"It is {depth:.3g} beyond",
                )  # fmt: skip
            q = problem.stop[k]
        else:
            region, q = k + 1, q - problem.stop[k]
    count = np.zeros(7, np.int64)
    count[0] = region
    # A first touch at next to no speed must not set the scale of chatter.
    slow = 1e-6 * (problem.force_bound[0] + abs(problem.constant[0]))
    return np.array([q, u, slow, 0.0]), count


def _after(phase: float, turns: float) -> tuple[float, float]:
    """Turns and phase after so many turns more; whole ones leave the phase as it is."""
    whole = math.floor(turns)
    last = phase + 2 * math.pi * (turns - whole)
    more = last >= 2 * math.pi
    return float(whole + more), last - 2 * math.pi * more


def _number(name: str, value: Any, above: float = -math.inf, least: float = -math.inf) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not (math.isfinite(number) and number > above and number >= least):
        limit = f" > {above:g}" if above > -math.inf else f" >= {least:g}"
        raise InvalidInput(name, value, "a finite number" + (limit if "inf" not in limit else ""))
    return number
