"""First contacts of random legs, beside a search that cannot miss one."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pytest

import impactsig
from impactsig import Force, Oscillator, Rigid, Stop
from tests.naive_simulate import CONTACT, NONE, UNDECIDED, first_contact

ANYWHERE, STEADY, BACKWARD, LEAVING = range(4)  # how a leg is drawn; the middle two near grazing
TURN = 2 * math.pi


@dataclass
class Tally:
    """Legs of each kind, contacts among them, and what engine and search disagree about."""

    legs: dict = field(default_factory=lambda: dict.fromkeys(range(4), 0))
    contacts: dict = field(default_factory=lambda: dict.fromkeys(range(4), 0))
    undecided: int = 0
    wrong: list = field(default_factory=list)


def flow_back(zeta, amplitude, omega, phase, x, v, tau):
    """The state `tau` before (x, v) at `phase`, and the phase then."""
    damped = math.sqrt(1 - zeta**2)
    response = amplitude / complex(1 - omega**2, 2 * zeta * omega)

    def steady(angle):
        turned = response * complex(math.cos(angle), math.sin(angle))
        return turned.real, -omega * turned.imag

    at, moving = steady(phase)
    z, w = x - at, v - moving
    co, si, grown = math.cos(damped * tau), math.sin(damped * tau), math.exp(zeta * tau)
    z, w = (
        grown * (z * (co - zeta / damped * si) - w / damped * si),
        grown * (w * (co + zeta / damped * si) + z / damped * si),
    )
    at, moving = steady(phase - omega * tau)
    return at + z, moving + w, (phase - omega * tau) % TURN


def draw(rng, kind):
    """zeta, amplitude, omega, phase, x, v of a leg below a stop at 1."""
    zeta, omega = 10 ** rng.uniform(-4, -0.3), 10 ** rng.uniform(-1, 1)
    phase = rng.uniform(0, TURN)
    if kind == STEADY:  # the steady motion of a forcing next to grazing, a little disturbed
        grazing = math.hypot(1 - omega**2, 2 * zeta * omega)
        amplitude = grazing * (1 + rng.choice([-1, 1]) * 10 ** rng.uniform(-10, -2))
        response = amplitude * np.exp(1j * phase) / complex(1 - omega**2, 2 * zeta * omega)
        x, v = response.real, -omega * response.imag
        return zeta, amplitude, omega, phase, x, v + rng.choice([0, 1e-8, 1e-4]) * rng.normal()
    amplitude = 10 ** rng.uniform(-2, 1)
    if kind == BACKWARD:  # up to a period before a turn next to the stop, on either side of it
        x = 1 + rng.choice([-1, 1]) * 10 ** rng.uniform(-11, -2)
        tau = min(rng.uniform(0, TURN / omega), 3 / zeta)
        x, v, phase = flow_back(zeta, amplitude, omega, phase, x, 0.0, tau)
        return zeta, amplitude, omega, phase, x, v
    v = 10 ** rng.uniform(-9, 0.5)
    if kind == LEAVING:
        return zeta, amplitude, omega, phase, 1.0, -v
    return zeta, amplitude, omega, phase, 1 - 10 ** rng.uniform(-9, 0.5), rng.choice([-v, v])


def judge(tally, kind, leg, mirrored):
    """Let the engine and the search find the first contact of a leg."""
    zeta, amplitude, omega, phase, x, v = leg
    length = 1.3 * TURN / omega
    verdict, low, high = first_contact(zeta, amplitude, omega, phase, x, v, end=length)
    sign, side = (-1, "lower") if mirrored else (1, "upper")
    machine = Oscillator(
        damping=2 * zeta, forces=Force(sign * amplitude, omega), stops=(Stop(sign, Rigid(0), side),)
    )
    found = impactsig.simulate(machine, duration=length, initial=(sign * x, sign * v), phase=phase)
    first = found.impacts.time[0] if found.impact_count else math.inf
    tally.legs[kind] += 1
    tally.contacts[kind] += verdict == CONTACT
    slack = 1e-15 * length + (high - low)
    if verdict == UNDECIDED or (verdict == CONTACT and high > length):
        # Rounding decides whether there is a touch at `low`, but not that there is none before.
        tally.undecided += 1
        agreed = first >= low - 1e-7 * length
    elif verdict == CONTACT:
        agreed = low - slack <= first <= high + slack
    else:
        agreed = first == math.inf
    if not agreed:
        tally.wrong.append((kind, leg, mirrored, verdict, low, high, first))


def legs(seed, count):
    rng = np.random.default_rng(seed)
    tally = Tally()
    while sum(tally.legs.values()) < count:
        kind = int(rng.integers(4))
        leg = draw(rng, kind)
        if leg[4] < 1 or kind == LEAVING:
            judge(tally, kind, leg, rng.random() < 0.5)
    return tally


def test_no_first_contact_is_missed():
    tally = legs(1, 1000)
    assert not tally.wrong
    assert all(contacts > 60 for contacts in tally.contacts.values())
    assert tally.undecided < 4


@pytest.mark.slow
def test_no_first_contact_of_a_million_is_missed():
    tally = legs(2, 1_000_000)
    assert not tally.wrong
    assert all(legs > 150_000 for legs in tally.legs.values())
    assert tally.undecided < 1000


def test_the_search_itself_finds_what_must_be_there():
    """A contact by closed form, none just below it, and one that rounding decides about."""
    # x = 1.5 sin t reaches 1; x = 1 - 1e-12 at most does not; x = 1 at most may or may not.
    verdict, low, high = first_contact(0, 0.0, 2.0, 0.0, 0.0, 1.5, end=10.0)
    assert verdict == CONTACT
    assert low <= math.asin(1 / 1.5) <= high
    assert high - low < 1e-12
    assert first_contact(0, 0.0, 2.0, 0.0, 0.0, 1 - 1e-12, end=10.0)[0] == NONE
    assert first_contact(0, 0.0, 2.0, 0.0, 0.0, 1.0, end=10.0)[0] == UNDECIDED
