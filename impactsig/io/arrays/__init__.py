"""Arrays in files: NumPy, MATLAB 4 and 5, Arrow."""
