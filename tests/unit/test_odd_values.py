"""Validators, given values whose own methods raise, and kinds of numbers that NumPy converts."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from impactsig import (
    Cantilever,
    Impacts,
    InvalidInput,
    KelvinVoigt,
    LoadCell,
    Noise,
    Oscillator,
    Recording,
    bifurcation_diagram,
    combine_impacts,
    correlation_sum,
    detect_impacts,
    fit_oscillator,
    flows,
    identify_period,
    interval_histogram,
    prediction_error,
    scenes,
    simulate,
    simulate_ensemble,
    surrogate_test,
    synthesize,
    track_period,
)
from impactsig._arguments import (
    entries,
    limits,
    number,
    one_or_several,
    path,
    reals,
    seed_sequence,
    whole,
)


class Raising:
    """An object that cannot be looked at."""

    def __array__(self, *_args, **_options):
        raise RuntimeError("no array")

    def __float__(self):
        raise RuntimeError("no number")

    def __iter__(self):
        raise RuntimeError("no items")


class RaisingItems:
    """A sequence with a length, whose items cannot be had."""

    def __len__(self):
        return 2

    def __getitem__(self, index):
        raise RuntimeError("no item")


class RaisingText:
    """An object that cannot be shown."""

    def __repr__(self):
        raise RuntimeError("no text")


RECURSIVE: list = []
RECURSIVE.append(RECURSIVE)
MASKED = np.ma.masked_array([1.0, 2.0, 3.0], mask=[0, 1, 0])


@pytest.mark.parametrize(
    "value",
    [
        Raising(), np.bool_(True), np.timedelta64(3, "ns"), np.datetime64("2020-01-01"),
        np.ma.masked, Decimal("sNaN"), 10**400, np.array("1"), np.zeros(1, [("a", float)])[0],
    ],
)  # fmt: skip
def test_what_float_would_take_or_cannot_is_no_number(value):
    with pytest.raises(InvalidInput, match="x:"):
        number("x", value)


def test_numbers_of_other_kinds_are_numbers():
    odd = (2, np.float16(2), Fraction(2), Decimal(2), np.array(2.0), np.uint64(2))
    assert [number("x", value) for value in odd] == [2.0] * 6


@pytest.mark.parametrize(
    "value", [Raising(), MASKED, [10**400], np.zeros(3, [("a", float)]), ["1"]]
)
def test_no_array_is_read_from_what_holds_no_numbers(value):
    with pytest.raises(InvalidInput, match="x:"):
        reals("x", value, "numbers")


def test_an_array_without_a_masked_value_is_numbers():
    assert reals("x", np.ma.masked_array([1.0, 2.0]), "numbers").tolist() == [1.0, 2.0]


@pytest.mark.parametrize("value", [np.timedelta64(3, "s"), np.bool_(True), True, 2.0])
def test_a_span_of_time_is_no_whole_number(value):
    with pytest.raises(InvalidInput, match="n:"):
        whole("n", value, 1)


@pytest.mark.parametrize("value", [RECURSIVE, [1, 2], True, -1, "1", Raising()])
def test_a_seed_is_a_whole_number(value):
    # NumPy would follow a list that holds itself until the process ends.
    with pytest.raises(InvalidInput, match="seed:"):
        seed_sequence(value)


def test_a_seed_may_be_long():
    assert seed_sequence(2**200).entropy == 2**200


@pytest.mark.parametrize("value", ["a\0b", "\ud800", Raising()])
def test_no_path_that_the_system_cannot_take(value):
    with pytest.raises(InvalidInput, match="directory:"):
        path("directory", value)


def test_items_that_raise_are_no_sequence():
    with pytest.raises(InvalidInput, match="values:"):
        entries("values", Raising(), "items")


def test_a_value_that_cannot_be_shown_is_refused_by_its_class():
    with pytest.raises(InvalidInput, match="x: got <RaisingText>"):
        number("x", RaisingText())


@pytest.mark.parametrize("value", [Raising(), RaisingItems(), "ab", [1.0], [2.0, 1.0], 1.0, None])
def test_two_numbers_in_order(value):
    with pytest.raises(InvalidInput, match="x:"):
        limits("x", value, "two numbers, the lesser first")
    assert limits("x", (Fraction(1, 2), np.float32(2)), "") == (0.5, 2.0)


@pytest.mark.parametrize("bounds", [{"above": 1.0}, {"least": 1.5}, {"most": 1.5}])
def test_two_numbers_within_bounds(bounds):
    with pytest.raises(InvalidInput, match="x:"):
        limits("x", (1.0, 2.0), "two numbers", **bounds)


def test_one_number_or_several():
    assert one_or_several("x", np.int8(3), "") == ((3,), True)
    assert one_or_several("x", range(2), "") == ((0, 1), False)
    for value in ("12", Raising(), RaisingItems(), 1j, np, None):
        with pytest.raises(InvalidInput, match="x:"):
            one_or_several("x", value, "a number or several")


ODD = [
    Raising(),
    RaisingItems(),
    [Raising()],
    RECURSIVE,
    RaisingText(),
    np,
    np.void(b"ab"),
    "\ud800",
]
TRAIN = Impacts.from_times(np.arange(0.05, 3.0, 0.1), duration=3.0, peak=np.ones(30))
CHAOS = np.random.default_rng(0).standard_normal(300)
NOISY = Oscillator(damping=0.2, noise=Noise(0.1))
BEAM = (0.2, 0.02, 0.001, 2e11, 7800.0)
CALLS = {
    "stops": lambda value: Oscillator(stops=value),
    "forces": lambda value: Oscillator(forces=value),
    "damping_ratio": lambda value: Cantilever(*BEAM, damping_ratio=value),
    "initial": lambda value: simulate(Cantilever(*BEAM), duration=1.0, initial=value),
    "section": lambda value: bifurcation_diagram(
        lambda rho: flows.lorenz(rho=rho), [28.0], section=value
    ),
    "kinds": lambda value: fit_oscillator(
        TRAIN, 0.1, ["amplitude"], scene=scenes.karpodinis(10.0), kinds=value
    ),
    "strengths": lambda value: fit_oscillator(
        TRAIN, 0.1, ["amplitude"], scene=scenes.karpodinis(10.0), strengths=value
    ),
    "horizon": lambda value: prediction_error(CHAOS, horizon=value),
    "flags": lambda value: Impacts([1.0, 2.0], flags=value),
    "bins": lambda value: interval_histogram(TRAIN, bins=value),
    "surrogates": lambda value: surrogate_test(CHAOS, surrogates=value),
    "statistic": lambda value: surrogate_test(CHAOS, lambda _x: value),
    "sensor": lambda value: synthesize(TRAIN, value),
    "trains": lambda value: combine_impacts(value),
    "contact_level": lambda value: detect_impacts(
        Recording(CHAOS, rate=1000.0), contact_level=value
    ),
    "energy_range": lambda value: simulate_ensemble(
        NOISY, paths=2, duration=1.0, energy_range=value
    ),
}


@pytest.mark.parametrize("value", ODD, ids=lambda value: type(value).__name__)
@pytest.mark.parametrize("argument", CALLS)
def test_what_cannot_be_looked_at_is_refused_by_name(argument, value):
    with pytest.raises(InvalidInput, match=argument):
        CALLS[argument](value)


@pytest.mark.parametrize("argument", ["step", "every", "duration"])
def test_steps_that_no_number_counts_are_refused(argument):
    with pytest.raises(InvalidInput, match=argument):
        simulate_ensemble(NOISY, paths=2, **({"duration": 20.0} | {argument: 5e-324}))


def test_what_a_function_or_a_stream_of_the_caller_raises_comes_through():
    with pytest.raises(RuntimeError, match="no items"):
        detect_impacts(Raising())
    with pytest.raises(TypeError):
        surrogate_test(CHAOS, float)


def test_public_functions_name_the_argument():
    with pytest.raises(InvalidInput, match="samples:"):
        Recording(Raising(), rate=1000.0)
    with pytest.raises(InvalidInput, match="initial:"):
        simulate(flows.lorenz(), duration=1, initial=Raising())
    with pytest.raises(InvalidInput, match="x:"):
        correlation_sum(Raising())
    with pytest.raises(InvalidInput, match="peak:"):
        Impacts([1.0, 2.0, 3.0], peak=MASKED)
    with pytest.raises(InvalidInput, match="stiffness:"):
        KelvinVoigt(np.bool_(True))


@pytest.mark.parametrize("kind", [Decimal, Fraction])
def test_what_is_computed_with_is_the_number_not_its_kind(kind):
    train = Impacts.from_times(np.arange(0.05, 3.0, 0.1), duration=3.0)
    period = kind(1) / kind(8)
    assert identify_period(train, period) == identify_period(train, 0.125)
    assert track_period(train, period, window=20).windows
    record = synthesize(train, LoadCell(), full_scale=kind(2))
    np.testing.assert_array_equal(
        record.samples, synthesize(train, LoadCell(), full_scale=2.0).samples
    )
    found = detect_impacts(record, dead_time=period, merge_within=kind(0))
    assert len(found) == len(train) // 2
