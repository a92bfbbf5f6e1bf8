"""Runge-Kutta methods for a simulation, and the engine that steps with them."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._arguments import whole
from ...oscillators import Oscillator
from ...oscillators.laws import HERTZ, PLACE, PUSHER, RIGID, spring_push
from ...oscillators.parts import numbers
from ..basis.events import COUNTERS, MODE
from ..basis.frame import forcing, pace, reference_frequency, swings
from ..basis.tableau import DEGREE, tableau
from ..exact.user import compiled, restitution_laws

if TYPE_CHECKING:
    from ..basis.contract import Moment
    from .rates import Functions, Problem

BEYOND = 2.0**53
"""Times the size of a machine and its start: there rounding is as large as the machine."""
OVERFLOWS = 1e140
"""Displacement or velocity whose square, and what is made of it, may overflow."""


@dataclass(frozen=True)
class RungeKutta:
    """Dormand and Prince's method of order 8 with adaptive steps.

    [HairerNorsettWanner1993]_, section II.10: error estimates of orders 5 and 3, and an
    interpolant of degree 7 on which the events are found.

    Parameters
    ----------
    tolerance : float
        Error of a step, relative to the velocity of the motion.

    Raises
    ------
    InvalidInput
        If the tolerance is out of its range.

    See Also
    --------
    FixedStep, simulate

    Examples
    --------
    >>> from impactsig import RungeKutta, scenes, simulate
    >>> motion = simulate(scenes.karpodinis(22.1), periods=20, method=RungeKutta(1e-10))
    >>> motion.status
    'complete'
    """

    tolerance: float = 1e-10

    def __post_init__(self) -> None:
        numbers(self, "tolerance", least=1e-14, most=1e-2)


@dataclass(frozen=True)
class FixedStep:
    """The classical Runge-Kutta method of order 4 with fixed steps, as in [Karpodinis]_.

    A step that ends beyond a stop is bisected to end at the stop. Contacts that begin and end
    within a step are missed. Use this method for comparisons only.

    Parameters
    ----------
    steps : int
        Number of steps per period of the first force, or else of the base (without forcing, per
        natural period).

    Raises
    ------
    InvalidInput
        If `steps` is not an integer in range.

    See Also
    --------
    RungeKutta, simulate

    Examples
    --------
    >>> from impactsig import FixedStep, scenes, simulate
    >>> motion = simulate(scenes.karpodinis(22.1), periods=5, method=FixedStep(500))
    >>> motion.status
    'complete'
    """

    steps: int = 300

    def __post_init__(self) -> None:
        object.__setattr__(self, "steps", whole("steps", self.steps, 8, 1_000_000))


class SteppingEngine:
    """The engine of oscillators with forces of any kind; implements `contract.Engine`.

    State and counters go on after the contract's entries with what the next step needs, so that a
    run that is cut where its buffer is full goes on as if it had not been cut. A row MARK is
    written once in a forcing period, for `sample` to go on from; one with a stop tells the approach
    velocity of a contact that was under way when the rows began.

    Parameters
    ----------
    oscillator : Oscillator
        The system.
    method : RungeKutta or FixedStep
        How it is stepped.
    chatter : float
        Rebounds slower than this share of the greatest approach velocity so far are summed, where
        a rigid stop is pressed upon.

    Raises
    ------
    InvalidInput
        If numba cannot compile the oscillator's `law`, or a restitution that is a function.
    """

    def __init__(
        self, oscillator: Oscillator, method: RungeKutta | FixedStep, chatter: float = 1e-6
    ) -> None:
        from .rates import Scratch

        self._made_of = oscillator, method, chatter
        self.omega: float = reference_frequency(oscillator)
        self._functions = _functions(oscillator)
        self._problem = _pose(oscillator, method, chatter)
        self._tableau = tableau()
        stops = len(oscillator.stops)
        self._scratch = Scratch(
            waves=np.empty_like(self._problem.waves),
            hertz=np.empty((stops, 5)),
            kq=np.empty(16),
            kv=np.empty(16),
            q=np.empty(DEGREE + 1),
            v=np.empty(DEGREE + 1),
            events=np.empty((2 * stops + 1, 6)),
            stack=np.empty((64, DEGREE + 3)),
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """To other processes: made anew there, since compiled functions cannot go."""
        return SteppingEngine, self._made_of

    def begin(self, q: float, v: float, phase: float) -> tuple[np.ndarray, np.ndarray]:
        """State and counters of a start at q, v (in the engine's units) and that phase.

        A start inside a Lankarani-Nikravesh stop takes for its approach velocity that from which
        the contact, without loss, would have come there.
        """
        from .rates import PUSHING, SLACK

        far = max(self._problem.far, BEYOND * abs(q), BEYOND * abs(v))
        p = self._problem = self._problem._replace(start=float(phase), far=min(far, OVERFLOWS))
        mode, at = 0, 0.0
        approach = np.zeros(len(p.stops))
        for k in p.order:
            place, side, law, stiffness, loss, n, _, weight = p.stops[k]
            depth = side * (q - place)
            if depth <= 0:
                continue
            if law == RIGID:
                q = place
                continue
            slack = law == PUSHER and spring_push(stiffness, loss, depth, side * v) <= 0
            mode += int(weight) * (SLACK if slack else PUSHING)
            at = place
            if law == HERTZ:
                approach[k] = math.sqrt(v * v + 2 * stiffness / (n + 1) * depth ** (n + 1))
        # A first touch at next to no speed must not set the scale of chatter.
        slow = 1e-6 * (np.abs(p.waves[:, 1]).sum() + abs(p.constant))
        state = np.array([q - at, v, slow, 0.0, p.fixed, abs(v), *approach])
        count = np.zeros(COUNTERS + 2, np.int64)
        count[MODE] = mode
        return state, count

    def run(self, now: Moment, events: np.ndarray, end: tuple[float, float], legs: int) -> int:
        """Move to the end, writing events until they are full; a status."""
        from .stepping import run

        return run(
            self._problem, self._tableau, self._functions, self._scratch,
            *now, events, *map(float, end), int(legs),
        )  # fmt: skip

    def place(self, mode: Any, q: Any) -> Any:
        """Position in the coordinates of the stops, of positions from the origins of modes."""
        from .rates import WEIGHT

        p = self._problem
        origin = np.zeros(np.shape(mode))
        for k in p.order:
            reached = np.asarray(mode).astype(np.int64) // int(p.stops[k, WEIGHT]) % 3 != 0
            origin = np.where(reached, p.stops[k, PLACE], origin)
        return q + origin

    def sample(
        self, rows: np.ndarray, where: np.ndarray, turns: np.ndarray, phase: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Position and velocity at instants, each after the row that `where` names."""
        from .retrace import sample

        q, v = np.empty(len(turns)), np.empty(len(turns))
        order = np.lexsort((phase, turns, where))
        sample(
            self._problem, self._tableau, self._functions, self._scratch,
            _reading(rows), np.asarray(where, np.int64),
            np.asarray(turns, float), np.asarray(phase, float), order, q, v,
        )  # fmt: skip
        return q, v

    def peaks(
        self, rows: np.ndarray, first: np.ndarray, last: np.ndarray, end: tuple[float, float]
    ) -> np.ndarray:
        """Greatest force of contacts, from the TOUCH in row `first` to row `last` or the end."""
        from .retrace import peaks

        out = np.empty(len(first))
        peaks(
            self._problem, self._tableau, self._functions, self._scratch,
            _reading(rows), np.asarray(first, np.int64), np.asarray(last, np.int64), *end, out,
        )  # fmt: skip
        return out * self._problem.inertia


def _reading(rows: np.ndarray) -> np.ndarray:
    """Rows that cannot be written to: numba compiles for either kind of array."""
    view = rows.view()
    view.flags.writeable = False
    return view


@lru_cache(maxsize=64)
def _pose(oscillator: Oscillator, method: RungeKutta | FixedStep, chatter: float) -> Problem:
    """The kernel's problem, in coordinates in which the stops rest; kept for the next run of it."""
    from .rates import Problem

    omega = reference_frequency(oscillator)
    mass, damping, stiffness = oscillator.mass, oscillator.damping, oscillator.stiffness
    inertia = mass * omega**2
    base = oscillator.base
    carried = base if base is not None and base.stops else None
    waves = [
        (ratio, abs(amplitude), cmath.phase(amplitude))
        for ratio, amplitude in forcing(oscillator)
        if amplitude
    ]

    stops = []
    for k, stop in enumerate(oscillator.stops):
        row = stop.law.row(inertia, mass * omega, omega)
        stops.append((stop.position, stop.sign, *row, 3.0 ** (k + 1)))
    order = sorted(range(len(stops)), key=lambda k: (-stops[k][1], stops[k][1] * stops[k][0]))

    steps = method.steps if isinstance(method, FixedStep) else 0
    friction = oscillator.friction
    fastest = max([1.0, *(ratio for ratio, _, _ in waves)])
    lengths = [abs(stop.position) for stop in oscillator.stops]
    lengths += [amplitude / ratio**2 for ratio, amplitude, _ in waves]
    size = max([*lengths, abs(oscillator.load) / inertia, carried.amplitude if carried else 0.0])
    constant, swung = oscillator.load / inertia, np.array(waves, float).reshape(-1, 3)
    return Problem(
        kappa=stiffness / inertia,
        damping=damping / (mass * omega),
        constant=constant,
        waves=swung,
        fastest=fastest,
        stops=np.array(stops, float).reshape(-1, 8),
        order=np.array(order, np.int64),
        kinetic=friction.kinetic / inertia if friction else 0.0,
        static=friction.static / inertia if friction else 0.0,  # type: ignore[operator]
        forced=oscillator.law is not None,
        omega=omega,
        inertia=inertia,
        start=0.0,
        base_amplitude=carried.amplitude if carried else 0.0,
        base_ratio=pace(oscillator),
        base_angle=carried.phase if carried else 0.0,
        chatter=chatter,
        fixed=2 * math.pi / (steps * swings(oscillator)) if steps else 0.0,
        tolerance=method.tolerance if isinstance(method, RungeKutta) else 1e-10,
        rounding=1e-15 * (abs(constant) + float(np.abs(swung[:, 1]).sum())),
        # An eighth of the fastest period: shorter swings than that the error estimate may not see.
        longest=2 * math.pi / 8 / fastest,
        far=BEYOND * size if size > 0 else OVERFLOWS,
    )


def _functions(oscillator: Oscillator) -> Functions:
    """The user's functions, compiled; stand-ins where there are none."""
    from .rates import Functions, no_law

    law = no_law if oscillator.law is None else compiled("law", oscillator.law, 3)
    return Functions(law, *restitution_laws(oscillator))
