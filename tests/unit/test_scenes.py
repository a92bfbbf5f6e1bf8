"""The papers' systems: each obeys the equation of motion that its paper prints."""

from __future__ import annotations

import inspect
import math
import re

import numpy as np
import pytest

from impactsig import Friction, InvalidInput, KelvinVoigt, Rigid, Stop, scenes, simulate


@pytest.mark.parametrize(
    ("make", "argument"),
    [
        (lambda: scenes.karpodinis(0), "frequency"),
        (lambda: scenes.karpodinis("fast"), "frequency"),
        (lambda: scenes.karpodinis(22, damping_ratio=-1), "damping_ratio"),
        (lambda: scenes.karpodinis(22, amplitude=math.inf), "amplitude"),
        (lambda: scenes.karpodinis(22, restitution=1.5), "restitution"),
        (lambda: scenes.okolewski(3, 0.6, "firm"), "stop"),
        (lambda: scenes.okolewski(-3, 0.6), "eta"),
        (lambda: scenes.okolewski(3, 0, "soft"), "restitution"),
        (lambda: scenes.okolewski(3, 0.6, "soft", stop_stiffness=0), "stop_stiffness"),
        (lambda: scenes.tian(0, 1), "omega"),
        (lambda: scenes.tian(1, "loud"), "amplitude"),
        (lambda: scenes.tian(1, 1, "firm"), "stop"),
        (lambda: scenes.tian(1, 1, damping_ratio=-0.1), "damping_ratio"),
        (lambda: scenes.tian(1, 1, "hard", restitution=-0.1), "restitution"),
        (lambda: scenes.tian(1, 1, stop_stiffness=-1), "stop_stiffness"),
        (lambda: scenes.tian(1, 1, stop_damping=math.nan), "stop_damping"),
        (lambda: scenes.tian(1, 1, gap=math.nan), "position"),
        (lambda: scenes.begley_virgin(0, 1.6, 0.05), "gamma"),
        (lambda: scenes.begley_virgin(1, 0, 0.05), "sigma"),
        (lambda: scenes.begley_virgin(1, (1, -1), 0.05), "sigma"),
        (lambda: scenes.begley_virgin(1, (-1, 0, 1), 0.05), "sigma"),
        (lambda: scenes.begley_virgin(1, (-math.inf, 1), 0.05), "sigma"),
        (lambda: scenes.begley_virgin(1, "wide", 0.05), "sigma"),
        (lambda: scenes.begley_virgin(1, 1.6, -0.05), "friction"),
        (lambda: scenes.begley_virgin(1, 1.6, "much"), "friction"),
        (lambda: scenes.begley_virgin(1, 1.6, 0.05, damping_ratio=-1), "damping_ratio"),
        (lambda: scenes.begley_virgin(1, 1.6, 0.05, wall_stiffness=0), "wall_stiffness"),
        (lambda: scenes.begley_virgin(1, 1.6, 0.05, kinetic_ratio=1.1), "kinetic_ratio"),
        (lambda: scenes.van_der_pol_duffing(1.1), "restitution"),
        (lambda: scenes.van_der_pol_duffing(friction=-1), "friction"),
        (lambda: scenes.van_der_pol_duffing(intensity="loud"), "intensity"),
        (lambda: scenes.van_der_pol_duffing(epsilon=0), "epsilon"),
        (lambda: scenes.van_der_pol_duffing(c2=-1), "c2"),
    ],
)
def test_what_cannot_be_is_refused_by_name(make, argument):
    with pytest.raises(InvalidInput) as caught:
        make()
    assert caught.value.argument == argument


def test_scenes_have_the_papers_parameters():
    beam = scenes.karpodinis(22.1)
    assert beam.forcing_period == pytest.approx(1 / 22.1, rel=1e-14)
    assert beam.stops_on("upper") == (Stop(1.0, Rigid(0.2)),)
    assert beam.stops_on("lower") == ()
    soft = scenes.okolewski(3, 0.8, "soft", stop_stiffness=2000)
    assert soft.stops[0].law.damping == pytest.approx(6.33704, abs=5e-6)
    assert scenes.okolewski(3, 0.8, load=0.1).load == 0.1
    assert scenes.tian(1, 0.5, "hard", gap=2).stops == (Stop(2, Rigid(0.85)),)
    assert scenes.tian(1, 0.5).stops == (Stop(1, KelvinVoigt(1e4, 10.3288336)),)


def test_van_der_pol_duffing_has_the_values_that_its_paper_prints(shared_data):
    text = shared_data("../papers/van-der-pol-duffing.txt").read_text()
    names = {"epsilon": "ε", "c1": "c1", "c2": "c2", "friction": "fk", "restitution": "r",
             "intensity": "D"}  # fmt: skip
    section = text[text.index("4.1. Effectiveness") :]  # of the values of the first figures
    scene = inspect.signature(scenes.van_der_pol_duffing)
    for name, symbol in names.items():
        printed = re.search(rf"\b{symbol} � (\d+\.\d+)", section)
        assert scene.parameters[name].default == float(printed[1]), name


def test_only_what_is_chosen_is_called_our_choice():
    words = scenes.van_der_pol_duffing.__doc__
    assert "VanDerPolDuffing2020" in words
    assert "our choice" not in words.lower()


def test_the_printed_optimum_is_near_the_equivalent_stop():
    printed = scenes.tian(1, 0.5).stops[0].law.damping
    assert KelvinVoigt.equivalent(0.85, 1e4).damping == pytest.approx(10.3325, abs=5e-5)
    assert printed == pytest.approx(10.3325, rel=1e-3)


def test_walls_and_friction():
    both = scenes.begley_virgin(1.338, 1.6, 0.05)
    assert [stop.position for stop in both.stops] == [-1.6, 1.6]
    aside = scenes.begley_virgin(0.88, (-1.86, 1.75), 0.06, kinetic_ratio=0.5)
    assert [stop.position for stop in aside.stops_on("lower") + aside.stops_on("upper")] == [
        -1.86,
        1.75,
    ]
    assert aside.friction == Friction(0.03, 0.06)


def test_a_scene_without_friction_has_none():
    assert scenes.begley_virgin(1.338, 1.6, 0).friction is None


# -- the equations of motion -----------------------------------------------------------------


def acceleration(oscillator, t, x, v):
    """x'' as `Oscillator`, `Force`, `BaseMotion`, `KelvinVoigt` and `Friction` document it."""

    def harmonic(part):
        angle = part.angular_frequency * t + part.phase
        return part.amplitude * math.cos(
            angle
        ), -part.amplitude * part.angular_frequency * math.sin(angle)

    at, moving = harmonic(oscillator.base) if oscillator.base else (0.0, 0.0)
    base = oscillator.base
    force = oscillator.load + sum(harmonic(one)[0] for one in oscillator.forces)
    force -= oscillator.stiffness * (x - at * bool(base and base.spring))
    force -= oscillator.damping * (v - moving * bool(base and base.damper))
    carried = bool(base and base.stops)
    for stop in oscillator.stops:
        sign = 1 if stop.side == "upper" else -1
        depth = sign * (x - at * carried - stop.position)
        if depth > 0:  # never of a rigid stop
            rate = sign * (v - moving * carried)
            force -= sign * (stop.law.stiffness * depth + stop.law.damping * rate)
    if oscillator.friction:
        force -= oscillator.friction.kinetic * np.sign(v - moving * carried)
    return force / oscillator.mass


def okolewski(t, x, v):
    eta, a, k_s, loss = 3.0, 0.0025, 2e5, math.log(0.6)
    c_s = -2 * loss * math.sqrt(k_s / (math.pi**2 + loss**2))
    b, rate = a * math.sin(eta * t), a * eta * math.cos(eta * t)
    contact = -k_s * (x - b) - c_s * (v - rate) if x < b else 0.0
    return a * math.sin(eta * t) - 0.23 * v - x + contact


def tian(t, x, v):
    contact = 1e4 * (x - 0.7) + 10.3288336 * v if x > 0.7 else 0.0
    return 0.8 * math.sin(1.3 * t) - 2 * 0.02 * v - x - contact


def begley_virgin(t, theta, rate):
    gamma, h, alpha, f, rho, left, right = 0.88, 0.1, 0.8, 0.06, 12.0, -1.1, 2.2
    g = rho**2 * (theta - right) if theta > right else 0.0
    g = rho**2 * (theta - left) if theta < left else g
    drive = 2 * h * gamma * math.cos(gamma * t) + math.sin(gamma * t)
    return drive - 2 * h * rate - theta - alpha * f * math.copysign(1, rate) - g


def karpodinis(t, x, v):
    return 0.25 * math.cos(20.1 / 22.2 * t) - 2 * 0.03 * v - x


@pytest.mark.parametrize(
    ("scene", "printed", "reach"),
    [
        (scenes.karpodinis(20.1), karpodinis, (-3, 1)),
        (scenes.okolewski(3, 0.6, "soft"), okolewski, (-0.01, 0.01)),
        (scenes.tian(1.3, 0.8, damping_ratio=0.02, gap=0.7), tian, (-2, 2)),
        (
            scenes.begley_virgin(
                0.88, (-1.1, 2.2), 0.06, damping_ratio=0.1, wall_stiffness=144, kinetic_ratio=0.8
            ),
            begley_virgin,
            (-3, 3),
        ),
    ],
    ids=["karpodinis", "okolewski", "tian", "begley_virgin"],
)
def test_a_scene_obeys_the_papers_equation(scene, printed, reach):
    rng = np.random.default_rng(0)
    for t, x, v in zip(
        rng.uniform(0, 50, 300), rng.uniform(*reach, 300), rng.normal(0, 2, 300), strict=True
    ):
        found = acceleration(scene, t, x, v)
        assert found == pytest.approx(printed(t, x, v), rel=1e-12, abs=1e-11)


@pytest.mark.parametrize(
    ("scene", "printed"),
    [
        (scenes.okolewski(3, 0.6, "soft"), okolewski),
        (scenes.tian(1.3, 0.8, damping_ratio=0.02, gap=0.7), tian),
        (
            scenes.begley_virgin(
                0.88, (-1.1, 2.2), 0.06, damping_ratio=0.1, wall_stiffness=144, kinetic_ratio=0.8
            ),
            begley_virgin,
        ),
    ],
    ids=["okolewski", "tian", "begley_virgin"],
)
def test_its_motion_obeys_it_too(scene, printed):
    motion = simulate(scene, periods=10)
    assert motion.impact_count > 5
    step = 1e-6
    time = np.linspace(motion.start + step, motion.stop - step, 2001)
    begin = motion.impacts.time
    edges = np.concatenate([begin, begin + motion.impacts.contact_time])
    time = time[np.abs(time[:, None] - edges).min(axis=1) > 2 * step]
    x, v = motion.sample(time)
    change = (motion.sample(time + step)[1] - motion.sample(time - step)[1]) / (2 * step)
    wanted = [printed(*at) for at in zip(time, x, v, strict=True)]
    np.testing.assert_allclose(change, wanted, atol=1e-6 * np.max(np.abs(change)))
