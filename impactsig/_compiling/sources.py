"""Source files as code: without comments and docstrings, with the files that they import.

Digests of code decide whether a kernel is compiled again (`compiled`) and whether a study is the
same (`studies.fingerprint`). Every process that computes takes them when it starts, and `ast` and
`tokenize` take ten times as long as the regular expressions here; a test compares the results.
"""

from __future__ import annotations

import functools
import hashlib
import re
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).parents[1]
"""The folder of this package."""
WITHOUT_NUMBERS = (
    ROOT / "plot",
    ROOT / "report",
    ROOT / "cli" / "__init__.py",
    ROOT / "cli" / "_parser.py",
    ROOT / "cli" / "_commands.py",
)
"""Parts of this package that change no result."""

_TEXT = re.compile(  # a string or a comment
    r'("""(?:[^"\\]+|\\.|"(?!""))*"""'
    r"|'''(?:[^'\\]+|\\.|'(?!''))*'''"
    r'|"(?:[^"\\\n]+|\\.)*"'
    r"|'(?:[^'\\\n]+|\\.)*'"
    r"|\#[^\n]*)",
    re.DOTALL,
)
_LINE_ENDS = re.compile(r"[ \t]*\n(?:[ \t]*\n)*")
_TYPES_ONLY = re.compile(r"^( *)if TYPE_CHECKING:\n(?:\1 +.*\n?)*", re.MULTILINE)
_IMPORT = re.compile(r"^ *from (\.+)([\w.]*) import (\([^)]*\)|.*)", re.MULTILINE)
_IMPORTED_NAME = re.compile(r"(\w+)(?: as \w+)?")
_NAME = re.compile(r"""["']\.?([a-z_][\w.]*)["']""")


def code(source: str) -> str:
    """Source code without comments, docstrings and blank lines.

    A docstring is any string that is a statement by itself: Python drops them all.
    """
    pieces = [*_TEXT.split(source), ""]  # every second piece is a string or a comment
    kept: list[str] = []
    plain = pieces[0]
    depth = _depth(plain)
    for text, after, following in zip(pieces[1::2], pieces[2::2], pieces[3::2], strict=False):
        if text[0] == "#":
            plain += after
        elif not depth and _begins_line(plain, not kept) and _ends_line(after, following):
            plain = plain.rstrip("rRuU") + after
        else:
            kept += [_LINE_ENDS.sub("\n", plain), text]
            plain = after
        depth += _depth(after)
    return "".join([*kept, _LINE_ENDS.sub("\n", plain)]).strip()


def _depth(plain: str) -> int:
    """Brackets that are opened and not closed."""
    return sum(map(plain.count, "([{")) - sum(map(plain.count, ")]}"))


def _begins_line(before: str, first: bool) -> bool:
    """Whether a string begins a logical line, perhaps with a prefix."""
    lines, end, line = before.rpartition("\n")
    return (bool(end) or first) and line.strip().lower() in ("", "r", "u") and lines[-1:] != "\\"


def _ends_line(after: str, following: str) -> bool:
    line, end, _ = after.partition("\n")
    return not line.strip() and (bool(end) or following[:1] in ("", "#"))


def reached(paths: Iterable[Path]) -> set[Path]:
    """These files and all files that they import by relative names.

    Imports within functions count, and those by `importlib.import_module`: of a file that calls it
    all strings that name a module beside it. Imports for types alone do not count.
    """
    files: set[Path] = set()
    left = list(paths)
    while left:
        path = left.pop()
        if path not in files and not any(map(path.is_relative_to, WITHOUT_NUMBERS)):
            files.add(path)
            left += _imported(path)
    return files


def digest(paths: Iterable[Path]) -> str:
    """Digest of the names and the code of files."""
    whole = hashlib.sha256()
    for path in sorted(paths):
        whole.update(f"{path.name}\n".encode() + _digest(path))
    return whole.hexdigest()


@functools.cache
def module(place: Path) -> Path | None:
    """The file of a module or package, if there is one."""
    candidates = (place.with_suffix(".py"), place / "__init__.py")
    return next((path for path in candidates if _exists(path)), None)


@functools.cache
def _imported(path: Path) -> list[Path]:
    text = _TYPES_ONLY.sub("", _code(path))
    files: list[Path | None] = []
    for dots, package, names in _IMPORT.findall(text):
        place = path.parents[len(dots) - 1].joinpath(*filter(None, package.split(".")))
        home = module(place)
        if home is not None and home.name != "__init__.py":
            files.append(home)
        else:  # what is imported from a package may be a module of it
            files += [module(place / name) or home for name in _IMPORTED_NAME.findall(names)]
    if "import_module" in text:
        files += [module(path.parent.joinpath(*name.split("."))) for name in _NAME.findall(text)]
    return [file for file in files if file is not None]


@functools.cache
def _code(path: Path) -> str:
    """The code of a file, which may be in the zip archive that this package is imported from."""
    content: bytes = globals()["__loader__"].get_data(str(path))
    return code(content.decode())


@functools.cache
def _digest(path: Path) -> bytes:
    return hashlib.sha256(_code(path).encode()).digest()


def _exists(path: Path) -> bool:
    try:
        _code(path)
    except OSError:
        return False
    return True
