"""Hard against soft contacts: which of them move alike."""
