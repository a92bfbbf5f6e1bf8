"""Oscillators under random forces: ensembles, densities, averaging."""
