"""Orbits laid beside measured instants, and paths found through them."""
