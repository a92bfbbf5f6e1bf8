"""A study in a directory: what is there after a stop, and when it is refused."""

from __future__ import annotations

import functools
import json
import os
import resource
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from impactsig import (
    ImpactsigWarning,
    InvalidInput,
    MissingExtra,
    UnreadableFile,
    UnwritableFile,
    open_study,
    sweep,
)
from impactsig.studies import fingerprint as _fingerprint
from impactsig.studies.fingerprint import code_of
from tests.cells import contents, logged, poisoned, same, waves

pytest.importorskip("zarr")
AXES = {"b": np.linspace(0.1, 0.9, 7), "a": np.arange(4)}


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "study"


def interrupted(after):
    """`waves`, stopped by Ctrl-C at the cell after so many."""
    count = 0

    def until(a, b):
        nonlocal count
        count += 1
        if count > after:
            raise KeyboardInterrupt
        return waves(a, b)

    return until


def test_a_study_is_read_back_as_it_was(folder):
    told = {"a": {"units": "Hz"}, "sine": {"long_name": "a sine"}}
    study = sweep(waves, AXES, directory=folder, tile=4, attributes=told)
    assert same(study, sweep(waves, AXES))
    again = open_study(folder)
    assert same(again, study)
    assert again.complete
    assert list(again.parameters) == ["b", "a"]
    assert again.parameters["b"].tobytes() == AXES["b"].tobytes()
    assert again.parameters["a"].dtype == AXES["a"].dtype
    assert again.attributes["a"] == {"units": "Hz"}
    assert again.attributes["sine"] == {"long_name": "a sine"}
    assert again.directory == folder


def test_others_can_read_the_results(folder):
    xarray = pytest.importorskip("xarray")
    study = sweep(waves, AXES, directory=folder, attributes={"a": {"units": "Hz"}})
    data = xarray.open_zarr(folder / "results.zarr", consolidated=False)
    xarray.testing.assert_identical(data.compute(), study.to_xarray())


def test_a_chunk_is_a_tile(folder):
    import zarr

    sweep(waves, AXES, directory=folder, tile=4)
    group = zarr.open_group(folder / "results.zarr", mode="r")
    assert group.metadata.zarr_format == 3
    assert group["sine"].chunks == (1, 4)
    assert group["powers"].chunks == (1, 4, 3)
    assert group["sine"].metadata.dimension_names == ("b", "a")
    assert len(list((folder / "done").iterdir())) == 7


def test_errors_are_kept(folder):
    axes = {"a": range(3), "b": range(5)}
    for _ in range(2):
        with pytest.warns(ImpactsigWarning, match="1 of 15 cells failed"):
            study = sweep(poisoned, axes, directory=folder, tile=2)
        assert study.errors == {(1, 3): "ValueError: no solution here"}
    assert same(open_study(folder), study)


def test_cells_that_all_fail_are_not_tried_again(folder, tmp_path):
    def never(a):
        with (tmp_path / "log").open("a") as log:
            log.write("tried\n")
        raise OSError("never")

    for _ in range(2):
        with pytest.warns(ImpactsigWarning, match="6 of 6 cells failed"):
            study = sweep(never, {"a": range(6)}, directory=folder, tile=2)
        assert study.observables == ()
    assert len((tmp_path / "log").read_text().splitlines()) == 6


# -- stopped, and gone on with ---------------------------------------------------------------------


@pytest.mark.parametrize("after", [0, 1, 3, 4, 9, 27])
def test_ctrl_c_leaves_a_valid_store(after, folder):
    function = interrupted(after)
    with pytest.raises(KeyboardInterrupt):
        sweep(function, AXES, directory=folder, tile=4)
    part = open_study(folder)
    assert part.done.sum() == after // 4 * 4
    if part.observables:
        whole = sweep(waves, AXES)["sine"]
        np.testing.assert_array_equal(part["sine"], np.where(part.done, whole, np.nan))
    assert ("still to do" in repr(part)) is not part.complete


def test_what_is_done_is_not_done_again(folder, tmp_path):
    function = logged(tmp_path)
    whole = sweep(function, AXES, directory=folder, tile=4)
    (tmp_path / "log").unlink()
    for tile in (2, 5):
        (folder / "done" / f"{tile}.json").unlink()
    assert open_study(folder).done.sum() == 20
    again = sweep(function, AXES, directory=folder)
    assert same(again, whole)
    assert len((tmp_path / "log").read_text().splitlines()) == 8
    (tmp_path / "log").unlink()
    assert same(sweep(function, AXES, directory=folder), whole)
    assert not (tmp_path / "log").exists()


def test_tiles_are_kept_while_the_first_is_under_way(folder):
    """What cells give is known from the trial."""
    kept = []

    def patient(a):
        if a == 0 and (folder / "study.json").exists():  # the trial is over
            until = time.monotonic() + 10
            while not kept and time.monotonic() < until:
                kept.extend((folder / "done").glob("[1-9]*.json"))
        return a

    study = sweep(patient, {"a": range(40)}, directory=folder, executor="threads", workers=2)
    assert kept
    assert study["value"].tolist() == list(range(40))


def test_another_executor_goes_on(folder):
    pytest.importorskip("cloudpickle")
    whole = sweep(waves, AXES, directory=folder, tile=4)
    before = contents(folder)
    for tile in (0, 3):
        (folder / "done" / f"{tile}.json").unlink()
    (folder / "results.zarr" / "sine" / "c" / "0" / "0").unlink()
    again = sweep(waves, AXES, directory=folder, executor="processes", workers=2)
    assert same(again, whole)
    assert contents(folder) == before


@pytest.mark.parametrize("damage", ["cut", "flip", "empty", "gone", "other"])
def test_a_chunk_that_is_not_whole_is_never_read(damage, folder):
    """Nor a record: their cells are missing, and worked out again."""
    whole = sweep(waves, AXES, directory=folder, tile=4)
    values = whole["sine"]
    before = contents(folder)
    chunk = folder / "results.zarr" / "sine" / "c" / "2" / "0"
    text = chunk.read_bytes()
    spoilt = {"cut": text[:-3], "flip": text[:-9] + bytes([text[-9] ^ 1]) + text[-8:], "empty": b""}
    if damage == "gone":
        chunk.unlink()
    elif damage == "other":
        chunk.write_bytes(chunk.parents[1].joinpath("3", "0").read_bytes())
    else:
        chunk.write_bytes(spoilt[damage])
    (folder / "done" / "5.json").write_text('{"tile": 5, "chec')
    with pytest.raises(UnreadableFile, match="tile 2 of sine was damaged"):
        whole["sine"]
    part = open_study(folder)
    assert part.done[:, 0].tolist() == [True, True, False, True, True, False, True]
    np.testing.assert_array_equal(part["sine"], np.where(part.done, values, np.nan))
    assert same(sweep(waves, AXES, directory=folder), open_study(folder))
    assert contents(folder) == before


@pytest.mark.parametrize("damage", ["cut", "flip", "gone", "no array", "no description"])
def test_a_damaged_axis_is_written_again(damage, folder):
    """Of a finished study, too; nothing is worked out again."""
    xarray = pytest.importorskip("xarray")
    whole = sweep(waves, AXES, directory=folder, tile=4, attributes={"b": {"units": "Hz"}})
    before = contents(folder)
    axis = folder / "results.zarr" / "b"
    chunk = axis / "c" / "0"
    content = chunk.read_bytes()
    if damage == "cut":
        chunk.write_bytes(content[:-3])
    elif damage == "flip":
        chunk.write_bytes(content[:-9] + bytes([content[-9] ^ 1]) + content[-8:])
    elif damage == "gone":
        chunk.unlink()
    elif damage == "no array":
        shutil.rmtree(axis)
    else:
        (axis / "zarr.json").write_text("{")
    study = sweep(waves, AXES, directory=folder, attributes={"b": {"units": "Hz"}})
    assert same(study, whole)
    assert contents(folder) == before
    data = xarray.open_zarr(folder / "results.zarr", consolidated=False)
    assert data["b"].values.tobytes() == AXES["b"].tobytes()


def test_a_tile_of_nothing_but_missing_values_is_done(folder):
    """Of results that are all NaN, or all a value that stands for nothing, there is a chunk too."""

    def often_none(a):
        return {"none": np.nan if a < 6 else a, "zero": 0, "no": False}

    axes = {"a": range(8)}
    study = sweep(often_none, axes, directory=folder, tile=2)
    assert same(study, sweep(often_none, axes))
    assert open_study(folder).done.all()
    assert len(list((folder / "results.zarr").glob("*/c/*"))) == 3 * 4 + 1


def test_files_that_a_kill_left_half_written_are_removed(folder):
    sweep(waves, AXES, directory=folder, tile=4)
    before = contents(folder)
    (folder / "done" / "3.json").unlink()
    (folder / "done" / ".3.json.x1y2").write_text("{")
    (folder / ".study.json.abcd").write_text("{")
    (folder / "results.zarr" / "sine" / "c" / "1" / "0.abc.partial").write_text("x")
    sweep(waves, AXES, directory=folder)
    assert contents(folder) == before


# -- a full disk, and directories that cannot be ---------------------------------------------------


def test_a_disk_that_fills_up(folder):
    """The system itself ends a write in its midst, as it does where the disk is full."""

    def large(a):
        return np.random.default_rng(a).random(4000) if a % 3 == 2 else np.zeros(4000)

    axes = {"a": range(6)}
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8192, limits[1]))
    try:
        with pytest.raises(UnwritableFile, match="What is done is kept"):
            sweep(large, axes, directory=folder, tile=1)
        part = open_study(folder)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert part.done.tolist() == [True, True, False, False, False, False]
    assert (part["value"][:2] == 0).all()
    assert np.isnan(part["value"][2:]).all()
    assert same(sweep(large, axes, directory=folder), sweep(large, axes))


def test_a_record_that_cannot_be_written(folder, monkeypatch):
    from impactsig.studies import _store

    dump = _store._dump

    def full(path, content):
        if path.name == "3.json":
            raise UnwritableFile(path, "cannot be written (No space left on device)")
        dump(path, content)

    monkeypatch.setattr(_store, "_dump", full)
    with pytest.raises(UnwritableFile, match="No space left"):
        sweep(waves, AXES, directory=folder, tile=4)
    assert open_study(folder).done.sum() == 12


def test_a_directory_that_cannot_be_made(tmp_path):
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "file", tmp_path / "file" / "study", "/proc/study"):
        with pytest.raises(UnwritableFile):
            sweep(waves, AXES, directory=path)


def test_a_directory_of_something_else(tmp_path):
    (tmp_path / "thesis.tex").write_text("")
    with pytest.raises(InvalidInput, match=r"^directory: got .* a new or empty directory"):
        sweep(waves, AXES, directory=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '{"format": 99}'])
def test_a_description_that_is_none(text, folder):
    folder.mkdir()
    with pytest.raises(UnreadableFile, match="holds no study"):
        open_study(folder)
    (folder / "study.json").write_text(text)
    for call in (open_study, lambda path: sweep(waves, AXES, directory=path)):
        with pytest.raises(UnreadableFile, match="describes no study"):
            call(folder)


def test_a_store_of_another_format(folder):
    sweep(waves, AXES, directory=folder)
    stored = json.loads((folder / "study.json").read_text())
    (folder / "study.json").write_text(json.dumps(stored | {"format": 99}))
    with pytest.raises(UnreadableFile, match="another version of impactsig"):
        open_study(folder)


@pytest.mark.parametrize("old", [None, type("zarr", (), {"__version__": "2.18.1"})])
def test_without_zarr_the_extra_is_named(old, folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "zarr", old)
    with pytest.raises(MissingExtra, match=r"needs zarr.* install \"impactsig\[studies\]\""):
        sweep(waves, AXES, directory=folder)


def test_in_memory_none_of_the_extras_is_loaded():
    probe = (
        "import sys, impactsig; impactsig.sweep(lambda a: a, {'a': [1, 2]}); "
        "print(*[m for m in ('zarr', 'xarray', 'dask', 'distributed', 'tqdm') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", probe], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == ""


# -- another study ---------------------------------------------------------------------------------

GAIN = 2


def helper(a):
    return GAIN * a


def cell(a, b):
    """One cell."""
    return helper(a) + b


def renamed(a, b):
    return helper(a) + b


class Scaled:
    def __init__(self, by):
        self.by = by

    def __call__(self, a, b):
        return self.by * a + b


def closing_over(by):
    return lambda a, b: by * a + b


def text_of(words, a=1, b=1):
    return len(words) + a + b


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"parameters": AXES | {"b": [0.1, 0.2]}}, "b (7 values from 0.1 to 0.9 there, 2 values"),
        ({"parameters": AXES | {"b": np.append(AXES["b"][:-2], [0.7, 0.9])}}, "b (other values)"),
        ({"parameters": {"a": AXES["a"], "b": AXES["b"]}}, "order of parameters (b, a there)"),
        ({"parameters": AXES | {"a": AXES["a"].astype(float)}}, "a (other values)"),
        ({"parameters": AXES | {"c": [5]}}, "c (none there, 5 here)"),
        ({"function": renamed}, "function (cell there, renamed here)"),
        ({"seed": 3}, "seed (None there, "),
        ({"vectorized": True}, "vectorized (False there, True here)"),
        ({"tile": 2}, "tile (blocks of (1, 4) there)"),
    ],
)
def test_another_study_is_refused(changed, told, folder):
    sweep(cell, AXES, directory=folder, tile=4)
    before = contents(folder)
    arguments = {"function": cell, "parameters": AXES} | changed
    with pytest.raises(InvalidInput, match=r"^directory: got ") as caught:
        sweep(arguments.pop("function"), arguments.pop("parameters"), directory=folder, **arguments)
    assert told in str(caught.value)
    assert contents(folder) == before


def test_other_code_is_refused(folder, monkeypatch):
    """A helper, a constant, a version, the package itself: each is named."""
    sweep(cell, AXES, directory=folder)
    sweep(cell, AXES, directory=folder)
    here = __name__
    changes = [
        (sys.modules[here], "GAIN", 3, f"code: {here}.GAIN (changed)"),
        (sys.modules[here], "helper", lambda a: 3 * a, f"code: {here}.helper (no longer used)"),
        (np, "__version__", "1.0", f"code: numpy ({np.__version__} there, 1.0 here)"),
    ]
    for home, name, value, told in changes:
        with monkeypatch.context() as patch:
            patch.setattr(home, name, value)
            with pytest.raises(InvalidInput) as caught:
                sweep(cell, AXES, directory=folder)
        assert told in str(caught.value)


def test_what_is_bound_to_a_function_is_told(folder):
    sweep(functools.partial(text_of, "ab", b=2), {"a": [1, 2]}, directory=folder)
    with pytest.raises(InvalidInput) as caught:
        sweep(functools.partial(text_of, "abc", b=3), {"a": [1, 2]}, directory=folder)
    told = "in it differ: argument 0 ('ab' there, 'abc' here); b (2 there, 3 here). Give another"
    assert told in str(caught.value)


def test_records_of_another_study_are_not_taken(folder, tmp_path):
    """Even where its chunks are the same."""
    whole = sweep(cell, AXES, directory=folder, tile=4)
    sweep(renamed, AXES, directory=tmp_path / "other", tile=4)
    record, theirs = folder / "done" / "3.json", tmp_path / "other" / "done" / "3.json"
    wanted = record.read_bytes()
    assert json.loads(wanted)["checksums"] == json.loads(theirs.read_bytes())["checksums"]
    shutil.copy(theirs, record)
    assert open_study(folder).done[:, 0].tolist() == [True, True, True, False, True, True, True]
    assert same(sweep(cell, AXES, directory=folder), whole)
    assert record.read_bytes() == wanted


def test_one_sweep_at_a_time(folder):
    def nested(a):
        if a == 2:
            with pytest.raises(InvalidInput, match="no other sweep is at work"):
                sweep(waves, AXES, directory=folder)
        return a

    for options in ({"tile": 1}, {}):
        study = sweep(nested, {"a": [1, 2]}, directory=folder, **options)
        assert study.complete
        assert not study.errors


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (Scaled(2), Scaled(3)),
        (closing_over(2), closing_over(3)),
        (closing_over(np.arange(3.0)), closing_over(np.arange(1.0, 4.0))),
        (closing_over(np.arange(6.0).reshape(2, 3)), closing_over(np.arange(6.0).reshape(3, 2))),
        (closing_over({"a": [1, 2]}), closing_over({"a": [1, 3]})),
        (lambda a, b=1: a, lambda a, b=2: a),
        (lambda a, *, b=1: a, lambda a, *, b=2: a),
        (lambda a: a + 1, lambda a: a + 2),
        (lambda a: a.real, lambda a: a.imag),
        (lambda a: [x + 1 for x in a], lambda a: [x + 2 for x in a]),
        (lambda a: np.sin(a), lambda a: np.cos(a)),
    ],
)
def test_what_changes_the_result_changes_the_fingerprint(one, other):
    assert code_of(one) != code_of(other)


PLAIN = """
def f(a):
    class Inner:
        x = None
    def g(b):
        if b:
            return b
    return a + 1, Inner, g
"""
DOCUMENTED = """
# Of a cell.
def f(a):
    "Of a cell."
    class Inner:
        "Within."

        x = None  # nothing
    def g(b):
        "Of b."
        if b:
            return b
    return a + 1, Inner, g
"""


def test_what_changes_nothing_does_not():
    codes = []
    for text in (PLAIN, DOCUMENTED):
        space = {"__name__": "users_module"}
        exec(text, space)
        codes.append(code_of(space["f"]))
    assert codes[0] == codes[1]
    assert code_of(Scaled(2)) == code_of(Scaled(2))
    assert code_of(closing_over(5)) == code_of(closing_over(5))


def test_the_fingerprint_is_that_of_another_process():
    """Hashes of strings differ between processes; the order of sets must not enter."""
    probe = (
        "from tests.cells import waves; import functools\n"
        "from impactsig.studies.fingerprint import code_of\n"
        "def f(a): return a in {'x', 'y', 'z', 'u', 'v'}\n"
        "g = functools.partial(f, {'p', 'q', 'r'})\n"
        "print(code_of(g), code_of(waves))"
    )
    runs = {
        subprocess.run(
            [sys.executable, "-c", probe], capture_output=True, text=True, check=True
        ).stdout
        for _ in range(3)
    }
    assert len(runs) == 1


PROBE = """
import functools, json, os, sys
from pathlib import Path
import impactsig, impactsig.io.reading
from impactsig.studies.fingerprint import code_of

def simulating(a):
    return impactsig.simulate(impactsig.scenes.karpodinis(a), periods=3)

def importing(a):
    from impactsig.dynamics.tangents import lyapunov
    return lyapunov

def reading(path):
    return impactsig.io.reading.read(path)

def passing_on(a):
    return a(impactsig)

cells = {
    "simulating": simulating,
    "importing": importing,
    "reading": reading,
    "passing on": passing_on,
    "posing": impactsig.Oscillator,
}

def told():
    # In a process of its own, which has read no file of the package for another.
    if os.fork() == 0:
        print(json.dumps({name: code_of(cell)["impactsig"] for name, cell in cells.items()}))
        sys.stdout.flush()
        os._exit(0)
    assert os.wait()[1] == 0

told()
for file, line in json.loads(sys.argv[1]):
    path = Path(impactsig.__file__).parent / file
    text = path.read_text()
    path.write_text(f"# before\\n{text}\\n{line}\\n")
    told()
    path.write_text(text)
"""
EDITS = {
    ("io/instruments/uff.py", "# typo"): set(),
    ("io/instruments/uff.py", '"""Not a docstring, but nothing either."""'): set(),
    ("io/instruments/uff.py", "LATER = 1"): {"reading", "passing on"},
    ("simulation/exact/flow.py", "LATER = 1"): {"simulating", "importing", "passing on"},
    ("dynamics/tangents/lyapunov.py", "LATER = 1"): {"importing", "passing on"},
    ("oscillators/parts.py", "LATER = 1"): {"simulating", "importing", "passing on", "posing"},
    ("plot/records/trains.py", "LATER = 1"): set(),
}


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """A copy of this package, to be edited."""
    root = tmp_path_factory.mktemp("edited")
    own = Path(_fingerprint.__file__).parents[1]
    shutil.copytree(own, root / own.name, ignore=shutil.ignore_patterns("__pycache__"))
    return root / own.name


@pytest.fixture(scope="module")
def parts(package):
    """What `code_of` says of the package for each cell: as it is, and after each edit alone."""
    run = subprocess.run(
        [sys.executable, "-c", PROBE, json.dumps(list(EDITS))],
        capture_output=True, text=True, check=True,
        env=os.environ | {"PYTHONPATH": str(package.parent)}, cwd=package.parent,
    )  # fmt: skip
    before, *after = map(json.loads, run.stdout.splitlines())
    return before, dict(zip(EDITS, after, strict=True))


@pytest.mark.parametrize("edit", EDITS, ids=lambda edit: " ".join(edit))
def test_of_this_package_the_code_counts_that_a_cell_reaches(edit, parts):
    before, after = parts
    assert {name for name in before if before[name] != after[edit][name]} == EDITS[edit]


def test_a_comment_in_this_package_voids_no_study(package, tmp_path):
    """A sweep in a directory goes on after one, and says so after a change of code."""
    program = (
        "import sys; from impactsig import InvalidInput, simulate, sweep\n"
        "def cell(a): return float(simulate is not None) + a\n"
        "try: print(sweep(cell, {'a': [1, 2]}, directory=sys.argv[1])['value'])\n"
        "except InvalidInput as error: print(error)"
    )

    def run():
        return subprocess.run(
            [sys.executable, "-c", program, str(tmp_path / "study")],
            env=os.environ | {"PYTHONPATH": str(package.parent)}, cwd=package.parent,
            capture_output=True, text=True, check=True,
        ).stdout  # fmt: skip

    assert run() == "[2. 3.]\n"
    for file, line, told in (
        ("simulation/exact/flow.py", "# typo", "[2. 3.]"),
        ("simulation/exact/flow.py", "LATER = 1", "in it differ: code: impactsig (changed)"),
    ):
        path = package / file
        text = path.read_text()
        path.write_text(f"{text}\n{line}\n")
        try:
            assert told in run()
        finally:
            path.write_text(text)


def test_settings_of_an_observable_are_code_of_a_cell():
    from impactsig.cli._observables import Observing
    from impactsig.oscillators import scenes

    cell = Observing(scenes.karpodinis, {}, {"periods": 10}, ("impacts_per_period",))
    faster = Observing(scenes.karpodinis, {}, {"periods": 20}, ("impacts_per_period",))
    assert code_of(cell) != code_of(faster)
    assert "impactsig" in code_of(cell)
    assert "impactsig" not in code_of(helper)
