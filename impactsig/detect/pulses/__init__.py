"""Measurement of single and overlapping force pulses, with errors."""
