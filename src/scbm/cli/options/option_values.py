"""The values of options that verbs share, read from text: goals, states, requirements, networks, time limits."""

from __future__ import annotations

import re
from itertools import count
from typing import TYPE_CHECKING, TypeVar

from msgspec.structs import replace

from scbm.cases import Network
from scbm.cli.options.option_errors import option_error
from scbm.files import DottedText, Scope, parse_duration, parse_predicate, parse_requirement, parse_state, suggestion
from scbm.model import Diagnostic, InputError, Place, Requirement, Slug

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scbm.model import BehaviorModel, Predicate, State


DRAWN = "drawn"
"""The value of `--network` that draws another network for each case."""


def read_time_limit(time_limit: str | None) -> int | None:
    """Return the time limit of a run in nanoseconds; `None` without the option. Raise `InputError`."""
    if time_limit is None:
        return None
    time_limit_ns = parse_duration(time_limit)
    if not time_limit_ns:
        message = f"`{time_limit}` is not a duration to run for"
        remedy = "write a number and a unit: `10 min`, `90 s`"
        raise option_error("--time-limit", message, remedy, time_limit, Slug.BAD_DURATION)
    return time_limit_ns


_QUANTIFIER = re.compile(r"(?<![\w.])(forall|exists|count|sum|min|max)\s+[A-Za-z_]\w*\s*(?:,|:|in\b)", re.ASCII)
T = TypeVar("T")


def _ground(text: str, model: BehaviorModel, option: str) -> DottedText:
    """Return a text with the names of instances in place of names with an index: `at.r1` for `at[r1]`.

    Raises:
        InputError: the text has a quantifier, which only model files have.
    """
    found = _QUANTIFIER.search(text)
    if found is not None:
        message = f"`{found[1]}` is for model files, and this is an option"
        remedy = "write the comparison for each object, or declare it in the model, as a goal or a requirement"
        place = Place(option, 1, found.start(1) + 1, len(found[1]))
        raise InputError([Diagnostic(Slug.PREDICATE_SYNTAX, message, place, remedy, text)])
    return DottedText(text, Scope.of(model).variables)


def _parsed(ground: DottedText, parse: Callable[[str], T]) -> T:
    """Return what `parse` makes of a ground text. Raise its `InputError` with places in the text as it is written."""
    try:
        return parse(ground.text)
    except InputError as error:
        raise InputError([_as_written(diagnostic, ground) for diagnostic in error.diagnostics]) from None


def _as_written(diagnostic: Diagnostic, ground: DottedText) -> Diagnostic:
    place = diagnostic.place
    if not place.line:
        return diagnostic
    begin, end = ground.span(place.column - 1, place.column - 1 + place.length)
    line = re.sub(r"[\r\n]", " ", ground.written)
    return replace(diagnostic, place=Place(place.file, 1, begin + 1, end - begin), source_line=line)


def read_goal(text: str, model: BehaviorModel) -> tuple[str, Predicate]:
    """Return a goal of the model by its name, or a predicate, which is then its own name. Raise `InputError`."""
    scope = Scope.of(model)
    ground = DottedText(text, scope.variables)
    name = ground.text
    named = model.goal(name)
    if named is not None:
        return name, named
    is_name = name.replace(".", "_").isidentifier() and name not in scope.variables
    if is_name and name not in ("true", "false"):
        names = [known for known, _ in model.goals]
        remedy = suggestion(name, names, "its goals are") or "write a predicate, such as `robot_at == home`"
        message = f"the model has no goal `{name}`"
        raise InputError([Diagnostic(Slug.UNKNOWN_GOAL, message, Place("--goal", 1, 1, len(text)), remedy, text)])
    ground = _ground(text, model, "--goal")
    predicate = _parsed(ground, lambda written: parse_predicate(written, scope, file="--goal"))
    return str(predicate), predicate


def read_state(assignments: Sequence[str], model: BehaviorModel) -> State:
    """Return the nominal state with variables changed by `variable=value`. Raise `InputError` with all errors."""
    ground = _ground(", ".join(assignments), model, "--state")
    return _parsed(ground, lambda written: parse_state(written, model.space, file="--state"))


def read_requirements(sentences: Sequence[str], model: BehaviorModel) -> tuple[Requirement, ...]:
    """Return the requirements of the command line, named `required_1`, … Raise `InputError` with all errors."""
    scope = Scope.of(model)
    taken = [requirement.name for requirement in model.requirements]
    names = (f"required_{number}" for number in count(1))
    free = (name for name in names if name not in taken)
    wrong: list[Diagnostic] = []
    requirements = []
    for sentence in sentences:
        try:
            ground = _ground(sentence, model, "--require")
            form = _parsed(ground, lambda written: parse_requirement(written, scope, file="--require"))
            requirements.append(Requirement(next(free), form))
        except InputError as error:
            wrong += error.diagnostics
    if wrong:
        raise InputError(wrong)
    return tuple(requirements)


def read_faults(text: str | None, model: BehaviorModel) -> Network | None:
    """Return the network of `--network`; `None` for `drawn`. Raise `InputError`."""
    if text is None:
        return Network()
    if text.strip() == DRAWN:
        return None
    from scbm.files import read_network  # noqa: PLC0415 - the keys of case files, which few runs need

    return read_network(text, model, file="--network")


def allowed_state(state: State, model: BehaviorModel) -> State:
    """Return the state. Raise `InputError` if the model does not allow it as an initial state."""
    if model.initial_states.holds(state):
        return state
    message = f"this state does not satisfy `initial_states`: {model.initial_states}"
    raise InputError([Diagnostic(Slug.INITIAL_STATE_NOT_ALLOWED, message, Place("--state"))])
