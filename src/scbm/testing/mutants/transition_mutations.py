"""Mutation operators for whole transitions: left out, or in another order."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from scbm.testing.mutants.model_parts import with_known_waivers, with_operation
from scbm.testing.mutants.mutant import Mutant, MutatedPart, SubjectKind
from scbm.testing.mutants.mutation import Mutation, body_of
from scbm.testing.mutants.term_edits import replaced, with_swapped_neighbours

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel, Operation, Transition


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
