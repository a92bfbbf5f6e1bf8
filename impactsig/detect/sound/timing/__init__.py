"""When a heard impact began: the edge, waveforms that are alike, modes that impacts share."""
