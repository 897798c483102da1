"""What verbs take in common, and how it is read."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.errors import Diagnostic, InputError, Place, Slug
from scbm.notation import Scope, parse_duration, parse_predicate, parse_state, suggestion
from scbm.running import RunnerOptions

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.model import BehaviorModel, Predicate, State


def read_limits(time_limit: str | None) -> RunnerOptions:
    """The limits of a run; those that are not given have their defaults. Raises `InputError`."""
    if time_limit is None:
        return RunnerOptions()
    time_limit_ns = parse_duration(time_limit)
    if not time_limit_ns:
        message = f"`{time_limit}` is not a duration to run for"
        place = Place("--time-limit", 1, 1, max(1, len(time_limit)))
        remedy = "write a number and a unit: `10 min`, `90 s`"
        raise InputError([Diagnostic(Slug.BAD_DURATION, message, place, remedy, time_limit)])
    return RunnerOptions(time_limit_ns=time_limit_ns)


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


def allowed_state(state: State, model: BehaviorModel) -> State:
    """The state, if the model allows it as an initial one. Raises `InputError`."""
    if model.initial_states.holds(state):
        return state
    message = f"this state does not satisfy `initial_states`: {model.initial_states}"
    raise InputError([Diagnostic(Slug.INITIAL_STATE_NOT_ALLOWED, message, Place("--state"))])
