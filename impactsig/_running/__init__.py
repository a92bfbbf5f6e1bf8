"""While work runs: threads for kernels, and progress bars."""
