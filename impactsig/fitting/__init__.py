"""From experiment to model: the oscillator that a measured train of impacts comes from."""

from .fit import fit_oscillator
from .machine import MachineFit
from .prediction import Band, Prediction
from .result import OscillatorFit

__all__ = ["Band", "MachineFit", "OscillatorFit", "Prediction", "fit_oscillator"]
