"""Motions under control: the force, delays, kicks at impacts."""
