"""The exact engine, for oscillators that are linear between events."""
