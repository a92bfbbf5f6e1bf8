"""Largest Lyapunov exponent of a series: how fast neighbours part."""
