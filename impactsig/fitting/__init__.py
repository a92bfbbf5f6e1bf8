"""From experiment to model: the oscillator that a measured train of impacts comes from."""

from .fit import fit_oscillator
from .result import OscillatorFit

__all__ = ["OscillatorFit", "fit_oscillator"]
