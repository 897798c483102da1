"""All mutants of a model: the registry of mutation operators (`MUTATIONS`), and which mutants are left out."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from scbm.testing.mutants.action_mutations import DropAction, DropCleanUp, MoveAction, OtherActionValue, OtherTrigger
from scbm.testing.mutants.deadline_mutations import LongerDeadline, NoDeadline, ShorterDeadline
from scbm.testing.mutants.guard_mutations import (
    DropConjunct,
    MoveConjunct,
    NegateConjunct,
    OtherGuardValue,
    OtherGuardVariable,
    OtherThreshold,
)
from scbm.testing.mutants.mutant_meaning import Meanings
from scbm.testing.mutants.operation_mutations import DropOperation, SwapOperations
from scbm.testing.mutants.transition_mutations import DropTransition, SwapTransitions
from scbm.testing.mutants.world_mutations import (
    DropEnvironment,
    DropRequestValue,
    EnvironmentActions,
    EnvironmentGuard,
    OtherInitialValue,
    OtherRequestValue,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.model import BehaviorModel
    from scbm.testing.mutants.mutant import Mutant
    from scbm.testing.mutants.mutation import Mutation

_ALL: tuple[Mutation, ...] = (
    DropConjunct(),
    NegateConjunct(),
    OtherGuardValue(),
    OtherGuardVariable(),
    OtherThreshold(),
    MoveConjunct(),
    DropAction(),
    OtherActionValue(),
    MoveAction(),
    DropCleanUp(),
    NoDeadline(),
    ShorterDeadline(),
    LongerDeadline(),
    DropTransition(),
    SwapTransitions(),
    OtherTrigger(),
    DropRequestValue(),
    OtherRequestValue(),
    DropOperation(),
    SwapOperations(),
    OtherInitialValue(),
    DropEnvironment(),
    EnvironmentGuard(),
    EnvironmentActions(),
)

MUTATIONS: dict[str, Mutation] = {mutation.name: mutation for mutation in _ALL}
"""The mutation operators by their names, in the order of reports."""

OPERATORS_VERSION = 1
"""The version of the operators. A new operator raises it, and so does a change after which an operator makes other
mutants of some model, or gives them other names: results that stores have of the operators before do not count any more
(decision 52).
"""


def mutants_of(model: BehaviorModel, operators: Iterable[str] | None = None) -> Iterator[Mutant]:
    """Yield the mutants of a model, operator by operator, each in the order of the file.

    A mutant that means the same as the model or as an earlier mutant is left out. So which mutants of one operator
    there are depends on the operators before it; it does not depend on `operators`, which only selects.

    Args:
        model: the model.
        operators: the names of the operators whose mutants are yielded; by default all of `MUTATIONS`.
    """
    chosen = None if operators is None else frozenset(operators)
    meanings = Meanings(model)
    names: dict[str, int] = {}
    for mutation in MUTATIONS.values():
        for mutant in mutation.mutants(model):
            if meanings.is_new(mutant):
                names[mutant.name] = names.get(mutant.name, 0) + 1
                number = names[mutant.name]
                if chosen is None or mutation.name in chosen:
                    yield mutant if number == 1 else replace(mutant, name=f"{mutant.name}#{number}")
