"""Figures of what intervals show: embedding, dimension, recurrence, surrogates."""
