"""Tangent maps and Newton searches of many oscillators at once: the bits of single ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from impactsig import (
    BaseMotion,
    Force,
    KelvinVoigt,
    Oscillator,
    Rigid,
    Stop,
    continue_orbit,
    find_periodic_orbit,
    find_periodic_orbits,
    scenes,
    tangent_map,
)
from impactsig.dynamics.periodic import shooting
from impactsig.dynamics.tangents.batches.tangent_maps import tangent_maps

WALLS = Stop(0.5, Rigid(0.7)), Stop(-0.6, Rigid(0.7), "lower")
SHAKEN = Oscillator(damping=0.1, base=BaseMotion(1.0, 1.1), stops=WALLS)
SOFT = Oscillator(
    damping=0.05, forces=(Force(0.5, 0.9),), stops=(Stop(0.5, KelvinVoigt(5.0, 0.1)),)
)
MACHINES = (
    scenes.karpodinis(22.1), SHAKEN, scenes.begley_virgin(0.5, 1.5, 0.8), SOFT,
    scenes.karpodinis(20.1), scenes.okolewski(2.0, 0.6, "soft"),
)  # fmt: skip
FIELDS = ("matrix", "scaled", "log_scale", "log_determinant", "impacts", "collapses", "grazings",
          "final", "status")  # fmt: skip


def same(one, other):
    for name in FIELDS:
        found, wanted = getattr(one, name), getattr(other, name)
        if name == "status":
            assert found == wanted
        else:
            assert np.array_equal(np.asarray(found), np.asarray(wanted), equal_nan=True), name


@pytest.mark.parametrize(("phase", "periods"), [(0.0, 1), (7.5, 3)])
def test_machines_of_several_layouts_have_the_bits_of_single_ones(phase, periods):
    starts = np.random.default_rng(3).uniform(-0.4, 0.4, (len(MACHINES), 2))
    found = tangent_maps(MACHINES, starts, phase, periods)
    for machine, start, own in zip(MACHINES, starts, found, strict=True):
        same(own, tangent_map(machine, periods=periods, initial=tuple(start), phase=phase))
    assert sum(own.impacts for own in found) > 0
    assert found[2].collapses > 0


@pytest.mark.parametrize(
    ("moving", "able"),
    [(False, [True, False, False, True, False]), (True, [False, True, False, False, False])],
)
def test_starts_of_one_machine_and_those_that_are_none(moving, able):
    # Stops that hang on the base are 1 ahead with it, at 1.5 and 0.4.
    machine = replace(SHAKEN, base=BaseMotion(1.0, 1.1, stops=moving))
    starts = np.array([[0.1, 0.2], [0.6, 0.0], [np.inf, 0.0], [-0.3, 0.1], [0.0, np.nan]])
    found = tangent_maps([machine], starts, 0.0, 2)
    assert [one is not None for one in found] == able
    for k in np.flatnonzero(able):
        same(found[k], tangent_map(machine, periods=2, initial=tuple(starts[k])))


def test_searches_side_by_side_end_where_each_ends_alone():
    beam = scenes.karpodinis(20.1)
    maps = shooting.OscillatorShooting(beam, 2, 0.0, None, 1e-11)
    starts = list(maps.close_returns(4, 4))
    together = maps.newton(*starts)
    assert {one.status for one in together} >= {"found", "lost"}
    for start, one in zip(starts, together, strict=True):
        orbit = find_periodic_orbit(beam, 2, guess=start)
        assert (orbit.status, orbit.iterations) == (one.status, one.iterations)
        assert np.array_equal(orbit.state, one.state)
        assert orbit.residual == one.residual


def test_orbits_and_branches_are_those_of_one_map_at_a_time(monkeypatch):
    def ask():
        orbits = find_periodic_orbits(scenes.karpodinis(20.1), 2, guesses=20)
        branch = continue_orbit(scenes.karpodinis, (22.1, 22.0))
        states = [orbit.state for orbit in orbits]
        return states, branch.parameter, branch.state, branch.multipliers

    found = ask()
    monkeypatch.setattr(shooting.Shooting, "side_by_side", False)
    for one, other in zip(found, ask(), strict=True):
        assert np.array_equal(one, other)
