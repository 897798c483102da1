"""What the script of the HTML report is given about cases: columns for the list, and what one case's page adds.

Which cases visit each obligation, and which alone: counted once, as several pages ask.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from scbm.cases.coverage import only_by, visitors_of_each
from scbm.reports.causes import causes_of
from scbm.reports.reproduction import again, place_of, sort_of_place
from scbm.store import Written

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable

    from scbm.cases.coverage import Obligation, Obligations
    from scbm.store import History


def case_columns(history: History, visitors: Visitors) -> dict[str, Any]:
    """All cases column by column, and what their numbers stand for.

    - `obligations`: `[subject, aspect]` for each, in the order of their bits;
    - `goal`, `end`, `set`, `place`: indices into `goals`, `ends`, `sets` and `places`;
    - `places`: in few words and in all of them where cases ran; the latter are empty for simulation;
    - `sets`: what is visited, as hexadecimal digits, the lowest first; digit i says it of obligations 4 i to 4 i + 3;
    - `visits`, `only`: how many obligations of the figure a case visits, and how many of these no other case visits;
    - `visitors`: how many cases visit each obligation;
    - `failures`: `[kind, subject, message, number of its cause]` of each failure, by the index of the case as text.
    """
    cases = history.cases
    counted = history.obligations.counted
    numbers = {
        (label, cause.failure.kind, cause.failure.subject): number
        for number, cause in enumerate(causes_of(history))
        for label in cause.labels
    }
    goals, goal = _numbered(case.goal for case in cases)
    ends, end = _numbered(case.verdict.end.replace("_", " ") for case in cases)
    places, place = _numbered((sort_of_place(case), place_of(case, history)) for case in cases)
    sets, visited = _numbered(f"{case.visited:x}"[::-1] for case in cases)
    return {
        "model": history.model.name,
        "obligations": [[obligation.subject, obligation.aspect] for obligation in history.obligations],
        "operations": [operation.name for operation in history.model.operations],
        "goals": goals,
        "ends": ends,
        "sets": sets,
        "places": places,
        "label": history.labels,
        "goal": goal,
        "end": end,
        "set": visited,
        "place": place,
        "ended_ns": [case.ended_ns for case in cases],
        "requests": [case.requests for case in cases],
        "visits": [(case.visited & counted).bit_count() for case in cases],
        "visitors": [len(cases) for cases in visitors.by_bit],
        "only": [(alone & counted).bit_count() for alone in only_by(history.coverage)],
        "failures": {
            str(index): [
                [failure.kind, failure.subject, failure.message, numbers[label, failure.kind, failure.subject]]
                for failure in case.verdict.failures
            ]
            for index, (label, case) in enumerate(zip(history.labels, cases, strict=True))
            if not case.verdict.passed
        },
    }


def case_details(history: History) -> dict[str, Any]:
    """What only the page of a case shows: `commands` for all, and `texts` and `paths` of written ones by index."""
    file = history.source.path
    texts = {str(i): c.recipe.text for i, c in enumerate(history.cases) if isinstance(c.recipe, Written)}
    paths = {str(i): c.recipe.path for i, c in enumerate(history.cases) if isinstance(c.recipe, Written)}
    return {"commands": [again(case, file, history.runs) for case in history.cases], "texts": texts, "paths": paths}


def _numbered(values: Iterable[Hashable]) -> tuple[list[Hashable], list[int]]:
    """The values without repetition, in the order of their first use, and for each value its number."""
    numbers: dict[Hashable, int] = {}
    column = [numbers.setdefault(value, len(numbers)) for value in values]
    return list(numbers), column


@dataclass(frozen=True, slots=True)
class Visitors:
    """The cases that visit each obligation, as indices into `History.cases`, in their order."""

    obligations: Obligations
    by_bit: tuple[tuple[int, ...], ...]

    @staticmethod
    def of(history: History) -> Visitors:
        """One pass over all cases."""
        return Visitors(history.obligations, visitors_of_each(history.coverage))

    def visiting(self, obligation: Obligation) -> tuple[int, ...]:
        """The cases that visit an obligation of the model."""
        return self.by_bit[self.obligations.bit(obligation).bit_length() - 1]
