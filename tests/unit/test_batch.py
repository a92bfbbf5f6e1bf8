"""Batches: scenes of arrays, tables and motions of many machines, bit for bit those of each."""

from __future__ import annotations

import math
import pickle
from dataclasses import fields

import numpy as np
import pytest

from impactsig import (
    BaseMotion,
    Force,
    Friction,
    Hertz,
    InvalidInput,
    KelvinVoigt,
    Noise,
    Oscillator,
    Rigid,
    Stop,
    lyapunov_spectrum,
    scenes,
    simulate,
    simulate_many,
)
from impactsig.results import OscillatorBatch
from impactsig.simulation.basis.columns import columns_of, spread
from impactsig.simulation.exact.modes import SHARED, stacks, tables


def same(one, other):
    """Whether two motions are the same to the last bit."""
    assert np.array_equal(one._segments, other._segments)
    for name in ("final", "start", "duration", "impact_count", "stick_count", "energy_lost"):
        assert getattr(one, name) == getattr(other, name), name
    assert one.status == other.status


SCENES = {
    "karpodinis": lambda f: scenes.karpodinis(f, restitution=0.3, damping_ratio=0.04),
    "okolewski, hard": lambda f: scenes.okolewski(f, 0.6 + f / 100),
    "okolewski, soft": lambda f: scenes.okolewski(f, 0.6 + f / 100, "soft", stop_stiffness=500.0),
    "tian": lambda f: scenes.tian(1 + f / 10, 0.4, gap=f / 30),
    "begley": lambda f: scenes.begley_virgin(f / 3, (-f / 2, f), 0.05, kinetic_ratio=0.8),
    "cantilever": lambda f: scenes.cantilever(
        0.2, 0.025, 1e-3, 210e9, 7850, stop=1e-3, frequency=f * 5, amplitude=2e-4, loading="clamp"
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_tables_of_ten_thousand_are_those_of_each(name):
    values = np.linspace(2.0, 6.0, 10_000)
    batch = SCENES[name](values)
    (stack,) = stacks(spread(batch.columns, len(values)), 1e-6, True)
    some = np.arange(7, 10_000, 4 if name == "karpodinis" else 97)
    machines = [SCENES[name](value) for value in values[some].tolist()]
    (alike,) = stacks(columns_of(machines), 1e-6, True)
    for field, value in stack.problem._asdict().items():
        among = value if field in SHARED else value[some]
        assert np.array_equal(among, getattr(alike.problem, field)), field
    for k, machine in zip(some[::10].tolist(), machines[::10], strict=True):
        assert batch[k] == machine
        alone = tables(machine, 1e-6, True).problem
        for field, value in stack.problem._asdict().items():
            own = value if field in SHARED else value[k]
            assert np.array_equal(own, getattr(alone, field)), field


def test_ten_thousand_motions_are_the_same_however_they_are_divided():
    beams = scenes.karpodinis(np.linspace(20.0, 24.0, 10_000))
    one = simulate_many(beams, periods=4, keep="counts", workers=1)
    two = simulate_many(beams, periods=4, workers=2)  # in other blocks
    for name in ("displacement", "velocity", "energy_lost", "impact_count", "status"):
        assert np.array_equal(getattr(one, name), getattr(two, name)), name
    for k in range(3, 10_000, 999):
        same(two[k], simulate(beams[k], periods=4))


def chattering(load):
    """A mass pressed to its stop, which it comes to rest at after infinitely many rebounds."""
    return Oscillator(
        damping=0.1, load=load, forces=(Force(1.0, 0.4),), stops=(Stop(0.1, Rigid(0.4)),)
    )


def rubbing(amplitude):
    return Oscillator(
        damping=0.1,
        forces=(Force(amplitude, 0.7), Force(0.4, 1.9, 1.0)),
        base=BaseMotion(0.1, 1.3, 0.4, stops=True),
        stops=(Stop(0.3, KelvinVoigt(300.0, 9.0, ends="force")), Stop(-0.4, Rigid(0.4), "lower")),
        friction=Friction(0.15, 0.3),
    )


def slowing(v):
    return 0.9 / (1 + v)


MACHINES = {
    "chatter that sticks": [chattering(load) for load in np.linspace(0.8, 1.0, 20)],
    "soft stops, friction": [rubbing(a) for a in np.linspace(0.5, 1.5, 20)],
    "a restitution function": [
        Oscillator(forces=Force(a, 0.8), damping=0.1, stops=Stop(0.3, Rigid(slowing)))
        for a in np.linspace(0.5, 1.5, 10)
    ],
    "other orders of the stops": [
        Oscillator(
            forces=Force(2.0, 0.9),
            damping=0.1,
            stops=(Stop(a, KelvinVoigt(9.0)), Stop(0.5, KelvinVoigt(4.0, 0.1, "force"))),
        )
        for a in np.linspace(0.3, 0.7, 10)
    ],
    "frequencies that coincide": [
        Oscillator(
            forces=(Force(1.0, 1.0), Force(0.5, w)), damping=0.1, stops=Stop(0.4, Rigid(0.7))
        )
        for w in (1.0, 2.0, 0.5, 1.1, 1.0, math.pi)
    ],
    "another engine among them": [
        chattering(1.0),
        Oscillator(damping=0.1, forces=Force(1.0, 0.9), stops=Stop(0.2, Hertz(50.0))),
        rubbing(1.0),
    ],
}


@pytest.mark.parametrize("name", MACHINES)
def test_motions_of_many_are_those_of_each(name):
    machines = MACHINES[name]
    options = {"periods": 8.3, "transient": 3.0}
    found = simulate_many(machines, workers=2, phase=0.3, **options)
    for k, machine in enumerate(machines):
        alone = simulate(machine, phase=0.3, **options)
        same(found[k], alone)
        assert (found.impact_count[k], found.energy_lost[k]) == (
            alone.impact_count,
            alone.energy_lost,
        )
    if name.startswith(("chatter", "soft")):
        assert found.stick_count.min() > 3


def test_events_that_fill_the_buffer_many_times_are_all_kept(monkeypatch):
    from impactsig.simulation.batches import moving as _moving

    monkeypatch.setattr(_moving, "ROOM", 11)
    found = simulate_many(MACHINES["chatter that sticks"], periods=5, workers=1)
    for machine, motion in zip(MACHINES["chatter that sticks"], found, strict=True):
        same(motion, simulate(machine, periods=5))


def test_motions_go_to_other_processes():
    restitution = np.array([0.2, 0.4, 0.6])
    batch = scenes.karpodinis(np.array([[20.1], [22.1]]), restitution=restitution)
    found = simulate(batch, periods=5)
    again = pickle.loads(pickle.dumps(found))
    same(again[1, 2], found[1, 2])
    assert again.to_xarray().identical(found.to_xarray())
    assert np.array_equal(again.energy_lost, found.energy_lost)
    assert again.status.tolist() == found.status.tolist()


def test_a_motion_that_ends_early_ends_no_other():
    def greedy(velocity):
        return 2.0 if velocity < 0.3 else 0.5

    walls = (Stop(1, Rigid(greedy)), Stop(-1, Rigid(greedy), "lower"))
    machine = Oscillator(stiffness=0, stops=walls)
    starts = [(0, 1.0), (0, 0.2), (0, 0.01)]
    found = simulate_many(machine, initial=starts, duration=20.0)
    assert found.status.tolist() == [
        simulate(machine, initial=at, duration=20.0).status for at in starts
    ]
    assert set(found.status) == {"broken law", "complete"}


# -- scenes of arrays ----------------------------------------------------------------------------


def test_a_scene_of_arrays_is_a_batch_in_their_shape():
    frequency, restitution = np.linspace(20, 21, 3)[:, None], np.array([0.2, 0.4])
    batch = scenes.karpodinis(frequency, restitution=restitution)
    assert isinstance(batch, OscillatorBatch)
    assert batch.shape == (3, 2)
    assert batch[1, 1] == batch[3] == scenes.karpodinis(20.5, restitution=0.4)
    assert [*batch][-1] == batch[-1] == scenes.karpodinis(21.0, restitution=0.4)
    found = simulate(batch, periods=9, transient=2)
    assert found.impact_count.shape == (3, 2)
    same(found[2, 0], simulate(batch[2, 0], periods=9, transient=2))
    alone = [motion.impacts_per_period for motion in found]
    assert found.impacts_per_period.ravel() == pytest.approx(alone, rel=1e-12)
    table = found.to_xarray()
    assert table.impact_count.dims == ("frequency", "restitution")
    assert table.frequency.values.tolist() == [20.0, 20.5, 21.0]


def test_friction_may_be_none_of_some():
    batch = scenes.begley_virgin(1.3, 0.8, np.array([0.0, 0.05]))
    for k, friction in enumerate((0.0, 0.05)):
        machine = scenes.begley_virgin(1.3, 0.8, friction)
        same(simulate(batch, periods=9)[k], simulate(machine, periods=9))
        assert batch[k] == machine


@pytest.mark.parametrize(
    ("make", "argument"),
    [
        (
            lambda: scenes.karpodinis(np.ones(3), restitution=np.full(2, 0.5)),
            "frequency, restitution",
        ),
        (lambda: scenes.karpodinis(np.array([20.0, 0.0])), "frequency"),
        (lambda: scenes.karpodinis(np.array([20.0, math.nan])), "frequency"),
        (lambda: scenes.karpodinis(np.array(["a", "b"])), "frequency"),
        (lambda: scenes.karpodinis(np.empty(0)), "frequency"),
        (lambda: scenes.karpodinis(20.0, restitution=np.array([0.5, 1.5])), "restitution"),
        (lambda: scenes.tian(np.array([1.0, 2.0]), 1.0, damping_ratio=-1), "damping_ratio"),
        (lambda: scenes.tian(np.array([0.5, 1.0]), 1.0, damping_ratio=0.0), "damping"),
        (lambda: scenes.begley_virgin(1.0, (np.array([-1.0, 2.0]), 1.0), 0.1), "sigma"),
        (lambda: scenes.begley_virgin(1.0, 1.0, np.array([0.1, -0.1])), "friction"),
        (lambda: scenes.okolewski(np.array([1.0, 2.0]), 0.0, "soft"), "restitution"),
        (
            lambda: scenes.cantilever(
                np.array([0.2, 0.3]), 0.025, 1e-3, 210e9, 7850, stop=1e-3, frequency=20, amplitude=1
            ),
            "length",
        ),
        (lambda: scenes.van_der_pol_duffing(np.array([0.5, 0.6])), "restitution"),
        (lambda: scenes.okolewski(np.array([2.0, 3.0]), 0.6, noise=Noise(0.1)), "noise"),
        (lambda: scenes.okolewski(np.array([2.0, 3.0]), 0.6, law=lambda t, x, v: -x), "law"),
        (
            lambda: scenes.okolewski(np.array([2.0, 3.0]), 0.6, stops=(Stop(0.1, Hertz(9.0)),)),
            "stops",
        ),
        (
            lambda: simulate(scenes.karpodinis(np.ones(3)), periods=1, initial=np.zeros((2, 2))),
            None,
        ),
        (lambda: simulate(scenes.karpodinis(np.ones(3)), periods=1, seed=3), "seed"),
        (lambda: Force(np.ones(3), 1.0), "amplitude"),
    ],
)
def test_what_cannot_be_a_batch_is_refused_by_name(make, argument):
    with pytest.raises(InvalidInput) as caught:
        make()
    assert argument is None or caught.value.argument == argument


def test_parts_of_a_batch_are_columns_and_others_are_not():
    batch = scenes.karpodinis(np.array([20.0, 21.0]))
    assert batch.columns.forces[0].angular_frequency.shape == (2,)
    numbers = [getattr(batch[0], field.name) for field in fields(Oscillator)]
    assert not any(isinstance(number, np.ndarray) for number in numbers)


# -- exponents -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "batch",
    [
        scenes.karpodinis(np.array([20.1, 20.3355, 22.1])),
        scenes.begley_virgin(1.338, 1.6, np.array([0.05, 0.2])),
    ],
    ids=repr,
)
def test_exponents_of_a_batch_are_those_of_each(batch):
    found = lyapunov_spectrum(batch, periods=1200, initial=(0.1, 0.0), phase=0.5)
    for k, machine in enumerate(batch):
        alone = lyapunov_spectrum(machine, periods=1200, initial=(0.1, 0.0), phase=0.5)
        for name in ("exponents", "between_collapses"):
            own = getattr(found, name)[k]
            assert np.array_equal(own, getattr(alone, name), equal_nan=True), name
        assert found.error[k] == pytest.approx(alone.error, rel=1e-9, nan_ok=True)
        for name in ("expected_sum", "collapses", "impacts", "grazings", "status"):
            assert getattr(found, name)[k] == getattr(alone, name), name


FAR = {
    "a frequency whose square is 0": {"forces": (Force(1.0, 1e-300),)},
    "a frequency whose square is no float": {"forces": (Force(1.0, 1e200),)},
    "forces that no float holds": {"forces": (Force(1e200, 1e-60),)},
    "a damping whose square is no float": {"forces": (Force(1.0, 1.0),), "damping": 1e200},
}


@pytest.mark.parametrize("name", FAR)
@pytest.mark.filterwarnings("error")
def test_numbers_that_no_float_holds_are_refused_not_moved(name):
    machine = Oscillator(stiffness=2.0, stops=(Stop(1.0, Rigid(0.5)),), **FAR[name])
    near = Oscillator(stiffness=2.0, stops=(Stop(1.0, Rigid(0.5)),), forces=(Force(1.0, 1.0),))
    with pytest.raises(InvalidInput, match="is not finite"):
        simulate(machine, periods=2)
    with pytest.raises(InvalidInput, match=r"oscillator 1, .* is not finite"):
        simulate_many([near, machine], periods=2)


@pytest.mark.parametrize("law", [Rigid(0.5), Hertz(1e4)])
@pytest.mark.parametrize("fast", [1e12, 1e308])
@pytest.mark.filterwarnings("error")
def test_forcing_of_endless_turns_is_refused(fast, law):
    """Not searched for impacts turn by turn, for ever."""
    forces = Force(1.0, 0.5), Force(0.3, fast)
    machine = Oscillator(damping=0.1, forces=forces, stops=(Stop(1.0, law),))
    with pytest.raises(InvalidInput, match=r"frequencies \S+ to 1|is not finite"):
        simulate(machine, periods=2)


def test_frequencies_whose_ratio_no_float_holds_have_no_common_period():
    assert not Oscillator(damping=0.1, forces=(Force(1.0, 0.1), Force(1.0, 1e308))).forcing_recurs
    assert not Oscillator(damping=0.1, forces=(Force(1.0, 1e308), Force(1.0, 0.1))).forcing_recurs


@pytest.mark.parametrize("gamma", [1e-300, 1e200])
@pytest.mark.filterwarnings("error")
def test_a_batch_is_compared_with_resonance_at_any_frequency(gamma):
    batch = scenes.begley_virgin(np.array([1.0, gamma]), 1.6, 0.0)
    with pytest.raises(InvalidInput, match=r"oscillator 1, .* is not finite"):
        simulate_many(batch, periods=2)
