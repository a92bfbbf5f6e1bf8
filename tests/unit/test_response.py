"""How far an oscillator swings, against closed forms."""

from __future__ import annotations

import math

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from matplotlib.figure import Figure

from impactsig import InvalidInput, response_spectrum, scenes

FAR = 50.0  # a wall that is not met


def den_hartog(gamma, h, f):
    """Amplitude of the motion that turns twice a period and never rests [DenHartog1931]_.

    From turn to turn, half a period T, it is a forced motion about f, R cos(gamma t + b), and a
    free one, u. It turns at X and at -X: u(0) + u(T) = -2 f and u'(0) + u'(T) = 0, by the free
    motion's matrix; then u'(0) = gamma R sin b and X = f + R cos b + u(0).
    """
    push = math.hypot(1, 2 * h * gamma)
    response = push / math.hypot(1 - gamma**2, 2 * h * gamma)
    w, T = math.sqrt(1 - h**2), math.pi / gamma
    c, s, decay = math.cos(w * T), math.sin(w * T), math.exp(-h * T)
    free = decay * np.array([[c + h / w * s, s / w], [-s / w, c - h / w * s]])
    u, du = np.linalg.solve(np.eye(2) + free, [-2 * f, 0])
    sine = du / (gamma * response)
    return f + response * math.sqrt(1 - sine**2) + u


@pytest.mark.parametrize(("h", "f"), [(0.1, 0.0), (0.5, 0.0)])
def test_without_friction_it_is_the_linear_response(h, f):
    gamma = np.array([0.3, 0.9, 1.0, 1.7])
    found = response_spectrum(
        lambda gamma: scenes.begley_virgin(gamma, FAR, f, damping_ratio=h), gamma
    )
    linear = np.hypot(1, 2 * h * gamma) / np.hypot(1 - gamma**2, 2 * h * gamma)
    assert found.greatest == pytest.approx(linear, rel=1e-8)
    assert found.least == pytest.approx(-linear, rel=1e-8)
    assert list(found.periods) == [1] * 4


@pytest.mark.parametrize(("h", "f"), [(0.1, 0.15), (0.02, 0.3)])
def test_with_friction_it_is_den_hartogs(h, f):
    gamma = np.array([0.8, 1.0, 1.3, 2.0])
    found = response_spectrum(
        lambda gamma: scenes.begley_virgin(gamma, FAR, f, damping_ratio=h), gamma
    )
    assert np.all(found.sticking == 0)
    expected = [den_hartog(each, h, f) for each in gamma]
    assert found.amplitude == pytest.approx(expected, rel=1e-8)


def test_where_friction_holds_it_never_moves():
    found = response_spectrum(lambda gamma: scenes.begley_virgin(gamma, FAR, 1.5), [0.5])
    assert found.greatest == found.least == 0
    assert found.sticking == 1


def test_a_rigid_stop_is_the_greatest_displacement():
    found = response_spectrum(scenes.karpodinis, [22.1, 23.0])
    assert found.greatest == pytest.approx([1.0, 1.0], abs=1e-12)
    ax = found.plot(Figure().subplots())
    assert ax.get_xlabel() == "frequency"


@pytest.mark.parametrize(
    ("changes", "argument"),
    [
        ({"values": []}, "values"),
        ({"periods": 0}, "periods"),
        ({"transient": 0}, "transient"),
        ({"closed": 1.0}, "closed"),
        ({"workers": 0}, "workers"),
        ({"scene": lambda _: None}, "scene"),
    ],
)
def test_bad_input_is_named(changes, argument):
    given = {"scene": scenes.karpodinis, "values": [22.1]} | changes
    with pytest.raises(InvalidInput) as caught:
        response_spectrum(given.pop("scene"), given.pop("values"), **given)
    assert caught.value.argument == argument
