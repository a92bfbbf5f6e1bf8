"""Figures of surrogates, prediction and recurrence: what is drawn is what was found."""

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from matplotlib.figure import Figure

from impactsig import prediction_error, recurrence_plot, surrogate_test

X = np.random.default_rng(2).random(150)


def test_the_data_stand_among_their_surrogates():
    result = surrogate_test(X, count=39, seed=1)
    ax = result.plot(ax=Figure().subplots())
    ax.figure.canvas.draw()
    assert sum(bar.get_height() for bar in ax.patches) == 39
    (line,) = ax.lines
    assert line.get_xdata()[0] == result.statistic
    low, high = ax.get_xlim()
    assert low < min(result.statistic, result.surrogates.min())
    assert high > max(result.statistic, result.surrogates.max())
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels[0] == "39 autoregressive surrogates"
    assert ax.get_xlabel() == result.name == "prediction error over that of linear prediction"


def test_surrogates_that_are_all_alike_can_be_drawn():
    result = surrogate_test(X, np.max, surrogates="shuffled", count=19, seed=1)
    assert result.deviation is None
    result.plot(ax=Figure().subplots()).figure.canvas.draw()


def test_errors_are_drawn_in_the_order_of_their_horizons():
    result = prediction_error(X, 2, horizon=[5, 1, 3])
    ax = result.plot(ax=Figure().subplots())
    np.testing.assert_array_equal(ax.lines[-1].get_xdata(), [1, 3, 5])
    np.testing.assert_array_equal(ax.lines[-1].get_ydata(), result.error[[1, 2, 0]])
    assert ax.lines[0].get_ydata() == [1, 1]


@pytest.mark.parametrize("count", [40, 1001, 2000])
def test_recurrences_are_where_they_belong(count):
    x = np.zeros(count)
    x[: count // 4] = 1
    result = recurrence_plot(x, radius=0.5)
    ax = result.plot(ax=Figure().subplots())
    ax.figure.canvas.draw()
    (image,) = ax.images
    shown = np.asarray(image.get_array())
    assert max(shown.shape) <= 1000
    low, high, _, _ = image.get_extent()
    block = (high - low) / len(shown)
    assert block == max(1, -(-count // 1000))
    quarter = int(count // 4 / block)
    assert shown[quarter - 2, quarter - 2] == 1
    assert shown[quarter - 2, quarter + 2] == 0
    assert shown[-1, -1] == 1
    assert ax.get_xlim() == (-0.5, count - 0.5)
