"""Figures of the choice of an embedding and of the exponent show what was found."""

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")


import impactsig
from tests import naive_reconstruct_embed as naive

NOISE = np.random.default_rng(5).normal(size=800)
HENON = naive.henon(800)
RESULTS = [
    lambda x: impactsig.embedding_delay(x, "1/e"),
    impactsig.embedding_delay,
    impactsig.false_nearest_neighbors,
    impactsig.averaged_false_neighbors,
    lambda x: impactsig.lyapunov_exponent(x, dimension=2),
]


@pytest.mark.parametrize("x", [NOISE, HENON, np.tile([1.0, 2.0, 4.0], 200) + 1e-3 * NOISE[:600]])
@pytest.mark.parametrize("result", RESULTS)
def test_every_result_draws_itself_where_told(result, x, ax):
    assert result(x).plot(ax) is ax
    ax.figure.draw_without_rendering()
    assert ax.lines


def test_the_fitted_line_has_the_slope_of_the_exponent(ax):
    found = impactsig.lyapunov_exponent(HENON, dimension=2, step=0.5)
    found.plot(ax)
    time, gap = ax.lines[-1].get_data()
    assert np.allclose(time, 0.5 * np.array(found.region))
    assert np.diff(gap) / np.diff(time) == pytest.approx(found.per_second)


def test_without_a_choice_the_figure_says_so(ax):
    impactsig.averaged_false_neighbors(NOISE, 4).plot(ax)
    assert ax.get_title(loc="left") == "no dimension"


def test_a_periodic_series_is_told_in_words(ax):
    impactsig.lyapunov_exponent(np.tile([1.0, 2.0], 200), dimension=1).plot(ax)
    assert "periodic" in ax.texts[0].get_text()
