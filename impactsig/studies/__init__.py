"""Parameter studies of any size: cells in tiles, on any executor, into a store that resumes."""
