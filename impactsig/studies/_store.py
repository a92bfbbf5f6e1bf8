"""A study on disk: its identity, a zarr chunk for each tile, and a record of finished tiles.

| file | holds |
|---|---|
| ``study.json`` | the parameters, the code and the tiles, written before anything else |
| ``results.zarr`` | a zarr v3 group: the axes, and an array for each observable, a chunk a tile |
| ``layout.json`` | names, types and shapes of the observables, once the arrays are there |
| ``done/N.json`` | tile N is done: checksums of its chunks, errors of its cells; after the chunks |

Every file is written whole or not at all. A chunk counts only if its record is there and its
checksum right, so that no half-written chunk is ever read back.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from .._extras import library
from .._files.atomic import atomic_path
from ..errors import ImpactsigError, InvalidInput, MissingExtra, UnreadableFile, UnwritableFile
from ._grid import Grid, Tiling
from ._layout import Layout, missing

STUDY, RESULTS, LAYOUT, DONE = "study.json", "results.zarr", "layout.json", "done"
LOCK = ".lock"
FORMAT = 1
EXTRA = "studies"


class Store:
    """The directory of one study."""

    def __init__(self, directory: Path, identity: dict[str, Any], tiling: Tiling) -> None:
        self.directory, self.identity, self.tiling = directory, identity, tiling
        self.study = checksum(json.dumps(identity, sort_keys=True).encode())
        self.errors: dict[int, str] = {}
        self._checksums: dict[int, dict[str, str]] = {}
        layout = _load(directory / LAYOUT)
        self.layout = None if layout is None else Layout.from_json(layout)
        self._arrays = {} if self.layout is None else self._open(self.layout)

    # -- opening ---------------------------------------------------------------------------------

    @classmethod
    def create(cls, directory: Path, identity: dict[str, Any], tiling: Tiling) -> Store:
        """Create a store in a `directory` that has been claimed."""
        axes = {name: values.tolist() for name, values in tiling.grid.axes.items()}
        kinds = {name: values.dtype.str for name, values in tiling.grid.axes.items()}
        _dump(
            directory / STUDY,
            {"format": FORMAT, "tile": tiling.block, "axes": axes, "types": kinds, **identity},
        )
        return cls(directory, identity, tiling)

    @classmethod
    def open(cls, directory: Path) -> Store:
        """Open an existing store.

        Raises
        ------
        UnreadableFile
            If `directory` holds no study.
        """
        require_zarr()
        if not (directory / STUDY).is_file():
            raise UnreadableFile(directory, "holds no study", "Give the directory= of a sweep")
        try:
            stored = _load(directory / STUDY) or {}
            axes, kinds = stored.pop("axes"), stored.pop("types")
            grid = Grid({name: np.array(axes[name], kinds[name]) for name in stored["order"]})
            tiling = Tiling(grid, tuple(stored.pop("tile")))
            if stored.pop("format") != FORMAT:
                raise ValueError("it was written by another version of impactsig")
            store = cls(directory, stored, tiling)
        except (KeyError, TypeError, ValueError) as error:
            raise UnreadableFile(directory / STUDY, f"describes no study ({error})") from None
        store._read_records()
        return store

    def _read_records(self) -> None:
        """Read which tiles are recorded as finished, and verify them."""
        for path in sorted((self.directory / DONE).glob("*.json")):
            record = _load(path)
            if not isinstance(record, dict) or record.get("study") != self.study:
                continue
            tile = record["tile"]
            if all(self._is_whole(tile, *one) for one in record["checksums"].items()):
                self._checksums[tile] = record["checksums"]
                self.errors |= {int(cell): text for cell, text in record["errors"].items()}

    # -- writing ---------------------------------------------------------------------------------

    def lay_out(self, layout: Layout, attributes: Mapping[str, Mapping[str, Any]]) -> None:
        """Create the arrays, once the layout is known."""
        import zarr

        grid, tiling = self.tiling.grid, self.tiling
        with _writing(self.directory / RESULTS):
            group = zarr.create_group(self.directory / RESULTS, overwrite=True, zarr_format=3)
            for name, values in grid.axes.items():
                _write_axis(group, name, values, attributes.get(name, {}))
            for name, kind in layout.kinds.items():
                group.create_array(
                    name,
                    shape=grid.shape + kind.shape,
                    chunks=tiling.block + kind.shape,
                    dtype=kind.dtype,
                    fill_value=missing(kind.dtype),
                    dimension_names=layout.dimensions(name, grid),
                    attributes=dict(attributes.get(name, {})),
                )
        _dump(self.directory / LAYOUT, layout.to_json())
        self.layout = layout
        self._arrays = self._open(layout)

    def write(self, tile: int, arrays: dict[str, np.ndarray], errors: dict[int, str]) -> None:
        """A finished tile: its chunks, and then the record of it."""
        place, shape = self.tiling.place(tile), self.tiling.shape(tile)
        checksums = {}
        for name, values in arrays.items():
            with _writing(self.directory / RESULTS):
                self._arrays[name][place] = values.reshape(shape + values.shape[1:])
            checksums[name] = checksum(self._chunk(tile, name).read_bytes())
        record = {"tile": tile, "study": self.study, "checksums": checksums, "errors": errors}
        _dump(self.directory / DONE / f"{tile}.json", record)
        self._checksums[tile] = checksums
        self.errors |= errors

    def mend_axes(self, attributes: Mapping[str, Mapping[str, Any]]) -> None:
        """Rewrite axes of the results that differ from those of the study.

        The study itself takes its axes from its description; other programs read these.
        """
        if self.layout is None:
            return
        import zarr

        with _writing(self.directory / RESULTS):
            group = zarr.open_group(self.directory / RESULTS, mode="r+")
            for name, values in self.tiling.grid.axes.items():
                given = attributes.get(name, {})
                try:
                    array: Any = group[name]
                    given = dict(array.attrs)
                    whole = np.array_equal(array[...], values) and array.dtype == values.dtype
                except Exception:  # zarr's decoders raise errors of many types
                    whole = False
                if not whole:
                    _write_axis(group, name, values, given)

    def tidy(self) -> None:
        """Remove what a killed process left half written."""
        for pattern in (".*.json.*", f"{DONE}/.*", f"{RESULTS}/**/*.partial"):
            for path in self.directory.glob(pattern):
                path.unlink(missing_ok=True)

    # -- reading ---------------------------------------------------------------------------------

    @property
    def done(self) -> set[int]:
        """Numbers of the finished tiles."""
        return set(self._checksums)

    def read(self, name: str) -> np.ndarray:
        """Read an observable on the whole grid; cells that are not finished are missing.

        Raises
        ------
        UnreadableFile
            If a chunk is not what was written.
        """
        assert self.layout is not None
        known = {tile: own[name] for tile, own in self._checksums.items() if name in own}
        for tile, wanted in known.items():
            if not self._is_whole(tile, name, wanted):
                raise UnreadableFile(
                    self.directory, f"tile {tile} of {name} was damaged since it was opened",
                    "Run the same sweep again: it works out that tile",
                )  # fmt: skip
        array = self._arrays[name]
        if len(known) == len(self.tiling):
            return np.asarray(array[...])
        kind = self.layout.kinds[name]
        whole = np.full(self.tiling.grid.shape + kind.shape, missing(kind.dtype), kind.dtype)
        for tile in known:
            whole[self.tiling.place(tile)] = array[self.tiling.place(tile)]
        return whole

    def _chunk(self, tile: int, name: str) -> Path:
        """The file that holds an observable of a tile."""
        array = self._arrays[name]
        corner = [int(n) for n in np.unravel_index(tile, self.tiling.counts)]
        inner = [0] * (array.ndim - len(corner))
        return self.directory / RESULTS / name / array.metadata.encode_chunk_key((*corner, *inner))

    def _is_whole(self, tile: int, name: str, wanted: str) -> bool:
        if name not in self._arrays:
            return False
        try:
            return checksum(self._chunk(tile, name).read_bytes()) == wanted
        except OSError:
            return False

    def attributes(self) -> dict[str, dict[str, Any]]:
        """What was said of axes and observables."""
        if self.layout is None:
            return {}
        import zarr

        group = zarr.open_group(self.directory / RESULTS, mode="r")
        names = [*self.tiling.grid.axes, *self.layout.kinds]
        return {name: dict(group[name].attrs) for name in names}

    def _open(self, layout: Layout) -> dict[str, Any]:
        import zarr

        try:
            # A chunk of nothing but missing values is written too: its record tells its checksum.
            with zarr.config.set({"array.write_empty_chunks": True}):
                group = zarr.open_group(self.directory / RESULTS, mode="r+")
                return {name: group[name] for name in layout.kinds}
        except (OSError, KeyError, ValueError) as error:
            raise UnreadableFile(self.directory / RESULTS, f"cannot be read ({error})") from None


def _write_axis(group: Any, name: str, values: np.ndarray, attributes: Mapping[str, Any]) -> None:
    group.create_array(
        name, data=values, dimension_names=[name], attributes=dict(attributes), overwrite=True
    )


def claim(directory: Path) -> bool:
    """Create the directory if need be; whether it holds a study.

    Raises
    ------
    InvalidInput
        If something else is in it.
    UnwritableFile
        If it cannot be made.
    """
    require_zarr()
    with _writing(directory):
        directory.mkdir(parents=True, exist_ok=True)
        others = {path.name for path in directory.iterdir() if path.name[0] != "."}
        if others - {DONE} and STUDY not in others:
            raise InvalidInput(
                "directory", directory, "a new or empty directory, or that of a study"
            )
        (directory / DONE).mkdir(exist_ok=True)
    return STUDY in others


@contextmanager
def locked(directory: Path) -> Iterator[None]:
    """Lock the directory; the system releases the lock of a killed process.

    Raises
    ------
    InvalidInput
        If one is at work.
    """
    try:
        import fcntl
    except ImportError:  # no such locks on Windows
        yield
        return
    with _writing(directory):
        lock = (directory / LOCK).open("w")
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InvalidInput(
                "directory", directory, "a directory in which no other sweep is at work"
            ) from None
        except OSError:  # a file system without locks
            pass
        yield


def require_zarr() -> None:
    """Raise MissingExtra where zarr is not installed, or too old."""
    zarr = library("zarr", EXTRA, "A study in a directory")
    if int(zarr.__version__.partition(".")[0]) < 3:
        raise MissingExtra(f"zarr 3 (here is {zarr.__version__})", EXTRA, "A study in a directory")


def checksum(content: bytes) -> str:
    """A short digest of bytes."""
    return hashlib.blake2b(content, digest_size=16).hexdigest()


def _dump(path: Path, content: Any) -> None:
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(content, sort_keys=True), encoding="utf-8")


def _load(path: Path) -> Any:
    """Content of a file; None if it is missing or damaged."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except ImpactsigError:
        raise
    except OSError as error:
        raise UnwritableFile(
            path, f"cannot be written ({error.strerror or error})",
            "What is done is kept: make room or give access, and run the same sweep again",
        ) from error  # fmt: skip
