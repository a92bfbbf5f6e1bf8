"""Parameters of an oscillator and a step as the kernels take them."""

from __future__ import annotations

import cmath
import math
from typing import TYPE_CHECKING

import numpy as np

from ...oscillators import Noise, Oscillator, Stop
from ...simulation.basis.frame import forcing, reference_frequency
from ...simulation.exact.user import compiled, restitution_laws

if TYPE_CHECKING:
    from ._gaussian import Transition
    from .accumulating import Potential
    from .equation import Functions, Problem

NODES = 4097  # of a law's potential


def pose(oscillator: Oscillator, step: float, phase: float, unfold: bool = False) -> Problem:
    """The parameters per mass, in the oscillator's own units of time and length."""
    from .equation import Problem

    mass, omega = oscillator.mass, reference_frequency(oscillator)
    turned = phase / omega  # the reference has come to `phase` at t = 0
    waves = [
        (ratio * omega, abs(amplitude) * omega**2, cmath.phase(amplitude) + ratio * phase)
        for ratio, amplitude in forcing(oscillator)
        if amplitude
    ]
    soft, walls = [], {"upper": (math.inf, 1.0, -1), "lower": (-math.inf, 1.0, -1)}
    for number, stop in enumerate(oscillator.stops):
        law = stop.law
        if law.rigid:
            walls[stop.side] = stop.position, law.row().restitution, number
            continue
        soft.append((stop.position, stop.sign, *law.row(mass, mass), number))

    noise, friction = oscillator.noise or Noise(0.0), oscillator.friction
    tau = noise.correlation_time
    memory = math.exp(-step / tau) if tau else 0.0
    kinetic = friction.kinetic / mass if friction else 0.0
    static = friction.static / mass if friction else 0.0  # type: ignore[operator]
    base = oscillator.base
    carried = base if base is not None and base.stops else None
    fold = 0.0
    if unfold:
        fold = 1.0 if walls["lower"][2] >= 0 else -1.0
    return Problem(
        step=step,
        kappa=oscillator.stiffness / mass,
        damping=oscillator.damping / mass,
        constant=oscillator.load / mass,
        waves=np.array(waves, float).reshape(-1, 3),
        soft=np.array(soft, float).reshape(-1, 8),
        low=walls["lower"][0],
        high=walls["upper"][0],
        low_restitution=walls["lower"][1],
        high_restitution=walls["upper"][1],
        low_stop=walls["lower"][2],
        high_stop=walls["upper"][2],
        kinetic=kinetic,
        static=static if tau else kinetic,
        sigma=0.0 if tau else math.sqrt(2 * noise.intensity) / mass,
        memory=memory,
        turned=math.cos(noise.angular_frequency * step),
        across=math.sin(noise.angular_frequency * step),
        fresh=filtered_deviation(oscillator) * math.sqrt(1 - memory**2),
        parametric=noise.parametric,
        forced=oscillator.law is not None,
        mass=mass,
        fold=fold,
        base_amplitude=carried.amplitude if carried else 0.0,
        base_frequency=carried.angular_frequency if carried else 1.0,
        base_angle=carried.phase + carried.angular_frequency * turned if carried else 0.0,
    )


def filtered_deviation(oscillator: Oscillator) -> float:
    """Standard deviation of the filtered force per mass; 0 for white noise."""
    noise = oscillator.noise
    if noise is None or not noise.correlation_time:
        return 0.0
    return math.sqrt(noise.intensity / noise.correlation_time) / oscillator.mass


def functions(oscillator: Oscillator) -> Functions:
    """The user's functions, compiled; placeholders where there are none."""
    from ...simulation.stepping.rates import no_law
    from ._laws import no_laws, over_paths
    from .equation import Functions

    law, laws = no_law, no_laws
    if oscillator.law is not None:
        law, laws = compiled("law", oscillator.law, 3), over_paths(oscillator.law)
    return Functions(law, laws, *restitution_laws(oscillator))


def potential(oscillator: Oscillator, law: object, low: float, high: float) -> Potential:
    """The potential energy, with a table of the law's part between two displacements."""
    from .accumulating import Potential, forces

    kappa, constant = oscillator.stiffness / oscillator.mass, oscillator.load / oscillator.mass
    value, slope, width = np.zeros(2), np.zeros(2), 0.0
    if oscillator.law is not None:
        # Zero, from where the energy counts, is a node.
        low, high = min(low, 0.0), max(high, 0.0)
        width = (high - low) / (NODES - 3)
        low = math.floor(low / width) * width
        x = low + width * np.arange(2 * NODES - 1) / 2
        force = np.empty_like(x)
        forces(law, x, force)
        force /= oscillator.mass
        parts = width / 6 * (force[:-2:2] + 4 * force[1:-1:2] + force[2::2])
        value = -np.concatenate([[0.0], np.cumsum(parts)])
        value -= value[round(-low / width)]
        slope = -np.ascontiguousarray(force[::2])
    return Potential(kappa, constant, low, width, value, slope, oscillator.mass)


def transition(p: Problem) -> Transition:
    """The exact transition over a step and its halves.

    The covariance over a time h is the integral of sigma^2 g g' with g the answer to a kick, which
    has one sign for each entry over a short step: by quadrature it keeps all digits.
    """
    from ._gaussian import CERTAIN, LEVELS, Transition

    length = p.step / 2.0 ** np.arange(LEVELS + 1)
    node, weight = np.polynomial.legendre.leggauss(24)
    flow, drift, covariance = [], [], []
    for h in length:
        flow.append(_flow(p.kappa, p.damping, h))
        at, share = h * (node + 1) / 2, h * weight / 2
        kick = np.array([_flow(p.kappa, p.damping, s)[:, 1] for s in at])
        drift.append(p.constant * share @ kick)
        covariance.append(p.sigma**2 * np.einsum("i,ij,ik->jk", share, kick, kick))
    pull, spread = [], []
    for level in range(LEVELS):
        half, whole = covariance[level + 1], covariance[level]
        joint = half @ flow[level + 1].T
        if p.sigma == 0:
            pull.append(np.zeros((2, 2)))
            spread.append(np.zeros((2, 2)))
            continue
        scale = np.diag([1 / length[level], 1.0])
        pull.append(joint @ scale @ np.linalg.inv(scale @ whole @ scale) @ scale)
        spread.append(_root(half - pull[-1] @ joint.T))
    waves = p.waves.copy()
    if len(waves):
        answer = p.waves[:, 1] / (p.kappa - p.waves[:, 0] ** 2 + 1j * p.damping * p.waves[:, 0])
        waves[:, 1], waves[:, 2] = np.abs(answer), p.waves[:, 2] + np.angle(answer)
    # How far a path may stray from the cubic through its ends: the bridge, and the fourth
    # derivative of the mean motion.
    rate = max(math.sqrt(p.kappa), p.damping)
    forced = float(np.sum(np.abs(waves[:, 1]) * (waves[:, 0] ** 4 + rate**4)))
    forced += abs(p.constant) * rate**2
    off = length**4 / 384
    return Transition(
        length=length,
        flow=np.array(flow),
        drift=np.array(drift),
        root=_root(covariance[0]),
        pull=np.array(pull),
        spread=np.array(spread),
        stray=CERTAIN * p.sigma * length**1.5 / math.sqrt(192) + off * forced,
        bend=np.stack([off * rate**4, off * rate**3], axis=1),
        waves=waves,
    )


def _flow(kappa: float, damping: float, t: float) -> np.ndarray:
    """Propagator of position and velocity over a time t."""
    d = damping / 2
    w = cmath.sqrt(kappa - d * d)
    decay = math.exp(-d * t)
    cosine = cmath.cos(w * t).real
    sine = (cmath.sin(w * t) / w).real if abs(w * t) > 1e-8 else t  # over w
    return decay * np.array([[cosine + d * sine, sine], [-kappa * sine, cosine - d * sine]])


def _root(covariance: np.ndarray) -> np.ndarray:
    """Lower Cholesky factor, of variances that may be 0."""
    (a, b), (_, c) = covariance
    one = math.sqrt(max(a, 0.0))
    below = b / one if one else 0.0
    return np.array([[one, 0.0], [below, math.sqrt(max(c - below**2, 0.0))]])


def contact_rate(stop: Stop, mass: float, speed: float) -> float:
    """Root of the stiffness per mass at the depth that an approach velocity reaches."""
    _, stiffness, _, n, _ = stop.law.row()
    depth = ((n + 1) * mass * speed**2 / (2 * stiffness)) ** (1 / (n + 1))
    return math.sqrt(n * stiffness * depth ** (n - 1) / mass)
