"""Crests of the rise in octaves that are pulses of a voice: many in a short time.

A voice opens 80 to 300 times a second, for a few tenths of a second, and each opening is a rise in
octaves. It is recognised by n, the number of other crests within 50 ms higher than 0.4 times
this one. If n is at least 5, and the average within a second is at most 0.7 n per 50 ms (a machine
that hits as fast does so all the time), the log-odds of an impact are at most

    0.3 o - 0.76 n + 1.69 ln B + 6.1,

with o the log-odds otherwise and B the greatest rise in narrow bands within two frames, limited to
their threshold. A crest where they reach it is not changed. Fitted by logistic regression to
records of `benchmarks.varied_sound`, seeds 6000 to 6039 and 6100 to 6139, and of
`benchmarks.sound_disturbances`.
"""

from __future__ import annotations

import numpy as np

from ...._compiling.compiled import allocating
from .._kernels import GROUP
from .._nearby_kernels import ends_about, number_as_high
from .crest_kernels import heard_about

WITHIN, AS_HIGH, MANY = 50e-3, 0.4, 5  # [s], share of the height, and number of crests
ALWAYS, STEADY = 1.0, 0.7  # [s], and share of the time that such crests fill if they are steady
OF_ODDS, OF_NUMBER, OF_BANDS, OFFSET = 0.3, 0.76, 1.69, 6.1
LEAST_BANDS = 0.01  # [neper of power]


@allocating
def lower_pulses(odds, asked, place, height, bands, groups, silence, seconds):
    """Lower the log-odds of crests that are asked for and may be pulses of a voice.

    Parameters
    ----------
    place, height, bands : frames of `seconds`, C there and the greatest B nearby
    groups : number of GROUPs of the passage
    silence : as of `Crests`
    """
    ends, rates = np.empty((4, len(place)), np.int64), np.empty(2)
    reaches = WITHIN / seconds, ALWAYS / seconds
    for i in range(2):
        whole = float(int(reaches[i]))
        ends_about(place, place, whole, whole + 1.0, ends[2 * i], ends[2 * i + 1])
    for k in range(len(place)):
        if not asked[k] or ends[1, k] - ends[0, k] <= MANY:
            continue
        number = number_as_high(height, k, ends[0, k], ends[1, k], AS_HIGH)
        if number < MANY:
            continue
        always = number_as_high(height, k, ends[2, k], ends[3, k], AS_HIGH)
        for i, count in enumerate((number, always)):
            end = min(place[k] + reaches[i], GROUP * groups)
            rates[i] = (count + 1.0) / (end - max(place[k] - reaches[i], 0.0))
        heard = heard_about(silence, place[k], round(ALWAYS / (GROUP * seconds)))
        if rates[1] < STEADY * heard * rates[0]:
            loud = np.log(max(bands[k], LEAST_BANDS))
            least = OF_ODDS * odds[k] - OF_NUMBER * number + OFFSET + OF_BANDS * loud
            odds[k] = min(odds[k], least)
