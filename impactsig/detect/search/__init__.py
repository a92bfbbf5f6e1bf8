"""Where a force record has impacts: responses of many widths, noise, which crests are impacts."""
