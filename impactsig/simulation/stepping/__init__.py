"""The stepping engine: Runge-Kutta steps that end on events, for Hertz contacts and any law."""
