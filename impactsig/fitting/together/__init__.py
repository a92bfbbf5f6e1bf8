"""One oscillator from many trains, each with a different forcing."""
