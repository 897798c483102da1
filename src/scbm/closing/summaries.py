"""Many obligations in few words."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from scbm.cases.coverage import STATE_ASPECTS, Aspect

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from scbm.cases.coverage import Obligation

_ALL_STATES = "every state"
_TIMES = "\N{MULTIPLICATION SIGN}"


def in_few_words(obligations: Iterable[Obligation]) -> tuple[str, ...]:
    """The obligations, operations with equal aspects together: `scan, pick: failed, timedout`; automatic ones last."""
    by_subject: dict[str, list[Aspect]] = {}
    taken: list[str] = []
    for obligation in obligations:
        if obligation.aspect is Aspect.TAKEN:
            taken.append(str(obligation))
        else:
            by_subject.setdefault(obligation.subject, []).append(obligation.aspect)
    by_aspects: dict[str, list[str]] = {}
    for subject, aspects in by_subject.items():
        by_aspects.setdefault(aspects_in_words(aspects), []).append(subject)
    told = [f"{', '.join(subjects)}: {aspects}" for aspects, subjects in by_aspects.items()]
    return (*told, ", ".join(taken)) if taken else tuple(told)


def plan_in_words(plan: Iterable[str], arrow: str) -> str:
    """The operations of a plan, an arrow between them; what is done several times in a row is told once."""
    rows = ((name, sum(1 for _ in row)) for name, row in groupby(plan))
    return arrow.join(name if count == 1 else f"{name} {_TIMES}{count}" for name, count in rows)


def aspects_in_words(aspects: Iterable[Aspect]) -> str:
    """The aspects in the order of the paper's report: `executing, failed`, or `every state`."""
    there = frozenset(aspects)
    states = [aspect.value for aspect in STATE_ASPECTS if aspect in there]
    others = [aspect.value for aspect in Aspect if aspect in there and aspect not in STATE_ASPECTS]
    return ", ".join([_ALL_STATES, *others] if len(states) == len(STATE_ASPECTS) else [*states, *others])


def listed(parts: Sequence[str], word: str = "and") -> str:
    """`a, b and c`."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} {word} {parts[-1]}"
