"""The values of options that verbs share, read from text: goals, states, requirements, networks, time limits."""

from __future__ import annotations

import re
from itertools import count
from typing import TYPE_CHECKING

from scbm.cases import Network
from scbm.cli.options.option_errors import option_error
from scbm.files import Scope, parse_duration, parse_predicate, parse_requirement, parse_state, suggestion
from scbm.model import Diagnostic, InputError, Place, Requirement, Slug

if TYPE_CHECKING:
    from collections.abc import Container, Sequence

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


_QUANTIFIER = re.compile(r"(?<![\w.])(forall|exists|count)\s+[A-Za-z_]\w*\s*(?:,|:|in\b)", re.ASCII)
_INDEXED = re.compile(r"([A-Za-z_][\w.]*)\[\s*(\w+(?:\s*,\s*\w+)*)\s*\](_\w+)?", re.ASCII)


def _without_indices(text: str, model: BehaviorModel, option: str) -> str:
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
    names = Scope.of(model).variables
    return _INDEXED.sub(lambda index: _instance(index, names), text)


def _instance(index: re.Match[str], names: Container[str]) -> str:
    """Return the name of a variable for its index, which stands before the end of a name of a resource."""
    objects = ".".join(part.strip() for part in index[2].split(","))
    base, end = index[1], index[3] or ""
    usual = f"{base}{end}.{objects}"
    ends = (suffix for suffix in ("_req_state", "_req_trigger") if f"{base}{end}".endswith(suffix))
    inner = next((f"{f'{base}{end}'.removesuffix(suffix)}.{objects}{suffix}" for suffix in ends), usual)
    return inner if inner in names else usual


def read_goal(text: str, model: BehaviorModel) -> tuple[str, Predicate]:
    """Return a goal of the model by its name, or a predicate, which is then its own name. Raise `InputError`."""
    named = model.goal(text)
    if named is not None:
        return text, named
    if text.isidentifier() and text not in ("true", "false"):
        names = [name for name, _ in model.goals]
        remedy = suggestion(text, names, "its goals are") or "write a predicate, such as `robot_at == home`"
        message = f"the model has no goal `{text}`"
        raise InputError([Diagnostic(Slug.UNKNOWN_GOAL, message, Place("--goal", 1, 1, len(text)), remedy, text)])
    text = _without_indices(text, model, "--goal")
    predicate = parse_predicate(text, Scope.of(model), file="--goal")
    return str(predicate), predicate


def read_state(assignments: Sequence[str], model: BehaviorModel) -> State:
    """Return the nominal state with variables changed by `variable=value`. Raise `InputError` with all errors."""
    return parse_state(_without_indices(", ".join(assignments), model, "--state"), model.space, file="--state")


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
            text = _without_indices(sentence, model, "--require")
            requirements.append(Requirement(next(free), parse_requirement(text, scope, file="--require")))
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
