"""Periodic orbits, and how they are followed through a parameter."""
