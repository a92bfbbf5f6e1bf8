"""Compilation of kernels by numba, and the cache that knows when their code has changed."""
