"""All mutants of a model, without those that mean the same as the model or as an earlier mutant."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.model import Operation, Transition
from scbm.model.normal_form import AllOf, AnyOf, normal_form
from scbm.mutation.mutants import SubjectKind, entries_of
from scbm.mutation.mutation_operators import MUTATIONS

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Iterator

    from scbm.model import BehaviorModel, Predicate
    from scbm.model.normal_form import NormalForm
    from scbm.mutation.mutants import ModelEntry, Mutant


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
    for operator, mutation in MUTATIONS.items():
        for mutant in mutation.mutants(model, operator):
            if meanings.is_new(mutant):
                names[mutant.name] = names.get(mutant.name, 0) + 1
                number = names[mutant.name]
                if chosen is None or operator in chosen:
                    yield mutant if number == 1 else replace(mutant, name=f"{mutant.name}#{number}")


class Meanings:
    """The meanings of one model and of the mutants of it so far.

    The meaning of a mutant is made of the entries that it does not share with the model. Guards are compared in normal
    form and actions without their order; of a transition that the planner ignores `g` and `gr` count together, and so
    do `a` and `ar`. So equal meanings have equal runs.
    """

    def __init__(self, model: BehaviorModel) -> None:
        self._model = model
        self._entries = entries_of(model)
        self._own: dict[tuple[SubjectKind, str], Hashable] = {}
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
        for kind, entries in entries_of(changed).items():
            old = self._entries[kind]
            if [entry.name for entry in old] != [entry.name for entry in entries]:
                yield kind, tuple(entry.name for entry in entries)
                continue
            for before, after in zip(old, entries, strict=True):
                if before is not after and self._own_meaning(before, kind) != (meaning := self._meaning(after)):
                    yield kind, after.name, meaning

    def _own_meaning(self, entry: ModelEntry, kind: SubjectKind) -> Hashable:
        """Return the meaning of an entry of the original; memoized."""
        if (kind, entry.name) not in self._own:
            self._own[kind, entry.name] = self._meaning(entry)
        return self._own[kind, entry.name]

    def _meaning(self, entry: ModelEntry) -> Hashable:
        match entry:
            case Operation():
                deadlines = entry.deadline_ns, entry.disabled_deadline_ns
                failed = None if entry.failed is None else self._run(entry.failed)
                return (*map(self._planned, (entry.pre, entry.post)), failed, frozenset(entry.timedout), deadlines)
            case Transition():
                return self._run(entry)
            case _:
                return entry

    def _planned(self, transition: Transition) -> Hashable:
        return self._form(transition.g), frozenset(transition.a), self._run(transition)

    def _run(self, transition: Transition) -> Hashable:
        return self._form(transition.running_guard), frozenset(transition.running_actions)

    def _form(self, predicate: Predicate) -> Hashable:
        return _unordered(normal_form(predicate, self._model.running_space))


def _unordered(form: NormalForm) -> Hashable:
    """Return the normal form as a key in which the order of conjuncts and disjuncts does not count."""
    if isinstance(form, AllOf | AnyOf):
        return type(form).__name__, frozenset(_unordered(part) for part in form.parts)
    return form
