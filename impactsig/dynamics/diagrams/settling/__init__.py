"""Motions followed past their transients, one or many at once, until their orbits close."""
