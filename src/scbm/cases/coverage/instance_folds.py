"""Short lists of names: the instances of an entry with parameters stand under its name (semantics 8.6)."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.cases.coverage.obligations import Aspect

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from scbm.cases.coverage.obligations import Obligation
    from scbm.model import BehaviorModel

_FEW = 3
"""Maximum number of instances that are listed by name, unless the entry has no others."""

_SECTIONS = {True: "automatic_transitions", False: "operations"}


@dataclass(frozen=True, slots=True)
class InstanceFolds:
    """The entries with parameters of a model, and the number of instances of each.

    Attributes:
        entries: the name of the entry of each instance, by its section and its name.
        counts: the number of instances of each entry, by its section and its name.
    """

    entries: Mapping[tuple[str, str], str]
    counts: Mapping[tuple[str, str], int]

    @staticmethod
    def of(model: BehaviorModel) -> InstanceFolds:
        """Return the entries of a model; a model without parameters has none."""
        entries = {(origin.section, origin.name): origin.lifted for origin in model.origins}
        return InstanceFolds(entries, Counter((section, lifted) for (section, _), lifted in entries.items()))

    def entry_of(self, obligation: Obligation) -> str | None:
        """Return the name of the entry that the subject of an obligation is an instance of; `None` if of none."""
        return self.entries.get((_SECTIONS[obligation.aspect is Aspect.TAKEN], obligation.subject))

    def count(self, entry: str, *, is_automatic: bool) -> int:
        """Return the number of instances of an entry."""
        return self.counts[_SECTIONS[is_automatic], entry]

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
