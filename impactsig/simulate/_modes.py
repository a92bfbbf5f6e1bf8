"""Oscillators in the units of the exact engine: their modes and gaps, as tables of numbers."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..oscillators import KelvinVoigt, Oscillator
from ._frame import forcing, reference_frequency
from ._laws import NO_NUMBER
from ._layout import Layout, layout, structure
from ._stops import restitution_of
from ._user import restitution_laws

if TYPE_CHECKING:
    from ._flow import Problem


class Tables(NamedTuple):
    """What the exact engine moves; all runs of an oscillator share it."""

    omega: float  # angular frequency of the reference
    layout: Layout
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
    plan = layout(structure(oscillator))
    many = problems([oscillator], plan, chatter, skip)
    arrays = {name: value[0] for name, value in many._asdict().items() if name not in SHARED}
    scalars = {name: float(arrays[name]) for name in SCALARS}
    problem = many._replace(**arrays | scalars)
    return Tables(problem.speed, plan, problem, restitution_laws(oscillator))


def shape(oscillator: Oscillator) -> tuple[Any, ...]:
    """What oscillators have in common whose tables can be stacked."""
    frequencies = {reference_frequency(oscillator)}
    frequencies |= {force.angular_frequency for force in oscillator.forces}
    if oscillator.base is not None:
        frequencies.add(oscillator.base.angular_frequency)
    return structure(oscillator), len(frequencies), restitution_laws(oscillator)


SCALARS = ("speed", "kinetic", "static")  # one number a machine
SHARED = ("rubs", "chatter", "skip", "pressed", "gaps", "means", "side")  # one for all of a layout


def problems(
    oscillators: Sequence[Oscillator], plan: Layout, chatter: float, skip: bool
) -> Problem:
    """The kernel's tables of oscillators of one layout and as many forcing frequencies.

    All fields but those in `SHARED` have an axis more, the first, for the oscillators. Every
    operation goes number by number, so that a machine's tables are the same alone and among others.
    """
    from ._flow import Problem

    numbers, stops, forced = zip(*map(_numbers, oscillators), strict=True)
    mass, damping, stiffness, load, omega, kinetic, static = _columns(numbers)
    position, spring, damper, restitution = _columns(stops)
    ratio, force_cos, force_sin = _columns(forced)
    inertia = mass * omega**2
    kinetic, static = kinetic / inertia, static / inertia

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
    with np.errstate(invalid="ignore", divide="ignore"):  # a rigid stop has no lag
        lag = np.where(spring > 0, damper * omega[:, None] / spring, 0.0)
        rest = np.where(kappa >= 1, constant / kappa, 0.0)
    beta = plan.lag * lag[:, plan.stop] + plan.halt
    beyond = plan.means[:, :, 2]
    gap = np.empty((*beta.shape, 3))
    gap[..., 0], gap[..., 1], gap[..., 2] = plan.alpha, beta, plan.toward * ways
    return Problem(
        kappa=kappa,
        delta=delta,
        root=root,
        sort=np.sign(difference),
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
        leans=np.any(beta, axis=2),
        gap=gap,
        means=plan.means,
        land=plan.lands * (origin[:, :, None] - origin[:, beyond]),
        origin=origin,
        side=plan.side,
        restitution=restitution,
        speed=omega,
        kinetic=kinetic,
        static=static,
        rubs=bool(plan.way.any()),
        chatter=chatter,
        skip=bool(skip),
    )


def _columns(rows: Any) -> np.ndarray:
    """The last axis first."""
    table = np.array(rows)
    return np.ascontiguousarray(table.transpose(-1, *range(table.ndim - 1)))


def _numbers(oscillator: Oscillator) -> tuple[tuple[float, ...], list[Any], list[Any]]:
    """An oscillator's numbers; position, spring, damper and restitution of stops; its forcing."""
    friction = oscillator.friction
    machine = (
        oscillator.mass,
        oscillator.damping,
        oscillator.stiffness,
        oscillator.load,
        reference_frequency(oscillator),
        friction.kinetic if friction else 0.0,
        (friction.static or 0.0) if friction else 0.0,
    )
    stops = []
    for stop in oscillator.stops:
        law: Any = stop.law
        if isinstance(law, KelvinVoigt):
            stops.append((stop.position, law.stiffness, law.damping, NO_NUMBER))
        else:
            stops.append((stop.position, 0.0, 0.0, restitution_of(law)))
    waves = [(ratio, pull.real, -pull.imag) for ratio, pull in forcing(oscillator)]
    return machine, stops or [(0.0, 0.0, 0.0, 0.0)], waves
