"""`impactsig sweep SCENE` and `impactsig plot DIR`: options and output."""

from __future__ import annotations

import argparse
import inspect
import re
from collections.abc import Iterator
from fractions import Fraction
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_origin, get_type_hints

from ..errors import ImpactsigWarning, InvalidInput
from ._files import FIGURES, check_ending, write_figure
from ._observables import OBSERVABLES, USUAL, Observing
from ._options import given
from ._simulating import add_scenes, read_docstring, run_of

if TYPE_CHECKING:
    from ..studies.study import Study

LONGEST = 10_000_000
"""Values that a range may have."""


def add_sweep(command: argparse.ArgumentParser) -> None:
    """Add a subcommand for each scene, with the options of a sweep."""
    add_scenes(command, _add_sweep_options, required=False)


def _add_sweep_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("the sweep")
    group.add_argument(
        "--over",
        type=_range,
        action="append",
        required=True,
        metavar="NAME=RANGE",
        help="a parameter of the scene and its values, from:to:step or a,b,c; again for a second "
        "axis",
    )
    group.add_argument(
        "--observe",
        nargs="+",
        choices=tuple(OBSERVABLES),
        default=USUAL,
        metavar="NAME",
        help=f"what to work out ({' '.join(USUAL)}); "
        + "; ".join(f"{name}: {one.description}" for name, one in OBSERVABLES.items()),
    )
    group.add_argument(
        "-o", "--out", type=Path, required=True, metavar="DIR",
        help="directory to keep the study in; if it is there already, go on with it",
    )  # fmt: skip
    group.add_argument(
        "--workers", type=_count, metavar="N", help="processes (default: number of cores)"
    )
    group.add_argument(
        "--cluster", metavar="ADDRESS", help="address of a dask scheduler, to work there instead"
    )
    group.add_argument("--tile", type=_count, metavar="N", help="number of cells per tile")


def swept(chosen: argparse.Namespace) -> Iterator[str]:
    """Run the sweep; yields the output line by line."""
    from ..studies.sweeping import sweep

    axes = _axes(chosen)
    fixed = given(chosen, chosen.parameters)
    names = tuple(dict.fromkeys(chosen.observe))
    observing = Observing(chosen.make, fixed, run_of(chosen), names)
    _try(observing, axes)
    where: dict[str, Any] = {"executor": "processes", "workers": chosen.workers}
    if chosen.cluster is not None:
        if chosen.workers is not None:
            raise InvalidInput("workers", chosen.workers, "none with a cluster, which has its own")
        where = {"client": chosen.cluster}
    elif chosen.workers == 1:
        where = {"executor": "serial"}
    attributes = {name: dict(OBSERVABLES[name].attributes) for name in names}
    try:
        study = sweep(
            observing,
            axes,
            vectorized=True,
            directory=chosen.out,
            tile=chosen.tile,
            attributes=attributes | _units(chosen.make, axes),
            **where,
        )
    except KeyboardInterrupt:
        _warn(f"stopped; what is done is kept in {chosen.out}, the same command goes on")
        raise
    yield f"{chosen.scene}: {in_words(study)}"
    yield f"kept in {chosen.out}; see it by: impactsig plot {chosen.out}"


def in_words(study: Study) -> str:
    """Describe a study."""
    axes = " x ".join(f"{len(values)} {name}" for name, values in study.parameters.items())
    parts = [f"{study.done.size} cells ({axes})", ", ".join(study.observables) or "nothing known"]
    left = study.done.size - int(study.done.sum())
    if left:
        parts.append(f"{left} cells still to do")
    if study.errors:
        parts.append(f"{len(study.errors)} failed")
    return "; ".join(parts)


def add_plot_options(command: argparse.ArgumentParser) -> None:
    """Add the options of `impactsig plot`."""
    command.add_argument("directory", type=Path, metavar="DIR", help="the --out directory of sweep")
    command.add_argument(
        "--observe", nargs="+", metavar="NAME", help="what to draw (default: everything)"
    )
    command.add_argument(
        "--at", type=_value, action="append", default=[], metavar="NAME=VALUE",
        help="fix a parameter at the value nearest to this",
    )  # fmt: skip
    command.add_argument(
        "-o", "--output", type=Path, metavar="OUT",
        help="a .png, .pdf or .svg file (default: study.png in DIR)",
    )  # fmt: skip


def drawn(chosen: argparse.Namespace) -> Iterator[str]:
    """Draw a study, a panel for each observable; returns a line that says where."""
    check_ending(chosen.output, FIGURES)
    from ..studies.study import open_study

    study = open_study(chosen.directory)
    names = list(dict.fromkeys(chosen.observe or study.observables))
    at = dict(chosen.at)

    def draw(figure: Any) -> None:
        panels = figure.subplots(len(names) or 1, squeeze=False)[:, 0]
        for ax, name in zip(panels, names or [None], strict=True):
            study.plot(name, ax, at=at)

    output = chosen.output or chosen.directory / "study.png"
    write_figure(draw, output, (7.0, 2.9 * max(1, len(names)) + 0.3))
    yield in_words(study)
    yield f"figure: {output}"


# -- words of the command line ---------------------------------------------------------------------


def _range(text: str) -> tuple[str, list[float]]:
    """A name and values. What stands there is meant: 20:24:0.01 has 20.99, not its neighbour."""
    name, equals, words = text.partition("=")
    name = name.strip().replace("-", "_")
    if not name or not equals:
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=RANGE")
    ends = words.split(":")
    try:
        if len(ends) == 1:
            values = [float(Fraction(word)) for word in words.split(",")]
        else:
            first, last, step = (Fraction(word) for word in ends)
            if not step or (last - first) / step < 0:
                raise ValueError
            count = int((last - first) / step) + 1
            if count > LONGEST:
                raise argparse.ArgumentTypeError(f"{text!r} has {count} values, over {LONGEST}")
            values = [float(first + n * step) for n in range(count)]
    except (ValueError, ZeroDivisionError, OverflowError):
        values = []
    if not values or not all(map(isfinite, values)):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a range: required NAME=from:to:step, or NAME=a,b,c, of numbers"
        )
    return name, values


def _value(text: str) -> tuple[str, float]:
    name, values = _range(text)
    if len(values) != 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE")
    return name, values[0]


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number, 1 or greater")
    return int(text)


# -- scenes ----------------------------------------------------------------------------------------


def _axes(chosen: argparse.Namespace) -> dict[str, list[float]]:
    """Validate the axes: parameters of the scene, with all that it requires."""
    hints = get_type_hints(chosen.make)
    numbers = [name for name in chosen.parameters if get_origin(hints[name]) is not Literal]
    axes: dict[str, list[float]] = {}
    for name, values in chosen.over:
        if name not in numbers or name in axes:
            required = f"a parameter of {chosen.scene} that is a number, once: {', '.join(numbers)}"
            raise InvalidInput("over", name, required)
        if getattr(chosen, name) is not None:
            raise InvalidInput(name, getattr(chosen, name), f"no value, as it is in --over {name}=")
        axes[name] = values
    for name, one in inspect.signature(chosen.make).parameters.items():
        needed = one.default is one.empty and one.kind is not one.VAR_KEYWORD
        if needed and name not in axes and getattr(chosen, name) is None:
            option = name.replace("_", "-")
            raise InvalidInput(name, "nothing", "a value or a range", f"Give --{option} or --over")
    return axes


def _try(observing: Observing, axes: dict[str, list[float]]) -> None:
    """Run one cell, so that an error of the command itself shows before the sweep begins."""
    import numpy as np

    def observe(place: int) -> None:
        observing(**{name: np.array([values[place]]) for name, values in axes.items()})

    try:
        observe(0)
    except Exception:
        observe(-1)


def _units(scene: Any, axes: dict[str, list[float]]) -> dict[str, dict[str, str]]:
    """Units of the axes, as the scene's docstring has them at the end of a parameter's sentence."""
    _, descriptions = read_docstring(scene)
    found = {name: re.match(r"[^.]*\[(\w+)\]\.", descriptions.get(name, "")) for name in axes}
    return {name: {"units": unit[1]} if unit else {} for name, unit in found.items()}


def _warn(text: str) -> None:
    import warnings

    warnings.warn(text, ImpactsigWarning, stacklevel=1)
