"""Recordings in which the forcing frequency was swept: the motion over the frequency."""

from __future__ import annotations

import numpy as np
import pytest

from impactsig import Impacts, Rig
from impactsig.experiment._sweep import swept
from impactsig.experiment._transitions import jumps_in_sweeps

pytestmark = pytest.mark.slow  # periods are identified in many windows
START, RATE, SECONDS = 20.0, 0.1, 25.0
CHANGE, SILENT = (
    21.2,
    22.0,
)  # [Hz], where every second impact begins to be missed, and where all are


def instants_of(cycles):
    """When the forcing has gone through so many cycles."""
    return (np.sqrt(START**2 + 2 * RATE * np.asarray(cycles)) - START) / RATE


@pytest.fixture(scope="module")
def train():
    """period(1,1), then period(1,2), then nothing; jitter of 0.1 ms."""
    cycles = np.arange(0.3, (START + RATE * SECONDS / 2) * SECONDS)
    time = instants_of(cycles)
    frequency = START + RATE * time
    hit = (frequency < CHANGE) | (np.arange(len(cycles)) % 2 == 0)
    hit &= frequency < SILENT
    time = time[hit] + 1e-4 * np.random.default_rng(0).standard_normal(int(hit.sum()))
    return Impacts(time, start=0.0, duration=SECONDS)


def rig_of(**sweep):
    forcing = [{"number": 1, "use": "forcing"}] if sweep["from"] == "channel" else []
    return Rig(channel=[{"number": 0}, *forcing], sweep=sweep)


@pytest.mark.parametrize(
    "origin",
    ["law", *(pytest.param(one, marks=pytest.mark.slow) for one in ("channel", "impacts"))],
)
def test_changes_are_found_at_their_frequency(train, origin):
    stated = {"start": START, "rate": RATE}
    instants = None
    if origin == "channel":
        stated, instants = {}, instants_of(np.arange(0.0, 531.0))
    row = swept(train, rig_of(**{"from": origin, **stated}), instants)
    jumps = jumps_in_sweeps([(row, "up")])
    assert [(one.before, one.after) for one in jumps] == [
        ("period(1,1)", "period(1,2)"),
        ("period(1,2)", "no impacts"),
    ]
    # Within two impacts, which is 0.02 Hz.
    np.testing.assert_allclose([one.value for one in jumps], [CHANGE, SILENT], atol=0.02)
    for one in row["windows"]:
        middle = START + RATE * 0.5 * (one["start"] + one["stop"])
        assert one["value"] == pytest.approx(middle, abs=0.1)


@pytest.mark.slow
def test_the_impacts_mend_a_law_that_is_off(train):
    """The stated frequency is 1 % too low; the impacts are locked to the true one."""
    wrong = {"start": 0.99 * START, "rate": 0.99 * RATE}
    of_law = swept(train, rig_of(**{"from": "law", **wrong}), None)["windows"][3]
    of_impacts = swept(train, rig_of(**{"from": "impacts", **wrong}), None)["windows"][3]
    true = START + RATE * 0.5 * (of_law["start"] + of_law["stop"])
    assert abs(of_law["value"] - true) > 0.1
    assert of_impacts["value"] == pytest.approx(true, abs=0.05)
