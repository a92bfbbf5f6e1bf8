"""Kernels: many machines of one layout, each moved by the exact engine as it is moved alone."""

from __future__ import annotations

from ..._compiling.compiled import kernel, njit
from ..basis.events import DONE, FULL, LEG_COUNT, ROW_COUNT
from ..exact.engine import run
from ..exact.flow import Problem

LEAST = 8  # rows for which there must be room to begin with a machine


@kernel
def move_range(
    many,
    scratch,
    upper,
    lower,
    clocks,
    states,
    counts,
    turns,
    phases,
    legs,
    status,
    rows,
    ends,
    first,
    last,
):
    """Move machines `first` to `last` to their ends; the one to go on with, `last` if none is left.

    `many` are their tables, stacked; `legs` the work each may take. Machines whose status is not
    DONE stay where they are. Events are written to `rows`, unless that has no rows: those of
    machine k end before row ``ends[k]``. The kernel returns when there is no room for more.
    """
    used = 0
    for k in range(first, last):
        if status[k] == DONE:
            if len(rows) > 0 and len(rows) - used < LEAST:
                ends[k] = used
                return k
            found = run(
                machine(many, k),
                scratch,
                clocks[k],
                states[k],
                counts[k],
                rows[used:],
                turns[k],
                phases[k],
                legs[k] - counts[k, LEG_COUNT],
                upper,
                lower,
            )
            used += counts[k, ROW_COUNT]
            if found == FULL:
                ends[k] = used
                return k
            status[k] = found
        ends[k] = used
    return last


@njit(nogil=True, inline="always")
def machine(many, k):
    """The tables of one of them.

    Inlined by numba, and so compiled as its callers are: what is compiled without reference counts
    must not hand arrays to what counts them.
    """
    return Problem(
        many.kappa[k],
        many.delta[k],
        many.root[k],
        many.damping_kind[k],
        many.constant[k],
        many.rest[k],
        many.drift[k],
        many.cosine[k],
        many.sine[k],
        many.reach[k],
        many.rate[k],
        many.ratio[k],
        many.force_cos[k],
        many.force_sin[k],
        many.force_bound[k],
        many.pressed,
        many.gaps,
        many.depends_on_velocity[k],
        many.gap[k],
        many.meanings,
        many.land[k],
        many.origin[k],
        many.side,
        many.restitution[k],
        many.speed[k],
        many.kinetic[k],
        many.static[k],
        many.has_friction,
        many.chatter,
        many.skip,
    )
