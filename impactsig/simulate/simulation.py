"""Oscillator -> Motion."""

from __future__ import annotations

from typing import Literal

from .._arguments import choice
from ..oscillators import Oscillator
from ._run import Run
from .motion import Motion
from .runge_kutta import FixedStep, RungeKutta


def simulate(
    oscillator: Oscillator,
    *,
    periods: float | None = None,
    duration: float | None = None,
    transient: float = 0.0,
    initial: tuple[float, float] = (0.0, 0.0),
    phase: float = 0.0,
    method: RungeKutta | FixedStep | None = None,
    keep: Literal["all", "counts"] = "all",
    chatter: float = 1e-6,
    skip_unreachable: bool = True,
) -> Motion:
    """The motion of an oscillator between stops, exact up to rounding where it is linear.

    Between events a linear motion is known in closed form; there is no time step and no tolerance,
    and the first contact cannot be missed. Hertz contacts and a force `law` of the user's are not
    linear: then the motion is stepped, to a tolerance (`RungeKutta`). Infinitely many rebounds in
    a finite time (chatter) are summed as the geometric series they are, and the mass sticks to the
    stop until the forcing lets go. Friction lets it slide and stick; the instants where it does
    either are as exact.

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
        Phase of the forcing at t = 0 [rad].
    method : RungeKutta or FixedStep, optional
        Step the motion in this way, linear or not. By default it is exact where it can be, and
        ``RungeKutta()`` elsewhere.
    keep : {"all", "counts"}
        "all" keeps what impacts, sticks and samples are made of, about 64 bytes an event;
        "counts" only counts, in constant memory. See `simulate_blocks` for what lies between.
    chatter : float
        Rebounds slower than this share of the greatest approach velocity so far are summed, where
        a rigid stop is pressed upon. It decides how many of them are listed one by one, not where
        the motion goes.
    skip_unreachable : bool
        End in one step a motion that can reach no stop any more.

    Returns
    -------
    Motion
        With a status: "complete"; "work limit" after 100 000 legs and 10 000 a period; "diverged"
        where a number overflowed; "broken law" where a function of the user's raised an error or
        returned what cannot be. What was computed until then is kept.

    Raises
    ------
    InvalidInput
        If an argument is out of its range, the mass starts beyond a rigid stop, or the oscillator
        has noise: then `simulate_ensemble` and `sample_path` move it.
    """
    choice("keep", keep, ("all", "counts"))
    run = Run(
        oscillator,
        periods=periods,
        duration=duration,
        transient=transient,
        initial=initial,
        phase=phase,
        method=method,
        chatter=chatter,
        skip_unreachable=skip_unreachable,
    )
    return run.motion(run.length, keep == "all")
