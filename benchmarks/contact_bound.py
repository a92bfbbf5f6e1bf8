"""The Cramer-Rao bound of a contact time that equal half-sine pulses share, in white noise.

    python -m benchmarks.contact_bound

Each pulse has its own height and instant; skew, flat top, power and length of the edges are those
of all (the family of `impactsig/detect/pulses/_model.py`). Prints the bound in per cent of the
contact time, for a known shape, one of unknown power, and one of the whole family.
"""

from __future__ import annotations

import numpy as np

SAMPLES = 15.0  # a contact: 300 us at 50 kHz
FLAT = 0.05  # of the edges: at none the family has a corner
INSTANTS = 16  # of the touch between two samples, averaged over
KNOWN, POWER, FAMILY = (3,), (2, 3), (0, 1, 2, 3)
RUNS = (
    (22, 5.7),
    (10, 7.5),
    (22, 10.0),
    (65, 3.6),
    (214, 5.7),
    (103, 7.5),
    (234, 10.0),
    (258, 13.5),
)


def pulse(p: np.ndarray, t: np.ndarray) -> np.ndarray:
    """A pulse of height, instant, skew, flat top, log power and log length."""
    height, start, skew, flat, power, length = p
    edge = np.exp(length)
    rise, fall = edge * np.exp(skew / 2), edge * np.exp(-skew / 2)
    since = t - start
    angle = np.minimum(since / rise, (rise + edge * flat + fall - since) / fall)
    return height * np.sin(np.pi / 2 * np.clip(angle, 0, 1)) ** np.exp(power)


def bound(count: int, snr: float, unknown: tuple[int, ...]) -> float:
    """Least relative standard error of the contact time of so many pulses."""
    t = np.arange(-5.0, SAMPLES + 10.0)
    shared = np.zeros((4, 4))
    for start in np.linspace(0, 1, INSTANTS, endpoint=False):
        p = np.array([snr, start, 0.0, FLAT, 0.0, np.log(SAMPLES / (2 + FLAT))])
        steps = 1e-4 * np.eye(6)
        slope = np.array([(pulse(p + h, t) - pulse(p - h, t)) / 2e-4 for h in steps])
        known = slope @ slope.T
        own, both = known[:2, :2], known[:2, 2:]
        shared += count / INSTANTS * (known[2:, 2:] - both.T @ np.linalg.solve(own, both))
    chosen = list(unknown)
    along = np.array([0.0, 1 / (2 + FLAT), 0.0, 1.0])[chosen]
    return float(np.sqrt(along @ np.linalg.solve(shared[np.ix_(chosen, chosen)], along)))


def main() -> None:
    print("impacts  peak/noise  known shape  power unknown  family unknown [%]")
    for count, snr in RUNS:
        found = [100 * bound(count, snr, unknown) for unknown in (KNOWN, POWER, FAMILY)]
        print(f"{count:7d}  {snr:10.1f}  {found[0]:11.2f}  {found[1]:13.2f}  {found[2]:14.2f}")


if __name__ == "__main__":
    main()
