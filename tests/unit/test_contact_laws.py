"""What engines ask of a law of contact, and that a law of a user's is moved by them."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import brentq

from impactsig import Hertz, KelvinVoigt, Oscillator, Rigid, Stop, simulate

LAWS = [
    KelvinVoigt(30.0, 2.0),
    KelvinVoigt(30.0, 2.0, ends="force"),
    Hertz(50.0, damping=0.3),
    Hertz(50.0, 2.0, damping=0.3),
]


@dataclass(frozen=True)
class Lossy(Hertz):
    """Hertz' contact with a loss of another formula."""

    @property
    def by_approach(self):
        return 0.8


def test_a_law_of_another_loss_is_a_class_of_one_formula():
    start = -0.1, 1.0
    free = Oscillator(stiffness=0.0, stops=(Stop(0.0, Lossy(1e6)),))
    _, after = simulate(free, duration=1.0, initial=start).sample([0.9])
    spring = 0.8 - math.log(1.8)  # Hunt and Crossley (1975): y - ln(1 + y) at touch and release
    left = brentq(lambda y: -y - math.log1p(-y) - spring, 0.0, 0.8, xtol=1e-15) / 0.8
    assert after == pytest.approx(-left, abs=1e-9)


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_the_force_of_a_law_is_the_same_in_other_units(law):
    time, length, mass = 2.0, 5.0, 0.3
    depth, inward = np.array([0.01, 0.2]), np.array([1.5, -0.4])
    other = law.in_units(time, length, mass).push(depth * length, inward * length / time)
    assert other == pytest.approx(law.push(depth, inward) * mass * length / time**2, rel=1e-12)


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_the_row_of_a_law_is_its_force_per_mass(law):
    _, stiffness, loss, exponent, _ = law.row(spring=4.0, damper=4.0)
    depth, inward = 0.2, 0.7
    elastic = stiffness * depth**exponent
    lossy = loss * inward * (1.0 if law.linear else elastic)
    assert elastic + lossy == pytest.approx(law.push(depth, inward) / 4.0, rel=1e-12)


def test_a_function_of_the_user_has_no_units_to_change():
    assert Rigid(0.7).function is None
    assert Rigid(lambda v: 0.7).function(1.0) == 0.7
    assert Rigid(0.7).in_units(2.0, 5.0, 0.3) == Rigid(0.7)
