"""nolds behind checks: its answers where there are some, typed errors where there are none."""

import subprocess
import sys
import warnings

import numpy as np
import pytest

from impactsig import InvalidInput
from impactsig.errors import ImpactsigWarning
from impactsig.reconstruct import classic
from tests import naive_reconstruct_embed as naive

NOISE = np.random.default_rng(5).normal(size=2000)
HENON = naive.henon(1000)
MEASURES = {
    "lyap_r": lambda x: classic.lyap_r(x, dimension=2, theiler=5, steps=8),
    "lyap_e": lambda x: classic.lyap_e(x, dimension=3, matrix_dimension=2),
    "sampen": classic.sampen,
    "hurst_rs": classic.hurst_rs,
    "dfa": classic.dfa,
}


def test_the_exponents_of_henon():
    # The sum of both is ln 0.3.
    assert MEASURES["lyap_r"](HENON) == pytest.approx(0.4192, rel=0.05)
    found = MEASURES["lyap_e"](HENON)
    assert found[0] == pytest.approx(0.4192, rel=0.2)
    assert found.shape == (2,)


def test_the_exponent_is_per_unit_of_step():
    per_value = classic.lyap_r(HENON, dimension=2, theiler=5, steps=8)
    per_second = classic.lyap_r(HENON, dimension=2, theiler=5, steps=8, step=0.5)
    assert per_second == pytest.approx(2 * per_value)


def test_white_noise_has_no_memory():
    assert classic.hurst_rs(NOISE) == pytest.approx(0.5, abs=0.08)
    assert classic.dfa(NOISE) == pytest.approx(0.5, abs=0.08)
    assert classic.dfa(np.cumsum(NOISE)) == pytest.approx(1.5, abs=0.1)


def test_the_sample_entropy_of_noise_is_that_of_two_gaussian_values_being_close():
    # P(abs(a - b) < r) = erf(r/2) for values of variance 1.
    from scipy.special import erf

    tolerance = 0.3 * NOISE.std()
    found = classic.sampen(NOISE, tolerance=tolerance)
    assert found == pytest.approx(-np.log(erf(0.3 / 2)), rel=0.1)


@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize(
    "x",
    [
        [],
        HENON[:8],
        np.ones(400),
        np.where(np.arange(400) == 7, np.nan, HENON[:400]),
        HENON[:400].reshape(2, -1),
        "text",
    ],
)
def test_what_nolds_would_answer_silently_is_refused(measure, x):
    with pytest.raises(InvalidInput) as caught:
        MEASURES[measure](x)
    assert caught.value.argument == "x"


@pytest.mark.parametrize("measure", ["lyap_r", "lyap_e", "hurst_rs", "dfa"])
def test_a_series_that_recurs_has_no_scaling(measure):
    with pytest.raises(InvalidInput, match="recur after 2"):
        MEASURES[measure](np.tile([1.0, 2.0], 200))


@pytest.mark.parametrize("measure", ["lyap_r", "lyap_e"])
def test_gaps_of_rounding_are_warned_of(measure):
    with pytest.warns(ImpactsigWarning, match="different values in 1000"):
        MEASURES[measure](np.round(HENON, 1))


def test_vectors_of_which_none_are_alike_are_an_error():
    with pytest.raises(InvalidInput, match="sampen"):
        classic.sampen(NOISE[:50], tolerance=1e-9)


def test_dimensions_that_do_not_fit_are_refused():
    with pytest.raises(InvalidInput, match="multiple of 3"):
        classic.lyap_e(HENON, dimension=9, matrix_dimension=4)


def test_nolds_is_loaded_only_when_asked_for():
    code = "import impactsig.reconstruct, sys; sys.exit('nolds' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_nothing_is_said_on_the_way():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        classic.dfa(NOISE[:200])
