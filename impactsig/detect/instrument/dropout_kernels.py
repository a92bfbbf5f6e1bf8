"""Kernels that find and fill dropouts: stretches in which a value is held.

A converter that loses its signal, a gate, or a transmitter that repeats what it sent last gives the
same value again and again. Where other samples are noisy, so many equal ones in a row are no
signal; nor are zeros that a record which stands elsewhere falls to and comes back from at once. A
peak at the limit of the instrument is none: it is reached gradually, as is silence. Dropouts are
filled with straight lines, so that neither their values nor their silence count.
"""

from __future__ import annotations

import math

import numpy as np

from ..._compiling.compiled import allocating, kernel
from ..._trains.impact_flags import OPEN_END, OPEN_START
from ..pulses.edges import ERRORS
from ..signal.order_kernels import median_of

LEAST = 16
"""Equal samples in a row that may be a dropout."""
BORDER = 64
"""Samples of the spans beside that are looked at, for what lies across the border."""
MOST = 1 << 14
"""Of them in a span."""
RARE = math.log(1e-12)
"""Logarithm of the chance that as many samples in a row are equal, one pair like another."""
EXPECTED = 1.0
"""Stretches of LEAST equal samples that chance makes of so many, from which on it makes some."""
LIVE, TURNS = 12, 0.2
"""Samples in a row that show whether the record is noisy; share of them at which noise turns."""
FAR = 6.0
"""Times the noise: what a held value is off where it may be the limit of the instrument."""
FALLEN = 2.5
"""Codes that zeros are off where a record has fallen to them: by two a slow drift goes as well."""
SETTLING, SETTLED = 4, 0.1
"""Samples before a held value that lie near it where the signal has settled; times the noise."""
FEWEST, ENOUGH = 32, 1024
"""Samples to either side whose median a filled stretch begins and ends with: as many as it has
itself, within these limits."""


@allocating
def find_dropouts(x, zero, held, out):
    """Bounds of the dropouts in x.

    Parameters
    ----------
    zero : float
        What a sample of 0 is here.
    held : float
        Value of a dropout that x begins in, or NaN.
    out : array (n, 2) of int, filled

    Returns
    -------
    int
        How many there are.
    """
    count = _equal_runs(x, out)
    if count == 0:
        return 0
    noise, share, step = _live(x, out[:count])
    longer = LEAST if share <= 0.0 else (np.inf if share >= 1.0 else RARE / math.log(share))
    # Some codes of a converter that is coarser than the noise are held for longer than others.
    coarse = 0.0 < share < 1.0 and share**LEAST * (1.0 - share) * len(x) > EXPECTED
    stride = max(1, len(x) // 1024)
    some = np.empty((len(x) + stride - 1) // stride)
    for k in range(len(some)):
        some[k] = x[k * stride]
    middle = median_of(some, len(some))
    lowest, highest = np.inf, -np.inf
    for i in range(len(x)):
        lowest, highest = min(lowest, x[i]), max(highest, x[i])
    silent = _silent(x, out[:count], noise)
    kept = 0
    for k in range(count):
        a, b = out[k, 0], out[k, 1]
        value = x[a]
        before = x[a - 1] if a > 0 else np.nan
        after = x[b] if b < len(x) else np.nan
        off = value - middle
        # A peak at a limit is reached and left by way of values in between.
        between = False
        for beside in (before, after):
            between |= 0.25 * abs(off) < abs(beside - middle) < 0.75 * abs(off)
        limit = between or (value in (lowest, highest) and value != zero)
        if value == silent:
            dead = False
        elif a == 0 and value == held:
            dead = True
        elif noise > 0.0 and b - a >= longer and (not coarse or b - a >= _usual_here(x, a, b)):
            dead = abs(off) < FAR * noise or not limit
        else:
            fallen = abs(off) > FALLEN * step and value == zero and share < 1.0
            for beside in (before, after):
                fallen &= not (value - beside) * off < 0.5 * off * off
            dead = fallen
        if dead:
            out[kept, 0], out[kept, 1] = a, b
            kept += 1
    return kept


@kernel
def _silent(x, runs, noise):
    """Value to which a noise-free sensor settles after ringing; NaN if none.

    What drops out leaves noise behind it, which does not stay near one value.
    """
    for k in range(len(runs)):
        a = runs[k, 0]
        if a >= SETTLING:
            away = 0.0
            for i in range(a - SETTLING, a):
                away = max(away, abs(x[i] - x[a]))
            if away < SETTLED * noise:
                return x[a]
    return np.nan


@kernel
def _usual_here(x, a, b):
    """Number of equal samples beside x[a:b] that chance explains; see RARE."""
    first, last = max(0, a - (b - a)), min(len(x), 2 * b - a)
    pairs = equal = 0
    for i in range(first + 1, last):
        if i < a or i > b:
            pairs += 1
            equal += x[i] == x[i - 1]
    if equal == 0:
        return 0.0
    return RARE / math.log(equal / pairs) if equal < pairs else np.inf


@kernel
def may_repeat(x):
    """Quick test of whether x may hold LEAST equal values in a row."""
    step = LEAST // 2
    equal = 0
    for i in range(step - 1, len(x), step):
        equal += x[i] == x[i - step + 1]
    return equal > 0


@kernel
def _equal_runs(x, out):
    """Find stretches of at least LEAST equal values; returns their number."""
    n, half, count, i = len(x), LEAST // 2, 0, 0
    while i + half <= n and count < len(out):
        if x[i] != x[i + half - 1]:
            i += half
            continue
        a, b = i, i + 1
        while b < n and x[b] == x[i]:
            b += 1
        while a > 0 and x[a - 1] == x[i]:
            a -= 1
        if b - a >= LEAST:
            out[count, 0], out[count, 1] = a, b
            count += 1
        i = max(i + half, b // half * half)
    return count


@kernel
def _live(x, runs):
    """Noise outside of the runs, 0 if not noisy, and the share of repeated samples.

    The noise is that of the differences, and the share is 1 where nothing else is left. Then the
    least difference that there is, which is a code's where these are coarse.
    """
    pairs = equal = places = turns = 0
    least = np.inf
    total = 0.0
    for k in range(len(runs) + 1):
        a = 0 if k == 0 else runs[k - 1, 1]
        b = len(x) if k == len(runs) else runs[k, 0]
        for i in range(a + 1, b):
            pairs += 1
            equal += x[i] == x[i - 1]
            off = abs(x[i] - x[i - 1])
            total += off
            least = off if 0.0 < off < least else least
        if b - a >= LIVE:
            for i in range(a + 1, b - 1):
                places += 1
                turns += (x[i] - x[i - 1]) * (x[i + 1] - x[i]) < 0.0
    if pairs == 0:
        return 0.0, 1.0, 0.0
    noisy = places > 0 and turns >= TURNS * places
    return total / pairs if noisy else 0.0, equal / pairs, least if least < np.inf else 0.0


@allocating
def fill(x, runs, before):
    """Replace the runs of x by straight lines; returns the last valid level.

    `before` is the level that x begins with, should it begin with a run; NaN where none is known.
    """
    values = np.empty(ENOUGH)
    level, end, enough = before, 0, FEWEST
    for k in range(len(runs) + 1):
        a = len(x) if k == len(runs) else runs[k, 0]
        if a > end:
            first = _level(x, end, min(end + enough, a), values)
            if k > 0:
                _line(x, runs[k - 1], first if np.isnan(level) else level, first)
        elif k > 0 and not np.isnan(level):
            _line(x, runs[k - 1], level, level)
        if k < len(runs):
            enough = min(max(runs[k, 1] - a, FEWEST), ENOUGH)
        if a > end:
            level = _level(x, max(end, a - enough), a, values)
        end = a if k == len(runs) else runs[k, 1]
    return level


@kernel
def _level(x, a, b, values):
    """Median of x over [a, b)."""
    for i in range(a, b):
        values[i - a] = x[i]
    return median_of(values, b - a)


@kernel
def _line(x, run, first, last):
    a, b = run
    for i in range(a, b):
        x[i] = first + (i - a + 1) * (last - first) / (b - a + 1)


@kernel
def cut_off(rows, runs):
    """Flag pulses that a dropout cuts off as open, with infinite errors.

    Parameters
    ----------
    rows : array (n, m)
        Measured pulses in the order of time.
    runs : array (d, 2)
        Dropouts in the same samples, in order.
    """
    d = 0
    for k in range(len(rows)):
        start, contact = rows[k, 0], rows[k, 1]
        while d < len(runs) and runs[d, 1] < start - 1.0:
            d += 1
        i = d
        while i < len(runs) and runs[i, 0] <= start + contact + 1.0:
            if runs[i, 0] <= start + 0.5 * contact:
                rows[k, 5] = int(rows[k, 5]) | OPEN_START
                rows[k, ERRORS] = np.inf
            if runs[i, 1] >= start + 0.5 * contact:
                rows[k, 5] = int(rows[k, 5]) | OPEN_END
            rows[k, ERRORS + 1] = rows[k, ERRORS + 3] = np.inf
            i += 1
