"""The objects of an HDF5 file; links to other files are not followed.

A file of one kilobyte may name any other file of the computer as the place of its samples, by an
external link, external storage or a virtual dataset. Only hard links are followed here, one name
at a time, and only datasets stored in the file by the filters that HDF5 itself has are read.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...errors import UnreadableFile
from .._arrays import Place, bytes_of, fact
from .._limits import DEFAULT_LIMITS, HARMLESS, Limits
from ._chunks import Chunks
from ._texts import Texts

_MATLABS_OWN = ("#refs#", "#subsystem#")
_DEEPEST, _MOST = 32, 10_000
_LINKS = {
    1: "a soft link, which is never followed",
    64: "an external link, which is never followed",
}
_FILTERS = frozenset((1, 2, 3, 4, 5, 6, 32_000))  # deflate ... scale-offset, and h5py's lzf


class Member(NamedTuple):
    """A group or dataset; `refused` says why it must not be read, if so."""

    place: Place
    object: Any
    refused: str = ""


def members(path: Path, file: Any, matlab: bool) -> Iterator[Member]:
    """Groups, datasets and refused links, each object once, parents first.

    The cells of a MATLAB file are references to objects that it keeps in a group of its own.

    Raises
    ------
    UnreadableFile
        If there are too many, or they lie too deep.
    """
    import h5py

    seen = set()
    pending: list[tuple[Place, Any]] = [((), file)]
    while pending:
        place, group = pending.pop(0)
        if len(place) > _DEEPEST:
            raise UnreadableFile(path, f"nests groups more than {_DEEPEST} deep")
        for name in group:
            here = (*place, name)
            if matlab and name in _MATLABS_OWN and not place:
                continue
            kind = group.id.links.get_info(name.encode("utf-8", "surrogateescape")).type
            if kind != h5py.h5l.TYPE_HARD:
                yield Member(here, None, f"is {_LINKS.get(kind, 'a link of an unknown kind')}")
                continue
            cells = [(here, group[name])]
            while cells:
                here, found = cells.pop(0)
                if found.id in seen or not isinstance(found, (h5py.Group, h5py.Dataset)):
                    continue
                seen.add(found.id)
                if len(seen) > _MOST:
                    raise UnreadableFile(path, f"holds more than {_MOST} objects")
                if matlab and "MATLAB_empty" in found.attrs:
                    continue  # what stands there is its shape
                if matlab and "MATLAB_sparse" in found.attrs:
                    yield Member(here, None, "is sparse")
                elif isinstance(found, h5py.Group):
                    yield Member(here, found)
                    pending.append((here, found))
                elif refused := refused_storage(found):
                    yield Member(here, None, refused)
                elif matlab and h5py.check_ref_dtype(found.dtype) is h5py.Reference:
                    cells += _cells(path, file, here, found)
                else:
                    yield Member(here, found)


def _cells(path: Path, file: Any, place: Place, dataset: Any) -> Iterator[tuple[Place, Any]]:
    """The objects that a MATLAB cell array refers to, all within its file."""
    if check_size(path, dataset, DEFAULT_LIMITS) or dataset.size > _MOST:
        return
    Chunks(path, dataset).check()
    for number, reference in enumerate(dataset[()].ravel(), 1):
        if reference:
            yield (*place[:-1], f"{place[-1]}{{{number}}}"), file[reference]


def refused_storage(dataset: Any) -> str:
    """Why the storage of a dataset must not be read; "" if it may."""
    import h5py

    plan = dataset.id.get_create_plist()
    if plan.get_layout() == h5py.h5d.VIRTUAL:
        return "is a virtual dataset, which is never followed"
    if plan.get_external_count():
        return "keeps its samples in another file (HDF5 external storage), which is never opened"
    foreign = [plan.get_filter(i)[0] for i in range(plan.get_nfilters())]
    foreign = [number for number in foreign if number not in _FILTERS]
    if foreign:
        return f"is packed by a filter that is not HDF5's own (number {foreign[0]})"
    return ""


def check_size(path: Path, dataset: Any, limits: Limits) -> str:
    """Why a dataset of the announced size contains no samples; "" if it does.

    Raises
    ------
    UnreadableFile
        If it announces what is not in the file, or chunks too large to be unpacked.
    """
    import h5py

    shape, dtype = dataset.shape, dataset.dtype
    announced, stored = bytes_of(shape, dtype), dataset.id.get_storage_size()
    if not announced:
        return "is empty"
    if not stored:
        return "announces samples that were never written"
    size = path.stat().st_size
    packed = dataset.id.get_create_plist().get_layout() == h5py.h5d.CHUNKED
    if stored > size or (not packed and stored < announced):
        raise UnreadableFile(
            path,
            f"dataset {dataset.name!r} announces {announced} bytes of samples and "
            f"{min(stored, size)} are there",
            "It is cut short or corrupt",
        )
    if packed and (chunk := bytes_of(dataset.chunks, dtype)) > HARMLESS:
        limits.check(path, chunk, at_once=True)
    return ""


def attributes(item: Any, texts: Texts) -> Iterator[tuple[str, Any]]:
    """Small attributes of a group or dataset that describe samples."""
    for name in item.attrs:
        if fact(name) is None:
            continue
        kind = item.attrs.get_id(name)
        if np.prod(kind.shape, dtype=object) > 4096 or kind.dtype.kind not in "biufOS":
            continue
        try:
            value = texts.attribute(item, name) if kind.dtype.kind == "O" else item.attrs[name]
        except (OSError, TypeError, ValueError, RuntimeError, KeyError):
            continue  # of a type that h5py does not know: nothing that is looked for
        if value is not None:
            yield name, value.item() if isinstance(value, np.ndarray) and value.size == 1 else value
