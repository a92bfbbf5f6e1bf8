"""Parameters of many oscillators of one form as columns, in user's and in engine units.

A single machine is a table of one column. All arithmetic here goes number by number, with products
in place of powers and real in place of complex numbers: their rounding depends on neither the
number of machines nor on whether Python or numpy carries it out.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...errors import InvalidInput
from ...oscillators import Oscillator
from ...oscillators.laws import PUSHER, SPRING
from ...oscillators.recurrence import LARGEST, ROUNDING

MASS, DAMPING, STIFFNESS, LOAD, KINETIC, STATIC, TIME_UNIT = range(7)
FIRST = 7  # row of the first force
APART = 1e9  # times as fast as the reference a forcing may be: motions are followed in its turns
AMPLITUDE, FREQUENCY, PHASE = range(3)  # of a force and of the base
POSITION, SPRING_RATE, DAMPER, RESTITUTION = range(4)  # of a stop


class Form(NamedTuple):
    """What oscillators must have in common for one table of parameters."""

    forces: int
    base: tuple[bool, bool, bool] | None  # whether spring, damper and stops hang on it
    stops: tuple[tuple[int, int], ...]  # side (1 upper, -1 lower) and kind of law
    functions: tuple[Any, ...]  # restitution of each stop where it is a function, else None


class Columns(NamedTuple):
    """Parameters of oscillators of one form; the last axis of each array is the oscillator."""

    form: Form
    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    load: np.ndarray
    kinetic: np.ndarray
    static: np.ndarray
    time_unit: np.ndarray
    forces: np.ndarray  # shape (forces, 3, n)
    base: np.ndarray  # shape (3, n)
    stops: np.ndarray  # shape (stops, 4, n)

    @property
    def n(self) -> int:
        """Number of oscillators."""
        return self.mass.shape[-1]


class Forcing(NamedTuple):
    """Harmonic forcing of many oscillators, in the engine's unit of time."""

    omega: np.ndarray  # angular frequency of the reference, shape (n,)
    inertia: np.ndarray  # mass omega^2
    recurs: np.ndarray  # whether all forcing recurs after a turn of the reference
    pace: np.ndarray  # frequency of the base over that of the reference
    slot: np.ndarray  # which component each force and then the base belong to, shape (parts, n)
    ratio: np.ndarray  # frequency of every part over that of the reference, shape (parts, n)
    cosine: np.ndarray  # amplitude of every part over the inertia, shape (parts, n)
    sine: np.ndarray


def form_of(machine: Oscillator) -> Form:
    """The form of an oscillator."""
    base = machine.base
    return Form(
        len(machine.forces),
        None if base is None else (base.spring, base.damper, base.stops),
        tuple((stop.sign, stop.law.row().law) for stop in machine.stops),
        tuple(stop.law.function for stop in machine.stops),
    )


def columns_of(machines: Iterable[Oscillator]) -> Columns:
    """The parameters of oscillators of one form."""
    machines = list(machines)
    table = np.array([_numbers(machine) for machine in machines], float)
    return _split(form_of(machines[0]), np.ascontiguousarray(table.T))


def columns_of_forms(machines: Sequence[Oscillator]) -> list[tuple[np.ndarray, Columns]]:
    """Numbers and parameters of the oscillators of each form."""
    forms: dict[Form, list[int]] = {}
    for k, machine in enumerate(machines):
        forms.setdefault(form_of(machine), []).append(k)
    return [(np.array(which), columns_of(machines[k] for k in which)) for which in forms.values()]


def spread(machine: Oscillator, count: int) -> Columns:
    """The parameters of an oscillator whose fields are numbers, or arrays with one number each."""
    numbers = _numbers(machine)
    table = np.empty((len(numbers), count))
    for row, number in zip(table, numbers, strict=True):
        row[:] = number
    return _split(form_of(machine), table)


def chosen(columns: Columns, which: Any) -> Columns:
    """Select some of the oscillators."""
    return Columns(columns.form, *(np.ascontiguousarray(rows[..., which]) for rows in columns[1:]))


def driven(forcing: Forcing, which: Any) -> Forcing:
    """Select the forcing of some of the oscillators."""
    return Forcing(*(np.ascontiguousarray(rows[..., which]) for rows in forcing))


def _split(form: Form, table: np.ndarray) -> Columns:
    after = FIRST + 3 * form.forces
    stops = after + (0 if form.base is None else 3)
    n = table.shape[1]
    parts = (
        table[FIRST:after].reshape(-1, 3, n),
        table[after:stops],
        table[stops:].reshape(-1, 4, n),
    )
    return Columns._make((form, *table[:FIRST], *parts))


def _numbers(machine: Oscillator) -> list[Any]:
    """A machine's numbers, in the order of the rows of a table."""
    friction = machine.friction
    numbers: list[Any] = [
        machine.mass,
        machine.damping,
        machine.stiffness,
        machine.load,
        friction.kinetic if friction else 0.0,
        friction.static if friction else 0.0,
        machine.time_unit,
    ]
    for force in machine.forces:
        numbers += (force.amplitude, force.angular_frequency, force.phase)
    if machine.base is not None:
        numbers += (machine.base.amplitude, machine.base.angular_frequency, machine.base.phase)
    for stop in machine.stops:
        _, stiffness, loss, _, restitution = stop.law.row()
        numbers += (stop.position, stiffness, loss, restitution)
    return numbers


def forcing_of(columns: Columns, reference: tuple[np.ndarray, np.ndarray] | None = None) -> Forcing:
    """The forcing of oscillators, in coordinates in which their stops rest.

    Parts of one frequency are one component; the reference is component 0, whether it is driven
    or not. Its frequency, and whether the forcing recurs, follow from the forces and the base
    unless they are given, as for a law with a period of its own.

    Raises
    ------
    InvalidInput
        If a force by the inertia is no float, or the frequencies are too far apart.
    """
    with np.errstate(all="ignore"):
        found = _forcing_of(columns, reference)
    machines = np.arange(columns.n)
    inertia = np.where(found.inertia > 0, found.inertia, np.inf)[:, None]
    force = np.concatenate([found.cosine, found.sine]).T
    check_finite({"inertia": inertia, "force": force}, machines)
    apart = ~(found.ratio <= APART).all(axis=0)
    if apart.any():
        raise InvalidInput(
            "oscillator",
            f"oscillator {machines[apart][0]}, forced at frequencies {found.ratio.max():.2g} to 1",
            f"frequencies at most {APART:g} to 1",
            "Leave out the forcing that the mass cannot follow",
        )
    return found


def check_finite(tables: dict[str, np.ndarray], machines: np.ndarray) -> None:
    """Refuse machines with numbers, one row each in every table, that no float holds.

    Raises
    ------
    InvalidInput
        If there is one.
    """
    if np.isfinite(np.concatenate([values.ravel() for values in tables.values()])).all():
        return
    for name, values in tables.items():
        beyond = ~np.isfinite(values).all(axis=1)
        if beyond.any():
            raise InvalidInput(
                "oscillator",
                f"oscillator {machines[beyond][0]}, whose {name} is not finite",
                "mass, stiffness, damping, frequencies and forces that a float holds when divided "
                "by each other",
                "Choose units in which they are nearer to 1",
            )


def _forcing_of(columns: Columns, reference: tuple[np.ndarray, np.ndarray] | None) -> Forcing:
    """The same, with whatever numbers come of it."""
    form, base = columns.form, columns.base
    frequencies = [force[FREQUENCY] for force in columns.forces]
    if form.base is not None:
        frequencies.append(base[FREQUENCY])
    omega, recurs = reference or _reference(columns, frequencies)
    inertia = columns.mass * (omega * omega)
    cosine, sine = [], []
    for amplitude, _, phase in columns.forces:
        cosine.append(amplitude * np.cos(phase))
        sine.append(amplitude * np.sin(phase))
    if form.base is not None:
        # q = x - base: what hangs on the base pulls no more, and inertia pushes back.
        spring, damper, stops = form.base
        w = base[FREQUENCY]
        push = (float(spring) - stops) * columns.stiffness + stops * columns.mass * w * w
        drag = w * ((float(damper) - stops) * columns.damping)
        push, drag = push * base[AMPLITUDE], drag * base[AMPLITUDE]
        c, s = np.cos(base[PHASE]), np.sin(base[PHASE])
        cosine.append(push * c - drag * s)
        sine.append(push * s + drag * c)

    n, parts = columns.n, len(frequencies)
    slot, ratio = np.zeros((parts, n), int), np.ones((parts, n))
    taken = np.zeros(n, int)
    for k, frequency in enumerate(frequencies):
        mine = frequency != omega
        slot[k] = np.where(mine, taken + 1, 0)
        for j in range(k):
            same = frequencies[j] == frequency
            slot[k] = np.where(same, slot[j], slot[k])
            mine &= ~same
        taken += mine
        ratio[k] = frequency / omega
        ratio[k] = np.where(recurs, np.rint(ratio[k]), ratio[k])
    shape = parts, n
    return Forcing(
        omega,
        inertia,
        recurs,
        np.ones(n) if form.base is None else ratio[-1],
        slot,
        ratio,
        np.reshape(cosine, shape) / inertia,
        -(np.reshape(sine, shape) / inertia),
    )


def _reference(columns: Columns, frequencies: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Frequency of the forcing period, and whether the forcing recurs; see `recurrence`.

    Without forcing it is the natural frequency, or 1 where there is none.
    """
    if not frequencies:
        natural = np.sqrt(columns.stiffness / columns.mass)
        return np.where(natural > 0, natural, 1.0), np.zeros(columns.n, bool)
    first = frequencies[0]
    recurs, periods = np.ones(columns.n, bool), np.ones(columns.n, int)
    for frequency in frequencies[1:]:
        ratio = frequency / first
        denominator = np.zeros(columns.n, int)
        for d in range(LARGEST, 0, -1):
            near = np.abs(ratio - np.rint(ratio * d) / d) <= ROUNDING * ratio
            denominator = np.where(near & (np.rint(ratio * d) > 0), d, denominator)
        recurs &= denominator > 0
        periods = np.where(recurs, np.lcm(periods, denominator), periods)
    recurs &= periods <= LARGEST
    return np.where(recurs, first / periods, first), recurs


def components(forcing: Forcing) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Ratio, cosine and sine of the components, shape (n, components), of machines alike in slots.

    Machines are alike where their columns of `slot` are the same.
    """
    n = len(forcing.omega)
    slots = forcing.slot[:, 0]
    number = 1 + int(slots.max(initial=0))
    ratio, cosine, sine = np.ones((n, number)), np.zeros((n, number)), np.zeros((n, number))
    for k, c in enumerate(slots):
        if c:
            ratio[:, c] = forcing.ratio[k]
        cosine[:, c] += forcing.cosine[k]
        sine[:, c] += forcing.sine[k]
    return ratio, cosine, sine


def order_of_stops(columns: Columns) -> np.ndarray:
    """Stops in the order they are reached, the upper before the lower; shape (stops, n)."""
    rows = []
    for side in (1, -1):
        own = [k for k, (of, _) in enumerate(columns.form.stops) if of == side]
        if own:
            reached = side * columns.stops[own, POSITION]
            rows.append(np.array(own)[np.argsort(reached, axis=0, kind="stable")])
    return np.concatenate(rows) if rows else np.empty((0, columns.n), int)


def kinds_of_stops(columns: Columns) -> np.ndarray:
    """Kind of law of each stop, shape (stops, n); without a damper none ends before its gap."""
    kinds = np.array([kind for _, kind in columns.form.stops], int)[:, None]
    return np.where((kinds == PUSHER) & (columns.stops[:, DAMPER] == 0), SPRING, kinds)


def groups(columns: Columns, forcing: Forcing) -> list[np.ndarray]:
    """Split oscillators into groups whose tables have the same layout."""
    has_friction = columns.static[None] > 0
    keys = np.concatenate(
        [forcing.slot, order_of_stops(columns), kinds_of_stops(columns), has_friction]
    )
    if np.all(keys == keys[:, :1]):
        return [np.arange(columns.n)]
    _, group = np.unique(keys, axis=1, return_inverse=True)
    return [np.flatnonzero(group.ravel() == k) for k in range(group.max() + 1)]
