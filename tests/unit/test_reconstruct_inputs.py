"""Whatever is given to be reconstructed: a typed error that names it, or an answer that says why.

One battery for every function that takes a series. Those that tell of what is odd in an answer are
held to a word of it; the others must refuse.
"""

from functools import cache

import numpy as np
import pandas as pd
import pytest

import impactsig
from impactsig import Impacts, InvalidInput
from impactsig.reconstruct import classic
from tests import naive_reconstruct_embed as naive

X = 2 + naive.henon(600)
FUNCTIONS = {
    "delay_embed": lambda x: impactsig.delay_embed(x, 2),
    "correlation_sum": lambda x: impactsig.correlation_sum(x, 3),
    "correlation_dimension": impactsig.correlation_dimension,
    "lyapunov_exponent": lambda x: impactsig.lyapunov_exponent(x, dimension=2),
    "lyapunov_exponent, kantz": lambda x: impactsig.lyapunov_exponent(
        x, dimension=2, method="kantz"
    ),
    "embedding_delay, 1/e": lambda x: impactsig.embedding_delay(x, "1/e"),
    "embedding_delay": impactsig.embedding_delay,
    "ordinal_patterns": impactsig.ordinal_patterns,
    "false_nearest_neighbors": lambda x: impactsig.false_nearest_neighbors(x, 3),
    "averaged_false_neighbors": lambda x: impactsig.averaged_false_neighbors(x, 3),
    "prediction_error": lambda x: impactsig.prediction_error(x, 2),
    "time_reversal_asymmetry": impactsig.time_reversal_asymmetry,
    "recurrence_plot": lambda x: impactsig.recurrence_plot(x, radius=0.1),
    "recurrence_quantification": lambda x: impactsig.recurrence_quantification(x, radius=0.1),
    "surrogates": lambda x: impactsig.surrogates(x, 2, seed=1),
    "surrogate_test": lambda x: impactsig.surrogate_test(x, count=19, seed=1),
    "return_map_determinism": lambda x: impactsig.return_map_determinism(x, count=19, seed=1),
    "lyap_r": lambda x: classic.lyap_r(x, dimension=2),
    "lyap_e": lambda x: classic.lyap_e(x, dimension=4),
    "sampen": classic.sampen,
    "hurst_rs": classic.hurst_rs,
    "dfa": classic.dfa,
}
every = pytest.mark.parametrize("name", FUNCTIONS)

NO_SERIES = {
    "nan": np.where(np.arange(600) == 7, np.nan, X),
    "infinite": np.where(np.arange(600) == 7, np.inf, X),
    "two-dimensional": X.reshape(2, -1),
    "a number": np.float64(3.0),
    "complex": X + 0j,
    "words": ["a"] * 600,
    "switches": X > 2,
    "instants": np.arange(600).astype("datetime64[s]"),
    "empty": [],
    "none": None,
    "no impacts": Impacts([]),
    "one impact": Impacts([1.0]),
}


@every
@pytest.mark.parametrize("kind", NO_SERIES)
def test_what_is_no_series_is_refused_by_name(name, kind):
    with pytest.raises(InvalidInput) as caught:
        FUNCTIONS[name](NO_SERIES[kind])
    assert caught.value.argument == "x"


FEW = X[:300]
WHOLE = np.round(9000 * FEW)  # to be told from its neighbours
KINDS = {
    "list": FEW.tolist,
    "tuple": lambda: tuple(FEW),
    "Series": lambda: pd.Series(FEW, index=np.arange(300)[::-1]),
    "objects": lambda: FEW.astype(object),
    "strided": lambda: np.repeat(FEW, 2)[::2],
    "read-only": lambda: np.frombuffer(FEW.tobytes()),
}


def told(result):
    """What can be compared of a result: its numbers and its words."""
    if isinstance(result, (float, np.ndarray)):
        return result
    return result.describe()


@cache
def expected(name, whole):
    return told(FUNCTIONS[name](WHOLE if whole else FEW))


@every
@pytest.mark.parametrize("kind", KINDS)
def test_any_series_of_numbers_will_do(name, kind):
    found = told(FUNCTIONS[name](KINDS[kind]()))
    np.testing.assert_array_equal(found, expected(name, whole=False))


@every
@pytest.mark.parametrize("kind", [np.int64, np.int16, np.float32])
def test_the_kind_of_number_does_not_matter(name, kind):
    found = told(FUNCTIONS[name](WHOLE.astype(kind)))
    np.testing.assert_array_equal(found, expected(name, whole=True))


@every
def test_impacts_stand_for_their_intervals(name):
    impacts = Impacts(np.cumsum(np.append(0.0, FEW)))
    found = told(FUNCTIONS[name](impacts))
    if name.startswith("lyapunov"):  # which also knows their time
        assert "per second" in found
        return
    np.testing.assert_array_equal(found, told(FUNCTIONS[name](impacts.intervals())))


FLAGGED_CONSTANT = {
    "correlation_dimension": "constant",
    "ordinal_patterns": "constant",
    "recurrence_quantification": "constant",
    "recurrence_plot": "1 of the pairs",
    "delay_embed": None,
}


@every
@pytest.mark.parametrize("value", [2.0, 0.0, 0.1, 1e300])
def test_a_constant_is_refused_or_named(name, value):
    x = np.full(600, value)
    if name not in FLAGGED_CONSTANT:
        with pytest.raises(InvalidInput) as caught:
            FUNCTIONS[name](x)
        assert caught.value.argument == "x"
    elif FLAGGED_CONSTANT[name]:
        assert FLAGGED_CONSTANT[name] in told(FUNCTIONS[name](x))


HUGE = {
    "overflow": 1e200 * X,
    "vanish": 1e-200 * X,
    "denormal": 1e-310 * X,
    "beyond": 1.7e308 * np.sin(np.arange(600)),
}
ANY_SIZE = {
    "delay_embed",
    "ordinal_patterns",
    "correlation_sum",
    "correlation_dimension",
    "recurrence_plot",
    "recurrence_quantification",
}


@every
@pytest.mark.parametrize("size", HUGE)
def test_numbers_that_cannot_be_squared_are_refused_or_right(name, size):
    if name in ANY_SIZE and (size != "beyond" or not name.startswith("correlation")):
        FUNCTIONS[name](HUGE[size])
        return
    with pytest.raises(InvalidInput, match=r"^x:.*in another unit") as caught:
        FUNCTIONS[name](HUGE[size])
    assert caught.value.argument == "x"


PERIOD = np.tile([1.0, 2.0, 4.0], 200)
OF_A_PERIOD = {
    "correlation_dimension": "dimension 0: the series is periodic",
    "lyapunov_exponent": "periodic: the values recur after 3, exponent 0",
    "lyapunov_exponent, kantz": "periodic: the values recur after 3, exponent 0",
    "embedding_delay": "no delay",
    "false_nearest_neighbors": "3 values only",
    "averaged_false_neighbors": "3 values only",
    "prediction_error": "0 standard deviations",
    "recurrence_quantification": "determinism 1",
    "surrogate_test": "the series is periodic",
    "return_map_determinism": "the series is periodic",
}
REFUSES_A_PERIOD = {"lyap_r", "lyap_e", "hurst_rs", "dfa"}


@every
def test_a_period_is_named_wherever_it_decides(name):
    if name in REFUSES_A_PERIOD:
        with pytest.raises(InvalidInput, match="recur after 3") as caught:
            FUNCTIONS[name](PERIOD)
        assert caught.value.argument == "x"
    elif name in OF_A_PERIOD:
        assert OF_A_PERIOD[name] in told(FUNCTIONS[name](PERIOD))


SAYS_ROUNDED = {
    "correlation_dimension": "values rounded to 0.1",
    "lyapunov_exponent": "different values in 600",
    "lyapunov_exponent, kantz": "different values in 600",
    "false_nearest_neighbors": "different values in 600",
    "averaged_false_neighbors": "different values in 600",
    "surrogate_test": "values are distinct",
    "return_map_determinism": "values are distinct",
}


@pytest.mark.parametrize("name", SAYS_ROUNDED)
def test_rounded_values_are_told(name):
    assert SAYS_ROUNDED[name] in told(FUNCTIONS[name](np.round(X, 1)))


@pytest.mark.parametrize("name", [name for name in SAYS_ROUNDED if "correlation" not in name])
def test_values_that_stand_twice_are_told(name):
    assert SAYS_ROUNDED[name][:10] in told(FUNCTIONS[name](np.repeat(X[:300], 2)))


WIDE = {
    "delay_embed": lambda x: impactsig.delay_embed(x, 7, 100),
    "correlation_sum": lambda x: impactsig.correlation_sum(x, 7, delay=100),
    "correlation_dimension": lambda x: impactsig.correlation_dimension(x, 7, delay=100),
    "lyapunov_exponent": lambda x: impactsig.lyapunov_exponent(x, dimension=7, delay=100),
    "false_nearest_neighbors": lambda x: impactsig.false_nearest_neighbors(x, 7, 100),
    "averaged_false_neighbors": lambda x: impactsig.averaged_false_neighbors(x, 7, 100),
    "prediction_error": lambda x: impactsig.prediction_error(x, 7, 100),
    "recurrence_plot": lambda x: impactsig.recurrence_plot(x, 7, 100, radius=1),
    "recurrence_quantification": lambda x: impactsig.recurrence_quantification(x, 7, 100, radius=1),
    "time_reversal_asymmetry": lambda x: impactsig.time_reversal_asymmetry(x, 600),
    "lyap_r": lambda x: classic.lyap_r(x, dimension=7, delay=100),
    "lyap_e": lambda x: classic.lyap_e(x, dimension=601, matrix_dimension=7),
    "sampen": lambda x: classic.sampen(x, dimension=7, delay=100),
    "correlation_sum, theiler": lambda x: impactsig.correlation_sum(x, 2, theiler=599),
    "correlation_dimension, theiler": lambda x: impactsig.correlation_dimension(x, 2, theiler=560),
    "lyapunov_exponent, theiler": lambda x: impactsig.lyapunov_exponent(
        x, dimension=2, theiler=300
    ),
    "false_nearest_neighbors, theiler": lambda x: impactsig.false_nearest_neighbors(
        x, 2, theiler=300
    ),
    "prediction_error, theiler": lambda x: impactsig.prediction_error(x, 2, theiler=300),
    "recurrence_quantification, theiler": lambda x: impactsig.recurrence_quantification(
        x, radius=1, theiler=599
    ),
    "lyap_r, theiler": lambda x: classic.lyap_r(x, dimension=2, theiler=300),
}


@pytest.mark.parametrize("name", WIDE)
def test_a_series_too_short_for_its_vectors_is_refused(name):
    with pytest.raises(InvalidInput, match=r"at (least|most)") as caught:
        WIDE[name](X)
    assert caught.value.argument in ("x", "theiler")


SHORTEST = {
    "delay_embed": 2,
    "ordinal_patterns": 3,
    "recurrence_plot": 1,
    "recurrence_quantification": 2,
}


@every
@pytest.mark.parametrize("count", [1, 2, 3, 5, 9])
def test_too_few_values_are_refused(name, count):
    x = X[:count]
    least = SHORTEST.get(name, {"correlation_sum": 4, "time_reversal_asymmetry": 2}.get(name, 10))
    if count >= least:
        FUNCTIONS[name](x)
        return
    with pytest.raises(InvalidInput) as caught:
        FUNCTIONS[name](x)
    assert caught.value.argument in ("x", "theiler")
