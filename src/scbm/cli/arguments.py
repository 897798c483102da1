"""What verbs take in common, and how it is read."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.errors import Diagnostic, InputError, Place, Slug
from scbm.model import State, format_value
from scbm.notation import Scope, nearest, parse_predicate, parse_value, suggestion

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.model import BehaviorModel, Predicate, Value


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
    values: dict[str, Value] = {}
    faults: list[Diagnostic] = []
    for assignment in assignments:
        name, equals, written = (part.strip() for part in assignment.partition("="))
        value = None
        if not equals:
            faults.append(_fault(Slug.BAD_OPTION, f"`{assignment}` is not `variable=value`", assignment, 0))
        elif name not in model.space:
            remedy = suggestion(name, model.space.names, "the variables are")
            faults.append(_fault(Slug.UNKNOWN_VARIABLE, f"there is no variable `{name}`", assignment, 0, remedy))
        elif name in values:
            faults.append(_fault(Slug.ASSIGNED_TWICE, f"`{name}` is given twice", assignment, 0))
        else:
            value = parse_value(written.removeprefix("=").strip(), model.space[name].domain)
            if value is None:
                faults.append(_outside(name, written, assignment, model))
            else:
                values[name] = value
    if faults:
        raise InputError(faults)
    return model.nominal_state.replace(values)


def _outside(name: str, written: str, assignment: str, model: BehaviorModel) -> Diagnostic:
    domain = model.space[name].domain
    near = nearest(written, [format_value(value) for value in domain.values])
    remedy = f"did you mean `{near}`?" if near else f"its domain is {domain}"
    message = f"`{written}` is not a value of `{name}`"
    return _fault(Slug.VALUE_OUTSIDE_DOMAIN, message, assignment, assignment.find(written) if written else 0, remedy)


def _fault(slug: Slug, message: str, assignment: str, index: int, remedy: str | None = None) -> Diagnostic:
    length = max(1, len(assignment) - index if index else len(assignment.partition("=")[0].strip()))
    return Diagnostic(slug, message, Place("--state", 1, index + 1, length), remedy, assignment)


def allowed_state(state: State, model: BehaviorModel) -> State:
    """The state, if the model allows it as an initial one. Raises `InputError`."""
    if model.initial_states.holds(state):
        return state
    message = f"this state does not satisfy `initial_states`: {model.initial_states}"
    raise InputError([Diagnostic(Slug.INITIAL_STATE_NOT_ALLOWED, message, Place("--state"))])
