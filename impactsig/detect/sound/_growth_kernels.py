"""Kernel for `_growth.py`: mean power of sounds about their attacks."""

from __future__ import annotations

from ._lane_kernels import fused, sum_of_squares


@fused
def add_powers(sounds, likely, first, lead, faintest, total):
    """Add the powers of the likely sounds to `total`, each over its energy; returns how many count.

    `total` begins at sample `first` of a sound, whose energy is that `lead` samples later and on.
    Sounds of less than the `faintest` energy do not count.
    """
    count, size = 0, min(len(total), sounds.shape[1] - first)
    for k in range(len(sounds)):
        near = sounds[k, first : first + size]
        energy = sum_of_squares(near[lead:])
        if likely[k] and energy > faintest:
            count += 1
            weight = 1.0 / energy
            for i in range(size):
                total[i] += weight * near[i] * near[i]
    return count
