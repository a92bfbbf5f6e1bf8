"""What the exponents say of themselves, what they refuse, and how they draw."""

import math

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from matplotlib.figure import Figure

import impactsig
from impactsig import FixedStep, Force, InvalidInput, Oscillator, Rigid, Stop, flows, scenes
from impactsig.dynamics.tangents.growth import batch_error

BEAM = scenes.karpodinis(20.1)


@pytest.mark.parametrize(
    ("system", "options", "argument"),
    [
        (3, {"periods": 10}, "system"),
        (BEAM, {}, "periods, duration"),
        (BEAM, {"periods": -1}, "periods"),
        (BEAM, {"periods": math.nan}, "periods"),
        (BEAM, {"periods": "many"}, "periods"),
        (BEAM, {"periods": 5, "duration": 5}, "periods, duration"),
        (BEAM, {"periods": 5, "transient": -1}, "transient"),
        (BEAM, {"periods": 5, "method": FixedStep(100)}, "method"),
        (BEAM, {"periods": 5, "initial": (2.0, 0.0)}, "initial"),
        (flows.lorenz(), {"periods": 5}, "periods"),
        (flows.lorenz(), {"duration": 0}, "duration"),
        (flows.lorenz(), {"duration": 5, "initial": (1, 2)}, "initial"),
        (flows.lorenz(), {"duration": 5, "transient": math.inf}, "transient"),
    ],
)
def test_wrong_arguments_are_named(system, options, argument):
    with pytest.raises(InvalidInput) as caught:
        impactsig.lyapunov_spectrum(system, **options)
    assert caught.value.argument == argument


def test_the_curve_ends_at_the_exponents():
    found = impactsig.lyapunov_spectrum(BEAM, periods=640)
    assert found.curve[-1] == pytest.approx(found.exponents)
    assert found.time == pytest.approx(np.arange(1, 65) * 10 * BEAM.forcing_period / BEAM.time_unit)
    assert found.exponents[0] > found.exponents[1]
    assert "per unit of time" in repr(found)


def test_how_the_run_is_cut_changes_nothing(monkeypatch):
    from impactsig.dynamics.tangents import _follow

    whole = impactsig.tangent_map(BEAM, periods=40)
    monkeypatch.setattr(_follow, "TURNS_AT_A_TIME", 0.7)
    monkeypatch.setattr(_follow, "ROOM", 5)
    cut = impactsig.tangent_map(BEAM, periods=40)
    size = np.abs(whole.matrix).max()
    assert cut.matrix == pytest.approx(whole.matrix, abs=1e-8 * size)
    assert cut.final == pytest.approx(whole.final)


def test_a_long_map_is_told_by_its_scale():
    found = impactsig.tangent_map(scenes.karpodinis(22.1), periods=5000)
    assert found.matrix == pytest.approx(0)
    assert found.log_scale < -700
    assert np.abs(found.scaled).max() > 1e-110
    multipliers = impactsig.tangent_map(scenes.karpodinis(22.1), periods=3).multipliers
    assert np.abs(multipliers[0]) >= np.abs(multipliers[1]) > 0


def broken(v):
    return 2.0 if v > 0.5 else 0.3


def test_a_run_that_ends_early_says_so():
    machine = Oscillator(forces=Force(1.0, 0.7), damping=0.1, stops=Stop(0.3, Rigid(broken)))
    found = impactsig.lyapunov_spectrum(machine, periods=100, transient=0)
    assert found.status == "broken law"
    assert impactsig.tangent_map(machine, periods=100).status == "broken law"


def test_batch_errors_of_independent_and_of_dependent_rates():
    """Signs that alternate in runs: n means of +-1 have the error 1 / sqrt(n - 1)."""
    fast = np.resize([1.0, -1.0], (4096, 1))
    assert batch_error(fast)[0] == pytest.approx(1 / math.sqrt(4095), rel=1e-12)
    slow = np.repeat(fast[:64], 64, axis=0)
    assert batch_error(slow)[0] == pytest.approx(1 / math.sqrt(63), rel=1e-12)
    both = np.hstack([3 * fast, 2 * slow + 5])
    assert batch_error(both) == pytest.approx([3 / math.sqrt(4095), 2 / math.sqrt(63)], rel=1e-12)
    odd = np.resize([1.0, -1.0, -1.0, 1.0], (9, 1))  # joined, the last is left out
    assert batch_error(odd)[0] == pytest.approx(math.sqrt(80 / 81 / 8), rel=1e-12)
    assert math.isnan(batch_error(fast[:7])[0])


def test_batch_errors_are_the_greatest_that_any_length_of_batch_gives():
    rates = np.random.default_rng(3).normal(size=(1024, 20)).cumsum(axis=0)
    rates[:, 10:] = np.diff(rates[:, 10:], axis=0, prepend=0.0)
    errors = [
        rates.reshape(-1, length, 20).mean(axis=1).std(axis=0, ddof=1) / math.sqrt(1024 / length)
        for length in (1, 2, 4, 8, 16, 32, 64, 128)
    ]
    assert batch_error(rates) == pytest.approx(np.max(errors, axis=0), rel=1e-12)


@pytest.mark.parametrize(
    ("system", "options"),
    [
        (BEAM, {"periods": 200}),
        (scenes.okolewski(3, 0.6), {"periods": 50}),
        (flows.rossler(), {"duration": 50}),
    ],
)
def test_the_convergence_is_drawn_where_told(system, options):
    ax = Figure().subplots()
    found = impactsig.lyapunov_spectrum(system, **options)
    assert found.plot(ax) is ax
    ax.figure.draw_without_rendering()
    assert len(ax.lines) == len(found.exponents) + 1
    assert bool(found.collapses) == ("collapse" in ax.get_title(loc="left"))
