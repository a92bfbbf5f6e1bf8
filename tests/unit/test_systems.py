"""Every question of every system: an answer, or one typed refusal (docs/systems.md)."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot

import impactsig as im
from impactsig import InvalidInput, plot, scenes

mpl.use("Agg")
TABLE = (Path(__file__).parents[2] / "docs" / "systems.md").read_text(encoding="utf-8")


def soft(frequency, law=None):
    """A machine with a stop, whose contact is linear unless a law is given."""
    return im.Oscillator(
        damping=0.1, forces=(im.Force(0.5, frequency),), stops=(im.Stop(0.3, law or im.Rigid(0.7)),)
    )


def hertz(frequency):
    return soft(frequency, im.Hertz(50.0))


def beam(frequency=21.0):
    return im.Cantilever(
        0.2, 0.025, 0.001, 210e9, 7850, stop=im.Stop(1e-3, im.Rigid(0.6)), modes=2,
        forcing=im.BaseMotion(2e-4, 2 * math.pi * frequency, stops=True),
    )  # fmt: skip


def noisy(frequency):
    return replace(soft(frequency), noise=im.Noise(1e-3))


def delayed(frequency):
    return im.Controlled(soft(frequency), im.DelayedFeedback(0.05, signal="displacement"))


def spiked(frequency):
    return im.Controlled(soft(frequency), im.IntervalFeedback(0.01, 0.05))


def chirped(frequency):
    return im.Swept(soft(frequency), frequency_rate=1e-4)


SADDLE = (0.954, 0.36)  # near the orbit of Karpodinis' beam that OGY holds


def nudged(frequency):
    beam = scenes.karpodinis(frequency)
    return im.Controlled(beam, im.OGY(im.find_periodic_orbit(beam, guess=SADDLE), limit=0.02))


# Of each column: the system of a parameter, a value of it, and how it is run.
COLUMNS = {
    "oscillator, exact": (soft, 0.9, {"periods": 30}),
    "oscillator, stepped": (hertz, 0.9, {"periods": 30}),
    "cantilever": (beam, 21.0, {"periods": 30}),
    "flow": (lambda rho: im.flows.lorenz(rho=rho), 28.0, {"duration": 60.0}),
    "delayed feedback": (delayed, 0.9, {"periods": 30}),
    "interval feedback": (spiked, 0.9, {"periods": 30}),
    "OGY": (nudged, 20.3355, {"periods": 30}),
    "swept force": (chirped, 0.9, {"duration": 210.0}),
    "with noise": (noisy, 0.9, {"periods": 30, "every": 2 * math.pi / 0.9 / 64, "seed": 1}),
}


@cache
def system(column):
    make, value, _ = COLUMNS[column]
    return make(value)


@cache
def motion(column):
    return im.simulate(system(column), **COLUMNS[column][2])


def train(column):
    """Impacts; of a flow its crossings."""
    if column == "flow":
        return im.threshold_crossings(system(column), 0.0, duration=60.0)
    return motion(column).impacts


def states(column):
    own = motion(column)
    found = own.sample(own.stop)
    assert own.status == "complete"
    assert system(column) in (own.system, getattr(own, "sweep", None)) or (
        own.system == system(column).system
    )
    assert own.stop == own.start + own.duration
    end = np.concatenate([np.ravel(part) for part in own.final])[: np.size(found)]
    if column != "cantilever":  # whose final state is that of its modes
        assert np.ravel(found) == pytest.approx(end, abs=1e-9)
    return np.isfinite(found).all()


def section(column):
    x, v = motion(column).stroboscopic(math.pi / 2)
    return len(x) == len(v) >= 29


def impact_map(column):
    found = im.impact_map(motion(column))
    return len(found) == len(motion(column).impacts) > 0


def displacements(column):
    level = 5e-4 if column == "cantilever" else 0.1
    up, down, both = (
        im.displacement_section(motion(column), level, way) for way in ("up", "down", "both")
    )
    return len(up) > 0 and abs(len(up) - len(down)) <= 1 and len(both) == len(up) + len(down)


def spectrum(column):
    options = {"rate": 20.0} if column == "flow" else {}
    found = motion(column).power_spectrum(segments=2, **options)
    return found.density.max() > 0


def crossings(column):
    given = system(column)
    fired = im.integrate_and_fire(given, 20.0, count=3)
    return len(im.threshold_crossings(given, 0.0, count=3)) == len(fired) == 3


def portrait(column):
    ax = plot.phase_portrait(motion(column))
    drawn = len(ax.lines[0].get_xdata())
    pyplot.close("all")
    return drawn > 100


def settled(column):
    """A state near an orbit; of systems that have none here any will do."""
    if column == "OGY":
        return SADDLE
    if not column.startswith("oscillator"):
        return None
    return im.simulate(system(column), periods=1, transient=60).final[:2]


@cache
def orbit(column):
    options = {"period": 1.56} if column == "flow" else {"guess": settled(column)}
    return im.find_periodic_orbit(system(column), **options)


def stability(column):
    found = orbit(column)
    options = {"signal": "y", "delay": found.period} if column == "flow" else {}
    return im.orbit_stability(found, im.DelayedFeedback(0.05, **options), laps=50).growth > 0


def smooth(column):
    """With a soft stop under noise, as a path has no tangent at a rigid one."""
    own = system(column)
    soft_stop = im.Stop(0.3, im.KelvinVoigt(20.0, 0.5))
    return replace(own, stops=(soft_stop,)) if column == "with noise" else own


def lyapunov(column):
    run = {"duration": 20.0} if column == "flow" else {"periods": 30}
    given = smooth(column)
    return im.lyapunov_spectrum(given, **run).exponents.size == given.dimension


def tangent(column):
    run = {"duration": 0.5} if column == "flow" else {"periods": 1}
    matrix = im.tangent_map(smooth(column), **run).matrix
    return matrix.shape == (system(column).dimension,) * 2


def cut(column):
    """Of a flow: the section by which its returns are counted."""
    return {"section": ("z", 27.0)} if column == "flow" else {}


def diagram(column):
    make, value, _ = COLUMNS[column]
    look = {"periods": 5, "transient": 5, "workers": 1, **cut(column)}
    found = im.bifurcation_diagram(make, [value], **look)
    return found.status == ("complete",) and len(found.strobe[0]) > 0


def chart(column):
    make, value, _ = COLUMNS[column]
    look = {"periods": 5, "workers": 1, **cut(column)}
    found = im.periodicity_chart(lambda a, b: make(a), [value], [0.0, 1.0], **look)
    return found.classes.size == 2 and not found.failed.any()


def response(column):
    make, value, _ = COLUMNS[column]
    look = {"periods": 5, "transient": 5, "workers": 1, **cut(column)}
    return im.response_spectrum(make, [value], **look).amplitude[0] > 0


def continued(column):
    make, value, _ = COLUMNS[column]
    start = {"guess": settled(column)}
    if column == "flow":
        start = {"guess": orbit(column).state, "period": orbit(column).period}
    return len(im.continue_orbit(make, (value, value * 1.001), most=2, **start)) == 2


def basins(column):
    # Lorenz' flow is chaotic at 28; the cantilever's starts are within its gap.
    given = im.flows.lorenz(rho=10.0) if column == "flow" else system(column)
    plane = ([0.0, 1e-4], [1e-4]) if column == "cantilever" else ([0.0, 0.1], [0.1])
    section = {"section": ("z", 5.0)} if column == "flow" else {}
    return im.basins_of_attraction(given, *plane, workers=1, **section).open_share == 0


def ensemble(column):
    return im.simulate_ensemble(system(column), paths=4, periods=5, seed=1).paths == 4


QUESTIONS = {
    "`simulate`, `sample`": states,
    "`stroboscopic`": section,
    "`impact_map`": impact_map,
    "`displacement_section`": displacements,
    "`threshold_crossings`, `integrate_and_fire`": crossings,
    "`power_spectrum`": spectrum,
    "`plot.phase_portrait`": portrait,
    "`measure`": lambda c: len(im.measure(train(c), missed=0.1, seed=1).impacts) > 0,
    "`synthesize`": lambda c: len(im.synthesize(train(c), rate=500.0, seed=1)) > 0,
    "`tangent_map`": tangent,
    "`lyapunov_spectrum`": lyapunov,
    "`find_periodic_orbit`": lambda c: orbit(c).found,
    "`orbit_stability` under feedback": stability,
    "`continue_orbit`": continued,
    "`bifurcation_diagram`": diagram,
    "`periodicity_chart`": chart,
    "`response_spectrum`": response,
    "`basins_of_attraction`": basins,
    "`simulate_ensemble`": ensemble,
}


def cells():
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in TABLE.splitlines()
            if line.startswith("|")]  # fmt: skip
    assert rows[0][1:] == list(COLUMNS)
    assert [row[0] for row in rows[2:]] == list(QUESTIONS)
    for question, *answers in rows[2:]:
        for column, answer in zip(COLUMNS, answers, strict=True):
            assert answer in "✓–"
            yield pytest.param(question, column, answer == "✓", id=f"{question}, {column}")


@pytest.mark.parametrize(("question", "column", "answered"), list(cells()))
def test_a_question_is_answered_or_refused_with_the_reason(question, column, answered):
    if answered:
        assert QUESTIONS[question](column)
        return
    with pytest.raises(InvalidInput) as caught:
        QUESTIONS[question](column)
    assert re.search(r"required: \w", str(caught.value))


@pytest.mark.parametrize(
    "wrong", [None, "beam", 3.0, im.Oscillator, scenes.karpodinis, [im.Oscillator()]]
)
def test_what_is_no_system_is_refused_by_every_question(wrong):
    for ask in (
        lambda: im.simulate(wrong, duration=1.0),
        lambda: im.tangent_map(wrong, duration=1.0),
        lambda: im.lyapunov_spectrum(wrong, duration=1.0),
        lambda: im.find_periodic_orbit(wrong),
        lambda: im.Controlled(wrong, im.DelayedFeedback(0.1)),
    ):
        with pytest.raises(InvalidInput) as caught:
            ask()
        assert caught.value.argument == "system"


def test_options_of_another_kind_of_system_are_refused_by_name():
    given = {"phase": 0.5, "seed": 1, "keep": "counts", "every": 0.1, "path": 2, "chatter": 1e-3}
    wrong = {
        "oscillator, exact": ("seed", "every", "path"),
        "cantilever": ("seed", "keep", "every", "path"),
        "flow": ("phase", "seed", "keep", "every", "path", "chatter"),
        "delayed feedback": ("seed", "keep", "every", "path"),
        "interval feedback": ("seed", "keep", "every", "path"),
        "OGY": ("seed", "keep", "every", "path"),
        "swept force": ("seed", "every", "path"),
        "with noise": ("keep", "chatter"),
    }
    for column, names in wrong.items():
        for name in names:
            with pytest.raises(InvalidInput, match="It takes") as caught:
                im.simulate(system(column), duration=1.0, **{name: given[name]})
            assert caught.value.argument == name
