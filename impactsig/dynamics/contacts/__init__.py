"""Equivalence of hard and soft contacts."""
