"""The dynamics behind a series of intervals: embedding, dimension, exponents, surrogates."""
