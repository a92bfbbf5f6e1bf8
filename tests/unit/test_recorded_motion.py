"""A recorded displacement: its velocity, sections and restitution, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import Impacts, InvalidInput, Recording, plot, recorded_motion, scenes, simulate

RATE = 10_000.0


def record(*columns, names=None, **more):
    samples = np.column_stack(columns)
    names = names or tuple(f"c{i}" for i in range(len(columns)))
    return Recording(samples, RATE, channels=names, units=("mm",) * len(columns), **more)


def swing(noise=0.0, seed=0, duration=5.0):
    """x = cos(2 pi 21 t), and its forcing a quarter turn ahead."""
    t = np.arange(int(duration * RATE)) / RATE
    rng = np.random.default_rng(seed)
    x = np.cos(2 * np.pi * 21 * t) + noise * rng.standard_normal(len(t))
    return t, x, np.cos(2 * np.pi * 21 * t + np.pi / 2)


@pytest.mark.parametrize("noise", [1e-4, 1e-3, 1e-2])
def test_velocity_and_what_noise_leaves_of_it(noise):
    t, x, _ = swing(noise)
    motion = recorded_motion(record(x))
    speed = 2 * np.pi * 21
    error = motion.v + speed * np.sin(speed * t)
    inner = slice(200, -200)
    assert np.std(error[inner]) < 2.0 * motion.velocity_noise
    assert motion.velocity_noise < 0.02 * speed
    assert motion.noise < 0.6 * noise


def test_stroboscopic_by_channel_and_by_frequency():
    _, x, forcing = swing(1e-4)
    by_channel = recorded_motion(record(x, forcing), "c0", forcing="c1")
    # The forcing is greatest where the swing goes up through 0.
    xs, vs = by_channel.stroboscopic()
    assert len(xs) == pytest.approx(105, abs=1)
    assert xs[2:-2] == pytest.approx(0, abs=2e-3)
    assert vs[2:-2] == pytest.approx(2 * np.pi * 21, rel=2e-3)
    by_frequency = recorded_motion(record(x), frequency=21.0)
    xs, vs = by_frequency.stroboscopic(np.pi / 2)
    assert xs == pytest.approx(0, abs=2e-3)
    assert vs[2:-2] == pytest.approx(-2 * np.pi * 21, rel=2e-3)
    with pytest.raises(InvalidInput, match="forcing"):
        recorded_motion(record(x)).stroboscopic()


def test_crossings_have_their_errors():
    z = []
    for seed in range(3):
        _, x, _ = swing(3e-3, seed)
        found = recorded_motion(record(x), smoothing=1.1e-3).crossings(0.5)
        k = np.arange(1, 106)
        truth = (k - 1 / 6) / 21
        assert len(found) == 105
        z.append((found.time - truth) / found.time_error)
    assert 0.8 < np.std(z) < 1.25
    both = recorded_motion(record(x)).crossings(0.5, "both")
    down = recorded_motion(record(x)).crossings(0.5, "down")
    assert len(both) == len(found) + len(down)


@pytest.mark.parametrize("noise", [0.0, 2e-3])
def test_the_restitution_coefficient_is_found(noise):
    motion = simulate(scenes.karpodinis(20.1), periods=60, transient=50, keep="all")
    time = motion.start + np.arange(int(motion.duration * 50_000)) / 50_000
    x, _ = motion.sample(time)
    rng = np.random.default_rng(1)
    x = x + noise * np.std(x) * rng.standard_normal(len(x))
    seen = Recording(x, 50_000.0, start=motion.start)
    found = recorded_motion(seen).restitution(motion.impacts, within=2e-3)
    truth = motion.oscillator.stops[0].law.restitution
    assert found.value == pytest.approx(truth, abs=max(4 * found.error, 2e-3))
    assert found.error < 0.05
    good = np.abs(found.approach) > 0.2 * np.abs(found.approach).max()
    assert np.median(np.abs(found.each - truth)[good]) < 0.1


def test_a_phase_portrait_is_drawn():
    _, x, _ = swing(1e-4, duration=0.5)
    ax = plot.phase_portrait(recorded_motion(record(x), frequency=21.0))
    assert ax.get_xlabel() == "displacement $x$ [mm]"
    assert len(ax.lines) == 2


def test_refusals():
    _, x, forcing = swing()
    with pytest.raises(InvalidInput, match="displacement"):
        recorded_motion(record(x, forcing))
    with pytest.raises(InvalidInput, match="one of the two"):
        recorded_motion(record(x, forcing), "c0", forcing="c1", frequency=21.0)
    with pytest.raises(InvalidInput, match="nan at sample 3"):
        recorded_motion(record(np.where(np.arange(len(x)) == 3, np.nan, x)))
    with pytest.raises(InvalidInput, match="16 or more"):
        recorded_motion(record(x[:5]))
    with pytest.raises(InvalidInput, match="room beside them"):
        recorded_motion(record(x)).restitution(Impacts([1.0]), within=1e-4)
