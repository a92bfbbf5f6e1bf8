"""Tangent maps and exponents of many oscillators at once."""
