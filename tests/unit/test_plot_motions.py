"""Figures of motions: the line breaks where the velocity jumps, and stops stand where they are."""

from __future__ import annotations

import math

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from matplotlib import pyplot
from matplotlib.figure import Figure

from impactsig import (
    BaseMotion,
    Force,
    InvalidInput,
    Oscillator,
    Rigid,
    Stop,
    plot,
    scenes,
    simulate,
)

FAMILY = [plot.phase_portrait, plot.time_history, plot.power_spectrum]


@pytest.fixture(scope="module")
def periodic():
    return simulate(scenes.karpodinis(22.1), periods=60, transient=500)


@pytest.fixture(scope="module")
def sticking():
    return simulate(scenes.okolewski(3, 0.6), periods=60, transient=200)


def line_of(ax):
    """The first line drawn."""
    return np.stack(ax.lines[0].get_data())


def dashes_of(ax):
    """Ends of the vertical lines drawn by `vlines`."""
    return [np.asarray(path) for one in ax.collections for path in one.get_segments()]


@pytest.mark.parametrize("paint", FAMILY)
@pytest.mark.parametrize(
    "scene",
    [
        scenes.karpodinis(20.1),
        scenes.okolewski(3, 0.6, "soft"),
        scenes.tian(0.8, 0.8),
        scenes.begley_virgin(0.88, (-1.86, 1.75), 0),
    ],
    ids=lambda scene: scene.name,
)
def test_each_draws_any_scene_on_the_axes_it_is_given(paint, scene, ax):
    motion = simulate(scene, periods=40)
    assert paint(motion, ax=ax) is ax
    ax.figure.canvas.draw()
    assert ax.get_xlabel()
    assert ax.get_ylabel()


@pytest.mark.parametrize("paint", FAMILY)
def test_without_axes_a_new_figure_is_made(paint, periodic):
    before = set(pyplot.get_fignums())
    ax = paint(periodic)
    assert set(pyplot.get_fignums()) - before == {ax.figure.number}
    pyplot.close(ax.figure)


@pytest.mark.parametrize("paint", FAMILY)
def test_counts_alone_cannot_be_drawn(paint, ax):
    with pytest.raises(InvalidInput, match="keep"):
        paint(simulate(scenes.karpodinis(), periods=40, keep="counts"), ax)


@pytest.mark.parametrize("paint", [plot.phase_portrait, plot.time_history])
@pytest.mark.parametrize("span", [{"start": 1e9}, {"stop": 0.0}, {"start": math.nan}])
def test_a_span_outside_the_motion_is_refused(paint, span, periodic, ax):
    with pytest.raises(InvalidInput, match="start"):
        paint(periodic, ax, **span)


# -- the phase portrait ----------------------------------------------------------------------


def test_the_line_breaks_at_a_rigid_stop_and_dashes_span_the_jump(periodic, ax):
    periodic.plot(ax)
    x, v = line_of(ax)
    hits = periodic.impacts.time
    shown = hits[hits > periodic.stop - 50 / 22.1]
    assert np.isnan(x).sum() == len(shown)
    # Between two neighbouring points of the unbroken line nothing jumps.
    assert np.nanmax(np.abs(np.diff(v))) < 0.05
    (dashed,) = dashes_of(ax)
    np.testing.assert_allclose(dashed[:, 0], 1.0)
    speed = 0.5810258993557  # of Shaw and Holmes' orbit
    np.testing.assert_allclose(dashed[:, 1], [-0.2 * speed, speed], atol=1e-6)


def test_a_soft_stop_breaks_nothing(ax):
    simulate(scenes.tian(0.8, 0.8), periods=60, transient=100).plot(ax)
    x, v = line_of(ax)
    assert x.max() > 1.0  # it goes into the stop
    assert np.isfinite(x).all()
    assert np.abs(np.diff(v)).max() < 0.2
    assert not dashes_of(ax)


def test_stops_are_drawn_where_they_stand(ax):
    plot.phase_portrait(
        simulate(scenes.begley_virgin(0.88, (-1.86, 1.75), 0), periods=60), ax, phase=None
    )
    stops = ax.lines[1:]
    assert sorted(line.get_xdata()[0] for line in stops) == [-1.86, 1.75]
    assert {line.get_linestyle() for line in stops} == {"--"}
    low, high = ax.get_xlim()
    shades = sorted((patch.get_x(), patch.get_x() + patch.get_width()) for patch in ax.patches)
    np.testing.assert_allclose(shades, [[low, -1.86], [1.75, high]])


def test_a_stop_out_of_reach_does_not_squeeze_the_motion(ax):
    machine = Oscillator(damping=0.2, forces=Force(0.7, 1.7), stops=Stop(50, Rigid(0.5)))
    simulate(machine, periods=60, transient=100).plot(ax)
    assert ax.get_xlim()[1] < 1


def test_moving_stops_are_at_rest_in_their_own_coordinates(sticking, ax):
    sticking.plot(ax)
    x, _ = line_of(ax)
    assert np.nanmin(x) == pytest.approx(0, abs=1e-9)
    assert "base" in ax.get_xlabel()
    for path in dashes_of(ax):
        np.testing.assert_allclose(path[:, 0], 0, atol=1e-9)
        assert path[0, 1] < 0 < path[1, 1]


@pytest.mark.parametrize("phase", [0.0, 1.3])
def test_once_a_period_is_the_stroboscopic_section(periodic, phase, ax):
    plot.phase_portrait(periodic, ax, phase=phase)
    label = "once a period" + f", at phase {phase:g}" * bool(phase)
    (points,) = (line for line in ax.lines if line.get_label() == label)
    x, v = periodic.stroboscopic(phase)
    drawn = np.stack(points.get_data())
    assert abs(drawn.shape[1] - len(x)) <= 1  # a period's end may be in or out by rounding
    np.testing.assert_allclose(drawn, np.broadcast_to([x[:1], v[:1]], drawn.shape), atol=1e-6)


def test_the_base_is_followed_at_any_frequency_and_phase(ax):
    """Where it is not the reference, its phase depends on what the reference began at."""
    machine = Oscillator(
        damping=0.2,
        forces=Force(0.6, 0.9),
        base=BaseMotion(0.3, 0.9 * math.sqrt(2), 0.4, stops=True),
        stops=Stop(0.5, Rigid(0.6)),
    )
    motion = simulate(machine, periods=100, phase=2.0)
    assert motion.impact_count > 20
    motion.plot(ax)
    x, _ = line_of(ax)
    assert np.nanmax(x) == pytest.approx(0.5, abs=1e-6)
    for path in dashes_of(ax):
        np.testing.assert_allclose(path[:, 0], 0.5, atol=1e-6)


# -- the time history ------------------------------------------------------------------------


def test_impacts_and_sticks_are_marked_in_their_span(sticking, ax):
    start, stop = sticking.start + 20, sticking.stop - 7
    plot.time_history(sticking, ax, start=start, stop=stop)
    hits = sticking.impacts.time
    hits = hits[(hits >= start) & (hits <= stop)]
    (marks,) = (line for line in ax.lines if line.get_label() == f"{len(hits)} impacts")
    np.testing.assert_allclose(marks.get_xdata(), hits)
    # The stop is where the base is, a sin(eta t).
    np.testing.assert_allclose(marks.get_ydata(), 0.0025 * np.sin(3 * hits), atol=1e-10)
    shaded = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in ax.patches]
    sticks = np.clip(sticking.sticks, start, stop)
    np.testing.assert_allclose(shaded, sticks[sticks[:, 0] < sticks[:, 1]])


def test_the_line_is_the_displacement(periodic, ax):
    plot.time_history(periodic, ax)
    time, x = line_of(ax)
    inside = np.isfinite(time)
    np.testing.assert_allclose(x[inside], periodic.sample(time[inside])[0])
    assert time[0] == pytest.approx(periodic.stop - 10 / 22.1)
    assert time[-1] == pytest.approx(periodic.stop)


def test_a_moving_stop_moves(sticking, ax):
    plot.time_history(sticking, ax)
    stop = next(line for line in ax.lines[1:] if len(line.get_xdata()) > 1000)
    time, height = stop.get_data()
    np.testing.assert_allclose(height, 0.0025 * np.sin(3 * time), atol=1e-10)


def test_a_free_motion_is_drawn_too(ax):
    ball = Oscillator(stiffness=0, load=-1, stops=Stop(0, Rigid(0.9), "lower"))
    motion = simulate(ball, duration=8.0, initial=(1, 0))
    plot.time_history(motion, ax)
    plot.phase_portrait(motion, Figure().subplots())
    assert ax.lines[0].get_ydata().size > 100


def test_bouncing_that_will_not_end_is_drawn_by_its_last_impacts(ax):
    ball = Oscillator(stiffness=0, load=-1, stops=Stop(0, Rigid(1), "lower"))
    motion = simulate(ball, duration=0.1, initial=(0, 1e-6))
    assert motion.impact_count > 20_000
    plot.time_history(motion, ax)
    ax.figure.canvas.draw()
    assert ax.get_xlim()[0] == pytest.approx(motion.impacts.time[-5000])


# -- the spectrum ----------------------------------------------------------------------------


def test_the_spectrum_drawn_is_the_spectrum(ax):
    motion = simulate(scenes.karpodinis(20.1), periods=500, transient=100)
    spectrum = motion.power_spectrum("velocity", segments=4)
    assert spectrum.plot(ax) is ax
    frequency, density = line_of(ax)
    shown = (spectrum.frequency > 0) & (spectrum.frequency <= 10.5 * 20.1)
    np.testing.assert_allclose(frequency, spectrum.frequency[shown])
    np.testing.assert_allclose(density, spectrum.density[shown])
    assert ax.lines[1].get_xdata()[0] == pytest.approx(20.1)
    assert "x'" in ax.get_ylabel()


def test_the_highest_frequency_can_be_chosen(periodic, ax):
    plot.power_spectrum(periodic, ax, highest=50)
    assert ax.get_xlim() == (0, 50)
    with pytest.raises(InvalidInput, match="highest"):
        plot.power_spectrum(periodic, ax, highest=0)


def test_what_is_at_rest_has_no_power(ax):
    still = simulate(Oscillator(damping=0.1), duration=100.0)
    plot.power_spectrum(still, ax)
    assert "no power" in ax.texts[0].get_text()


def test_seconds_are_told_only_where_there_are_any(periodic, sticking):
    for motion, time, frequency, span in (
        (periodic, "time [s]", "frequency [Hz]", " s;"),
        (sticking, "time", "frequency", ";"),
    ):
        assert f" in {motion.duration:.6g}{span}" in repr(motion)
        long = plot.time_history(motion, Figure().subplots(), start=motion.start)
        assert long.get_xlabel() == time
        spectrum = plot.power_spectrum(motion, Figure().subplots())
        assert spectrum.get_xlabel() == frequency
        (forcing,) = spectrum.get_legend().get_texts()
        assert forcing.get_text().endswith("Hz") == (frequency == "frequency [Hz]")


def test_a_unit_of_time_is_told_in_seconds():
    assert not scenes.okolewski(3, 0.6).in_seconds
    assert scenes.okolewski(3, 0.6, time_unit=0.01).in_seconds
    assert scenes.okolewski(3, 0.6).in_units(time=0.01).in_seconds
    assert Oscillator().in_seconds
