"""What a measured train shows by itself: words, moments, echoes, an initial guess."""
