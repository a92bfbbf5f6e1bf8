"""What the engines share: names of state and events, contact laws, units, parameter tables."""
