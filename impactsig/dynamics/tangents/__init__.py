"""Tangent maps and Lyapunov exponents of every system."""
