"""Bifurcation diagrams and periodicity charts, against closed forms and motions one by one."""

from __future__ import annotations

import math

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from matplotlib.figure import Figure

from impactsig import (
    Force,
    Hertz,
    InvalidInput,
    Oscillator,
    Rigid,
    Stop,
    bifurcation_diagram,
    periodicity_chart,
    scenes,
    simulate,
)
from impactsig.dynamics.diagrams.settling.strobing import closing
from impactsig.plot.systems.diagrams import LABELS
from tests.cells_device import walls

SHAW_HOLMES = 0.5810258993557  # approach velocity of the 22.1 Hz beam, a root of the closed form


def okolewski(stop, restitution=1.0):
    return lambda eta: scenes.okolewski(eta, restitution, stop)


def test_period_one_beam_is_that_of_the_closed_form():
    found = bifurcation_diagram(scenes.karpodinis, [22.1], exponents=True)
    assert found.periods[0] == found.impacts[0] == found.impacts_per_period[0] == 1
    assert found.velocity[0] == pytest.approx([SHAW_HOLMES], rel=1e-9)
    lost = (1 - 0.2**2) * SHAW_HOLMES**2 / 2
    assert found.energy_per_period[0] == pytest.approx(lost, rel=1e-9)
    assert found.sticking[0] == 0
    period = 2 * math.pi * 22.2 / 22.1
    assert found.exponents[0].sum() == pytest.approx(-0.06 + math.log(0.04) / period, rel=1e-12)


@pytest.mark.parametrize("stop", ["hard", "soft"])
def test_okolewskis_orbits_without_loss(stop):
    found = bifurcation_diagram(okolewski(stop), [4.0, 8.0], transient=1000, exponents=True)
    assert found.impacts_per_period == pytest.approx([0.5, 0.25], rel=1e-12)
    assert list(found.periods) == [2, 4]
    assert found.exponents.sum(axis=1) == pytest.approx([-0.23, -0.23], abs=1e-6)


def test_ending_at_closed_orbits_changes_nothing():
    values = np.append(np.linspace(2.5, 5.5, 13), [2.86, 3.16, 4.84])
    full, ended = (
        bifurcation_diagram(okolewski("hard", 0.6), values, skip=skip, exponents=True)
        for skip in (False, True)
    )
    assert np.array_equal(full.periods, ended.periods)
    assert np.array_equal(full.impacts, ended.impacts)
    assert np.count_nonzero(full.periods == 0) > 0
    closed = full.periods > 0
    assert np.count_nonzero(closed) > 5
    size = max(np.abs(strobe).max() for strobe in full.strobe)
    for k in np.flatnonzero(closed):
        one, other = (np.sort(found.strobe[k][:, 0]) for found in (full, ended))
        assert one == pytest.approx(other, abs=1e-7 * size)
    smooth = closed & np.isfinite(full.exponents).all(axis=1)
    assert np.allclose(full.exponents[smooth], ended.exponents[smooth], atol=1e-4)


def test_a_chaotic_value_is_its_motion():
    # So short that the digits that strobing costs have not grown.
    found = bifurcation_diagram(scenes.karpodinis, [20.1], periods=20, transient=20)
    motion = simulate(scenes.karpodinis(20.1), periods=20, transient=20)
    assert found.periods[0] == 0
    assert found.impacts[0] == -1
    assert found.impacts_per_period[0] == motion.impact_count / 20
    assert found.velocity[0] == pytest.approx(motion.impacts.approach_velocity, abs=1e-9)
    assert found.strobe[0] == pytest.approx(np.column_stack(motion.stroboscopic())[1:], abs=1e-9)


def test_sticking_is_the_share_of_the_time():
    found = bifurcation_diagram(okolewski("hard", 0.6), [3.0])
    motion = simulate(scenes.okolewski(3.0, 0.6), periods=400, transient=400)
    assert found.periods[0] == 4
    share = np.diff(motion.sticks).sum() / motion.duration
    assert share > 0
    assert found.sticking[0] == pytest.approx(share, rel=1e-8)


def test_carried_starts_go_on_from_the_last_value():
    apart = bifurcation_diagram(okolewski("hard", 0.6), [4.0, 4.0])
    carried = bifurcation_diagram(okolewski("hard", 0.6), [4.0, 4.0], carry=True, transient=10)
    # Ten periods are too few from rest, but not from the orbit.
    assert list(carried.periods) == [0, 2]
    assert np.sort(carried.strobe[1][:, 0]) == pytest.approx(
        np.sort(apart.strobe[1][:, 0]), rel=1e-3
    )


def test_carried_starts_show_hysteresis():
    # A beam that is started at rest below grazing never meets its stop; one that hits goes on.
    def beam(amplitude):
        return scenes.karpodinis(22.1, amplitude=amplitude, restitution=0.9)

    amplitudes = np.linspace(0.05, 0.2, 31)
    up = bifurcation_diagram(beam, amplitudes, carry=True)
    down = bifurcation_diagram(beam, amplitudes[::-1], carry=True)
    assert np.any(up.impacts_per_period != down.impacts_per_period[::-1])


def test_a_hertz_stop_is_stepped_to_the_same_orbit():
    def stepped(frequency):
        return Oscillator(
            damping=0.1, forces=Force(0.6, frequency), stops=Stop(0.5, Hertz(1e3)), name="Hertz"
        )

    found = bifurcation_diagram(stepped, [0.9], periods=20, transient=120, closed=1e-5)
    motion = simulate(stepped(0.9), periods=20, transient=200)
    assert found.periods[0] > 0
    assert found.impacts_per_period[0] == pytest.approx(motion.impacts_per_period)
    full = bifurcation_diagram(stepped, [0.9], periods=20, transient=120, closed=1e-5, skip=False)
    assert full.periods[0] == found.periods[0]


def test_the_number_of_threads_changes_nothing():
    values = np.linspace(3, 4, 7)
    one, two = (bifurcation_diagram(okolewski("hard", 0.6), values, workers=n) for n in (1, 2))
    assert all(np.array_equal(a, b) for a, b in zip(one.strobe, two.strobe, strict=True))


def test_chart_is_the_same_with_and_without_ending_early():
    x, y = np.linspace(0.4, 2.0, 9), np.linspace(0.02, 0.5, 5)
    full, ended = (periodicity_chart(walls, x, y, skip=skip) for skip in (False, True))
    assert np.array_equal(full.classes, ended.classes)
    assert np.array_equal(full.periods, ended.periods)
    assert np.all(full.followed == 200)
    assert ended.followed.mean() < 60
    assert set(np.unique(full.classes)) == {0, 1, 2}


def test_each_cell_is_what_its_motion_does():
    x, y = [0.4, 0.75, 1.1, 2.0], [0.1, 0.3]
    found = periodicity_chart(walls, x, y, periods=400)
    for i, friction in enumerate(y):
        for j, gamma in enumerate(x):
            motion = simulate(walls(gamma, friction), periods=48, transient=400)
            n, m = int(found.periods[i, j]), int(found.impacts[i, j])
            if n:
                assert motion.impact_count == pytest.approx(48 * m / n, abs=m)
                strobe = np.column_stack(motion.stroboscopic())
                assert strobe[n:] == pytest.approx(strobe[:-n], abs=1e-4)


@pytest.mark.parametrize("observe", LABELS)
def test_figures_of_a_diagram(observe):
    found = bifurcation_diagram(okolewski("hard", 0.6), [3.0, 4.0], exponents=True)
    ax = found.plot(Figure().subplots(), observe=observe)
    assert ax.get_ylabel() == LABELS[observe]
    assert ax.lines


def test_a_slow_cell_closes_where_a_long_run_does():
    # Beside a period doubling; multipliers near -1.
    gamma, friction = [0.867], [0.161, 0.222, 0.252]
    short = periodicity_chart(walls, gamma, friction, periods=200)
    long = periodicity_chart(walls, gamma, friction, periods=4000, skip=False)
    assert np.all(short.followed < 200)
    assert np.all(long.periods == 1)
    assert np.array_equal(short.periods, long.periods)
    assert np.array_equal(short.impacts, long.impacts)


def test_what_a_slow_motion_comes_to_is_what_a_long_one_does():
    def wall(gamma):
        return walls(gamma, 0.222)

    slow, late = (
        bifurcation_diagram(wall, [0.867], transient=n, exponents=True) for n in (150, 4000)
    )
    assert slow.periods[0] == late.periods[0] == 1
    assert slow.strobe[0] == pytest.approx(late.strobe[0], rel=1e-8)
    assert slow.exponents == pytest.approx(late.exponents, abs=1e-8)


@pytest.mark.parametrize("frequency", [20.1, 20.3355])
def test_chaos_never_closes(frequency):
    """However it stands when it ends: many lengths, many starts."""
    ends = range(150, 400)
    found = [
        bifurcation_diagram(
            lambda _: scenes.karpodinis(frequency), [0], periods=1, transient=n, closed=1e-6
        )
        for n in ends
    ]
    assert not any(one.periods[0] for one in found)


def test_axes_bear_the_names_of_the_parameters():
    found = bifurcation_diagram(lambda eta: scenes.okolewski(eta, 1.0), [4.0], transient=100)
    assert found.plot(Figure().subplots()).get_xlabel() == r"$\eta$"
    chart = periodicity_chart(
        lambda gamma, damping_ratio: scenes.begley_virgin(
            gamma, 1.5, 0.1, damping_ratio=damping_ratio
        ),
        [2.0, 2.1],
        [0.1, 0.2],
    )
    ax = chart.plot(Figure().subplots())
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"$\gamma$", "damping ratio")
    assert bifurcation_diagram(Named(), [4.0], transient=100).parameter == "eta"


class Named:
    def __call__(self, eta):
        return scenes.okolewski(eta, 1.0)


def test_figures_of_a_chart_tell_what_is_there():
    found = periodicity_chart(walls, np.linspace(0.4, 2.0, 9), [0.1, 0.3])
    for colours, first in (("orbits", "(0, 1)"), ("classes", "period-1 without impact")):
        ax = found.plot(Figure().subplots(), colours=colours)
        assert ax.get_legend().get_texts()[0].get_text() == first
    with pytest.raises(InvalidInput, match="colours"):
        found.plot(Figure().subplots(), colours="red")


def test_a_motion_that_ends_early_is_not_known():
    def broken(value):
        return Oscillator(
            forces=Force(1.0, 0.7), damping=0.1, law=lambda t, x, v: math.nan * value * x + 0 / x
        )

    found = bifurcation_diagram(broken, [1.0], exponents=True)
    assert found.status != ("complete",)
    assert np.isnan(found.impacts_per_period[0])
    chart = periodicity_chart(lambda a, b: broken(a), [1.0], [1.0])
    assert chart.failed.all()
    assert chart.classes[0, 0] == -1
    chart.plot(Figure().subplots())


@pytest.mark.parametrize(
    ("changes", "argument"),
    [
        ({"values": []}, "values"),
        ({"values": [1.0, math.inf]}, "values"),
        ({"scene": lambda _: "none"}, "scene"),
        ({"periods": 0}, "periods"),
        ({"transient": 0}, "transient"),
        ({"closed": 0.0}, "closed"),
        ({"workers": 0}, "workers"),
        ({"initial": (1.0,)}, "initial"),
        ({"scene": lambda _: Oscillator(stops=Stop(1.0, Rigid(0.5)))}, "periods"),
    ],
)
def test_bad_input_of_a_diagram_is_named(changes, argument):
    given = {"scene": okolewski("hard"), "values": [3.0]} | changes
    with pytest.raises(InvalidInput) as caught:
        bifurcation_diagram(given.pop("scene"), given.pop("values"), **given)
    assert caught.value.argument == argument


def test_exponents_that_were_not_asked_for_are_not_drawn():
    found = bifurcation_diagram(okolewski("hard"), [4.0])
    with pytest.raises(InvalidInput, match="exponents=True"):
        found.plot(Figure().subplots(), observe="exponents")
    with pytest.raises(InvalidInput, match="observe"):
        found.plot(Figure().subplots(), observe="colour")


def strobes_of(x, impacts):
    """Rows of a motion at rest between the strobes: place, velocity, impacts, energy lost."""
    rows = np.zeros((len(x), 4))
    rows[:, 0], rows[:, 2] = x, impacts
    return rows


@pytest.mark.parametrize(
    ("x", "impacts", "closed"),
    [
        ([1], [1], 1),
        ([1, -1], [1], 2),
        ([1], [1, 2], 2),
        ([1, -1], [1, 1, 1, 2], 4),
        ([1, -1], [1, 1, 2, 1], 4),
        ([1, -1, 0.5], [1, 1, 1, 2, 2, 2], 6),
    ],
)
def test_an_orbit_has_closed_only_where_its_impacts_have_as_well(x, impacts, closed):
    n = 39
    strobes = strobes_of(np.resize(x, n + 1), np.resize(impacts, n + 1))
    for last in range(3 * closed, n + 1):
        assert closing(strobes, last, 1e-6, 8) == closed
    assert closing(strobes, 3 * closed - 1, 1e-6, 8) == 0
    assert closing(strobes, n, 1e-6, closed - 1) == 0
