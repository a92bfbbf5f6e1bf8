"""Where two families of oscillators do the same."""

from __future__ import annotations

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from matplotlib.figure import Figure

from impactsig import InvalidInput, match_rate, scenes, simulate, strobe_distance


def hard(omega, amplitude):
    return scenes.tian(omega, amplitude, "hard")


def soft(omega, amplitude):
    return scenes.tian(omega, amplitude, "soft")


def test_distance_of_sorted_sets_does_not_see_the_order():
    points = np.array([[0.0, 1.0], [2.0, 3.0], [1.0, -1.0]])
    assert strobe_distance(points, points[[2, 0, 1]]) == 0
    moved = points + np.array([0.3, 0.4])
    assert strobe_distance(points, moved[::-1]) == pytest.approx(0.5)


def test_each_cell_is_what_its_two_motions_say():
    x, y = [0.8, 2.5], [0.3, 1.9]
    found = match_rate(hard, soft, x, y, periods=20, transient=30)
    assert found.distance.shape == (2, 2)
    for i, amplitude in enumerate(y):
        for j, omega in enumerate(x):
            sets = []
            for family in (hard, soft):
                motion = simulate(family(omega, amplitude), periods=20, transient=30)
                sets.append(sorted(zip(*motion.stroboscopic(), strict=True)))
            one, other = np.array(sets)
            expected = np.mean(np.linalg.norm(one - other, axis=1))
            assert found.distance[i, j] == pytest.approx(expected, rel=1e-12)
    assert found.rate == np.mean(found.distance < 0.1)
    assert found.failed == 0


def test_a_family_matches_itself():
    found = match_rate(soft, soft, np.linspace(0.5, 4, 5), [0.5, 1.5], periods=20, transient=10)
    assert found.rate == 1
    assert np.all(found.distance == 0)


def test_figure_shows_the_share():
    found = match_rate(hard, soft, [0.8, 2.5], [0.3, 1.9], periods=20, transient=30)
    ax = found.plot(Figure().subplots())
    assert f"{found.rate:.1%}" in ax.get_title(loc="left")


@pytest.mark.parametrize(
    ("changes", "argument"),
    [
        ({"x": []}, "x"),
        ({"y": [np.nan]}, "y"),
        ({"x": "abc"}, "x"),
        ({"periods": 0}, "periods"),
        ({"transient": -1}, "transient"),
        ({"below": 0.0}, "below"),
        ({"workers": 0}, "workers"),
    ],
)
def test_bad_input_is_named(changes, argument):
    with pytest.raises(InvalidInput) as caught:
        match_rate(hard, soft, **({"x": [1.0], "y": [1.0]} | changes))
    assert caught.value.argument == argument


def test_sets_that_do_not_fit_are_refused():
    with pytest.raises(InvalidInput, match="second"):
        strobe_distance(np.zeros((3, 2)), np.zeros((2, 2)))
    with pytest.raises(InvalidInput, match="first"):
        strobe_distance(np.zeros(3), np.zeros((2, 2)))
    with pytest.raises(InvalidInput, match="second"):
        strobe_distance(np.zeros((1, 2)), [[0.0, np.nan]])
