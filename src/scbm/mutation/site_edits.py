"""The edits of mutation operators: what each kind of value at a site becomes, one change at a time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from msgspec.structs import replace

from scbm.model import Add, Assign, Constant, Reference, Role, conjunction, format_duration, format_value
from scbm.model.predicates import negated
from scbm.model.variables import trigger_name
from scbm.mutation.expression_edits import (
    after,
    can_meet,
    conjuncts_of,
    other_calculations,
    other_constants,
    replaced,
    with_other_leaf,
)
from scbm.mutation.mutants import SubjectKind
from scbm.mutation.mutation_sites import Edit

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from scbm.model import Action, BehaviorModel, Predicate, StateSpace, Value
    from scbm.mutation.expression_edits import Leaf
    from scbm.mutation.mutation_sites import Actions, Site

T = TypeVar("T")
I = TypeVar("I")  # noqa: E741 - an item of a list

SiteEdits: TypeAlias = "Callable[[Site[T], BehaviorModel], Iterator[Edit[T]]]"
"""A function that yields the changes of the value of a site of a model."""

ItemEdits: TypeAlias = "Callable[[I, Site[Any], BehaviorModel], Iterator[Edit[tuple[I, ...]]]]"
"""A function that yields for an item of a list what takes its place: nothing, or other items."""


def each_conjunct(*edits: ItemEdits[Predicate]) -> SiteEdits[Predicate]:
    """Return a function that changes one conjunct of a guard at a time."""
    return _each(conjuncts_of, conjunction, edits)


def each_item(*edits: ItemEdits[I]) -> SiteEdits[tuple[I, ...]]:
    """Return a function that changes one item of a list at a time, such as an action."""
    return _each(tuple, tuple, edits)


def _each(
    items_of: Callable[[T], tuple[I, ...]], joined: Callable[[Iterable[I]], T], edits: Iterable[ItemEdits[I]]
) -> SiteEdits[T]:
    def changes(site: Site[T], model: BehaviorModel) -> Iterator[Edit[T]]:
        items = items_of(site.value)
        for index, item in enumerate(items):
            for edit in edits:
                for label, others, words in edit(item, site, model):
                    yield Edit(label, joined(replaced(items, index, *others)), words)

    return changes


def drop(item: I, _: Site[Any], __: BehaviorModel) -> Iterator[Edit[tuple[I, ...]]]:
    """Leave out an item."""
    yield Edit(f"drop:{item}", ())


def drop_unless_last(action: Action, site: Site[Actions], model: BehaviorModel) -> Iterator[Edit[Actions]]:
    """Leave out an action; no automatic transition and no environment transition is left without actions."""
    match site.kind:
        case SubjectKind.AUTOMATIC:
            actions = next(t.running_actions for t in model.automatic_transitions if t.name == site.subject)
        case SubjectKind.ENVIRONMENT:
            actions = site.value
        case _:
            actions = ()
    if len(actions) != 1:
        yield Edit(f"drop:{action}", ())


def negate(conjunct: Predicate, _: Site[Any], __: BehaviorModel) -> Iterator[Edit[tuple[Predicate, ...]]]:
    """Negate a conjunct."""
    opposite = negated(conjunct)
    yield Edit(f"negate:{conjunct}", (opposite,), f"{conjunct} → {opposite}")


def assign_other(action: Action, _: Site[Any], model: BehaviorModel) -> Iterator[Edit[Actions]]:
    """Assign the next value that a model may assign, or another sum, or count the other way."""
    for other in _other_actions(action, model.running_space):
        yield Edit(f"value:{other}", (other,), f"{action} → {other}")


def _other_actions(action: Action, space: StateSpace) -> Iterator[Action]:
    match action:
        case Add(target, amount):
            yield Add(target, -amount)
        case Assign(target, Constant(value)):
            for other in after(value, space[target].assignable):
                yield Assign(target, Constant(other))
                return
        case Assign(target, source):
            changed = (*other_calculations(source), *other_constants(source))
            yield from (Assign(target, other) for other in changed if can_meet(Reference(target), other, space))


def trigger_other(action: Action, site: Site[Actions], model: BehaviorModel) -> Iterator[Edit[Actions]]:
    """Assign the trigger of the next resource; no transition assigns one trigger twice."""
    triggers = [trigger_name(resource.name) for resource in model.resources]
    if action.target in triggers and isinstance(action, Assign):
        operation, key = model.operation(site.subject), site.path[2]
        actions = operation.timedout if key == "timedout" else getattr(operation, key).running_actions
        assigned = [each.target for each in actions]
        for name in [name for name in after(action.target, triggers) if name not in assigned][:1]:
            other = replace(action, target=name)
            yield Edit(f"trigger:{other}", (other,), f"{action} → {other}")


def carry_other(name: str, site: Site[tuple[str, ...]], model: BehaviorModel) -> Iterator[Edit[tuple[str, ...]]]:
    """Carry the next declared variable that a request does not carry yet."""
    declared = [variable.name for variable in model.variables]
    following = after(name, declared) if name in declared else declared
    for other in [each for each in following if each not in site.value][:1]:
        yield Edit(f"{name}->{other}", (other,), f"{name} → {other}")


def each_comparison(word: str, others: Callable[[Leaf, StateSpace], Iterator[Leaf]]) -> SiteEdits[Predicate]:
    """Return a function that changes one comparison of a guard at a time.

    Args:
        word: what changes, for the names of mutants.
        others: returns what takes the place of a comparison.
    """

    def changes(site: Site[Predicate], model: BehaviorModel) -> Iterator[Edit[Predicate]]:
        for each in with_other_leaf(site.value, lambda leaf: others(leaf, model.running_space)):
            yield Edit(f"{word}:{each.new}", each.whole, f"{each.old} → {each.new}")

    return changes


def move_conjunct(
    site: Site[tuple[Predicate, Predicate]], _: BehaviorModel
) -> Iterator[Edit[tuple[Predicate, Predicate]]]:
    """Move one conjunct of the first guard to the second one."""
    source, target = map(conjuncts_of, site.value)
    for index, conjunct in enumerate(source):
        moved = conjunction(replaced(source, index)), conjunction((*target, conjunct))
        yield Edit(f"move:{conjunct}", moved, f"move {conjunct} to {site.parts[1]}")


def move_action(site: Site[tuple[Actions, Actions]], model: BehaviorModel) -> Iterator[Edit[tuple[Actions, Actions]]]:
    """Move one action of the first list to the second one; `plan.state` stays in `ar`."""
    source, target = site.value
    for index, action in enumerate(source):
        if model.running_space[action.target].role is not Role.PLAN_STATE:
            moved = replaced(source, index), (*target, action)
            yield Edit(f"move:{action}", moved, f"move {action} to {site.parts[1]}")


def other_deadline(changed_ns: Callable[[int], int | None]) -> SiteEdits[int | None]:
    """Return a function that changes a deadline; `changed_ns` returns the new one, or `None` for none."""

    def changes(site: Site[int | None], _: BehaviorModel) -> Iterator[Edit[int | None]]:
        old, new = site.value, None if site.value is None else changed_ns(site.value)
        before, label = ("none" if ns is None else format_duration(ns) for ns in (old, new))
        yield Edit(label, new, f"{before} → {label}")

    return changes


def begin_with_other(site: Site[Value], model: BehaviorModel) -> Iterator[Edit[Value]]:
    """Begin with the next value of the domain, if it has another one."""
    for value in after(site.value, model.space[site.subject].domain.values):
        label = format_value(value)
        yield Edit(label, value, f"{format_value(site.value)} → {label}")
        return


def leave_out(_: Site[Any], __: BehaviorModel) -> Iterator[Edit[Any]]:
    """Leave out an entry, or a transition."""
    yield Edit("drop", None)


def swap(site: Site[tuple[Any, Any]], _: BehaviorModel) -> Iterator[Edit[tuple[Any, Any]]]:
    """Let two entries change places."""
    first, second = site.value
    yield Edit(f"swap:{second.name}", (second, first), f"after {second.name} instead of before")
