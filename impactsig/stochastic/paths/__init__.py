"""Paths of stochastic differential equations: steps, random numbers, stops."""
