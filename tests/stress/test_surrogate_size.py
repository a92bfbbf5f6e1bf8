"""How often the surrogate test rejects where it should not, and where it should."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from impactsig import surrogate_test
from tests import firing

PROCESSES = {
    "first order": (lambda x: x, [1, -0.8]),
    "second order": (lambda x: x, [1, -1.5, 0.8]),
    "first order, lognormal": (lambda x: np.exp(0.5 * x), [1, -0.8]),
    "second order, cubed": (lambda x: x**3, [1, -1.5, 0.8]),
    "second order, two groups": (lambda x: x + 30 * np.sign(x), [1, -1.5, 0.8]),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("statistic", "count"), [("prediction_error", 19), ("time_reversal_asymmetry", 39)]
)
@pytest.mark.parametrize("process", PROCESSES)
def test_one_linear_process_in_twenty_is_rejected(process, statistic, count):
    """Between 3 and 7 % of 1000 realisations; the standard error is 0.7 %."""
    function, recursion = PROCESSES[process]
    rejected = 0
    for run in range(1000):
        noise = np.random.default_rng([77, run]).standard_normal(556)
        x = function(lfilter([1], recursion, noise)[300:])
        rejected += surrogate_test(x, statistic, count=count, seed=run).rejected
    assert 30 <= rejected <= 70


@pytest.mark.slow
@pytest.mark.parametrize("flow", ["rossler", "lorenz"])
def test_nine_of_ten_series_of_a_thousand_intervals_are_rejected(flow):
    rejected = sum(
        surrogate_test(firing.intervals(flow, 1000, seed), count=19, seed=seed).rejected
        for seed in range(100)
    )
    assert rejected >= 90
