"""The cases of a suite as mutants get them: with its initial values, unless they name what it lacks."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from scbm.model import State
from scbm.model.variables import operation_state_name
from scbm.testing.mutants.mutant import MutatedPart
from scbm.testing.mutants.operation_mutations import values_of_current

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.cases import Case
    from scbm.model import BehaviorModel, Predicate, StateSpace
    from scbm.testing.mutants.mutant import Mutant


def begun_as(mutant: Mutant, case: Case, original: BehaviorModel) -> Case:
    """Return the case with the initial state that it has on a mutant.

    A variable with another nominal value begins with that value where it began with the nominal value of the original.
    Random values that a case drew are kept.
    """
    if MutatedPart.INITIAL not in mutant.parts:
        return case
    old, new = original.space[mutant.subject], mutant.model.space[mutant.subject]
    is_drawn = case.origin is not None and len(old.random) > 1
    if is_drawn or case.initial[old.name] != old.initial:
        return case
    return replace(case, initial=State(case.initial.space, {**case.initial, old.name: new.initial}))


def missing_name(mutant: Mutant, case: Case, original: BehaviorModel) -> str | None:
    """Return the operation that a case names and a mutant does not have; `None` if it has all.

    The file of such a case could not be read for the mutant.
    """
    if MutatedPart.OPERATIONS not in mutant.parts:
        return None
    name = mutant.subject
    if any(operation.name == name for operation in mutant.model.operations):
        return None  # it has only changed its place
    return name if _names(case, name, original.running_space) else None


def _names(case: Case, operation: str, space: StateSpace) -> bool:
    """Return whether a case names an operation anywhere."""
    state = operation_state_name(operation)
    assigned = [name for injection in case.injections for name, _ in injection.assign]
    listed = [rule.subject for rule in case.outcomes]
    for goal in case.goals:
        listed += [*(goal.expect.plan or ()), *goal.expect.order]
        listed += [visit.subject for visit in goal.expect.visits]
    predicates = tuple(_predicates(case))
    read = [name for predicate in predicates for name in predicate.reads()]
    compared = values_of_current(predicates, space)
    return operation in (*listed, *compared) or state in (*assigned, *read)


def _predicates(case: Case) -> Iterator[Predicate]:
    yield from (injection.when for injection in case.injections if injection.when is not None)
    for goal in case.goals:
        yield goal.predicate
        yield from () if goal.when is None else (goal.when,)
        yield from goal.expect.final
    for requirement in case.requirements:
        yield from requirement.sentence.predicates
