"""Recording to Impacts: noise floor, threshold with hysteresis, contact time, sound onsets."""
