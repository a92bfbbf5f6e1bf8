"""Tables of modes and gaps of oscillators, in the units of the exact engine."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...oscillators import Oscillator
from ..basis.columns import (
    DAMPER,
    POSITION,
    RESTITUTION,
    SPRING_RATE,
    Columns,
    Forcing,
    check_finite,
    chosen,
    columns_of,
    components,
    driven,
    forcing_of,
    groups,
)
from ._layout import Layout, layout, structure
from .user import laws_of

if TYPE_CHECKING:
    from .flow import Problem


class Tables(NamedTuple):
    """The tables of an oscillator, shared by all its runs."""

    omega: float  # angular frequency of the reference
    problem: Problem
    laws: tuple[Any, Any]  # restitution functions of the upper and of the lower stop
    stack: Stack  # of this machine alone


class Stack(NamedTuple):
    """Oscillators of one layout, and their tables."""

    which: np.ndarray  # their numbers among those that were stacked
    columns: Columns
    forcing: Forcing
    layout: Layout
    problem: Problem  # all fields but those in `SHARED` have a first axis for the machines
    laws: tuple[Any, Any]


SCALARS = ("speed", "kinetic", "static")  # one number a machine
# One for all machines of a layout.
SHARED = ("has_friction", "chatter", "skip", "pressed", "gaps", "meanings", "side")


@lru_cache(maxsize=64)
def tables(oscillator: Oscillator, chatter: float, skip: bool) -> Tables:
    """The tables of an oscillator, cached for its next run.

    Raises
    ------
    InvalidInput
        If numba cannot compile a restitution that is a function.
    """
    (stack,) = stacks(columns_of([oscillator]), chatter, skip)
    return taken(stack, 0)


def taken(stack: Stack, k: int) -> Tables:
    """The tables of one oscillator of a stack."""
    alone = subset(stack, slice(k, k + 1))
    many = alone.problem
    arrays = {name: value[0] for name, value in many._asdict().items() if name not in SHARED}
    scalars = {name: float(arrays[name]) for name in SCALARS}
    problem = many._replace(**arrays | scalars)
    return Tables(problem.speed, problem, stack.laws, alone)


def subset(stack: Stack, which: Any) -> Stack:
    """Select some of the oscillators of a stack."""
    many = stack.problem
    arrays = {name: value[which] for name, value in many._asdict().items() if name not in SHARED}
    return stack._replace(
        which=stack.which[which],
        columns=chosen(stack.columns, which),
        forcing=driven(stack.forcing, which),
        problem=many._replace(**arrays),
    )


def stacks(columns: Columns, chatter: float, skip: bool) -> list[Stack]:
    """The tables of oscillators of one form, one stack for each layout.

    Raises
    ------
    InvalidInput
        If numba cannot compile a restitution that is a function, or a machine's numbers are too
        far apart.
    """
    forcing = forcing_of(columns)
    laws = laws_of(columns.form)
    found = []
    for which in groups(columns, forcing):
        mine, waves = columns, forcing
        if len(which) < columns.n:
            mine, waves = chosen(columns, which), driven(forcing, which)
        plan = layout(structure(mine))
        with np.errstate(all="ignore"):
            problem = _problem(mine, waves, plan, chatter, skip)
        _check_range(which, problem)
        found.append(Stack(which, mine, waves, plan, problem, laws))
    return found


def _check_range(which: np.ndarray, problem: Problem) -> None:
    """Refuse machines whose tables have numbers that no float holds.

    Raises
    ------
    InvalidInput
        If there is one.
    """
    check_finite(
        {
            name: table.reshape(len(which), -1)
            for name, table in problem._asdict().items()
            if name not in SHARED and name != "restitution"  # which is NaN for a function
        },
        which,
    )


def _problem(
    columns: Columns, forcing: Forcing, plan: Layout, chatter: float, skip: bool
) -> Problem:
    """The kernel's tables of machines of one layout.

    Every operation goes number by number, so that a machine's tables are the same alone and among
    others.
    """
    from .flow import Problem

    mass, damping, stiffness, load = columns[1:5]
    omega, inertia = forcing.omega, forcing.inertia
    kinetic, static = columns.kinetic / inertia, columns.static / inertia
    stops = columns.stops if len(columns.stops) else np.zeros((1, 4, columns.n))
    position, spring, damper, restitution = (
        np.ascontiguousarray(stops[:, row].T)
        for row in (POSITION, SPRING_RATE, DAMPER, RESTITUTION)
    )
    ratio, force_cos, force_sin = components(forcing)

    # A touched stop is the origin of its mode, so that nothing cancels there.
    origin = np.where(plan.at >= 0, position[:, plan.at], 0.0)
    kappa = np.zeros(origin.shape) + stiffness[:, None]
    damped = np.zeros(origin.shape) + damping[:, None]
    constant = load[:, None] - kappa * origin
    for s, presses in enumerate(plan.soft.T):
        kappa = kappa + presses * spring[:, s, None]
        damped = damped + presses * damper[:, s, None]
        constant = constant - presses * spring[:, s, None] * (origin - position[:, s, None])
    kappa = kappa / inertia[:, None]
    delta = damped / (2 * mass * omega)[:, None]
    constant = constant / inertia[:, None] - plan.way * kinetic[:, None]
    # (sqrt kappa - delta)(sqrt kappa + delta) keeps the digits that kappa - delta^2 would lose.
    difference = (np.sqrt(kappa) - delta) * (np.sqrt(kappa) + delta)
    root = np.sqrt(np.abs(difference))

    # The forced response force / (kappa - ratio^2 + 2i delta ratio), component by component.
    # Without forcing the clock may well run at the natural frequency.
    pull = np.hypot(force_cos, force_sin)
    real = kappa[:, :, None] - (ratio * ratio)[:, None]
    imaginary = 2 * delta[:, :, None] * ratio[:, None]
    size = np.where(pull[:, None] > 0, np.hypot(real, imaginary), 1.0)
    real, imaginary = real / size, imaginary / size
    cosine = (force_cos[:, None] * real - force_sin[:, None] * imaginary) / size
    sine = (force_sin[:, None] * real + force_cos[:, None] * imaginary) / size
    amplitude = pull[:, None] / size
    reach, force_bound = np.zeros((*kappa.shape, 5)), np.zeros((len(kappa), 4))
    for c in range(ratio.shape[1]):
        for n in range(5):  # derivatives
            reach[:, :, n] += amplitude[:, :, c]
            amplitude[:, :, c] *= ratio[:, c, None]
            if n < 4:
                force_bound[:, n] += pull[:, c]
                pull[:, c] *= ratio[:, c]

    ways = position[:, plan.stop] - origin[:, :, None]
    lag = np.where(spring > 0, damper * omega[:, None] / spring, 0.0)  # a rigid stop has none
    rest = np.where(kappa >= 1, constant / kappa, 0.0)
    beta = plan.lag * lag[:, plan.stop] + plan.halt
    beyond = plan.meanings[:, :, 2]
    gap = np.empty((*beta.shape, 3))
    gap[..., 0], gap[..., 1], gap[..., 2] = plan.alpha, beta, plan.toward * ways
    stacked: Any = Problem  # of many machines, whose numbers are columns
    return stacked(
        kappa=kappa,
        delta=delta,
        root=root,
        damping_kind=np.sign(difference),
        constant=constant,
        rest=rest,
        drift=np.where(kappa >= 1, 0.0, constant),
        cosine=cosine,
        sine=sine,
        reach=reach,
        rate=np.maximum(ratio.max(axis=1)[:, None], delta + root),
        ratio=ratio,
        force_cos=force_cos,
        force_sin=force_sin,
        force_bound=force_bound,
        pressed=plan.pressed,
        gaps=plan.gaps,
        depends_on_velocity=np.any(beta, axis=2),
        gap=gap,
        meanings=plan.meanings,
        land=plan.lands * (origin[:, :, None] - origin[:, beyond]),
        origin=origin,
        side=plan.side,
        restitution=restitution,
        speed=omega,
        kinetic=kinetic,
        static=static,
        has_friction=bool(plan.way.any()),
        chatter=chatter,
        skip=bool(skip),
    )
