"""One oscillator from many trains, each at a forcing of its own."""
