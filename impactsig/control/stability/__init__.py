"""Stability of controlled orbits: maps and their derivatives."""
