"""Reconstruction of dynamics from intervals: embedding, dimension, exponents, surrogates."""
