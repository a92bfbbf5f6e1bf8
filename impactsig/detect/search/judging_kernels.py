"""Kernels for decisions: levels, widths, and consistency of measured pulses."""

from __future__ import annotations

import numpy as np

from ..._compiling.compiled import allocating, kernel
from ..._numerics.spread import DEVIATION_BY_MEDIAN
from ..._trains.impact_flags import OPEN_END, OPEN_START, UNRESOLVED
from ..pulses.edges import NO_PULSE
from ..signal.ladder import MATCH
from ..signal.order_kernels import quantile
from ..signal.probability import ABOUT, excursions
from ._false_alarms import LEAST_SIGMA, discovery_level

UNLIKE = float(np.log(ABOUT))
"""Difference of the logarithms of widths that noise does not explain."""
SEVERAL = 5
"""Events that tell what width is usual."""
RINGING, NARROWER, WEAKER = 30.0, 0.6, 0.2
"""Widths after an impact in which its sensor may ring; how narrow and weak that is beside it."""
TOO_LONG = 1.2
"""Times the longest contact: a pulse that is measured as longer is none."""
WIDER, MUCH_WIDER, NARROW, STANDS = 10.0, 40.0, 0.5, 7.0
"""Times its response's width that a pulse may be without more ado; at most, and less than which,
where it is as high as so many times the noise of responses at its own width."""
FLOOR, ALONE = 0.005, 0.0005
"""Of the height of the strong ones around: least one of an impact, and of one that stands alone."""
CLEAR, STRONGER, DIED_AWAY = 2.0, 3.0, 60.0
"""Times the level of certainty that such a one reaches; it follows none so many times as high
within so many widths."""
LOBES = 32
"""Samples to either side of a very short pulse where its filter rings."""


@kernel
def alike(width, usual):
    """Whether a width is about the usual one, within its uncertainty."""
    return abs(np.log(width / usual)) < UNLIKE


@allocating
def levels(near, samples, seconds):
    """Usual height of the events of some seconds, and the height of certain ones.

    Returns
    -------
    (width, height of the strong ones, level of the usual width, level of other widths)
    """
    widths, heights = np.empty(len(near)), np.empty(len(near))
    clear = 0
    for least in (2 * LEAST_SIGMA, -np.inf):
        for k in range(len(near)):
            if near[k, 3] >= least:
                widths[clear], heights[clear] = near[k, 1], near[k, 2]
                clear += 1
        if clear:
            break
    usual = quantile(widths[:clear], 0.5) if clear else 1.0
    height = quantile(heights[:clear], 0.97)
    like, unlike = widths, heights  # of the responses, from now on
    count = 0
    for k in range(len(near)):
        if clear >= SEVERAL and alike(near[k, 1], usual):
            like[count] = near[k, 3]
            count += 1
        else:
            unlike[k - count] = near[k, 3]
    level_else = discovery_level(unlike[: len(near) - count], 2.0 * samples, seconds)
    level = level_else
    if count:
        level = min(level, discovery_level(like[:count], 4.0 * samples / usual, seconds))
    return usual, height, level, level_else


@kernel
def certainty(events, usual, usual_level, level_else, out):
    """Probability of events, which is 1/2 at the level of their width.

    As if the noise made as many of them there as impacts do; that of others follows from how many
    more or fewer of these it makes at their height.
    """
    at_usual, at_else = excursions(usual_level), excursions(level_else)
    for k in range(len(events)):
        at_level = max(at_usual if alike(events[k, 1], usual) else at_else, 1e-300)
        at_height = excursions(max(events[k, 3], 1.5))
        out[k] = at_level / (at_level + at_height)


@kernel
def apart(crests, events, reach, out):
    """Mark the crests farther than `reach` widths from any event.

    Parameters
    ----------
    crests, events : arrays (n, CREST), (m, EVENT)
        The events in the order of time, but for what two seconds share at their border.
    """
    widest, first = 0.0, 0
    for k in range(len(events)):
        widest = max(widest, events[k, 1])
    for k in range(len(crests)):
        while first < len(events) and events[first, 0] < crests[k, 0] - reach * widest - 2.0:
            first += 1
        out[k] = True
        i = first
        while i < len(events) and events[i, 0] <= crests[k, 0] + reach * widest:
            if abs(events[i, 0] - crests[k, 0]) < reach * events[i, 1]:
                out[k] = False
                break
            i += 1


@kernel
def consistent(rows, total, shortest, kept, ends):
    """Mark pulses whose length and height agree with their responses, and those at an end.

    A neighbour in the flanks makes the width too narrow, seldom too wide. At an end of the
    stretch, where a response has one flank only, a pulse is under way or there is none.
    """
    for k in range(len(rows)):
        contact, peak, flags = rows[k, 1], rows[k, 2], int(rows[k, 5])
        length, height = rows[k, 7] / MATCH, rows[k, 9]
        longest = (3.0 if flags & UNRESOLVED else 10.0) * length + 4.0
        whole = 0.25 * length < contact < longest and contact >= shortest
        whole = whole and 0.4 * height < peak < 2.5 * height
        under_way = flags != NO_PULSE and (flags & (OPEN_START | OPEN_END)) > 0
        middle = rows[k, 0] + 0.5 * contact
        ends[k] = min(middle, total - middle) < 2.5 * rows[k, 7] + 3.0
        if ends[k]:
            kept[k] = under_way or (whole and flags == 0)
        else:
            kept[k] = flags != NO_PULSE and whole and not under_way


@kernel
def too_long(rows, longest, out):
    """Mark complete pulses that are longer than a contact; whether there are any."""
    count = 0
    for k in range(len(rows)):
        flags = int(rows[k, 5])
        whole = flags != NO_PULSE and not flags & (OPEN_START | OPEN_END)
        out[k] = whole and rows[k, 1] > TOO_LONG * longest
        count += out[k]
    return count > 0


@kernel
def own_width(events, rows, widths, noise, changed):
    """Set the widths of events to those measured, if they differ; whether any did.

    A neighbour in its flanks makes a pulse look narrower than it is. Far more do so noise that
    grows with the width and, the other way round, a tone that wide responses average out: there
    the pulse must stand out of the `noise` of responses at its own of the `widths`. `changed`
    marks these.
    """
    count = 0
    for k in range(len(rows)):
        contact = max(MATCH * rows[k, 1], 1.0)
        off = contact / rows[k, 7]
        changed[k] = rows[k, 5] == 0 and 1.5 < off < MUCH_WIDER and rows[k, 7] > 2.0
        if off < NARROW:  # one that stands beside is what is narrow
            left = k > 0 and events[k, 0] - events[k - 1, 0] < rows[k, 7]
            right = k + 1 < len(rows) and events[k + 1, 0] - events[k, 0] < rows[k, 7]
            changed[k] = rows[k, 5] == 0 and not left and not right
        if changed[k] and not 1.5 < off < WIDER:
            rung = 0
            while rung < len(widths) - 1 and widths[rung] < contact:
                rung += 1
            changed[k] = widths[rung] >= contact and rows[k, 2] > STANDS * noise[rung]
        if changed[k]:
            events[k, 1] = contact
            if off < NARROW:
                events[k, 0], events[k, 2] = rows[k, 0] + 0.5 * rows[k, 1], rows[k, 2]
            count += 1
    return count > 0


def with_neighbors(marked):
    """Extend a mask to the neighbours of its marked entries."""
    out = marked.copy()
    out[1:] |= marked[:-1]
    out[:-1] |= marked[1:]
    return out


@kernel
def bounds(group, first, last, total):
    """Centres of the events next to samples [first, last); -1 and `total` if none."""
    before, after = -1.0, float(total)
    for k in range(len(group)):
        centre = group[k, 0]
        if centre < first:
            before = max(before, centre)
        elif centre >= last:
            after = min(after, centre)
    return before, after


@allocating
def draw_together(events, group):
    """Average the widths of events with those around them, by their uncertainties.

    The logarithm of a width is uncertain by about 4 over the height in standard deviations of the
    noise (measured on half-sines in white noise).
    """
    if len(group) == 0:
        return
    logs = np.empty(len(group))
    for least in (2 * LEAST_SIGMA, -np.inf):  # the clear ones, or, of few, all
        count = 0
        for k in range(len(group)):
            if group[k, 3] > least:
                logs[count] = np.log(group[k, 1])
                count += 1
        if count >= 5:
            break
    middle = quantile(logs[:count], 0.5)
    for k in range(count):
        logs[k] = abs(logs[k] - middle)
    spread = max(0.05, DEVIATION_BY_MEDIAN * quantile(logs[:count], 0.5))
    for k in range(len(events)):
        own, error = np.log(events[k, 1]), 4.0 / events[k, 3]
        if abs(own - middle) < 3 * np.hypot(spread, error):
            weight = spread**2 / (spread**2 + error**2)
            events[k, 1] = np.exp(weight * own + (1 - weight) * middle)


def worst(bad, sure):
    """The bad events that are less certain than bad ones beside them."""
    out = bad.copy()
    out[1:] &= ~(bad[:-1] & (sure[1:] > sure[:-1]))
    out[:-1] &= ~(bad[1:] & (sure[:-1] > sure[1:]))
    return out


@kernel
def leave_alone(rows, kept):
    """Keep the higher of two pulses that overlap by half a contact; whether all are kept."""
    for i in range(1, len(rows)):
        if rows[i, 0] < rows[i - 1, 0] + 0.5 * rows[i - 1, 1]:
            kept[i if rows[i, 2] <= rows[i - 1, 2] else i - 1] = False
    count = 0
    for i in range(len(rows)):
        count += kept[i]
    return count == len(rows)


@kernel
def ringing(events, near, out):
    """Mark ringing events: narrower and far weaker than one just before.

    Parameters
    ----------
    events, near : arrays (n, EVENT), (m, EVENT)
        Both in the order of time, but for what two seconds share at their border.
    """
    following = 0
    widest, strongest = 0.0, 0.0
    for i in range(len(near)):
        widest, strongest = max(widest, near[i, 1]), max(strongest, near[i, 2])
    for k in range(len(events)):
        centre, width, height = events[k, 0], events[k, 1], events[k, 2]
        while following < len(near) and near[following, 0] < centre:
            following += 1
        out[k] = False
        if width > NARROWER * widest or height > WEAKER * strongest:
            continue
        for i in range(following - 1, -1, -1):
            apart = centre - near[i, 0]
            if apart > RINGING * widest:
                break
            strong = width <= NARROWER * near[i, 1] and height <= WEAKER * near[i, 2]
            if strong and 0.0 < apart < RINGING * near[i, 1]:
                out[k] = True
                break


def measured_ringing(rows, near):
    """Mark measured pulses that ring, by their contact times."""
    events, out = np.empty((len(rows), 3)), np.empty(len(rows), np.bool_)
    events[:, 0] = rows[:, 0] + 0.5 * rows[:, 1]
    events[:, 1], events[:, 2] = MATCH * rows[:, 1], rows[:, 2]
    ringing(events, near, out)
    return out


@kernel
def strong_enough(events, usual, level, height, out):
    """Mark events that are not too weak beside the strong ones around.

    Those above `FLOOR` of their height are; above `ALONE` of it those of the usual width that stand
    clear of the noise, since a sensor's ringing after a stronger one has died away.

    Parameters
    ----------
    events : array (n, EVENT)
        In the order of time, but for what two seconds share at their border.
    """
    for k in range(len(events)):
        out[k] = events[k, 2] >= FLOOR * height
        weak = ALONE * height <= events[k, 2] < FLOOR * height
        if not weak or events[k, 3] < CLEAR * level or not alike(events[k, 1], usual):
            continue
        out[k] = True
        i = k - 1
        while i >= 0 and events[k, 0] - events[i, 0] < DIED_AWAY * usual:
            out[k] &= events[i, 2] < STRONGER * events[k, 2]
            i -= 1


@kernel
def lobes(events, near, out):
    """Mark possible side lobes of a filter beside a greater event.

    Parameters
    ----------
    events, near : arrays (n, EVENT), (m, EVENT)
        Both in the order of time, but for what two seconds share at their border.
    """
    first = 0
    for k in range(len(events)):
        while first < len(near) and near[first, 0] < events[k, 0] - LOBES:
            first += 1
        out[k] = False
        i = first
        while i < len(near) and near[i, 0] < events[k, 0] + LOBES:
            apart = np.abs(near[i, 0] - events[k, 0])
            out[k] |= events[k, 2] < 0.5 * near[i, 2] / (1.0 + 0.5 * apart)
            i += 1
