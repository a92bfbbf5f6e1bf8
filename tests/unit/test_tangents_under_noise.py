"""Tangent maps and Lyapunov exponents along a path under noise."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from impactsig import (
    BaseMotion,
    Force,
    Friction,
    Hertz,
    InvalidInput,
    KelvinVoigt,
    Noise,
    Oscillator,
    Rigid,
    Stop,
    lyapunov_spectrum,
    simulate,
    tangent_map,
)

LINEAR = Oscillator(damping=0.2, forces=(Force(0.5, 0.9),), noise=Noise(1e-2))
PERIOD = 2 * math.pi / 0.9


def two_hollows(t, x, v):
    return 2 * x - x**3


def test_a_linear_oscillator_has_the_tangent_map_that_it_has_without_noise():
    run = {"periods": 2, "initial": (0.3, 0.1)}
    found = tangent_map(LINEAR, seed=1, step=PERIOD / 64, **run)
    quiet = tangent_map(replace(LINEAR, noise=None), **run)
    np.testing.assert_allclose(found.matrix, quiet.matrix, atol=1e-12)
    assert found.status == "complete"


@pytest.mark.parametrize(("damping", "roots"), [(0.2, [-0.1, -0.1]), (2.5, [-0.5, -2.0])])
def test_the_exponents_of_a_linear_oscillator_are_its_roots(damping, roots):
    own = replace(LINEAR, damping=damping)
    found = lyapunov_spectrum(own, periods=200, seed=2)
    np.testing.assert_allclose(found.exponents, roots, atol=5e-4)
    assert found.sum == pytest.approx(-damping, rel=1e-9)
    assert found.expected_sum == pytest.approx(-damping, rel=1e-9)


@pytest.mark.parametrize("noise", [Noise(1e-3), Noise(1e-3, 0.5)])
def test_a_path_has_the_derivative_that_differences_show(noise):
    """But for the first order of the step."""
    own = Oscillator(damping=0.2, forces=(Force(0.3, 1.0),), law=two_hollows, noise=noise)
    off = []
    for count in (128, 512):
        run = {"duration": 3.0, "seed": 3, "step": 1 / count}
        columns = []
        for side in np.eye(2) * 1e-5:
            starts = (tuple(np.array([0.3, 0.1]) + sign * side) for sign in (1, -1))
            ends = [simulate(own, initial=start, **run).final[:2] for start in starts]
            columns.append(np.subtract(*ends) / 2e-5)
        found = tangent_map(own, initial=(0.3, 0.1), **run).matrix
        off.append(np.abs(found - np.transpose(columns)).max())
    assert off[1] < 5e-4
    assert off[1] < 0.4 * off[0]


def between_soft_stops(law, carried, noise):
    return Oscillator(
        damping=0.1, forces=(Force(0.8, 1.0),), noise=noise,
        base=BaseMotion(0.05, 2.0, stops=True) if carried else None,
        stops=(Stop(0.2, law), Stop(-0.3, law, "lower")),
    )  # fmt: skip


@pytest.mark.parametrize("carried", [False, True])
@pytest.mark.parametrize(
    "law",
    [KelvinVoigt(20.0, 1.0), KelvinVoigt(20.0, 1.0, ends="force"), Hertz(60.0, damping=0.5)],
    ids=["spring", "pusher", "Hertz"],
)
def test_under_faint_noise_soft_stops_have_the_tangent_map_that_they_have_without(law, carried):
    """With the jumps where dampers begin and end to act, but for the first order of the step."""
    own = between_soft_stops(law, carried, Noise(1e-16))
    run = {"duration": 4.0, "initial": (0.1, 0.3)}
    quiet = tangent_map(replace(own, noise=None), **run)
    found = tangent_map(own, seed=1, step=1 / 2048, **run)
    assert found.impacts == quiet.impacts > 0
    np.testing.assert_allclose(found.matrix, quiet.matrix, atol=4e-3 * np.abs(quiet.matrix).max())
    assert found.log_determinant == pytest.approx(quiet.log_determinant, abs=1e-3)


@pytest.mark.parametrize("law", [KelvinVoigt(20.0), Hertz(60.0, damping=0.5)])
def test_pushes_without_a_jump_have_the_derivative_that_differences_show(law):
    """Of one with a jump differences show nothing, as steps end beside it, and not on it."""
    own = between_soft_stops(law, True, Noise(1e-3, 0.2))
    run = {"duration": 4.0, "seed": 1, "step": 1 / 1024}
    columns = []
    for side in np.eye(2) * 1e-6:
        starts = (tuple(np.array([0.1, 0.3]) + sign * side) for sign in (1, -1))
        ends = [simulate(own, initial=start, **run).final[:2] for start in starts]
        columns.append(np.subtract(*ends) / 2e-6)
    found = tangent_map(own, initial=(0.1, 0.3), **run)
    assert found.impacts > 0
    np.testing.assert_allclose(found.matrix, np.transpose(columns), atol=6e-3)


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"stops": (Stop(0.5, Rigid(0.7)),)}, "root of ds"),
        ({"stops": (Stop(0.5, Rigid(0.7)),), "noise": Noise(1e-2, 0.5)}, "no force of its noise"),
        ({"stops": (Stop(0.5, Hertz(60.0, restitution=0.7)),)}, "approach velocity"),
        ({"friction": Friction(0.1)}, "about rest"),
    ],
)
def test_what_has_no_derivative_is_refused(changes, why):
    for ask in (tangent_map, lyapunov_spectrum):
        with pytest.raises(InvalidInput, match=why) as caught:
            ask(replace(LINEAR, **changes), periods=3, seed=1)
        assert caught.value.argument == "system"
