"""Phase of a train of impacts over time: rate, slots, drift, satellites."""
