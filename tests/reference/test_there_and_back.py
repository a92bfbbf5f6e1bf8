"""Simulated beams recorded and found again: the whole circle against its own truth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import impactsig
from benchmarks.recordings import score
from impactsig import Force
from impactsig.comparison import compare
from impactsig.simulation.instruments.measuring import measure
from impactsig.simulation.instruments.sensors import LoadCell, Microphone
from impactsig.simulation.instruments.synthesis import SPEED_OF_SOUND, synthesize

VOLTS = 0.6  # per unit of approach velocity


def beam(frequency, initial=(0.0, 0.0), seconds=60.0):
    scene = impactsig.scenes.karpodinis(frequency=frequency)
    return impactsig.simulate(
        scene, periods=seconds * frequency, transient=500, initial=initial
    ).impacts


MOTIONS = ((22.1, (0, 0)), (24.0, (0, 0)), (20.1, (0, 0)), (20.1, (0.3, 0.1)))
RATES = (50_000.0, 60_000.0, 100_000.0)


@pytest.mark.parametrize(
    ("frequency", "initial", "rate"),
    [
        # Each motion at one rate, each rate with one motion at least; the others are slow.
        pytest.param(*one, rate, marks=() if k % 3 == place else pytest.mark.slow)
        for k, one in enumerate(MOTIONS)
        for place, rate in enumerate(RATES)
    ],
)
def test_a_load_cell_finds_the_impacts_of_the_beam(frequency, initial, rate):
    truth = beam(frequency, initial)
    noise = 0.1 * VOLTS * np.median(truth.approach_velocity)  # 20 dB below the peaks
    cell = LoadCell(gain=VOLTS, noise=noise, drift=0.02, hum=0.01, unit="V")
    made = synthesize(truth, cell, rate=rate, bits=16, full_scale=2.0, seed=int(rate))
    found = impactsig.detect_impacts(made)
    _, rms, pairs = score(found.time, truth.time)
    missed = np.setdiff1d(np.arange(len(truth)), pairs[:, 1])
    # Chaos has impacts near grazing, weaker than the noise: those, and only those, may be lost.
    assert np.all(VOLTS * truth.approach_velocity[missed] < 3 * noise)
    assert len(missed) < 0.03 * len(truth)
    sure = len(truth) - len(missed)
    assert 2 * len(pairs) / (len(found) + sure) >= 0.995
    assert frequency == 20.1 or len(found) == len(truth) == len(pairs)
    assert rms < 20e-6
    contact = found.contact_time[pairs[:, 0]] - 300e-6
    assert abs(np.median(contact)) < 10e-6
    peak = found.peak[pairs[:, 0]] / (VOLTS * truth.approach_velocity[pairs[:, 1]])
    assert np.median(peak) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(("frequency", "period"), [(22.1, (1, 1)), (20.1, (None, None))])
def test_what_is_read_from_the_record_is_what_was_simulated(frequency, period):
    truth = beam(frequency)
    made = synthesize(truth, LoadCell(gain=VOLTS, noise=0.005), seed=5)
    apart = compare(truth, impactsig.detect_impacts(made), forcing_period=1 / frequency)
    for one in (apart.a, apart.b):
        assert (one.period.impacts, one.period.periods) == period
    assert apart.b.cv == pytest.approx(apart.a.cv, abs=0.01)
    assert apart.interval.wasserstein < 1e-3


@pytest.mark.parametrize(("frequency", "seed"), [(22.1, 1), (20.1, 2), (20.1, 3)])
def test_a_microphone_finds_the_impacts_of_the_beam(frequency, seed):
    truth = beam(frequency)
    microphone = Microphone(distance=0.5, noise=0.1 * np.median(truth.approach_velocity) / 0.5)
    found = impactsig.detect_impacts(synthesize(truth, microphone, seed=seed))
    f1, rms, _ = score(found.time - 0.5 / SPEED_OF_SOUND, truth.time)
    assert f1 >= 0.98
    assert rms < 80e-6


@pytest.mark.parametrize("seed", [1, 2])
def test_a_grazing_beam_is_heard_and_felt_though_it_is_silent_most_of_the_time(seed):
    """Two forces that beat: impacts for some 30 forcing periods, then none for 46 and more."""
    scene = impactsig.scenes.karpodinis(frequency=21.55)
    omega = scene.angular_forcing_frequency
    forces = (Force(0.082, omega), Force(0.0123, omega * (1 + 1 / 80)))
    truth = impactsig.simulate(
        replace(scene, forces=forces), periods=1600, transient=240, phase=np.pi
    ).impacts
    assert np.sum(np.diff(truth.time) > 40 / 21.55) >= 15
    median = np.median(truth.approach_velocity)
    for sensor, allowed in (
        (LoadCell(gain=VOLTS, noise=0.03 * VOLTS * median), 20e-6),
        (Microphone(distance=0.5, noise=0.03 * median / 0.5), 100e-6),
    ):
        late = 0.5 / SPEED_OF_SOUND if isinstance(sensor, Microphone) else 0.0
        found = impactsig.detect_impacts(synthesize(truth, sensor, seed=seed))
        f1, rms, _ = score(found.time - late, truth.time)
        assert f1 >= 0.99
        assert rms < allowed


def test_noise_on_the_displacement_and_a_load_cell_see_the_same_impacts():
    """The experiment at 20.1 Hz, and the simulation with the noise that the thesis fits it by."""
    scene = impactsig.scenes.karpodinis(frequency=20.1)
    motion = impactsig.simulate(scene, periods=1500, transient=500)
    noisy = measure(motion, noise=0.00713, seed=1)
    assert len(noisy.missed) == 0
    # The others are approaches: the beam was within reach of the noise, and turned back.
    near = noisy.impacts.time[noisy.spurious]
    x, _ = motion.sample(near)
    spread = motion.sample(np.linspace(motion.start, motion.stop, 100_000))[0].std()
    assert np.all((x > 1 - 9 * 0.00713 * spread) & (x < 1))
    gap = np.abs(near[:, None] - motion.impacts.time).min(axis=1)
    assert gap.min() > 0.1 / 20.1
    detected = impactsig.detect_impacts(synthesize(motion.impacts, LoadCell(noise=0.01), seed=1))
    hits = noisy.impacts[noisy.source >= 0]
    assert compare(detected, hits).interval.wasserstein < 1e-3


def test_a_worn_instrument_is_told_by_the_comparison():
    truth = beam(22.1)
    seen = measure(truth, jitter=2e-4, missed=0.05, spurious=0.03, seed=4)
    apart = compare(truth, seen.impacts, forcing_period=1 / 22.1)
    assert apart.a.period.missed == 0
    told = apart.b.period
    assert (told.impacts, told.periods) == (1, 1)
    assert told.missed == pytest.approx(len(seen.missed) / len(truth), abs=0.005)
    assert told.spurious == pytest.approx(len(seen.spurious) / len(seen.impacts), abs=0.01)
    assert told.jitter == pytest.approx(2e-4, rel=0.1)
    assert apart.b.cv > 10 * apart.a.cv
