"""From experiment to model: the oscillator that a measured train of impacts comes from."""

from .fit import fit_oscillator
from .prediction import Band, Prediction
from .result import OscillatorFit

__all__ = ["Band", "OscillatorFit", "Prediction", "fit_oscillator"]
