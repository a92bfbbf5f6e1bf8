"""Recording -> what the machine itself is: its natural frequency and its damping."""

from .resonance import Estimate, Resonance, identify_resonance

__all__ = ["Estimate", "Resonance", "identify_resonance"]
