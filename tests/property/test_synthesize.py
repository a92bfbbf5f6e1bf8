"""What must hold of a synthesized record whatever the impacts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from impactsig import Impacts
from impactsig.simulation.instruments.sensors import LoadCell, Microphone
from impactsig.simulation.instruments.synthesis import synthesize

# Scaling by powers of two is exact as long as no number becomes subnormal.
PEAK = st.just(0.0) | st.floats(1e-6, 100)
IMPACT = st.tuples(st.floats(0, 0.2), PEAK, st.floats(0, 0.05), st.booleans())


def run(rows):
    time, peak, contact, _ = np.array(rows, float).reshape(-1, 4).T
    return Impacts.from_times(time, start=0.0, duration=0.2, peak=peak, contact_time=contact)


@settings(max_examples=60, deadline=None)
@given(st.lists(IMPACT, max_size=20), st.floats(200, 60_000), st.integers(1, 30))
def test_the_record_of_a_train_is_the_sum_over_its_parts(rows, rate, power):
    cell = LoadCell(ringing=0.3, ringing_frequency=90.0, ringing_decay=0.02)
    parts = [[row for row in rows if row[3] is chosen] for chosen in (True, False)]
    whole = synthesize(run(rows), cell, rate=rate).samples
    pieces = [synthesize(run(part), cell, rate=rate).samples for part in parts]
    scale = 1 + sum(row[1] for row in rows)
    np.testing.assert_allclose(whole, sum(pieces), atol=1e-12 * scale)
    louder = LoadCell(gain=2.0**power, ringing=0.3, ringing_frequency=90.0, ringing_decay=0.02)
    np.testing.assert_array_equal(
        synthesize(run(rows), louder, rate=rate).samples, 2.0**power * whole
    )


@pytest.mark.parametrize("sensor", [LoadCell(noise=0.1, hum=0.2), Microphone(noise=0.1)])
@settings(max_examples=30, deadline=None)
@given(st.lists(IMPACT, max_size=20), st.integers(2, 32), st.floats(0.01, 100), st.integers(0, 99))
def test_no_record_leaves_the_range_of_its_converter(sensor, rows, bits, full_scale, seed):
    made = synthesize(run(rows), sensor, rate=20_000.0, bits=bits, full_scale=full_scale, seed=seed)
    assert len(made) == 4000
    assert np.isfinite(made.samples).all()
    assert np.abs(made.samples).max() <= full_scale * (1 + 1e-12)
    assert len(np.unique(made.samples)) <= 2**bits
