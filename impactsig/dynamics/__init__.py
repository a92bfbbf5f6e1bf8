"""What an oscillator does in the long run: exponents, sections, orbits, diagrams, equivalence."""
