"""Branches of periodic orbits of cantilevers and of flows."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from impactsig import (
    Flow,
    InvalidInput,
    Oscillator,
    continue_orbit,
    find_periodic_orbit,
    flows,
)

from .test_diagrams_of_systems import BEAM, hopf, one_mode, shaken


def settled(system):
    """Displacement and velocity of a stable orbit."""
    return find_periodic_orbit(system).state


def test_one_mode_has_the_branch_of_its_oscillator():
    found = continue_orbit(shaken, (21.0, 20.0), guess=settled(shaken(21.0)))
    expected = continue_orbit(one_mode, (21.0, 20.0), guess=settled(one_mode(21.0)))
    assert found.status == expected.status == "end of range"
    (own,), (other,) = found.special, expected.special
    assert (own.kind, other.kind) == ("period doubling", "period doubling")
    assert own.parameter == pytest.approx(other.parameter, rel=1e-9)
    np.testing.assert_allclose(found.multipliers[-1], expected.multipliers[-1], rtol=1e-7)
    np.testing.assert_allclose(found.period, 1 / found.parameter, rtol=1e-14)
    again = find_periodic_orbit(one_mode(20.0), guess=found.state[-1], phase=found.phase[-1])
    np.testing.assert_allclose(again.state, found.state[-1], rtol=1e-6)


@pytest.mark.slow
def test_two_modes_graze_where_they_reach_the_stop():
    beam = replace(BEAM, modes=2)

    def scene(amplitude):
        own = shaken(19.0, beam)
        return replace(own, forcing=replace(own.forcing, amplitude=amplitude))

    small = find_periodic_orbit(scene(1e-5), guess=(np.zeros(2), np.zeros(2)))
    times = np.linspace(0, 1 / 19.0, 20_001)
    reach = small.motion(1.01).sample(times)[0].max() / 1e-5  # linear as far as the stop
    branch = continue_orbit(scene, (1e-5, 5e-4), guess=small.state)
    assert branch.status == branch.special[-1].kind == "grazing"
    assert branch.state.shape[1] == 4
    assert branch.special[-1].parameter == pytest.approx(1e-3 / reach, rel=1e-6)


def test_a_circle_is_followed_with_its_period():
    def slower(omega):
        return Flow(turning_rates, (0.5, 0.0), (omega,))

    branch = continue_orbit(slower, (1.0, 2.0), period=6.3, most=3)
    np.testing.assert_allclose(np.hypot(*branch.state.T), 0.5, atol=1e-9)
    np.testing.assert_allclose(branch.period, 2 * math.pi / branch.parameter, rtol=1e-9)
    assert branch.parameter[-1] > 1.01
    across = np.exp(-2 * 0.25 * branch.period)
    np.testing.assert_allclose(branch.multipliers, np.stack([across**0, across], 1), rtol=1e-6)
    assert branch.stable.all()


def turning_rates(t, y, omega):
    """A circle of radius 1/2, passed in 2 pi / omega; the exponents are 0 and -1/2."""
    away = 0.25 - y[0] ** 2 - y[1] ** 2
    return y[0] * away - omega * y[1], y[1] * away + omega * y[0]


@pytest.mark.slow
def test_rossler_doubles_where_its_diagram_does():
    branch = continue_orbit(lambda c: flows.rossler(c=c), (2.5, 3.2), period=5.8)
    (doubling,) = branch.special
    assert doubling.kind == "period doubling"
    assert doubling.parameter == pytest.approx(2.8324, abs=1e-3)


@pytest.mark.parametrize(
    ("scene", "options", "argument"),
    [
        (hopf, {}, "period"),
        (lambda a: hopf(a) if a == 1.0 else shaken(a), {"period": 6.3}, "scene_of_parameter"),
        (shaken, {"period": 1.0}, "period"),
        (lambda a: BEAM, {}, "system"),  # not forced
        (lambda a: Oscillator(), {}, "scene_of_parameter"),
    ],
)
def test_what_has_no_branch_is_refused(scene, options, argument):
    with pytest.raises(InvalidInput) as caught:
        continue_orbit(scene, (1.0, 1.1), **options)
    assert caught.value.argument == argument
