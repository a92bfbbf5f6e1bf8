"""Experiment: the runs of a rig, one for each recording."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arguments import choice, whole
from .._arguments import path as path_of
from .._extras import library
from .._showing import Shown, figures
from ..errors import ImpactsigError, InvalidInput
from ..impacts import Impacts
from ._kept import Kept
from ._reading import KEPT, read_runs
from ._transitions import Hysteresis, Jump, hysteresis_of, jumps_in_sweeps, jumps_of
from .points import QUANTITIES, Point, branch_of, cloud_of, points_of
from .rig import RIG, Rig

if TYPE_CHECKING:
    import pandas as pd
    import xarray
    from matplotlib.axes import Axes

COLUMNS = (
    "period", "kind", "m", "n", "confidence", "forcing_frequency", "locked_frequency", "impacts",
    "impacts_per_period", "interval", "interval_spread", "contact_time", "contact_time_error",
    "contact_time_spread", "time_in_contact", "peak", "peak_spread", "impulse", "impulse_spread",
    "jitter", "missed", "spurious", "dimension", "dimension_low", "dimension_high", "duration",
    "unit", "sensor", "reason", "recorded_at", "notes",
)  # fmt: skip
"""Of the table of runs, after file, parameter and branch."""
_WORDS = ("period", "kind", "unit", "sensor", "reason", "recorded_at", "notes")


@dataclass(frozen=True, eq=False, repr=False)
class Experiment(Shown):
    """The runs of a rig, in the order of branch and parameter.

    Attributes
    ----------
    rig : Rig
        How the recordings are read.
    files : tuple of Path
        The recording of each run.
    values : numpy.ndarray, shape (n,)
        Parameter value of each run; NaN if the rig defines none.
    branches : tuple of str
        "up", "down", another word, or an empty text.
    errors : dict of Path to ImpactsigError
        Recordings that could not be analysed, and why.
    directory : Path
        Folder in which the runs are stored.

    See Also
    --------
    Rig, plot.experiment, detect_many

    Examples
    --------
    >>> import tempfile
    >>> from impactsig import Experiment
    >>> kept = tempfile.mkdtemp()
    >>> runs = Experiment.read("data_samples/experiment", directory=kept, workers=1, progress=False)
    >>> len(runs.files), len(runs.errors)
    (22, 0)
    """

    rig: Rig
    files: tuple[Path, ...] = field(repr=False)
    values: np.ndarray = field(repr=False)
    branches: tuple[str, ...] = field(repr=False)
    errors: dict[Path, ImpactsigError]
    directory: Path
    _keys: tuple[str, ...] = field(repr=False)

    @classmethod
    def read(
        cls,
        folder: str | PathLike[str],
        rig: Rig | str | PathLike[str] | None = None,
        *,
        directory: str | PathLike[str] | None = None,
        workers: int | None = None,
        client: Any = None,
        progress: bool | None = None,
    ) -> Experiment:
        """Analyse all recordings of a folder, in parallel processes.

        Each run is stored on disk as soon as it is analysed, under a key derived from the content
        of the recording, the settings of the rig and the code of this package. Stored runs are not
        analysed again: an interrupted call can be repeated, and only recordings that changed, or to
        which a changed setting applies, are analysed.

        Parameters
        ----------
        folder : path-like
            The folder of the recordings, which may be in subfolders.
        rig : Rig or path-like, optional
            By default the ``rig.toml`` of the folder.
        directory : path-like, optional
            Folder in which the runs are stored; by default ``.impactsig`` in `folder`. The
            processes of a cluster must see it under the same name.
        workers : int, optional
            Number of processes, by default the number of cores. The result does not depend on it.
        client : distributed.Client or str, optional
            Use this dask cluster instead, as for `sweep`.
        progress : bool, optional
            Whether to show a progress bar; by default only in a terminal or notebook.

        Returns
        -------
        Experiment
            The experiment. Recordings that cannot be analysed are listed in `errors`.

        Raises
        ------
        InvalidInput
            If there is no rig, or no recording.
        UnreadableFile
            If the file of the rig, or its table, cannot be used.
        UnwritableFile
            If the runs cannot be stored.
        """
        place = path_of("folder", folder)
        if rig is None:
            if not (place / RIG).is_file():
                raise InvalidInput(
                    "rig", None, f"a Rig, or a {RIG} in the folder",
                    f"impactsig rig FILE -o {place / RIG} writes one",
                )  # fmt: skip
            rig = place / RIG
        used = rig if isinstance(rig, Rig) else Rig.read(path_of("rig", rig))
        kept = Kept(place / KEPT if directory is None else path_of("directory", directory))
        kept.claim()
        found, errors = [], {}
        for task, row in read_runs(used, place, kept, workers, client, progress):
            if isinstance(row, ImpactsigError):
                errors[task.path] = row
                continue
            recorded = row.get("value")
            value = task.place.value if recorded is None else recorded
            found.append((task.place.branch, value, task.path, task.key))
        # up, down, then other branches
        found.sort(key=lambda one: (one[0] != "up", one[0], np.isnan(one[1]), one[1], one[2]))
        return cls(
            used,
            tuple(path for _, _, path, _ in found),
            np.array([value for _, value, _, _ in found], float),
            tuple(branch for branch, _, _, _ in found),
            errors,
            kept.folder,
            tuple(key for _, _, _, key in found),
        )

    # -- reading ---------------------------------------------------------------------------

    def __len__(self) -> int:
        return len(self.files)

    @property
    def parameter(self) -> str:
        """Name of the parameter that differs between runs."""
        return str(self.rig.parameter.get("name", "parameter"))

    @property
    def unit(self) -> str:
        """Unit of the parameter."""
        return str(self.rig.parameter.get("unit", ""))

    def impacts(self, run: int) -> Impacts:
        """The impacts of a run, by its number from 0.

        Raises
        ------
        InvalidInput
            If there is no such run.
        """
        number = whole("run", run, 0, max(len(self) - 1, 0))
        if not len(self):
            raise InvalidInput("run", run, "an experiment with runs")
        return Kept(self.directory).impacts(self._keys[number])

    def to_frame(self) -> pd.DataFrame:
        """A table with a row for each run: parameter, period, and means over the run.

        The mean contact time is Huber's robust mean over seconds [Huber1964]_, since detection
        measures the pulses of each second together.
        """
        import pandas as pd

        columns: dict[str, list[Any]] = {
            "file": [_printable(path.name) for path in self.files],
            self.parameter: self.values.tolist(),
            "branch": list(self.branches),
        }
        rows = [
            {name: row.get(name) for name in COLUMNS} | {"notes": "; ".join(row["notes"])}
            for row in self._rows()
        ]
        for name in COLUMNS:
            values = [row[name] for row in rows]
            columns[name] = values if name in _WORDS else [_number(one) for one in values]
        frame = pd.DataFrame(columns)
        for name in ("m", "n", "impacts"):
            frame[name] = frame[name].astype("Int64")
        return frame

    def to_xarray(self, *quantities: str) -> xarray.Dataset:
        """The table of runs and the quantities of every impact as labelled arrays.

        Parameters
        ----------
        *quantities : str
            "interval", "peak", "contact_time", "impulse" or "phase": values along a dimension of
            their own, whose coordinate ``..._run`` says which run each belongs to.

        Raises
        ------
        InvalidInput
            If there is no such quantity.
        MissingExtra
            If xarray is not installed.
        """
        xarray = library("xarray", "studies", "An experiment as labelled arrays")
        frame = self.to_frame()
        data: dict[str, Any] = {
            name: ("run", frame[name].to_numpy(object if name in _WORDS else float))
            for name in COLUMNS
        }
        coordinates: dict[str, Any] = {
            "file": ("run", frame["file"].to_numpy(object)),
            self.parameter: ("run", self.values, {"units": self.unit}),
            "branch": ("run", np.array(self.branches, object)),
        }
        for name in quantities:
            clouds = [cloud for _, cloud in self.clouds(name)]
            dimension = f"{name}_index"
            data[f"{name}_of_impacts"] = (dimension, np.concatenate([*clouds, np.empty(0)]))
            points = [point.run for point in self.points()]
            lengths = [len(cloud) for cloud in clouds]
            coordinates[f"{name}_run"] = (dimension, np.repeat(np.array(points, int), lengths))
        return xarray.Dataset(data, coordinates)

    # -- over the parameter ----------------------------------------------------------------

    def points(self) -> tuple[Point, ...]:
        """Every parameter value with its motion: one for each run, several for a sweep."""
        return tuple(
            point
            for run, row in enumerate(self._rows())
            for point in points_of(run, row, float(self.values[run]), self.branches[run])
        )

    def clouds(self, quantity: str) -> Iterator[tuple[Point, np.ndarray]]:
        """Values of an impact quantity at every parameter value, as in a bifurcation diagram.

        Parameters
        ----------
        quantity : {"interval", "peak", "contact_time", "impulse", "phase"}
            The quantity. "phase" is in forcing periods, relative to the zero of the forcing if it
            was recorded, otherwise to the mean of the run.

        Yields
        ------
        point : Point
        values : ndarray, shape (k,)
            Of k impacts, or of the intervals between them; empty if it was not measured.
        """
        choice("quantity", quantity, QUANTITIES)
        kept = Kept(self.directory)
        for run, (key, row) in enumerate(zip(self._keys, self._rows(), strict=True)):
            points = points_of(run, row, float(self.values[run]), self.branches[run])
            impacts = kept.impacts(key) if row["impacts"] else None
            for point in points:
                yield point, cloud_of(quantity, point, row, impacts)

    def jumps(self) -> tuple[Jump, ...]:
        """Changes of the motion along each branch: other periods, gained or lost.

        In a sweep a motion is lost later than in a steady experiment. This delay is estimated from
        the transient around the change, subtracted and stated: beyond the frequency at which a
        motion becomes unstable, deviations grow, at first below the noise, and where it becomes
        stable they decay increasingly fast. With sweeps in both directions, the frequency between
        growth and decay is determined; with one direction it is extrapolated. If no transient is
        visible, the error includes the sweep over 20 forcing periods.
        """
        steady = [one for one in self.points() if math.isinf(one.stop)]
        sweeps = [
            (row, branch_of(row, branch))
            for row, branch in zip(self._rows(), self.branches, strict=True)
            if "changes" in row
        ]
        return (*jumps_of(steady), *jumps_in_sweeps(sweeps))

    def hysteresis(self) -> tuple[Hysteresis, ...]:
        """Changes that occur at different parameter values upwards and downwards."""
        return hysteresis_of(self.jumps())

    def plot(self, observe: Any = "interval", ax: Axes | None = None, **options: Any) -> Axes:
        """Draw a quantity over the parameter; see `impactsig.plot.experiment`."""
        axes: Axes = figures("experiment")(self, observe, ax, **options)
        return axes

    def write_report(
        self,
        directory: str | PathLike[str],
        *,
        reports: bool = True,
        simulated: Any = (),
        workers: int | None = None,
        progress: bool | None = None,
    ) -> Path:
        """Write a page with figures and tables that links a report of each recording.

        Parameters
        ----------
        directory : path-like
            Folder for ``index.html``, the tables ``runs.csv`` and ``jumps.csv``, and, in
            ``recordings``, the reports; it is created if necessary. Reports of the same recording,
            settings and version of this package are not written again.
        reports : bool
            Whether to write a report of each recording.
        simulated : BifurcationDiagram or sequence of it, optional
            Simulated diagrams to draw with the measurement.
        workers : int, optional
            Number of processes, by default the number of cores. The result does not depend on it.
        progress : bool, optional
            Whether to show a progress bar; by default only in a terminal or notebook.

        Returns
        -------
        Path
            The page.

        Raises
        ------
        UnwritableFile
            If the directory cannot be created or written.
        """
        from ..report.experiment import write_experiment

        return write_experiment(
            self,
            path_of("directory", directory),
            runs=self._keys,
            reports=reports,
            simulated=simulated,
            workers=workers,
            progress=progress,
        )

    def _rows(self) -> Iterator[dict[str, Any]]:
        kept = Kept(self.directory)
        for key in self._keys:
            row = kept.read(key)
            if isinstance(row, ImpactsigError):
                raise row
            yield row

    def __repr__(self) -> str:
        parts = [f"{len(self)} run{'s' * (len(self) != 1)}"]
        known = self.values[np.isfinite(self.values)]
        if len(known):
            span = f"{known.min():g} to {known.max():g} {self.unit}".rstrip()
            parts.append(f"{self.parameter} {span}")
        if set(self.branches) - {""}:
            parts.append(", ".join(sorted(set(self.branches) - {""})))
        if self.errors:
            parts.append(f"{len(self.errors)} recording{'s' * (len(self.errors) > 1)} failed")
        return f"Experiment({'; '.join(parts)})"


def _printable(name: str) -> str:
    """A file name, with bytes that are no UTF-8 as tables and pages can hold them."""
    return name.encode(errors="backslashreplace").decode()


def _number(value: Any) -> float:
    return np.nan if value is None else float(value)
