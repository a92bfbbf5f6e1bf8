"""Integrators of stochastic paths: steps, random numbers, stops."""
