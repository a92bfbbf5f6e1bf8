"""`impactsig simulate SCENE`: its options are the parameters of the scene, read off its signature.

A new function in `impactsig.scenes` is a new scene of the command: its annotations say how words
are understood, its docstring what ``--help`` says.
"""

from __future__ import annotations

import argparse
import inspect
import re
import types
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin, get_type_hints

from ..oscillators import Oscillator, scenes
from ._options import given
from ._values import number

if TYPE_CHECKING:
    from ..simulation.motion import Motion
    from ..stochastic.noisy_motion import NoisyMotion

PERIODS = 1000
"""Forcing periods simulated by default."""


def add_scenes(
    command: argparse.ArgumentParser,
    add_options: Callable[[argparse.ArgumentParser], None] | None = None,
    required: bool = True,
) -> None:
    """Add a subcommand for each scene, with the scene's parameters and the command's own options.

    Unless `required`, parameters without a default may be left out: they are given otherwise.
    """
    choice = command.add_subparsers(title="scenes", metavar="SCENE", dest="scene", required=True)
    for name, scene in _scenes().items():
        summary, descriptions = read_docstring(scene)
        parser = choice.add_parser(name, help=summary, description=summary, allow_abbrev=False)
        group = parser.add_argument_group("the scene")
        parameters = _parameters(scene)
        for parameter in parameters.values():
            description = descriptions.get(parameter.name, "")
            _add_parameter(group, scene, parameter, description, required)
        _add_run_options(parser)
        (add_options or _add_own_options)(parser)
        parser.set_defaults(make=scene, parameters=list(parameters))


def simulated(chosen: argparse.Namespace) -> Motion | NoisyMotion:
    """Simulate the scene that the command line describes; one path if it has noise."""
    scene = chosen.make(**given(chosen, chosen.parameters))
    from ..simulation import simulate

    noisy = scene.noise is not None and scene.noise.intensity > 0
    return simulate(scene, **run_of(chosen), **({"seed": chosen.seed} if noisy else {}))


def run_of(chosen: argparse.Namespace) -> dict[str, Any]:
    """The options of `simulate` that the user gave."""
    length = {"periods": chosen.periods, "duration": chosen.duration}
    if chosen.periods is None and chosen.duration is None:
        length["periods"] = PERIODS
    return {
        **length,
        "transient": chosen.transient,
        "initial": tuple(chosen.initial),
        "phase": chosen.phase,
    }


def in_words(motion: Motion | NoisyMotion) -> str:
    """Describe the motion in a paragraph."""
    from ..intervals import identify_period
    from ..simulation.motion import Motion

    oscillator, impacts = motion.system, motion.impacts
    assert impacts is not None
    forcing, met = oscillator.forcing_period, _count(len(impacts), "impact")
    unit = " s" if oscillator.in_seconds else ""
    span, rate = f"{impacts.duration:.6g}{unit}", ""
    if forcing is not None:
        periods = impacts.duration / forcing
        span = f"{periods:.6g} forcing periods ({span})"
        rate = f", {len(impacts) / periods:.4g} per period"
    if isinstance(motion, Motion):
        period = identify_period(impacts, forcing)
        parts = [
            _count(motion.stick_count, "stick"),
            # The rebounds of a chatter may hide the period of a motion: not found is not aperiodic.
            "no period(m, n) identified" if period.aperiodic else period.describe(),
        ]
    else:
        parts = [f"one path under noise, in steps of {motion.step:.3g}{unit}"]
    text = "; ".join([f"{met} in {span}{rate}", *parts, f"status: {motion.status}"])
    return f"{oscillator.name}: {text}."


def _count(number: int, what: str) -> str:
    return f"{number or 'no'} {what}{'s' * (number != 1)}"


def _add_run_options(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("the run")
    group.add_argument(
        "--periods", type=number, metavar="N", help=f"number of forcing periods ({PERIODS})"
    )
    group.add_argument(
        "--duration", type=number, metavar="S", help="duration [s], instead of periods"
    )
    group.add_argument(
        "--transient",
        type=number,
        default=0.0,
        metavar="N",
        help="transient in forcing periods, or seconds with --duration (0)",
    )
    group.add_argument(
        "--initial",
        type=number,
        nargs=2,
        default=(0.0, 0.0),
        metavar=("X", "V"),
        help="displacement and velocity at the start (0 0)",
    )
    group.add_argument(
        "--phase",
        type=number,
        default=0.0,
        metavar="RAD",
        help="phase of the forcing at the start (0)",
    )


def _add_own_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of `simulate` itself."""
    group = parser.add_argument_group("noise")
    group.add_argument(
        "--seed",
        type=int,
        default=0,
        metavar="N",
        help="seed of the noise, for scenes with noise (0)",
    )
    group = parser.add_argument_group("output")
    group.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="OUT",
        help="a .csv or .parquet file for the impacts (default: CSV to standard output)",
    )
    group.add_argument(
        "--figure",
        type=Path,
        metavar="OUT",
        help="a .png, .pdf or .svg file: phase portrait, or displacement over time under noise",
    )


# -- scenes --------------------------------------------------------------------------------------


def _scenes() -> dict[str, Callable[..., Oscillator]]:
    return {
        name: one
        for name, one in vars(scenes).items()
        if inspect.isfunction(one) and one.__module__ == scenes.__name__ and name[0] != "_"
    }


def _parameters(scene: Callable[..., Oscillator]) -> dict[str, inspect.Parameter]:
    """Named parameters of a scene; others cannot be given on a command line."""
    given = inspect.signature(scene).parameters
    return {k: one for k, one in given.items() if one.kind is not inspect.Parameter.VAR_KEYWORD}


def _add_parameter(
    group: Any,
    scene: Callable[..., Oscillator],
    parameter: inspect.Parameter,
    description: str,
    required: bool,
) -> None:
    kind = get_type_hints(scene)[parameter.name]
    if get_args(kind) == (float, types.NoneType):
        kind = float
    needed = parameter.default is inspect.Parameter.empty
    ending = "required" if needed else f"default: {_brief(parameter.default)}"
    words: dict[str, Any] = {
        "help": f"{description} ({ending})".replace("%", "%%"),
        "required": needed and required,
    }
    if get_origin(kind) is Literal:
        words["choices"] = get_args(kind)
    elif get_origin(kind) is types.UnionType:  # float | tuple[float, float]
        words |= {"type": number, "nargs": "+", "action": _OneOrTwo, "metavar": "X"}
    else:
        words |= {"type": number, "metavar": "X"}
    group.add_argument(f"--{parameter.name.replace('_', '-')}", **words)


class _OneOrTwo(argparse.Action):
    """A number where one is given, else a pair."""

    def __call__(self, parser: Any, namespace: Any, values: Any, option: Any = None) -> None:
        setattr(namespace, self.dest, values[0] if len(values) == 1 else tuple(values))


def _brief(value: Any) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def read_docstring(function: Callable[..., Any]) -> tuple[str, dict[str, str]]:
    """The first line and the description of each parameter of a numpydoc docstring."""
    text = (inspect.getdoc(function) or "").replace("]_", "]").replace("`", "")
    descriptions: dict[str, str] = {}
    names: list[str] = []
    _, _, rest = text.partition("Parameters\n----------\n")
    for line in rest.splitlines():
        if re.match(r"[-=]+$", line):  # of the next section
            break
        if line.startswith(" "):
            for name in names:
                descriptions[name] = f"{descriptions.get(name, '')} {line.strip()}".strip()
        elif " : " in line:
            names = line.partition(" : ")[0].split(", ")
        else:
            names = []
    return text.partition("\n")[0], descriptions
