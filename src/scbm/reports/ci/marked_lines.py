"""The lines of a model file with what they say that can be measured, for reports that show lines (decision 21)."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from scbm.cases.coverage import STATE_ASPECTS, Aspect, Obligation
from scbm.files import read_located

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases.coverage import Coverage
    from scbm.files import Places
    from scbm.model import BehaviorModel, Operation
    from scbm.store import ModelSource

_LINE_END = re.compile(r"\r\n|\r|\n")
_KEYS = ("g", "gr", "a", "ar")
_ROLES = (
    *(("precondition", Aspect.EXECUTING, ("pre", key)) for key in _KEYS),
    *(("postcondition", Aspect.COMPLETED, ("post", key)) for key in _KEYS),
    ("deadline", Aspect.TIMEDOUT, ("deadline",)),
    ("failed", Aspect.FAILED, ("failed",)),
    ("timedout", Aspect.TIMEDOUT, ("timedout",)),
)
"""The parts of an operation that lines show: what they are called, what they take part in, where they stand in it."""


@dataclass(frozen=True, slots=True)
class MarkedLine:
    """A line of a model file.

    Attributes:
        number: counted from 1.
        text: the line, without its end.
        role: what it says: `operation`, `precondition`, `postcondition`, `deadline`, `failed`, `timedout` or
            `automatic transition`; of several in one line, the first. Empty if it says nothing that can be measured.
        obligations: those that are branches of this line, each with the number of cases that visited it.
        hits: how many cases executed it; `None` if there is nothing to execute.
        state: `visited` if it was executed and all of its branches were visited, `missed` if neither was, else
            `partly`; empty if there is nothing to measure.
    """

    number: int
    text: str
    role: str = ""
    obligations: tuple[tuple[Obligation, int], ...] = ()
    hits: int | None = None
    state: str = ""


@dataclass(frozen=True, slots=True)
class MarkedPart:
    """An operation or an automatic transition.

    Attributes:
        name: that of the operation, or `automatic/` and that of the transition.
        number: the line of its key, counted from 1.
        lines: the numbers of all lines of it that say something measurable, rising.
        hits: in how many cases it left its initial state, or was taken.
    """

    name: str
    number: int
    lines: tuple[int, ...]
    hits: int

    def owns(self, obligation: Obligation) -> bool:
        """Whether an obligation in the figure is one of this part."""
        return self.name == (str(obligation) if obligation.aspect is Aspect.TAKEN else obligation.subject)


@dataclass(frozen=True, slots=True)
class MarkedFile:
    """A model file.

    Attributes:
        lines: each of its lines.
        parts: its operations, then its automatic transitions.
    """

    lines: tuple[MarkedLine, ...]
    parts: tuple[MarkedPart, ...]

    @property
    def measured(self) -> tuple[MarkedLine, ...]:
        """The lines that say something measurable."""
        return tuple(line for line in self.lines if line.hits is not None)


@dataclass(frozen=True, slots=True)
class _Saying:
    """What something in a line says: its part, its role, and the obligations any of which means that it happened."""

    part: str
    number: int
    role: str
    happened: tuple[Obligation, ...]


def mark_lines(model: BehaviorModel, source: ModelSource, coverage: Coverage) -> tuple[MarkedLine, ...]:
    """Each line of a model file, as `mark_file` has it."""
    return mark_file(model, source, coverage).lines


def mark_file(model: BehaviorModel, source: ModelSource, coverage: Coverage) -> MarkedFile:
    """A model file with its marks. Each obligation in the figure is a branch of exactly one line.

    Args:
        model: the model that the source says.
        source: its file.
        coverage: what was visited of it.

    Raises:
        InputError: the source says no model.
    """
    _, places = read_located(source.text, source.path)
    marker = _Marker(coverage, tuple(_sayings(model, places)), tuple(_branches(model, places)))
    texts = _LINE_END.split(source.text)
    if not texts[-1]:
        texts.pop()  # what is behind the end of the last line
    lines = tuple(marker.line(number, text) for number, text in enumerate(texts, start=1))
    return MarkedFile(lines, marker.parts())


def as_code(file: MarkedFile) -> MarkedFile:
    """A model file as tools for code understand one: a line was executed if and only if one of its branches was.

    They call a line missed, or refuse the file as inconsistent, if it was executed and none of its branches was. An
    operation that never failed would be such a line. So the branches of the line of its key stand in that of its
    precondition here, and a line is executed as often as its most frequent branch at least.
    """
    numbers = {obligation: line.number for line in file.lines for obligation, _ in line.obligations}
    keys = {part.name: part.number for part in file.parts}
    branches: dict[int, list[tuple[Obligation, int]]] = {}
    for line in file.lines:
        for obligation, count in line.obligations:
            is_of_key = obligation.aspect is not Aspect.TAKEN and keys[obligation.subject] == line.number
            place = numbers[Obligation(obligation.subject, Aspect.EXECUTING)] if is_of_key else line.number
            branches.setdefault(place, []).append((obligation, count))
    lines = (_with_branches(line, branches.get(line.number, [])) for line in file.lines)
    return MarkedFile(tuple(lines), file.parts)


def _with_branches(line: MarkedLine, branches: Sequence[tuple[Obligation, int]]) -> MarkedLine:
    if line.hits is None:
        return line
    counts = [count for _, count in branches]
    hits = max([line.hits, *counts])
    return replace(line, obligations=tuple(branches), hits=hits, state=_state([hits, *counts]))


def _state(counts: Sequence[int]) -> str:
    return "visited" if all(counts) else "partly" if any(counts) else "missed"


def _sayings(model: BehaviorModel, places: Places) -> Iterator[_Saying]:
    """All that lines say, part by part; the first of a part is its key."""
    for operation in model.operations:
        path = ("operations", operation.name)
        aspects = {aspect: Obligation(operation.name, aspect) for aspect in STATE_ASPECTS}
        yield _Saying(operation.name, _line(places, path), "operation", tuple(aspects.values()))
        for role, aspect, below in _ROLES:
            for number in places.lines((*path, *below)):
                yield _Saying(operation.name, number, role, (aspects[aspect],))
    for transition in model.automatic_transitions:
        path = ("automatic_transitions", transition.name)
        taken = Obligation(transition.name, Aspect.TAKEN)
        for number in (_line(places, path), *places.lines(path)):
            yield _Saying(str(taken), number, "automatic transition", (taken,))


def _branches(model: BehaviorModel, places: Places) -> Iterator[tuple[Obligation, int]]:
    """Each obligation in the figure, and the line that it is a branch of."""
    for operation in model.operations:
        for aspect in STATE_ASPECTS:
            path = ("operations", operation.name, *_below(aspect, operation))
            yield Obligation(operation.name, aspect), _line(places, path)
    for transition in model.automatic_transitions:
        path = ("automatic_transitions", transition.name)
        yield Obligation(transition.name, Aspect.TAKEN), _line(places, path)


def _below(aspect: Aspect, operation: Operation) -> tuple[str, ...]:
    """Where, below the key of an operation, the line stands that decides whether a state is visited."""
    match aspect:
        case Aspect.EXECUTING | Aspect.DISABLED:
            return ("pre", "g")
        case Aspect.COMPLETED:
            return ("post", "g")
        case Aspect.TIMEDOUT:
            return ("timedout",) if operation.deadline_ns is None else ("deadline",)
        case _:
            return ()


def _line(places: Places, path: tuple[str, ...]) -> int:
    """The line of a key; if there is none, of the last one on the way to it."""
    return max(1, places.find(path)[0].line)


class _Marker:
    """Counts, for lines and for parts, the cases in which what they say happened."""

    def __init__(
        self, coverage: Coverage, sayings: Sequence[_Saying], branches: Sequence[tuple[Obligation, int]]
    ) -> None:
        self._obligations = coverage.obligations
        self._visits = coverage.visits()
        self._sets = Counter(visited for _, visited in coverage.cases)  # many cases visit the same
        self._known: dict[int, int] = {}
        self._by_line: dict[int, list[_Saying]] = {}
        self._by_part: dict[str, list[_Saying]] = {}
        self._branches: dict[int, list[Obligation]] = {}
        for saying in sayings:
            self._by_line.setdefault(saying.number, []).append(saying)
            self._by_part.setdefault(saying.part, []).append(saying)
        for obligation, number in branches:
            self._branches.setdefault(number, []).append(obligation)

    def line(self, number: int, text: str) -> MarkedLine:
        """One line of the file."""
        sayings = self._by_line.get(number)
        if not sayings:
            return MarkedLine(number, text)
        branches = tuple((obligation, self._visits[obligation]) for obligation in self._branches.get(number, ()))
        hits = self._cases(sayings)
        state = _state([hits, *(count for _, count in branches)])
        return MarkedLine(number, text, sayings[0].role, branches, hits, state)

    def parts(self) -> tuple[MarkedPart, ...]:
        """All parts of the model."""
        return tuple(
            MarkedPart(name, said[0].number, tuple(sorted({saying.number for saying in said})), self._cases(said[:1]))
            for name, said in self._by_part.items()
        )

    def _cases(self, sayings: Sequence[_Saying]) -> int:
        """In how many cases any of what is said happened."""
        mask = 0
        for saying in sayings:
            for obligation in saying.happened:
                mask |= self._obligations.bit(obligation)
        if mask not in self._known:
            self._known[mask] = sum(count for visited, count in self._sets.items() if visited & mask)
        return self._known[mask]
