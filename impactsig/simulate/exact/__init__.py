"""The exact engine: oscillators that are linear between events, followed from one to the next."""
