"""Files: written whole or not at all, standard input, locks, a directory of one's own."""
