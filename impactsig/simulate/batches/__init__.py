"""Many oscillators at once."""
