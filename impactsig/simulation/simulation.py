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

    *An oscillator or a cantilever* is computed in closed form between events, without a time step
    or tolerance, and no contact is missed. With Hertz contacts or a user-defined force `law`, which
    are not linear, the motion is integrated to a tolerance (`RungeKutta`). Infinitely many rebounds
    in a finite time (chatter) are summed as a geometric series, and the mass sticks to the stop
    until the forcing releases it. Under friction the mass slides and sticks; the instants of these
    events are also exact. A cantilever moves in all its modes: at a rigid stop an impulse p
    reverses the velocity of the tip and changes every modal velocity by -p / m, with m the modal
    mass [WaggBishop2000]_.

    *An oscillator with noise* is simulated along one path, step by step; use `simulate_ensemble`
    for statistics of many paths.

    *A flow* is integrated by the method of Dormand and Prince of order 8 with a tolerance of 1e-13.
    In a chaotic flow errors grow by a factor e in the inverse of the largest exponent, so that
    after about 40 of these times the trajectory is still one of the flow, but no longer that of its
    initial state.

    *A controlled system* moves under its controller; see `Controlled`.

    *A batch of oscillators*, made by a scene from arrays, is simulated in one compiled call, with
    the same results as each oscillator alone; see `simulate_many`.

    Parameters
    ----------
    system : Oscillator, OscillatorBatch, Cantilever, Flow or Controlled
        The system.
    periods, duration : float
        Length of the simulation, in forcing periods or in seconds (of a flow, in its unit of time).
        Give one of them; flows and systems without forcing take `duration`.
    transient : float
        Length of the initial transient that is discarded: in forcing periods if `periods` is given,
        else in the unit of `duration`.
    initial : optional
        State at t = 0. For an oscillator displacement and velocity, in its units and relative to
        the ground, by default (0, 0); for a cantilever modal displacements [m] and velocities
        [m/s], from the first mode on, by default 0; for a flow its coordinates, by default those of
        `Flow.initial`; for a batch one state for all, or one each in an array of shape (n, 2).
    phase : float, optional
        Phase of the forcing at t = 0 [rad], by default 0. Not for flows.
    method : RungeKutta, FixedStep or str, optional
        For an oscillator, the integration method, also if it is linear. By default the motion is
        exact if possible, otherwise ``RungeKutta()`` (under delayed feedback
        ``RungeKutta(1e-12)``). With noise one of the methods of `simulate_ensemble`, by default
        "splitting".
    chatter : float
        Rebounds slower than this fraction of the greatest approach velocity so far are summed, if
        the mass is pressed against a rigid stop. It determines how many of them are listed, not the
        motion. Not for flows and with noise.
    keep : {"all", "counts"}
        For an oscillator: "all" keeps all events, about 64 bytes each, for impacts, sticks and
        samples; "counts" keeps only their numbers, in constant memory. `simulate_blocks` is an
        alternative for long runs.
    skip_unreachable : bool
        For an oscillator: whether to end the simulation in one step if the mass cannot reach a stop
        any more.
    seed : int, SeedSequence or Generator, optional
        Of the noise. The same seed gives the same result; a Generator is advanced.
    step, every : float, optional
        With noise: the time step [s], by default a fifth of the fastest time scale, and the
        interval between stored instants [s], by default the time step.
    path : int
        With noise: number of the path, which equals that of `simulate_ensemble` to the last bit
        (only to rounding if numba uses Intel SVML and the law has trigonometric functions).

    Returns
    -------
    Motion, Motions, BeamMotion, NoisyMotion, FlowMotion, ControlledMotion or ControlledFlowMotion
        Each has ``system``, ``start``, ``duration``, ``stop``, ``final``, ``sample(time)`` and a
        ``status``: "complete"; "work limit" if the greatest number of legs (for an oscillator 100
        000 plus 10 000 per period) was reached; "diverged" if a number overflowed, or, under
        feedback and for stepped motions, exceeded 2^53 times the size of the system (the greatest
        of the distances of its stops, the displacement by its forces, and the initial state), where
        rounding errors are as large as that size; "broken law" if a user's function raised an error
        or returned an invalid value. Results up to that time are kept.

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
