"""Figures of beams: what they draw is what the results say."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from matplotlib import pyplot

from impactsig import (
    BaseMotion,
    Cantilever,
    InvalidInput,
    Rigid,
    Stop,
    apparent_restitution,
    plot,
    simulate,
)

BEAM = Cantilever(0.2, 0.025, 1e-3, 210e9, 7850.0)


@pytest.fixture(scope="module")
def motions():
    shaken = BaseMotion(2e-4, 2 * math.pi * 22, stops=True)
    beam = replace(BEAM, stop=Stop(1e-3, Rigid(0.4)), forcing=shaken)
    return [simulate(replace(beam, modes=modes), periods=20) for modes in (1, 4)]


def test_tip_history_shows_tip_impacts_and_sticks(motions):
    motion = motions[1]
    start, stop = 0.4, 0.6
    ax = motion.plot(start=start, stop=stop)
    tip, slow, hits, stand = ax.get_lines()
    time, place = tip.get_data()
    assert (time[0], time[-1]) == (start, stop)
    assert place == pytest.approx(motion.sample(time)[0], abs=1e-15)
    assert slow.get_ydata() == pytest.approx(motion.modal(time)[0][:, 0], abs=1e-15)
    inside = motion.impacts.between(start, stop).time
    assert np.array_equal(hits.get_xdata(), inside)
    assert hits.get_label() == f"{len(inside)} impacts"
    assert stand.get_ydata()[0] == 1e-3
    held = (motion.sticks[:, 1] > start) & (motion.sticks[:, 0] < stop)
    assert len(ax.patches) == held.sum() > 0
    pyplot.close(ax.figure)
    with pytest.raises(InvalidInput, match="start, stop"):
        motion.plot(start=0.5, stop=0.4)
    with pytest.raises(InvalidInput, match="stop"):
        motion.plot(stop=100.0)


def test_restitution_is_drawn_as_a_slope(motions):
    result = apparent_restitution(motions[1])
    ax = result.plot()
    points, line, _zero = ax.get_lines()
    assert np.array_equal(points.get_xdata(), result.approach)
    assert np.array_equal(points.get_ydata(), -result.departure)
    x, y = line.get_data()
    assert y[1] / x[1] == pytest.approx(result.value)
    pyplot.close(ax.figure)


def test_restitution_over_modes_takes_any_order(motions):
    results = [apparent_restitution(motion) for motion in reversed(motions)]
    ax = plot.restitution_over_modes(results, label="one")
    plot.restitution_over_modes(results, ax, label="again")
    assert len(ax.containers) == 2
    x, y = ax.containers[0].lines[0].get_data()
    assert list(x) == [1, 4]
    assert list(y) == [results[1].value, results[0].value]
    colours = {container.lines[0].get_color() for container in ax.containers}
    assert len(colours) == 2
    pyplot.close(ax.figure)
    with pytest.raises(InvalidInput, match="results"):
        plot.restitution_over_modes([])
