"""Control of chaos: feedback that makes a chaotic motion follow one of its unstable orbits."""
