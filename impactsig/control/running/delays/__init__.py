"""Kernels of delayed feedback: the delay line, the control force, and steps between events."""
