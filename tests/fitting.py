"""Trains to fit an oscillator to, and a problem whose solution is known in closed form."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np

from impactsig import measure, scenes, simulate

NATURAL = scenes.NATURAL_FREQUENCY


@cache
def chaos(frequency=20.1, count=800):
    impacts = simulate(scenes.karpodinis(frequency), periods=2 * count, transient=300).impacts
    impacts = impacts[:count]
    return replace(impacts, duration=float(impacts.time[-1] - impacts.start))


def measured(truth, seed, strength_noise=0.03):
    """With a jitter of 1 % of the mean interval, 2 % missed and 1 % spurious."""
    jitter = 0.01 * truth.intervals().mean()
    seen = measure(truth, jitter=jitter, missed=0.02, spurious=0.01, seed=seed).impacts
    noise = 1 + strength_noise * np.random.default_rng(seed).standard_normal(len(seen))
    return replace(seen, approach_velocity=None, impulse=3.0 * seen.approach_velocity * noise)


class Linear:
    """A problem whose moments are linear in its parameters but for a slight curvature."""

    free = ("restitution", "damping")
    names = ("restitution", "damping", "missed")
    share = 1.0

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
        self.truth = np.array([0.4, -3.0, 0.1])
        self.slopes = np.random.default_rng(0).standard_normal((12, 3)) * [20.0, 3.0, 60.0]
        self.box = np.array([0.0, -7.0, 0.0]), np.array([1.0, -0.5, 0.5])
        self.measured = self.moments(self.truth)

    def kind(self, name):
        return SimpleNamespace(finest=1e-4)

    def moments(self, psi):
        """Of trains at parameters, shape (..., 3)."""
        off = psi - self.truth
        curved = 2 * off[..., :1] * off[..., 1:2]
        return off @ self.slopes.T + curved + self.rng.standard_normal((*off.shape[:-1], 12))

    def look(self, psi):
        return self.moments(psi) - self.measured
