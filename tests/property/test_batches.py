"""Machines of any kind, moved together, move as each alone."""

from __future__ import annotations

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from impactsig import InvalidInput, simulate, simulate_many
from impactsig.simulation.batches import moving as _moving

from ..unit.test_stacked_tables import machine


@settings(max_examples=12, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    count=st.integers(1, 12),
    repeats=st.integers(1, 3),
    workers=st.integers(1, 3),
    room=st.integers(8, 200),
    periods=st.floats(0.1, 6.0),
    transient=st.sampled_from([0.0, 1.7]),
    phase=st.floats(-10.0, 10.0),
)
def test_any_machines_in_any_division(
    seed, count, repeats, workers, room, periods, transient, phase
):
    rng = np.random.default_rng(seed)
    options = {"periods": periods, "transient": transient}
    drawn = [machine(rng) for _ in range(count)]
    ways = [(one, way) for one in drawn if (way := alone(one, phase=phase, **options))]
    assume(ways)
    count = len(ways)
    machines = [one for one, _ in ways] * repeats
    before = _moving.ROOM, _moving.SMALLEST
    _moving.ROOM, _moving.SMALLEST = room, 1
    try:
        found = simulate_many(machines, phase=phase, workers=workers, **options)
    finally:
        _moving.ROOM, _moving.SMALLEST = before
    for k, (_, own) in enumerate(ways):
        for motion in found[k::count]:
            assert np.array_equal(motion._segments, own._segments)
            assert motion.final == own.final
        assert np.all(found.energy_lost[k::count] == own.energy_lost)
        assert np.all(found.duration[k::count] == own.duration)


def alone(machine, **options):
    """Its motion; None where a moving stop stands beyond the start."""
    try:
        return simulate(machine, **options)
    except InvalidInput:
        return None
