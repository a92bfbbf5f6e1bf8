"""Poincare sections of a motion: at a displacement, and at impacts."""
