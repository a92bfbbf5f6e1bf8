"""How impacts stretch, and what grazing does: determinants, amplitudes and square roots."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

import impactsig
from impactsig import Force, Oscillator, Rigid, Stop


def one_sided(zeta, amplitude, omega, restitution):
    return Oscillator(
        damping=2 * zeta, forces=Force(amplitude, omega), stops=(Stop(1, Rigid(restitution)),)
    )


def steady(zeta, amplitude, omega, phase=0.0):
    """Displacement and velocity of the forced response."""
    response = amplitude / complex(1 - omega**2, 2 * zeta * omega)
    turned = response * complex(math.cos(phase), math.sin(phase))
    return turned.real, -omega * turned.imag


def grazing_amplitude(zeta, omega):
    return math.hypot(1 - omega**2, 2 * zeta * omega)


def jacobian(step_map, state, step=0.01, pairs=8):
    """Derivative of a map of the plane by central differences of order 16."""
    columns = []
    for direction in np.eye(2):
        column = np.zeros(2)
        for k in range(1, pairs + 1):
            weight = Fraction(1, 2 * k)
            for j in range(1, pairs + 1):
                weight *= Fraction(j * j, j * j - k * k) if j != k else 1
            ahead, behind = (step_map(state + s * k * step * direction) for s in (1, -1))
            column += float(weight) * (ahead - behind) / step
        columns.append(column)
    return np.stack(columns, axis=1)


@pytest.mark.parametrize(
    ("zeta", "amplitude", "omega", "restitution"),
    [(0.03, 0.25, 22.1 / 22.2, 0.2), (0.1, 0.9, 0.8, 0.6), (0, 2.0, 1.7, 0.9), (1.5, 9, 1.1, 0.8),
     (0.05, 9.435, 2.7, 0.8)],
)  # fmt: skip
def test_areas_shrink_by_the_restitution_squared_and_the_damping(
    zeta, amplitude, omega, restitution
):
    """The determinant of the monodromy matrix is r^2 exp(-2 zeta T) where there is one impact.

    T runs from the middle of one flight to that of the next: a period on the first orbit, which is
    Shaw's and Holmes'. Central differences of order 16, 0.01 to 0.08 apart, reach 3e-13: beyond
    that rounding, 1e-16 / 0.01 magnified by the entries' products over their determinant, rules.
    """
    machine = one_sided(zeta, amplitude, omega, restitution)
    run = impactsig.simulate(machine, periods=8, transient=1000)
    time = run.impacts.time
    first = int(np.argmax(np.diff(time[:-1])))
    start, end = (time[first : first + 2] + time[first + 1 : first + 3]) / 2
    phase = omega * start % (2 * math.pi)

    def flow(state):
        motion = impactsig.simulate(machine, duration=end - start, initial=state, phase=phase)
        assert motion.impact_count == 1
        return np.array(motion.final[:2])

    matrix = jacobian(flow, np.array(run.sample(start)))
    expected = restitution**2 * math.exp(-2 * zeta * (end - start))
    assert np.linalg.det(matrix) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("zeta", "omega"), [(0.05, 0.8), (0.2, 2.3), (0.01, 1.0)])
def test_impacts_begin_at_the_grazing_amplitude(zeta, omega):
    """Bisection between forcings that do and do not make the steady motion touch."""

    lowest = np.angle(-complex(1 - omega**2, 2 * zeta * omega))  # phase of the least x

    def touches(amplitude):
        motion = impactsig.simulate(
            one_sided(zeta, amplitude, omega, 0.5), periods=1.5, keep="counts",
            initial=steady(zeta, amplitude, omega, lowest), phase=lowest,
        )  # fmt: skip
        return motion.impact_count > 0

    low, high = 0.5 * grazing_amplitude(zeta, omega), 1.4 * grazing_amplitude(zeta, omega)
    assert not touches(low)
    assert touches(high)
    for _ in range(52):
        middle = (low + high) / 2
        low, high = (low, middle) if touches(middle) else (middle, high)
    assert high == pytest.approx(grazing_amplitude(zeta, omega), rel=1e-14)


def test_approach_velocities_above_grazing_grow_with_the_square_root():
    """v / sqrt(A / A_g - 1) -> omega sqrt 2 for the first impact of a steady motion."""
    zeta, omega = 0.05, 0.8
    excess = np.logspace(-12, -5, 15)
    speed = []
    for above in excess:
        amplitude = grazing_amplitude(zeta, omega) * (1 + above)
        motion = impactsig.simulate(
            one_sided(zeta, amplitude, omega, 0.5), periods=1.5,
            initial=steady(zeta, amplitude, omega),
        )  # fmt: skip
        speed.append(motion.impacts.approach_velocity[0])
    slope, level = np.polyfit(np.log(excess), np.log(speed), 1)
    assert slope == pytest.approx(0.5, rel=1e-3)
    assert math.exp(level) == pytest.approx(omega * math.sqrt(2), rel=0.01)
    ratio = np.array(speed) / np.sqrt(excess)
    # The relative excess itself carries an error of 1e-16 / excess.
    np.testing.assert_allclose(ratio, omega * math.sqrt(2), rtol=1e-4)


def test_the_steady_motion_just_below_grazing_never_touches():
    zeta, omega = 0.05, 0.8
    amplitude = grazing_amplitude(zeta, omega) * (1 - 1e-9)
    below = impactsig.simulate(
        one_sided(zeta, amplitude, omega, 0.5), periods=1000, skip_unreachable=False,
        initial=steady(zeta, amplitude, omega),
    )  # fmt: skip
    assert below.impact_count == 0


@pytest.mark.parametrize("restitution", [0.0, 0.4, 0.9, 1.0])
def test_the_poincare_map_moves_with_the_square_root_of_the_penetration(restitution):
    """Nordmark (1991): x' -> -r x' at a speed sqrt(2 |a| d), d how deep it would go without a stop.

    At the turn the acceleration of the grazing motion is a = -omega^2. The shift of the state a
    third of a period later is (1 + r) sqrt(2 |a| d) times what the flow makes of a unit velocity.
    """
    zeta, omega = 0.05, 0.8
    amplitude = grazing_amplitude(zeta, omega)
    start, later = -0.8, 2 * math.pi / 3
    turn = np.angle(complex(1 - omega**2, 2 * zeta * omega))  # phase of the greatest x
    x, v = steady(zeta, amplitude, omega, turn + start)
    duration = (later - start) / omega
    free = Oscillator(damping=2 * zeta, forces=Force(amplitude, omega))
    damped = math.sqrt(1 - zeta**2)

    def unit(tau):
        """What a unit velocity becomes: the second column of the free flow."""
        decay, angle = math.exp(-zeta * tau), damped * tau
        return decay * np.array([
            math.sin(angle) / damped, math.cos(angle) - zeta / damped * math.sin(angle)
        ])  # fmt: skip

    back = unit(start / omega)  # along this from the grazing state, the turn is at another speed
    ahead = np.array(
        [back[1] + 2 * zeta * back[0], -back[0]]
    )  # first column of the flow back: the turn is that much deeper
    depth = np.logspace(-12, -6, 13)
    shift = []
    for d in depth:
        state = (x + d * ahead[0], v + d * ahead[1])
        options = {"duration": duration, "initial": state, "phase": turn + start}
        hit = impactsig.simulate(one_sided(zeta, amplitude, omega, restitution), **options)
        assert hit.impact_count == 1
        missed = impactsig.simulate(free, **options)
        shift.append(np.subtract(hit.final[:2], missed.final[:2]))
    expected = -(1 + restitution) * math.sqrt(2) * omega * unit(later / omega)
    for found, level in zip(np.transpose(shift), expected, strict=True):
        slope, intercept = np.polyfit(np.log(depth), np.log(np.abs(found)), 1)
        assert slope == pytest.approx(0.5, rel=0.01)
        assert np.sign(found[0]) * math.exp(intercept) == pytest.approx(level, rel=0.01)
