"""A beam in several modes before a stop: against one mode, a slow twin, and the laws it obeys."""

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
    apparent_restitution,
    scenes,
    simulate,
)
from tests import naive_beam

DRAWING = (0.2, 0.025, 1e-3, 210e9, 7850.0)
BEAM = Cantilever(*DRAWING)
FIRST = float(BEAM.frequencies(1)[0])
PERIOD = 1 / FIRST


def base(frequency, phase=0.0, amplitude=0.2e-3, rides=False):
    return BaseMotion(amplitude, 2 * math.pi * frequency, phase, stops=rides)


# -- one mode --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("law", "loading", "frequency", "amplitude"),
    [
        (Rigid(0.2), "base", 20, 2e-4),
        (Rigid(0.7), "clamp", 21, 2e-4),
        (Rigid(0.5), "tip", 5, 0.6),  # chatter and sticks
        (KelvinVoigt(5000.0, 0.5), "tip", 21, 0.04),
        (KelvinVoigt(5000.0, 0.5), "clamp", 21, 2e-4),
    ],
)
def test_one_mode_is_the_exact_oscillator(law, loading, frequency, amplitude):
    stop = Stop(1e-3, law)
    scene = scenes.cantilever(*DRAWING, 1e-3, frequency, amplitude, loading, stops=stop)
    forcing = Force(amplitude, 2 * math.pi * frequency)
    if loading != "tip":
        forcing = base(frequency, amplitude=amplitude, rides=loading == "base")
    at_clamp = (amplitude if loading == "clamp" else 0.0, 0.0)  # at rest in it
    one = simulate(scene, periods=60, initial=at_clamp)
    motion = simulate(replace(BEAM, stop=stop, modes=1, forcing=forcing), periods=60)
    assert len(motion.impacts) == one.impact_count > 20
    assert len(motion.sticks) == one.stick_count
    assert motion.impacts.time == pytest.approx(one.impacts.time, abs=1e-12)
    speeds = one.impacts.approach_velocity
    assert motion.impacts.approach_velocity == pytest.approx(speeds, abs=1e-12)
    if isinstance(law, KelvinVoigt):
        assert motion.impacts.contact_time == pytest.approx(one.impacts.contact_time, abs=1e-12)
        assert motion.impacts.peak == pytest.approx(one.impacts.peak, rel=1e-7)
        assert motion.energy_lost is None
    else:
        assert motion.energy_lost == pytest.approx(one.energy_lost, rel=1e-11)
        assert motion.sticks == pytest.approx(one.sticks, abs=1e-12)
    time = np.linspace(one.start, one.stop, 501)
    for found, expected in zip(motion.sample(time), one.sample(time), strict=True):
        assert found == pytest.approx(expected, abs=1e-12)


def test_one_mode_appears_as_its_stop():
    motion = simulate(
        replace(BEAM, stop=Stop(1e-3, Rigid(0.3)), modes=1, forcing=base(21, rides=True)),
        periods=50,
    )
    result = apparent_restitution(motion)
    assert result.each == pytest.approx(np.full(len(result.each), 0.3), abs=1e-12)
    assert result.value == pytest.approx(0.3, abs=1e-12)
    assert result.error < 1e-12
    assert np.all(result.impacts == 1)
    assert np.all(result.contact_time == 0)


# -- several modes ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("stop", "modes", "forcing", "duration", "initial"),
    [
        (Stop(1e-3, Rigid(0.8)), 3, base(21, 0.3, 3e-4), 0.04, (-2e-3, 0.1)),
        (
            Stop(-1e-3, Rigid(0.9), "lower"), 4, Force(0.02, 160.0, 0.3), 0.04,
            ((0, 1e-4), (-0.2, 0.1)),
        ),
        (Stop(5e-4, KelvinVoigt(2e4, 0.3)), 3, base(21, 0.3, 3e-4), 0.03, (0.0, 0.2)),
    ],
)  # fmt: skip
def test_slow_twin(stop, modes, forcing, duration, initial):
    time, speed, final, lost = naive_beam.simulate_beam(
        BEAM, stop, modes, forcing, 0.02, duration, initial
    )
    motion = simulate(
        replace(BEAM, stop=stop, modes=modes, forcing=forcing, damping_ratio=0.02),
        duration=duration,
        initial=initial,
    )
    assert len(time) >= 2
    assert motion.impacts.time == pytest.approx(time, abs=1e-11)
    assert motion.impacts.approach_velocity == pytest.approx(speed, abs=1e-9)
    assert np.concatenate(motion.final[:2]) == pytest.approx(final, abs=1e-9)
    if motion.energy_lost is not None:
        assert motion.energy_lost == pytest.approx(lost, rel=1e-8)


@pytest.mark.parametrize("modes", [1, 2, 5, 16])
@pytest.mark.parametrize("restitution", [1.0, 0.7])
def test_energy_is_kept_or_lost_in_impacts(modes, restitution):
    motion = simulate(
        replace(BEAM, stop=Stop(1e-3, Rigid(restitution)), modes=modes, damping_ratio=0.0),
        duration=1.0,
        initial=(-3e-3, 0.2),
    )
    before, after = motion.energy([0.0, 1.0]).sum(axis=1)
    assert len(motion.impacts) > 10
    # Each impact leaves a rounding; so does what a chatter's cut-off takes.
    assert after + motion.energy_lost == pytest.approx(before, rel=1e-12)
    assert (motion.energy_lost == 0) == (restitution == 1)


@pytest.mark.parametrize("restitution", [0.0, 0.6])
def test_forced_and_damped_energy_is_balanced(restitution):
    """What the forcing brings goes into the modes, their damping and the stop; by quadrature.

    The stop holds the tip in this motion, so a force that pins it must do no work.
    """
    modes, ratio = 4, 0.03
    forcing = Force(0.1, 2 * math.pi * 17, 0.3)
    motion = simulate(
        replace(
            BEAM,
            stop=Stop(2e-4, Rigid(restitution)),
            modes=modes,
            forcing=forcing,
            damping_ratio=ratio,
        ),
        periods=4,
        transient=3,
    )
    assert len(motion.sticks) > 3
    cuts = np.unique(
        np.concatenate([
            np.linspace(motion.start, motion.start + motion.duration, 400),
            motion.impacts.time, motion.sticks.ravel(),
        ])
    )  # fmt: skip
    nodes, weights = np.polynomial.legendre.leggauss(12)
    middle, half = (cuts[1:] + cuts[:-1]) / 2, np.diff(cuts) / 2
    time = middle[:, None] + half[:, None] * nodes
    _q, v = motion.modal(time)
    rates = 2 * math.pi * motion.frequencies
    push = forcing.amplitude * np.cos(forcing.angular_frequency * time + forcing.phase)
    power = push * v.sum(axis=-1) - (2 * ratio * rates * BEAM.modal_mass * v**2).sum(axis=-1)
    work = float((power * weights * half[:, None]).sum())
    before, after = motion.energy([motion.start, motion.start + motion.duration]).sum(axis=1)
    size = motion.energy_lost
    assert after - before == pytest.approx(work - motion.energy_lost, abs=1e-10 * size)


def test_the_stop_holds_the_tip_with_one_force_that_pushes():
    """While it does, every mode misses the same force, towards the beam, and the tip is still."""
    forcing = Force(0.1, 2 * math.pi * 17, 0.3)
    motion = simulate(
        replace(BEAM, stop=Stop(2e-4, Rigid(0.4)), modes=5, forcing=forcing), periods=6
    )
    begin, end = max(motion.sticks, key=np.ptp)
    time = np.linspace(begin, end, 42)[1:-1]
    h = 1e-7
    q, v = motion.modal(time)
    a = (motion.modal(time + h)[1] - motion.modal(time - h)[1]) / (2 * h)
    rates = 2 * math.pi * motion.frequencies
    push = (
        forcing.amplitude
        * np.cos(forcing.angular_frequency * time + forcing.phase)
        / BEAM.modal_mass
    )
    force = a + 0.06 * rates * v + rates**2 * q - push[:, None]
    assert force == pytest.approx(force[:, :1] * np.ones(5), rel=1e-4, abs=1e-2)
    assert np.all(force[:, 0] < 0)
    place, speed = motion.sample(time)
    assert place == pytest.approx(np.full(40, 2e-4), abs=1e-17)
    assert speed == pytest.approx(np.zeros(40), abs=1e-15)


@pytest.mark.parametrize("seed", range(6))
def test_the_tip_never_gets_past_the_stop(seed):
    rng = np.random.default_rng(seed)
    side, sign = ("upper", 1) if seed % 2 else ("lower", -1)
    position = sign * rng.choice([0.0, 3e-4, 1e-3])
    forcing = [None, Force(0.1, 300.0), base(15, 0.3), base(30, 0.3, rides=True)][seed % 4]
    motion = simulate(
        replace(
            BEAM,
            stop=Stop(position, Rigid(rng.uniform(0, 0.9)), side),
            modes=int(rng.integers(2, 11)),
            forcing=forcing,
            damping_ratio=0.01,
        ),
        duration=8 * PERIOD,
        initial=(-sign * 2e-3, 0.0),
    )
    assert motion.status == "complete"
    assert len(motion.impacts) > 3
    time = np.linspace(0, motion.duration, 20_001)
    assert (sign * (motion.sample(time)[0] - position)).max() < 1e-15


def test_the_motion_does_not_hang_on_where_chatter_is_cut_off():
    """The cut-off changes how many impacts are listed, the motion by the square of it."""
    final, counts = [], []
    for chatter in (1e-2, 1e-4, 1e-8):
        motion = simulate(
            replace(
                BEAM,
                stop=Stop(2e-4, Rigid(0.6)),
                modes=4,
                forcing=Force(0.1, 2 * math.pi * 17, 0.3),
            ),
            periods=5.3,
            chatter=chatter,
        )
        final.append(np.concatenate(motion.final[:2]))
        counts.append(len(motion.impacts))
    assert counts[0] < counts[1] < counts[2]
    assert np.abs(final[0] - final[2]).max() < 1e-4
    assert np.abs(final[1] - final[2]).max() < 1e-8


def test_going_on_is_the_whole():
    beam = replace(
        BEAM, stop=Stop(1e-3, Rigid(0.5)), modes=4, forcing=base(21, 0.2), damping_ratio=0.02
    )
    whole = simulate(beam, periods=6)
    first = simulate(beam, periods=3.3)
    q, v, phase = first.final
    rest = simulate(beam, periods=2.7, initial=(q, v), phase=phase)
    assert np.concatenate(rest.final[:2]) == pytest.approx(
        np.concatenate(whole.final[:2]), abs=1e-11
    )
    late = simulate(beam, periods=2.7, transient=3.3)
    assert late.final[0] == pytest.approx(whole.final[0], abs=1e-13)
    assert late.impacts.time == pytest.approx(whole.impacts.between(late.start).time, abs=1e-13)


def test_without_a_stop_each_mode_rings_by_itself():
    motion = simulate(
        replace(BEAM, modes=3, damping_ratio=[0.0, 0.1, 0.5]),
        duration=0.5,
        initial=((1e-3, 2e-3, -1e-3), 0.0),
    )
    time = np.linspace(0, 0.5, 200)
    w, z = 2 * math.pi * BEAM.frequencies(3), np.array([0.0, 0.1, 0.5])
    damped = w * np.sqrt(1 - z**2)
    angle = damped * time[:, None]
    ring = np.exp(-z * w * time[:, None]) * (np.cos(angle) + z * w / damped * np.sin(angle))
    assert motion.modal(time)[0] == pytest.approx(ring * [1e-3, 2e-3, -1e-3], abs=1e-15)
    shape = sum(a * BEAM.mode_shape(n + 1, [0.1, 0.2]) for n, a in enumerate([1e-3, 2e-3, -1e-3]))
    assert motion.deflection(0.0, [0.1, 0.2]) == pytest.approx(shape, abs=1e-15)
    assert len(motion.impacts) == 0


def test_peaks_of_soft_contacts():
    soft = KelvinVoigt(3e4, 0.4)
    motion = simulate(
        replace(BEAM, stop=Stop(-2e-4, soft, "lower"), modes=6, forcing=base(21)), periods=6
    )
    impacts = motion.impacts
    assert len(impacts) > 5
    for begin, lasts, peak in zip(impacts.time, impacts.contact_time, impacts.peak, strict=True):
        x, v = motion.sample(begin + lasts * np.linspace(0, 1, 20_001)[1:-1])
        force = -(soft.stiffness * (x + 2e-4) + soft.damping * v)
        assert force.max() == pytest.approx(peak, rel=1e-3)  # it may be at the touch itself
        assert force.max() <= peak * (1 + 1e-9)


def test_velocities_before_and_after_impacts():
    motion = simulate(
        replace(BEAM, stop=Stop(1e-3, Rigid(0.6)), modes=3, forcing=base(21)), periods=30
    )
    q, before, after = motion.modal_at_impacts()
    assert q.shape == before.shape == after.shape == (len(motion.impacts), 3)
    # The same impulse on every mode.
    change = (before - after) * BEAM.modal_mass
    assert change == pytest.approx(np.repeat(motion.impacts.impulse[:, None], 3, axis=1), rel=1e-9)
    later = motion.modal(motion.impacts.time)[1]
    assert later == pytest.approx(after, abs=1e-12)


# -- what the beam as a whole does -----------------------------------------------------------------


def thrown(restitution, modes, ratio=0.03, law=None):
    """The first mode meets a stop at its place of rest, nothing else moving or pushing."""
    return simulate(
        replace(BEAM, stop=Stop(0.0, law or Rigid(restitution)), modes=modes, damping_ratio=ratio),
        duration=0.8 * PERIOD,
        initial=(0.0, 1.0),
    )


def test_two_modes_in_closed_form():
    """One plastic impact, after which the tip is held and the rest swings about it."""
    motion = thrown(0.0, 2, 0.0)
    w = 2 * math.pi * BEAM.frequencies(2)
    # q1 = -q2 = u; u'' = -(w1^2 + w2^2) / 2 u, from u' = 1/2: the force vanishes with u.
    pinned = math.sqrt((w**2).mean())
    assert motion.sticks[0] == pytest.approx([0.0, math.pi / pinned], abs=1e-14)
    result = apparent_restitution(motion)
    assert result.value == pytest.approx(0.5, abs=1e-12)
    assert result.contact_time == pytest.approx([math.pi / pinned], abs=1e-14)


def test_many_modes_forget_the_coefficient_of_the_tip():
    """And one contact is a burst: the more modes, the less the tip's own coefficient matters."""
    spread = []
    for modes in (1, 4, 12, 24):
        results = [apparent_restitution(thrown(r, modes)) for r in (0.1, 0.5, 0.9)]
        values = [result.value for result in results]
        spread.append(max(values) - min(values))
    assert spread[0] == pytest.approx(0.8)
    assert np.all(np.diff(spread) < 0)
    assert spread[-1] < 2e-3
    assert 0.6 < values[-1] < 0.65  # far below the 0.9 of the tip
    assert results[-1].impacts[0] > 100


def test_converges_with_the_number_of_modes():
    """Of a soft stop, whose contact is smooth, much faster than of a rigid one."""
    soft = KelvinVoigt(2e4, 0.5)
    values = [apparent_restitution(thrown(0, n, law=soft)).value for n in (2, 4, 8, 16, 32)]
    gone = np.abs(np.array(values[:-1]) - values[-1])
    assert np.all(gone[1:] < 0.6 * gone[:-1])
    assert gone[-1] < 1e-4
    rigid = [apparent_restitution(thrown(0.5, n)).value for n in (8, 16, 32)]
    assert abs(rigid[1] - rigid[2]) < 2e-3 < abs(rigid[0] - rigid[2])


def test_apparent_restitution_tells_contacts_from_impacts():
    motion = simulate(
        replace(BEAM, stop=Stop(1e-3, Rigid(0.8)), modes=6, forcing=base(21, rides=True)),
        periods=60,
        transient=20,
    )
    result = apparent_restitution(motion)
    first, _size = motion.impacts.bursts(result.within)
    assert result.impacts.sum() <= len(motion.impacts)
    assert len(result.each) + result.left_out == len(first)
    assert set(result.time) <= set(motion.impacts.time[first])
    assert result.impacts.mean() > 1.5
    assert result.value == pytest.approx(
        -np.polynomial.polynomial.polyfit(result.approach, result.departure, [1])[1]
    )
    assert str(result).startswith("ApparentRestitution(")


# -- bad input -------------------------------------------------------------------------------------

STOP = Stop(1e-3, Rigid(0.5))


@pytest.mark.parametrize(
    ("change", "argument"),
    [
        ({"stop": 1e-3}, "stop"),
        ({"stop": Stop(1e-3, KelvinVoigt(1e4, 1.0, "force"))}, "stop.law"),
        ({"stop": Stop(1e-3, Rigid(lambda v: 0.5))}, "stop.law"),
        ({"modes": 0}, "modes"),
        ({"modes": 1000}, "modes"),
        ({"damping_ratio": [0.1, 0.2]}, "damping_ratio"),
        ({"damping_ratio": 1.0}, "damping_ratio"),
        ({"damping_ratio": "some"}, "damping_ratio"),
        ({"damping_ratio": 0.0, "forcing": base(FIRST)}, "damping_ratio"),
        ({"duration": None}, "periods, duration"),
        ({"periods": 3}, "periods, duration"),
        ({"duration": None, "periods": 3}, "periods"),
        ({"duration": -1}, "duration"),
        ({"transient": -1}, "transient"),
        ({"chatter": 0.5}, "chatter"),
        ({"phase": math.nan}, "phase"),
        ({"initial": 0.0}, "initial"),
        ({"initial": (np.zeros(9), 0.0)}, "initial"),
        ({"initial": (math.nan, 0.0)}, "initial"),
        ({"initial": (2e-3, 0.0)}, "initial"),
        ({"forcing": 3.0}, "forcing"),
        ({"forcing": BaseMotion(1e-3, 10.0, spring=False)}, "forcing"),
    ],
)
def test_what_cannot_be_is_refused_by_name(change, argument):
    parts = {"stop": STOP, "modes": 4, "forcing": None, "damping_ratio": 0.03}
    run = {"duration": 0.1} | {name: own for name, own in change.items() if name not in parts}
    own = {name: change.get(name, part) for name, part in parts.items()}
    with pytest.raises(InvalidInput) as caught:
        simulate(replace(BEAM, **own), **run)
    assert caught.value.argument == argument


def test_motions_refuse_too():
    motion = simulate(replace(BEAM, stop=STOP, modes=2), duration=0.1, initial=(0.0, 0.01))
    with pytest.raises(InvalidInput, match="times in the span"):
        motion.sample(0.2)
    with pytest.raises(InvalidInput, match="a complete contact"):
        apparent_restitution(motion)
    with pytest.raises(InvalidInput, match="within"):
        apparent_restitution(motion, within=-1)
    with pytest.raises(InvalidInput, match="a BeamMotion"):
        apparent_restitution(simulate(scenes.karpodinis(), periods=3))
    assert repr(motion) == "BeamMotion(2 modes, 0 impacts in 0.1 s)"


def test_an_elastic_tip_that_is_pressed_bounces_without_end():
    motion = simulate(
        replace(
            BEAM,
            stop=Stop(1e-4, Rigid(1.0)),
            modes=10,
            damping_ratio=0.3,
            forcing=Force(0.15, 60.0),
        ),
        duration=PERIOD,
    )
    assert motion.status == "work limit"
    assert repr(motion).endswith("; work limit)")
    assert 0 < motion.duration < PERIOD
    assert len(motion.impacts) > 1000
    assert motion.sample(motion.duration)[0] <= 1e-4 * (1 + 1e-12)
    # A tip with any loss comes to an end of it.
    soon = simulate(
        replace(
            BEAM,
            stop=Stop(1e-4, Rigid(0.99)),
            modes=10,
            damping_ratio=0.3,
            forcing=Force(0.15, 60.0),
        ),
        duration=PERIOD,
    )
    assert soon.status == "complete"
    assert len(soon.sticks) > 0


def test_a_tip_that_begins_on_a_soft_stop_presses_on_it():
    """There the rate of the gap is rounding; a stop that is a hair away makes the same motion."""
    beam = Cantilever(0.2, 0.02, 0.001, 2e11, 7800.0, modes=2, forcing=BaseMotion(1e-3, 10.0))
    law = KelvinVoigt(32905.95477834865, 10.0)
    touching, beside = (
        simulate(replace(beam, stop=Stop(at, law, "lower")), periods=1)
        for at in (1e-3, 1e-3 - 1e-10)
    )
    assert touching.status == "complete"
    assert len(touching.impacts) == len(beside.impacts) < 5
    time = np.linspace(0.0, touching.stop, 200)
    assert touching.sample(time)[0] == pytest.approx(beside.sample(time)[0], abs=1e-8)
