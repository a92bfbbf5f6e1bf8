"""Kernel for `_tails.py`: how fast the sound of crests decays."""

from __future__ import annotations

import numpy as np

from ...._compiling.compiled import kernel, njit


@njit(nogil=True)
def decays_after(place, loud, loudness, sampled, seconds, levels, after, before_next, out):
    """Decays of the crests after which sound is measured, in their order; returns how many.

    Parameters
    ----------
    place, loud : frames of crests, and the loudness after them
    loudness : that of every `sampled`-th frame, of so many seconds each
    levels : least loudness of a crest that is measured, and of audible sound
    after, before_next : of a tail, after a crest and at most until before the next [s]
    out : room for a decay [neper/s] of each crest
    """
    frames = len(loudness)
    number, index, total = np.zeros((3, frames + 1))  # of audible frames until each
    for j in range(frames):
        heard = loudness[j] > levels[1]
        number[j + 1] = number[j] + heard
        index[j + 1] = index[j] + (j if heard else 0)
        total[j + 1] = total[j] + (loudness[j] if heard else 0.0)
    begin, most, least = after[0] / seconds, after[1] / seconds, before_next / seconds
    count, k = 0, 0
    while k < len(place):
        following = k + 1
        while following < len(place) and not loud[following] > levels[0]:
            following += 1
        if loud[k] > levels[0]:
            end = place[following] if following < len(place) else frames * sampled
            first = int(np.ceil((place[k] + begin) / sampled))
            last = int(min(place[k] + most, end - least) // sampled)
            if last > first:
                heard = number[last] - number[first]
                at = (index[last] - index[first]) / heard if heard else first
                fallen = loud[k] - (total[last] - total[first]) / max(heard, 1.0)
                out[count] = fallen / (seconds * (sampled * at - place[k]))
                count += 1
        k = following
    return count


@kernel
def beyond_tails(place, loud, decay, out):
    """Excess of each crest over the tails of those before it, which lose `decay` in a frame."""
    tail = -np.inf  # the loudest, were it at the first frame
    for k in range(len(place)):
        undecayed = loud[k] + decay * place[k]
        out[k] = undecayed - tail if np.isfinite(decay) else np.inf
        tail = max(tail, undecayed)
