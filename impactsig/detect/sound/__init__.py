"""Where a sound record has impacts: bands, background, gates, rooms, the decision."""
