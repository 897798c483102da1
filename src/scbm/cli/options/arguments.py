"""What verbs take in common, and how it is read."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain, count
from typing import TYPE_CHECKING

from scbm.cases import Network
from scbm.files import Scope, parse_duration, parse_predicate, parse_requirement, parse_state, read_network, suggestion
from scbm.model import Diagnostic, InputError, Place, Requirement, Slug

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from scbm.cases import Case
    from scbm.model import BehaviorModel, Predicate, State


DRAWN = "drawn"
"""What `--network` says for another network in each case."""


def read_time_limit(time_limit: str | None) -> int | None:
    """How many nanoseconds a run may take, if it is said. Raises `InputError`."""
    if time_limit is None:
        return None
    time_limit_ns = parse_duration(time_limit)
    if not time_limit_ns:
        message = f"`{time_limit}` is not a duration to run for"
        place = Place("--time-limit", 1, 1, max(1, len(time_limit)))
        remedy = "write a number and a unit: `10 min`, `90 s`"
        raise InputError([Diagnostic(Slug.BAD_DURATION, message, place, remedy, time_limit)])
    return time_limit_ns


def read_goal(text: str, model: BehaviorModel) -> tuple[str, Predicate]:
    """A goal by its name in the model, or as a predicate, which then is its own name. Raises `InputError`."""
    named = model.goal(text)
    if named is not None:
        return text, named
    if text.isidentifier() and text not in ("true", "false"):
        names = [name for name, _ in model.goals]
        remedy = suggestion(text, names, "its goals are") or "write a predicate, such as `robot_at == home`"
        message = f"the model has no goal `{text}`"
        raise InputError([Diagnostic(Slug.UNKNOWN_GOAL, message, Place("--goal", 1, 1, len(text)), remedy, text)])
    predicate = parse_predicate(text, Scope.of(model), file="--goal")
    return str(predicate), predicate


def read_state(assignments: Sequence[str], model: BehaviorModel) -> State:
    """The nominal state with some variables changed, each as `variable=value`. Raises `InputError` with all faults."""
    return parse_state(", ".join(assignments), model.space, file="--state")


def read_requirements(sentences: Sequence[str], model: BehaviorModel) -> tuple[Requirement, ...]:
    """Requirements beside those of the model, named `required_1`, … Raises `InputError` with all faults."""
    scope = Scope.of(model)
    taken = [requirement.name for requirement in model.requirements]
    names = (f"required_{number}" for number in count(1))
    free = (name for name in names if name not in taken)
    wrong: list[Diagnostic] = []
    requirements = []
    for sentence in sentences:
        try:
            requirements.append(Requirement(next(free), parse_requirement(sentence, scope, file="--require")))
        except InputError as error:
            wrong += error.diagnostics
    if wrong:
        raise InputError(wrong)
    return tuple(requirements)


def _add_requirements(case: Case, asked: Iterable[Requirement], model: BehaviorModel) -> tuple[Requirement, ...]:
    """Return the requirements of a case with additional ones, which get names that are free."""
    requirements = list(case.requirements)
    for requirement in asked:
        if all(known.sentence != requirement.sentence for known in requirements):
            taken = [known.name for known in (*requirements, *model.requirements)]
            names = chain([requirement.name], (f"required_{number}" for number in count(1)))
            requirements.append(replace(requirement, name=next(name for name in names if name not in taken)))
    return tuple(requirements)


def complete(case: Case, requirements: Sequence[Requirement], time_limit_ns: int | None, model: BehaviorModel) -> Case:
    """The case with requirements and the limit of the command line, so that it keeps them when it is saved."""
    if time_limit_ns is not None and case.limits.time_ns is None:
        case = replace(case, limits=replace(case.limits, time_ns=time_limit_ns))
    return replace(case, requirements=_add_requirements(case, requirements, model))


def read_faults(text: str | None, model: BehaviorModel) -> Network | None:
    """A network as `--network` says it; `None` where it says `drawn`. Raises `InputError`."""
    if text is None:
        return Network()
    return None if text.strip() == DRAWN else read_network(text, model, file="--network")


def allowed_state(state: State, model: BehaviorModel) -> State:
    """The state, if the model allows it as an initial one. Raises `InputError`."""
    if model.initial_states.holds(state):
        return state
    message = f"this state does not satisfy `initial_states`: {model.initial_states}"
    raise InputError([Diagnostic(Slug.INITIAL_STATE_NOT_ALLOWED, message, Place("--state"))])
