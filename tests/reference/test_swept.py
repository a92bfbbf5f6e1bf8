"""Motion under a swept force, against Duhamel's integral and an independent integration."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import impactsig as im

PARTS = {"frequency_rate": 0.004, "amplitude_rate": 0.02, "start": 5.0}
BEAM = im.scenes.karpodinis(20.0)
FORCE = im.Force(0.5, 0.6, 0.3)


def force(t, frequency_rate, amplitude_rate, start):
    """The docstring's formula, written again."""
    s = max(t - start, 0)
    angle = 0.6 * t + 2 * math.pi * frequency_rate * s**2 / 2 + 0.3
    return (0.5 + amplitude_rate * s) * mpmath.cos(angle)


def test_without_a_stop_it_is_duhamels_integral():
    swept = im.Swept(im.Oscillator(damping=0.1, forces=(FORCE,)), **PARTS)
    motion = im.simulate(swept, duration=25.0)
    mpmath.mp.dps = 20
    omega = mpmath.sqrt(1 - 0.05**2)
    breaks = [0.0, 5.0, 10.0, 15.0, 20.0, 25.0]
    for time in (5.0, 15.0, 25.0):

        def memory(t, time=time):
            lag = time - t
            return mpmath.exp(-0.05 * lag) * mpmath.sin(omega * lag) / omega * force(t, **PARTS)

        wanted = mpmath.quad(memory, [at for at in breaks if at <= time])
        assert motion.sample(time)[0] == pytest.approx(float(wanted), abs=1e-11)


@pytest.mark.parametrize("law", [im.Rigid(0.6), im.KelvinVoigt(50.0, 1.0), im.Hertz(80.0)])
def test_impacts_are_those_of_an_independent_integration(law):
    machine = im.Oscillator(damping=0.1, forces=(FORCE,), stops=(im.Stop(0.4, law),))
    motion = im.simulate(im.Swept(machine, **PARTS), duration=20.0)

    def rates(t, y):
        push = 0.0
        depth = y[0] - 0.4
        if depth > 0 and isinstance(law, im.KelvinVoigt):
            push = 50.0 * depth + 1.0 * y[1]
        if depth > 0 and isinstance(law, im.Hertz):
            push = 80.0 * depth**1.5
        return [y[1], float(force(t, **PARTS)) - 0.1 * y[1] - y[0] - push]

    def touch(t, y):
        return y[0] - 0.4

    touch.direction = 1
    touch.terminal = True
    time, state, touches = 0.0, [0.0, 0.0], []
    while time < 20.0:
        # The corner at the start of the sweep is where an integration may not step over.
        end = 5.0 if time < 5.0 else 20.0
        run = solve_ivp(rates, (time, end), state, "DOP853", events=touch, rtol=1e-12, atol=1e-13,
                        max_step=0.02)  # fmt: skip
        time, state = run.t[-1], list(run.y[:, -1])
        if len(run.t_events[0]):
            touches.append(time)
            if isinstance(law, im.Rigid):
                state = [0.4, -0.6 * state[1]]
            else:
                state[0] = 0.4 + 1e-15
    assert len(touches) > 2
    if isinstance(law, im.Rigid):
        assert motion.impacts.time == pytest.approx(touches, abs=1e-9)
    else:
        assert motion.impacts.time == pytest.approx(touches, abs=2e-6)


def test_in_seconds_a_sweep_is_that_of_the_rig():
    up = im.Swept(BEAM, frequency_rate=0.5, start=3.0)
    motion = im.simulate(up, duration=8.0, transient=2.0)
    assert up.frequency([0.0, 3.0, 10.0]) == pytest.approx([20.0, 20.0, 23.5])
    assert up.phase(10.0) == pytest.approx(2 * math.pi * (200 + 0.25 * 49))
    slow, fast = ((motion.impacts.time > a) & (motion.impacts.time < a + 1) for a in (2.0, 9.0))
    assert fast.sum() > slow.sum() > 0
    _, velocity = motion.sample(motion.impacts.time)
    assert np.isfinite(velocity).all()


def test_without_a_sweep_it_is_the_steady_motion():
    beam = im.scenes.karpodinis(22.1)
    still = im.simulate(im.Swept(beam), duration=2.0, transient=1.0, phase=0.4)
    exact = im.simulate(beam, duration=2.0, transient=1.0, phase=0.4)
    assert still.impacts.time == pytest.approx(exact.impacts.time, abs=1e-11)
    for ours, theirs in zip(still.stroboscopic(1.0), exact.stroboscopic(1.0), strict=True):
        assert ours == pytest.approx(theirs, abs=1e-7)
    assert math.remainder(still.final[2] - exact.final[2], math.tau) == pytest.approx(0, abs=1e-9)


def test_a_run_goes_on_from_its_end():
    beam = im.scenes.karpodinis(22.1)
    up = im.simulate(im.Swept(beam, 0.5), duration=2.0)
    x, v, phase = up.final
    down = im.Swept(im.scenes.karpodinis(23.1), -0.5)
    back = im.simulate(down, duration=2.0, initial=(x, v), phase=phase)
    assert down.frequency(2.0) == pytest.approx(22.1)
    assert np.max(np.diff(back.impacts.time)) < 0.2


def test_stroboscopic_states_are_a_turn_of_the_force_apart():
    sweep = im.Swept(im.scenes.karpodinis(22.1), 0.5, start=0.3)
    motion = im.simulate(sweep, duration=2.0, transient=0.1)
    x, _ = motion.stroboscopic(0.7)
    times = sweep.times_of(0.7 + 2 * math.pi * np.arange(200))
    assert sweep.phase(times) == pytest.approx(0.7 + 2 * math.pi * np.arange(200), rel=1e-14)
    inside = times[(times >= motion.start) & (times <= motion.stop)]
    assert len(x) == len(inside)
    assert x == pytest.approx(motion.sample(inside)[0], abs=1e-12)


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda: im.Swept(im.Oscillator(damping=0.1)), "oscillator"),
        (lambda: im.Swept(im.scenes.okolewski(4.0, 0.6)), "oscillator"),
        (lambda: im.Swept(im.flows.lorenz()), "oscillator"),
        (lambda: im.Swept(BEAM, start=-1.0), "start"),
        (lambda: im.simulate(im.Swept(BEAM, -1.0), duration=30.0), "duration"),
        (lambda: im.simulate(im.Swept(BEAM, -1.0)), "duration"),
        (lambda: im.simulate(im.Swept(BEAM), periods=3), "periods"),
        (lambda: im.Swept(BEAM).frequency([0.0, math.nan]), "time"),
    ],
)
def test_what_cannot_be_swept_is_refused(call, argument):
    with pytest.raises(im.InvalidInput) as caught:
        call()
    assert caught.value.argument == argument
