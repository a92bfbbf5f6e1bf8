"""The cantilever as drawn, and the scene made of it, against closed forms and many digits."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from matplotlib import pyplot

from impactsig import (
    Cantilever,
    Force,
    InvalidInput,
    KelvinVoigt,
    Rigid,
    Stop,
    scenes,
    simulate,
)

DRAWING = (0.2, 0.025, 1e-3, 210e9, 7850.0)
BEAM = Cantilever(*DRAWING)


def scene(stop=1e-3, frequency=20.0, amplitude=1e-4, **options):
    return scenes.cantilever(*DRAWING, stop, frequency, amplitude, **options)


def root(n):
    """beta L of mode n, in the precision of the context."""
    start = (mpmath.mpf(n) - 0.5) * mpmath.pi + (0.3 if n == 1 else 0)
    return mpmath.findroot(lambda x: mpmath.cos(x) + 1 / mpmath.cosh(x), start)


def shape(b, xi):
    sigma = (mpmath.cosh(b) + mpmath.cos(b)) / (mpmath.sinh(b) + mpmath.sin(b))

    def phi(y):
        return mpmath.cosh(y) - mpmath.cos(y) - sigma * (mpmath.sinh(y) - mpmath.sin(y))

    return phi(b * mpmath.mpf(xi)) / phi(b), sigma


def test_first_four_frequencies():
    with mpmath.workdps(40):
        length, _width, thickness, modulus, density = (mpmath.mpf(value) for value in DRAWING)
        speed = mpmath.sqrt(modulus * thickness**2 / (12 * density)) / length**2
        expected = [float(root(n) ** 2 * speed / (2 * mpmath.pi)) for n in range(1, 5)]
    assert BEAM.frequencies() == pytest.approx(expected, rel=1e-14)
    assert BEAM.wavenumbers(3) == pytest.approx([1.8751041, 4.6940911, 7.8547574], abs=5e-8)


@pytest.mark.parametrize("mode", [1, 2, 3, 5, 12, 60, 400])
def test_modes_keep_their_digits_however_high(mode):
    """To the rounding of the place: beta x has as many radians as it has."""
    places = np.linspace(0, 1, 9)
    with mpmath.workdps(2 * int(1.4 * mode) + 40):  # cosh takes half of them
        b = root(mode)
        assert abs(BEAM.wavenumbers(mode)[-1] / b - 1) < 3e-16
        expected = [float(shape(b, xi)[0]) for xi in places]
        assert BEAM.participation(mode)[-1] == pytest.approx(
            float(4 * (-1) ** (mode - 1) * shape(b, 0)[1] / b), rel=1e-15
        )
    found = BEAM.mode_shape(mode, places * BEAM.length)
    assert found == pytest.approx(expected, abs=2e-15 * (1 + mode))


def test_shapes_near_the_clamp_do_not_cancel():
    near = np.array([1e-9, 1e-5, 1e-3, 0.02, 0.3])
    with mpmath.workdps(60):
        expected = [float(shape(root(2), xi)[0]) for xi in near]
    assert BEAM.mode_shape(2, near * BEAM.length) == pytest.approx(expected, rel=1e-14)


def test_modes_are_orthogonal_with_a_quarter_of_the_mass():
    nodes, weights = np.polynomial.legendre.leggauss(200)
    x, weights = (nodes + 1) / 2 * BEAM.length, weights / 2
    shapes = np.array([BEAM.mode_shape(n, x) for n in range(1, 9)])
    assert shapes * weights @ shapes.T == pytest.approx(np.eye(8) / 4, abs=1e-14)
    assert (shapes @ weights) * 4 == pytest.approx(BEAM.participation(8), rel=1e-12)
    assert BEAM.modal_mass == pytest.approx(7850 * 0.025 * 1e-3 * 0.2 / 4)


def test_compliances_of_all_modes_add_up_to_that_at_rest():
    left = []
    for count in (10, 100, 1000):
        compliance = (1 / BEAM.modal_stiffness(count)).sum()
        left.append(1 - compliance * BEAM.stiffness)
        # The tail of the sum of 12 / b^4, b = (n - 1/2) pi, by its integral.
        assert left[-1] == pytest.approx(4 / math.pi**4 / count**3, rel=0.02)
    assert BEAM.stiffness == pytest.approx(3 * 210e9 * 0.025 * 1e-9 / 12 / 0.2**3)
    rates = 2 * np.pi * BEAM.frequencies(6)
    assert BEAM.modal_stiffness(6) == pytest.approx(BEAM.modal_mass * rates**2, rel=1e-14)


def test_tuned_moves_all_frequencies_alike():
    tuned = BEAM.tuned(22.2)
    assert tuned.frequencies(1)[0] == pytest.approx(22.2, rel=1e-14)
    assert tuned.frequencies(5) / BEAM.frequencies(5) == pytest.approx(
        np.full(5, 22.2 / BEAM.frequencies(1)[0]), rel=1e-14
    )
    assert tuned.mass == BEAM.mass


@pytest.mark.parametrize(
    ("make", "argument"),
    [
        (lambda: Cantilever(0, 0.025, 1e-3, 210e9, 7850), "length"),
        (lambda: Cantilever(0.2, "wide", 1e-3, 210e9, 7850), "width"),
        (lambda: Cantilever(0.2, 0.025, 0.05, 210e9, 7850), "thickness"),
        (lambda: Cantilever(0.2, 0.025, 1e-3, math.inf, 7850), "modulus"),
        (lambda: Cantilever(0.2, 0.025, 1e-3, 210e9, -1), "density"),
        (lambda: BEAM.frequencies(0), "count"),
        (lambda: BEAM.wavenumbers(2.5), "count"),
        (lambda: BEAM.mode_shape(0, 0.1), "mode"),
        (lambda: BEAM.mode_shape(1, 0.21), "x"),
        (lambda: BEAM.mode_shape(1, "tip"), "x"),
        (lambda: BEAM.tuned(-1), "frequency"),
        (lambda: BEAM.plot(modes=0), "modes"),
        (lambda: scene(stop=0), "stop"),
        (lambda: scene(frequency="fast"), "frequency"),
        (lambda: scene(amplitude=math.nan), "amplitude"),
        (lambda: scene(loading="side"), "loading"),
        (lambda: scene(damping_ratio=-1), "damping_ratio"),
        (lambda: scene(restitution=2), "restitution"),
        (lambda: scene(natural_frequency=0), "natural_frequency"),
    ],
)
def test_what_cannot_be_is_refused_by_name(make, argument):
    with pytest.raises(InvalidInput) as caught:
        make()
    assert caught.value.argument == argument


def test_scene_is_the_first_mode():
    machine = scene(loading="tip", amplitude=0.1, damping_ratio=0.01)
    first = 2 * math.pi * BEAM.frequencies(1)[0]
    assert machine.angular_natural_frequency == pytest.approx(first, rel=1e-14)
    assert machine.damping == pytest.approx(2 * 0.01 * machine.mass * first)
    assert machine.mass == BEAM.modal_mass
    assert machine.forces == (Force(0.1, 2 * math.pi * 20),)
    assert machine.stops == (Stop(1e-3, Rigid(0.2)),)
    assert machine.time_unit == machine.length_unit == machine.mass_unit == 1.0
    measured = scene(natural_frequency=22.2)
    assert measured.angular_natural_frequency == pytest.approx(2 * math.pi * 22.2)
    assert measured.mass == machine.mass
    soft = Stop(1e-3, KelvinVoigt(1e4, 0.1))
    assert scene(stops=soft).stops == (soft,)


@pytest.mark.parametrize("loading", ["base", "clamp"])
def test_shaken_clamp_drives_the_tip_by_its_share(loading):
    """The steady tip of the first mode, in closed form; too far from the stop to touch it."""
    omega, a = 100.0, 1e-4
    machine = scene(1.0, omega / (2 * math.pi), a, loading=loading, damping_ratio=0.05)
    motion = simulate(machine, periods=2, transient=400)
    first = machine.angular_natural_frequency
    share = 1.5659835120792516
    relative = share * omega**2 / (first**2 - omega**2 + 0.1j * first * omega)
    tip = a * (relative + (loading == "clamp"))
    time = np.linspace(motion.start, motion.stop, 50)
    expected = (tip * np.exp(1j * omega * time)).real
    assert motion.sample(time)[0] == pytest.approx(expected, abs=1e-12 * abs(tip) + 1e-17)


def test_mode_shapes_are_drawn():
    ax = BEAM.plot(modes=3)
    assert len(ax.get_lines()) == 4
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels[0] == f"1: {BEAM.frequencies(1)[0]:.4g} Hz"
    pyplot.close(ax.figure)
