"""Impacts: validation, intervals, selection, bursts, tables."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace
from datetime import datetime

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from impactsig import Impacts, InvalidInput, UnreadableFile, UnwritableFile
from impactsig.impacts import CLIPPED, OPEN_END, flag_names


def five(**known):
    return Impacts(
        [1.0, 2.0, 4.0, 7.0, 11.0],
        contact_time=[0.1, 0.2, 0.3, 0.4, 0.5],
        start=0.0,
        duration=15.0,
        unit="N",
        **known,
    )


def test_intervals_and_gaps():
    np.testing.assert_array_equal(five().intervals(), [1, 2, 3, 4])
    gapped = five(gaps=[[2.5, 3.0], [7.0, 8.0]])
    np.testing.assert_array_equal(gapped.intervals(), [1, 3])
    inside = five(gaps=[[5.0, 7.0], [1.5, 4.5]])
    assert inside.interval_spans_gap().tolist() == [True, True, True, False]
    assert inside.in_gap().tolist() == [False, True, True, False, False]
    assert Impacts([]).intervals().shape == Impacts([3.0]).intervals().shape == (0,)


def test_time_in_contact():
    assert five().time_in_contact() == pytest.approx(0.1)
    assert five(gaps=[[2.5, 7.5]]).time_in_contact() == pytest.approx(0.08)  # two are in it
    with pytest.raises(InvalidInput, match="contact_time"):
        Impacts([1.0]).time_in_contact()


def test_bursts():
    train = Impacts.from_times([0.0, 0.1, 0.2, 5.0, 9.0, 9.1])
    first, size = train.bursts(0.5)
    assert first.tolist() == [0, 3, 4]
    assert size.tolist() == [3, 1, 2]
    assert [len(part) for part in Impacts([]).bursts(1.0)] == [0, 0]
    with pytest.raises(InvalidInput):
        train.bursts(0)


def test_selection_keeps_the_run():
    chosen = five()[np.array([True, False, True, False, False])]
    assert chosen.time.tolist() == [1.0, 4.0]
    assert chosen.contact_time.tolist() == [0.1, 0.3]
    assert (chosen.duration, chosen.unit) == (15.0, "N")
    assert five()[-1].time.tolist() == [11.0]
    assert len(five()[:0]) == 0


def test_between_makes_a_new_run():
    part = five(gaps=[[2.5, 3.0], [12, 13]]).between(2.0, 7.0)
    assert part.time.tolist() == [2.0, 4.0]
    assert (part.start, part.stop) == (2.0, 7.0)
    assert part.gaps.tolist() == [[2.5, 3.0]]
    assert five().between(stop=1.5).time.tolist() == [1.0]
    with pytest.raises(InvalidInput):
        five().between(20.0)


def test_from_times_sorts_with_what_belongs_to_them():
    train = Impacts.from_times([3.0, 1.0], peak=[30.0, 10.0], flags=[4, 0])
    assert train.time.tolist() == [1.0, 3.0]
    assert train.peak.tolist() == [10.0, 30.0]
    assert train.flags.tolist() == [0, 4]
    assert (train.start, train.duration) == (1.0, 2.0)


def test_flags_are_copied_and_as_many_as_the_impacts():
    flags = np.array([4, 0], np.uint8)
    train = Impacts([1.0, 3.0], flags=flags)
    flags[:] = 1
    assert train.flags.tolist() == [4, 0]
    with pytest.raises(InvalidInput, match="flags"):
        Impacts([1.0, 3.0, 4.0], flags=flags)


@pytest.mark.parametrize(
    ("argument", "known"),
    [
        ("time", {"time": [2.0, 1.0]}),
        ("time", {"time": [1.0, np.nan]}),
        ("time", {"time": [[1.0]]}),
        ("time", {"time": ["a"]}),
        ("time", {"time": [-1.0]}),
        ("time", {"time": [99.0]}),
        ("peak", {"peak": [1.0, 2.0]}),
        ("peak", {"peak": [np.inf]}),
        ("flags", {"flags": [1, 2]}),
        ("gaps", {"gaps": [1.0, 2.0, 3.0]}),
        ("gaps", {"gaps": [[2.0, 1.0]]}),
        ("gaps", {"gaps": [[np.nan, 1.0]]}),
        ("gaps", {"gaps": "none"}),
        ("duration", {"duration": -1.0}),
    ],
)
def test_bad_arguments_are_named(argument, known):
    with pytest.raises(InvalidInput) as caught:
        Impacts(**{"time": [1.0], "start": 0.0, "duration": 5.0, **known})
    assert caught.value.argument == argument


def test_arrays_cannot_be_changed_in_place():
    with pytest.raises(ValueError, match="read-only"):
        five().time[0] = 0.0


def equal(a, b):
    for name in Impacts.__dataclass_fields__:
        x, y = getattr(a, name), getattr(b, name)
        if isinstance(x, np.ndarray):
            np.testing.assert_array_equal(x, y, err_msg=name)
            assert x.dtype == y.dtype
        else:
            assert x == y, name


finite = st.floats(-1e300, 1e300, allow_nan=False)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(st.floats(0, 1e9), finite, st.integers(0, 15)), max_size=20),
    st.text(max_size=20),
    st.sampled_from(["csv", "parquet"]),
)
def test_tables_come_back_without_loss(tmp_path_factory, rows, text, kind):
    path = tmp_path_factory.mktemp("tables") / f"impacts.{kind}"
    rows.sort()
    train = Impacts(
        [row[0] for row in rows],
        peak=[row[1] for row in rows],
        flags=[row[2] for row in rows],
        start=0.0,
        duration=1e9,
        unit=text,
        source=text,
        gaps=[[0.1, 0.30000000000000004]],
        threshold=1 / 3,
        settings={"channel": text},
        recorded_at=datetime(2024, 1, 2, 3, 4, 5, 6),
    )
    getattr(train, f"to_{kind}")(path)
    equal(train, getattr(Impacts, f"read_{kind}")(path))


def test_any_table_of_times_can_be_read(tmp_path):
    path = tmp_path / "times.csv"
    path.write_text("time,peak,remark\n1.5,2,a\n2.5,3,b\n")
    assert Impacts.read_csv(path).peak.tolist() == [2.0, 3.0]


@pytest.mark.parametrize(
    "text", ["", "a,b\n1,2\n", "time\nsoon\n", "# impactsig {broken\ntime\n1\n"]
)
def test_what_is_no_table_of_impacts_is_refused(tmp_path, text):
    path = tmp_path / "x.csv"
    path.write_text(text)
    with pytest.raises(UnreadableFile, match=r"x\.csv"):
        Impacts.read_csv(path)
    path.with_suffix(".parquet").write_text(text)
    with pytest.raises(UnreadableFile):
        Impacts.read_parquet(path.with_suffix(".parquet"))
    with pytest.raises(UnreadableFile):
        Impacts.read_csv(tmp_path / "absent.csv")


def test_nothing_is_left_where_writing_fails(tmp_path):
    with pytest.raises(UnwritableFile, match="cannot be written"):
        five().to_csv(tmp_path / "absent" / "x.csv")
    with pytest.raises(UnwritableFile):
        five().to_csv(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_repr_says_what_there_is():
    assert "5 impacts in 15 s" in repr(five())
    assert repr(Impacts([], reason="too quiet")) == "Impacts(0 impacts in 0 s; too quiet)"
    assert "<td>" in five()._repr_html_()
    assert flag_names(CLIPPED | OPEN_END) == "open end, clipped"


@pytest.mark.parametrize(
    "time", [np.array(["2020-01-01", "2020-01-02"], "M8[s]"), [1 + 1j, 2 + 1j]]
)
def test_dates_and_complex_numbers_are_no_times(time):
    with pytest.raises(InvalidInput, match="real numbers"):
        Impacts.from_times(time)


@pytest.mark.parametrize("span", [{"duration": "x"}, {"start": "x"}, {"start": np.nan}])
def test_a_span_that_is_no_number_is_refused(span):
    with pytest.raises(InvalidInput, match=next(iter(span))):
        Impacts([1.0, 2.0], **span)


def test_repr_takes_no_interval_across_a_gap():
    assert "median interval 1 s" in repr(Impacts([0.0, 1.0, 9.0, 10.0], gaps=[[2.0, 8.0]]))
    assert "interval" not in repr(Impacts([0.0, 9.0], gaps=[[2.0, 8.0]]))
    assert "(1 impact in" in repr(Impacts([1.0]))


def test_a_foreign_note_in_a_parquet_file_is_told(tmp_path):
    arrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    table = arrow.table({"time": [1.0]}).replace_schema_metadata({b"impactsig": b"{"})
    parquet.write_table(table, tmp_path / "x.parquet")
    with pytest.raises(UnreadableFile, match="Parquet"):
        Impacts.read_parquet(tmp_path / "x.parquet")


def test_impacts_go_to_other_processes_whole():
    impacts = Impacts.from_times(
        [1.0, 2.0], start=0.5, duration=3.0, peak=[1, 2], unit="N", settings={"threshold": 1}
    )
    for again in (pickle.loads(pickle.dumps(impacts)), copy.deepcopy(impacts)):
        assert again.to_frame().equals(impacts.to_frame())
        for name in ("start", "duration", "unit", "settings"):
            assert getattr(again, name) == getattr(impacts, name)
        assert not again.time.flags.writeable


def test_the_covariance_of_intervals():
    error = np.array([0.1, 0.2, 0.3, 0.4, 0.5])
    intervals, covariance = five(time_error=error).intervals(errors=True)
    np.testing.assert_array_equal(intervals, five().intervals())
    difference = np.diff(np.eye(5), axis=0)  # intervals = difference @ instants
    expected = difference @ np.diag(error**2) @ difference.T
    np.testing.assert_allclose(covariance.toarray(), expected, atol=1e-17)
    # The interval across a gap is left out, and what its neighbours shared with it.
    gapped, covariance = five(time_error=error, gaps=[[2.5, 3.0]]).intervals(errors=True)
    difference = difference[[0, 2, 3]]
    np.testing.assert_array_equal(gapped, [1, 3, 4])
    expected = difference @ np.diag(error**2) @ difference.T
    np.testing.assert_allclose(covariance.toarray(), expected, atol=1e-17)
    for few in (Impacts([]), Impacts([1.0])):
        intervals, covariance = replace(few, time_error=np.zeros(len(few))).intervals(errors=True)
        assert (len(intervals), covariance.shape) == (0, (0, 0))
    with pytest.raises(InvalidInput, match="time_error"):
        five().intervals(errors=True)


def test_intervals_are_free_of_the_error_that_a_second_shares():
    rng = np.random.default_rng(4)
    time = np.cumsum(rng.choice([0.05, 0.2, 0.45, 0.8, 1.4], 40))
    own, shared = rng.uniform(1e-6, 3e-6, 40), np.full(40, 5e-6)
    train = Impacts(time, time_error=np.hypot(own, shared), shared_time_error=shared)
    # Seconds that begin anywhere: two instants are in one with a chance that falls to 0 at 1 s.
    together = np.maximum(1.0 - np.abs(time[:, None] - time), 0.0)
    difference = np.diff(np.eye(40), axis=0)
    expected = np.diag(own**2) + together * 25e-12
    expected = difference @ expected @ difference.T
    found = train.intervals(errors=True)[1].toarray()
    near = np.abs(np.subtract.outer(np.arange(39), np.arange(39))) < 2
    np.testing.assert_allclose(found[near], expected[near], rtol=1e-9)
    assert not found[~near].any()
    # Three in a second: nothing but their own.
    close = Impacts([0.0, 0.1, 0.2], time_error=[3e-6] * 3, shared_time_error=[2e-6] * 3)
    found = close.intervals(errors=True)[1].toarray()
    np.testing.assert_allclose(found[0, 1], -5e-12)
    np.testing.assert_allclose(np.diag(found), 10e-12 + 2 * 4e-12 * 0.1)


@given(st.integers(0, 2**32 - 1), st.integers(2, 30))
def test_the_covariance_of_intervals_is_one(seed, count):
    rng = np.random.default_rng(seed)
    time = np.cumsum(10 ** rng.uniform(-3, 1, count))
    shared = 10 ** rng.uniform(-8, -4, count)
    error = shared + rng.choice([0.0, 1e-9, 1e-5], count)
    train = Impacts(time, time_error=error, shared_time_error=shared)
    covariance = train.intervals(errors=True)[1].toarray()
    scale = 1e9 * np.sqrt(np.abs(np.diag(covariance)) + 1e-30)
    assert np.linalg.eigvalsh(covariance * 1e18 / np.outer(scale, scale)).min() > -1e-9


@pytest.mark.parametrize("error", [None, [2e-6, 1e-6]])
@pytest.mark.parametrize("what", ["time", "peak"])
def test_no_more_of_an_error_is_shared_than_there_is(what, error):
    columns = {f"{what}_error": error, f"shared_{what}_error": [1.5e-6, 1.5e-6]}
    with pytest.raises(InvalidInput, match=f"shared_{what}_error.*at most {what}_error"):
        Impacts([1.0, 2.0], **columns)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("time_error", [0.1, -0.1], "-0.1 at index 1"),
        ("shared_time_error", [0.1, -0.1], "-0.1 at index 1"),
        ("peak_error", [0.1, np.nan], "nan at index 1"),
        ("probability", [0.5, 1.1], "1.1 at index 1"),
        ("stop_index", [0, 0.5], "0.5 at index 1"),
        ("pulses", [0, 1], "0.0 at index 0"),
        ("stop_index", [0, -2], "-2.0 at index 1"),
        ("stop_probability", [0.5, 1.2], "1.2 at index 1"),
    ],
)
def test_what_is_known_of_impacts_must_make_sense(name, value, words):
    with pytest.raises(InvalidInput, match=words):
        Impacts([1.0, 2.0], **{name: value})


def test_whole_numbers_stay_whole_and_errors_may_be_infinite(tmp_path):
    train = Impacts([1.0, 2.0], stop_index=[1.0, 0.0], time_error=[1e-6, np.inf])
    assert np.array(["lower", "upper"])[train.stop_index].tolist() == ["upper", "lower"]
    train.to_csv(tmp_path / "train.csv")
    again = Impacts.read_csv(tmp_path / "train.csv")
    np.testing.assert_array_equal(again.time_error, train.time_error)
    assert again.stop_index.tolist() == [1, 0]
