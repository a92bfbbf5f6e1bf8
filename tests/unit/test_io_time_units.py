"""Axes and steps in other units than seconds, in every format: rate [Hz] and first time [s]."""

import warnings

import numpy as np
import pytest

import impactsig.io as io
from impactsig.errors import InvalidInput
from impactsig.io.times.timebase import rate_of_step, time_base

from .test_io_lvm import header as lvm_header
from .test_io_lvm import segment as lvm_segment
from .test_io_uff import as_text, packed
from .test_io_uff import text as uff_text

UNITS = {
    "s": 1.0,
    "ms": 1e-3,
    "us": 1e-6,
    "µs": 1e-6,
    "μs": 1e-6,
    "ns": 1e-9,
    "min": 60.0,
    "h": 3600.0,
    "milliseconds": 1e-3,
    "microseconds": 1e-6,
    "Sekunden": 1.0,
}
COUNT = 40
X = np.arange(COUNT, dtype=np.float32)


def axis(unit):
    """Times of which the first is 6 steps after 0, and the rate of those times in seconds [Hz]."""
    step = 0.25 * UNITS[unit]
    return 0.25 * np.arange(6, 6 + COUNT), 1 / step


def text(folder, times, unit):
    rows = [f"{t},{x}" for t, x in zip(times, X, strict=True)]
    path = folder / "a.csv"
    path.write_text("\n".join([f"time [{unit}],a", *rows]) + "\n", encoding="utf-8")
    return path


def lvm(folder, times, unit):
    rows = [f"\t{t}\t{x}" for t, x in zip(times, X, strict=True)]
    path = folder / "a.lvm"
    segment = lvm_segment(rows, ["time", "F"], delta="0")
    segment = segment.replace("Y_Unit_Label\tN", f"Y_Unit_Label\t{unit}")
    path.write_text(lvm_header() + segment, encoding="utf-8")
    return path


def tdms(folder, channels, **properties):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(str(folder / "a.tdms")) as file:
        file.write_segment([nptdms.ChannelObject("g", *one, properties) for one in channels])
    return folder / "a.tdms"


def tdms_waveform(folder, times, unit):
    return tdms(
        folder,
        [("a", X)],
        wf_increment=times[1] - times[0],
        wf_start_offset=times[0],
        wf_xunit_string=unit,
    )


def tdms_channel(folder, times, unit):
    return tdms(folder, [("time", times), ("a", X)], unit_string=unit)


def uff(folder, content):
    (folder / "a.uff").write_bytes(content)
    return folder / "a.uff"


def uff_step(folder, times, unit):
    numbers = dict(count=COUNT, step=times[1] - times[0], axis=(17, "Time", unit))
    head = uff_text(as_text(X), **numbers)
    # The first time stands in the columns after the spacing.
    return uff(folder, head.replace(f"{2.0:13.5E}".encode(), f"{times[0]:13.5E}".encode(), 1))


def uff_text_times(folder, times, unit):
    pairs = as_text(np.column_stack([times, X]).ravel())
    return uff(folder, uff_text(pairs, count=COUNT, even=0, step=0, axis=(17, "t", unit)))


def uff_packed_times(folder, times, unit):
    rows = np.zeros(COUNT, [("t", "f4"), ("x", "f4")])
    rows["t"], rows["x"] = times, X
    options = dict(count=COUNT, even=0, step=0, axis=(0, "Time", unit))
    return uff(folder, packed(rows.tobytes(), **options))


def hdf5(folder, times, unit):
    h5py = pytest.importorskip("h5py")
    with h5py.File(folder / "a.h5", "w") as file:
        file["time"], file["a"] = times, X
        file["time"].attrs["unit"] = unit
    return folder / "a.h5"


def npz(folder, times, unit):
    np.savez(folder / "a.npz", **{f"t [{unit}]": times, "a": X})
    return folder / "a.npz"


def matlab(folder, times, unit):
    from scipy.io import savemat

    savemat(folder / "a.mat", {"t": {"time": times, "unit": unit, "a": X}})
    return folder / "a.mat"


def parquet(folder, times, unit):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    field = pyarrow.field("time", pyarrow.float64(), metadata={"unit": unit})
    schema = pyarrow.schema([field, pyarrow.field("a", pyarrow.float32())])
    parquet.write_table(pyarrow.table([times, X], schema=schema), folder / "a.parquet")
    return folder / "a.parquet"


WRITERS = [
    text,
    lvm,
    tdms_waveform,
    tdms_channel,
    uff_step,
    uff_text_times,
    uff_packed_times,
    hdf5,
    npz,
    matlab,
    parquet,
]


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("write", WRITERS)
def test_an_axis_in_any_unit_of_time(tmp_path, write, unit):
    times, rate = axis(unit)
    rec = io.read(write(tmp_path, times, unit))
    assert rec.rate == pytest.approx(rate, rel=1e-12)
    assert rec.start == pytest.approx(6 / rate, rel=1e-12)
    np.testing.assert_array_equal(rec.samples, X)


@pytest.mark.parametrize("write", [text, lvm, tdms_channel, uff_text_times, uff_packed_times, npz])
def test_digits_are_in_the_unit_of_the_axis(tmp_path, write):
    times, _ = axis("ns")
    times[20] += 0.1  # 40 % of a step: more than the last digit
    path = write(tmp_path, times, "ns")
    with (
        warnings.catch_warnings(action="ignore"),
        pytest.raises(InvalidInput, match=r"not uniform|Delta_X of '0'|step is given as 0"),
    ):
        io.read(path, None if write is not lvm else "F")


def test_a_printed_step_singles_out_a_whole_rate_in_hertz(tmp_path):
    # 1024 Hz: 0.9765625 ms, printed with six digits; 1.024 samples a millisecond are not whole.
    options = dict(count=COUNT, step=0.976562, axis=(17, "Time", "ms"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # the digits leave no doubt
        assert io.read(uff(tmp_path, uff_text(as_text(X), **options))).rate == 1024.0


def test_a_step_is_that_of_a_whole_rate_only_within_rounding():
    rates = [*range(1, 2000), 44_100, 48_000, 50_000, 51_200, 65_536, 102_400, 1_000_000]
    for rate in rates:
        step = 1 / rate
        for near in (step, np.nextafter(step, 0), np.nextafter(step, 1)):
            assert rate_of_step(near) == rate
        far = step * (1 + 16 * np.finfo(float).eps)
        assert rate_of_step(far) == 1 / far != rate


def test_how_far_the_rate_of_a_column_of_times_is_known():
    # 11 times over 3 s: the rate of 10 / 3 Hz moves by what both ends may be off, each by half
    # a digit, in proportion to the 3 s; or by how far the times are seen to lie off the grid.
    times = 0.3 * np.arange(11)
    assert "between 3.33222 and 3.33444 Hz" in time_base(times, 1e-3).doubt
    times[4] += 0.002
    assert "between 3.32889 and 3.33778 Hz" in time_base(times).doubt
