"""Values such as -9999 that stand for missing samples, as often as there are impacts."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import Impacts, LoadCell, Recording, detect_impacts, match_impacts, synthesize

RATE = 50_000


@pytest.fixture(scope="module")
def machine():
    rng = np.random.default_rng(44)
    time = np.cumsum(rng.uniform(0.05, 0.15, 60))
    truth = Impacts(time, start=0.0, duration=7.0, peak=np.exp(rng.normal(0, 0.4, 60)))
    return truth, synthesize(truth, LoadCell(noise=0.02), seed=4).samples


def found_in(samples, **options):
    return detect_impacts(Recording(samples, RATE, units="N"), **options)


@pytest.mark.parametrize("code", [-9999.0, 32767.0, 1e30])
@pytest.mark.parametrize("polarity", ["auto", "both"])
def test_codes_as_frequent_as_impacts(machine, code, polarity):
    truth, samples = machine
    places = np.random.default_rng(5).integers(0, len(samples), 150)
    coded = samples.copy()
    coded[np.append(places, places[:5] + 1)] = code
    found = found_in(coded, polarity=polarity)
    assert match_impacts(found, truth, 1e-3).f1 == 1
    (note,) = (note for note in found.notes if "error codes" in note)
    count = np.count_nonzero(coded == code)
    assert note.startswith(f"{count} samples are {code:g}, far from all others")
    runs = [one for one in found.disturbances if one.kind == "code"]
    assert round(sum(one.duration for one in runs) * RATE) == count
    assert {one.height for one in runs} == {code}


def test_codes_leave_the_step_of_a_converter(machine):
    """Filled by lines, 164 samples halved it, and 626 impacts were found instead of 60."""
    truth, samples = machine
    coarse = 0.05 * np.round(samples / 0.05)
    coded = coarse.copy()
    coded[np.random.default_rng(8).integers(0, len(samples), 200)] = 32767.0
    expected, found = found_in(coarse), found_in(coded)
    assert found.settings["converter_step"] == expected.settings["converter_step"]
    assert match_impacts(found, truth, 1e-3).f1 == match_impacts(expected, truth, 1e-3).f1


def test_two_codes_in_any_blocks(machine):
    truth, samples = machine
    rng = np.random.default_rng(6)
    coded = samples.copy()
    coded[rng.integers(0, len(samples), 80)] = -9999.0
    coded[rng.integers(0, len(samples), 80)] = 9999.0
    coded[:3] = coded[-2:] = -9999.0
    cuts = np.sort(np.append(rng.integers(0, len(samples), 20), np.flatnonzero(coded < -9)[5:9]))
    blocks = [
        Recording(part, RATE, units="N", start=first / RATE)
        for part, first in zip(np.split(coded, cuts), [0, *cuts], strict=True)
        if len(part)
    ]
    found, pieces = found_in(coded), detect_impacts(blocks)
    assert match_impacts(found, truth, 1e-3).f1 == 1
    for name in ("time", "contact_time", "peak", "time_error"):
        np.testing.assert_array_equal(getattr(found, name), getattr(pieces, name))
    assert sum(one.duration for one in found.disturbances) == pytest.approx(
        sum(one.duration for one in pieces.disturbances)
    )
    assert "-9999 or 9999" in found.notes[0]


def test_a_limit_and_a_switch_are_no_codes(machine):
    _, samples = machine
    clipped = found_in(np.minimum(samples, 0.5))
    switch = np.zeros(RATE * 3)
    switch[np.random.default_rng(7).integers(0, len(switch), 40)] = 5.0
    for found in (clipped, found_in(switch)):
        assert len(found) >= 39
        assert not any(one.kind == "code" for one in found.disturbances)
