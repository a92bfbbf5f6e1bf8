"""Simulation under control: control force, delay lines, parameter changes at impacts."""
