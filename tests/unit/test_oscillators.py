"""Oscillators as data: what is refused, what is kept."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError

import pytest

from impactsig import BaseMotion, Force, InvalidInput, KelvinVoigt, Oscillator, Rigid, Stop


@pytest.mark.parametrize(
    ("make", "argument"),
    [
        (lambda: Rigid(1.1), "restitution"),
        (lambda: Rigid(-1e-9), "restitution"),
        (lambda: Rigid(math.nan), "restitution"),
        (lambda: KelvinVoigt(-1), "stiffness"),
        (lambda: KelvinVoigt(1, -1), "damping"),
        (lambda: KelvinVoigt.equivalent(0, 1e4), "restitution"),
        (lambda: Force(1, 0), "angular_frequency"),
        (lambda: Force("loud", 1), "amplitude"),
        (lambda: BaseMotion(1, -2), "angular_frequency"),
        (lambda: Stop(math.inf, Rigid(1)), "position"),
        (lambda: Stop(1, Rigid(1), "left"), "side"),
        (lambda: Stop(1, 0.5), "law"),
        (lambda: Oscillator(mass=0), "mass"),
        (lambda: Oscillator(stiffness=-1), "stiffness"),
        (lambda: Oscillator(damping=-1), "damping"),
        (lambda: Oscillator(load=math.nan), "load"),
        (lambda: Oscillator(forces=(1.0,)), "forces"),
        (lambda: Oscillator(base="floor"), "base"),
        (lambda: Oscillator(stops=(Stop(1, Rigid(1)), Stop(2, Rigid(1)))), "stops"),
        (lambda: Oscillator(stops=(Stop(1, Rigid(1)), Stop(1, Rigid(1), "lower"))), "stops"),
        (lambda: Oscillator(forces=Force(1, 1)), "damping"),
    ],
)
def test_what_cannot_be_is_refused_by_name(make, argument):
    with pytest.raises(InvalidInput) as caught:
        make()
    assert caught.value.argument == argument


@pytest.mark.parametrize(
    ("stops", "side"),
    [
        ((Stop(-1.5, Rigid(0.5)), Stop(1.0, Rigid(0.5))), "lower"),
        ((Stop(-1.0, Rigid(0.5), "lower"), Stop(1.5, Rigid(0.5), "lower")), "upper"),
    ],
)
def test_two_rigid_stops_of_one_side_are_told_of_the_other(stops, side):
    with pytest.raises(InvalidInput, match=f'side="{side}"'):
        Oscillator(stops=stops)


def test_an_oscillator_is_immutable_and_compares_by_value():
    one = Oscillator(forces=Force(1, 2), stops=[Stop(1, Rigid(0.5))])
    assert one == Oscillator(forces=(Force(1.0, 2.0),), stops=(Stop(1.0, Rigid(0.5)),))
    assert hash(one) == hash(Oscillator(forces=(Force(1, 2),), stops=(Stop(1, Rigid(0.5)),)))
    with pytest.raises(FrozenInstanceError):
        one.mass = 2
    assert "Rigid(restitution=0.5)" in repr(one)


@pytest.mark.parametrize(
    ("stiffness", "damping"), [(2e5, 63.3704), (2000, 6.33704), (500, 3.16852), (100, 1.41701)]
)
def test_the_equivalent_soft_stop(stiffness, damping):
    found = KelvinVoigt.equivalent(0.8, stiffness)
    assert found.damping == pytest.approx(damping, rel=1e-5)
    assert KelvinVoigt.equivalent(1, stiffness).damping == 0
