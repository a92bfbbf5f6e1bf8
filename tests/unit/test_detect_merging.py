"""Which impacts `merge_within` joins and `dead_time` drops: instants, peaks and flags."""

from __future__ import annotations

import numpy as np
import pytest

import impactsig
from impactsig.impacts import CLIPPED, OPEN_START

HEIGHTS = np.array([0.6, 1.0, 0.8, 0.7])


def record(starts, heights=HEIGHTS, clip=np.inf, samples=8000):
    """Half-sines of 40 samples, one sample per second."""
    t = np.arange(samples, dtype=float)
    x = np.zeros(samples)
    for start, height in zip(starts, heights, strict=True):
        u = (t - start) / 40.0
        x += np.where((u >= 0) & (u <= 1), height * np.sin(np.pi * u), 0.0)
    return impactsig.Recording(np.minimum(x, clip), 1.0, units="N")


def merged_by_hand(time, peak, flags, within):
    """A group is an impact and all that follow it by at most `within`; nothing is chained."""
    groups = []
    for k in range(len(time)):
        if groups and time[k] <= time[groups[-1][0]] + within:
            groups[-1].append(k)
        else:
            groups.append([k])
    joined = [int(np.bitwise_or.reduce([flags[k] for k in group])) for group in groups]
    first = [group[0] for group in groups]
    return time[first], np.array([max(peak[group]) for group in groups]), joined, first


@pytest.mark.parametrize("within", [50.0, 250.0, 450.0, 1e4])
def test_impacts_within_reach_of_the_first_of_a_group_join_it(within):
    # 200 apart: the third is within 250 of the second, not of the first.
    rec = record([1000.0, 1200.0, 1400.0, 4000.0], clip=0.65)
    every = impactsig.detect_impacts(rec)
    np.testing.assert_array_equal(every.flags, [0, CLIPPED, CLIPPED, CLIPPED])
    merged = impactsig.detect_impacts(rec, merge_within=within)
    time, peak, flags, first = merged_by_hand(every.time, every.peak, every.flags, within)
    np.testing.assert_array_equal(merged.time, time)
    np.testing.assert_array_equal(merged.peak, peak)
    np.testing.assert_array_equal(merged.flags, flags)
    kept = impactsig.detect_impacts(rec, dead_time=within)
    for name in ("time", "peak", "flags", "contact_time", "impulse", "rise_time"):
        np.testing.assert_array_equal(getattr(kept, name), getattr(every, name)[first])


@pytest.mark.parametrize("option", ["merge_within", "dead_time"])
def test_an_impact_exactly_as_far_away_as_given_still_belongs_to_the_first(option):
    rec = record([1000.0, 1200.0, 1600.0, 4000.0])
    time = impactsig.detect_impacts(rec).time
    assert len(time) == 4
    # The difference of two instants within a factor of two is exact, and so is its sum.
    apart = time[1] - time[0]
    np.testing.assert_array_equal(
        impactsig.detect_impacts(rec, **{option: apart}).time, time[[0, 2, 3]]
    )
    short = impactsig.detect_impacts(rec, **{option: (1 - 1e-9) * apart})
    np.testing.assert_array_equal(short.time, time)


def test_a_merged_impact_has_the_flags_of_all_its_parts():
    rec = record([-20.0, 200.0, 400.0, 4000.0], clip=0.9)
    every = impactsig.detect_impacts(rec)
    np.testing.assert_array_equal(every.flags, [OPEN_START, CLIPPED, 0, 0])
    merged = impactsig.detect_impacts(rec, merge_within=500.0)
    np.testing.assert_array_equal(merged.flags, [OPEN_START | CLIPPED, 0])
    np.testing.assert_array_equal(merged.time, every.time[[0, 3]])
    assert merged.peak[0] == every.peak.max()
    assert merged.shared_peak_error[0] == every.shared_peak_error[every.peak.argmax()]
