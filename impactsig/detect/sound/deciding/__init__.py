"""Which crests of a sound are impacts, how probable each is, and what makes them doubtful."""
