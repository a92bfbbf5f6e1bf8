"""Largest Lyapunov exponent of a series, from the divergence of neighbours."""
