"""The table of file formats, and the choice of the reader of a file.

To add a format, write one file with a function

    ``open_source(path: pathlib.Path, limits: Limits) -> Source``

and add one `Format` to `FORMATS`. The contract of that function (see `Source`, `Signal`):

- It reads headers and metadata only, where the format allows; samples are read by `Source.read`,
  which touches no more than it is asked for.
- It checks every size that the file declares against the size of the file, or by `Limits.check`
  if the samples are compressed or only announced, before it allocates.
- It never unpickles, evaluates or runs anything from the file, nor does it open another file that
  this one names.
- A signal whose rate the file does not tell has ``rate=None`` and says why in `no_rate`; a file
  that ends early is opened as far as it goes, and says so in `truncated`.
- It raises `UnreadableFile` where it knows what is wrong. Any other exception, from it or from
  the library it uses, is turned into that type by `guarded`, and stays chained.
- Libraries are imported inside the functions; an optional one is named in the table.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from os import PathLike
from pathlib import Path

from .._arguments import instance
from .._extras import library
from ..errors import ImpactsigError, InvalidInput, UnreadableFile
from ._encoding import encoding_of, is_plain
from ._limits import DEFAULT_LIMITS, Limits
from ._raw import RawLayout
from ._source import Source
from .arrays.mat4 import is_mat4
from .instruments.ide import is_ide
from .instruments.mdf import is_mdf
from .instruments.tradb import is_sqlite

_HEAD = 4096


@dataclass(frozen=True)
class Format:
    """One family of file formats.

    Parameters
    ----------
    name : str
        For messages and for `FileInfo.format` where the reader does not narrow it down.
    extensions : tuple of str
        Lower case, with the dot.
    sniff : callable
        Whether the first 4096 bytes of a file are of this format.
    module : str
        The module of `impactsig.io` that holds `open_source`.
    library, extra : str
        The optional library that the reader needs and the extra that installs it.
    """

    name: str
    extensions: tuple[str, ...]
    sniff: Callable[[bytes], bool]
    module: str
    library: str = ""
    extra: str = ""


def _is_audio(head: bytes) -> bool:
    return (
        (head[:4] in (b"RIFF", b"RIFX", b"RF64") and head[8:12] == b"WAVE")
        or (head[:4] == b"FORM" and head[8:12] in (b"AIFF", b"AIFC"))
        or head[:4] in (b"fLaC", b"OggS")
        or head[:16] == b"riff\x2e\x91\xcf\x11\xa5\xd6\x28\xdb\x04\xc1\x00\x00"
    )


def _is_tdms(head: bytes) -> bool:
    return head[:4] in (b"TDSm", b"TDSh")


def _is_hdf5(head: bytes) -> bool:
    # Behind a block of the user's, as in MATLAB 7.3, of 512 bytes or a power of two more.
    return any(head[at : at + 8] == b"\x89HDF\r\n\x1a\n" for at in (0, 512, 1024, 2048))


def _is_npz(head: bytes) -> bool:
    # A zip archive of which the first member is an array; other archives have other names.
    length = int.from_bytes(head[26:28], "little")
    return head[:4] == b"PK\x03\x04" and head[30 : 30 + length].endswith(b".npy")


def _is_mat5(head: bytes) -> bool:
    return head[124:128] in (b"\x00\x01IM", b"\x01\x00MI")  # version 1 in either byte order


def _is_uff(head: bytes) -> bool:
    # A line of -1 and the number of a dataset, each in its columns.
    # The first may stand twice, around a set that was lost.
    return re.match(rb"(?:    -1 *\r?\n){1,3}(?= {0,5}\d{1,6})[ \d]{6}[b \r\n]", head) is not None


def _is_arrow(head: bytes) -> bool:
    return head[:4] in (b"PAR1", b"FEA1") or head[:6] == b"ARROW1"


def is_lvm(head: bytes) -> bool:
    """Whether a file begins with the header that LVM files may also do without."""
    return head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"LabVIEW Measurement")


def _is_text(head: bytes) -> bool:
    if encoding_of(head).startswith("utf-16"):
        return True
    # What is above 127 may be Latin-1 or UTF-8.
    return is_plain(head) and bool(re.search(rb"[0-9]", head))


FORMATS: tuple[Format, ...] = (
    Format(
        "audio (WAV, FLAC, OGG, AIFF, W64, RF64)",
        (".wav", ".flac", ".ogg", ".oga", ".opus", ".aif", ".aiff", ".aifc", ".w64", ".rf64"),
        _is_audio,
        "instruments.audio",
    ),
    Format("NI TDMS", (".tdms",), _is_tdms, "instruments.tdms", "nptdms", "daq"),
    Format("NumPy npy", (".npy",), lambda head: head[:6] == b"\x93NUMPY", "arrays.npy"),
    Format("NumPy npz", (".npz",), _is_npz, "arrays.npz"),
    Format("HDF5", (".h5", ".hdf5", ".hdf", ".he5"), _is_hdf5, "hdf5.hdf5", "h5py", "hdf5"),
    Format("MATLAB 5", (".mat",), _is_mat5, "arrays.mat5"),
    Format(
        "Parquet or Feather",
        (".parquet", ".feather", ".arrow"),
        _is_arrow,
        "arrays.arrow",
        "pyarrow",
        "parquet",
    ),
    Format("NI LVM", (".lvm",), is_lvm, "text.lvm"),
    Format("UFF 58", (".uff", ".unv"), _is_uff, "instruments.uff"),
    Format("enDAQ IDE", (".ide",), is_ide, "instruments.ide", "idelib", "endaq"),
    Format("MDF", (".mf4", ".mdf"), is_mdf, "instruments.mdf", "asammdf", "mdf"),
    Format("Vallen tradb", (".tradb", ".pridb"), is_sqlite, "instruments.tradb"),
    # Last, because many formats are text: those have sniffers of their own further up.
    Format("text (CSV, TSV, TXT)", (".csv", ".tsv", ".txt", ".dat", ".asc"), _is_text, "text.text"),
)


RAW = Format("raw binary", (), lambda head: False, "_raw")
# Its mark is weak: five small numbers. So the name of the file must say it too.
MATLAB_4 = Format("MATLAB 4", (".mat",), is_mat4, "arrays.mat4")


def _recognised(path: Path, head: bytes) -> Format:
    """The format of a file: by its content, else by its extension.

    A text file without the mark of any format goes to the reader its extension names, if that
    reads text too (an LVM file without a header), else to the reader of plain tables.

    Raises
    ------
    UnreadableFile
        If its format is not known.
    """
    named = next((f for f in FORMATS if path.suffix.lower() in f.extensions), None)
    found = next((f for f in FORMATS if f.sniff(head)), None)
    if found is not None:
        textual = found.module == "text.text" and named is not None and named.module == "text.lvm"
        return named if textual and named is not None else found
    if path.suffix.lower() == ".mat" and MATLAB_4.sniff(head):
        return MATLAB_4
    known = "; ".join(f"{f.name}: {' '.join(f.extensions)}" for f in FORMATS)
    begins = f"it begins with {head[:8]!r}"
    if named is not None and named.module.startswith("text.") and is_plain(head):
        raise UnreadableFile(
            path,
            f"contains no numbers ({begins})",
            "Expected columns of numbers, with or without headings above them",
        )
    if named is not None:
        raise UnreadableFile(
            path,
            f"is named as {named.name}, but its content is not ({begins})",
            f"Known formats: {known}",
        )
    raise UnreadableFile(
        path,
        f"is of no known format ({begins})",
        f"Known formats: {known}. For numbers without a header give raw=RawLayout(...) (--raw)",
    )


def _first_bytes(path: Path) -> bytes:
    """The beginning of a file that can be read and is not empty."""
    try:
        if path.is_dir():
            raise UnreadableFile(path, "is a folder", "Give the path of a file in it")
        if path.exists() and not path.is_file():
            raise UnreadableFile(path, "is not a regular file")
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except FileNotFoundError as error:
        raise UnreadableFile(path, "no such file", "Check the path") from error
    except (OSError, ValueError) as error:
        if isinstance(error, ImpactsigError):
            raise
        reason = getattr(error, "strerror", None) or str(error)
        raise UnreadableFile(path, f"cannot be opened ({reason})") from error
    if not head:
        raise UnreadableFile(path, "is empty (0 bytes)")
    return head


def open_file(
    path: str | PathLike[str], limits: Limits = DEFAULT_LIMITS, raw: RawLayout | None = None
) -> Source:
    """Open a file with the reader of its format, or as numbers without a header.

    Raises
    ------
    InvalidInput
        If `path` is no path.
    UnreadableFile
        If it cannot be read.
    MissingExtra
        If its format needs a library that is not installed.
    """
    try:
        path = Path(path)
    except TypeError:
        raise InvalidInput("path", path, "a path as text or pathlib.Path") from None
    instance("limits", limits, Limits)
    head = _first_bytes(path)
    found = _recognised(path, head) if raw is None else RAW
    if found.library:
        library(found.library, found.extra, f"Reading {found.name}")
    with guarded(path, found.name):
        module = import_module(f".{found.module}", __package__)
        source = module.open_source(path, limits if raw is None else raw)
        if not source.signals:
            raise UnreadableFile(path, f"holds no signal that {found.name} could give")
        return source


@contextmanager
def guarded(path: Path, name: str) -> Iterator[None]:
    """Turn any exception of a reader or its library into `UnreadableFile`, chained."""
    try:
        yield
    except ImpactsigError:
        raise
    except Exception as error:
        reason = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
        reason = " ".join(reason.split())  # libraries quote what they choked on, line ends and all
        reason = reason if len(reason) <= 200 else reason[:197] + "..."
        raise UnreadableFile(path, f"cannot be read as {name} ({reason})") from error
