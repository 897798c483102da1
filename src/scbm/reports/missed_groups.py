"""Missed obligations in groups: those of one group are missing for one reason, so one sentence says it of all.

The HTML report and the terminal show a group as a sentence with the obligations below it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.coverage import Aspect, Decision
from scbm.model.visible_text import counted
from scbm.reports.cover_advice import CoverMeans, joined_advice

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.cases.coverage import Obligation
    from scbm.reports.missed_reasons import Missed


class MissedRow(Struct, frozen=True):
    """The missed obligations of one subject in a group.

    Attributes:
        missed: the obligations, in the order of the model.
        detail: what their reasons say beyond the sentence of the group; empty if they say the same for all of it.
    """

    missed: tuple[Missed, ...]
    detail: str

    @property
    def obligation(self) -> Obligation:
        """The first of the obligations, which names the operation or the automatic transition."""
        return self.missed[0].obligation

    @property
    def aspects(self) -> str:
        """The missed aspects in words."""
        return ", ".join(each.obligation.aspect.value for each in self.missed)


class ReasonGroup(Struct, frozen=True):
    """Obligations that are missing for one reason; there is at least one."""

    missed: tuple[Missed, ...]

    @property
    def status(self) -> Decision:
        """The status that all of them have."""
        return self.missed[0].status

    @property
    def subjects(self) -> tuple[str, ...]:
        """The operations or automatic transitions, each once."""
        return tuple(dict.fromkeys(each.obligation.subject for each in self.missed))

    @property
    def count(self) -> int:
        """The number of obligations that the figure counts."""
        return sum(each.obligation.counts for each in self.missed)

    @property
    def aspects(self) -> str:
        """How many obligations of each aspect are missing, such as `285 disabled, 285 failed`."""
        found = [each.obligation.aspect.value for each in self.missed]
        return ", ".join(f"{found.count(aspect)} {aspect}" for aspect in dict.fromkeys(found))

    @property
    def sentence(self) -> str:
        """The reason as a sentence about all of them: `285 operations are in no plan of 10 cases: add a goal …`."""
        first = self.missed[0]
        subjects = self.subjects
        if len(subjects) == 1 and len(dict.fromkeys(each.reason for each in self.missed)) == 1:
            return f"{subjects[0]}: {first.reason}"
        noun = "automatic transition" if first.obligation.aspect is Aspect.TAKEN else "operation"
        words = self._advice_words()
        return f"{counted(len(subjects), noun)} {first.sort}{f': {words}' if words else ''}"

    def _advice_words(self) -> str:
        """Return what would cover them; the reason of another status, if it is that of all; empty for none."""
        advice = [each.advice for each in self.missed if each.advice is not None]
        if not advice:
            return ""
        joined = joined_advice(advice)
        return _SHORTER.get(joined.means, joined.words.removeprefix("no plan needs them: "))

    @property
    def rows(self) -> tuple[MissedRow, ...]:
        """A row for each subject, in the order of the model."""
        is_same = len(dict.fromkeys(each.detail for each in self.missed)) == 1
        by_subject: dict[str, list[Missed]] = {}
        for each in self.missed:
            by_subject.setdefault(each.obligation.subject, []).append(each)
        return tuple(
            MissedRow(tuple(found), "" if is_same else "; ".join(dict.fromkeys(each.detail for each in found)))
            for found in by_subject.values()
        )


_SHORTER = {
    CoverMeans.GUARDED: "their guards never held",
    CoverMeans.UNDISTURBED: "an injection can disable them",
}
"""Words of means whose own words say again what the first half of the sentence says."""


def reason_groups(missed: Iterable[Missed]) -> tuple[ReasonGroup, ...]:
    """Return the groups of missed obligations: undecided ones first, then by their size, the largest first."""
    found: dict[tuple[object, ...], list[Missed]] = {}
    for each in missed:
        means = None if each.advice is None else each.advice.means
        is_automatic = each.obligation.aspect is Aspect.TAKEN
        found.setdefault((each.status, each.sort, means, is_automatic), []).append(each)
    groups = (ReasonGroup(tuple(group)) for group in found.values())
    order = list(Decision)
    return tuple(sorted(groups, key=lambda g: (g.status is not Decision.UNDECIDED, order.index(g.status), -g.count)))
