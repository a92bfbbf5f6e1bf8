"""Source files as code: what counts as a change, and which files belong to a module."""

from __future__ import annotations

import io
import tokenize

import pytest

from impactsig._compiling import sources
from impactsig._compiling.sources import ROOT, reached


def statements(source):
    """Logical lines by Python's own tokenizer, without comments and lines that are one string."""
    line, kept = [], []
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type != tokenize.COMMENT and token.string.strip():
            line.append(token)
        if token.type in (tokenize.NEWLINE, tokenize.ENDMARKER):
            if line and not (len(line) == 1 and line[0].type == tokenize.STRING):
                kept.append((line[0].start[1], [one.string for one in line]))
            line = []
    return kept


def test_code_is_what_the_tokenizer_sees():
    for path in sorted(ROOT.rglob("*.py"))[::4]:
        source = path.read_text()
        assert statements(sources.code(source)) == statements(source), path


SAME = """def f(x):
    return x + "#"
"""


@pytest.mark.parametrize(
    "other",
    [
        '"""Of a module."""\n\n\ndef f(x):  # comment\n    return x + "#"  # "\n',
        'def f(x):\n    """Doc."""\n    return x + "#"\n',
        'def f(x):\n    r"""Doc, "quoted" \\d."""  # comment\n\n    return x + "#"',
        "def f(x):\n    '''Doc # \"'''\n    # don't\n    return x + \"#\"\n    'unused'\n",
        'def f(x):\n    """Doc\n\n    of lines.\n    """\n    return x + "#"\n',
    ],
)
def test_comments_and_docstrings_are_no_code(other):
    assert sources.code(other) == sources.code(SAME)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ('x = "# a"', 'x = "# b"'),
        ('x = """\n# a"""', 'x = """\n# b"""'),
        ('x = """\n\n"""', 'x = """\n"""'),
        ('x = f(\n    "a"\n)', 'x = f(\n    "b"\n)'),
        ('x = {"a":\n    """b"""\n}', 'x = {"a":\n    """c"""\n}'),
        ('x = y +\\\n"a"', 'x = y +\\\n"b"'),
        ('"a".f()', '"b".f()'),
        ('"a" "b"; x = 1', '"a" "b"; x = 2'),
        ("if x:\n    y\n    z", "if x:\n    y\nz"),
        ("x = '\\'#1'", "x = '\\'#2'"),
    ],
)
def test_everything_else_is_code(one, other):
    assert sources.code(one) != sources.code(other)


def test_imports_are_followed_wherever_they_stand(tmp_path):
    files = {
        "start.py": """
from typing import TYPE_CHECKING
from . import one, constant
from .inner import two
if TYPE_CHECKING:
    from . import types_only
    from .inner import types_only
def f():
    from .inner.three import (
        g as h,
    )
    from ..beside import name
    from .missing import nothing
""",
        "one.py": "",
        "__init__.py": "constant = 1",
        "types_only.py": "",
        "inner/__init__.py": "from . import four",
        "inner/two.py": "from .. import start",
        "inner/three.py": "",
        "inner/four.py": "from importlib import import_module\nNAMES = ['five', 'none']",
        "inner/five.py": "",
        "inner/six.py": "",
        "../beside.py": "",
        "unrelated.py": "",
    }  # fmt: skip
    package = tmp_path / "package"
    for name, text in files.items():
        path = (package / name).resolve()
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    names = {path.relative_to(tmp_path).as_posix() for path in reached([package / "start.py"])}
    assert names == {
        "package/start.py", "package/one.py", "package/__init__.py", "package/inner/two.py",
        "package/inner/three.py", "beside.py",
    }  # fmt: skip
    names = {path.name for path in reached([package / "inner" / "__init__.py"])}
    assert names == {"__init__.py", "four.py", "five.py"}


def test_what_simulation_reaches():
    found = reached([ROOT / "simulation" / "__init__.py"])
    names = {path.relative_to(ROOT).as_posix() for path in found}
    assert {"simulation/exact/flow.py", "simulation/exact/passing.py"} <= names
    assert "oscillators/parts.py" in names
    assert not any(name.startswith(("io/", "plot/", "report/", "detect/")) for name in names)


def test_reading_reaches_the_formats_that_are_imported_by_name():
    names = {path.stem for path in reached([ROOT / "io" / "__init__.py"])}
    assert {"uff", "tdms", "text", "mat5"} <= names


def test_the_kernels_of_detection_do_not_hang_on_the_type_that_they_fill():
    kernels = [p for p in (ROOT / "detect").rglob("*.py") if "@njit" in p.read_text()]
    assert len(kernels) > 10
    assert ROOT / "impacts.py" not in reached(kernels)
