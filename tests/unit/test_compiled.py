"""Kernels are kept where that is safe, and compiled anew when the code they are made of changed."""

from __future__ import annotations

import fcntl
import json
import os
import pickle
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from numba.core.registry import cpu_target

from impactsig._compiling import compiled as _compiled
from impactsig._compiling import sources
from impactsig._files.private import private_directory
from impactsig._files.turns import Turn

INNER = """
from impactsig._compiling.compiled import njit

@njit()
def inner(x):
    return {factor} * x
"""
OUTER = """
from impactsig._compiling.compiled import njit
from .{folder}inner import inner

@njit()
def outer(x):
    return inner(x) + 1
"""
INNER_EXPLAINED = '''"""Doubles numbers."""
from impactsig._compiling.compiled import njit  # cached

# Two
# lines.
@njit()
def inner(x):
    """Twice the number."""
    return 2 * x
'''
OUTER_EXPLAINED = '''"""Doubles numbers and adds one."""

from impactsig._compiling.compiled import njit
from .inner import inner


@njit()
def outer(x):
    """
    Twice the number and one.
    """
    # inner doubles it
    return inner(x) + 1
'''
SERVER = """
import json, os, resource, sys, warnings
import numba
import impactsig._compiling.compiled

numba.njit(lambda x: 2 * x + 1)(5)  # loads what any compilation needs
for line in sys.stdin:
    folder, largest, variables = json.loads(line)
    if os.fork() == 0:
        for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
            os.environ.pop(name, None)
        os.environ.update(variables)
        numba.core.config.reload_config()
        sys.path.insert(0, folder)
        resource.setrlimit(resource.RLIMIT_FSIZE, (largest, resource.RLIM_INFINITY))
        warnings.simplefilter("always")
        with warnings.catch_warnings(record=True) as caught:
            from kernels.outer import outer
            value = outer(5)
        told = [f"{one.category.__name__} {one.message}" for one in caught]
        print(json.dumps([value, sum(outer.stats.cache_hits.values()), told]), flush=True)
        os._exit(0)
    assert os.wait()[1] == 0
"""


@pytest.fixture(scope="module")
def server():
    """A process that has imported numba and none of our kernels; a copy of it runs each."""
    with subprocess.Popen(
        [sys.executable, "-c", SERVER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    ) as process:  # fmt: skip
        yield process
        process.stdin.close()


@pytest.fixture
def run(server):
    """Ask for a kernel of 5: its value, whether it was read from the cache, and the warnings."""

    def asked(package, largest=resource.RLIM_INFINITY, **variables):
        texts = {name: str(value) for name, value in variables.items()}
        print(json.dumps([str(package.parent), largest, texts]), file=server.stdin, flush=True)
        return tuple(json.loads(server.stdout.readline()))

    return asked


@pytest.fixture
def package(tmp_path):
    folder = tmp_path / "kernels"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "outer.py").write_text(OUTER.format(folder=""))
    (folder / "inner.py").write_text(INNER.format(factor=2))
    return folder


def test_a_kernel_does_what_another_file_says_now(package, run):
    """Comments and docstrings cost no compilation, wherever they move a function."""
    assert run(package) == (11, 0, [])
    (package / "inner.py").write_text(INNER_EXPLAINED)
    (package / "outer.py").write_text(OUTER_EXPLAINED)
    assert run(package) == (11, 1, [])
    (package / "inner.py").write_text(INNER.format(factor=3))
    assert run(package) == (16, 0, [])


def test_a_kernel_is_compiled_with_one_that_was_read(package, run):
    """Of a function that is read the LLVM code is parsed only then."""
    assert run(package) == (11, 0, [])
    (package / "outer.py").write_text(OUTER.format(folder="").replace("+ 1", "+ 100"))
    assert run(package) == (110, 0, [])
    assert run(package) == (110, 1, [])


@pytest.mark.skipif(sys.platform != "linux", reason="reads object code of Linux")
def test_a_kernel_calls_the_copies_it_was_compiled_with(package, run):
    """A weak copy gives way to one of its name that was loaded before, and may sum otherwise."""
    steps = "\n    ".join(f"x = x * x - {k}.5 if x < {k} else 1 / (x + {k})" for k in range(60))
    inner = INNER.format(factor=2).replace("return", f"{steps}\n    return")
    (package / "inner.py").write_text(inner)
    (package / "outer.py").write_text(OUTER.format(folder="").replace("+ 1", "+ inner(x + 1)"))
    run(package)
    (kept,) = package.rglob("outer.outer-*.nbc")
    _, elf = kept.read_bytes().split(b"\x7fELF", 1)
    copies = {name: bound for name, bound in symbols(b"\x7fELF" + elf) if "inner" in name}
    assert copies
    assert set(copies.values()) == {LOCAL}


LOCAL, FUNCTION, SYMBOLS = 0, 2, 2


def symbols(elf):
    """Names and bindings of the functions that an object file defines."""
    headers, count = struct.unpack_from("<Q12xH", elf, 40)
    tables = [struct.unpack_from("<IIQQQQIIQQ", elf, headers + 64 * k) for k in range(count)]
    for _, kind, _, _, begin, size, link, *_ in tables:
        if kind != SYMBOLS:
            continue
        for entry in range(begin, begin + size, 24):
            name, info, _, section = struct.unpack_from("<IBBH", elf, entry)
            if info & 15 == FUNCTION and section:
                start = tables[link][4] + name
                yield elf[start : elf.index(0, start)].decode(), info >> 4


CALLS = """
import json, sys

from numba.core import event

compiled = []

class Names(event.Listener):
    def on_start(self, event):
        compiled.append(event.data["dispatcher"].py_func.__name__)

    def on_end(self, event):
        pass

event.register("numba:compile", Names())
sys.path.insert(0, sys.argv[1])
from kernels.inner import inner
from kernels.outer import outer

functions = {"inner": inner, "outer": outer}
values = [functions[name](5) for name in sys.argv[2:]]
print(json.dumps([values, compiled]))
"""


def called(package, *names):
    """Values of kernels that a new process calls, and the kernels that it compiles for that."""
    beside = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    found = subprocess.run(
        [sys.executable, "-c", CALLS, str(package.parent), *names], check=True,
        env=beside | {"PYTHONPATH": os.pathsep.join(sys.path)}, capture_output=True, text=True,
    )  # fmt: skip
    return json.loads(found.stdout)


def test_python_calls_what_was_compiled_for_a_kernel(package):
    """That has no entry from Python, so it is compiled again; then both are kept."""
    assert called(package, "outer", "inner") == [[11, 10], ["outer", "inner", "inner"]]
    assert called(package, "outer", "inner") == [[11, 10], []]
    (package / "outer.py").write_text(OUTER.format(folder="").replace("+ 1", "+ 100"))
    assert called(package, "inner", "outer") == [[10, 110], ["outer"]]


def defined(package, name):
    """Of each thing that is kept of a kernel, the functions that its machine code defines."""
    texts = [path.read_bytes() for path in sorted(package.rglob(f"{name}*.nbc"))]
    codes = [b"\x7fELF" + text.split(b"\x7fELF", 1)[1] for text in texts]
    return [[function for function, _ in symbols(code)] for code in codes]


@pytest.mark.skipif(sys.platform != "linux", reason="reads object code of Linux")
def test_what_only_kernels_call_has_no_machine_code(package):
    called(package, "outer")
    assert defined(package, "inner.inner-") == [[]]
    called(package, "inner")
    within, entered = defined(package, "inner.inner-")
    assert within == []
    assert any("inner" in name for name in entered)


def test_functions_of_a_user_are_compiled_as_numba_does(package):
    """Also where they call what was compiled for a kernel."""
    code = """
import sys
import numba
sys.path.insert(0, sys.argv[1])
from kernels.outer import outer

@numba.njit
def smaller(x, y):
    if x < 0:
        raise ValueError("negative", x)
    return min(x, y) + outer(x)

assert smaller(5, 3) == 3 + 11
assert outer(5) == 11
assert smaller(2.0, 3.0) == 2.0 + 5.0
try:
    smaller(-1, 1)
except ValueError as error:
    assert error.args == ("negative", -1)
else:
    raise AssertionError
"""
    text = OUTER.format(folder="").replace("inner(x)", "max(inner(x), min(x, 3))")
    (package / "outer.py").write_text(text)
    subprocess.run(
        [sys.executable, "-c", code, str(package.parent)],
        check=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )


def test_functions_of_one_name_are_kept_apart(package, run):
    (package / "outer.py").write_text("""
from impactsig._compiling.compiled import njit

@njit()
def outer(x):
    return x + 1

first = outer

@njit()
def outer(x):
    return first(x) + 2 * first(0)
""")
    assert run(package) == (8, 0, [])
    assert run(package) == (8, 1, [])


def test_a_constant_is_compiled_as_any_number(package, run):
    """Once for its type, not once for each value."""
    (package / "outer.py").write_text("""
from impactsig._compiling.compiled import njit
from .inner import inner

@njit()
def first(x):
    return inner(1) + inner(2) + inner(-x) + inner(x=3)

def outer(x):
    return first(x) + 1000 * len(inner.signatures)

outer.stats = first.stats
""")
    assert run(package) == (1002, 0, [])


def test_state_is_of_what_is_imported_and_of_nothing_else(tmp_path, monkeypatch):
    def state(**changed):
        texts = {
            "outer": OUTER.format(folder="deep."),
            "deep/inner": "from .. import (\n    a,\n    names,\n)\n",
            "names": "A = 1\n",
            "other": "B = 1\n",
        }
        root = tmp_path / "_".join(changed) / "package"
        (root / "deep").mkdir(parents=True)
        for name, text in (texts | changed).items():
            (root / f"{name}.py").write_text(text)
        return _compiled.state(root / "outer.py")

    first = state()
    assert state(other="B = 2\n") == first
    assert state(names="A = 2\n") != first
    # And of how kernels are kept: a file may leave it to another to compile its functions.
    text = Path(_compiled.__file__).read_text()
    (tmp_path / "compiled.py").write_text(text + "form = 2\n")
    monkeypatch.setattr(_compiled, "__file__", str(tmp_path / "compiled.py"))
    assert state(last="") != first


TWO_AT_ONCE = """
import json, os, sys, time
from pathlib import Path
import numba
from numba.core import event

folder = Path(sys.argv[1])
sys.path.insert(0, sys.argv[1])
numba.njit(lambda x: 2 * x + 1)(5)  # loads what any compilation needs
second = os.fork() == 0

class Slow(event.Listener):  # the first has begun to compile, and takes its time over it
    def on_start(self, event):
        (folder / "begun").touch()
        until = time.monotonic() + 20
        while not (folder / "called").exists() and time.monotonic() < until:
            time.sleep(0.01)
        time.sleep(0.2)

    def on_end(self, event):
        pass

from kernels.outer import outer
if second:
    while not (folder / "begun").exists():
        time.sleep(0.01)
    (folder / "called").touch()
else:
    event.register("numba:compile", Slow())
value = outer(5)
hits = {False: "first", True: "second"}[second]
(folder / hits).write_text(json.dumps([value, sum(outer.stats.cache_hits.values())]))
if not second:
    assert os.wait()[1] == 0
"""


def test_of_two_processes_one_compiles_and_the_other_waits(package, tmp_path):
    subprocess.run(
        [sys.executable, "-c", TWO_AT_ONCE, str(tmp_path)], check=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )  # fmt: skip
    assert json.loads((tmp_path / "first").read_text()) == [11, 0]
    assert json.loads((tmp_path / "second").read_text()) == [11, 1]


def test_a_turn_ends_with_what_it_was_taken_for(tmp_path):
    """Also where that fails; and a process that has it does not wait for itself."""
    turn = Turn(tmp_path / "turn")

    def is_free():
        with turn.path.open("w") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return False
        return True

    def fail():
        with turn.ended():
            turn.take()
            with turn.ended():
                turn.take()
            assert not is_free()
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert is_free()


# -- kernels that come with the package ------------------------------------------------------------


@pytest.fixture
def shipped(package, run):
    """The package with its kernels compiled, as a wheel carries them: for the shipped target."""
    if not _compiled._runs_shipped(cpu_target.target_context.codegen().magic_tuple()):
        pytest.skip("needs Linux on a processor that shipped kernels run on")
    assert run(package) == (11, 0, [])
    kept = (package / "__pycache__").rename(package / "_kernels")
    for index in kept.glob("*.nbi"):
        rewrite(index, lambda version: version, lambda target: _compiled.shipped_target())
    return package


def rewrite(index, changed_version, changed_target):
    with index.open("rb") as file:
        version, (stamp, overloads) = pickle.load(file), pickle.load(file)
    moved = {(key[0], changed_target(key[1]), key[2]): name for key, name in overloads.items()}
    text = pickle.dumps(changed_version(version)) + pickle.dumps((stamp, moved))
    index.write_bytes(text)


def made(package):
    """Kernels that a process has compiled for itself."""
    found = sorted(path.name.split(".")[0] for path in package.rglob("__pycache__/*.nbc"))
    shutil.rmtree(package / "__pycache__", ignore_errors=True)
    return found


def test_a_shipped_kernel_is_used(shipped, run, tmp_path):
    """Wherever the user keeps others."""
    assert run(shipped) == (11, 1, [])
    assert made(shipped) == []
    assert run(shipped, NUMBA_CACHE_DIR=tmp_path / "cache") == (11, 1, [])
    assert not list((tmp_path / "cache").rglob("*.nbc"))


def test_a_shipped_kernel_of_other_code_is_not_used(shipped, run):
    (shipped / "inner.py").write_text(INNER.format(factor=3))
    assert run(shipped) == (16, 0, [])
    assert made(shipped) == ["inner", "outer"]


@pytest.mark.parametrize("place", range(3))
def test_a_shipped_kernel_of_other_versions_is_not_used(place, shipped, run):
    """Of numba, llvmlite and numpy."""

    def other(version):
        words = version.split()
        words[place] += "1"
        return " ".join(words)

    for index in (shipped / "_kernels").glob("outer*.nbi"):
        rewrite(index, other, lambda target: target)
    assert run(shipped) == (11, 0, [])
    assert made(shipped) == ["outer"]


def test_a_shipped_kernel_is_not_used_where_checks_are_asked_for(shipped, run):
    assert run(shipped, NUMBA_BOUNDSCHECK=1) == (11, 0, [])
    assert made(shipped) == ["inner", "outer"]


def test_shipped_kernels_run_on_processors_that_have_all_they_need():
    triple, name, features = _compiled.shipped_target()
    assert _compiled._runs_shipped((triple, "znver4", f"+64bit,{features},+avx512f,-amx-tile"))
    assert not _compiled._runs_shipped((triple, name, features.replace("+avx2", "-avx2")))
    assert not _compiled._runs_shipped((triple, name, features.replace("+fma,", "")))
    assert not _compiled._runs_shipped(("x86_64-apple-darwin", name, features))
    assert not _compiled._runs_shipped((triple, "generic", ""))


# -- directories that cannot be written ------------------------------------------------------------


@pytest.fixture
def nowhere(package, tmp_path):
    """Variables of a process that can write neither beside the package nor at home."""
    (package / "__pycache__").touch()  # a file, which stops root as well
    (tmp_path / "home").touch()
    (tmp_path / "tmp").mkdir()
    return {"HOME": tmp_path / "home", "TMPDIR": tmp_path / "tmp"}


def private(nowhere):
    return nowhere["TMPDIR"] / f"impactsig-{os.getuid()}"


def test_without_a_home_kernels_are_kept_in_a_private_temporary_directory(package, nowhere, run):
    value, hits, warned = run(package, **nowhere)
    assert (value, hits) == (11, 0)
    (warning,) = warned
    assert warning.startswith("ImpactsigWarning")
    assert f"keeps its compiled functions in {private(nowhere)}, " in warning
    assert "Set NUMBA_CACHE_DIR to" in warning
    assert private(nowhere).stat().st_mode & 0o777 == 0o700
    assert run(package, **nowhere) == (11, 1, warned)


def test_the_directory_that_the_warning_asks_for_is_taken(package, nowhere, tmp_path, run):
    assert run(package, **nowhere, NUMBA_CACHE_DIR=tmp_path / "cache") == (11, 0, [])
    assert list((tmp_path / "cache").rglob("outer*.nbc"))


def test_code_that_others_could_have_planted_is_not_run(package, nowhere, run):
    run(package, **nowhere)
    private(nowhere).chmod(0o777)
    value, hits, warned = run(package, **nowhere)
    assert (value, hits) == (11, 0)
    (warning,) = warned
    assert "compiles its functions anew in every process. Set NUMBA_CACHE_DIR" in warning


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


@pytest.mark.parametrize("mode", [0o700, 0o755, 0o1777])
def test_a_directory_is_private_in_any_proper_temporary_directory(mode, temporary):
    temporary.chmod(mode)
    directory = private_directory()
    assert directory.parent == temporary
    assert directory.stat().st_mode & 0o777 == 0o700
    assert private_directory() == directory


def foreign(path):
    if os.getuid() != 0:
        pytest.skip("only root can give a directory away")
    os.chown(path, 65534, 65534)


def linked(path):
    path.rename(path.with_name("theirs"))
    path.symlink_to(path.with_name("theirs"))


def filed(path):
    path.rmdir()
    path.touch()


@pytest.mark.parametrize(
    "spoil",
    [
        lambda path: path.chmod(0o720),
        lambda path: path.chmod(0o702),
        lambda path: path.chmod(0o750),
        lambda path: path.parent.chmod(0o777),  # others could put another in its place
        lambda path: path.parent.chmod(0o770),
        foreign,
        lambda path: foreign(path.parent),
        linked,
        filed,
    ],
)
def test_a_directory_that_others_can_write_to_is_not_private(spoil, temporary):
    spoil(private_directory())
    assert private_directory() is None


def test_a_private_directory_is_checked_whenever_it_is_read(package, nowhere, monkeypatch):
    """A process may live on after its files were removed, and the directory made by others."""
    monkeypatch.setattr(_compiled, "private_directory", lambda: private(nowhere))
    monkeypatch.setattr(_compiled, "_warned", ["before"])
    place = _compiled._Temporary.from_function(private, str(package / "outer.py"))
    private(nowhere).mkdir()
    place.ensure_cache_path()
    monkeypatch.setattr(_compiled, "private_directory", lambda: None)
    with pytest.raises(PermissionError, match="others can write to"):
        place.ensure_cache_path()


def test_a_full_disk_does_not_end_a_calculation(package, run):
    value, hits, warned = run(package, largest=0)
    assert (value, hits) == (11, 0)
    assert [one.partition(" ")[0] for one in warned] == ["ImpactsigWarning"]


def test_kernels_are_read_without_scipys_linear_algebra_which_is_there_when_asked_for():
    code = """
import sys
from impactsig import scenes, simulate
simulate(scenes.karpodinis(), periods=1)
assert "scipy.linalg" not in sys.modules
from numba.np import arraymath, linalg
assert arraymath.ensure_blas is linalg.ensure_blas
linalg.ensure_blas()
assert "scipy.linalg.cython_blas" in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_what_compiles_kernels_reaches_no_more_than_it_needs():
    """All kernels are compiled anew when one of these files changes."""
    reached = sources.reached([Path(_compiled.__file__)])
    names = {one.name for one in reached}
    assert {"compiled.py", "_linking.py", "_worked_out_once.py", "_written_briefly.py"} <= names
    assert len(names) < 15


def test_no_kernel_is_called_while_tests_are_collected(called_while_collecting):
    """Each worker would compile it, or wait for the other one that does, before any test."""
    assert called_while_collecting == []
