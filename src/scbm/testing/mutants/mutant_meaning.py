"""The meanings of mutants, to leave out those that equal the original model or an earlier mutant."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from scbm.model import Operation, Transition
from scbm.model.normal_form import AllOf, AnyOf, normal_form

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator, Sequence

    from scbm.model import BehaviorModel, EnvironmentTransition, Predicate, Resource, Variable
    from scbm.model.normal_form import NormalForm
    from scbm.testing.mutants.mutant import Mutant

    Entry: TypeAlias = Operation | Transition | EnvironmentTransition | Resource | Variable


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
