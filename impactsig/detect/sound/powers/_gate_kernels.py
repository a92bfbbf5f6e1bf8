"""Kernels that find and fill digital silence."""

from __future__ import annotations

import numpy as np

from ...._compiling.compiled import njit
from .._core_kernels import extremes
from .._kernels import EDGE, octave_powers

CLOSED = 8  # frames without power, in a row, that are silence
SMOOTH = 0.5  # of a step, that the next sample differs by at most: else it is a click
SHORTEST = 4  # samples of a silence that is bridged
BESIDE, STEPS = 4, 3.0  # samples beside a short silence, and steps of the converter they are off
LEAST_HEARD = 0.1  # share of a window that its power can be read from
MOST = 64  # frames of which powers are renewed together
SIDE_BY_SIDE = 64  # samples that are checked in vector lanes
_NONE, _ONE, _LANES = np.uint64(0), np.uint64(1), np.uint64(SIDE_BY_SIDE)
_TWO, _THREE, _FOUR = np.uint64(2), np.uint64(3), np.uint64(4)


@njit(nogil=True)
def silent_frames(power, first, last, out):
    """Mask of frames in runs of CLOSED or more without power. Returns whether there are any."""
    out[:] = False
    row, within = power[0, first:last], out[first:last]
    for j in range(len(row)):
        within[j] = row[j] == 0.0
    for b in range(1, power.shape[0]):
        row = power[b, first:last]
        for j in range(len(row)):
            within[j] &= row[j] == 0.0
    any_closed, run = False, 0
    for j in range(len(within) + 1):
        if j < len(within) and within[j]:
            run += 1
            continue
        if run >= CLOSED:
            any_closed = True
        else:
            for i in range(j - run, j):
                within[i] = False
        run = 0
    return any_closed


@njit(nogil=True)
def silent_samples(x, silent, hop, out, runs):
    """Mask of samples in silent frames, or equal to all that follow until one.

    Frames in which the samples change, as in a straight line, are silent no more. Returns the
    number of runs of such samples; each is from runs[k, 0] to before runs[k, 1].
    """
    out[:] = False
    count = j = 0
    while j < len(silent):
        if not silent[j]:
            j += 1
            continue
        first, begin = j, j * hop
        while j < len(silent) and silent[j]:
            j += 1
        end, changes = j * hop, 0
        for i in range(np.uint64(begin + 1), np.uint64(end)):  # in vector lanes
            changes += x[i] != x[begin]
        if changes:
            silent[first:j] = False
            continue
        while begin > 0 and x[begin - 1] == x[begin]:
            begin -= 1
        while end < len(x) and x[end] == x[end - 1]:
            end += 1
        out[begin:end] = True
        if count == 0 or runs[count - 1, 1] < begin:
            runs[count, 0] = begin
            count += 1
        runs[count - 1, 1] = end
    return count


@njit(nogil=True)
def soften(x, runs, length, hop, changed):
    """Add linear ramps of at most `length` samples at both ends of silent `runs` of samples.

    There is none beside a click: it is no part of a wave that was cut off. The frames that ramps
    touch are `changed`.
    """
    for begin, end in runs:
        base, ramp = x[begin], min(length, (end - begin) // 2)
        if ramp and begin > 1:
            step = x[begin - 1] - base
            if abs(x[begin - 2] - x[begin - 1]) <= SMOOTH * abs(step):
                for k in range(ramp):
                    x[begin + k] = base + step * (ramp - k) / (ramp + 1.0)
                changed[begin // hop : (begin + ramp - 1) // hop + 1] = True
        if ramp and end < len(x) - 1:
            step = x[end] - base
            if abs(x[end + 1] - x[end]) <= SMOOTH * abs(step):
                for k in range(ramp):
                    x[end - 1 - k] = base + step * (ramp - k) / (ramp + 1.0)
                changed[(end - ramp) // hop : (end - 1) // hop + 1] = True


@njit(nogil=True)
def bridge(x, hop, step, least, greatest, out, changed):
    """Copy x to `out`, with straight lines across short silences that cut a wave off.

    These are from SHORTEST to before CLOSED + 2 frames of equal samples. On both sides some of the
    next BESIDE samples are more than STEPS times `step` off, and neither begins with a click or an
    impact: where the first is as far off, the second is not as far from it. What equals the least
    or the greatest sample is clipped, no silence; `least` and `greatest` are those of a part of x.
    Returns their number; if there are any, `out` is filled and the frames of these are `changed`.
    """
    count, off, longest, known = 0, STEPS * step, (CLOSED + 2) * hop, False
    begins = np.empty(SIDE_BY_SIDE, np.bool_)
    for first in range(BESIDE, len(x) - BESIDE, SIDE_BY_SIDE):
        size = min(SIDE_BY_SIDE, len(x) - BESIDE - first)
        if not put_beginnings(x, first, off, begins[:size]):
            continue
        for begin in range(first, first + size):
            if not begins[begin - first]:
                continue
            end = begin + SHORTEST
            while end < len(x) and end - begin < longest and x[end] == x[begin]:
                end += 1
            if end - begin == longest or len(x) - end < BESIDE:
                continue
            base, last, after = x[begin], x[end], 0.0
            for k in range(BESIDE):
                after = max(after, abs(x[end + k] - base))
            if after <= off:
                continue
            jump = abs(x[begin - 1] - base)
            if jump > off and abs(x[begin - 2] - x[begin - 1]) > SMOOTH * jump:
                continue
            jump = abs(last - base)
            if jump > off and abs(x[end + 1] - last) > SMOOTH * jump:
                continue
            if not (known or least < base < greatest):
                least, greatest, _ = extremes(x)
                known = True
            if base in (least, greatest):
                continue
            if count == 0:
                out[:] = x
            for k in range(begin, end):
                share = (k - begin + 1.0) / (end - begin + 1.0)
                out[k] = (1.0 - share) * x[begin - 1] + share * last
            changed[begin // hop : (end - 1) // hop + 1] = True
            count += 1
    return count


@njit(nogil=True)
def put_beginnings(x, first, off, out):
    """Where SHORTEST or more equal samples begin from x[first] on, after some that are `off` off.

    Returns whether any do. In vector lanes: quiet sound has many equal samples in a row.
    """
    any_begins, begin = False, np.uint64(first)
    for i in range(np.uint64(len(out))):
        k = begin + i
        base, before = x[k], x[k - _ONE]
        equal = (x[k + _ONE] == base) & (x[k + _TWO] == base) & (x[k + _THREE] == base)
        far = (abs(before - base) > off) | (abs(x[k - _TWO] - base) > off)
        far |= (abs(x[k - _THREE] - base) > off) | (abs(x[k - _FOUR] - base) > off)
        out[i] = equal & far & (before != base)
        any_begins |= out[i]
    return any_begins


@njit(nogil=True)
def renew_powers(x, hop, wanted, power, rest):
    """Powers of the octaves, and what is left below them, in the frames of x that are `wanted`.

    As `octave_powers` of all of x gives them.
    """
    octaves, frames = power.shape
    longest = MOST + 2 * EDGE
    even, odd, high = np.empty((3, longest * hop // 2))
    room, begin = np.empty(octaves * longest), 0
    while begin < frames:
        if not wanted[begin]:
            begin += 1
            continue
        end = j = begin + 1
        while j < min(begin + MOST, frames) and j <= end + 2 * EDGE:
            j += 1
            if wanted[j - 1]:
                end = j
        first, last = max(begin - EDGE, 0), min(end + EDGE, frames)
        count = last - first
        half = count * hop // 2
        part = room[: octaves * count].reshape(octaves, count)
        own = x[first * hop : last * hop]
        octave_powers(own, octaves, even[:half], odd[:half], high[:half], part)
        left = even if octaves % 2 else odd
        for j in range(begin, end):
            rest[j] = left[j - first]
            for b in range(octaves):
                power[b, j] = part[b, j - first]
        begin = end


@njit(nogil=True)
def hold(power, silent, past, held):
    """Fill silent frames with the mean power of the `past` frames before.

    `held` is that of a silence that began before the first `past` frames.
    """
    for j in range(power.shape[1]):
        if not silent[j]:
            continue
        if j > past and not silent[j - 1]:
            for b in range(power.shape[0]):
                held[b] = power[b, j - 1 - past : j - 1].mean()
        for b in range(power.shape[0]):
            power[b, j] = held[b]


@njit(nogil=True)
def heard_shares(silent, first, hop, window, out):
    """Share of each squared window, centred on sample first + g hop, that is not silent."""
    size = np.uint64(len(window))
    whole = size // _LANES * _LANES
    squares, sums = np.empty(size), np.zeros(SIDE_BY_SIDE)
    for k in range(size):
        squares[k] = window[k] * window[k]
    for at in range(_NONE, whole, _LANES):
        for k in range(_NONE, _LANES):
            sums[k] += squares[at + k]
    total = sums.sum()  # in the order of audible values, which are never more
    for k in range(whole, size):
        total += squares[k]
    for g in range(len(out)):
        begin = np.uint64(first + g * hop - len(window) // 2)
        counted = 0
        for k in range(size):  # in vector lanes, as what follows
            counted += silent[begin + k]
        if counted == 0 or counted == len(window):
            out[g] = 1.0 if counted == 0 else 0.0
            continue
        sums[:] = 0.0
        for at in range(_NONE, whole, _LANES):
            for k in range(_NONE, _LANES):
                sums[k] += 0.0 if silent[begin + at + k] else squares[at + k]
        heard = sums.sum()
        for k in range(whole, size):
            heard += 0.0 if silent[begin + k] else squares[k]
        out[g] = heard / total


@njit(nogil=True)
def hold_bands(power, share, closes, held):
    """Complete the powers of partly silent windows with the last audible powers.

    That is the power over the share where the gate closes.
    """
    for b in range(power.shape[0]):
        for g in range(power.shape[1]):
            rest = 1.0 - share[g]
            if rest == 0.0:
                continue
            if closes[g] and share[g] >= LEAST_HEARD:
                held[b] = power[b, g] / share[g]
            power[b, g] += rest * held[b]


@njit(nogil=True)
def put_edge_steps(parts, audible, flank, out):
    """Mean over the octaves of ln(p_i / p_k), p_i beside an edge and p_k `flank` parts from it.

    out[0] are those where parts begin to be `audible`, out[1] where they cease to. All parts from i
    to k are audible, and p is nowhere 0 in both. Returns the numbers of both.
    """
    counts, begin = np.zeros(2, np.int64), 0
    while begin < len(audible):
        if not audible[begin]:
            begin += 1
            continue
        end = begin
        while end < len(audible) and audible[end]:
            end += 1
        if end - begin > flank:
            for side, edge, inner, real in (
                (0, begin, begin + flank, begin > 0),
                (1, end - 1, end - 1 - flank, end < len(audible)),
            ):
                total = 0.0
                for b in range(parts.shape[0]):
                    if parts[b, edge] <= 0.0 or parts[b, inner] <= 0.0:
                        real = False
                        break
                    total += np.log(parts[b, edge] / parts[b, inner])
                if real:
                    out[side, counts[side]] = total / parts.shape[0]
                    counts[side] += 1
        begin = end
    return counts[0], counts[1]
