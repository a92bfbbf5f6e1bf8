"""Figures of several trains: what is drawn is what was given, at one scale."""

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from matplotlib import pyplot
from matplotlib.figure import Figure

from impactsig import Impacts, InvalidInput, interval_histogram, plot

STEADY = Impacts.from_times(0.05 * np.arange(100))
SPREAD = np.random.default_rng(1).uniform(0.04, 0.06, 400)


def test_every_train_has_its_map_at_the_scale_of_all():
    figure = Figure()
    trains = {"steady": STEADY, "of $intervals": SPREAD, "one": [0.1], "far": [0.09, 0.01, 0.09]}
    panels = plot.return_maps({**trains, "again": STEADY}, figure=figure)
    figure.canvas.draw()
    assert [ax.get_title(loc="left") for ax in panels] == [
        "steady",
        r"of \$intervals",
        "one",
        "far",
        "again",
    ]
    assert len(figure.axes) == 5
    drawn = np.column_stack(panels[1].lines[-1].get_data())
    np.testing.assert_array_equal(drawn, np.column_stack((SPREAD[:-1], SPREAD[1:])))
    assert "Too few" in panels[2].texts[0].get_text()
    limits = {ax.get_xlim() + ax.get_ylim() for ax in (*panels[:2], *panels[3:])}
    assert len(limits) == 1
    low, high = panels[0].get_xlim()
    assert low < 0.01 < 0.09 < high
    assert panels[0].get_ylabel() == "interval $I_{k+1}$ [ms]"
    before = set(pyplot.get_fignums())
    plot.return_maps({"a": STEADY}, lag=2)
    (made,) = set(pyplot.get_fignums()) - before
    pyplot.close(made)
    with pytest.raises(InvalidInput, match="trains"):
        plot.return_maps({})


def test_every_column_is_the_density_of_its_train_and_stands_at_its_value():
    ax = Figure().subplots()
    trains = [STEADY, SPREAD, [], np.full(50, 0.0501)]
    assert plot.interval_densities(trains, [0.0, 1.0, 3.0, 4.0], "noise [%]", ax) is ax
    ax.figure.canvas.draw()
    (mesh,) = ax.collections
    shown = mesh.get_array().filled(0)
    corners = mesh.get_coordinates()
    np.testing.assert_allclose(corners[0, :, 0], [-0.5, 0.5, 2.0, 3.5, 4.5])
    edges = corners[:, 0, 1]
    widths = [np.diff(interval_histogram(x).edges)[0] for x in (STEADY, SPREAD, [0.0501] * 50)]
    np.testing.assert_allclose(np.diff(edges), np.median(widths), rtol=0.1)
    assert (edges[0], edges[-1]) == pytest.approx((SPREAD.min(), SPREAD.max()))
    for column, values in ((0, STEADY.intervals()), (1, SPREAD), (3, [0.0501] * 50)):
        count = np.histogram(values, edges)[0]
        np.testing.assert_allclose(shown[:, column], count / count.max())
    assert not shown[:, 2].any()
    assert ax.get_xlabel() == "noise [%]"
    assert ax.get_ylabel() == "interspike interval $I$ [ms]"


def test_trains_that_are_all_alike_share_one_bin():
    ax = plot.interval_densities([[0.05] * 9] * 3, [1, 2, 3], ax=Figure().subplots())
    assert ax.collections[0].get_array().shape == (1, 3)


def test_nothing_to_bin_is_said_in_words():
    ax = plot.interval_densities([[], []], [1, 2], ax=Figure().subplots())
    assert "No intervals" in ax.texts[0].get_text()


@pytest.mark.parametrize(
    ("trains", "parameter", "named"),
    [
        ([STEADY], [1.0], "trains"),
        ([STEADY, SPREAD], [1.0], "parameter"),
        ([STEADY, SPREAD], [2.0, 1.0], "parameter"),
        ([STEADY, SPREAD], [0.0, np.nan], "parameter"),
    ],
)
def test_what_cannot_be_drawn_is_named(trains, parameter, named):
    with pytest.raises(InvalidInput, match=named):
        plot.interval_densities(trains, parameter, ax=Figure().subplots())


@pytest.mark.parametrize(
    "paint",
    [
        plot.spike_train, plot.peak_against_time, plot.contact_against_interval,
        plot.interval_sequence,
    ],
)  # fmt: skip
def test_impacts_of_each_stop_have_a_colour(paint):
    time = np.cumsum(np.random.default_rng(1).uniform(0.03, 0.06, 40))
    stop = np.arange(40) % 2
    stop[7] = -1
    train = Impacts(time, peak=1.0 + stop, contact_time=np.full(40, 3e-4), stop_index=stop)
    ax = paint(train)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [
        "stop not known", "stop 0", "stop 1",
    ]  # fmt: skip
    one = paint(train[stop == 0])
    assert one.get_legend() is None
    pyplot.close("all")
