"""Figures: what is drawn is what was measured, in SI units, and nothing empty crashes."""

import itertools
from dataclasses import replace

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from matplotlib import pyplot
from matplotlib.figure import Figure

from impactsig import Impacts, InvalidInput, Recording, interval_histogram, plot
from impactsig.plot import axes as _axes
from impactsig.plot.comparison import _common_edges

RATE = 50_000.0
TOUCH, CONTACT = np.array([0.01, 0.03, 0.06]), np.array([3e-4, 2e-4, 4e-4])
PEAK = np.array([1.0, 0.5, 2.0])


@pytest.fixture
def recording():
    """Half-sine pulses on a silent line."""
    t = np.arange(5000) / RATE
    samples = np.zeros(len(t))
    for touch, contact, peak in zip(TOUCH, CONTACT, PEAK, strict=True):
        u = (t - touch) / contact
        samples += peak * np.where((u > 0) & (u < 1), np.sin(np.pi * np.clip(u, 0, 1)), 0)
    return Recording(samples, RATE, "V", "load cell")


@pytest.fixture
def impacts():
    return Impacts(
        TOUCH,
        contact_time=CONTACT,
        peak=PEAK,
        duration=0.1,
        start=0.0,
        unit="V",
        threshold=0.2,
        contact_level=0.0,
        sensor="force",
    )


REASON = "the strongest response is 1.1e+03 N, below 5 $\\sigma$ of the noise of this recording"
EMPTY = Impacts.from_times([], start=0.0, duration=1.0, reason=REASON)
FAMILY = [
    plot.spike_train,
    plot.interval_sequence,
    plot.return_map,
    plot.histogram,
    plot.contact_against_interval,
    plot.peak_against_time,
]


def drawn(ax):
    """All points of all lines."""
    return np.concatenate([np.column_stack(line.get_data()) for line in ax.lines])


def render(ax):
    ax.figure.canvas.draw()
    return [label.get_text() for label in ax.get_xticklabels()]


# -- the family ------------------------------------------------------------------------------


@pytest.mark.parametrize("paint", FAMILY)
def test_each_figure_draws_on_the_axes_it_is_given_and_names_units(paint, impacts, ax):
    assert paint(impacts, ax=ax) is ax
    render(ax)
    label = ax.get_xlabel() + ax.get_ylabel()
    assert "[s]" in label or "[ms]" in label


@pytest.mark.parametrize("paint", FAMILY)
def test_without_axes_a_new_figure_is_made(paint, impacts):
    before = set(pyplot.get_fignums())
    ax = paint(impacts)
    assert set(pyplot.get_fignums()) - before == {ax.figure.number}
    pyplot.close(ax.figure)


@pytest.mark.parametrize("paint", FAMILY)
@pytest.mark.parametrize("count", [0, 1])
def test_too_few_impacts_are_explained_in_words_or_drawn(paint, count, ax):
    few = Impacts.from_times(
        np.full(count, 0.5),
        start=0.0,
        duration=1.0,
        contact_time=[1e-3] * count,
        peak=[1.0] * count,
    )
    paint(few, ax=ax)
    render(ax)
    alone = count == 1 and paint in (plot.spike_train, plot.peak_against_time)
    assert bool(ax.texts) is not alone
    assert all(text.get_text() for text in ax.texts)


def test_the_reason_for_no_impacts_is_shown_and_its_dollars_are_not_a_formula(ax):
    plot.spike_train(EMPTY, ax)
    assert ax.texts[0].get_text().replace("\n", " ") == REASON.replace("$", "\\$")
    render(ax)


@pytest.mark.parametrize("paint", [plot.contact_against_interval, plot.peak_against_time])
def test_what_was_not_measured_cannot_be_drawn(paint, ax):
    with pytest.raises(InvalidInput, match="impacts"):
        paint(Impacts.from_times([0.1, 0.2, 0.4]), ax)


# -- the numbers -----------------------------------------------------------------------------


def test_intervals_are_drawn_in_seconds_where_they_end(impacts, ax):
    plot.interval_sequence(impacts, ax)
    np.testing.assert_allclose(drawn(ax), [[0.03, 0.02], [0.06, 0.03]])
    assert ax.get_ylabel() == "interspike interval [ms]"


def test_no_interval_is_drawn_across_a_gap(ax):
    split = Impacts.from_times([0.0, 1.0, 5.0, 6.5], gaps=[[2.0, 4.0]], contact_time=[1, 2, 3, 4])
    plot.interval_sequence(split, ax)
    np.testing.assert_allclose(drawn(ax), [[1.0, 1.0], [6.5, 1.5]])
    other = Figure().subplots()
    plot.contact_against_interval(split, other)
    np.testing.assert_allclose(drawn(other), [[1.0, 2.0], [1.5, 4.0]])


def test_return_map_pairs_each_interval_with_the_next(ax):
    plot.return_map([1.0, 2.0, 4.0, 3.0], lag=2, ax=ax)
    np.testing.assert_allclose(np.column_stack(ax.lines[-1].get_data()), [[1.0, 4.0], [2.0, 3.0]])
    assert ax.get_ylabel() == "interval $I_{k+2}$ [s]"
    low, high = ax.get_xlim()
    assert low < 1.0
    assert high > 4.0


def test_a_perfect_period_is_not_drawn_at_the_scale_of_rounding(ax):
    plot.return_map(Impacts.from_times(np.arange(50) * 0.1), ax=ax)
    low, high = ax.get_xlim()
    assert high - low >= 0.003


def test_histogram_draws_the_density_it_is_given(ax):
    rng = np.random.default_rng(3)
    result = interval_histogram(rng.uniform(0.01, 0.02, 500), bins=10)
    plot.histogram(result, ax)
    values, edges, _ = ax.patches[0].get_data()
    assert float(np.sum(values * np.diff(edges))) == pytest.approx(1.0)
    assert ax.get_ylabel() == "density $p(I)$ [1/s]"


def test_peaks_carry_the_unit_of_the_run(impacts, ax):
    plot.peak_against_time(impacts, ax)
    np.testing.assert_allclose(drawn(ax), np.column_stack((TOUCH, PEAK)))
    assert ax.get_ylabel() == "peak [V]"


# -- the waveform ----------------------------------------------------------------------------


def test_three_million_samples_are_reduced_and_no_spike_is_lost(ax):
    samples = np.zeros(3_000_000, np.float32)
    samples[1_234_567], samples[2_000_001] = 5.0, -7.0
    plot.waveform(Recording(samples, RATE), ax=ax)
    line = drawn(ax)
    assert len(line) <= 4000
    assert (line[:, 1].max(), line[:, 1].min()) == (5.0, -7.0)
    where = line[np.argmax(line[:, 1]), 0]
    assert where == pytest.approx(1_234_567 / RATE, abs=len(samples) / RATE / 2000)


def test_every_impact_is_marked_at_the_height_of_its_pulse(recording, impacts, ax):
    plot.waveform(recording, impacts, ax)
    marks = np.column_stack(ax.lines[-1].get_data())
    np.testing.assert_allclose(marks[:, 0], TOUCH)
    # Between samples the half-sine stays within 1 - cos(pi / 2 n) of its peak, n >= 10 a pulse.
    np.testing.assert_allclose(marks[:, 1], PEAK, rtol=0.05)


def test_a_negative_pulse_is_marked_below(recording, impacts, ax):
    plot.waveform(recording.calibrate(scale=-1), impacts, ax)
    np.testing.assert_allclose(ax.lines[-1].get_ydata(), -PEAK, rtol=0.05)


def test_a_weak_pulse_on_a_drifting_line_is_marked_at_its_top(impacts, recording, ax):
    drifting = replace(recording, samples=0.2 * recording.samples - 5 * (recording.time > 0.02))
    plot.waveform(drifting, replace(impacts, settings={"polarity": "positive"}), ax)
    np.testing.assert_allclose(ax.lines[-1].get_ydata(), 0.2 * PEAK - [0, 5, 5], atol=0.02)


def test_a_span_shows_its_own_impacts_only(recording, impacts, ax):
    plot.waveform(recording, impacts, ax, start=0.02, stop=0.05)
    np.testing.assert_allclose(ax.lines[-1].get_xdata(), [0.03])
    assert ax.lines[0].get_xdata()[0] == pytest.approx(0.02)


def test_every_channel_has_its_line_and_hostile_names_are_plain(ax):
    both = Recording(np.ones((100, 2)), 100.0, ("V", "g"), ("$\\frac{", "a" * 200))
    plot.waveform(both, ax=ax)
    labels = [line.get_label() for line in ax.lines]
    assert labels == [r"\$\frac{", "a" * 45 + "..."]
    render(ax)


def test_missing_samples_leave_a_hole(ax):
    samples = np.sin(np.arange(100_000.0))
    samples[40_000:50_000] = np.nan
    samples[50_001] = 9.0
    found = Impacts.from_times([0.1, 0.9], start=0.0, duration=2.0)
    plot.waveform(Recording(samples, RATE), found, ax)
    assert np.isnan(drawn(ax)[:, 1]).any()
    assert np.nanmax(drawn(ax)[:, 1]) == 9.0
    assert np.isfinite(ax.lines[-1].get_ydata()).all()
    render(ax)


def test_an_empty_recording_says_so(ax):
    plot.waveform(Recording(np.empty(0), RATE), ax=ax)
    assert "no samples" in ax.texts[0].get_text()


# -- one pulse -------------------------------------------------------------------------------


def test_a_pulse_shows_its_levels_and_its_contact(recording, impacts, ax):
    plot.pulse(recording, impacts, 1, ax)
    levels = {
        line.get_label(): line.get_ydata()[0] for line in ax.lines if len(line.get_ydata()) == 2
    }
    assert levels["threshold 0.2 V"] == pytest.approx(0.2)
    assert "contact level 0 V" not in levels
    shade = ax.patches[0].get_extents().transformed(ax.transData.inverted())
    assert (shade.x0, shade.x1) == pytest.approx((0.0, 2e-4), abs=1e-9)
    assert any(text.get_text() == "contact 0.200 ms" for text in ax.texts)
    assert ax.get_xlabel() == "time since 0.030000 s [ms]"


def test_levels_of_a_negative_pulse_lie_below_its_baseline(recording, impacts, ax):
    plot.pulse(recording.calibrate(scale=-1, offset=3.0), impacts, -1, ax)
    heights = [line.get_ydata()[0] for line in ax.lines if line.get_label().startswith("threshold")]
    assert heights == [pytest.approx(2.8)]


@pytest.mark.parametrize("index", [3, -4])
def test_there_is_no_such_pulse(recording, impacts, index):
    with pytest.raises(InvalidInput, match=r"index: got -?\d; required: from -3 to 2"):
        plot.pulse(recording, impacts, index, Figure().subplots())


def test_a_pulse_needs_one_channel(impacts, ax):
    with pytest.raises(InvalidInput, match="one channel"):
        plot.pulse(Recording(np.zeros((5000, 2)), RATE), impacts, 0, ax)


# -- ticks -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "factor", "labels"),
    [
        ([0.0, 0.005, 0.01], 1e3, ["0", "5", "10"]),
        ([-0.25, 0.0, 0.25], 1.0, ["−0.25", "0.00", "0.25"]),
        ([12.3455, 12.346, 12.3465], 1.0, ["12.3455", "12.3460", "12.3465"]),
    ],
)
def test_ticks_have_the_digits_they_need(values, factor, labels):
    assert _axes.PrefixFormatter(factor).format_ticks(values) == labels


@pytest.mark.parametrize(
    ("largest", "unit"),
    [(60.0, "s"), (1.0, "s"), (0.05, "ms"), (3e-4, "ms"), (5e-5, "µs"), (0.0, "s")],
)
def test_times_come_in_the_prefix_that_reads_best(largest, unit, ax):
    _axes.seconds(ax.xaxis, "time", [0.0, largest])
    assert ax.get_xlabel() == f"time [{unit}]"


@pytest.mark.parametrize("decades", [0.5, 0.8, 1.2, 1.9, 3.0])
def test_labels_of_a_logarithmic_axis_do_not_overlap(decades):
    figure = pyplot.figure(figsize=(4.0, 3.0))
    ax = figure.subplots()
    ax.plot([2e-5, 2e-5 * 10**decades], [1.0, 2.0])
    _axes.logarithmic(ax)
    figure.canvas.draw()
    shown = [one for one in ax.xaxis.get_ticklabels(which="both") if one.get_text()]
    low, high = ax.get_xlim()
    spans = sorted(
        (box.x0, box.x1)
        for one in shown
        if low <= one.get_position()[0] <= high
        for box in [one.get_window_extent()]
    )
    assert len(spans) >= 2
    assert all(before[1] <= after[0] for before, after in itertools.pairwise(spans))
    pyplot.close(figure)


def test_histograms_of_two_alike_trains_have_no_bin_for_what_differs():
    intervals = np.random.default_rng(1).exponential(0.05, 56) + 0.003
    alike = intervals + 1e-6 * np.random.default_rng(2).standard_normal(56)
    for pair in ([intervals, alike], [alike, intervals]):
        edges = _common_edges(pair)
        assert edges[0] == pytest.approx(np.min(pair))  # the bin before it would begin below zero
        assert edges[-1] == pytest.approx(np.max(pair))
        assert np.all(np.diff(edges) > 0)
    edges = _common_edges([intervals, 0.1 * intervals])
    assert 0 <= edges[0] <= 0.1 * intervals.min()
