"""Two clocks laid on each other by the impacts of both recordings."""

from __future__ import annotations

import doctest

import numpy as np
import pytest

from impactsig import Impacts, InvalidInput, alignment, match_impacts
from impactsig.alignment import align_impacts


def pair(seed, *, count=1000, delay=0.0, skew=0.0, jitter=2e-5, missed=0.05, spurious=0.05):
    """A train, and what another instrument with a clock of its own counted of it."""
    rng = np.random.default_rng(seed)
    truth = np.cumsum(rng.uniform(0.03, 0.07, count))
    trains = []
    for late, fast in ((0.0, 0.0), (delay, skew)):
        seen = truth[rng.random(count) >= missed]
        seen = seen + rng.normal(0, jitter, len(seen))
        false = rng.uniform(truth[0], truth[-1], rng.poisson(spurious * count))
        trains.append(Impacts.from_times(late + (1 + fast) * np.concatenate((seen, false))))
    return trains[1], trains[0], truth


def test_example():
    assert doctest.testmod(alignment, extraglobs={"Impacts": Impacts}).failed == 0


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("delay", "skew"), [(2.5, 5e-5), (-7.0, -1.5e-4), (0.0029, 0.0)])
def test_delay_and_skew_are_found(seed, delay, skew):
    other, reference, truth = pair(seed, delay=delay, skew=skew)
    found = align_impacts(other, reference)
    assert found.skew == pytest.approx(skew, abs=1e-6)
    assert abs(found.skew - skew) < 4 * found.skew_error
    assert abs(found.delay - delay) < 4 * found.delay_error
    assert found.skew_error < 2e-7
    # Both trains keep 95 % of the impacts.
    assert len(found.pairs) > 0.87 * len(truth)
    assert match_impacts(found.impacts, reference, 2e-4).rms < 4e-5
    assert found.error.std() == pytest.approx(np.sqrt(2) * 2e-5, rel=0.1)


def test_standard_errors_are_those_of_many_pairs():
    z = []
    for seed in range(60):
        other, reference, _ = pair(100 + seed, count=200, delay=0.4, skew=3e-5)
        found = align_impacts(other, reference)
        z.append(((found.delay - 0.4) / found.delay_error, (found.skew - 3e-5) / found.skew_error))
    assert np.all(np.abs(np.std(z, axis=0) - 1) < 0.3)


def test_channels_of_one_instrument_have_one_clock():
    other, reference, _ = pair(3, delay=0.0029)
    found = align_impacts(other, reference, skew=False)
    assert found.skew == found.skew_error == 0
    assert found.delay == pytest.approx(0.0029, abs=5e-6)


def test_recordings_that_overlap_in_part():
    other, reference, _ = pair(5, count=2000, delay=11.0, skew=5e-5)
    found = align_impacts(other[other.time < 40.0], reference[reference.time > 20.0])
    assert found.skew == pytest.approx(5e-5, abs=2e-6)
    assert found.delay == pytest.approx(11.0, abs=1e-4)


def test_what_cannot_be_aligned_is_refused():
    rng = np.random.default_rng(1)
    strangers = [Impacts.from_times(np.cumsum(rng.uniform(0.03, 0.07, 500))) for _ in range(2)]
    with pytest.raises(InvalidInput, match="one delay"):
        align_impacts(*strangers)
    clock = Impacts.from_times(0.05 * np.arange(500))
    with pytest.raises(InvalidInput, match="trains are periodic"):
        align_impacts(clock, clock)
    assert align_impacts(clock, clock, longest_delay=0.02).delay == 0
    with pytest.raises(InvalidInput, match="6 or more"):
        align_impacts(clock[:3], clock)


def test_trains_that_have_nothing_in_common_are_refused():
    for seed in range(12):
        rng = np.random.default_rng(seed)
        one, other = (
            Impacts(np.cumsum(rng.uniform(0.03, 0.06, count)))
            for count in (50, (6, 50, 200)[seed % 3])
        )
        for skew in (True, False):
            with pytest.raises(InvalidInput, match="impacts that both trains hold"):
                align_impacts(one, other, skew=skew)


def test_a_handful_in_common_suffices_where_chance_makes_fewer():
    rng = np.random.default_rng(5)
    true = np.cumsum(rng.uniform(0.03, 0.06, 40))
    found = align_impacts(Impacts(true[30:] + 1e-5), Impacts(true))
    assert found.delay == pytest.approx(1e-5, abs=1e-4)
    assert len(found.pairs) == 10
