"""Search of a force record: matched responses of many widths, noise, and decisions."""
