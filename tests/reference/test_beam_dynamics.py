"""Tangent maps, exponents and orbits of a cantilever, in all its modes [Muller1995]_."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from impactsig import (
    BaseMotion,
    Cantilever,
    Force,
    InvalidInput,
    KelvinVoigt,
    Rigid,
    Stop,
    displacement_section,
    find_periodic_orbit,
    flows,
    lyapunov_spectrum,
    scenes,
    simulate,
    tangent_map,
)

SHAKEN = BaseMotion(2e-4, 2 * math.pi * 21, stops=True)
BEAM = Cantilever(0.2, 0.025, 0.001, 210e9, 7850, modes=3, forcing=SHAKEN)
RIGID = replace(BEAM, stop=Stop(1e-3, Rigid(0.6)))
CASES = {
    "no stop": (BEAM, 3.3),
    "rigid": (RIGID, 3.3),
    "chatter and sticks": (
        replace(BEAM, stop=Stop(2e-4, Rigid(0.4)), forcing=Force(0.1, 2 * math.pi * 17, 0.3)), 1.2,
    ),
    "soft": (replace(BEAM, stop=Stop(-2e-4, KelvinVoigt(2e3, 0.5), "lower")), 4.2),
    "clamp moves before the stop": (
        replace(RIGID, forcing=BaseMotion(2e-4, 2 * math.pi * 21)), 2.4,
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_the_tangent_map_is_the_difference_of_neighbours(case):
    beam, periods = CASES[case]
    m, start = beam.modes, np.array([1e-4, 0.0, 0.0, 0.05, 0.0, 0.0])
    found = tangent_map(beam, periods=periods, initial=(start[:m], start[m:]))
    if case != "no stop":
        assert found.impacts >= 3
    assert (found.collapses > 0) == ("sticks" in case)
    assert found.grazings == 0
    omega = beam.angular_forcing_frequency
    unit = np.repeat([1.0, omega], m)
    columns = []
    for j in range(2 * m):
        off = np.zeros(2 * m)
        off[j] = 1e-9 * unit[j]
        ends = []
        for side in (1, -1):
            near = start + side * off
            q, v, _ = simulate(beam, periods=periods, initial=(near[:m], near[m:])).final
            ends.append(np.concatenate([q, v]))
        columns.append((ends[0] - ends[1]) / (2 * off[j]))
    scaled, expected = (
        matrix / unit[:, None] * unit for matrix in (found.matrix, np.stack(columns, axis=1))
    )
    assert np.abs(scaled - expected).max() < 1e-6 * np.abs(expected).max()


def test_one_mode_has_the_exponents_and_orbits_of_its_oscillator():
    beam = replace(RIGID, modes=1)
    oscillator = scenes.cantilever(
        0.2, 0.025, 0.001, 210e9, 7850, stop=1e-3, frequency=21, amplitude=2e-4, restitution=0.6
    )
    run = {"periods": 100, "transient": 20}
    found, expected = lyapunov_spectrum(beam, **run), lyapunov_spectrum(oscillator, **run)
    np.testing.assert_allclose(found.exponents, expected.exponents, rtol=1e-9)
    np.testing.assert_allclose(found.error, expected.error, rtol=1e-6)
    assert found.expected_sum == pytest.approx(expected.expected_sum, rel=1e-12)
    orbit, exact = find_periodic_orbit(beam), find_periodic_orbit(oscillator)
    np.testing.assert_allclose(orbit.state, exact.state, rtol=1e-11)
    np.testing.assert_allclose(orbit.multipliers, exact.multipliers, rtol=1e-8)
    assert (orbit.impacts, orbit.periods) == (exact.impacts, exact.periods)
    np.testing.assert_allclose(orbit.impact_phase, exact.impact_phase, atol=1e-11)


def test_exponents_without_a_stop_are_the_damping_of_the_modes():
    found = lyapunov_spectrum(BEAM, periods=60)
    damping = np.repeat(0.03 * 2 * math.pi * BEAM.frequencies(3), 2)
    assert found.sum == pytest.approx(-damping.sum(), rel=1e-11)
    # Columns turn with the modes: the exponents come to their limit as the inverse of the time.
    np.testing.assert_allclose(found.exponents, -damping, rtol=1e-2)


def test_exponents_add_up_to_what_areas_lose():
    found = lyapunov_spectrum(RIGID, periods=50)
    assert found.impacts > 100
    # Damping all the time; at each impact the coefficient, for displacement and velocity alike.
    damping = 2 * 0.03 * (2 * math.pi * RIGID.frequencies(3)).sum()
    lost = 2 * found.impacts * math.log(0.6) / (50 * RIGID.forcing_period)
    assert found.sum == pytest.approx(found.expected_sum, rel=1e-11)
    assert found.sum == pytest.approx(lost - damping, rel=1e-11)


def test_sticks_end_two_directions():
    beam, _ = CASES["chatter and sticks"]
    found = lyapunov_spectrum(beam, periods=20)
    assert found.collapses >= 15
    assert np.isneginf(found.exponents).sum() == 2
    assert np.isfinite(found.between_collapses[:4]).all()
    assert "2 of 6 directions vanish" in found.describe()
    assert "nan" not in found.describe()


@pytest.mark.parametrize("modes", [2, 4])
def test_an_orbit_comes_back(modes):
    orbit = find_periodic_orbit(replace(RIGID, modes=modes))
    assert orbit.found
    assert orbit.stable
    motion = orbit.motion(cycles=20)
    end = np.concatenate(motion.final[:2])
    assert np.abs(end - orbit.state).max() < 1e-12
    assert len(motion.impacts) == 20 * orbit.impacts
    assert "in its modes" in repr(orbit)
    again = find_periodic_orbit(replace(RIGID, modes=modes), guess=orbit.state * 1.01)
    np.testing.assert_allclose(again.state, orbit.state, atol=1e-10)


def test_the_tangent_map_of_a_flow_loses_volume_at_its_divergence():
    found = tangent_map(flows.lorenz(), duration=1.0)
    assert found.log_determinant == pytest.approx(-(10 + 1 + 8 / 3), rel=1e-9)
    orbit = find_periodic_orbit(flows.rossler(), period=5.88)
    turned = tangent_map(flows.rossler(), duration=orbit.period, initial=orbit.state)
    np.testing.assert_allclose(turned.multipliers, orbit.multipliers.real, rtol=1e-6, atol=1e-9)
    with pytest.raises(InvalidInput, match="lyapunov_spectrum"):
        tangent_map(flows.lorenz(), duration=200.0)


@pytest.mark.parametrize(
    ("ask", "argument"),
    [
        (lambda: find_periodic_orbit(replace(BEAM, forcing=None)), "system"),
        (lambda: find_periodic_orbit(RIGID, period=1.0), "period"),
        (lambda: find_periodic_orbit(RIGID, guess=(1.0, "a")), "guess"),
        (lambda: find_periodic_orbit(RIGID, guess=np.zeros(5)), "guess"),
        (lambda: find_periodic_orbit(RIGID, method="exact"), "method"),
        (lambda: lyapunov_spectrum(RIGID, periods=-1), "periods"),
        (lambda: lyapunov_spectrum(RIGID, periods=3, method="exact"), "method"),
        (lambda: tangent_map(RIGID, periods=3, transient=2), "transient"),
    ],
)
def test_bad_input_names_the_argument(ask, argument):
    with pytest.raises(InvalidInput) as caught:
        ask()
    assert caught.value.argument == argument


def test_a_tip_that_swings_freely_crosses_a_level_at_instants_known_in_closed_form():
    """x = q cos(w t), without damping and with a base that does next to nothing."""
    base = BaseMotion(1e-30, 0.1)
    ruler = Cantilever(0.2, 0.025, 0.001, 210e9, 7850, modes=1, damping_ratio=0.0, forcing=base)
    q, level = 1e-3, 4e-4
    motion = simulate(ruler, duration=2.0, initial=([q], [0.0]))
    w = 2 * np.pi * motion.frequencies[0]
    found = displacement_section(motion, level, "up")
    first = 2 * np.pi - np.arccos(level / q)
    exact = (first + 2 * np.pi * np.arange(len(found))) / w
    assert len(found) == int((2.0 * w - first) / (2 * np.pi)) + 1
    np.testing.assert_allclose(found.time, exact, atol=1e-14 * 2.0 * w)
    np.testing.assert_allclose(found.velocity, w * np.sqrt(q**2 - level**2), rtol=1e-9)
    np.testing.assert_allclose(found.phase, 0.1 * exact, rtol=1e-9)
    down = displacement_section(motion, level, "down")
    np.testing.assert_allclose(down.velocity, -w * np.sqrt(q**2 - level**2), rtol=1e-9)


def test_a_tip_crosses_a_level_below_its_stop_before_and_after_every_impact():
    base, stop = BaseMotion(2e-4, 2 * np.pi * 21.0, stops=True), Stop(1e-3, Rigid(0.6))
    ruler = Cantilever(0.2, 0.025, 0.001, 210e9, 7850, stop=stop, modes=2, forcing=base)
    motion = simulate(ruler, periods=20)
    found = displacement_section(motion, 8e-4, "both")
    x, v = motion.sample(found.time)
    np.testing.assert_allclose(x, 8e-4, rtol=1e-9)
    np.testing.assert_allclose(v, found.velocity, rtol=1e-9)
    assert (np.sign(found.velocity[:-1]) != np.sign(found.velocity[1:])).all()
    above = np.searchsorted(found.time, motion.impacts.time) % 2  # after an odd number of them
    assert len(motion.impacts) > 20
    assert (above == 1).all()
    assert len(displacement_section(motion, 1e-3)) == 0  # the stop itself is impact_map's
    with pytest.raises(InvalidInput, match="forced"):
        displacement_section(simulate(replace(ruler, forcing=None), duration=1.0), 1e-4)
