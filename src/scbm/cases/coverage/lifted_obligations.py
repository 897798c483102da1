"""Lifted obligations: the statuses of all instances of an entry, and short lists of their names (semantics 8.6)."""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING

from msgspec import Struct, field
from msgspec.structs import replace

from scbm.cases.coverage.obligations import Aspect, Figure, Obligation, Obligations
from scbm.cases.coverage.statuses import Decision, count_statuses, coverable_figure

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from scbm.cases.coverage.statuses import ObligationStatus, Statuses
    from scbm.model import BehaviorModel, ObjectLists


_ORDER = (Decision.UNDECIDED, Decision.WAIVED, Decision.EXCLUDED, Decision.UNCOVERABLE)
"""The statuses of instances that are not covered; the first that any instance has is that of the lifted obligation."""


def folded_decision(decisions: Iterable[Decision]) -> Decision:
    """Return the status of a lifted obligation, whose instances have these statuses."""
    found = dict.fromkeys(decisions)
    return Decision.COVERED if Decision.COVERED in found else first_missed(found)


def first_missed(decisions: Iterable[Decision]) -> Decision:
    """Return the first status that any instance has, covered ones left out; `COVERED` if all are."""
    found = dict.fromkeys(decisions)
    return next((decision for decision in _ORDER if decision in found), Decision.COVERED)


class ObjectListVisits(Struct, frozen=True):
    """The visits of runs of the same lifted model under other objects (semantics 8.7).

    Attributes:
        objects: the objects of these runs.
        cases: the number of their cases.
        visited: the lifted obligations of which they visited an instance, each with whether its entry has parameters.
        forced: those of them that they visited only after a state was forced.
    """

    objects: ObjectLists
    cases: int
    visited: frozenset[tuple[Obligation, bool]]
    forced: frozenset[tuple[Obligation, bool]] = frozenset()

    @staticmethod
    def of(model: BehaviorModel, cases: int, visited: int, forced: int) -> ObjectListVisits:
        """Return the visits of cases of a model. Raise `ValueError` for a model without objects.

        Args:
            model: the model with its own objects.
            cases: the number of the cases.
            visited: the ground obligations that they visit, as bits.
            forced: those of them that only forced states visit, as bits.
        """
        if model.objects is None:
            raise ValueError(f"the model `{model.name}` has no objects")
        obligations = Obligations.of(model)
        origins = {(origin.section, origin.name): origin.lifted for origin in model.origins}
        keys = [(obligations.bit(each), lifted_obligation(each, origins)) for each in obligations]
        free = frozenset(key for bit, key in keys if visited & ~forced & bit)
        return ObjectListVisits(
            model.objects,
            cases,
            frozenset(key for bit, key in keys if visited & bit),
            frozenset(key for bit, key in keys if forced & bit) - free,
        )

    def decision(self, obligation: Obligation, *, is_lifted: bool) -> Decision | None:
        """Return the status of the visited instances of a lifted obligation; `None` if no instance was visited."""
        key = (obligation, is_lifted)
        if key not in self.visited:
            return None
        return Decision.UNDECIDED if key in self.forced else Decision.COVERED


class LiftedStatus(Struct, frozen=True):
    """The status of one lifted obligation.

    Attributes:
        obligation: the obligation; its subject is the name of the lifted entry.
        is_lifted: whether the entry has parameters; other entries are listed with their one instance.
        decisions: the statuses of the instances, in the order of the model.
        visited: the number of instances that a case visits, forced states included.
        elsewhere: the statuses of visited instances under other objects, one for each model that has any.
    """

    obligation: Obligation
    is_lifted: bool
    decisions: tuple[Decision, ...]
    visited: int
    elsewhere: tuple[Decision, ...] = ()

    @property
    def decision(self) -> Decision:
        """The status: covered if any instance is, uncoverable if all are."""
        return folded_decision((*self.decisions, *self.elsewhere))

    @property
    def is_visited(self) -> bool:
        """Whether any instance was visited, by a forced state or without, whatever its status is."""
        return bool(self.visited or self.elsewhere)

    @property
    def missed(self) -> int:
        """The number of instances that no case visits."""
        return len(self.decisions) - self.visited


class LiftedStatuses(Struct, frozen=True):
    """The statuses of the lifted obligations of a model.

    Attributes:
        entries: one for each obligation, *queued* included, in the order of the model.
        objects: the objects of the model; `None` if its file has no types.
        others: the visits under other objects that are united with those of the model.
    """

    entries: tuple[LiftedStatus, ...]
    objects: ObjectLists | None = None
    others: tuple[ObjectListVisits, ...] = ()

    @staticmethod
    def of(model: BehaviorModel, statuses: Statuses, others: Iterable[ObjectListVisits] = ()) -> LiftedStatuses | None:
        """Return the statuses of a model with parameters; `None` for a model without.

        Args:
            model: the model.
            statuses: the statuses of its ground obligations.
            others: the visits of runs of the same lifted model under other objects.
        """
        if not any(origin.section in _SECTIONS.values() for origin in model.origins):
            return None
        origins = {(origin.section, origin.name): origin.lifted for origin in model.origins}
        instances: dict[tuple[Obligation, bool], list[ObligationStatus]] = {}
        for entry in statuses.entries:
            instances.setdefault(lifted_obligation(entry.obligation, origins), []).append(entry)
        joined = tuple(others)
        entries = (
            LiftedStatus(
                *key,
                tuple(each.decision for each in found),
                sum(each.is_visited for each in found),
                tuple(_elsewhere(*key, joined)),
            )
            for key, found in instances.items()
        )
        return LiftedStatuses(tuple(entries), model.objects, joined)

    @property
    def figure(self) -> Figure:
        """The lifted figure: visited of all lifted obligations, without *queued*."""
        counted = [entry for entry in self.entries if entry.obligation.counts]
        return Figure(sum(entry.is_visited for entry in counted), len(counted))

    @property
    def alone(self) -> LiftedStatuses:
        """The statuses without the visits under other objects."""
        return LiftedStatuses(tuple(replace(entry, elsewhere=()) for entry in self.entries), self.objects)

    @property
    def counts(self) -> dict[Decision, int]:
        """The number of lifted obligations of each status, without *queued*."""
        return count_statuses(entry.decision for entry in self.entries if entry.obligation.counts)

    @property
    def coverable(self) -> Figure:
        """The figure of what can be covered, of lifted obligations."""
        return coverable_figure(self.counts)


def _elsewhere(obligation: Obligation, is_lifted: bool, others: Iterable[ObjectListVisits]) -> Iterator[Decision]:  # noqa: FBT001 - a pair
    found = (each.decision(obligation, is_lifted=is_lifted) for each in others)
    return (decision for decision in found if decision is not None)


def instances_of(text: str, model: BehaviorModel, obligations: Obligations) -> Iterator[Obligation]:
    """Yield the obligations of all instances of an entry with parameters; of one aspect, if the name has it."""
    origins = {(origin.section, origin.name): origin.lifted for origin in model.origins}
    for obligation in obligations:
        lifted, is_lifted = lifted_obligation(obligation, origins)
        if is_lifted and text in (str(lifted), lifted.subject):
            yield obligation


def lifted_names(model: BehaviorModel, obligations: Obligations) -> tuple[str, ...]:
    """Return the names of all lifted obligations, then of the entries with parameters that have them."""
    origins = {(origin.section, origin.name): origin.lifted for origin in model.origins}
    lifted = [each for each, is_lifted in (lifted_obligation(o, origins) for o in obligations) if is_lifted]
    return tuple(dict.fromkeys((*map(str, lifted), *(each.subject for each in lifted))))


def lifted_obligation(obligation: Obligation, origins: Mapping[tuple[str, str], str]) -> tuple[Obligation, bool]:
    """Return the lifted obligation of a ground one, and whether its entry has parameters.

    Args:
        obligation: the obligation.
        origins: the lifted name of each ground entry, by its section and its name.
    """
    section = "automatic_transitions" if obligation.aspect is Aspect.TAKEN else "operations"
    lifted = origins.get((section, obligation.subject))
    return (obligation, False) if lifted is None else (Obligation(lifted, obligation.aspect), True)


_FEW = 3
"""Maximum number of instances that are listed by name, unless the entry has no others."""

_SECTIONS = {True: "automatic_transitions", False: "operations"}


class InstanceFolds(Struct, frozen=True):
    """The entries with parameters of a model, and the number of instances of each.

    Attributes:
        entries: the name of the entry of each instance, by its section and its name.
        counts: the number of instances of each entry, by its section and its name.
        indexed: the name with its types, such as `at[robot]`, for each instance of a variable or a resource: `at.r1`.
    """

    entries: Mapping[tuple[str, str], str]
    counts: Mapping[tuple[str, str], int]
    indexed: Mapping[str, str] = field(default_factory=dict)

    @staticmethod
    def of(model: BehaviorModel) -> InstanceFolds:
        """Return the entries of a model; a model without parameters has none."""
        entries = {(origin.section, origin.name): origin.lifted for origin in model.origins}
        counts = Counter((section, lifted) for (section, _), lifted in entries.items())
        return InstanceFolds(entries, counts, _indexed_names(model))

    def entry_of(self, obligation: Obligation) -> str | None:
        """Return the name of the entry that the subject of an obligation is an instance of; `None` if of none."""
        return self.entries.get((_SECTIONS[obligation.aspect is Aspect.TAKEN], obligation.subject))

    def count(self, entry: str, *, is_automatic: bool) -> int:
        """Return the number of instances of an entry."""
        return self.counts[_SECTIONS[is_automatic], entry]

    def in_entries(self, text: str) -> str:
        """Return a text with names of entries for those of their instances: `n[robot] += 1` for `n.r1 += 1`."""
        return _NAME.sub(lambda match: self._entry_name(match[0]), text) if self.entries else text

    def _entry_name(self, name: str) -> str:
        subject = name.removesuffix(".state")
        for section in _SECTIONS.values():
            if (entry := self.entries.get((section, subject))) is not None:
                return f"{entry}{name.removeprefix(subject)}"
        return self.indexed.get(name, name)

    def folded(self, subjects: Iterable[str], *, is_automatic: bool = False) -> tuple[str, ...]:
        """Return names with instances folded: `move (8)` for all of `move`, `move (5 of 8)` for many, names for few."""
        section = _SECTIONS[is_automatic]
        groups: dict[tuple[str, bool], list[str]] = {}
        for subject in subjects:
            entry = self.entries.get((section, subject))
            groups.setdefault((subject if entry is None else entry, entry is not None), []).append(subject)
        return tuple(
            words
            for (entry, is_lifted), names in groups.items()
            for words in (self._words(entry, section, names) if is_lifted else names)
        )

    def _words(self, entry: str, section: str, names: list[str]) -> list[str]:
        count = self.counts[section, entry]
        if len(names) == count:
            return [f"{entry} ({count})"]
        return names if len(names) <= _FEW else [f"{entry} ({len(names)} of {count})"]


_NAME = re.compile(r"[A-Za-z_]\w*(?:\.\w+)+", re.ASCII)
_REQUEST = re.compile(r"_req_(?:state|trigger)\Z", re.ASCII)


def _indexed_names(model: BehaviorModel) -> dict[str, str]:
    """Return the names with types for the instances of variables and resources, their requests included."""
    if model.objects is None:
        return {}
    found: dict[str, tuple[str, tuple[str, ...]]] = {}
    every = [each for _, objects in model.objects.types for each in objects]
    for variable in model.running_space:
        suffix = _REQUEST.search(variable.name)
        base, *index = variable.name.removesuffix(suffix[0] if suffix else "").split(".")
        while index and index[0] not in every:
            base = f"{base}.{index.pop(0)}"
        if index and all(each in every for each in index):
            found[variable.name] = (f"{base}{suffix[0] if suffix else ''}", tuple(index))
    used: dict[tuple[str, int], dict[str, None]] = {}
    for base, chosen in found.values():
        for position, each in enumerate(chosen):
            used.setdefault((base, position), {})[each] = None
    kinds = {key: _smallest_type(list(objects), model.objects) for key, objects in used.items()}
    return {
        name: f"{base}[{', '.join(kinds[base, position] for position in range(len(chosen)))}]"
        for name, (base, chosen) in found.items()
    }


def _smallest_type(objects: Iterable[str], lists: ObjectLists) -> str:
    """Return the type that has all of some objects, in its subtypes or itself, and the fewest others."""
    own, parents = dict(lists.types), dict(lists.parents)
    sizes: dict[str, list[str]] = {kind: [] for kind in own}
    for kind, members in own.items():
        above: str | None = kind
        while above is not None:
            sizes.setdefault(above, []).extend(members)
            above = parents.get(above)
    wanted = list(objects)
    fitting = [kind for kind, found in sizes.items() if all(each in found for each in wanted)]
    return min(fitting, key=lambda kind: len(sizes[kind]), default="\u2026")
