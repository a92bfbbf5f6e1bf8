"""Types of variables, found without asking again what has met no new type.

numba asks each statement of a function for types until no variable has a new one, so most of them
twice, each within settings of warnings and the text of an error that are made anew.
"""

from __future__ import annotations

from typing import Any

from numba.core import errors, lowering, typeinfer, types, utils
from numba.core.errors import NumbaError, TypingError

_TYPES: Any = typeinfer
_errors: Any = errors
_ASKED_ONCE = (
    _TYPES.Propagate, _TYPES.ArgConstraint, _TYPES.CallConstraint, _TYPES.IntrinsicCallConstraint,
    _TYPES.GetAttrConstraint, _TYPES.SetItemConstraint, _TYPES.StaticGetItemConstraint,
    _TYPES.StaticSetItemConstraint, _TYPES.BuildTupleConstraint, _TYPES.ExhaustIterConstraint,
    _TYPES.PairFirstConstraint, _TYPES.PairSecondConstraint,
)  # fmt: skip
"""Statements whose types follow from those of the variables in them, and from nothing else."""


def _variable(variables: Any, name: str) -> Any:
    """A variable with its type; noted for the statement that asks for it."""
    found = variables.get(name)
    if found is None:
        found = _TYPES.TypeVar(variables.context, name)
        variables[name] = found
    noted = variables.__dict__.get("noted")
    if noted is not None:
        noted.append(found)
    return found


def _propagate(network: Any, inferred: Any) -> list[Exception]:
    """As `ConstraintNetwork.propagate`; warnings name the function, not the line."""
    variables, place = inferred.typevars, inferred.func_ir.loc
    known = network.__dict__.setdefault("known", {})
    failed: list[Exception] = []
    with inferred.warnings.catch_warnings(filename=place.filename, lineno=place.line):
        for number, statement in enumerate(network.constraints):
            met = known.get(number)
            if met and all(variable.type is kind for variable, kind in met):
                if type(statement) is _TYPES.Propagate:
                    inferred.refine_map[statement.dst] = statement
                continue
            noted: list[Any] = []
            variables.noted = noted
            try:
                statement(inferred)
            except errors.ForceLiteralArg as error:
                failed.append(error)
            except TypingError as error:
                told = TypingError(str(error), loc=statement.loc, highlighting=False)
                failed.append(utils.chain_exception(told, error))
            else:
                if type(statement) in _ASKED_ONCE and all(map(_is_settled, noted)):
                    known[number] = [(variable, variable.type) for variable in noted]
            variables.noted = None
    return failed


def _is_settled(variable: Any) -> bool:
    """Whether a variable has a type that nothing but another type of it would change."""
    kind = variable.type
    return kind is not None and kind.is_precise() and not isinstance(kind, types.RecursiveCall)


class _Told:
    """Tells any error within what was done, as `errors.new_error_context`."""

    __slots__ = "named", "parts", "text"

    def __init__(self, text: str, *parts: Any, **named: Any) -> None:
        self.text, self.parts, self.named = text, parts, named
        place = named.get("loc")
        if place is not None and not place.filename.startswith(_errors._numba_path):
            _errors.loc_info.update(named)

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        if isinstance(error, NumbaError):
            error.add_context(_errors._format_msg(self.text, self.parts, self.named))


CHANGED: tuple[tuple[Any, str, Any], ...] = (
    (_TYPES.ConstraintNetwork, "propagate", _propagate),
    (_TYPES.TypeVarMap, "__getitem__", _variable),
    (_TYPES, "new_error_context", _Told),
    (lowering, "new_error_context", _Told),
)
