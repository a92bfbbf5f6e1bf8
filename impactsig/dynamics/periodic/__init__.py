"""Periodic orbits and their continuation in a parameter."""
