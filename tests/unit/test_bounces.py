"""The restitution coefficient of a body that bounces, from the times between its impacts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.bounces import drop, recorded
from impactsig import Impacts, InvalidInput, restitution_from_bounces
from impactsig.intervals._drop import _variance


def bounces(restitution=0.75, flights=8, contact=0.0, jitter=0.0, seed=0):
    """Touches of a body whose first flight is half a second."""
    gaps = 0.5 * restitution ** np.arange(flights) + contact
    time = np.concatenate(([0.0], np.cumsum(gaps)))
    return time + jitter * np.random.default_rng(seed).standard_normal(len(time))


def test_without_noise_it_is_the_coefficient():
    errors = np.full(9, 1e-6)
    found = restitution_from_bounces(Impacts(bounces(), time_error=errors), contact_time=0.0)
    assert found.restitution == pytest.approx(0.75, abs=1e-9)
    np.testing.assert_allclose(found.ratios, 0.75)
    # A contact of 2 ms makes plain ratios of intervals wrong by up to 1 %; fitted it does not.
    train = Impacts(bounces(contact=2e-3), time_error=errors)
    found = restitution_from_bounces(train)
    assert found.interval[0] < 0.75 < found.interval[1]
    assert found.contact_time == pytest.approx(2e-3, abs=1e-9)
    assert found.contact == "fitted"
    assert abs(restitution_from_bounces(train, contact_time=0.0).restitution - 0.75) > 1e-3
    measured = replace(train, contact_time=np.full(9, 2e-3))
    assert restitution_from_bounces(measured).restitution == pytest.approx(0.75, abs=1e-9)


def test_two_flights_have_the_error_of_their_ratio():
    """In closed form: r = (t2 - t1) / (t1 - t0), each instant with the error s."""
    t0, t1, t2, s = 0.0, 0.5, 0.9, 1e-3
    train = Impacts([t0, t1, t2], time_error=np.full(3, s))
    found = restitution_from_bounces(train, contact_time=0.0)
    first = t1 - t0
    expected = s * np.sqrt((0.8 / first) ** 2 + (1.8 / first) ** 2 + (1 / first) ** 2)
    assert found.restitution == pytest.approx(0.8)
    assert found.error == pytest.approx(expected, rel=1e-6)
    assert found.ratio_errors == pytest.approx([expected])


@pytest.mark.parametrize(("known", "contact"), [(True, 0.0), (False, 0.0)])
def test_stated_intervals_hold_the_coefficient(known, contact):
    """Of 150 drops with jitter: 95 % within its own scatter of 2.5 standard deviations."""
    held = 0
    for k in range(150):
        rng = np.random.default_rng((1, k))
        truth, flights = rng.uniform(0.6, 0.9), int(rng.integers(5, 9))
        time = bounces(truth, flights, 2e-3 if contact is None else 0.0, 1e-4, k)
        errors = np.full(len(time), 1e-4) if known else None
        found = restitution_from_bounces(Impacts(time, time_error=errors), contact_time=contact)
        held += found.interval[0] <= truth <= found.interval[1]
    assert 0.905 <= held / 150 <= 0.995


def test_impacts_that_are_no_bounces_are_left_out():
    time = bounces(flights=9)
    errors = np.full(len(time) + 2, 1e-6)
    before = np.concatenate(([-0.9, -0.2], time))  # it was knocked twice before it was let go
    found = restitution_from_bounces(Impacts(before, time_error=errors), contact_time=0.0)
    assert found.restitution == pytest.approx(0.75, abs=1e-6)
    assert (found.first, len(found.flights)) == (2, 9)
    late = np.concatenate((time, [time[-1] + 0.3, time[-1] + 0.8]))
    found = restitution_from_bounces(Impacts(late, time_error=errors), contact_time=0.0)
    assert len(found.flights) == 9


def test_an_impact_amid_a_flight_is_no_bounce():
    time = bounces(flights=6)
    for false in (0.1, 0.3, 0.7, 1.0):  # amid the first, second and third flight
        seen = np.sort(np.append(time, [false, false + 0.05]))
        found = restitution_from_bounces(
            Impacts(seen, time_error=np.full(len(seen), 1e-6)), contact_time=0.0
        )
        assert found.restitution == pytest.approx(0.75, abs=1e-5)


def hertz(restitution=0.7, flights=9, power=-0.2):
    """Instants and contact times of a body whose contacts go by a power of the speed."""
    contact = 2e-3 * restitution ** (power * np.arange(flights + 1))
    flown = 0.5 * restitution ** np.arange(flights)
    return np.concatenate(([0.0], np.cumsum(flown + contact[:-1]))), contact


@pytest.mark.parametrize("power", [0.0, -0.1, -0.2])
def test_contacts_go_by_a_power_of_the_speed(power):
    time, contact = hertz(power=power)
    errors = np.full(len(time), 1e-6)
    found = restitution_from_bounces(Impacts(time, time_error=errors))
    assert found.restitution == pytest.approx(0.7, abs=1e-5)
    # Weak contacts come out too short by a third, and begin too late by half of that.
    peak = 0.7 ** np.arange(len(time))
    short = np.where(peak < 0.2, contact / 3, 0.0)
    train = Impacts(
        time + short / 2, time_error=np.full(len(time), 1e-5), contact_time=contact - short,
        contact_time_error=np.full(len(time), 1.8e-5), peak=peak,
    )  # fmt: skip
    found = restitution_from_bounces(train)
    assert found.interval[0] < 0.7 < found.interval[1]
    assert found.interval[1] - found.interval[0] < 1e-3


@pytest.mark.parametrize("power", [0.0, -0.2])
def test_intervals_hold_where_the_law_of_contact_is_not_known(power):
    """Of 50 drops: at an end of the range of laws, 95 to 97.5 % within 2.5 deviations."""
    held = 0
    for k in range(50):
        rng = np.random.default_rng((2, k))
        truth = rng.uniform(0.55, 0.85)
        time, _ = hertz(truth, int(rng.integers(6, 10)), power)
        time = time + 2e-5 * rng.standard_normal(len(time))
        found = restitution_from_bounces(Impacts(time, time_error=np.full(len(time), 2e-5)))
        held += found.interval[0] <= truth <= found.interval[1]
    assert held >= 45


def test_what_cannot_be_read_is_refused():
    time, errors = bounces(), np.full(9, 1e-6)
    with pytest.raises(InvalidInput, match="flights"):
        restitution_from_bounces(Impacts(time[:2], time_error=errors[:2]))
    with pytest.raises(InvalidInput, match="contact_time"):
        restitution_from_bounces(Impacts(time[:4], time_error=errors[:4]))
    with pytest.raises(InvalidInput, match="flights"):
        restitution_from_bounces(Impacts(np.arange(9.0), time_error=errors), contact_time=0.0)
    with pytest.raises(InvalidInput, match="time_error"):
        restitution_from_bounces(Impacts(time[:3]), contact_time=0.0)
    with pytest.raises(InvalidInput, match="errors"):
        restitution_from_bounces(Impacts(time, time_error=np.zeros(9)))


@pytest.mark.parametrize("sensor", ["force", "sound"])
def test_a_recorded_drop_gives_the_coefficient(sensor):
    rng = np.random.default_rng((0, 7))
    truth, train = drop(rng, hertz=sensor == "force")
    found = restitution_from_bounces(recorded(train, sensor, 20.0, 1))
    assert found.restitution == pytest.approx(truth, abs=2e-3)
    assert f"{found.restitution:.5g}" in str(found)


def test_the_variance_of_what_is_hardly_determined():
    """Of columns (1, 1) and (1, 1 + e) it is 2 / e^2; the normal matrix is singular in float64."""
    e = 2.0**-30
    assert _variance(np.array([[1.0, 1.0], [1.0, 1 + e]]), 1) == pytest.approx(2 / e**2, rel=1e-5)
    # A longer contact is a longer flight where bounces hardly get shorter.
    time = np.concatenate(([0.0], np.cumsum(512577.0 - 35.0 * np.arange(4))))
    found = restitution_from_bounces(Impacts(time, time_error=np.full(5, 600.0)))
    assert found.error > 1
    assert found.interval == (0.0, 1.0)


def test_the_error_does_not_depend_on_the_unit_of_time():
    time, errors = bounces(jitter=1e-5), np.full(9, 1e-5)
    one, other = (
        restitution_from_bounces(Impacts(k * time, time_error=k * errors)) for k in (1, 1e6)
    )
    assert other.error == pytest.approx(one.error, rel=1e-4)
    far = restitution_from_bounces(Impacts(time, time_error=np.full(9, 1e200)), contact_time=0.0)
    assert far.interval == (0.0, 1.0)
    with pytest.raises(InvalidInput, match="another unit"):
        restitution_from_bounces(Impacts(1e150 * time), contact_time=0.0)
