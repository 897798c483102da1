"""Short texts for many obligations, plans and lists."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from scbm.cases.coverage import STATE_ASPECTS, Aspect

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from scbm.cases.coverage import InstanceFolds, Obligation

_ALL_STATES = "every state"
_TIMES = "\u00d7"


def in_few_words(obligations: Iterable[Obligation], folds: InstanceFolds | None = None) -> tuple[str, ...]:
    """Return the obligations, grouped by equal aspects: `scan, pick: failed, timedout`; automatic transitions last.

    Args:
        obligations: the obligations.
        folds: the entries whose instances are folded; by default no entry's are.
    """
    by_subject: dict[str, list[Aspect]] = {}
    taken: list[str] = []
    for obligation in obligations:
        if obligation.aspect is Aspect.TAKEN:
            taken.append(obligation.subject)
        else:
            by_subject.setdefault(obligation.subject, []).append(obligation.aspect)
    by_aspects: dict[str, list[str]] = {}
    for subject, aspects in by_subject.items():
        by_aspects.setdefault(aspects_in_words(aspects), []).append(subject)
    groups = [
        f"{', '.join(subjects if folds is None else folds.folded(subjects))}: {aspects}"
        for aspects, subjects in by_aspects.items()
    ]
    if not taken:
        return tuple(groups)
    transitions = taken if folds is None else folds.folded(taken, is_automatic=True)
    return (*groups, ", ".join(f"automatic/{name}" for name in transitions))


def plan_in_words(plan: Iterable[str], arrow: str) -> str:
    """Return the operations of a plan with an arrow between them; an operation repeated in a row is named once."""
    rows = ((name, sum(1 for _ in row)) for name, row in groupby(plan))
    return arrow.join(name if count == 1 else f"{name} {_TIMES}{count}" for name, count in rows)


def aspects_in_words(aspects: Iterable[Aspect]) -> str:
    """Return the aspects in the order of the paper's report: `executing, failed`, or `every state`."""
    there = frozenset(aspects)
    states = [aspect.value for aspect in STATE_ASPECTS if aspect in there]
    others = [aspect.value for aspect in Aspect if aspect in there and aspect not in STATE_ASPECTS]
    return ", ".join([_ALL_STATES, *others] if len(states) == len(STATE_ASPECTS) else [*states, *others])


def reason_about_it(reason: str, subject: str) -> str:
    """Return a reason without the name of its subject, which stands in the line above."""
    if reason.startswith(f"{subject} "):
        return f"it {reason.removeprefix(subject).lstrip()}"
    return reason.replace(f"takes automatic/{subject};", "takes it;")


def listed(parts: Sequence[str], word: str = "and") -> str:
    """Return the parts as `a, b and c`."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} {word} {parts[-1]}"
