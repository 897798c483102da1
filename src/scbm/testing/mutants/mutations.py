"""All mutants of a model: the registry of mutation operators (`MUTATIONS`), and which mutants are left out."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeAlias

from scbm.model import Operation, Transition
from scbm.model.normal_form import AllOf, AnyOf, normal_form
from scbm.testing.mutants.action_mutations import DropAction, DropCleanUp, MoveAction, OtherActionValue, OtherTrigger
from scbm.testing.mutants.deadline_mutations import LongerDeadline, NoDeadline, ShorterDeadline
from scbm.testing.mutants.entry_mutations import DropOperation, DropTransition, SwapOperations, SwapTransitions
from scbm.testing.mutants.guard_mutations import (
    DropConjunct,
    MoveConjunct,
    NegateConjunct,
    OtherGuardValue,
    OtherGuardVariable,
    OtherThreshold,
)
from scbm.testing.mutants.world_mutations import (
    DropEnvironment,
    DropRequestValue,
    EnvironmentActions,
    EnvironmentGuard,
    OtherInitialValue,
    OtherRequestValue,
)

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Iterator, Sequence

    from scbm.model import BehaviorModel, EnvironmentTransition, Predicate, Resource, Variable
    from scbm.model.normal_form import NormalForm
    from scbm.testing.mutants.mutation import Mutant, Mutation

    Entry: TypeAlias = Operation | Transition | EnvironmentTransition | Resource | Variable


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

OPERATORS_VERSION = 2
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


class Meanings:
    """The meanings of one model and of the mutants of it so far.

    The meaning of a mutant is made of the entries that it does not share with the model. Guards are compared in normal
    form and actions without their order; of a transition that the planner ignores `g` and `gr` count together, and so
    do `a` and `ar`. So equal meanings have equal runs.
    """

    def __init__(self, model: BehaviorModel) -> None:
        self._model = model
        self._sections = _sections(model)
        self._own: dict[tuple[str, str], Hashable] = {}
        self._known: set[Hashable] = set()

    def is_new(self, mutant: Mutant) -> bool:
        """Return whether a mutant differs from the model and from all mutants before; remember it."""
        meaning = tuple(self._differences(mutant.model))
        if not meaning or meaning in self._known:
            return False
        self._known.add(meaning)
        return True

    def _differences(self, changed: BehaviorModel) -> Iterator[Hashable]:
        """Yield the order of each section with other entries, and the meaning of each entry that changed."""
        for key, entries in _sections(changed).items():
            old = self._sections[key]
            if [entry.name for entry in old] != [entry.name for entry in entries]:
                yield key, tuple(entry.name for entry in entries)
                continue
            for before, after in zip(old, entries, strict=True):
                if before is not after and self._own_meaning(before, key) != (meaning := self._meaning(after, key)):
                    yield key, after.name, meaning

    def _own_meaning(self, entry: Entry, section: str) -> Hashable:
        """Return the meaning of an entry of the original; memoized."""
        if (section, entry.name) not in self._own:
            self._own[section, entry.name] = self._meaning(entry, section)
        return self._own[section, entry.name]

    def _meaning(self, entry: Entry, section: str) -> Hashable:
        match entry:
            case Operation():
                deadlines = entry.deadline_ns, entry.disabled_deadline_ns
                failed = None if entry.failed is None else self._run(entry.failed)
                return (*map(self._planned, (entry.pre, entry.post)), failed, frozenset(entry.timedout), deadlines)
            case Transition():
                return self._run(entry)
            case _:
                return section, entry

    def _planned(self, transition: Transition) -> Hashable:
        return self._form(transition.g), frozenset(transition.a), self._run(transition)

    def _run(self, transition: Transition) -> Hashable:
        return self._form(transition.running_guard), frozenset(transition.running_actions)

    def _form(self, predicate: Predicate) -> Hashable:
        return _unordered(normal_form(predicate, self._model.running_space))


def _sections(model: BehaviorModel) -> dict[str, Sequence[Entry]]:
    return {
        "variables": model.variables,
        "resources": model.resources,
        "operations": model.operations,
        "automatic_transitions": model.automatic_transitions,
        "environment": model.environment,
    }


def _unordered(form: NormalForm) -> Hashable:
    """Return the normal form as a key in which the order of conjuncts and disjuncts does not count."""
    if isinstance(form, AllOf | AnyOf):
        return type(form).__name__, frozenset(_unordered(part) for part in form.parts)
    return form
