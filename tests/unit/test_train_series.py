"""Trains over a threshold or a noise level."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib import pyplot

from impactsig import (
    InvalidInput,
    fired_trains,
    flows,
    integrate_and_fire,
    measure,
    noisy_trains,
    plot,
    scenes,
    simulate,
    threshold_crossings,
)


@pytest.fixture(scope="module")
def motion():
    return simulate(scenes.karpodinis(22.1), periods=60, transient=400)


def test_noise_widens_the_intervals_of_the_same_train(motion):
    trains = noisy_trains(motion, seed=1)
    assert list(trains) == ["0 %", "0.247 %", "0.476 %", "0.96 %"]
    widths = [np.std(train.intervals()) for train in trains.values()]
    assert widths[0] < 1e-12
    assert np.all(np.diff(widths) > 0)
    alone = measure(motion, noise=0.00476, seed=1).impacts
    assert np.array_equal(trains["0.476 %"].time, alone.time)
    assert len(plot.return_maps(trains)) == 4
    pyplot.close("all")


def test_a_flow_fires_at_each_threshold():
    options = {"count": 40, "transient": 50}
    trains = fired_trains(flows.rossler(), [20, 40], **options)
    alone = integrate_and_fire(flows.rossler(), 40, **options)
    assert np.array_equal(trains["threshold 40"].time, alone.time)
    crossed = fired_trains(flows.rossler(), [1.0], kind="crossing", **options)
    alone = threshold_crossings(flows.rossler(), 1.0, **options)
    assert np.array_equal(crossed["threshold 1"].time, alone.time)


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda motion: noisy_trains(motion.impacts), "motion"),
        (lambda motion: noisy_trains(motion, [0.1, 0.1]), "noise"),
        (lambda motion: noisy_trains(motion, []), "noise"),
        (lambda motion: fired_trains(flows.rossler(), [20], kind="count"), "kind"),
        (lambda motion: fired_trains(flows.rossler(), 20), "thresholds"),
    ],
)
def test_bad_input_is_named(motion, call, argument):
    with pytest.raises(InvalidInput) as caught:
        call(motion)
    assert caught.value.argument == argument
