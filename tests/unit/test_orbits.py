"""What sections, periods and orbits refuse, and how they draw."""

import functools
import math

import matplotlib
import pytest

matplotlib.use("Agg")

from matplotlib.figure import Figure

import impactsig
from impactsig import Force, InvalidInput, KelvinVoigt, Oscillator, Rigid, Stop, scenes

BEAM = scenes.karpodinis(22.1)


@functools.cache
def motion(keep="all"):
    """Not while tests are collected, for every worker would compile for it."""
    return impactsig.simulate(BEAM, periods=4, keep=keep)


def free():
    return impactsig.simulate(Oscillator(), duration=3)


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda: impactsig.impact_map(motion(), stop=1), "stop"),
        (lambda: impactsig.impact_map(motion(), stop=-1), "stop"),
        (lambda: impactsig.impact_map(motion("counts")), "keep"),
        (lambda: impactsig.impact_map(BEAM), "motion"),
        (lambda: impactsig.displacement_section(motion("counts")), "keep"),
        (lambda: impactsig.displacement_section(motion(), math.nan), "displacement"),
        (lambda: impactsig.displacement_section(motion(), 0, "left"), "direction"),
        (lambda: impactsig.orbit_period(free()), "motion"),
        (lambda: impactsig.orbit_period(motion(), longest=0), "longest"),
        (lambda: impactsig.orbit_period(motion(), tolerance=0), "tolerance"),
        (lambda: impactsig.orbit_period(impactsig.simulate(BEAM, periods=0.5)), "motion"),
        (lambda: impactsig.find_periodic_orbit(Oscillator()), "system"),
        (lambda: impactsig.find_periodic_orbit(BEAM, 0), "periods"),
        (lambda: impactsig.find_periodic_orbit(BEAM, guess=(1,)), "guess"),
        (lambda: impactsig.find_periodic_orbit(BEAM, guess=("a", 1)), "guess"),
        (lambda: impactsig.find_periodic_orbit(BEAM, impacts=7), "periods, impacts"),
        (lambda: impactsig.find_periodic_orbit(BEAM, phase=math.inf), "phase"),
        (lambda: impactsig.find_periodic_orbits(BEAM, guesses=0), "guesses"),
    ],
)
def test_wrong_arguments_are_named(call, argument):
    with pytest.raises(InvalidInput) as caught:
        call()
    assert caught.value.argument == argument


def test_a_guess_that_leads_nowhere_says_so():
    orbit = impactsig.find_periodic_orbit(BEAM, guess=(5.0, 0.0))
    assert orbit.status == "lost"
    assert not orbit.found
    assert "lost" in repr(orbit)


@pytest.mark.parametrize(
    "section",
    [
        lambda: impactsig.impact_map(motion()),
        lambda: impactsig.displacement_section(motion()),
        lambda: impactsig.displacement_section(motion(), 100.0),
    ],
)
def test_sections_are_drawn_where_told(section):
    section = section()
    ax = Figure().subplots()
    assert section.plot(ax) is ax
    ax.figure.draw_without_rendering()
    assert len(ax.lines) == (len(section) > 0)
    assert str(len(section)) in repr(section)


def test_the_impacts_of_two_stops_are_told_apart():
    stops = (Stop(0.3, Rigid(0.8)), Stop(-0.3, Rigid(0.8), "lower"))
    machine = Oscillator(damping=0.1, forces=Force(1.0, 0.7), stops=stops)
    motion = impactsig.simulate(machine, periods=20)
    section = impactsig.impact_map(motion)
    ax = section.plot(Figure().subplots())
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["stop 0", "stop 1"]
    own = impactsig.impact_map(motion, stop=1)
    assert 0 < len(own) < len(section)
    assert set(own.stop) == {1}


def test_an_orbit_draws_its_phase_portrait():
    ax = Figure().subplots()
    orbit = impactsig.find_periodic_orbit(BEAM)
    assert orbit.plot(ax) is ax
    assert ax.lines or ax.collections


@pytest.mark.usefixtures("little_work")
def test_a_motion_that_ends_before_it_can_return_is_refused():
    stop = Stop(1e-300, KelvinVoigt(1e11))  # chatters without loss until the work limit
    pressed = Oscillator(damping=0.1, stiffness=0, forces=(Force(1.0, 0.9),), load=1, stops=(stop,))
    for find in (impactsig.find_periodic_orbits, impactsig.find_periodic_orbit):
        with pytest.raises(InvalidInput, match=r"ended early.*guess="):
            find(pressed)
