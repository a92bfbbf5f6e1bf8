"""From experiment to model: the oscillator that a measured train of impacts comes from."""

from .fit import OscillatorFit, fit_oscillator

__all__ = ["OscillatorFit", "fit_oscillator"]
