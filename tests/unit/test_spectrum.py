"""Power spectra of motions: the right power, at the right frequency, and all of it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from impactsig import Force, InvalidInput, Oscillator, Rigid, Stop, scenes, simulate

HARMONIC = Oscillator(damping=0.2, forces=Force(0.7, 1.7), stops=Stop(50, Rigid(0.5)))
RESPONSE = 0.7 / abs(1 - 1.7**2 + 0.2j * 1.7)
"""Amplitude of the steady response."""


def steady(oscillator, periods=64):
    return simulate(oscillator, periods=periods, transient=200)


@pytest.mark.parametrize(
    ("quantity", "amplitude"), [("displacement", RESPONSE), ("velocity", 1.7 * RESPONSE)]
)
@pytest.mark.parametrize("options", [{}, {"segments": 1}, {"rate": 64 * 1.7 / math.tau}])
def test_a_harmonic_response_is_one_line_of_half_its_squared_amplitude(
    quantity, amplitude, options
):
    found = steady(HARMONIC).power_spectrum(quantity, **options)
    forcing = 1.7 / math.tau
    assert 1 / found.forcing_period == pytest.approx(forcing, rel=1e-14)
    assert found.frequency[np.argmax(found.density)] == pytest.approx(forcing, rel=1e-12)
    near = found.power(forcing - 1.1 * found.resolution, forcing + 1.1 * found.resolution)
    assert near == pytest.approx(amplitude**2 / 2, rel=1e-9)
    assert found.power() == pytest.approx(near, rel=1e-9)


def test_the_power_of_a_band_has_the_frequencies_at_both_its_ends():
    found = steady(HARMONIC).power_spectrum()
    density, step = found.density, found.resolution
    k = int(np.argmax(density))
    line, beside, next_but_one = found.frequency[[k, k + 1, k + 2]]
    assert found.power(line, line) == pytest.approx(density[k] * step, rel=1e-12)
    assert found.power(line, beside) == pytest.approx(density[k : k + 2].sum() * step, rel=1e-12)
    assert found.power(beside, beside) == pytest.approx(density[k + 1] * step, rel=1e-12)
    assert found.power(beside, next_but_one) < found.power(line, line)


def test_two_forces_are_two_lines():
    both = Oscillator(damping=0.2, forces=(Force(0.7, 1.7), Force(0.3, 3.4)))
    found = steady(both).power_spectrum()
    for amplitude, omega in ((0.7, 1.7), (0.3, 3.4)):
        response = amplitude / abs(1 - omega**2 + 0.2j * omega)
        line, width = omega / math.tau, 1.1 * found.resolution
        assert found.power(line - width, line + width) == pytest.approx(response**2 / 2, rel=1e-9)


@pytest.mark.parametrize("quantity", ["displacement", "velocity"])
@pytest.mark.parametrize(
    "scene", [scenes.karpodinis(22.1), scenes.okolewski(3, 0.6, "soft")], ids=["hard", "soft"]
)
def test_parseval_holds_for_periodic_impacting(scene, quantity):
    """Spans of more than two repeats weigh every phase of a periodic motion alike."""
    motion = simulate(scene, periods=72, transient=1000)
    found = motion.power_spectrum(quantity)
    rate, repeats = found.rate, 4
    time = motion.start + np.arange(repeats * round(rate * scene.forcing_period)) / rate
    values = motion.sample(time)[quantity == "velocity"]
    assert found.power() == pytest.approx(np.var(values), rel=1e-6)


def test_parseval_holds_for_chaos_within_the_spread_of_its_spans():
    motion = simulate(scenes.karpodinis(20.1), periods=3000, transient=200)
    x, _ = motion.sample(np.linspace(motion.start, motion.stop, 200_000))
    assert motion.power_spectrum().power() == pytest.approx(np.var(x), rel=0.01)


def test_the_velocity_is_the_displacement_times_its_frequency():
    motion = simulate(scenes.okolewski(3, 0.6, "soft", stop_stiffness=100), periods=200)
    x, v = (motion.power_spectrum(name) for name in ("displacement", "velocity"))
    low = (x.frequency > 0.2) & (x.frequency < 2)
    ratio = v.density[low].sum() / ((math.tau * x.frequency) ** 2 * x.density)[low].sum()
    assert ratio == pytest.approx(1, rel=0.02)


def test_more_segments_are_shorter_and_whole_periods_long():
    motion = steady(HARMONIC, periods=50)
    period = HARMONIC.forcing_period
    for segments, periods in ((1, 50), (4, 20), (8, 11)):
        found = motion.power_spectrum(segments=segments)
        assert found.resolution == pytest.approx(1 / (periods * period), rel=1e-12)
        assert found.frequency[-1] == pytest.approx(found.rate / 2)


def test_without_forcing_the_natural_period_sets_the_rate():
    free = simulate(Oscillator(stiffness=4.0), duration=100.0, initial=(1, 0))
    found = free.power_spectrum(segments=1)
    assert found.forcing_period is None
    assert found.rate == pytest.approx(128 * 2 / math.tau)
    assert found.power() == pytest.approx(0.5, rel=1e-9)


@pytest.mark.parametrize(
    ("argument", "options"),
    [
        ("quantity", {"quantity": "force"}),
        ("segments", {"segments": 0}),
        ("segments", {"segments": 2.5}),
        ("segments", {"segments": 128}),
        ("rate", {"rate": 0}),
        ("rate", {"rate": math.nan}),
        ("segments", {"rate": 1e-3}),
    ],
)
def test_what_cannot_be_is_refused_by_name(argument, options):
    with pytest.raises(InvalidInput) as caught:
        steady(HARMONIC).power_spectrum(**options)
    assert caught.value.argument == argument


def test_a_ball_has_no_period_to_choose_a_rate_by():
    ball = Oscillator(stiffness=0, load=-1, stops=Stop(0, Rigid(1), "lower"))
    motion = simulate(ball, duration=100.0, initial=(1, 0))
    with pytest.raises(InvalidInput, match="rate"):
        motion.power_spectrum()
    found = motion.power_spectrum("velocity", rate=50.0, segments=1)
    # Thrown up from 0 it is back after 2 sqrt(2 h / g).
    assert found.frequency[np.argmax(found.density)] == pytest.approx(
        1 / (2 * math.sqrt(2)), abs=found.resolution
    )


def test_a_spectrum_that_would_fill_the_memory_is_refused():
    fast = simulate(Oscillator(mass=1e-6, stiffness=1e8), duration=50.0, initial=(1, 0))
    with pytest.raises(InvalidInput, match=r"rate.*at most \d+ samples.*1.02e\+10"):
        fast.power_spectrum()
    assert fast.power_spectrum(rate=100.0).rate == 100.0


def test_counts_alone_have_no_spectrum():
    with pytest.raises(InvalidInput, match="keep"):
        simulate(HARMONIC, periods=50, keep="counts").power_spectrum()
