"""A recorded displacement: its velocity, sections and restitution, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import (
    Impacts,
    InvalidInput,
    Recording,
    plot,
    recorded_motion,
    scenes,
    simulate,
    threshold_crossings,
)

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


@pytest.mark.parametrize(("noise", "step"), [(1e-3, 0.0), (1e-2, 0.0), (0.0, 1e-3), (0.0, 1e-2)])
def test_what_is_left_of_noise_and_steps_is_what_is_stated(noise, step):
    t, x, _ = swing(noise)
    true = np.cos(2 * np.pi * 21 * t)
    motion = recorded_motion(record(step * np.round(x / step) if step else x))
    inner = slice(300, -300)
    off = motion.v + 2 * np.pi * 21 * np.sin(2 * np.pi * 21 * t)
    assert 0.75 < np.std((motion.x - true)[inner]) / motion.noise < 1.3
    assert 0.75 < np.std(off[inner]) / motion.velocity_noise < 1.3
    assert motion.noise < 0.35 * max(noise, step / np.sqrt(12))
    assert motion.velocity_noise < 0.01 * 2 * np.pi * 21


def test_of_a_velocity_alone_the_displacement_is_its_integral():
    t, _, _ = swing()
    phase = 2 * np.pi * 21.3 * t
    ratios = []
    for seed in range(12):
        noise = 10.0 * np.random.default_rng(seed).standard_normal(len(t))
        v = -2 * np.pi * 21.3 * np.sin(phase) + 3.0 + noise  # an offset as well
        motion = recorded_motion(Recording(v, RATE, "mm/s"), velocity=0, forcing_period=1 / 21.3)
        ratios.append(np.mean((motion.x - np.cos(phase)) ** 2) / motion.noise**2)
    assert motion.unit == "mm"
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.5)  # few draws of a random walk
    xs, vs = motion.stroboscopic()
    assert xs == pytest.approx(1.0, abs=5 * motion.noise)
    assert vs == pytest.approx(3.0, abs=5 * motion.velocity_noise)


def bounces(restitution, speed, count=10, gravity=9.81):
    """A bouncing ball: instants of touch and velocities before; displacement and velocity."""
    before = speed * restitution ** np.arange(count)
    touch = 0.1 + np.append(0.0, np.cumsum(2 * restitution * before[:-1] / gravity))
    time = np.arange(int((touch[-1] + 0.02) * RATE)) / RATE
    k = np.maximum(np.searchsorted(touch, time, side="right") - 1, 0)
    since = time - touch[k]
    leaves = np.where(since < 0, -before[k], restitution * before[k])
    return touch, leaves * since - 0.5 * gravity * since**2, leaves - gravity * since


@pytest.mark.parametrize(
    ("noise", "step"), [(1e-5, 0.0), (1e-4, 0.0), (1e-4, 1e-4), (0.0, 1e-4), (1e-5, 1e-3)]
)
def test_a_bouncing_ball_keeps_its_share_of_the_velocity(noise, step):
    z, each = [], []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        touch, x, _ = bounces(0.8, rng.uniform(1.9, 2.1))
        x = x + noise * rng.standard_normal(len(x))
        x = step * np.round(x / step) if step else x
        found = recorded_motion(record(x), smoothing=1e-3).restitution(Impacts(touch))
        z.append((found.value - 0.8) / found.error)
        each.append((found.each - 0.8) / found.each_error)
    assert np.sqrt(np.mean(np.square(z))) < 1.5
    assert np.sqrt(np.mean(np.concatenate(each) ** 2)) < 1.25
    if noise >= step:  # of steps alone the error is a bound
        assert np.sqrt(np.mean(np.concatenate(each) ** 2)) > 0.75


def test_noise_does_not_lower_the_coefficient():
    """Noise in what is divided by draws a ratio of sums towards 0."""
    off = []
    for seed in range(25):
        rng = np.random.default_rng(seed)
        touch, x, _ = bounces(0.95, 1.0, 30)
        x = x + 3e-4 * rng.standard_normal(len(x))
        found = recorded_motion(record(x), smoothing=1e-3).restitution(Impacts(touch))
        off.append(found.value - 0.95)
        ratio = -found.approach @ found.departure / (found.approach @ found.approach)
        assert ratio < found.value
    assert abs(np.mean(off)) < 2.5 * found.error / np.sqrt(25)


def test_restitution_of_a_recorded_velocity_and_uncertain_instants():
    each = {"velocity": [], "instants": []}
    for seed in range(12):
        rng = np.random.default_rng(seed)
        touch, x, v = bounces(0.8, rng.uniform(1.9, 2.1))
        noisy = v + 0.02 * rng.standard_normal(len(v))
        found = recorded_motion(record(noisy), velocity=0).restitution(Impacts(touch))
        each["velocity"].append((found.each - 0.8) / found.each_error)
        seen = touch + 1e-3 * rng.standard_normal(len(touch))
        train = Impacts(seen, time_error=np.full(len(touch), 1e-3))
        exact = recorded_motion(record(x + 1e-8 * rng.standard_normal(len(x))), smoothing=1e-3)
        found = exact.restitution(train, within=10e-3)
        each["instants"].append((found.each - 0.8) / found.each_error)
    assert 0.8 < np.std(np.concatenate(each["velocity"])) < 1.2
    assert 0.5 < np.median(np.abs(np.concatenate(each["instants"]))) / 0.6745 < 1.5
    train = Impacts(touch, time_error=np.where(np.arange(len(touch)) == 3, np.inf, 0.0))
    assert 3 not in exact.restitution(train).impacts


def test_stroboscopic_by_channel_and_by_period():
    _, x, forcing = swing(1e-4)
    by_channel = recorded_motion(record(x, forcing), "c0", forcing="c1")
    # The forcing is greatest where the swing goes up through 0.
    xs, vs = by_channel.stroboscopic()
    assert len(xs) == pytest.approx(105, abs=1)
    assert xs[2:-2] == pytest.approx(0, abs=2e-3)
    assert vs[2:-2] == pytest.approx(2 * np.pi * 21, rel=2e-3)
    by_period = recorded_motion(record(x), forcing_period=1 / 21.0)
    xs, vs = by_period.stroboscopic(np.pi / 2)
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
    exact = recorded_motion(record(np.cos(np.arange(4000) * np.pi / 100)), smoothing=5e-4)
    sides = [exact.crossings(0.0, one).time for one in ("up", "down")]  # at samples
    np.testing.assert_allclose(sides[0], np.arange(150, 4000, 200) / RATE, atol=1e-9)
    np.testing.assert_allclose(sides[1], np.arange(50, 4000, 200) / RATE, atol=1e-9)
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
    truth = motion.system.stops[0].law.restitution
    assert found.value == pytest.approx(truth, abs=max(4 * found.error, 2e-3))
    assert found.error < 0.05
    good = np.abs(found.approach) > 0.2 * np.abs(found.approach).max()
    assert np.median(np.abs(found.each - truth)[good]) < 0.1


def test_a_phase_portrait_is_drawn():
    _, x, _ = swing(1e-4, duration=0.5)
    ax = plot.phase_portrait(recorded_motion(record(x), forcing_period=1 / 21.0))
    assert ax.get_xlabel() == "displacement $x$ [mm]"
    assert len(ax.lines) == 2


def test_refusals():
    _, x, forcing = swing()
    with pytest.raises(InvalidInput, match="displacement"):
        recorded_motion(record(x, forcing))
    with pytest.raises(InvalidInput, match="one of the two"):
        recorded_motion(record(x, forcing), "c0", forcing="c1", forcing_period=1 / 21.0)
    with pytest.raises(InvalidInput, match="nan at sample 3"):
        recorded_motion(record(np.where(np.arange(len(x)) == 3, np.nan, x)))
    with pytest.raises(InvalidInput, match="velocity: got c0; required: another channel"):
        recorded_motion(record(x, forcing), "c0", velocity="c0")
    with pytest.raises(InvalidInput, match="forcing: got 1 throughout"):
        recorded_motion(record(x, np.ones(len(x))), "c0", forcing="c1")
    with pytest.raises(InvalidInput, match="smoothing"):
        recorded_motion(record(x), velocity=0, smoothing=1e-3)
    with pytest.raises(InvalidInput, match="16 or more"):
        recorded_motion(record(x[:5]))
    with pytest.raises(InvalidInput, match="from_times"):
        recorded_motion(record(x)).restitution(x)
    with pytest.raises(InvalidInput, match="room beside them"):
        recorded_motion(record(x)).restitution(Impacts([1.0]), within=1e-4)


def test_a_recorded_motion_is_not_simulated_to_find_its_crossings():
    with pytest.raises(InvalidInput, match=r"a Flow\. A RecordedMotion has a method crossings"):
        threshold_crossings(recorded_motion(record(swing()[1]), smoothing=1e-3), 0.5)
    with pytest.raises(InvalidInput, match=r"a Flow\. recorded_motion\(recording\)\.crossings"):
        threshold_crossings(record(swing()[1]), 0.5)


@pytest.mark.parametrize("kind", ["displacement", "velocity"])
@pytest.mark.parametrize("noise", [0.0, 1e-5])
def test_restitution_where_the_motion_bends_more_than_a_cubic(kind, noise):
    """Of exact records the stated error was once a twelfth of the actual one."""
    rate, z = 5000.0, []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        # Half oscillations of random frequency that grow, so that each returns with another speed.
        speed, approach = 3.0, rng.uniform(1, 4, 25)
        parts, time = [], [0.0]
        for u in approach:
            turn = 2 * np.pi * rng.uniform(3, 6)
            growth = np.log(u / speed) * turn / np.pi
            first = np.ceil(time[-1] * rate)
            time.append(time[-1] + np.pi / turn)
            t = np.arange(first, np.ceil(time[-1] * rate)) / rate - time[-2]
            sine, cosine = np.sin(turn * t), np.cos(turn * t)
            x, v = speed / turn * sine, speed * (growth / turn * sine + cosine)
            parts.append(np.exp(growth * t) * (x if kind == "displacement" else v))
            speed = 0.7 * u
        samples = np.concatenate(parts)
        samples += noise * rng.standard_normal(len(samples))
        instants = Impacts.from_times(
            time[1:-1] + rng.normal(0, 1e-6, 24), time_error=np.full(24, 1e-6)
        )
        channel = {kind: 0}
        motion = recorded_motion(Recording(samples, rate, units="m"), **channel)
        found = motion.restitution(instants)
        z.append((found.value - 0.7) / found.error)
    assert np.sqrt(np.mean(np.square(z))) < 1.5
