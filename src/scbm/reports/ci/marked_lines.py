"""The lines of a model file with the obligations that each stands for, for reports by line (decision 21)."""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

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
"""The parts of an operation that have lines: role, aspect, and the path of the keys below the operation."""


class MarkedLine(Struct, frozen=True):
    """A line of a model file.

    Attributes:
        number: counted from 1.
        text: the line, without its end.
        role: what it stands for: `operation`, `precondition`, `postcondition`, `deadline`, `failed`, `timedout` or
            `automatic transition`; of several in one line, the first. Empty for a line without obligations.
        obligations: the branches of this line, each with the number of cases that visited it.
        hits: the number of cases that executed it; `None` if it cannot be executed.
        state: `visited` if it was executed and all of its branches were visited, `missed` if neither was, else
            `partly`; empty if there is nothing to measure.
    """

    number: int
    text: str
    role: str = ""
    obligations: tuple[tuple[Obligation, int], ...] = ()
    hits: int | None = None
    state: str = ""


class MarkedPart(Struct, frozen=True):
    """An operation or an automatic transition.

    Attributes:
        name: the name of the operation, or `automatic/` and the name of the transition.
        number: the line of its key, counted from 1.
        lines: the numbers of its lines with obligations, in ascending order.
        hits: the number of cases in which it left its initial state, or was taken.
    """

    name: str
    number: int
    lines: tuple[int, ...]
    hits: int

    def owns(self, obligation: Obligation) -> bool:
        """Return whether an obligation of the figure belongs to this part."""
        return self.name == (str(obligation) if obligation.aspect is Aspect.TAKEN else obligation.subject)


class MarkedFile(Struct, frozen=True):
    """A model file.

    Attributes:
        lines: each of its lines.
        parts: its operations, then its automatic transitions.
    """

    lines: tuple[MarkedLine, ...]
    parts: tuple[MarkedPart, ...]

    @property
    def measured(self) -> tuple[MarkedLine, ...]:
        """The lines with obligations."""
        return tuple(line for line in self.lines if line.hits is not None)


class _LineMeaning(Struct, frozen=True):
    """One meaning of a line: its part, its role, and the obligations; a visit of any of them executes the line."""

    part: str
    number: int
    role: str
    happened: tuple[Obligation, ...]


def mark_lines(model: BehaviorModel, source: ModelSource, coverage: Coverage) -> tuple[MarkedLine, ...]:
    """Return the lines of a model file, marked as by `mark_file`."""
    return mark_file(model, source, coverage).lines


def mark_file(model: BehaviorModel, source: ModelSource, coverage: Coverage) -> MarkedFile:
    """Return a model file with its marks. Each obligation of the figure is a branch of exactly one line.

    Args:
        model: the model in the source.
        source: its file.
        coverage: the visits of the cases.

    Raises:
        InputError: the source is not a model.
    """
    _, places = read_located(source.text, source.path)
    marker = _Marker(coverage, tuple(_meanings(model, places)), tuple(_branches(model, places)))
    texts = _LINE_END.split(source.text)
    if not texts[-1]:
        texts.pop()  # what is behind the end of the last line
    lines = tuple(marker.line(number, text) for number, text in enumerate(texts, start=1))
    return MarkedFile(lines, marker.parts())


def as_code(file: MarkedFile) -> MarkedFile:
    """Return the file as coverage tools for code expect it: a line is executed if and only if one of its branches is.

    Tools report a line as missed, or refuse the file, if the line is executed and none of its branches is. The line of
    an operation that never failed would be such a line. Therefore the branches of the line with the key of an operation
    move to the line of its precondition, and a line is executed at least as often as its most frequent branch.
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


def _meanings(model: BehaviorModel, places: Places) -> Iterator[_LineMeaning]:
    """Yield the meanings of lines, part by part; the first of a part is its key."""
    for operation in model.operations:
        path = ("operations", operation.name)
        aspects = {aspect: Obligation(operation.name, aspect) for aspect in STATE_ASPECTS}
        yield _LineMeaning(operation.name, places.line(path), "operation", tuple(aspects.values()))
        for role, aspect, below in _ROLES:
            for number in places.lines((*path, *below)):
                yield _LineMeaning(operation.name, number, role, (aspects[aspect],))
    for transition in model.automatic_transitions:
        path = ("automatic_transitions", transition.name)
        taken = Obligation(transition.name, Aspect.TAKEN)
        for number in (places.line(path), *places.lines(path)):
            yield _LineMeaning(str(taken), number, "automatic transition", (taken,))


def _branches(model: BehaviorModel, places: Places) -> Iterator[tuple[Obligation, int]]:
    """Yield each obligation of the figure with the line that it is a branch of."""
    for operation in model.operations:
        for aspect in STATE_ASPECTS:
            path = ("operations", operation.name, *_below(aspect, operation))
            yield Obligation(operation.name, aspect), places.line(path)
    for transition in model.automatic_transitions:
        path = ("automatic_transitions", transition.name)
        yield Obligation(transition.name, Aspect.TAKEN), places.line(path)


def _below(aspect: Aspect, operation: Operation) -> tuple[str, ...]:
    """Return the path below the key of an operation to the line that decides whether a state is visited."""
    match aspect:
        case Aspect.EXECUTING | Aspect.DISABLED:
            return ("pre", "g")
        case Aspect.COMPLETED:
            return ("post", "g")
        case Aspect.TIMEDOUT:
            return ("timedout",) if operation.deadline_ns is None else ("deadline",)
        case _:
            return ()


class _Marker:
    """Counts the cases that executed each line and each part."""

    def __init__(
        self, coverage: Coverage, meanings: Sequence[_LineMeaning], branches: Sequence[tuple[Obligation, int]]
    ) -> None:
        self._obligations = coverage.obligations
        self._visits = coverage.visits()
        self._sets = Counter(visited for _, visited in coverage.cases)  # many cases visit the same
        self._known: dict[int, int] = {}
        self._by_line: dict[int, list[_LineMeaning]] = {}
        self._by_part: dict[str, list[_LineMeaning]] = {}
        self._branches: dict[int, list[Obligation]] = {}
        for meaning in meanings:
            self._by_line.setdefault(meaning.number, []).append(meaning)
            self._by_part.setdefault(meaning.part, []).append(meaning)
        for obligation, number in branches:
            self._branches.setdefault(number, []).append(obligation)

    def line(self, number: int, text: str) -> MarkedLine:
        """Return one marked line of the file."""
        meanings = self._by_line.get(number)
        if not meanings:
            return MarkedLine(number, text)
        branches = tuple((obligation, self._visits[obligation]) for obligation in self._branches.get(number, ()))
        hits = self._cases(meanings)
        state = _state([hits, *(count for _, count in branches)])
        return MarkedLine(number, text, meanings[0].role, branches, hits, state)

    def parts(self) -> tuple[MarkedPart, ...]:
        """Return all parts of the model."""
        return tuple(
            MarkedPart(
                name,
                of_part[0].number,
                tuple(sorted({meaning.number for meaning in of_part})),
                self._cases(of_part[:1]),
            )
            for name, of_part in self._by_part.items()
        )

    def _cases(self, meanings: Sequence[_LineMeaning]) -> int:
        """Return the number of cases with a visit to any of these obligations."""
        mask = 0
        for meaning in meanings:
            for obligation in meaning.happened:
                mask |= self._obligations.bit(obligation)
        if mask not in self._known:
            self._known[mask] = sum(count for visited, count in self._sets.items() if visited & mask)
        return self._known[mask]
