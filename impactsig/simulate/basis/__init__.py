"""What engines share: state and events by name, laws of contact, units, columns of machines."""
