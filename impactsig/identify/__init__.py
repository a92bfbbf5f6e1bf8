"""Natural frequency, damping and friction of a machine, from a recording."""
