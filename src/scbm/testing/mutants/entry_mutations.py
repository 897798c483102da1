"""Mutation operators for whole operations and whole transitions: left out, or in another order."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from scbm.model import Constant, Equal, Member, NotEqual, Reference
from scbm.model.variables import CURRENT_NAME, operation_state_name
from scbm.testing.mutants.expression_edits import comparisons_of, replaced, with_swapped_neighbours
from scbm.testing.mutants.model_parts import with_known_waivers, with_operation
from scbm.testing.mutants.mutation import Mutant, MutatedPart, Mutation, SubjectKind, body_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.model import Action, BehaviorModel, Operation, Predicate, StateSpace, Transition
    from scbm.testing.mutants.expression_edits import Leaf


class DropTransition(Mutation):
    """Leaves out an automatic transition, or the `failed` transition of an operation."""

    name = "transition-drop"
    group = "transitions"
    summary = "an automatic transition, or the `failed` transition of an operation, is left out"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each `failed` transition, then for each automatic one."""
        for operation in model.operations:
            if operation.failed is not None:
                yield self._without_failed(model, operation, operation.failed)
        for index, transition in enumerate(model.automatic_transitions):
            kept = replaced(model.automatic_transitions, index)
            yield Mutant(
                name=f"automatic/{transition.name}/drop",
                operator=self.name,
                kind=SubjectKind.AUTOMATIC,
                subject=transition.name,
                parts=(MutatedPart.AUTOMATIC_TRANSITIONS,),
                path=("automatic_transitions", transition.name),
                before=f"{transition.name}: {body_of(transition)}",
                after="",
                change="drop",
                model=with_known_waivers(replace(model, automatic_transitions=kept)),
            )

    def _without_failed(self, model: BehaviorModel, operation: Operation, failed: Transition) -> Mutant:
        return Mutant(
            name=f"{operation.name}/failed/drop",
            operator=self.name,
            kind=SubjectKind.OPERATION,
            subject=operation.name,
            parts=(MutatedPart.FAILED,),
            path=("operations", operation.name, "failed"),
            before=f"failed: {body_of(failed)}",
            after="",
            change="drop",
            model=with_operation(model, replace(operation, failed=None)),
        )


class SwapTransitions(Mutation):
    """Lets two neighbouring automatic transitions change places."""

    name = "transition-swap"
    group = "transitions"
    summary = "two neighbouring automatic transitions change places"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each pair of neighbours."""
        for first, second, changed in with_swapped_neighbours(model.automatic_transitions):
            yield Mutant(
                name=f"automatic/{first.name}/swap:{second.name}",
                operator=self.name,
                kind=SubjectKind.AUTOMATIC,
                subject=first.name,
                parts=(MutatedPart.AUTOMATIC_TRANSITIONS,),
                path=("automatic_transitions", first.name),
                before=f"automatic_transitions: {first.name}, {second.name}",
                after=f"automatic_transitions: {second.name}, {first.name}",
                change=f"after {second.name} instead of before",
                model=replace(model, automatic_transitions=changed),
            )


class DropOperation(Mutation):
    """Leaves out an operation that nothing else in the model names."""

    name = "operation-drop"
    group = "operations"
    summary = "an operation is left out, unless something else in the model reads or assigns its state"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each operation that can be left out; one operation always stays."""
        named_by = _owners_by_named_operation(model)
        for index, operation in enumerate(model.operations):
            if len(model.operations) == 1 or any(owner != operation.name for owner in named_by[operation.name]):
                continue
            kept = replaced(model.operations, index)
            yield Mutant(
                name=f"{operation.name}/drop",
                operator=self.name,
                kind=SubjectKind.OPERATION,
                subject=operation.name,
                parts=(MutatedPart.OPERATIONS,),
                path=("operations", operation.name),
                before=f"{operation.name}: pre {body_of(operation.pre)}; post {body_of(operation.post)}",
                after="",
                change="drop",
                model=with_known_waivers(replace(model, operations=kept)),
            )


class SwapOperations(Mutation):
    """Lets two neighbouring operations change places, which decides between plans of equal length."""

    name = "operation-swap"
    group = "operations"
    summary = "two neighbouring operations change places"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each pair of neighbours."""
        for first, second, changed in with_swapped_neighbours(model.operations):
            yield Mutant(
                name=f"{first.name}/swap:{second.name}",
                operator=self.name,
                kind=SubjectKind.OPERATION,
                subject=first.name,
                parts=(MutatedPart.OPERATIONS,),
                path=("operations", first.name),
                before=f"operations: {first.name}, {second.name}",
                after=f"operations: {second.name}, {first.name}",
                change=f"after {second.name} instead of before",
                model=replace(model, operations=changed),
            )


_OUTSIDE = ""
"""Stands for all entries that are no operations; no operation has this name."""


def _owners_by_named_operation(model: BehaviorModel) -> dict[str, list[str]]:
    """Return for each operation the entries that name it: operations by their names, and `_OUTSIDE`."""
    by_state = {operation_state_name(operation.name): operation.name for operation in model.operations}
    owners: dict[str, list[str]] = {operation.name: [] for operation in model.operations}
    for owner, predicates, actions in _expressions(model):
        read = (name for part in (*predicates, *actions) for name in part.reads())
        for name in (*read, *(action.target for action in actions)):
            if name in by_state:
                owners[by_state[name]].append(owner)
        for name in values_of_current(predicates, model.running_space):
            if name in owners:
                owners[name].append(owner)
        if any(CURRENT_NAME in action.reads() for action in actions):
            for each in owners.values():
                each.append(owner)  # the domain of `current.name` has to fit that of the target
    return owners


def _expressions(model: BehaviorModel) -> Iterator[tuple[str, tuple[Predicate, ...], tuple[Action, ...]]]:
    """Yield the predicates and actions of each entry that can name an operation, each after its owner."""
    for operation in model.operations:
        for transition in (operation.pre, operation.post, operation.failed):
            if transition is not None:
                yield _of_transition(operation.name, transition)
        yield operation.name, (), operation.timedout
    for transition in model.automatic_transitions:
        yield _of_transition(_OUTSIDE, transition)
    for requirement in model.requirements:
        yield _OUTSIDE, requirement.sentence.predicates, ()


def _of_transition(owner: str, transition: Transition) -> tuple[str, tuple[Predicate, Predicate], tuple[Action, ...]]:
    return owner, (transition.g, transition.gr), transition.running_actions


def values_of_current(predicates: Iterable[Predicate], space: StateSpace) -> Iterator[str]:
    """Yield the values that `current.name` is compared with; of a variable all values of its domain."""
    for predicate in predicates:
        for leaf in comparisons_of(predicate):
            if CURRENT_NAME in leaf.reads():
                yield from _opposite_values(leaf, space)


def _opposite_values(leaf: Leaf, space: StateSpace) -> Iterator[str]:
    terms = leaf.members if isinstance(leaf, Member) else (leaf.left, leaf.right)
    for term in terms:
        match term:
            case Constant(value):
                yield str(value)
            case Reference(name) if name != CURRENT_NAME and isinstance(leaf, Equal | NotEqual):
                yield from map(str, space[name].domain.values)
            case _:
                pass
