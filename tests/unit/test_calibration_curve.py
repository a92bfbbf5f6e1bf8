"""The calibration curve of probabilities, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import InvalidInput, plot
from impactsig.plot.records._calibration_bins import calibration_bins


def test_bins_shares_and_scores():
    p = np.array([0.0, 0.1, 0.2, 0.5, 0.5, 0.9, 1.0])
    came = np.array([0, 0, 1, 1, 0, 1, 1], bool)
    found = calibration_bins(p, came)
    assert found.size.tolist() == [2, 1, 2, 0, 2]
    np.testing.assert_allclose(found.predicted, [0.05, 0.2, 0.5, np.nan, 0.95])
    np.testing.assert_allclose(found.observed, [0, 1, 0.5, np.nan, 1])
    assert found.brier == pytest.approx((0.01 + 0.64 + 0.25 + 0.25 + 0.01) / 7)
    assert found.constant == pytest.approx(4 / 7 * 3 / 7)


@pytest.mark.parametrize(
    ("hits", "of", "low", "high"),
    # Newcombe (1998), Statistics in Medicine 17, 857, table I, method 3
    [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_intervals_are_those_that_are_published(hits, of, low, high):
    found = calibration_bins(np.full(of, 0.5), np.arange(of) < hits, 1)
    assert found.low[0] == pytest.approx(low, abs=5e-5)
    assert found.high[0] == pytest.approx(high, abs=5e-5)


def test_the_figure_shows_what_was_counted():
    rng = np.random.default_rng(0)
    p = rng.random(400)
    came = rng.random(400) < p
    ax = plot.calibration_curve(p, came, label="honest")
    plot.calibration_curve(p, rng.random(400) < 0.5, ax, label="guessed")
    found = calibration_bins(p, came)
    drawn = ax.containers[0].lines[0]
    np.testing.assert_array_equal(drawn.get_xdata(), found.predicted)
    np.testing.assert_array_equal(drawn.get_ydata(), found.observed)
    assert np.all((found.low < found.predicted) & (found.predicted < found.high))
    words = [text.get_text() for text in ax.get_legend().get_texts()]
    assert words[0] == f"honest: Brier {found.brier:.3f} (constant {found.constant:.3f}), 400"
    assert len(ax.lines) - 1 == 2 * 3  # one diagonal, two curves with two caps each


def test_refusals():
    with pytest.raises(InvalidInput, match=r"probability: got 1\.5 at index 1"):
        plot.calibration_curve([0.5, 1.5], [True, False])
    with pytest.raises(InvalidInput, match="outcome: got bool of shape"):
        plot.calibration_curve([0.5, 0.5], [True])
    with pytest.raises(InvalidInput, match="outcome"):
        plot.calibration_curve([0.5, 0.5], [0.2, 1.0])
    with pytest.raises(InvalidInput, match="bins"):
        plot.calibration_curve([0.5], [True], bins=0)
