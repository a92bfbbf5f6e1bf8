"""Machines on a GPU: what threads compute, in numba's simulator of one and on a device.

The simulator runs the kernels' Python, a thread a machine, so their bits are those of the compiled
kernels here. A device's own functions of angles may differ from those in the last bits.
"""

from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np
import pytest

from impactsig import (
    BaseMotion,
    Force,
    Friction,
    Hertz,
    ImpactsigError,
    InvalidInput,
    KelvinVoigt,
    MissingExtra,
    Noise,
    Oscillator,
    Rigid,
    Stop,
    basins_of_attraction,
    flows,
    lyapunov_spectrum,
    periodicity_chart,
    scenes,
    simulate_ensemble,
    simulate_many,
)
from impactsig.stochastic.paths.equation import BLOCK
from impactsig.studies import device
from impactsig.studies.device import parts_of_device
from tests.cells_device import walls
from tests.gpu import pretend_device, simulating

BEAMS = scenes.karpodinis(np.linspace(20, 24, 5))
NUMBERS = ("impact_count", "stick_count", "displacement", "velocity", "energy_lost", "phase")


def on_device(function, *args, **options):
    return function(*args, executor="gpu", **options)


@pytest.fixture(scope="module")
def simulator():
    with simulating() as called:
        yield called


@pytest.fixture
def real():
    try:
        parts_of_device()
    except ImpactsigError as error:
        pytest.skip(f"needs a GPU: {error}")
    return on_device


@pytest.fixture(params=["simulator", pytest.param("real", marks=pytest.mark.gpu)])
def gpu(request):
    """Calls a function with executor="gpu", and how near it is to threads."""
    called = request.getfixturevalue(request.param)
    return called, 0.0 if request.param == "simulator" else 1e-9


def agree(a, b, within):
    assert np.shape(a) == np.shape(b)
    assert np.allclose(a, b, rtol=within, atol=within, equal_nan=True)


# -- what threads compute --------------------------------------------------------------------------


MACHINES = {
    "rigid": (BEAMS, 6),
    "soft": (scenes.okolewski(np.linspace(1.5, 4, 3), 0.6, "soft"), 3),
    "friction": (scenes.begley_virgin(np.array([0.5, 1.0, 1.4]), 1.5, 0.2), 4),
    # Pressed to its stop, with chatter of more impacts than there are rows.
    "chatter": (
        Oscillator(
            damping=0.1, load=1.0, stops=(Stop(0.0, Rigid(0.9)),), forces=(Force(1.3, 0.2),)
        ),
        2,
    ),
    "two layouts": ([scenes.karpodinis(21.0), scenes.begley_virgin(1.0, 1.5, 0.1)], 3),
}


def motions_of(name, executor):
    """Numbers and events of the motions of some machines, and impacts as they are counted."""
    machines, periods = MACHINES[name]
    found, counted = (
        simulate_many(machines, periods=periods, transient=1, executor=executor, keep=keep)
        for keep in ("all", "counts")
    )
    numbers = [getattr(found, number) for number in NUMBERS]
    events = [(one.impacts.time, one.impacts.approach_velocity, one.sticks) for one in found]
    return numbers, events, counted.impact_count


def exponents_of(executor):
    found = lyapunov_spectrum(BEAMS, periods=6, transient=3, executor=executor)
    return found.exponents, found.between_collapses, found.expected_sum, found.impacts


@pytest.mark.parametrize("name", list(MACHINES))
def test_motions(gpu, name):
    called, within = gpu
    numbers, events, counted = called(motions_of, name)
    wanted, wanted_events, impacts = motions_of(name, "threads")
    for found, own in zip(numbers, wanted, strict=True):
        agree(found, own, within)
    for found, own in zip(events, wanted_events, strict=True):
        for part, own_part in zip(found, own, strict=True):
            agree(part, own_part, within)
    agree(counted, impacts, 0)
    if name == "chatter":
        assert impacts[0] > 2 * 128
        assert numbers[1][0] > 0


@pytest.mark.parametrize("skip", [True, False])
def test_charts(gpu, skip):
    called, _ = gpu
    axes = [0.5, 1.4], [0.1, 0.2]
    options = {"periods": 30, "closed": 1e-5, "skip": skip}
    found, wanted = (
        call(periodicity_chart, walls, *axes, **options)
        for call in (called, lambda function, *given, **more: function(*given, **more))
    )
    assert found.periods.max() > 1
    for name in ("periods", "impacts", "followed", "failed"):
        assert np.array_equal(getattr(found, name), getattr(wanted, name))


def test_basins(gpu):
    called, within = gpu
    system, axis = scenes.begley_virgin(1.338, 1.6, 0.3), np.linspace(-1.5, 1.5, 3)
    options = {"periods": 60, "closed": 1e-4, "catch": False}
    found = called(basins_of_attraction, system, axis, axis, **options)
    wanted = basins_of_attraction(system, axis, axis, **options)
    assert np.array_equal(found.labels, wanted.labels)
    assert found.open_share < 1
    for one, other in zip(found.attractors, wanted.attractors, strict=True):
        agree(one.strobe, other.strobe, 100 * within)


def test_caught_starts(gpu):
    called, within = gpu
    system, axis = scenes.karpodinis(22.1), np.linspace(-0.9, 0.9, 2)
    options = {"periods": 40, "closed": 1e-3}
    found = called(basins_of_attraction, system, axis, axis, **options)
    wanted = basins_of_attraction(system, axis, axis, **options)
    assert np.array_equal(found.labels, wanted.labels)
    assert found.attractors[0].radius > 0
    agree(found.attractors[0].radius, wanted.attractors[0].radius, within)


def test_exponents(gpu):
    called, within = gpu
    wanted = exponents_of("threads")
    assert np.isfinite(wanted[0]).all()
    for found, own in zip(called(exponents_of), wanted, strict=True):
        agree(found, own, 100 * within)


ENSEMBLES = {
    "white": Oscillator(damping=0.1, noise=Noise(0.1), stops=(Stop(0.3, Rigid(0.7)),)),
    "friction": Oscillator(
        damping=0.05, noise=Noise(0.2), friction=Friction(0.1, 0.15),
        stops=(Stop(0.3, Rigid(0.7)), Stop(-0.4, Rigid(0.9), "lower")),
    ),
    "band": Oscillator(
        damping=0.1, noise=Noise(0.1, correlation_time=3.0, angular_frequency=1.2),
        forces=(Force(0.3, 1.1),), stops=(Stop(0.3, Hertz(4.0)),),
    ),
    "soft": Oscillator(
        damping=0.1, noise=Noise(0.1), base=BaseMotion(0.2, 1.1, stops=True),
        stops=(Stop(0.3, KelvinVoigt(5.0, 0.1)), Stop(-0.3, KelvinVoigt(5.0, 0.1), "lower")),
    ),
    "stiffness": Oscillator(
        damping=0.2, noise=Noise(0.02, parametric=True), stops=(Stop(0.3, Rigid(0.7)),)
    ),
}  # fmt: skip


def ensemble_of(name, executor):
    """Numbers of an ensemble of three paths, through more than one draw of random numbers."""
    found = simulate_ensemble(
        ENSEMBLES[name], paths=3, duration=4.0, transient=1.0, initial=(0.1, 0.4), seed=5, bins=16,
        executor=executor,
    )  # fmt: skip
    densities = [
        (one.density, one.standard_error, one.mean, one.mean_error, one.sd)
        for one in (found.energy, found.displacement, found.velocity)
    ]
    numbers = found.mean_energy, found.impact_rate, found.impact_rate_error, found.drift
    return [*densities, (found.joint.density, found.joint.standard_error), numbers], found.step


@pytest.mark.parametrize("name", list(ENSEMBLES))
def test_ensembles(gpu, name):
    called, within = gpu
    found, step = called(ensemble_of, name)
    wanted, _ = ensemble_of(name, "threads")
    assert 5.0 / step > BLOCK
    assert wanted[-1][1] > 0
    for one, other in zip(found, wanted, strict=True):
        for part, own in zip(one, other, strict=True):
            agree(part, own, 100 * within)


# -- what a GPU does not take ----------------------------------------------------------------------


@pytest.fixture
def there(monkeypatch):
    """As if there were a GPU."""
    monkeypatch.setattr(device, "parts_of_device", dict)


def by_speed(v):
    return 0.5


SHAKEN = Oscillator(damping=0.1, noise=Noise(0.1))


def ensemble(oscillator=SHAKEN, **options):
    return on_device(simulate_ensemble, oscillator, paths=2, duration=2.0, **options)


@pytest.mark.usefixtures("there")
@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda: on_device(simulate_many, BEAMS, periods=2, workers=2), "workers"),
        (lambda: on_device(simulate_many, BEAMS, periods=2, method="dop853"), "executor"),
        (
            lambda: on_device(
                simulate_many, Oscillator(stops=(Stop(1.0, Hertz(9.0)),)), duration=1.0
            ),
            "executor",
        ),
        (
            lambda: on_device(
                simulate_many, Oscillator(stops=(Stop(1.0, Rigid(by_speed)),)), duration=1.0
            ),
            "restitution",
        ),
        (lambda: on_device(lyapunov_spectrum, scenes.karpodinis(22.0), periods=9), "system"),
        (
            lambda: on_device(
                basins_of_attraction,
                Oscillator(
                    damping=0.1, stops=(Stop(1.0, Hertz(9.0)),), forces=(Force(1.0, 1.0),)
                ),
                [0.0], [0.0],
            ),
            "system",
        ),
        (lambda: on_device(periodicity_chart, lambda a, b: flows.rossler(), [1.0], [1.0]), "scene"),
        (lambda: ensemble(method="gaussian"), "method"),
        (lambda: ensemble(workers=1), "workers"),
        (lambda: ensemble(replace(SHAKEN, law=lambda t, x, v: -x)), "law"),
        (lambda: ensemble(replace(SHAKEN, stops=(Stop(1.0, Rigid(by_speed)),))), "restitution"),
    ],
)  # fmt: skip
def test_refusals(call, argument):
    with pytest.raises(InvalidInput) as error:
        call()
    assert error.value.argument == argument


def test_without_a_gpu_it_says_so(monkeypatch):
    monkeypatch.delenv("NUMBA_ENABLE_CUDASIM", raising=False)
    try:
        parts_of_device()
    except (InvalidInput, MissingExtra):
        with pytest.raises((InvalidInput, MissingExtra), match="GPU"):
            on_device(simulate_many, BEAMS, periods=2)
    else:
        pytest.skip("there is one")


# -- the code of a device --------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.usefixtures("there")
@pytest.mark.parametrize(
    "call",
    [
        lambda: on_device(simulate_many, BEAMS, periods=2),
        lambda: on_device(periodicity_chart, walls, [0.5, 1.0], [0.1, 0.2], periods=9),
        lambda: ensemble(),
    ],
    ids=["motions", "strobes", "ensembles"],
)
def test_it_compiles_for_a_device(monkeypatch, call):
    pretend_device(monkeypatch)
    from impactsig.studies import device_kernels

    texts = []

    class Compiled(Exception):
        pass

    def compiled(each, order, *arguments):
        with device_kernels.without_fusing():
            each._kernel.compile((numba.typeof(order), numba.typeof(arguments)))
        (kernel,) = each._kernel.overloads.values()
        texts.append(kernel.library.get_asm_str())
        raise Compiled

    monkeypatch.setattr(device_kernels.Each, "__call__", compiled)
    with pytest.raises(Compiled):
        call()
    assert ".visible .entry" in texts[0]
