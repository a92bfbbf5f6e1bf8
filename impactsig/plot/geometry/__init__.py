"""Figures of embedding, dimension, recurrence and surrogates."""
