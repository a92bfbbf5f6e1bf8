"""Noise on the displacement before it is thresholded: what is counted, and what may be skipped."""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np
import pytest

from impactsig import (
    BaseMotion,
    Force,
    Friction,
    Impacts,
    InvalidInput,
    KelvinVoigt,
    Oscillator,
    Rigid,
    Stop,
    measure,
    scenes,
    simulate,
)
from impactsig.simulation.instruments._thresholding import CUT, RELEASE, TRIGGER, _noise, spikes


def beam(frequency=22.1, periods=500, **changes):
    return simulate(scenes.karpodinis(frequency, **changes), periods=periods, transient=300)


def rubbing():
    """Soft stops on both sides, friction, and two forces that beat."""
    return simulate(
        Oscillator(
            damping=0.05,
            forces=(Force(0.5, 0.9), Force(0.3, math.sqrt(2))),
            stops=(Stop(1.0, KelvinVoigt(200.0, 1.0)), Stop(-0.8, KelvinVoigt(300.0), "lower")),
            friction=Friction(0.02),
        ),
        periods=150,
        transient=20,
    )


def moving():
    """A stop on either side of a base that moves at a frequency of its own."""
    return simulate(
        Oscillator(
            damping=0.1,
            forces=(Force(0.6, 0.95),),
            base=BaseMotion(0.2, 0.61803, 0.3, stops=True),
            stops=(Stop(1.0, Rigid(0.7)), Stop(-0.9, Rigid(0.4), "lower")),
        ),
        periods=200,
        phase=2.5,
    )


SCENES = {
    "chaotic": lambda: beam(20.1),
    "moving": moving,
    "rubbing": rubbing,
    "moving stop": lambda: simulate(scenes.okolewski(4, 1.0), periods=200, transient=20),
    "chattering": lambda: simulate(scenes.okolewski(3, 0.6), periods=100, transient=20),
}


@pytest.mark.parametrize("noise", [1e-8, pytest.param(0.003, marks=pytest.mark.slow), 0.03])
@pytest.mark.parametrize("scene", SCENES)
def test_what_is_skipped_could_not_have_mattered(scene, noise):
    motion = SCENES[scene]()
    looked, all_of_it = (
        spikes(motion, noise, None, np.random.default_rng(3), skip=skip) for skip in (True, False)
    )
    np.testing.assert_array_equal(looked.of_impact, all_of_it.of_impact)
    np.testing.assert_array_equal(looked.spurious, all_of_it.spurious)
    assert np.isfinite(looked.of_impact).any()


@pytest.mark.parametrize("make", [beam, lambda: beam(20.1), moving])
def test_next_to_no_noise_counts_every_impact_within_a_sample(make):
    motion = make()
    rate = 2500 / motion.system.forcing_period
    seen = measure(motion, noise=1e-9, rate=rate, seed=1)
    assert len(seen.missed) == 0
    real = seen.source >= 0
    off = seen.impacts.time[real] - motion.impacts.time[seen.source[real]]
    # Half a step of the fastest is what the threshold is short of the stop by.
    velocity = motion.impacts.approach_velocity
    quick = velocity > 0.2  # the others dwell near the stop
    early = 1.1 + 0.55 * velocity.max() / velocity
    assert np.all(np.abs(off[quick]) * rate < early[quick])
    np.testing.assert_array_equal(
        seen.impacts.approach_velocity[real], motion.impacts.approach_velocity
    )


def test_spikes_come_when_white_gaussian_noise_first_crosses_the_threshold():
    """Of independent samples the chance that none has crossed is a product, in closed form."""
    motion, noise, rate = beam(periods=4000), 0.01, 50_000.0
    seen = measure(motion, noise=noise, rate=rate, seed=5)
    assert len(seen.missed) == len(seen.spurious) == 0
    off = seen.impacts.time - motion.impacts.time
    x = motion.sample(np.linspace(motion.start, motion.stop, 1_000_000))[0]
    sigma = noise * x.std()
    threshold = TRIGGER * sigma + 0.5 * 0.5810258993557 * 2 * np.pi * 22.2 / rate

    cross = np.vectorize(NormalDist().cdf)
    phases = np.arange(20) / 20
    moments = np.zeros(2)
    for phase in phases:
        time = (np.arange(-600, 100) + phase) / rate
        short = 1 - motion.sample(motion.impacts.time[10] + time)[0]
        chance = cross((threshold - short) / sigma)
        first = chance * np.concatenate(([1.0], np.cumprod(1 - chance)[:-1]))
        assert first.sum() == pytest.approx(1, abs=1e-9)
        moments += [first @ time, first @ time**2]
    mean, square = moments / len(phases)
    deviation = math.sqrt(square - mean**2)
    assert off.mean() == pytest.approx(mean, abs=5 * deviation / math.sqrt(len(off)))
    assert off.std() == pytest.approx(deviation, rel=5 / math.sqrt(2 * len(off)))


def test_noise_belongs_to_a_sample():
    index = np.arange(400_000)
    drawn = _noise([1, 2], index)
    chosen = np.sort(np.random.default_rng(0).choice(index, 5000, replace=False))
    np.testing.assert_array_equal(_noise([1, 2], chosen), drawn[chosen])
    assert not np.array_equal(_noise([1, 3], chosen), drawn[chosen])
    assert drawn.std() == pytest.approx(1, rel=5 / math.sqrt(2 * len(index)))
    together = np.mean(drawn[1:] * drawn[:-1])
    assert abs(together) < 5 / math.sqrt(len(index))
    assert np.abs(drawn).max() < CUT


def test_an_approach_that_turns_back_in_reach_of_the_noise_is_counted_as_none():
    omega = 0.95
    grazing = math.hypot(1 - omega**2, 0.06 * omega)
    for nearness, counted in ((0.5 * TRIGGER, True), (2 * RELEASE, False)):
        sigma = 0.01  # of an amplitude of 1, whose standard deviation is 1 / sqrt(2)
        scene = Oscillator(
            damping=0.06,
            forces=(Force(grazing * (1 - nearness * sigma / math.sqrt(2)), omega),),
            stops=(Stop(1.0, Rigid(0.5)),),
        )
        motion = simulate(scene, periods=300, transient=100)
        assert motion.impact_count == 0
        seen = measure(motion, noise=sigma, seed=2)
        assert len(seen.impacts) == (300 if counted else 0)
        assert np.all(seen.source == -1)
        if counted:
            period = 2 * np.pi / omega
            assert np.diff(seen.impacts.time).mean() == pytest.approx(period, rel=1e-3)
            assert not seen.impacts.approach_velocity.any()


def test_impacts_without_leaving_are_one_spike():
    """A ball comes to rest: its bounces become lower than the noise, and there are no more."""
    ball = Oscillator(stiffness=0.0, load=-1.0, stops=(Stop(0.0, Rigid(0.5), "lower"),))
    motion = simulate(ball, duration=20.0, initial=(0.5, 0.0))
    seen = measure(motion, noise=0.01, rate=1e4, seed=1)
    spread = motion.sample(np.linspace(0, 20, 200_001))[0].std()
    height = 0.5 * 0.25 ** np.arange(1, 1 + len(motion.impacts))
    apart = np.flatnonzero(height > (RELEASE + 4) * 0.01 * spread)
    together = np.flatnonzero(height < (RELEASE - 5) * 0.01 * spread)
    assert set(apart + 1) <= set(seen.source)
    assert not set(together + 1) & set(seen.source)
    assert len(seen.spurious) == 0
    assert len(seen.missed) == len(motion.impacts) - len(seen.impacts)


def test_the_other_effects_are_what_they_are_without_noise():
    motion = beam(20.1)
    plain = measure(motion, missed=0.1, spurious=0.05, seed=6)
    same = measure(motion.impacts, missed=0.1, spurious=0.05, seed=6)
    np.testing.assert_array_equal(plain.impacts.time, same.impacts.time)
    noisy = measure(motion, noise=0.00713, missed=0.1, spurious=0.05, seed=6)
    counted = measure(motion, noise=0.00713, seed=6)
    assert set(noisy.missed) == set(plain.missed) | set(counted.missed)
    false = plain.impacts.time[plain.spurious]
    assert np.isin(false, noisy.impacts.time).all()
    # Both random: other noise, other instants.
    other = measure(motion, noise=0.00713, seed=7)
    assert not np.array_equal(other.impacts.time, counted.impacts.time)
    again = measure(motion, noise=0.00713, seed=6)
    np.testing.assert_array_equal(again.impacts.time, counted.impacts.time)


def test_an_approach_has_no_strength_to_be_counted_by():
    motion = beam(20.1)
    seen = measure(motion, noise=0.01, seed=1)
    strong = measure(motion, noise=0.01, missed_weak=(0.05, 1e-6), seed=1)
    weak = motion.impacts.approach_velocity[seen.source[seen.source >= 0]] < 0.05
    assert len(seen.spurious) > 0 == len(strong.spurious)
    assert len(strong.impacts) == np.sum(seen.source >= 0) - weak.sum()


def test_what_cannot_be_used_is_named():
    motion = beam(periods=10)
    with pytest.raises(InvalidInput, match="a Motion"):
        measure(Impacts.from_times([1.0, 2.0]), noise=0.01)
    with pytest.raises(InvalidInput, match="noise"):
        measure(motion, noise=-0.1)
    with pytest.raises(InvalidInput, match="rate"):
        measure(motion, noise=0.1, rate=0)
    with pytest.raises(InvalidInput, match="impacts"):
        measure([1.0, 2.0])
    free = simulate(Oscillator(forces=(Force(1.0, 0.5),)), periods=3)
    with pytest.raises(InvalidInput, match="stop"):
        measure(free, noise=0.1)
    counts = simulate(scenes.karpodinis(), periods=3, keep="counts")
    with pytest.raises(InvalidInput, match="keep"):
        measure(counts, noise=0.1)
    ball = Oscillator(stiffness=0.0, load=-1.0, stops=(Stop(0.0, Rigid(0.5), "lower"),))
    with pytest.raises(InvalidInput, match="rate"):
        measure(simulate(ball, duration=1.0, initial=(0.5, 0.0)), noise=0.1)
