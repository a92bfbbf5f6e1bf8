"""What instruments see of impacts: trains over thresholds, and records."""
