"""What the instrument adds to a force record: codes, dropouts, hum, a coupling."""
