"""The pulse shape that impacts of one machine share, and measurement of each by it.

Skew, flatness, power and length of the edges and the difference of their powers are taken as
normally distributed over the pulses of one span. Mean and spread are estimated from all of them
(`_shared_shape_kernels.py`), each pulse being linear about its fit: clear pulses show the shape,
and faint ones are measured with it. Where no member of the family follows the pulses, the clear
ones show the rest of their shape (`_common_rest.py`), and the touch (`_misfit.py`). Where none is
even near, they are laid on each other and measured by their mean (`_by_mean.py`). What noise hides
in one span may show in others: each tells the next of the spread and of the rest.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...._compiling.compiled import allocating, kernel
from ...signal.order_kernels import centre_of
from .._model import FLAT, LENGTH, POWER, POWERS, SKEW, WIDER, parts_of
from ..edges import ERRORS, FIT
from ..fit_errors import (
    EDGE,
    ESTIMATE,
    LEFT,
    LEFT_SD,
    MADE,
    NOW,
    SEEN,
    TAKEN,
)
from ._by_mean import share_mean
from ._by_shape import share
from ._common_rest import (
    LEAST,
    common_rest,
    is_clear,
    linearize_anew,
    linearize_with,
    make_room,
)
from ._mean_pulse import is_seen
from ._misfit import allow_for_unseen, correct_misfit, doubt_unlike, what_is_left
from ._shared_shape_kernels import (
    AGAIN,
    ALONE,
    APART,
    BRIEF,
    ROUNDS,
    SHAPES,
    Shape,
)
from .told import learn, with_told

ABOUT = np.array([0.0, 0.3, 0.3, 0.0, 0.0])
"""Where the mean shape is expected; its length at that of the matched responses. A half-sine has
the power 1, a raised cosine 2."""
FAMILY_ROUNDS, TURNED = 4, 0.02
"""In which pulses become linear about the shape that they share, or until it turns by less."""
SHORTER = 0.25
"""By how much a flat top that is less than none leads astray: pulses are not linear so far from it.
(`_shared_shape_kernels.py` says how it counts.) Laws that the family misses have half as much."""
HELD = 1e-3
"""Standard deviation of a parameter that is held meanwhile."""
CLEAR_ROUNDS, STAYS = 5, 0.3
"""In which clear pulses find the rest of their shape, or until their instants stay [errors]."""
MISSED_ROUNDS = 3
"""In which all pulses are measured with it."""
STEEP, LONG = 16.0, 3.0
"""Samples on both edges, and flat top over these: where samples enter them fits are not linear."""
DOUBT, OF_ONE = 3.7, 2.0
"""Standard errors of the rest's mean square that noise hardly ever leaves; of that of single fits,
which is less than none by one to four."""
USUAL = 1.7
"""What noise usually leaves: no more is taken for a rest where there need not be one."""
BY_ONE, BY_SHARED, FEWEST = 5.0, 2.0, 0.3
"""Samples of a pulse that its own fit follows, whatever they are, and that the shared shape does;
no smaller share of the rest is taken to be left."""
FAR, UNLIKE, UNSETTLED = 0.026, 0.5, 1.5
"""Of the heights is left, root mean square, such a share of clear pulses is not followed at all, or
instants still move by so many errors in the last round, root mean square: then only the pulses
themselves tell how they lie to each other. One of many pulses may always move."""
SOFTEST, LEAST_FAR = 0.85, 0.006
"""Logarithm of the power of an edge above which the family, where it misses so much of the heights,
does not tell where pulses begin: they are longer the greater it is, and hardly differ."""
STEPS = 0.05**2
"""Mean square, over that of the heights, that a mean pulse may leave where the family does not
settle or follow: a step, which lies between two samples, is no reason against it there."""
MISSED = 2.0
"""Times what the family usually leaves of a pulse: no more is left of one of the same shape."""


class Family(NamedTuple):
    """The member of the family that the pulses of a span are measured by, and how it fits."""

    missed: bool  # whether it misses them
    shown: bool  # whether clear pulses show the rest of their shape
    steep: bool
    left: float  # mean square that it leaves of them, over that of their heights
    alike: np.ndarray  # rows of the pulses of this shape
    clear: np.ndarray  # those of them that show it
    about: np.ndarray  # (2, SHAPES), where it is expected and how exactly
    mean: np.ndarray
    spread: np.ndarray
    learnt: np.ndarray  # what the span adds to `told`


def share_shape(rows, x, origin, timed, told):
    """Measure the pulses of `rows` again, in place, by their shared shape.

    Parameters
    ----------
    rows : array
        As `impactsig.detect.pulses.pulse.measure_all` fills them.
    x, origin : array, int
        The samples that they were measured in, and the place of the first.
    timed : bool
        Contact times are those from first to last touch.
    told : array
        What the spans before tell (see `nothing_told`); this one is added, in place.
    """
    family = _share_family(rows, x, origin, timed, told)
    far = _is_far(rows, family.alike, family.left if family.missed else 0.0, family.mean)
    if far and share_mean(rows, x, origin, timed, far):
        if family.missed:
            learn(family.learnt, told)
        return
    if family.missed:  # few records need it, and it takes long to compile
        before = rows.copy()
        moved = _share_missed(rows, x, origin, timed, told, family)
        if moved > UNSETTLED and share_mean(before, x, origin, timed, max(family.left, STEPS)):
            rows[:] = before
            return
    doubt_unlike(rows, family.alike, timed)


@allocating
def _share_family(rows, x, origin, timed, told):
    """Measure pulses by a shape of the family, and return it."""
    alike = _alike(rows)
    clear = _clear(rows, alike)
    left, error = what_is_left(rows, alike)
    length = _usual_length(rows, alike)
    absorbed = max(1.0 - BY_ONE / length, FEWEST)
    missed, steep = left > OF_ONE * error, _are_steep(rows, alike)
    if not missed and not steep:
        error = np.inf  # single fits of few samples leave nothing
    about, learnt = np.empty((2, SHAPES)), told.copy()
    learnt[ALONE:] = 0.0
    for m in range(SHAPES):
        about[0, m], about[1, m] = ABOUT[m], APART[m]
    mean, spread = about[0], about[1]
    if len(alike) >= LEAST:
        edges = np.empty(len(alike))
        for i in range(len(alike)):
            edges[i] = rows[alike[i], FIT + EDGE]
        about[0, LENGTH - SKEW] = centre_of(edges, len(alike))
        even = about.copy()
        if not missed and not steep:
            even[1, POWERS - SKEW] = HELD
        shape = Shape(even[0].copy(), even[1].copy(), np.zeros((SHAPES, SHAPES)), told)
        shape = share(rows, alike, timed, True, even, told, shape, ROUNDS)
        if not missed and not steep:
            before, first, room = rows.copy(), shape, make_room()
            settled = _settle(rows, alike, x, origin, timed, even, told, shape, room)
            near = rows.copy()
            shape = _free(rows, alike, x, origin, timed, about, told, settled, room)
            if len(clear) >= LEAST:
                absorbed = max(1.0 - BY_SHARED / length, FEWEST)
                _, left, error = common_rest(rows, clear, x, origin, room)
                if left > DOUBT * error and shape.mean[FLAT - SKEW] < -SHORTER:
                    rows[:] = near
                    even[1] = about[1]
                    even[0, FLAT - SKEW], even[1, FLAT - SKEW] = 0.0, HELD
                    shape = _free(rows, alike, x, origin, timed, even, told, settled, room)
                    _, left, error = common_rest(rows, clear, x, origin, room)
                if left > DOUBT * error:  # a shape that single fits do not show
                    rows[:] = before
                    shape = share(rows, alike, timed, True, about, told, first, ROUNDS)
                    shape = _free(rows, alike, x, origin, timed, about, told, shape, room)
                    _, left, error = common_rest(rows, clear, x, origin, room)
        mean, spread, learnt = shape.mean, shape.spread, shape.told
    left, error = with_told(left / absorbed, error / absorbed, learnt)
    missed |= len(alike) > 0 and left > DOUBT * error
    if not missed:
        learn(learnt, told)
        allow_for_unseen(rows, alike, max(left - USUAL * error, 0.0), timed)
    shown = missed and len(clear) >= LEAST and not steep
    left = max(left, 0.0)
    return Family(missed, shown, steep, left, alike, clear, about, mean, spread, learnt)


@allocating
def _settle(rows, alike, x, origin, timed, about, told, shape, room):
    """The shape after pulses have become linear about it, powers (and flat tops below none) held.

    `about` is changed.
    """
    for _ in range(FAMILY_ROUNDS):
        if _turned(rows, alike, shape) < TURNED:
            break
        linearize_anew(rows, alike, x, origin, room)
        if shape.mean[FLAT - SKEW] < 0.0:
            shape.mean[FLAT - SKEW] = about[0, FLAT - SKEW] = 0.0
            about[1, FLAT - SKEW] = HELD
        shape = share(rows, alike, timed, True, about, told, shape, AGAIN)
    return shape


@allocating
def _free(rows, alike, x, origin, timed, about, told, shape, room):
    """The shape after a round about where pulses are, free in what `about` does not hold."""
    linearize_anew(rows, alike, x, origin, room)
    return share(rows, alike, timed, True, about, told, shape, AGAIN)


@allocating
def _share_missed(rows, x, origin, timed, told, family):
    """Measure pulses that the family misses, with the rest of their shape.

    How far clear pulses still moved in the last round, root mean square [errors].
    """
    alike, clear, about, learnt = family.alike, family.clear, family.about, family.learnt
    room = make_room()
    moved = 0.0
    if len(alike) >= LEAST:
        shape = Shape(family.mean, family.spread, np.zeros((SHAPES, SHAPES)), learnt)
        if family.shown:
            about[0, POWER - SKEW] = _held(shape.mean)
            before = np.empty(len(clear))
            for _ in range(CLEAR_ROUNDS):
                rest = common_rest(rows, clear, x, origin, room)[0]
                linearize_with(rows, clear, x, origin, rest, room)
                for i in range(len(clear)):
                    before[i] = rows[clear[i], 0]
                shape = share(rows, clear, timed, False, about, told, shape, AGAIN)
                moved = highest = 0.0
                for i in range(len(clear)):
                    row = rows[clear[i]]
                    one = abs(row[0] - before[i]) / row[ERRORS]
                    highest = max(highest, one)
                    moved += one * one / len(clear)
                moved = math.sqrt(moved)
                if highest < STAYS:
                    break
            rest = common_rest(rows, clear, x, origin, room)[0]
            for _ in range(MISSED_ROUNDS):
                linearize_with(rows, alike, x, origin, rest, room)
                shape = share(rows, alike, timed, False, about, told, shape, AGAIN)
        elif not family.steep:
            shape = _free(rows, alike, x, origin, timed, about, told, shape, room)
        for k in range(len(learnt)):
            for m in range(SHAPES):
                learnt[k, m] = shape.told[k, m]
    learn(learnt, told)
    rest, held, error = common_rest(rows, clear, x, origin, room)
    held = max(held - DOUBT * error, 0.0) if family.shown else 0.0
    correct_misfit(rows, alike, x, origin, family.left, held, rest, timed)
    return moved


@kernel
def _is_far(rows, alike, left, mean):
    """Mean square that a mean pulse may leave, if clear pulses are far from the family; else 0."""
    softest = mean[POWER - SKEW] + abs(mean[POWERS - SKEW])
    if left > FAR * FAR or (left > LEAST_FAR * LEAST_FAR and softest > SOFTEST):
        return left
    clear = followed = 0
    for k in range(len(rows)):
        clear += is_seen(rows[k]) and is_clear(rows[k])
    for k in alike:
        followed += is_clear(rows[k])
    return STEPS if followed < (1.0 - UNLIKE) * clear and clear >= LEAST else 0.0


@kernel
def _turned(rows, alike, shape):
    """How far the shared shape is from those that pulses are linear about, in any parameter.

    These have neither a flat top shorter than none nor two powers.
    """
    turned = max(-shape.mean[FLAT - SKEW], 0.0)
    for m in range(SKEW, WIDER):
        mean = 0.0
        for k in alike:
            mean += rows[k, FIT + ESTIMATE + m] / len(alike)
        if m != FLAT:
            turned = max(turned, abs(shape.mean[m - SKEW] - mean))
    return turned


@kernel
def _usual_length(rows, alike):
    """Mean length of pulses [samples], by the squares of their heights; one at least."""
    length = total = 0.0
    for k in alike:
        parts = parts_of(rows[k, FIT + NOW :])
        one = rows[k, 2] ** 2
        length += one * (parts.rise + parts.flat + parts.fall)
        total += one
    return max(length / total, 1.0) if total > 0.0 else 1.0


@allocating
def _alike(rows):
    """The pulses that are measured by a fit, or that it misses no more than it does others."""
    chosen, shown = np.empty(len(rows), np.int64), np.empty(len(rows))
    count = clear = 0
    for k in range(len(rows)):
        if rows[k, FIT + SEEN] != rows[k, 0]:
            rows[k, FIT + SEEN] = np.nan  # measured otherwise since
        if _is_fitted(rows[k]) and is_clear(rows[k]):
            shown[clear] = rows[k, FIT + LEFT]
            clear += 1
    usual = MISSED * centre_of(shown, clear) if clear >= LEAST else 0.0
    for k in range(len(rows)):
        kept = rows[k, FIT:]
        if _is_fitted(rows[k]) and (
            kept[TAKEN] == kept[MADE] or kept[LEFT] < usual + 3.0 * kept[LEFT_SD]
        ):
            chosen[count] = k
            count += 1
    return chosen[:count]


@allocating
def _clear(rows, alike):
    """Those of the pulses that show their shape."""
    clear = np.empty(len(alike), np.int64)
    count = 0
    for k in alike:
        if is_clear(rows[k]):
            clear[count] = k
            count += 1
    return clear[:count]


@kernel
def _held(mean):
    """Power at which the edges of the family are held while the rest of the shape is sought.

    That of soft edges is as fitted; a steep foot would bind an instant to a sample, and where there
    is a flat top its corners are taken for softness.
    """
    flat = max(BRIEF * (math.exp(mean[FLAT - SKEW]) - 1.0), 0.0)
    return max(mean[POWER - SKEW], 0.0) * max(1.0 - flat, 0.0)


@kernel
def _are_steep(rows, alike):
    """Whether pulses have a long flat top and hardly a sample on their edges."""
    edges = flat = 0.0
    for k in alike:
        parts = parts_of(rows[k, FIT + ESTIMATE :])
        edges += parts.rise + parts.fall
        flat += parts.flat
    return edges < STEEP * len(alike) and flat > LONG * edges


@kernel
def _is_fitted(row):
    """Whether one pulse was fitted here, well or not, and is whole."""
    return row[5] == 0 and row[6] == 0 and row[FIT + MADE] == row[0]
