"""The search for the parameters of one train, from a guess to an estimate."""
