"""Diagrams of systems that are simulated whole: cantilevers, flows, under control, under noise."""

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
    Flow,
    Force,
    InvalidInput,
    KelvinVoigt,
    Noise,
    Oscillator,
    Rigid,
    Stop,
    bifurcation_diagram,
    flows,
    periodicity_chart,
    response_spectrum,
    scenes,
    simulate,
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


def hopf_rates(t, y, mu):
    """A circle of radius sqrt(mu), passed in 2 pi; exponents 0 and -2 mu."""
    away = mu - y[0] ** 2 - y[1] ** 2
    return y[0] * away - y[1], y[1] * away + y[0]


def hopf(mu, second=0.0):
    return Flow(hopf_rates, (0.3, 0.4), (mu,), name="Hopf")


CUT = {"section": ("x", 0.0)}


def test_a_flow_has_the_diagram_response_and_chart_of_its_circle():
    values, look = [0.25, 1.0], {"periods": 6, "transient": 20, **CUT}
    found = bifurcation_diagram(hopf, values, exponents=True, **look)
    assert list(found.periods) == list(found.impacts) == [1, 1]
    assert list(found.impacts_per_period) == [1, 1]
    for k, mu in enumerate(values):
        # x rises through 0 at y = -sqrt(mu), with the rate of a unit angular velocity.
        np.testing.assert_allclose(found.strobe[k], [[0.0, -math.sqrt(mu)]], atol=1e-9)
        np.testing.assert_allclose(found.velocity[k], [math.sqrt(mu)], rtol=1e-9)
        np.testing.assert_allclose(found.exponents[k], [0.0, -2 * mu], atol=1e-7)
    swung = response_spectrum(hopf, values, **look)
    np.testing.assert_allclose(swung.greatest, np.sqrt(values), rtol=1e-8)
    np.testing.assert_allclose(swung.least, -np.sqrt(values), rtol=1e-8)
    chart = periodicity_chart(hopf, [0.25, 1.0], [0.0], periods=40, **CUT)
    assert chart.classes.tolist() == [[1, 1]]


def test_a_flow_that_comes_to_rest_has_period_1_without_returns():
    look = {"section": ("x", 0.1)}  # beside the point at which it rests
    found = bifurcation_diagram(hopf, [-0.5], periods=4, transient=4, **look)
    assert (found.periods[0], found.impacts[0], found.status[0]) == (1, 0, "complete")
    np.testing.assert_allclose(found.strobe[0], [[0.0, 0.0]], atol=1e-9)
    chart = periodicity_chart(hopf, [-0.5], [0.0], periods=8, **look)
    assert chart.classes.tolist() == [[0]]


def test_rossler_doubles_its_period():
    found = bifurcation_diagram(
        lambda c: flows.rossler(c=c), [2.5, 3.5, 5.7], periods=12, transient=100, **CUT
    )
    assert list(found.periods) == [1, 2, 0]
    assert len(found.strobe[1]) == 2
    assert len(found.strobe[2]) == 12


def test_under_noise_a_diagram_has_the_strobes_of_one_path():
    def scene(damping):
        return Oscillator(damping=damping, forces=(Force(0.5, 0.9),), noise=Noise(0.02))

    look = {"periods": 4000, "transient": 20, "phase": 0.7}
    found = bifurcation_diagram(scene, [0.5, 1.0], seed=3, **look)
    assert list(found.periods) == [0, 0]
    assert list(found.impacts) == [-1, -1]
    for k, damping in enumerate([0.5, 1.0]):
        # The forced motion in the mean; about it <x^2> = intensity / (c k), <v^2> = intensity / c.
        answer = 0.5 / (1 - 0.81 + 0.9j * damping) * np.exp(0.7j)
        mean = np.array([answer.real, (0.9j * answer).real])
        strobe = found.strobe[k]
        assert strobe.shape == (4000, 2)
        spread = math.sqrt(0.02 / damping)
        np.testing.assert_allclose(strobe.mean(axis=0), mean, atol=4 * spread / math.sqrt(4000))
        np.testing.assert_allclose(strobe.std(axis=0), spread, rtol=0.05)
    again = bifurcation_diagram(scene, [0.5, 1.0], seed=3, workers=2, **look)
    np.testing.assert_array_equal(again.strobe[1], found.strobe[1])
    path = simulate(scene(0.5), periods=5, transient=2, every=2 * math.pi / 0.9, seed=4)
    short = bifurcation_diagram(scene, [0.5], periods=5, transient=2, seed=4)
    assert len(short.strobe[0]) == len(path.x) == 5


def test_a_flow_that_leaves_or_never_returns_says_so():
    def falling(t, y):
        return -1.0, -y[1]

    def bursting(t, y, a):
        return y[0] ** 2, -y[1]

    found = bifurcation_diagram(lambda a: Flow(bursting, (1.0, 0.0), (a,)), [1.0], **CUT)
    assert found.status == ("diverged",)
    assert np.isnan(found.impacts_per_period).all()
    found = bifurcation_diagram(lambda a: Flow(falling, (-1.0, 0.0)), [1.0], **CUT)
    assert found.status == ("no return",)


@pytest.mark.parametrize(
    ("ask", "argument"),
    [
        (lambda: bifurcation_diagram(hopf, [1.0]), "section"),
        (lambda: response_spectrum(hopf, [1.0]), "section"),
        (lambda: periodicity_chart(hopf, [1.0], [1.0]), "section"),
        (lambda: bifurcation_diagram(hopf, [1.0], section="x"), "section"),
        (lambda: bifurcation_diagram(hopf, [1.0], section=("x", math.nan)), "section"),
        (lambda: bifurcation_diagram(hopf, [1.0], section=("w", 0.0)), "signal"),
        (lambda: response_spectrum(noisy, [1.0]), "scene"),
        (lambda: periodicity_chart(noisy, [1.0], [1.0]), "scene"),
        (lambda: bifurcation_diagram(noisy, [1.0], exponents=True), "exponents"),
    ],
)
def test_a_section_is_needed_and_an_orbit_has_no_noise(ask, argument):
    with pytest.raises(InvalidInput) as caught:
        ask()
    assert caught.value.argument == argument


def noisy(a, b=0.0):
    return Oscillator(damping=a, forces=(Force(0.5, 0.9),), noise=Noise(0.02))
