"""The phase of a train of impacts followed over time: rate, slots, drift, satellites."""
