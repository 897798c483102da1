"""Everything that changes variables of a model in runs: who makes a change, where, and what it assigns.

The changes are those of the runner (semantics 5 and 6) and those from outside (semantics 9), without time and plans.
Forced states are no runs: what injections force is none of the changes.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.coverage import Aspect, Obligation
from scbm.model import (
    Add,
    And,
    Assign,
    Constant,
    Domain,
    Equal,
    Member,
    Order,
    Reference,
    Relation,
    RequestState,
    Truth,
)
from scbm.model.sources import free_groups, is_triggered
from scbm.running.compiled_steps import OperationPart
from scbm.running.lifecycle import guard_and_actions, parts_by_end

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import Action, BehaviorModel, Operation, Predicate, StateSpace, Term, Value


class MakerKind(Enum):
    """The kind of what makes a change, in words."""

    START = "start of an operation"
    END = "end of an operation"
    AUTOMATIC = "automatic transition"
    ENVIRONMENT = "environment transition"
    REPLY = "reply of a resource"
    PUBLISHED = "value that a resource publishes"
    INPUT = "input"


class ChangeMaker(Struct, frozen=True):
    """Something that changes variables.

    Attributes:
        kind: its kind.
        name: the operation, the transition, the resource or the input.
        aspect: for an operation the state that it goes to, for an automatic transition *taken*; else `None`.
    """

    kind: MakerKind
    name: str
    aspect: Aspect | None = None

    @property
    def obligation(self) -> Obligation | None:
        """The obligation that a run visits when this changes a variable; `None` for what is outside the model."""
        return None if self.aspect is None else Obligation(self.name, self.aspect)

    @property
    def suffix(self) -> str:
        """How labels distinguish it from the completion of the same operation: ` (failed)`; empty for most."""
        if self.aspect in (Aspect.FAILED, Aspect.TIMEDOUT):
            return f" ({self.aspect})"
        return " (start)" if self.kind is MakerKind.START else ""

    def __str__(self) -> str:
        return f"{self.name}{self.suffix}"


class ModelChange(Struct, frozen=True):
    """A step that changes variables.

    Attributes:
        maker: who makes it.
        guard: where it can be made.
        actions: what it assigns, all at once; each stays in its domain.
        given: variables that get one of some values, or keep theirs.
        start: for the end of an operation the change at its start; `None` for other changes.
    """

    maker: ChangeMaker
    guard: Predicate
    actions: tuple[Action, ...] = ()
    given: tuple[tuple[str, tuple[Value, ...]], ...] = ()
    start: ModelChange | None = None

    def action_on(self, name: str) -> Action | None:
        """Return the action that assigns a variable; `None` if there is none."""
        return next((action for action in self.actions if action.target == name), None)

    def values_given(self, name: str) -> tuple[Value, ...]:
        """Return the values that it can give a variable whatever the state is; empty for none."""
        return next((values for given, values in self.given if given == name), ())


def model_changes(model: BehaviorModel) -> tuple[ModelChange, ...]:
    """Return all changes of a model, in the order of its file: operations, automatic transitions, the others."""
    space = model.running_space
    found = [change for operation in model.operations for change in _of_operation(operation, space)]
    for each in model.automatic_transitions:
        maker = ChangeMaker(MakerKind.AUTOMATIC, each.name, Aspect.TAKEN)
        found.append(_change(maker, each.running_guard, each.running_actions, space))
    for outside in model.environment:
        maker = ChangeMaker(MakerKind.ENVIRONMENT, outside.name)
        found.append(_change(maker, outside.guard, outside.actions, space))
    return (*found, *_from_resources(model))


def _of_operation(operation: Operation, space: StateSpace) -> Iterator[ModelChange]:
    before = guard_and_actions(operation, OperationPart.PRE)
    assert before is not None  # noqa: S101 - each operation has a precondition
    start = _change(ChangeMaker(MakerKind.START, operation.name, Aspect.EXECUTING), *before, space)
    yield start
    for end, part in parts_by_end().items():
        after = guard_and_actions(operation, part)
        if after is not None:
            maker = ChangeMaker(MakerKind.END, operation.name, Aspect(end.value))
            yield _change(maker, *after, space, start)


def _from_resources(model: BehaviorModel) -> Iterator[ModelChange]:
    """Yield what replies measure, then what changes freely."""
    for resource in model.resources:
        if resource.measures and is_triggered(resource, model):
            answered = Equal(Reference(resource.request_state), Constant(RequestState.EXECUTING.value))
            given = tuple((name, resource.sends(model.space[name])) for name in resource.measures)
            yield ModelChange(ChangeMaker(MakerKind.REPLY, resource.name), answered, given=given)
    for group in free_groups(model):
        kind = MakerKind.INPUT if group.names == (group.name,) else MakerKind.PUBLISHED
        yield ModelChange(ChangeMaker(kind, group.name), Truth(True), given=group.values)


def _change(
    maker: ChangeMaker,
    guard: Predicate,
    actions: tuple[Action, ...],
    space: StateSpace,
    start: ModelChange | None = None,
) -> ModelChange:
    """Return a change that is made only where no action leaves its domain (semantics 2.4)."""
    inside = (part for action in actions for part in _stays_inside(action, space))
    return ModelChange(maker, And((guard, *inside)) if actions else guard, actions, (), start)


def _stays_inside(action: Action, space: StateSpace) -> Iterator[Predicate]:
    """Yield the predicates under which an action assigns a value of the domain of its variable."""
    domain = space[action.target].domain
    match action:
        case Add(target, amount):
            ends = (int(domain.values[0]) - amount, int(domain.values[-1]) - amount)
            yield from within(Reference(target), Domain(ends))
        case Assign(_, Reference(name)):
            common = tuple(Constant(value) for value in space[name].domain.values if value in domain)
            if len(common) < len(space[name].domain):
                yield Member(Reference(name), common)
        case Assign(_, source) if not isinstance(source, Constant):
            yield from within(source, domain)


def within(term: Term, domain: Domain) -> tuple[Predicate, ...]:
    """Return the predicates that a term of integers has a value between the ends of a domain."""
    low, high = Constant(domain.values[0]), Constant(domain.values[-1])
    return Order(term, Relation.AT_LEAST, low), Order(term, Relation.AT_MOST, high)
