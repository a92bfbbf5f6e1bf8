"""Basins of attraction, against motions that are followed one by one."""

from __future__ import annotations

from dataclasses import replace

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from matplotlib.figure import Figure
from scipy.stats import binomtest

from impactsig import (
    OGY,
    Controlled,
    DelayedFeedback,
    Flow,
    InvalidInput,
    Noise,
    basins_of_attraction,
    find_periodic_orbit,
    scenes,
    simulate,
)
from impactsig.dynamics.diagrams import _survey

from .test_diagrams_of_systems import one_mode, shaken

FOUR = scenes.begley_virgin(1.338, 1.6, 0.05)


@pytest.fixture(scope="module")
def four():
    return basins_of_attraction(FOUR, np.linspace(-2.5, 2.5, 24), np.linspace(-3, 3, 20))


def test_the_four_attractors_of_the_reference(four):
    kinds = sorted((a.impacts, a.periods) for a in four.attractors)
    assert kinds == [(0, 1), (2, 1), (3, 2), (3, 2)]
    points = {(a.impacts, a.periods): a.strobe for a in four.attractors}
    assert points[0, 1][0] == pytest.approx([-0.22939, -1.65387], abs=5.1e-6)
    assert points[2, 1][0] == pytest.approx([-0.13229, 1.55535], abs=5.1e-6)
    assert four.open_share == 0
    assert four.failed == 0
    assert four.shares.sum() == pytest.approx(1)
    assert np.all(np.diff(four.shares) <= 0)
    assert np.all((four.intervals[:, 0] < four.shares) & (four.shares < four.intervals[:, 1]))


def test_intervals_of_the_shares_are_those_of_wilson(four):
    """Their ends p are where the share is 1.96 standard errors sqrt(p (1 - p) / n) away."""
    n = four.labels.size
    for share, interval in zip(four.shares, four.intervals, strict=True):
        for p in interval:
            assert (share - p) ** 2 == pytest.approx(1.959963984540054**2 * p * (1 - p) / n)
        assert interval == pytest.approx(
            binomtest(round(share * n), n).proportion_ci(method="wilson"), rel=1e-12
        )


def test_every_start_ends_where_its_motion_does(four):
    rng = np.random.default_rng(2)
    for _ in range(40):
        i, j = rng.integers(20), rng.integers(24)
        motion = simulate(FOUR, periods=1, transient=600, initial=(four.x[j], four.v[i]))
        points = four.attractors[four.labels[i, j]].strobe
        apart = np.abs(points - np.array(motion.final[:2])).max(axis=1)
        assert apart.min() < 1e-6


def test_catching_changes_no_label(four):
    full = basins_of_attraction(FOUR, four.x, four.v, catch=False, workers=1)
    assert np.array_equal(full.labels, four.labels)
    assert four.rechecked == 256
    assert four.differing == 0
    assert all(attractor.radius > 0 for attractor in four.attractors)
    assert all(attractor.radius == 0 for attractor in full.attractors)


def test_attractors_that_no_scout_reached_are_found(four, monkeypatch):
    """Their starts are followed until their orbits close, as none of them may be caught."""
    monkeypatch.setattr(_survey, "SCOUTS", 1)
    found = basins_of_attraction(FOUR, four.x, four.v)
    assert sum(one.radius > 0 for one in found.attractors) == 1
    assert sum(one.radius == 0 for one in found.attractors) == 3
    assert np.array_equal(found.labels, four.labels)


def test_a_moving_base_is_seen_from_the_ground():
    found = basins_of_attraction(scenes.okolewski(4.0, 0.6), [0.01, 0.02], [0.0, 0.1])
    (only,) = found.attractors
    motion = simulate(scenes.okolewski(4.0, 0.6), periods=1, transient=500)
    assert np.abs(only.strobe - np.array(motion.final[:2])).max(axis=1).min() < 1e-9
    assert found.shares == [1.0]


def test_chaos_is_left_open():
    found = basins_of_attraction(scenes.karpodinis(20.1), [0.0, 0.5], [0.0], periods=200)
    assert found.open_share == 1
    assert found.attractors == ()
    found.plot(Figure().subplots())


def test_figure_names_the_attractors(four):
    ax = four.plot(Figure().subplots())
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert len(texts) == 4
    assert texts[0].startswith("(2, 1)")
    assert ax.get_xlim() == pytest.approx((-2.5, 2.5), rel=0.1)
    assert ax.get_ylim() == pytest.approx((-3, 3), rel=0.1)


def well_rates(t, y, drag):
    return y[1], y[0] - y[0] ** 3 - drag * y[1]


def well(drag):
    """A ball between two hollows, at x = -1 and x = 1."""
    return Flow(well_rates, (0.0, 0.0), (drag,), name="two hollows")


def test_a_ball_rests_in_the_hollow_that_it_rolls_into():
    """Heavily damped from rest it stays on its side of the hill."""
    x = np.array([-1.5, 0.1])
    found = basins_of_attraction(well(5.0), x, [0.0], section=("x", 0.0))
    assert [(own.impacts, own.periods) for own in found.attractors] == [(0, 1), (0, 1)]
    ended = np.array([found.attractors[k].strobe[0] for k in found.labels[0]])
    np.testing.assert_allclose(ended, np.stack([np.sign(x), 0 * x], axis=1), atol=1e-8)
    assert found.open_share == found.failed == found.rechecked == 0
    assert found.plot(Figure().subplots()).get_xlabel() == "displacement at the start"


def nothing(t, x, v):
    return 0.0


def test_a_stepped_oscillator_has_the_basins_of_the_exact_one():
    plane = np.linspace(-2, 2, 4), np.linspace(-2, 2, 3)
    expected = basins_of_attraction(FOUR, *plane, catch=False)
    found = basins_of_attraction(replace(FOUR, law=nothing), *plane)
    np.testing.assert_array_equal(found.labels, expected.labels)
    for own, other in zip(found.attractors, expected.attractors, strict=True):
        assert (own.impacts, own.periods) == (other.impacts, other.periods)
        np.testing.assert_allclose(np.sort(own.strobe, 0), np.sort(other.strobe, 0), atol=1e-6)


def test_one_mode_of_a_cantilever_has_the_basins_of_its_oscillator():
    plane = np.linspace(-1e-3, 9e-4, 4), np.linspace(-0.1, 0.1, 3)
    expected = basins_of_attraction(one_mode(19.0), *plane, catch=False)
    found = basins_of_attraction(shaken(19.0), *plane)
    np.testing.assert_array_equal(found.labels, expected.labels)
    assert len(found.attractors) > 0
    for own, other in zip(found.attractors, expected.attractors, strict=True):
        assert (own.impacts, own.periods) == (other.impacts, other.periods)
        np.testing.assert_allclose(np.sort(own.strobe, 0), np.sort(other.strobe, 0), atol=1e-8)


def test_under_ogy_starts_are_those_whose_motions_come_to_the_orbit_in_time():
    x, v, periods = [0.2, 0.4, 0.6, 0.8], [-0.4, 0.0, 0.4], 128
    bare = scenes.karpodinis(20.3355)
    orbit = find_periodic_orbit(bare, 1, impacts=1)
    beam = Controlled(bare, OGY(orbit, limit=0.01))
    found = basins_of_attraction(beam, x, v, periods=periods)
    held = [
        [
            np.hypot(*(simulate(beam, periods=periods, initial=(a, b)).final[:2]
                       - orbit.state)) < 1e-7
            for a in x
        ]
        for b in v
    ]  # fmt: skip
    assert np.any(held)
    assert not np.all(held)
    np.testing.assert_array_equal(found.labels, np.where(held, 0, -1))
    assert found.attractors[0].strobe[0] == pytest.approx(orbit.state, abs=1e-7)
    with pytest.raises(InvalidInput, match="on for good"):
        basins_of_attraction(replace(beam, start=5), x, v)


@pytest.mark.parametrize(
    ("changes", "argument"),
    [
        ({"x": []}, "x"),
        ({"v": ["a"]}, "v"),
        ({"periods": 0}, "periods"),
        ({"closed": -1.0}, "closed"),
        ({"workers": 1.5}, "workers"),
        ({"x": [1.5]}, "initial"),
        ({"system": "beam"}, "system"),
        ({"system": Controlled(scenes.karpodinis(20.1), DelayedFeedback(0.1))}, "system"),
        ({"system": replace(scenes.karpodinis(20.1), noise=Noise(0.1))}, "system"),
        ({"system": well(0.1)}, "section"),
        ({"system": well(0.1), "section": "x"}, "section"),
    ],
)
def test_bad_input_is_named(changes, argument):
    given = {"system": scenes.karpodinis(20.1), "x": [0.0], "v": [0.0]} | changes
    with pytest.raises(InvalidInput) as caught:
        basins_of_attraction(**given)
    assert caught.value.argument == argument
