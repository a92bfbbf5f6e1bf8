"""Fit of an impact oscillator to a measured train of impacts."""

from .fit import fit_oscillator
from .machine import MachineFit
from .prediction import Band, Prediction
from .result import OscillatorFit

__all__ = ["Band", "MachineFit", "OscillatorFit", "Prediction", "fit_oscillator"]
