"""Long-term dynamics: exponents, sections, periodic orbits, diagrams, equivalent contacts."""
