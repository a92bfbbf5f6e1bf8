"""One force pulse or two that touch: start, end, peak and impulse, with their errors."""
