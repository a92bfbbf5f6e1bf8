"""Branches of periodic orbits against Shaw's and Holmes' closed forms."""

from __future__ import annotations

import math

import matplotlib
import numpy as np
import pytest
from scipy.optimize import brentq

matplotlib.use("Agg")

from matplotlib.figure import Figure

import impactsig
from impactsig import Force, InvalidInput, KelvinVoigt, Oscillator, Rigid, Stop, scenes
from tests import naive

ZETA, RESTITUTION = 0.03, 0.2


def coefficients(omega):
    """alpha and gamma / omega: (1 + alpha V)^2 + (gamma V / omega)^2 = (A / A_g)^2."""
    period, damped = 2 * math.pi / omega, math.sqrt(1 - ZETA**2)
    decay = math.exp(-ZETA * period)
    c, s = math.cos(damped * period), math.sin(damped * period)
    delta = 1 - 2 * decay * c + decay**2
    alpha = (1 + RESTITUTION) * decay * s / (damped * delta)
    gamma = -RESTITUTION + (1 + RESTITUTION) * (1 - decay * c - ZETA * decay * s / damped) / delta
    return alpha, gamma / omega


def grazing_amplitude(omega):
    return math.hypot(1 - omega**2, 2 * ZETA * omega)


def doubling(omega, amplitude=0.25):
    """det(M + 1) of the orbit with one impact a period: 1 + trace + det, in closed form."""
    period, damped = 2 * math.pi / omega, math.sqrt(1 - ZETA**2)
    c, s = math.cos(damped * period), math.sin(damped * period) / damped
    flow = math.exp(-ZETA * period) * np.array([[c + ZETA * s, s], [-s, c - ZETA * s]])
    speed = naive.one_impact_orbit(omega, amplitude=amplitude)
    gain = np.linalg.solve(flow - np.eye(2), [0, (1 + RESTITUTION) * speed])
    response = amplitude / complex(1 - omega**2, 2 * ZETA * omega)
    forced = complex(1 - gain[0], (RESTITUTION * speed + gain[1]) / omega)
    push = amplitude * (forced / response / abs(forced / response)).real - 1
    before, after = push - 2 * ZETA * speed, push + 2 * ZETA * RESTITUTION * speed
    saltation = [[-RESTITUTION, 0], [(after + RESTITUTION * before) / speed, -RESTITUTION]]
    return np.linalg.det(saltation @ flow + np.eye(2))


def amplitudes(omega):
    return lambda amplitude: scenes.karpodinis(
        omega * scenes.NATURAL_FREQUENCY, amplitude=amplitude
    )


def kinds(branch):
    return [point.kind for point in branch.special]


def test_the_period_doubling_of_the_beam():
    branch = impactsig.continue_orbit(scenes.karpodinis, (22.1, 20.1))
    assert (branch.impacts, branch.periods, branch.status) == (1, 1, "end of range")
    closed = brentq(lambda f: doubling(naive.frequency_ratio(f)), 20.1, 22.1, xtol=1e-13)
    assert kinds(branch) == ["period doubling"]
    assert branch.special[0].parameter == pytest.approx(closed, rel=1e-9)
    assert np.array_equal(branch.stable, branch.parameter > closed)
    assert branch.parameter[[0, -1]] == pytest.approx([22.1, 20.1], rel=1e-15)
    for frequency, velocity in zip(branch.parameter, branch.approach_velocity, strict=True):
        closed = naive.one_impact_orbit(naive.frequency_ratio(frequency))
        assert velocity == pytest.approx(closed, rel=1e-8)


@pytest.mark.parametrize("omega", [0.8, 0.9])
def test_an_impacting_orbit_ends_where_it_grazes(omega):
    branch = impactsig.continue_orbit(amplitudes(omega), (1.5 * grazing_amplitude(omega), 0.05))
    assert branch.status == "grazing"
    assert kinds(branch)[-1] == "grazing"
    assert branch.special[-1].parameter == pytest.approx(grazing_amplitude(omega), rel=1e-7)
    assert np.all(np.diff(branch.parameter) < 0)


def test_around_a_fold_to_the_grazing():
    """Just above resonance two orbits with an impact are born together; the unstable one grazes."""
    omega = 1.05
    alpha, gamma = coefficients(omega)
    grazing = grazing_amplitude(omega)
    branch = impactsig.continue_orbit(amplitudes(omega), (0.3, 0.05))
    assert kinds(branch) == ["fold", "grazing"]
    fold, end = branch.special
    closed = grazing * abs(gamma) / math.hypot(alpha, gamma)
    assert fold.parameter == pytest.approx(closed, rel=1e-9)
    assert end.parameter == pytest.approx(grazing, rel=1e-6)
    # Every point is on one of the two branches of the quadratic.
    v, a = branch.approach_velocity[:, 0], branch.parameter
    assert (1 + alpha * v) ** 2 + (gamma * v) ** 2 == pytest.approx((a / grazing) ** 2, rel=1e-8)
    turn = int(np.argmin(a))
    assert branch.stable[: turn - 1].all()
    assert not branch.stable[turn + 2 :].any()


def test_the_orbit_without_impacts_ends_where_it_grazes():
    branch = impactsig.continue_orbit(amplitudes(0.9), (0.1, 0.3))
    assert (branch.impacts, branch.status, kinds(branch)) == (0, "grazing", ["grazing"])
    assert branch.special[0].parameter == pytest.approx(grazing_amplitude(0.9), rel=1e-8)
    assert branch.stable.all()


def test_a_section_that_an_impact_passes_is_moved():
    """The strobe begins just before the impact, whose phase then passes it."""
    first = impactsig.find_periodic_orbit(scenes.karpodinis(22.1))
    phase = float(first.impact_phase[0]) - 0.02
    branch = impactsig.continue_orbit(
        scenes.karpodinis, (22.1, 20.1), phase=phase, guess=None, impacts=1
    )
    assert len(set(branch.phase)) > 1
    assert branch.status == "end of range"
    for frequency, velocity in zip(branch.parameter, branch.approach_velocity, strict=True):
        closed = naive.one_impact_orbit(naive.frequency_ratio(frequency))
        assert velocity == pytest.approx(closed, rel=1e-8)


def test_a_soft_resonance_is_three_valued_between_its_folds():
    """It begins and ends where the forced response just reaches the stops."""

    def scene(omega):
        stops = (Stop(0.5, KelvinVoigt(1.0)), Stop(-0.5, KelvinVoigt(1.0), "lower"))
        return Oscillator(damping=0.04, forces=Force(0.06, omega), stops=stops)

    below, above = (
        brentq(lambda w: abs(0.06 / complex(1 - w**2, 0.04 * w)) - 0.5, *bracket, xtol=1e-14)
        for bracket in ((0.7, 1.0), (1.0, 1.3))
    )
    quiet = impactsig.continue_orbit(scene, (0.9, 1.8), guess=(0.5, 0.0))
    assert kinds(quiet) == ["grazing"]
    assert quiet.special[0].parameter == pytest.approx(below, rel=1e-7)
    branch = impactsig.continue_orbit(scene, (1.0, 1.8), guess=(0.5, 0.0))
    assert branch.impacts == 2
    assert kinds(branch) == ["fold", "fold", "grazing"]
    assert branch.special[2].parameter == pytest.approx(above, rel=1e-7)
    (right, left) = (point.parameter for point in branch.special[:2])
    assert right > above > left
    unstable = branch.parameter[~branch.stable]
    assert left - 1e-6 < unstable.min() < unstable.max() < right + 1e-6


def test_an_orbit_that_rubs_ends_where_it_reaches_the_walls():
    """Begley's and Virgin's motion without impacts: its greatest displacement becomes 1.6."""

    def scene(gamma):
        return scenes.begley_virgin(gamma, 1.6, 0.05)

    branch = impactsig.continue_orbit(scene, (1.338, 1.0), guess=(-0.22939, -1.65387))
    assert branch.state[0] == pytest.approx([-0.22939, -1.65387], abs=5e-6)
    assert branch.status == "grazing"
    gamma = branch.special[-1].parameter

    def reach(gamma):
        motion = impactsig.simulate(
            scene(gamma), periods=1, transient=600, initial=branch.state[-1]
        )
        section = impactsig.simulate(scene(gamma), periods=1, initial=motion.final[:2])
        return max(abs(section.sample(np.linspace(0, section.stop, 20_001))[0]))

    assert reach(gamma + 1e-5) < 1.6
    assert reach(gamma + 1e-7) == pytest.approx(1.6, abs=1e-6)
    assert branch.stable.all()


@pytest.mark.parametrize(
    ("arguments", "options", "argument"),
    [
        ((3, (1, 2)), {}, "scene_of_parameter"),
        ((scenes.karpodinis, (22.1, 22.1)), {}, "values"),
        ((scenes.karpodinis, 22.1), {}, "values"),
        ((scenes.karpodinis, ("a", 3)), {}, "values"),
        ((scenes.karpodinis, (22.1, 20)), {"most": 1}, "most"),
        ((scenes.karpodinis, (22.1, 20)), {"guess": (9, 9)}, "guess"),
    ],
)
def test_wrong_arguments_are_named(arguments, options, argument):
    with pytest.raises(InvalidInput) as caught:
        impactsig.continue_orbit(*arguments, **options)
    assert caught.value.argument == argument


def test_a_branch_is_drawn_where_told():
    branch = impactsig.continue_orbit(scenes.karpodinis, (21.2, 20.7))
    assert "period doubling at 20.95" in repr(branch)
    for observe in ("displacement", "approach velocity", "multiplier"):
        ax = Figure().subplots()
        assert branch.plot(ax, observe=observe) is ax
        ax.figure.draw_without_rendering()
        labels = [line.get_label() for line in ax.lines]
        assert labels == ["stable", "unstable", "period doubling"]


def test_a_rigid_scene_without_stops_reached_has_no_special_points():
    def scene(omega):
        return Oscillator(damping=0.2, forces=Force(0.1, omega), stops=Stop(50.0, Rigid(0.5)))

    branch = impactsig.continue_orbit(scene, (0.9, 1.1))
    assert branch.special == ()
    response = 0.1 / (1 - branch.parameter**2 + 0.2j * branch.parameter)
    assert branch.state[:, 0] == pytest.approx(response.real, abs=1e-9)
