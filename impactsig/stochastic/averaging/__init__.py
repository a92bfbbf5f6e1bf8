"""Stochastic averaging: stationary densities of oscillators with weak noise."""
