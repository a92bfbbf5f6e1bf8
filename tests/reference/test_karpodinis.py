"""The impacting beam of Karpodinis' thesis, with the thesis' own way of integrating it."""

from math import pi

import numpy as np
import pytest

from tests import naive

PERIODIC = naive.frequency_ratio(22.1)
V = 0.5810258993557  # approach velocity of the period(1,1) orbit (Shaw & Holmes, closed form)


def test_the_closed_form_gives_the_known_approach_velocity():
    assert naive.one_impact_orbit(PERIODIC) == pytest.approx(V, abs=1e-13)


def test_the_beam_settles_on_the_orbit_with_one_impact_in_a_period():
    instants, velocity, _ = naive.integrate_impacts(PERIODIC, 200, steps=400)
    assert np.diff(instants)[-20:] == pytest.approx(2 * pi / PERIODIC, abs=1e-9)
    assert velocity[-20:] == pytest.approx(V, abs=1e-8)


def test_the_approach_velocity_converges_in_fourth_order():
    steps = np.array([50, 100, 200, 400])
    error = []
    for count in steps:
        _, velocity, _ = naive.integrate_impacts(PERIODIC, 200, steps=int(count))
        error.append(abs(velocity[-1] - V))
    order = -np.diff(np.log(error)) / np.diff(np.log(steps))
    assert np.all((order > 3.8) & (order < 4.2)), order


@pytest.mark.parametrize(("frequency", "published"), [(20.1, 0.607), (20.3355, 0.548)])
def test_impacts_per_period_of_the_chaotic_runs(frequency, published):
    omega = naive.frequency_ratio(frequency)
    _, _, state = naive.integrate_impacts(omega, 200, steps=150)
    batches = []
    for _ in range(12):
        instants, _, state = naive.integrate_impacts(omega, 200, steps=150, state=state)
        batches.append(len(instants) / 200)
    error = np.std(batches, ddof=1) / np.sqrt(len(batches))
    assert error < 0.01
    assert np.mean(batches) == pytest.approx(published, abs=0.005 + 3 * error)  # it was sampled too


def test_the_chaotic_run_never_repeats():
    """Two orbits 1e-9 apart part company; on the periodic orbit they meet."""
    apart = {}
    for frequency in (20.1, 22.1):
        omega = naive.frequency_ratio(frequency)
        _, _, (t, x, v) = naive.integrate_impacts(omega, 200, steps=150)
        one, _, _ = naive.integrate_impacts(omega, 150, steps=150, state=(t, x, v))
        other, _, _ = naive.integrate_impacts(omega, 150, steps=150, state=(t, x, v - 1e-9))
        last = min(len(one), len(other)) - 1
        apart[frequency] = abs(one[last] - other[last])
    assert apart[22.1] < 1e-9
    assert apart[20.1] > 1e-3


@pytest.mark.parametrize("restitution", [0.2, 1.0])
def test_without_forcing_and_damping_energy_is_lost_only_at_the_stop(restitution):
    """x'^2 + x^2 is kept between impacts and x'^2 -> r^2 x'^2 at each; r = 1 keeps all of it."""
    start = 1.7
    _, velocity, (_, x, v) = naive.integrate_impacts(
        1.0, 3.4, steps=1000, damping=0, amplitude=0, restitution=restitution, state=(0, -start, 0)
    )
    expected, energy = [], start**2 - 1
    for _ in velocity:
        expected.append(np.sqrt(energy))
        energy *= restitution**2
    assert len(velocity) >= 3
    assert velocity == pytest.approx(expected, abs=1e-9)
    assert x**2 + v**2 == pytest.approx(1 + energy, abs=1e-9)
