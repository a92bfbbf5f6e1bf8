"""Natural frequency, damping and friction of a machine, from a recording."""

from .friction import Bounded, FrictionDecay, identify_friction
from .resonance import Estimate, Resonance, identify_resonance

__all__ = [
    "Bounded",
    "Estimate",
    "FrictionDecay",
    "Resonance",
    "identify_friction",
    "identify_resonance",
]
