"""Kernels that find the width of an event near a place, and its crest and flanks."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...._compiling.compiled import allocating, kernel
from ...signal.ladder import HALF_SINE_GAIN
from ...signal.order_kernels import value_at
from .._response_kernels import gated, noise_at, parts, parts_inside, running_sums

EVENT = 5  # fields of an event: centre, width [samples], height, height over noise, flank mean
LEAST = 5.0  # standard deviations of an event's height once others are taken off it
RESPONSE = 1.03  # noise of the response to one sample over that of a sample
ROOM = 0.2  # of the way to a neighbour: how far a crest may move


@kernel
def put(event, rows, k):
    """Make the event row k; a row given as an array takes numba six seconds to compile."""
    for i in range(EVENT):
        rows[k, i] = event[i]


class Noise(NamedTuple):
    """Noise of the responses: of the tabulated widths, and of others once computed, else NaN."""

    widths: np.ndarray
    sigma: np.ndarray
    known: np.ndarray


@allocating
def noise_of(here):
    """Noise of the responses in a stretch."""
    width = here.rungs.width
    widths, known = np.empty(len(width)), np.empty(2 * width[-1])
    for j in range(len(width)):
        widths[j] = width[j]
    for k in range(len(known)):
        known[k] = np.nan
    return Noise(widths, here.noise, known)


@kernel
def sigma_at(width, noise):
    """Noise of the response to a whole number of samples."""
    if width >= len(noise.known):
        return noise_at(float(width), noise.widths, noise.sigma)
    sigma = noise.known[width]
    if np.isnan(sigma):
        sigma = noise.known[width] = noise_at(float(width), noise.widths, noise.sigma)
    return sigma


@kernel
def _margin(widest):
    """Samples from the crest to the outer end of a flank."""
    return int(6.2 * widest) + 16


@kernel
def room_for(widest):
    """Sums that `best_width` needs room for."""
    return 2 * _margin(widest) + 2


@kernel
def best_width(x, origin, total, centre, narrowest, widest, noise, sums, event, room):
    """Find the best width in a range near a centre, in quarter octaves.

    The crest is looked for within 0.6 widths and `room` of the centre. `sums` is room to work in.
    """
    margin = _margin(widest)
    lo, hi = max(0, int(centre) - margin), min(total, int(centre) + margin + 1)
    lo, hi = max(lo, origin), min(hi, origin + len(x))
    running_sums(x, lo - origin, hi - lo, sums)
    reference = x[lo - origin]
    event[0], event[1], event[2], event[3], event[4] = centre, narrowest, 0.0, 0.0, 0.0
    previous = 0
    steps = math.ceil(4.0 * math.log(widest / narrowest) / math.log(2.0) - 1e-9)
    for step in range(steps + 1):
        width = round(narrowest * 2.0 ** (0.25 * step))
        if width == previous or width > widest + 0.5:
            continue
        previous = width
        near = width + (width + 1) // 2 + 1
        far = near + 4 * width + 4
        gain = HALF_SINE_GAIN if width > 1 else 1.0
        sigma = sigma_at(width, noise)
        shift = 0.5 * (width - 1) - (width - 1) // 2
        stride = max(1, width // 16)
        reach = min(0.6 * width, room)
        first = max(round(centre - shift - reach - 0.5), lo)
        last = min(round(centre - shift + reach + 0.5), hi - 1)
        per_unit, per_side = 1.0 / width, 1.0 / (far - near)
        inside = first - lo >= far and last + far < hi
        for i in range(first, last + 1, stride):
            if inside:
                c, left, right = parts_inside(sums, i - lo, width, near, far, per_unit, per_side)
            else:
                c, left, right = parts(sums, 0, hi - lo, i - lo, width, near, far)
            value = gated(c, left, right, gain)
            if value > sigma * event[3]:
                event[0], event[1], event[2] = i + shift, width, value
                event[3], event[4] = value / sigma, 0.5 * (left + right) + reference
    return event[3] > 0.0


@allocating
def place(here, events, white, out):
    """Crest and flanks of events at the widths that they have been given.

    Parameters
    ----------
    here : Stretch
    events : array (n, EVENT)
        The centre and the flank mean are filled, and the width is rounded.
    white : array (rungs,)
        Noise of the responses where it is white, over that of the first of them.
    out : array (n, 4), filled
        Centre, flank mean, width, and how many times that of white noise the noise over it is.
    """
    noise = noise_of(here)
    event = np.empty(EVENT)
    colours = np.empty(len(white))
    for j in range(len(white)):
        colours[j] = noise.sigma[j] / (noise.sigma[0] * white[j])
    widest = 0.0
    for k in range(len(events)):
        events[k, 1] = max(float(round(events[k, 1])), 1.0)
        widest = max(widest, events[k, 1])
    sums = np.empty(room_for(widest))
    for k in range(len(events)):
        width, room = events[k, 1], np.inf
        for m in (k - 1, k + 1):
            if 0 <= m < len(events):
                room = min(room, ROOM * abs(events[m, 0] - events[k, 0]))
        centre = events[k, 0]
        x, origin, total = here.x, here.origin, here.total
        if best_width(x, origin, total, centre, width, width, noise, sums, event, room):
            events[k, 0], events[k, 4] = event[0], event[4]
        out[k, 0], out[k, 1], out[k, 2] = events[k, 0], events[k, 4], width
        out[k, 3] = value_at(width, noise.widths, colours)
