"""`simulate`: from any system to its motion."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import lru_cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal, overload

from .._arguments import choice, unless
from ..errors import InvalidInput
from ..oscillators import Cantilever, Oscillator
from ..oscillators.flows import Flow
from .motion import Motion
from .run import Run
from .stepping.runge_kutta import FixedStep, RungeKutta

if TYPE_CHECKING:
    from .._arguments import Seed
    from ..oscillators.batch import OscillatorBatch
    from .batches.motions import Motions
    from .beam.beam_motion import BeamMotion
    from .flows.flow_motion import FlowMotion

CHATTER = 1e-6
DEFAULTS = {"chatter": CHATTER, "keep": "all", "skip_unreachable": True, "path": 0}
SYSTEMS = "an Oscillator or a batch of them, a Cantilever, a Flow, or one of them Controlled"


@overload
def simulate(system: Oscillator, **options: Any) -> Motion: ...
@overload
def simulate(system: OscillatorBatch, **options: Any) -> Motions: ...
@overload
def simulate(system: Cantilever, **options: Any) -> BeamMotion: ...
@overload
def simulate(system: Flow, **options: Any) -> FlowMotion: ...
@overload
def simulate(system: Any, **options: Any) -> Any: ...


def simulate(  # type: ignore[misc]
    system: Any,
    *,
    periods: float | None = None,
    duration: float | None = None,
    transient: float = 0.0,
    initial: Any = None,
    phase: float | None = None,
    method: RungeKutta | FixedStep | str | None = None,
    chatter: float = CHATTER,
    keep: Literal["all", "counts"] = "all",
    skip_unreachable: bool = True,
    seed: Seed = None,
    step: float | None = None,
    every: float | None = None,
    path: int = 0,
) -> Any:
    """Simulate a system; exact up to rounding where it is linear between events.

    *An oscillator or a cantilever* moves in closed form between events; there is no time step and
    no tolerance, and the first contact cannot be missed. Hertz contacts and a force `law` of the
    user's are not linear: then the motion is stepped, to a tolerance (`RungeKutta`). Infinitely
    many rebounds in a finite time (chatter) are summed as the geometric series they are, and the
    mass sticks to the stop until the forcing lets go. Friction lets it slide and stick; the
    instants where it does either are as exact. A cantilever moves in all its modes: at a rigid stop
    an impulse p turns the tip's velocity round and changes every modal velocity by -p / m, m the
    modal mass [WaggBishop2000]_.

    *An oscillator with noise* moves along one path, step by step; `simulate_ensemble` follows many
    and keeps none.

    *A flow* is stepped by Dormand and Prince's method of order 8 at a tolerance of 1e-13. In a
    chaotic flow an error grows e-fold in the inverse of the largest exponent, so that after some 40
    of these the trajectory is one of the flow, but no longer that of its initial state.

    *A controlled system* moves under its controller; see `Controlled`.

    *A batch of oscillators*, as scenes make of arrays, moves in one compiled call, each as it moves
    alone; see `simulate_many`.

    Parameters
    ----------
    system : Oscillator, OscillatorBatch, Cantilever, Flow or Controlled
        The system.
    periods, duration : float
        Length of the simulation, in forcing periods or in seconds (of a flow, in its unit of time).
        Give one of them; flows and systems without forcing take `duration`.
    transient : float
        Length of the transient that is discarded before: in forcing periods if `periods` is given,
        else in the unit of `duration`.
    initial : optional
        State at t = 0. Of an oscillator displacement and velocity, in its units and against the
        ground, (0, 0) unless given; of a cantilever modal displacements [m] and velocities [m/s],
        from the first mode on, 0 unless given; of a flow its coordinates, those of the flow unless
        given; of a batch one start for all, or one each in an array of shape (n, 2).
    phase : float, optional
        Phase of the forcing at t = 0 [rad]; 0 unless given. Not for flows.
    method : RungeKutta, FixedStep or str, optional
        Of an oscillator: step the motion in this way, linear or not; by default it is exact where
        it can be, and ``RungeKutta()`` elsewhere (under delayed feedback ``RungeKutta(1e-12)``).
        With noise one of the methods of `simulate_ensemble`, "splitting" by default.
    chatter : float
        Rebounds slower than this share of the greatest approach velocity so far are summed, where
        a rigid stop is pressed upon. It decides how many of them are listed one by one, not where
        the motion goes. Not for flows and with noise.
    keep : {"all", "counts"}
        Of an oscillator: "all" keeps what impacts, sticks and samples are made of, about 64 bytes
        an event; "counts" only counts, in constant memory. See `simulate_blocks` for what lies
        between.
    skip_unreachable : bool
        Of an oscillator: end in one step a motion that can reach no stop any more.
    seed : int, SeedSequence or Generator, optional
        Of the noise. The same seed gives the same result; a Generator is advanced.
    step, every : float, optional
        With noise: the step, by default a fifth of the fastest time scale, and the time from one
        instant to the next that is kept, a step by default [s].
    path : int
        With noise: number of the path, the same as in `simulate_ensemble` to the last bit; to
        rounding only, where numba has Intel's SVML and the law takes sines.

    Returns
    -------
    Motion, Motions, BeamMotion, NoisyMotion, FlowMotion, ControlledMotion or ControlledFlowMotion
        Each has ``system``, ``start``, ``duration``, ``stop``, ``final``, ``sample(time)`` and a
        ``status``: "complete"; "work limit" where the number of legs (of an oscillator 100 000 and
        10 000 a period) is used up; "diverged" where a number overflowed, or under feedback and
        where motions are stepped, where rounding became as large as the machine (at 2^53 times the
        greatest of its stops' distances, what its forces displace, and the start); "broken law"
        where a function of the user's raised an error or returned what cannot be. What was computed
        until then is kept.

    Raises
    ------
    InvalidInput
        If an argument is out of range or does not apply to the system, or the system starts beyond
        a rigid stop.

    See Also
    --------
    simulate_many, simulate_blocks, simulate_ensemble, sweep

    Examples
    --------
    >>> import numpy as np
    >>> from impactsig import flows, scenes, simulate
    >>> motion = simulate(scenes.karpodinis(22.1), periods=100, transient=500)
    >>> motion.impact_count  # one impact a period
    100
    >>> lorenz = simulate(flows.lorenz(), duration=20, transient=5)
    >>> x = lorenz.sample(lorenz.start + 0.04 * np.arange(500))[:, 0]
    """
    given: dict[str, Any] = {"periods": periods, "duration": duration, "transient": transient}
    rest = {
        "initial": initial, "phase": phase, "method": method, "chatter": chatter, "keep": keep,
        "skip_unreachable": skip_unreachable, "seed": seed, "step": step, "every": every,
        "path": path,
    }  # fmt: skip
    for name, value in rest.items():
        if value is not DEFAULTS.get(name):
            given[name] = value
    return mover(system, given)(system, **given)


def mover(system: Any, given: dict[str, Any]) -> Callable[..., Any]:
    """The function that simulates a system, after a check of the options given.

    Raises
    ------
    InvalidInput
        If it is no system, or takes no such option.
    """
    if not isinstance(getattr(system, "moved_by", None), str) or isinstance(system, type):
        raise InvalidInput("system", system, SYSTEMS, "scenes and flows of impactsig have some")
    move, accepted = _loaded(system.moved_by)
    for name, value in given.items():
        meant = unless(0.0, value) if name == "transient" else value
        if name not in accepted and meant is not None:
            taken = ", ".join(sorted(accepted))
            raise InvalidInput(
                name, value, f"no {name} for {what_it_is(system)}", f"It takes {taken}"
            )
    for name in set(given) - accepted:
        del given[name]
    return move


def what_it_is(system: Any) -> str:
    """A system in words: "an Oscillator with noise"."""
    name = type(system).__name__
    noisy = " with noise" if getattr(system, "noise", None) is not None else ""
    return f"{'an' if name[0] in 'AEIO' else 'a'} {name}{noisy}"


@lru_cache
def _loaded(home: str) -> tuple[Callable[..., Any], frozenset[str]]:
    """The function `move` of a module, and the names of its options."""
    move = import_module(home).move
    return move, frozenset(list(inspect.signature(move).parameters)[1:])


def move(
    oscillator: Oscillator,
    *,
    periods: float | None = None,
    duration: float | None = None,
    transient: float = 0.0,
    initial: Any = (0.0, 0.0),
    phase: float = 0.0,
    method: RungeKutta | FixedStep | None = None,
    chatter: float = CHATTER,
    keep: Literal["all", "counts"] = "all",
    skip_unreachable: bool = True,
) -> Motion:
    """Simulate an oscillator without noise."""
    choice("keep", keep, ("all", "counts"))
    run = Run(
        oscillator, periods=periods, duration=duration, transient=transient, initial=initial,
        phase=phase, method=method, chatter=chatter, skip_unreachable=skip_unreachable,
    )  # fmt: skip
    return run.motion(run.length, keep == "all")
