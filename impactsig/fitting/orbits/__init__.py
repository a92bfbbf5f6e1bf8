"""Orbits fitted to measured instants, and paths through them."""
