"""Begley and Virgin 1998: four attractors side by side, and motion that sticks."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

import impactsig
from impactsig import scenes

FOUR = {"gamma": 1.338, "sigma": 1.6, "friction": 0.05}


@pytest.mark.parametrize(
    ("point", "impacts"), [((-0.22939, -1.65387), 0), ((-0.13229, 1.55535), 2)]
)
@pytest.mark.parametrize("wall", [12.0**2, 15.0**2, 30.0**2])
def test_the_period_1_attractors(point, impacts, wall):
    """Strobe points at rho = 15; they are period-1, without and with two impacts, for others."""
    machine = scenes.begley_virgin(**FOUR, wall_stiffness=wall)
    motion = impactsig.simulate(machine, periods=20, transient=600, initial=point)
    x, v = motion.stroboscopic()
    assert np.ptp(x) < 1e-9
    assert np.ptp(v) < 1e-9
    assert motion.impact_count == 20 * impacts
    if wall == 225:
        assert (x[0], v[0]) == pytest.approx(point, abs=1e-5)


def test_there_are_four_of_them():
    """Two of period 1, and a pair of period 2 of which one is the other upside down."""
    machine = scenes.begley_virgin(**FOUR)
    rng = np.random.default_rng(0)
    starts = rng.uniform((-1.5, -2), (1.5, 2), (120, 2))
    motions = impactsig.simulate_many(machine, initial=starts, periods=8, transient=400)
    found = Counter()
    for motion in motions:
        x, v = motion.stroboscopic()
        found[tuple(sorted({(round(a, 6), round(b, 6)) for a, b in zip(x, v, strict=True)}))] += 1
    assert sorted(len(orbit) for orbit in found) == [1, 1, 2, 2]
    pair = [orbit for orbit in found if len(orbit) == 2]
    # Upside down and half a period later.
    x, v = impactsig.simulate(machine, periods=2, initial=pair[0][0]).stroboscopic(np.pi)
    turned = {(-a, -b) for a, b in zip(x, v, strict=True)}
    distance = [min(np.hypot(a - c, b - d) for c, d in turned) for a, b in pair[1]]
    assert max(distance) < 1e-5


def test_strong_friction_sticks_twice_in_a_period():
    """gamma = 0.5, f = 0.6, no wall reached: it stops at either end, as the symmetry demands."""
    motion = impactsig.simulate(scenes.begley_virgin(0.5, 9.0, 0.6), periods=10, transient=50)
    assert motion.impact_count == 0
    assert motion.stick_count == 20
    lasts = np.diff(motion.sticks, axis=1)
    assert np.ptp(lasts[1:-1]) < 1e-11
    x, v = motion.sample(motion.sticks[1:-1].mean(axis=1))
    assert np.all(v == 0)
    np.testing.assert_allclose(x[::2], -x[1::2], atol=1e-11)
