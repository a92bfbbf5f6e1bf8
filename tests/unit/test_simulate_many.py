"""Runs in pieces and runs in numbers: both are what simulate gives; machines in other units."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import impactsig
from impactsig import (
    BaseMotion,
    Force,
    Friction,
    InvalidInput,
    KelvinVoigt,
    Oscillator,
    Rigid,
    RungeKutta,
    Stop,
    scenes,
    simulate_blocks,
    simulate_many,
)

BEAM = scenes.karpodinis(20.1)
RUBBING = Oscillator(
    damping=0.1,
    forces=(Force(1.0, 0.7), Force(0.4, 1.9, 1.0)),
    base=BaseMotion(0.1, 1.3, 0.4, stops=True),
    stops=(Stop(0.3, KelvinVoigt(300.0, 9.0, ends="force")), Stop(-0.4, Rigid(0.4), "lower")),
    friction=Friction(0.15, 0.3),
)


def pushed(t, x, v):
    return 0.2 * t - 0.1 * x * v


def joined(spans):
    """Spans that meet, as one."""
    whole = []
    for start, stop in spans:
        if whole and start - whole[-1][1] < 1e-12:
            whole[-1][1] = stop
        else:
            whole.append([start, stop])
    return np.array(whole)


@pytest.mark.parametrize("block", [0.37, 3, 7.5, 1000])
def test_pieces_are_the_whole(block):
    options = {"periods": 30, "transient": 4, "initial": (0.1, 0.3), "phase": 1.0}
    whole = impactsig.simulate(RUBBING, **options)
    pieces = list(simulate_blocks(RUBBING, block=block, **options))
    assert len(pieces) == -(-30 // block)
    assert whole.stick_count > 5
    assert pieces[0].start == whole.start
    for one, after in pairwise(pieces):
        assert after.start == one.stop
    time = np.concatenate([piece.impacts.time for piece in pieces])
    assert len(time) == whole.impact_count == sum(piece.impact_count for piece in pieces)
    np.testing.assert_allclose(time, whole.impacts.time, atol=1e-9)
    sticks = joined(np.concatenate([piece.sticks for piece in pieces]))
    np.testing.assert_allclose(sticks, whole.sticks, atol=1e-9)
    assert sum(piece.energy_lost for piece in pieces) == pytest.approx(whole.energy_lost, rel=1e-9)
    np.testing.assert_allclose(pieces[-1].final, whole.final, atol=1e-9)
    middle = np.linspace(pieces[0].start, pieces[0].stop, 100)
    np.testing.assert_allclose(pieces[0].sample(middle), whole.sample(middle), atol=1e-9)


def test_pieces_are_made_when_asked_for():
    pieces = simulate_blocks(BEAM, periods=1e12, block=100)
    first, second = next(pieces), next(pieces)
    assert first.duration == pytest.approx(100 / 20.1, rel=1e-13)
    assert second.start == first.stop
    assert len(second._segments) == second.impact_count + 1  # and nothing of the first


def test_pieces_end_with_the_run():
    def greedy(velocity):
        return 2.0 if velocity < 0.1 else 0.5

    walls = (Stop(1, Rigid(greedy)), Stop(-1, Rigid(greedy), "lower"))
    pieces = list(
        simulate_blocks(Oscillator(stiffness=0, stops=walls), duration=1e3, block=1, initial=(0, 1))
    )
    assert [piece.status for piece in pieces[:-1]] == ["complete"] * (len(pieces) - 1)
    assert pieces[-1].status == "broken law"


@pytest.mark.parametrize(
    ("argument", "options"),
    [
        ("block", {"periods": 1, "block": 0}),
        ("block", {"periods": 1, "block": "all"}),
        ("periods, duration", {}),
        ("keep", {"periods": 1, "keep": "counts"}),
        ("initial", {"periods": 1, "initial": (2, 0)}),
    ],
)
def test_pieces_are_refused_by_name_at_once(argument, options):
    with pytest.raises(InvalidInput) as caught:
        simulate_blocks(BEAM, **options)
    assert caught.value.argument == argument


def same(one, other):
    np.testing.assert_array_equal(one.impacts.time, other.impacts.time)
    np.testing.assert_array_equal(one.impacts.approach_velocity, other.impacts.approach_velocity)
    np.testing.assert_array_equal(one.sticks, other.sticks)
    assert (one.final, one.energy_lost, one.status) == (
        other.final,
        other.energy_lost,
        other.status,
    )


@pytest.mark.parametrize("workers", [None, 1, 3])
def test_many_are_those_one_by_one_to_the_last_bit(workers):
    machines = [scenes.karpodinis(f) for f in (20.1, 21.55, 22.1)] + [RUBBING]
    starts, phases = [(0, 0), (0.5, 0.1), (0, -0.2), (0.2, 0)], [0, 1, 2, 3]
    found = simulate_many(machines, initial=starts, phase=phases, periods=50, workers=workers)
    for machine, start, phase, motion in zip(machines, starts, phases, found, strict=True):
        same(motion, impactsig.simulate(machine, initial=start, phase=phase, periods=50))


def test_short_runs_that_share_a_task_keep_their_order():
    starts = np.linspace((0, 0), (0.9, 0.5), 70)
    found = simulate_many(BEAM, initial=starts, periods=2, workers=2)
    assert len(found) == 70
    for motion, start in zip(found, starts, strict=True):
        same(motion, impactsig.simulate(BEAM, initial=tuple(start), periods=2))


@pytest.mark.parametrize("method", [None, RungeKutta()], ids=repr)
def test_runs_of_one_machine_leave_each_other_alone(method):
    machine = replace(RUBBING, law=pushed) if method else RUBBING
    options = {"periods": 10, "method": method}
    first = impactsig.simulate(machine, phase=1.0, **options)
    times = np.linspace(first.start, first.stop, 50)
    before = first.sample(times)
    other = impactsig.simulate(machine, phase=2.5, initial=(0.1, 0.3), **options)
    assert other.final != first.final
    np.testing.assert_array_equal(first.sample(times), before)
    same(impactsig.simulate(machine, phase=1.0, **options), first)


def test_one_of_anything_serves_all():
    starts = np.array([(0, 0), (0.5, 0.1), (0.9, 0)])
    assert len(simulate_many(BEAM, periods=1)) == 1
    assert len(simulate_many([], periods=1)) == 0
    for motion, start in zip(simulate_many(BEAM, initial=starts, periods=9), starts, strict=True):
        same(motion, impactsig.simulate(BEAM, initial=tuple(start), periods=9))
    for motion, phase in zip(simulate_many([BEAM], phase=[0, 1], periods=9), [0, 1], strict=True):
        same(motion, impactsig.simulate(BEAM, phase=phase, periods=9))
    for motion in simulate_many([BEAM, BEAM], initial=(0.5, 0), phase=2, periods=9):
        same(motion, impactsig.simulate(BEAM, initial=(0.5, 0), phase=2, periods=9))


@pytest.mark.parametrize(
    ("argument", "oscillators", "options"),
    [
        ("oscillators, initial, phase", [BEAM] * 2, {"initial": [(0, 0)] * 3}),
        ("oscillators, initial, phase", BEAM, {"initial": [(0, 0)] * 3, "phase": [0, 1]}),
        ("oscillators, initial, phase", BEAM, {"phase": [[0, 1]]}),
        ("initial", BEAM, {"initial": np.zeros((2, 3))}),
        ("initial", BEAM, {"initial": 0.5}),
        ("initial", BEAM, {"initial": [(0, 0), (2, 0)]}),
        ("initial", BEAM, {"initial": [(0, 0), (1,)]}),
        ("oscillators", 3, {}),
        ("oscillators", [BEAM, "beam"], {}),
        ("phase", BEAM, {"phase": [0, np.nan]}),
        ("workers", BEAM, {"workers": 0}),
        ("workers", BEAM, {"workers": 1.5}),
        ("periods", BEAM, {"periods": [1, 2]}),
    ],
)
def test_many_are_refused_by_name(argument, oscillators, options):
    with pytest.raises(InvalidInput) as caught:
        simulate_many(oscillators, **{"periods": 1, **options})
    assert caught.value.argument == argument


def numbers_of(machine):
    """All numbers of an oscillator that units change."""
    found = [machine.mass, machine.damping, machine.stiffness, machine.load]
    found += [machine.time_unit, machine.length_unit, machine.mass_unit]
    for force in machine.forces:
        found += [force.amplitude, force.angular_frequency, force.phase]
    found += [machine.base.amplitude, machine.base.angular_frequency, machine.base.phase]
    for stop in machine.stops:
        found += [stop.position, *(v for v in vars(stop.law).values() if isinstance(v, float))]
    return [*found, machine.friction.kinetic, machine.friction.static]


# A machine in SI units, and the units in which its mass, stiffness and gap are 1.
SHAKER = Oscillator(
    mass=2.0, damping=30.0, stiffness=8e4, load=-12.0,
    forces=(Force(300.0, 150.0, 0.3), Force(40.0, 390.0)),
    base=BaseMotion(1e-4, 170.0, 1.0, stops=True),
    stops=(
        Stop(2e-3, KelvinVoigt(4e5, 200.0, ends="force")), Stop(3e-3, Rigid(0.5)),
        Stop(-2e-3, impactsig.Hertz(1e9, damping=0.2), "lower"),
    ),
    friction=Friction(5.0, 9.0),
)  # fmt: skip
UNITS = (1 / 200.0, 2e-3, 2.0)


def test_units_there_and_back():
    there = SHAKER.in_units(*UNITS)
    assert (there.mass, there.stiffness, there.stops[0].position) == pytest.approx((1, 1, 1))
    assert there.damping == pytest.approx(30 / (2 * 200))  # c / (m omega_n) = 2 zeta
    assert there.friction.static == pytest.approx(9 / (8e4 * 2e-3))
    hertz = there.stops[2].law
    assert hertz.stiffness == pytest.approx(1e9 * (2e-3) ** 1.5 / (8e4 * 2e-3))
    assert hertz.damping == pytest.approx(0.2 * 2e-3 * 200)
    assert numbers_of(there.in_units()) == pytest.approx(numbers_of(SHAKER), rel=1e-14)


def test_the_same_machine_in_other_units_moves_the_same_in_seconds():
    machine = Oscillator(**{**vars(SHAKER), "stops": SHAKER.stops[:2]})
    scaled = machine.in_units(*UNITS)
    start = 1e-4 * np.cos(1.0)
    one = impactsig.simulate(machine, duration=0.3, initial=(start, 0.1))
    other = impactsig.simulate(scaled, duration=0.3, initial=(start / 2e-3, 0.1 / (200 * 2e-3)))
    assert one.impact_count > 10
    np.testing.assert_allclose(other.impacts.time, one.impacts.time, rtol=1e-7)
    assert other.impact_count == one.impact_count
    time = np.linspace(0, 0.3, 300)
    x, v = one.sample(time)
    scaled_x, scaled_v = other.sample(time)
    np.testing.assert_allclose(scaled_x * 2e-3, x, atol=1e-9)
    np.testing.assert_allclose(scaled_v * 2e-3 * 200, v, atol=1e-6)
    joule = 2.0 * (2e-3 * 200) ** 2
    assert other.energy_lost * joule == pytest.approx(one.energy_lost, rel=1e-7)


def test_a_function_has_no_other_units():
    for argument, part in (
        ("law", {"law": lambda t, x, v: -x}),
        ("restitution", {"stops": Stop(1, Rigid(lambda v: 0.5))}),
    ):
        with pytest.raises(InvalidInput, match="anew") as caught:
            Oscillator(**part).in_units(2.0)
        assert caught.value.argument == argument
    with pytest.raises(InvalidInput):
        Oscillator().in_units(time=0)
