"""Machines whose tables are stacked are moved as each alone, to the last bit."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest

from impactsig import (
    BaseMotion,
    Force,
    Friction,
    InvalidInput,
    KelvinVoigt,
    Oscillator,
    Rigid,
    Stop,
    periodicity_chart,
    scenes,
)
from impactsig.dynamics.diagrams.settling.cells import follow_cells
from impactsig.dynamics.diagrams.settling.closing import _about_to_close
from impactsig.dynamics.diagrams.settling.settling import settle
from impactsig.simulation.basis.columns import columns_of, form_of
from impactsig.simulation.basis.events import STROBE_IMPACTS
from impactsig.simulation.exact.modes import SHARED, stacks, tables


def machine(rng):
    """One with up to three stops on either side, in any order."""
    stops = []
    for side, sign in (("upper", 1), ("lower", -1)):
        places = np.sort(rng.uniform(0.1, 2.0, rng.integers(0, 4)))
        for k, place in enumerate(places):
            soft = KelvinVoigt(10 ** rng.uniform(0, 4), rng.uniform(0.1, 3))
            laws = [
                soft,
                KelvinVoigt(soft.stiffness, soft.damping, "force"),
                KelvinVoigt(soft.stiffness, 0.0, "force"),
                Rigid(rng.uniform()),
            ]
            law = laws[rng.integers(0, 4 if k == len(places) - 1 else 3)]
            stops.append(Stop(sign * place, law, side))
    return Oscillator(
        mass=rng.uniform(0.5, 2),
        damping=rng.uniform(0.01, 1),
        stiffness=10 ** rng.uniform(-3, 2),
        forces=[Force(rng.uniform(), w, rng.uniform(0, 6)) for w in rng.choice([1.3, 2.0], 2)],
        load=rng.normal(),
        base=[None, BaseMotion(0.3, 1.7, stops=True)][rng.integers(0, 2)],
        stops=[stops[k] for k in rng.permutation(len(stops))],
        friction=[None, Friction(0.1), Friction(0.0, 0.2)][rng.integers(0, 3)],
    )


@pytest.fixture(scope="module")
def machines():
    rng = np.random.default_rng(5)
    return [machine(rng) for _ in range(600)]


def test_tables_are_the_same_alone_and_among_others(machines):
    forms = defaultdict(list)
    for oscillator in machines:
        forms[form_of(oscillator)].append(oscillator)
    sizes = []
    for members in forms.values():
        found = stacks(columns_of(members), 1e-6, True)
        assert sorted(np.concatenate([stack.which for stack in found])) == [*range(len(members))]
        for stack in found:
            sizes.append(len(stack.which))
            for k, number in enumerate(stack.which):
                alone = tables(members[number], 1e-6, True).problem
                for name, value in stack.problem._asdict().items():
                    own = value if name in SHARED else value[k]
                    assert np.array_equal(own, getattr(alone, name)), name
    assert max(sizes) > 5


def test_forced_response_fulfils_the_equation_of_motion(machines):
    theta = np.linspace(0, 6, 7)
    for oscillator in machines[:100]:
        p = tables(oscillator, 1e-6, True).problem
        for i in range(len(p.kappa)):
            for c, w in enumerate(p.ratio):
                cos, sin = np.cos(theta), np.sin(theta)
                q = p.cosine[i, c] * cos + p.sine[i, c] * sin
                v = w * (p.sine[i, c] * cos - p.cosine[i, c] * sin)
                force = p.force_cos[c] * cos + p.force_sin[c] * sin
                left = (p.kappa[i] - w * w) * q + 2 * p.delta[i] * v
                scale = abs(p.force_cos[c]) + abs(p.force_sin[c])
                assert left == pytest.approx(force, abs=1e-14 * scale)
                assert p.reach[i, 0] >= np.abs(q).max()


def test_cells_of_many_are_those_of_each(machines):
    some = [m for m in machines if m.base is None][:80]
    forms = defaultdict(list)
    for oscillator in some:
        forms[form_of(oscillator)].append(oscillator)
    closed_late = 0
    for members in forms.values():
        n = len(members)
        start = np.tile((0.0, 0.1), (n, 1))
        found = follow_cells(columns_of(members), 20, start, np.zeros(n), 1e-6, True)
        for k, oscillator in enumerate(members):
            settled = settle(oscillator, 20, tolerance=1e-6, initial=(0.0, 0.1))
            orbit = settled.closing()
            assert (found.periods[k], found.followed[k]) == (orbit.closed, len(settled.strobes) - 1)
            closed_late += orbit is not settled
            impacts = orbit.strobes[-orbit.closed :, STROBE_IMPACTS].sum() if orbit.closed else -1
            assert found.impacts[k] == impacts
    assert closed_late > 3


def test_chart_over_machines_of_different_shape_puts_each_in_its_place():
    def scene(gamma, friction):
        return scenes.begley_virgin(gamma, 0.8, friction)  # none where the friction is 0

    x, y = np.linspace(0.5, 1.5, 5), np.array([0.0, 0.1, 0.0])
    chart = periodicity_chart(scene, x, y, periods=100)
    for row in range(3):
        alone = periodicity_chart(scene, x, y[row : row + 1], periods=100)
        assert np.array_equal(chart.periods[row], alone.periods[0])
        assert np.array_equal(chart.followed[row], alone.followed[0])


def test_chart_of_a_scene_that_takes_numbers_only_is_the_same():
    def numbers_only(frequency, restitution):
        return scenes.karpodinis(float(frequency), restitution=float(restitution))

    def arrays_too(frequency, restitution):
        return scenes.karpodinis(frequency, restitution=restitution)

    x, y = np.linspace(19, 25, 5), np.linspace(0.1, 0.8, 4)
    one, other = (
        periodicity_chart(scene, x, y, periods=20) for scene in (numbers_only, arrays_too)
    )
    for name in ("periods", "impacts", "followed", "failed"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


def test_an_orbit_is_looked_for_once_two_rounds_of_returns_are_small():
    """What the derivative tells is compared over two rounds; one alone may be chance."""
    strobes = np.zeros((2, 8, 4))
    strobes[:, :, 0] = 1.0
    strobes[1, 5, 0] = 1.5  # the return before the last is far off
    both = np.array([7, 7]), np.array([0, 1]), 1, np.array([0.01, 0.01])
    assert _about_to_close(strobes, *both).tolist() == [True, False]
    strobes[1, 5, 0] = 1.0
    strobes[1, 7, STROBE_IMPACTS] = 1.0
    assert _about_to_close(strobes, *both).tolist() == [True, False]


def test_chart_refuses_what_is_no_oscillator():
    with pytest.raises(InvalidInput) as caught:
        periodicity_chart(lambda a, b: None, [1.0, 2.0], [1.0])
    assert caught.value.argument == "scene"
