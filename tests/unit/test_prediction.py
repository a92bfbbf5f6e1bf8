"""Nonlinear prediction error against the naive twin, closed forms, and what it says of noise."""

import numpy as np
import pytest

from impactsig import InvalidInput, prediction_error, time_reversal_asymmetry
from impactsig.reconstruct.testing._errors import forecasts
from tests import firing, naive_recurrence

RNG = np.random.default_rng(11)


@pytest.mark.parametrize("values", [RNG.random(90), RNG.integers(0, 4, 90).astype(float)])
@pytest.mark.parametrize(("dimension", "delay"), [(1, 1), (2, 3), (4, 1)])
@pytest.mark.parametrize(("neighbors", "theiler"), [(1, 0), (5, 3)])
def test_errors_are_those_of_the_naive_twin(values, dimension, delay, neighbors, theiler):
    horizon = [2, 1, 4]
    found = prediction_error(
        values, dimension, delay, horizon, neighbors=neighbors, theiler=theiler
    )
    for h, error in zip(horizon, found.error, strict=True):
        guess = naive_recurrence.forecasts(values, dimension, delay, h, 4, neighbors, theiler)
        end = (dimension - 1) * delay + h
        target = values[end : end + len(guess)]
        assert error == np.sqrt(np.mean((guess - target) ** 2)) / target.std()
    assert found.references == len(values) - (dimension - 1) * delay - 4


def test_the_plane_is_that_of_least_squares():
    """Every reference has all others as neighbours: leave-one-out regression, in closed form."""
    x = RNG.random(40)
    rows = len(x) - 3
    found = prediction_error(x, 3, 1, 1, neighbors=rows - 1, theiler=0, predictor="linear")
    design = np.column_stack((np.ones(rows), x[:-3], x[1:-2], x[2:-1]))
    hat = design @ np.linalg.pinv(design)
    residual = (x[3:] - hat @ x[3:]) / (1 - np.diag(hat))  # the PRESS residual
    assert found.value == pytest.approx(np.sqrt(np.mean(residual**2)) / x[3:].std(), rel=1e-9)


def test_a_linear_recursion_is_foretold_by_the_plane():
    """x_n = 2 cos(w) x_{n-1} - x_{n-2} exactly."""
    x = np.sin(0.7 * np.arange(400))
    assert prediction_error(x, 2, predictor="linear").value < 1e-9
    assert prediction_error(x, 2).value > 1e-4


def test_neighbours_that_do_not_spread_give_no_slope():
    x = np.tile([0.0, 1.0], 40)
    assert prediction_error(x, 2, predictor="linear").value == 0


def test_independent_values_cannot_be_foretold():
    """The mean of k independent futures: E^2 = 1 + 1/k."""
    found = prediction_error(RNG.standard_normal(4000), 3, horizon=[1, 5], neighbors=8)
    assert found.error == pytest.approx(np.sqrt(1 + 1 / 8), abs=0.03)


@pytest.mark.parametrize("flow", ["rossler", "lorenz"])
def test_intervals_are_foretold_for_a_while(flow):
    found = prediction_error(firing.intervals(flow, 1000, 1), 4, horizon=range(1, 21))
    assert found.value < 0.6
    assert found.error[-1] > found.error[0] + 0.1
    assert "1 step ahead" in repr(found)


def test_more_intervals_are_foretold_better():
    errors = [
        prediction_error(firing.intervals("rossler", n, 1), 3, neighbors=5).value
        for n in (500, 4000)
    ]
    assert errors[1] < 0.7 * errors[0]


def test_a_series_that_climbs_slowly_and_falls_fast_is_not_reversible():
    """Steps of +1 four times and -4 once: <d^3> = -12, <d^2> = 4."""
    x = np.tile(np.arange(5.0), 200)[:-4]
    assert time_reversal_asymmetry(x) == pytest.approx(-12 / 4**1.5)
    assert time_reversal_asymmetry(-x) == pytest.approx(12 / 4**1.5)
    assert time_reversal_asymmetry(x[::-1]) == pytest.approx(12 / 4**1.5)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"dimension": 0}, "dimension"),
        ({"delay": 1.5}, "delay"),
        ({"horizon": 0}, "horizon"),
        ({"horizon": []}, "horizon"),
        ({"horizon": 1.5}, "horizon"),
        ({"neighbors": 0}, "neighbors"),
        ({"neighbors": 3, "predictor": "linear"}, "neighbors"),
        ({"theiler": -1}, "theiler"),
        ({"predictor": "cubic"}, "predictor"),
        ({"dimension": 45}, "x"),
        ({"theiler": 60}, "x"),
    ],
)
def test_arguments_that_cannot_be_used(options, named):
    with pytest.raises(InvalidInput, match=f"^{named}:"):
        prediction_error(RNG.random(100), **options)


def test_a_constant_cannot_be_normalised():
    with pytest.raises(InvalidInput, match=r"^x:.*constant after"):
        prediction_error([1.0] + [2.0] * 80, 3)
    with pytest.raises(InvalidInput, match=r"^x:.*not all equal"):
        prediction_error([2.0] * 80)
    with pytest.raises(InvalidInput, match=r"^x: got periodic"):
        time_reversal_asymmetry([1.0, 2.0] * 20, delay=2)


def test_one_kernel_serves_arrays_that_can_be_written_to_and_ones_that_cannot():
    x = np.random.default_rng(1).random(100)
    first = prediction_error(x, dimension=1).value
    kernels = list(forecasts.signatures)
    x.flags.writeable = False
    assert prediction_error(x, dimension=1).value == first
    assert forecasts.signatures == kernels
