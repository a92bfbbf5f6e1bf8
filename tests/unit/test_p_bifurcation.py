"""Shapes of averaged densities, and where they change."""

from __future__ import annotations

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")

from matplotlib.figure import Figure

from impactsig import (
    InvalidInput,
    Noise,
    Oscillator,
    Rigid,
    Stop,
    averaged_density,
    p_bifurcation,
    plot,
    scenes,
)
from impactsig.results import DensityShape

FAR = np.inf


def shape(heights, lower=FAR, upper=FAR):
    """Extrema at energies 0, 1, 2... of these heights; the last is a maximum."""
    count = len(heights)
    maximum = (np.arange(count) - (count - 1)) % 2 == 0
    return DensityShape(np.arange(count, dtype=float), maximum, np.array(heights), lower, upper)


@pytest.mark.parametrize(
    ("heights", "name", "peaks"),
    [
        ([1.0], "peak", 1),
        ([0.2, 1.0], "crater", 2),
        ([0.5, 0.2, 1.0], "crater with peak", 3),
        ([0.2, 1.0, 0.5, 0.7], "2 ridges", 4),
        ([0.9, 0.2, 1.0, 0.5, 0.7], "2 ridges with peak", 5),
    ],
)
def test_names_and_peaks(heights, name, peaks):
    found = shape(heights)
    assert found.name == name
    assert found.peaks() == found.peaks("displacement") == peaks


def test_peaks_along_the_displacement_end_at_stops():
    assert shape([0.2, 1.0], lower=0.0).peaks("displacement") == 1  # the bottom is at the stop
    assert shape([0.5, 0.2, 1.0], lower=0.0).peaks("displacement") == 2
    # The ridge is at energy 1, beyond what a mass at rest at the stop has: the cut ends rising.
    assert shape([0.2, 1.0], upper=0.5).peaks("displacement") == 2
    assert shape([0.5, 0.2, 1.0], upper=0.5).peaks("displacement") == 2
    assert shape([0.5, 0.2, 1.0], upper=1.5).peaks("displacement") == 3
    with pytest.raises(InvalidInput, match="section"):
        shape([1.0]).peaks("energy")


@pytest.mark.parametrize(
    ("heights", "left"),
    [
        ([0.05, 0.01, 1.0], [0.01, 1.0]),  # the centre
        ([1.0, 0.01, 0.05], [1.0]),  # the outermost ridge
        ([0.02, 0.05, 0.04, 1.0], [0.02, 1.0]),  # an inner ridge, with the higher hollow
        ([0.04, 0.05, 0.02, 1.0], [0.04, 1.0]),
        ([0.5, 0.01, 0.05, 0.02, 1.0], [0.5, 0.01, 1.0]),
        ([0.5, 0.2, 1.0], [0.5, 0.2, 1.0]),
    ],
)
def test_peaks_too_low_to_be_seen(heights, left):
    found = shape(heights).visible(0.1)
    assert found.height.tolist() == left
    assert np.all(np.diff(found.maximum.astype(int)) != 0)
    assert found.maximum[-1]
    assert found.energy[0] == 0


def test_a_limit_cycle_leaves_the_bottom():
    """x'' + (x^2 - mu) x' + x = noise: a crater for mu > 0, a ridge of amplitude 2 sqrt(mu)."""

    def scene(mu):
        return Oscillator(law=lambda t, x, v: (mu - x * x) * v, noise=Noise(0.05))

    found = p_bifurcation(scene, [-0.2, 0.05, 0.1, 0.4])
    assert found.classes == ("peak", "crater", "crater", "crater")
    (only,) = found.transitions
    assert only.value == pytest.approx(0, abs=1e-9)
    for mu, each in zip([0.05, 0.1, 0.4], found.shapes[1:], strict=True):
        assert each.energy[1] == pytest.approx(2 * mu, rel=1e-10)
    assert found.parameter == "mu"


def test_two_ridges():
    """Means of sin^2 cos^2n over a cycle are 1/2, 1/8, 1/16, 5/128, so that at amplitude a a cycle
    gains as (1 - a^2) (4 - a^2) (9 - a^2) v^2 would.
    """
    machine = Oscillator(
        law=lambda t, x, v: 0.01 * (36 - 196 * x**2 + 112 * x**4 - 12.8 * x**6) * v,
        noise=Noise(0.05),
    )
    found = averaged_density(machine).shape
    assert found.energy[1:] == pytest.approx([0.5, 2.0, 4.5], rel=1e-9)
    assert found.name == "2 ridges"


def test_several_transitions_between_neighbouring_values():
    found = p_bifurcation(lambda f: scenes.van_der_pol_duffing(0.99, f), [0.0, 3.0])
    assert [each.before for each in found.transitions] == ["crater", "crater with peak"]
    assert found.transitions[-1].after == found.classes[-1] == "peak"


def test_shapes_with_a_stop_that_only_large_orbits_meet():
    """The stop takes energy from one side of its grazing only, and cuts the ridge off there."""

    def scene(gap):
        return Oscillator(
            law=lambda t, x, v: 0.05 * (0.5 - x * x) * v, noise=Noise(0.02),
            stops=(Stop(gap, Rigid(0.9)),),
        )  # fmt: skip

    free = averaged_density(scene(5.0)).shape
    assert free.energy[1] == pytest.approx(1.0, rel=1e-10)
    held = averaged_density(scene(1.2)).shape
    assert held.upper == pytest.approx(0.72)
    assert 0.72 < held.energy[1] < 1.0
    assert held.peaks("displacement") == 2


def test_nothing_damps_orbits_that_meet_no_stop():
    """The density is level up to the energy of grazing, 0.5, and falls from there."""
    machine = Oscillator(noise=Noise(0.1), stops=(Stop(1.0, Rigid(0.8)),))
    density = averaged_density(machine)
    assert density.joint_density(0.0, [0.0, 0.5, 0.99]) == pytest.approx(
        np.full(3, density.shape.height[0]), rel=1e-12
    )
    assert density.joint_density(0.0, 1.2) < 0.99 * density.shape.height[0]
    assert density.shape.name == "peak"


@pytest.mark.parametrize(
    ("arguments", "argument"),
    [
        ({"values": []}, "values"),
        ({"values": [1.0, np.nan]}, "values"),
        ({"values": [1.0, 0.5]}, "values"),
        ({"values": "r"}, "values"),
        ({"least": 1.5}, "least"),
        ({"tolerance": 0.0}, "tolerance"),
        ({"impact": "soft"}, "impact"),
        ({"scene": lambda r: None}, "scene"),
    ],
)
def test_bad_input(arguments, argument):
    given = {"scene": scenes.van_der_pol_duffing, "values": [0.97], **arguments}
    with pytest.raises(InvalidInput) as caught:
        p_bifurcation(given.pop("scene"), given.pop("values"), **given)
    assert caught.value.argument == argument


def test_figure_of_a_density():
    density = averaged_density(scenes.van_der_pol_duffing(0.99, 2))
    energies, plane, cut = density.plot(Figure())
    assert energies.get_xlabel() == "energy $H$"
    assert plane.get_xlabel() == "displacement $x$"
    assert cut.get_title(loc="left") == "crater with peak"
    marked = {line.get_label(): line for line in cut.lines if line.get_marker() == "o"}
    assert len(np.unique(np.abs(marked["maximum"].get_xdata()))) == 2
    assert len(marked["minimum"].get_xdata()) == 2
    # A ridge is drawn on the energies at which the density is greatest.
    ridge = plane.lines[0]
    x, v = np.asarray(ridge.get_xdata()), np.asarray(ridge.get_ydata())
    assert v**2 / 2 + x**4 / 4 == pytest.approx(np.full(len(x), density.shape.energy[-1]))


def test_figure_of_a_diagram():
    found = p_bifurcation(lambda friction: scenes.van_der_pol_duffing(0.99, friction), [1, 2, 3])
    ax = found.plot(Figure().subplots())
    assert ax.get_xlabel() == "friction"
    maxima, minima = ax.lines[:2]
    assert len(maxima.get_xdata()) == 5
    assert len(minima.get_xdata()) == 2
    assert ax.lines[2].get_xdata()[0] == found.transitions[0].value
    assert [text.get_text() for text in ax.texts] == ["crater\nwith peak", "peak"]
    assert plot.p_bifurcation(found) is not None
