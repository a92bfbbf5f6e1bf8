"""What three weak rises that agree tell, in closed form, and soft strokes beside ringing sound."""

from __future__ import annotations

import numpy as np

from benchmarks.other_sounds import KINDS, drums, f1
from impactsig.detect.signal.stream import Piece
from impactsig.detect.sound._agreement import agreed_odds, unexplained
from impactsig.detect.sound.sound import detect_sound


def test_the_weakest_of_the_rises_counts():
    bands, around = np.array([0.36, 0.18, 0.36, 0.36, 0.0]), np.array([0.05, 0.05, 0.12, 0.05, 0.0])
    likelihood, octave = np.array([60.0, 300.0, 60.0, 15.0, 90.0]), np.full(5, 40.0)
    odds = agreed_odds(bands, around, likelihood, octave)
    np.testing.assert_allclose(odds, [6 * np.log(2), 0.0, 0.0, -6 * np.log(2), -np.inf], atol=1e-12)


def test_only_what_nothing_near_explains_is_asked():
    frame, odds = np.array([0, 20, 100, 110, 200]), np.array([-1.0, 3.0, -2.0, -1.0, -np.inf])
    np.testing.assert_array_equal(unexplained(frame, odds, 1e-3), [3])


def test_soft_strokes_beside_a_ringing_ride():
    made = drums(np.random.default_rng([3, 0]))
    found = detect_sound(lambda: [Piece(0, made.samples)], made.rate).time
    assert f1(found, made.time, *KINDS[drums]) >= 0.97  # 0.935 without
