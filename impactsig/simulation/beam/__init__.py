"""The engine of the cantilever in its modes, and its motions."""
