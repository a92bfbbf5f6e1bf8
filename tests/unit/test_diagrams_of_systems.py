"""Diagrams of systems that are simulated whole: cantilevers, and oscillators under control."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from impactsig import (
    BaseMotion,
    Cantilever,
    Controlled,
    DelayedFeedback,
    InvalidInput,
    KelvinVoigt,
    Rigid,
    Stop,
    bifurcation_diagram,
    flows,
    periodicity_chart,
    response_spectrum,
    scenes,
)

DRAWN = (0.2, 0.025, 0.001, 210e9, 7850)
BEAM = Cantilever(*DRAWN, stop=Stop(1e-3, Rigid(0.6)), modes=1)


def shaken(frequency, beam=BEAM):
    return replace(beam, forcing=BaseMotion(2e-4, 2 * math.pi * frequency, stops=True))


def one_mode(frequency):
    return scenes.cantilever(
        *DRAWN, stop=1e-3, frequency=frequency, amplitude=2e-4, restitution=0.6
    )


def test_one_mode_has_the_diagram_of_its_oscillator():
    values = [19.5, 20.5, 21.5]
    look = {"periods": 40, "transient": 250, "exponents": True}
    found = bifurcation_diagram(shaken, values, **look)
    expected = bifurcation_diagram(one_mode, values, **look)
    np.testing.assert_array_equal(found.periods, expected.periods)
    np.testing.assert_array_equal(found.impacts, expected.impacts)
    assert list(found.periods) == [0, 1, 1]
    assert found.parameter == "frequency"
    for k in (1, 2):
        np.testing.assert_allclose(found.strobe[k], expected.strobe[k], atol=1e-9)
        np.testing.assert_allclose(found.velocity[k], expected.velocity[k], atol=1e-9)
        np.testing.assert_allclose(found.exponents[k], expected.exponents[k], rtol=1e-6)
        assert found.energy_per_period[k] == pytest.approx(expected.energy_per_period[k], rel=1e-8)
        assert found.impacts_per_period[k] == 1


def test_a_cantilever_has_its_modes():
    beam = replace(BEAM, modes=3, stop=Stop(1e-3, KelvinVoigt(2e4, 1.0)))
    found = bifurcation_diagram(
        lambda frequency: shaken(frequency, beam), [21.0], periods=4, transient=150, exponents=True
    )
    assert found.status == ("complete",)
    assert found.exponents.shape == (1, 6)
    assert np.isnan(found.energy_per_period[0])  # a soft stop keeps no account


def test_feedback_locks_over_its_gain():
    chaotic = scenes.karpodinis(20.3355)
    found = bifurcation_diagram(
        lambda gain: Controlled(chaotic, DelayedFeedback(gain, 1, limit=0.1)), [0.01, 0.15],
        periods=20, transient=500,
    )  # fmt: skip
    assert list(found.periods) == [0, 1]
    assert list(found.impacts) == [-1, 1]


def test_one_mode_has_the_response_and_the_chart_of_its_oscillator():
    values = [19.0, 20.5, 21.5]
    look = {"periods": 20, "transient": 250}
    found = response_spectrum(shaken, values, **look)
    expected = response_spectrum(one_mode, values, **look)
    closed = expected.periods > 0
    np.testing.assert_array_equal(found.periods, expected.periods)
    np.testing.assert_allclose(found.greatest[closed], expected.greatest[closed], rtol=1e-9)
    np.testing.assert_allclose(found.least[closed], expected.least[closed], rtol=1e-5)
    one = periodicity_chart(lambda f, r: shaken(f), values, [0.6], periods=250)
    other = periodicity_chart(lambda f, r: one_mode(f), values, [0.6], periods=250)
    np.testing.assert_array_equal(one.periods, other.periods)
    np.testing.assert_array_equal(one.impacts, other.impacts)


@pytest.mark.parametrize(
    ("scene", "options", "argument"),
    [
        (lambda a: flows.lorenz(), {}, "scene"),
        (lambda a: BEAM, {}, "scene"),  # not forced
        (lambda a: Controlled(flows.rossler(), DelayedFeedback(0.1, 5.9, signal="y")), {}, "scene"),
        (shaken, {"carry": True}, "scene"),
        (
            lambda a: Controlled(scenes.karpodinis(22.1), DelayedFeedback(0.1)),
            {"exponents": True}, "exponents",
        ),
    ],
)  # fmt: skip
def test_what_has_no_diagram_is_refused(scene, options, argument):
    with pytest.raises(InvalidInput) as caught:
        bifurcation_diagram(scene, [21.0], periods=3, transient=3, **options)
    assert caught.value.argument == argument


def test_nothing_swings_beyond_a_rigid_stop():
    found = response_spectrum(one_mode, [19.0, 20.5, 21.5, 22.5], periods=20, transient=100)
    assert found.greatest.max() < 1e-3 * (1 + 1e-12)
    assert found.greatest.min() > 1e-3 * (1 - 1e-12)
