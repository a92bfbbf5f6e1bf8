"""Figures of simulated systems: motions, sections, diagrams, orbits, densities."""
