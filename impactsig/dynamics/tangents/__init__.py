"""How neighbours part: tangent maps and Lyapunov exponents of every system."""
