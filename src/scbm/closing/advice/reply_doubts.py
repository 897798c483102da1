"""Doubts about measured values: postconditions that wait for what no reply carries, and variables never carried.

A reply carries values that its resource sends, and a simulated one only those that it draws (semantics 6.3). Variables
that change from outside, too, are never doubted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.closing.advice.doubts import Doubt, variables_in_use
from scbm.closing.proofs.blame import blame
from scbm.closing.proofs.possible_values import ValueSets, possible_values
from scbm.closing.summaries import listed
from scbm.model import Constant, Equal, Outcome, Reference, RequestState, Severity, Slug, conjunction, format_value
from scbm.model.predicates import conjuncts
from scbm.model.sources import changed_from_outside, is_triggered

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from scbm.model import BehaviorModel, Operation, Predicate, Resource, Value, Variable

_MAX_LISTED = 5
"""Maximum number of values that a message lists."""


def doubts_about_replies(model: BehaviorModel) -> Iterator[Doubt]:
    """Yield the doubts about postconditions, then notes about variables that simulated replies never carry.

    There is no note about a variable for which a doubted postcondition waits.
    """
    outside = changed_from_outside(model)
    measured = [
        (resource, variable)
        for resource in model.resources
        for variable in map(model.space.__getitem__, resource.measures)
        if is_triggered(resource, model) and variable.name not in outside and len(variable.domain) > 1
    ]
    names = dict.fromkeys(variable.name for _, variable in measured)
    waiting = [each for each in model.operations if any(name in names for name in each.post.running_guard.reads())]
    explained: list[tuple[str, str]] = []
    if waiting:
        drawn, sent, free = (
            possible_values(_with_replies(model, measured, values)) for values in (_drawn, _sent, _all)
        )
        possible_of_sent, possible_of_all = (ValueSets(model.running_space, values) for values in (sent, free))
        for operation in waiting:
            guard = operation.post.running_guard
            possible = ValueSets(model.running_space, drawn | _replied(operation, model, outside))
            parts = blame((guard,), possible.can_hold) if possible_of_all.can_hold(guard) else ()
            blamed = [pair for pair in measured if pair[1].name in conjunction(parts).reads()]
            if blamed:
                explained += [(resource.name, variable.name) for resource, variable in blamed]
                values = _drawn if possible_of_sent.can_hold(guard) else _sent
                yield _never_fits(operation, parts, *blamed[0], values)
    in_use = variables_in_use(model) if measured else ()
    for resource, variable in measured:
        is_explained = (resource.name, variable.name) in explained
        if variable.name in in_use and not _drawn(resource, variable) and not is_explained:
            yield _never_drawn(resource, variable.name)


# what replies carry


def _drawn(resource: Resource, variable: Variable) -> tuple[Value, ...]:
    """Return the values that simulated replies of a resource draw for a variable, in the order of the domain."""
    drawn = [
        value
        for outcome in (Outcome.SUCCEED, Outcome.FAIL)
        for each in resource.drawn(outcome)
        if each.name == variable.name
        for value in each.possible
    ]
    return tuple(value for value in variable.domain.values if value in drawn)


def _replied(operation: Operation, model: BehaviorModel, outside: Sequence[str]) -> dict[str, tuple[Value, ...]]:
    """Return the values of variables that each successful reply carries, when the operation that awaits it completes.

    A value from before the reply is gone then, unless an automatic transition assigns it again.
    """
    awaited = conjuncts(operation.post.running_guard)
    succeeded = Constant(RequestState.SUCCEEDED.value)
    carried = {
        each.name: each.possible
        for resource in model.resources
        if Equal(Reference(resource.request_state), succeeded) in awaited
        for each in resource.drawn(Outcome.SUCCEED)
    }
    changed = [*outside, *(a.target for each in model.automatic_transitions for a in each.running_actions)]
    return {name: values for name, values in carried.items() if name not in changed}


def _sent(resource: Resource, variable: Variable) -> tuple[Value, ...]:
    return resource.sends(variable)


def _all(_: Resource, variable: Variable) -> tuple[Value, ...]:
    return variable.domain.values


def _with_replies(
    model: BehaviorModel,
    measured: Sequence[tuple[Resource, Variable]],
    values: Callable[[Resource, Variable], tuple[Value, ...]],
) -> BehaviorModel:
    """Return a model whose replies carry other values; one that carries none of a variable never changes it."""
    sent = {resource.name: dict(resource.values) for resource in model.resources}
    for resource, variable in measured:
        sent[resource.name][variable.name] = values(resource, variable) or (variable.initial,)
    resources = (replace(each, values=tuple(sent[each.name].items())) for each in model.resources)
    return replace(model, resources=tuple(resources))


# doubts


def _never_fits(
    operation: Operation,
    parts: Sequence[Predicate],
    resource: Resource,
    variable: Variable,
    values: Callable[[Resource, Variable], tuple[Value, ...]],
) -> Doubt:
    """Return the doubt about a postcondition, at the conjunct that never holds."""
    name = variable.name
    carried = [*map(format_value, values(resource, variable))]
    shown = f"only {listed(carried)}" if 0 < len(carried) <= _MAX_LISTED else f"{len(carried):,} values"
    who = resource.name if values is _sent else f"simulated replies of {resource.name}"
    verb = ("sends" if values is _sent else "draw") if carried else "never carry"
    what = f"{shown} for {name}" if carried else name
    message = f"{operation.name} waits for {conjunction(parts)}, and {who} {verb} {what}"
    is_drawn = any(each.name == name for each in (*resource.simulation.measured, *resource.simulation.failed))
    where = "`measured` in its `simulation`" if is_drawn and values is _drawn else f"`measures` of {resource.name}"
    part = next(part for part in parts if name in part.reads())
    key = "g" if part in conjuncts(operation.post.g) else "gr"
    path = ("operations", operation.name, "post", key, conjuncts(getattr(operation.post, key)).index(part))
    remedy = f"list the value under {where}, or change the postcondition"
    return Doubt(Slug.REPLY_NEVER_CARRIES, message, path, remedy)


def _never_drawn(resource: Resource, name: str) -> Doubt:
    """Return the note about a variable that replies of the simulation leave as it is: that may be meant."""
    message = f"simulated replies of {resource.name} never carry {name}, as no values are listed for it"
    remedy = f"list its values under `measures`, or write `measured: {{{name}: any}}` under `simulation`"
    path = ("resources", resource.name, "measures", resource.measures.index(name))
    return Doubt(Slug.REPLY_NEVER_CARRIES, message, path, remedy, Severity.NOTE)
