"""Small numerical methods that several rooms use: pairs, lines, smoothing, spread."""
