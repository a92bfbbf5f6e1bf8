"""The one rule of the default Theiler window, and that all who need a window go by it."""

import numpy as np
import pytest

import impactsig
from impactsig import Impacts
from impactsig.reconstruct._theiler import theiler_window
from tests import firing, naive_reconstruct_embed
from tests.gaps import with_gaps

WAVE = np.sin(2 * np.pi * (np.arange(2000) - 0.5) / 80)


@pytest.mark.parametrize("unit", [1e-300, 1.0, 1e300])
def test_of_a_wave_it_is_two_periods(unit):
    assert theiler_window(None, unit * WAVE) == 160


def test_of_a_ramp_it_is_a_tenth():
    assert theiler_window(None, np.arange(100.0)) == 10


def test_where_the_mean_is_crossed_often_it_is_when_the_series_has_forgotten():
    # The autocorrelation of a wave in noise is that of the wave, which is 0 at a quarter of it.
    noise = np.random.default_rng(2).normal(size=8000)
    x = np.sin(2 * np.pi * np.arange(8000) / 400) + noise
    assert 2 * 8000 / np.count_nonzero((x[:-1] <= 0) & (x[1:] > 0)) < 20
    assert theiler_window(None, x) == pytest.approx(100, abs=5)


def test_of_intervals_it_spans_two_orbits():
    # Roessler fires about six times an orbit: with S = x + 20, threshold 20, period 5.9.
    assert theiler_window(None, firing.intervals("rossler", 2000, 1)) == pytest.approx(12, abs=2)


def test_nothing_is_followed_across_a_gap():
    x = np.tile([0.0, 0.0, 1.0, 1.0], 100)  # a rise every four
    # Cut in the middle of a rise, and that rise is not one.
    broken = np.concatenate((x[:202], [np.nan], x[202:]))
    assert theiler_window(None, x) == 8
    assert theiler_window(None, broken) == 2 * 400 // 99


def test_it_is_given_before_all_else():
    assert theiler_window(7, WAVE) == 7


def test_all_go_by_it():
    x = naive_reconstruct_embed.henon(600)
    expected = theiler_window(None, x)
    assert impactsig.correlation_sum(x, 2).theiler == expected
    assert impactsig.correlation_dimension(x, 2).theiler == expected
    assert impactsig.lyapunov_exponent(x, dimension=2).theiler == expected
    assert impactsig.false_nearest_neighbors(x, 2).theiler == expected
    assert impactsig.averaged_false_neighbors(x, 2).theiler == expected


def test_intervals_of_a_run_with_gaps_have_it_too():
    impacts = with_gaps(2 + naive_reconstruct_embed.henon(600), [200])
    assert isinstance(impacts, Impacts)
    expected = theiler_window(None, 2 + naive_reconstruct_embed.henon(600))
    assert impactsig.correlation_sum(impacts, 2).theiler == pytest.approx(expected, abs=1)
