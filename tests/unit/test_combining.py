"""Trains of several sensors made one."""

from __future__ import annotations

import doctest
from dataclasses import replace

import numpy as np
import pytest

from impactsig import (
    Impacts,
    InvalidInput,
    LoadCell,
    Recording,
    align_impacts,
    combine_impacts,
    detect_impacts,
    match_impacts,
    synthesize,
)
from impactsig.combining import combination
from impactsig.impacts import CLIPPED


def heard(truth, rng, *, late=0.0, jitter=2e-5, **known):
    """What a sensor makes of the truth: 5 % missed, 5 % spurious."""
    kept = rng.random(len(truth)) >= 0.05
    false = rng.uniform(truth[0], truth[-1], rng.poisson(0.05 * len(truth)))
    time = np.concatenate((truth[kept] + jitter * rng.standard_normal(kept.sum()), false)) + late
    return Impacts.from_times(time, time_error=np.full(len(time), jitter), **known)


@pytest.mark.parametrize("seed", range(3))
def test_load_cell_and_microphone(seed):
    rng = np.random.default_rng(seed)
    truth = np.cumsum(rng.uniform(0.02, 0.08, 1000))
    cell, microphone = heard(truth, rng, jitter=5e-6), heard(truth, rng, late=0.0029, jitter=3e-5)
    both = combine_impacts([cell, microphone])
    assert both.delays[1] == pytest.approx(0.0029, abs=3e-5)
    assert both.delay_errors[1] < 1e-5
    matched = match_impacts(both.impacts, Impacts(truth), 3e-4)
    assert matched.recall > 0.99
    # No impact twice: what is spurious is what either sensor made up.
    made_up = len(cell) + len(microphone) - 2 * 0.95 * len(truth)
    assert len(matched.spurious) == pytest.approx(made_up, abs=30)
    assert len(both.impacts) == len(matched.pairs) + len(matched.spurious)
    z = matched.error / both.impacts.time_error[matched.pairs[:, 0]]
    assert 0.9 < np.std(z[np.abs(z) < 5]) < 1.1
    for k, train in enumerate((cell, microphone)):
        assert sorted(both.index[both.index[:, k] >= 0, k]) == list(range(len(train)))


def test_channels_that_start_at_other_times():
    rng = np.random.default_rng(21)
    truth = np.cumsum(rng.uniform(0.02, 0.08, 400))
    cell, microphone = heard(truth, rng), heard(truth, rng, late=-0.31)
    both = combine_impacts([cell, microphone])
    assert both.delays[1] == pytest.approx(-0.31, abs=3e-5)
    assert any("0.31 s apart" in note for note in both.impacts.notes)
    assert match_impacts(both.impacts, Impacts(truth), 3e-4).recall > 0.99
    # Asked for less, or of another machine, they have no common delay.
    other = heard(np.cumsum(rng.uniform(0.02, 0.08, 400)), rng)
    for trains, longest in (((cell, microphone), 0.05), ((cell, other), None)):
        apart = combine_impacts(trains, longest_delay=longest)
        assert apart.delays[1] == 0.0
        assert np.isinf(apart.delay_errors[1])


def test_of_what_a_sensor_shares_as_much_counts_as_its_weight():
    truth, cells = np.arange(1.0, 400.0), []
    for late, error, shared in ((0.0, 2e-6, 1e-6), (1e-4, 4e-6, 3e-6)):
        columns = {"time_error": np.full(399, error), "shared_time_error": np.full(399, shared)}
        cells.append(Impacts(truth + late, **columns))
    both = combine_impacts(cells).impacts
    # Weights 4/5 and 1/5.
    np.testing.assert_allclose(both.shared_time_error, np.hypot(0.8e-6, 0.6e-6))
    one = combine_impacts([cells[0], Impacts(truth + 1e-4, time_error=np.full(399, 4e-6))]).impacts
    np.testing.assert_allclose(one.shared_time_error, 0.8e-6)


def test_of_a_peak_all_errors_are_those_of_the_sensor_that_measured_it():
    truth = np.arange(1.0, 30.0)
    weak, strong = (
        Impacts(truth, peak=peak, peak_error=0.1 * peak, shared_peak_error=0.04 * peak)
        for peak in (np.full(29, 1.0), np.where(truth > 9.5, 2.0, 0.5))
    )
    both = combine_impacts([weak, strong]).impacts
    np.testing.assert_allclose(both.peak, np.where(truth > 9.5, 2.0, 1.0))
    np.testing.assert_allclose(both.shared_peak_error, 0.04 * both.peak)
    alone = replace(strong, shared_peak_error=None)
    assert combine_impacts([weak, alone]).impacts.shared_peak_error is None


def test_two_load_cells_tell_the_stops_apart():
    rng = np.random.default_rng(5)
    truth = np.cumsum(rng.uniform(0.02, 0.08, 600))
    stop = rng.integers(0, 2, 600)
    strong = np.exp(0.3 * rng.standard_normal(600))
    trains = []
    for own in (0, 1):
        peak = np.where(stop == own, strong, 0.2 * strong)
        felt = peak > 0.15
        trains.append(
            Impacts(
                truth[felt] + 1e-4 * own, peak=peak[felt], contact_time=3e-4 * peak[felt],
                unit="N", sensor="force",
            )
        )  # fmt: skip
    both = combine_impacts(trains, stops=[0, 1])
    assert len(both.impacts) == 600
    np.testing.assert_array_equal(both.impacts.stop_index, stop)
    np.testing.assert_allclose(both.impacts.peak, strong)
    np.testing.assert_allclose(both.impacts.contact_time, 3e-4 * strong)
    assert both.delays[1] == pytest.approx(1e-4)


@pytest.mark.parametrize("late", [-3e-3, 3e-3])
def test_stops_hit_in_turn_are_not_one_that_is_late(late):
    """Once half of the impacts were lost: each of one load cell has a partner 18 ms later."""
    rng = np.random.default_rng(9)
    left = 0.1 + np.arange(0, 5, 0.0976) + 1e-5 * rng.standard_normal(52)
    right = left[:-1] + 0.0182 + 1e-5 * rng.standard_normal(51)
    cells = [
        Impacts(one, peak=np.ones(len(one)), unit="N", sensor="force") for one in (left, right)
    ]
    both = combine_impacts(cells, stops=[0, 1])
    assert np.bincount(both.impacts.stop_index).tolist() == [52, 51]
    assert both.delays[1] == 0
    assert not both.impacts.notes
    # A microphone before them, so that the cells have a delay of their own that they share.
    room = Impacts(np.sort(np.append(left, right)) + late, sensor="sound", peak=np.ones(103))
    three = combine_impacts([room, *cells], stops=[None, 0, 1])
    np.testing.assert_allclose(three.delays[1:], -late, atol=1e-5)
    assert np.bincount(three.impacts.stop_index).tolist() == [52, 51]


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_a_microphone_leaves_what_the_load_cell_measured(order):
    """Contact times and peaks once dropped out; what the cell missed is filled in, error inf."""
    rng = np.random.default_rng(8)
    truth = np.cumsum(rng.uniform(0.02, 0.08, 300))
    n = np.count_nonzero
    felt, loud = rng.random(300) > 0.05, rng.random(300) > 0.05
    peak, contact = rng.uniform(1, 2, 300), rng.uniform(2e-4, 4e-4, 300)
    flags = np.where(peak > 1.9, CLIPPED, 0)
    cell = Impacts(
        truth[felt], peak=peak[felt], contact_time=contact[felt], rise_time=contact[felt] / 2,
        peak_error=np.full(n(felt), 0.01), contact_time_error=np.full(n(felt), 1e-6),
        flags=flags[felt], unit="N", sensor="force", contact_level=0.0,
    )  # fmt: skip
    sound = Impacts(truth[loud] + 3e-3, peak=50 * peak[loud], unit="Pa", sensor="sound")
    both = combine_impacts([(cell, sound)[k] for k in order]).impacts
    heard_or_felt = felt | loud
    own = felt[heard_or_felt]
    assert len(both) == n(heard_or_felt)
    assert (both.unit, both.contact_level) == ("N", 0.0)
    np.testing.assert_array_equal(both.peak[own], peak[felt])
    np.testing.assert_array_equal(both.contact_time[own], contact[felt])
    np.testing.assert_array_equal(both.flags[own], flags[felt])
    assert np.all(np.isinf(both.peak_error) == ~own)
    assert np.all(np.isinf(both.contact_time_error) == ~own)
    alone = np.flatnonzero(~own)
    single = alone[(alone > 0) & own[alone - 1] & own[np.minimum(alone + 1, len(own) - 1)]]
    mean = (both.contact_time[single - 1] + both.contact_time[single + 1]) / 2
    assert len(single) > 5
    np.testing.assert_allclose(both.contact_time[single], mean)
    assert both.rise_time is None  # no error could say which were measured


def test_what_no_sensor_of_a_stop_recorded_has_no_stop():
    cell = Impacts([1.0, 2.0], peak=[1.0, 1.0])
    microphone = Impacts([1.0, 1.5, 2.0], peak=[0.1, 0.1, 0.1], sensor="sound")
    both = combine_impacts([cell, microphone], stops=[0, None])
    assert both.impacts.stop_index.tolist() == [0, -1, 0]
    assert both.impacts.peak is None  # newtons and pascals do not mix
    assert both.index.tolist() == [[0, 0], [-1, 1], [1, 2]]


def test_a_gap_is_where_no_sensor_was():
    one = Impacts([1.0], gaps=[[2.0, 4.0], [6.0, 7.0]], start=0.0, duration=10.0)
    two = Impacts([1.0], gaps=[[3.0, 6.5]], start=0.0, duration=10.0)
    assert combine_impacts([one, two]).impacts.gaps.tolist() == [[3.0, 4.0], [6.0, 6.5]]


def test_where_no_sensor_of_a_stop_was_its_impacts_are_missed():
    """The other stop's are kept, but no interval between them is one of the machine."""
    time = np.arange(1.0, 9.0, 0.5)
    left = Impacts(time[::2], peak=np.ones(8), gaps=[[2.8, 5.1]], start=0.0, duration=10.0)
    left = replace(left[(left.time < 2.8) | (left.time > 5.1)], start=0.0, duration=10.0)
    right = Impacts(time[1::2], peak=np.ones(8), start=0.0, duration=10.0)
    both = combine_impacts([left, right], stops=[0, 1]).impacts
    assert both.gaps.tolist() == [[2.8, 5.1]]
    assert len(both) == len(time) - 3
    np.testing.assert_allclose(both.intervals(), 0.5)
    assert len(both.intervals()) == len(time) - 1 - 6
    assert both.time[both.in_gap()].tolist() == [3.5, 4.5]
    unknown = combine_impacts([left, right]).impacts
    assert not len(unknown.gaps)
    assert [note for note in unknown.notes if note.startswith("sensor 1 has gaps of 2.3 s")]
    microphone = Impacts(time, sensor="sound", start=0.0, duration=10.0)
    all_heard = combine_impacts([left, right, microphone], stops=[0, 1, None]).impacts
    assert not len(all_heard.gaps)
    assert not any("gaps" in note for note in all_heard.notes + both.notes)
    assert len(all_heard.intervals()) == len(time) - 1


def test_example():
    assert doctest.testmod(combination, extraglobs={"Impacts": Impacts}).failed == 0


def test_refusals():
    train = Impacts([1.0, 2.0])
    with pytest.raises(InvalidInput, match="trains"):
        combine_impacts([])
    with pytest.raises(InvalidInput, match=r"for each sensor \(1\)"):
        combine_impacts([train], stops=[0, 1])
    with pytest.raises(InvalidInput, match="has none"):
        combine_impacts([train], stops=[0])
    clock = Impacts(0.05 * np.arange(200))
    with pytest.raises(InvalidInput, match="trains are periodic"):
        combine_impacts([clock, clock], longest_delay=0.2)


@pytest.mark.parametrize("period", [0.0452, 0.02, 0.009])
@pytest.mark.parametrize("late", [0.0, 1.1e-3, -1.1e-3])
def test_of_delays_that_suit_alike_the_least_is_taken(period, late):
    """Two sensors of a periodic machine: delays that differ by a period pair as many."""
    rng = np.random.default_rng(4)
    one, two = 1 + period * np.arange(200) + 1e-6 * rng.normal(size=(2, 200))
    found = combine_impacts([Impacts(one), Impacts(two + late)])
    assert found.delays[1] == pytest.approx(late, abs=1e-6)
    assert len(found.impacts) == 200
    assert ["repeat themselves" in note for note in found.impacts.notes] == [True]


@pytest.mark.parametrize("jitter", [0.0, 0.0002, 0.01])
@pytest.mark.parametrize("late", [0.0292, 0.0015])
def test_a_microphone_ten_metres_away_from_a_nearly_periodic_machine(late, jitter):
    """What is one impact agrees better than what lies a period beside it."""
    rng = np.random.default_rng(5)
    gaps = 0.06 * (1 + jitter * rng.normal(size=200))
    cell = 1 + np.cumsum(gaps)
    sound = cell[rng.random(200) > 0.05] + late
    sound += 1e-5 * rng.normal(size=len(sound))
    found = combine_impacts([Impacts(cell), Impacts(sound, sensor="sound")])
    assert found.delays[1] == pytest.approx(late, abs=5e-6)
    assert len(found.impacts) == 200
    repeats = ["repeat themselves" in note for note in found.impacts.notes]
    assert repeats == [True] * (jitter == 0 and late > 0.01)  # 50 ms hold -31 ms as well


@pytest.mark.parametrize(("ppm", "count"), [(50, 300), (50, 1000), (200, 4000)])
def test_clocks_that_differ_are_told_and_their_alignment_combines(ppm, count):
    rng = np.random.default_rng(7)
    cell = np.cumsum(rng.uniform(0.03, 0.08, count))
    clock = 0.003 + (1 + 1e-6 * ppm) * cell + 1e-5 * rng.normal(size=count)
    trains = Impacts(cell), Impacts(clock, sensor="sound")
    (note,) = combine_impacts(trains).impacts.notes
    assert "align_impacts" in note
    aligned = align_impacts(trains[1], trains[0]).impacts
    found = combine_impacts([trains[0], aligned]).impacts
    assert len(found) == count
    assert found.notes == ()


def test_channels_of_one_recording():
    rng = np.random.default_rng(2)
    time = np.cumsum(rng.uniform(0.03, 0.08, 150))
    stop = rng.integers(0, 2, 150)
    truth = Impacts(time, start=0.0, duration=time[-1] + 0.1, peak=np.exp(rng.normal(0, 0.3, 150)))
    cells = [
        synthesize(
            replace(truth, peak=np.where(stop == own, 1.0, 0.15) * truth.peak),
            LoadCell(noise=0.005),
            seed=own,
        ).samples
        for own in (0, 1)
    ]
    record = Recording(
        np.column_stack(cells), 50_000.0, channels=("left", "right"), units=("N",) * 2
    )
    both = detect_impacts(record, channel=["left", "right"], stops=[0, 1])
    assert len(both) == 150
    np.testing.assert_allclose(both.time, time, atol=3e-5)
    np.testing.assert_array_equal(both.stop_index, stop)
    assert abs(both.settings["delay"]["right"]) < 2e-6
    assert both.settings["of_channel"]["left"]["sensor"] == "force"
    with pytest.raises(InvalidInput, match="stops"):
        detect_impacts(record, channel="left", stops=[0])
    with pytest.raises(InvalidInput, match="each of 2 channels"):
        detect_impacts(record, channel=["left", "right"], sensor=["force"])


def test_a_sensor_without_errors_leaves_those_of_the_other():
    rng = np.random.default_rng(4)
    truth = np.cumsum(rng.uniform(0.02, 0.08, 300))
    cell = heard(truth, rng, jitter=5e-6)
    sound = replace(heard(truth, rng, late=0.0029, jitter=1e-4), time_error=None)
    for trains, place in (([cell, sound], 0), ([sound, cell], 1)):
        both = combine_impacts(trains)
        felt = both.index[:, place] >= 0
        own = cell.time[both.index[felt, place]] - both.delays[place]
        np.testing.assert_allclose(both.impacts.time[felt], own, atol=1e-12)
        np.testing.assert_allclose(both.impacts.time_error[felt], 5e-6)
        assert np.all(np.isinf(both.impacts.time_error[~felt]))
        assert 5 < np.count_nonzero(~felt) < 60


def test_a_clipped_sensor_is_said_and_leaves_the_stop_in_doubt():
    left = Impacts.from_times([1.0, 1.7, 2.0], peak=[3.0, 0.2, 3.1])
    right = replace(
        Impacts.from_times([1.0, 1.7, 2.5], peak=[1.0, 1.0, 0.4]),
        flags=np.array([CLIPPED, CLIPPED, 0], np.uint8),
    )
    both = combine_impacts([left, right], stops=[0, 1])
    assert both.impacts.stop_index.tolist() == [0, 1, 0, 1]
    # The first is stronger at the left as far as one can tell.
    assert (both.impacts.flags & CLIPPED).tolist() == [CLIPPED, CLIPPED, 0, 0]
    (note,) = both.impacts.notes
    assert note.startswith("sensor 2 is clipped in 2 of its 3 impacts")
    # Two ranges of one sensor: the peak of the one that is not clipped holds.
    ranges = combine_impacts([left, right])
    assert (ranges.impacts.flags & CLIPPED).tolist() == [0, CLIPPED, 0, 0]
    assert ranges.impacts.notes == both.impacts.notes
    assert combine_impacts([right]).impacts.notes == ()


def test_load_cells_of_different_units_are_combined_without_peaks():
    """Once an IndexError: no sensor's peaks are kept, so that there was no level of contacts."""
    truth = np.cumsum(np.random.default_rng(3).uniform(0.02, 0.08, 50))
    cells = [
        Impacts(
            truth, peak=np.ones(50), contact_time=np.full(50, 3e-4), contact_level=0.0,
            unit=unit, sensor="force",
        )
        for unit in ("N", "V")
    ]  # fmt: skip
    both = combine_impacts(cells).impacts
    assert len(both) == 50
    assert both.peak is None
    assert (both.unit, both.contact_level) == ("", 0.0)
    np.testing.assert_array_equal(both.contact_time, 3e-4)
    assert [note for note in both.notes if "different units ('N', 'V')" in note]


@pytest.mark.parametrize("late", [-2.1e-3, 0.0147, 0.9])
@pytest.mark.parametrize("stops", [None, [0, 1]])
def test_a_load_cell_that_starts_late(late, stops):
    """Filters of two modules at 2 kS/s are 20 ms apart: each impact was once there twice."""
    rng = np.random.default_rng(15)
    truth = np.cumsum(rng.uniform(0.03, 0.08, 200))
    cells = []
    for delay in (0.0, late):
        seen = rng.random(200) > 0.05
        time = truth[seen] + delay + 1e-5 * rng.standard_normal(np.count_nonzero(seen))
        cells.append(Impacts(time, peak=np.ones(len(time)), unit="N", sensor="force"))
    both = combine_impacts(cells, stops=stops)
    assert both.delays[1] == pytest.approx(late, abs=5e-6)
    assert len(both.impacts) <= 200
    assert [note for note in both.impacts.notes if "start so late" in note]


@pytest.mark.parametrize("spread", [1e-4, 3e-4])
def test_stops_that_an_irregular_machine_hits_in_turn(spread):
    """From stop to stop takes nearly as long each time, as for a delay, and less than `within`."""
    rng = np.random.default_rng(10)
    flights = np.abs(rng.normal([0.0182, 0.0794], [spread, 0.002], (120, 2)))
    time = np.cumsum(flights)
    cells = [
        Impacts(one, peak=np.ones(120), unit="N", sensor="force") for one in (time[::2], time[1::2])
    ]
    assert len(combine_impacts(cells).impacts) == 240


@pytest.mark.parametrize("seed", range(6))
def test_what_impacts_of_a_second_share_is_no_drift(seed):
    rng = np.random.default_rng(seed)
    truth = np.cumsum(rng.uniform(0.03, 0.08, 300))
    shared = 2e-6 * rng.standard_normal(30)[truth.astype(int)]
    trains = [Impacts(truth, sensor="force"), Impacts(truth + shared, sensor="force")]
    assert combine_impacts(trains).impacts.notes == ()
