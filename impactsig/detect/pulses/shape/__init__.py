"""The shape that the pulses of one machine share, beyond the fitted family too."""
