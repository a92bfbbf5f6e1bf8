"""Every argument of every public callable, given what it cannot be."""

from __future__ import annotations

import inspect
import math
import re
import warnings
from pathlib import Path

import numpy as np
import pytest

import impactsig
from impactsig import ImpactsigError, InvalidInput, UnreadableFile

from ..valid_calls import Things, valid_calls

WRONG = {
    "text": "no such thing",
    "bytes": b"x",
    "True": True,
    "None": None,
    "nan": math.nan,
    "inf": math.inf,
    "huge": 10**30,
    "complex": 2 + 1j,
    "object": object(),
    "numbers": np.array([1e300, -1e300, 5.0]),
    "cube": np.zeros((2, 2, 2)),
    "nan in an array": np.array([math.nan]),
    "empty": [],
    "mixed": [1, 2, "a"],
    "complex numbers": np.array([1j, 2, 3]),
    "scalar array": np.array(3),
    "date": np.datetime64("NaT"),
}
QUICK = ("text", "complex", "object", "cube", "mixed", "complex numbers")
NEVER_MEANT = {"complex", "object", "cube", "complex numbers"}
ANYTHING = {("Impacts", "settings")}  # kept as it is
ENDLESS = {  # it means what it says, and the run would not end
    ("huge", name) for name in ("periods", "duration", "transient", "count", "period")
}


@pytest.fixture(scope="module")
def calls(tmp_path_factory):
    folder = tmp_path_factory.mktemp("valid")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)  # where a text may well name a directory, which is made
        yield valid_calls(Things(folder))


def test_every_public_callable_has_a_valid_call(calls):
    public = {name: getattr(impactsig, name) for name in impactsig.__all__}
    errors = {name for name in public if hasattr(impactsig.errors, name)}
    callables = {name for name, found in public.items() if callable(found)}
    assert callables - errors - {"Experiment"} == set(calls)  # which is read from a folder


def tried(name, calls, wrong):
    """What happens to each argument: the name, what was given, and the error if it has no name."""
    args, options = calls[name]
    function = getattr(impactsig, name)
    signature = inspect.signature(function)
    given = dict(signature.bind(*args, **options).arguments)
    more = given.pop("options", {})
    free = {p.name for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD}
    for argument in sorted((free | set(more)) - {"self"}):
        for label in wrong:
            if (label, argument) in ENDLESS:
                continue
            try:
                found = function(**given | more | {argument: WRONG[label]})
                if inspect.isgenerator(found):
                    next(found, None)
            except ImpactsigError as error:
                named = argument in str(error) or isinstance(error, UnreadableFile)  # a file's
                yield argument, label, None if named else error
            except Exception as error:
                yield argument, label, error
            else:
                wrong_taken = label in NEVER_MEANT and (name, argument) not in ANYTHING
                yield argument, label, TypeError("taken") if wrong_taken else None


def known():
    """The names of `valid_calls`, read without making anything."""
    text = (Path(__file__).parents[1] / "valid_calls.py").read_text(encoding="utf-8")
    return re.findall(r'^    call\("(\w+)"', text, re.MULTILINE)


def judge(name, calls, wrong):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        untyped = [
            f"{argument} = {label}: {type(error).__name__}: {error}"
            for argument, label, error in tried(name, calls, wrong)
            if error is not None
        ]
    assert not untyped


SLOW = {"write_report", "write_reports", "detect_many", "fit_oscillator"}


@pytest.mark.parametrize("name", [name for name in known() if name not in SLOW])
def test_what_an_argument_cannot_be_is_refused_by_its_name(name, calls):
    judge(name, calls, QUICK)


@pytest.mark.slow
@pytest.mark.parametrize("name", known())
def test_so_is_everything_else(name, calls):
    judge(name, calls, WRONG)


FORCED = impactsig.Oscillator(
    damping=0.1,
    forces=(impactsig.Force(0.5, 1.0),),
    stops=(impactsig.Stop(0.3, impactsig.Hertz(50.0)),),
)
CLAMPED = impactsig.Cantilever(
    0.2, 0.02, 0.001, 2e11, 7800.0, modes=2, forcing=impactsig.BaseMotion(1e-3, 10.0)
)
SHAKEN = impactsig.Oscillator(damping=0.2, noise=impactsig.Noise(0.1))
FED = impactsig.DelayedFeedback(0.05)
FLOWS_FED = impactsig.DelayedFeedback(0.2, delay=5.88, signal="y")
SYSTEMS = {
    "stepped": (FORCED, {"periods": 2}),
    "cantilever": (CLAMPED, {"periods": 2}),
    "flow": (impactsig.flows.lorenz(), {"duration": 1.0}),
    "noisy": (SHAKEN, {"duration": 3.0, "seed": 1}),
    "controlled": (impactsig.Controlled(FORCED, FED), {"periods": 3}),
    "controlled flow": (
        impactsig.Controlled(impactsig.flows.rossler(), FLOWS_FED, start=6.0), {"duration": 9.0}
    ),
    "swept": (impactsig.Swept(FORCED, frequency_rate=1e-4), {"duration": 3.0}),
}  # fmt: skip
ASKED = {
    "simulate": (sorted(set(inspect.signature(impactsig.simulate).parameters) - {"system"}), 7),
    "tangent_map": (["chatter", "initial", "method", "phase", "transient"], 4),
    "lyapunov_spectrum": (["chatter", "initial", "method", "phase", "transient"], 4),
}


@pytest.mark.parametrize(
    ("question", "system"),
    [(question, name) for question, (_, n) in ASKED.items() for name in list(SYSTEMS)[:n]],
)
def test_every_system_refuses_what_an_option_cannot_be(question, system):
    what, given = SYSTEMS[system]
    for option in ASKED[question][0]:
        for wrong in sorted(NEVER_MEANT):
            with pytest.raises(InvalidInput, match=option):
                getattr(impactsig, question)(what, **given | {option: WRONG[wrong]})


class Uncountable(list):
    """A sequence whose items cannot be counted."""

    def __len__(self):
        raise ArithmeticError


class Unreadable(list):
    """A sequence whose items cannot be read."""

    def __iter__(self):
        raise ArithmeticError


class Asked:
    """An object that raises whatever it is asked for."""

    def __getattr__(self, name):
        raise ArithmeticError


LORENZ = impactsig.flows.lorenz()
ODD = {
    "channels": lambda: impactsig.Recording(np.zeros(3), 1.0, channels=Uncountable("a")),
    "units": lambda: impactsig.Recording(np.zeros(3), 1.0, units=Unreadable("a")),
    "coordinates": lambda: impactsig.Flow(LORENZ.function, [1.0], coordinates=Unreadable("a")),
    "channel": lambda: impactsig.Rig(channel=Unreadable([{"number": 0}])),
    "impacts": lambda: impactsig.fit_oscillator(Unreadable(), [1.0], natural_frequency=1.0),
    "raw.dtype": lambda: impactsig.RawLayout(Asked()),
}


@pytest.mark.parametrize("argument", ODD)
def test_what_raises_when_it_is_looked_at_is_refused_by_its_name(argument):
    with pytest.raises(InvalidInput, match=argument):
        ODD[argument]()


def of_none():
    raise AssertionError  # it cannot be called with what it is given


FUNCTIONS = {
    "scene": [
        lambda: impactsig.bifurcation_diagram(of_none, [1.0]),
        lambda: impactsig.periodicity_chart(lambda a: FORCED, [1.0], [1.0]),
        lambda: impactsig.p_bifurcation(of_none, [1.0]),
        lambda: impactsig.response_spectrum(of_none, [1.0]),
    ],
    "scene_of_parameter": [lambda: impactsig.continue_orbit(of_none, (1.0, 2.0))],
    "first": [lambda: impactsig.match_rate(lambda a: FORCED, of_none, [1.0], [1.0])],
    "statistic": [lambda: impactsig.surrogate_test(np.random.default_rng(1).random(99), of_none)],
    "fit": [
        lambda: impactsig.correlation_dimension(np.random.default_rng(1).random(99), fit=of_none)
    ],
    "function": [lambda: impactsig.Flow(lambda t, y: y, [1.0], [2.0])],
    "signal": [lambda: impactsig.Flow(lambda t, y: y, [1.0], signal=Asked)],
    "law": [lambda: impactsig.Oscillator(law=lambda x: x)],
}


@pytest.mark.parametrize("argument", FUNCTIONS)
def test_a_function_of_other_arguments_is_refused_by_its_name(argument):
    for call in FUNCTIONS[argument]:
        with pytest.raises(InvalidInput, match=f"^{argument}: "):
            call()


def test_functions_whose_arguments_python_does_not_know_are_called():
    series = np.random.default_rng(1).random(99)
    assert impactsig.surrogate_test(series, max, seed=1).name == "max"


def test_a_forcing_period_is_judged_before_the_number_of_impacts():
    train = impactsig.Impacts.from_times(np.arange(1.0, 9.0))
    with pytest.raises(InvalidInput, match="forcing_period: got 1e-06"):
        impactsig.fit_oscillator(train, 1e-6, natural_frequency=2.0)
