"""Variables that nothing looks at, and nominal values that are not allowed as an initial state."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.checking.doubts import Doubt
from scbm.errors import Slug
from scbm.model import AfterAlways, Always, Before, LeadsTo, Never, format_value

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel, Predicate
    from scbm.model.requirements import Sentence


def doubts_about_variables(model: BehaviorModel) -> Iterator[Doubt]:
    """Every declared variable that nothing reads, and a nominal state that `initial_states` forbids."""
    used = frozenset(_used(model))
    for variable in model.variables:
        if variable.name not in used:
            message = f"nothing reads {variable.name}, and no request carries it"
            yield Doubt(Slug.UNUSED_VARIABLE, message, ("variables", variable.name))
    nominal = model.nominal_state
    if not model.initial_states.holds(nominal):
        read = ", ".join(f"{name} == {format_value(nominal[name])}" for name in model.initial_states.reads())
        message = f"the nominal values do not satisfy `initial_states`: {read}"
        yield Doubt(Slug.INITIAL_STATE_NOMINAL, message, ("initial_states",))


def _used(model: BehaviorModel) -> Iterator[str]:
    for predicate in _predicates(model):
        yield from predicate.reads()
    for resource in model.resources:
        yield from resource.request
    for action in model.actions:
        yield from (name for name in action.reads() if name != action.target)


def _predicates(model: BehaviorModel) -> Iterator[Predicate]:
    yield from (transition.running_guard for transition in model.transitions)
    yield from (model.initial_states, *(goal for _, goal in model.goals))
    for requirement in model.requirements:
        yield from _parts(requirement.sentence)


def _parts(sentence: Sentence) -> tuple[Predicate, ...]:
    match sentence:
        case Always(predicate) | Never(predicate):
            return (predicate,)
        case LeadsTo(first, second) | Before(first, second):
            return (first, second)
        case AfterAlways(start, predicate, stop):
            return (start, predicate, stop)
