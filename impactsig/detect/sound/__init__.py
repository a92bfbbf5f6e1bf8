"""Detection in sound records: bands, background, gates, rooms, decision."""
