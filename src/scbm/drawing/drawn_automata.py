"""Automata as pictures show them: equal objects once, and edges that go the same way as one arrow."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct
from msgspec.structs import astuple

from scbm.cases.coverage import InstanceFolds
from scbm.drawing.model_changes import MakerKind

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.cases.coverage import Obligation
    from scbm.drawing.automata import Automaton, ModelAutomata
    from scbm.drawing.edge_statuses import EdgeStatuses
    from scbm.drawing.model_changes import ChangeMaker
    from scbm.drawing.value_groups import ValueGroup


class ArrowStyle(Enum):
    """The kinds of arrows that pictures distinguish, each with its words in the legend."""

    OPERATION = "operation"
    AUTOMATIC = "automatic transition"
    OUTSIDE = "environment, replies, published values, inputs"


_STYLES = {
    MakerKind.START: ArrowStyle.OPERATION,
    MakerKind.END: ArrowStyle.OPERATION,
    MakerKind.AUTOMATIC: ArrowStyle.AUTOMATIC,
}
_WORDS = {MakerKind.REPLY: " (reply)", MakerKind.PUBLISHED: " (published)", MakerKind.INPUT: " (input)"}


class MakerLine(Struct, frozen=True):
    """A line of the label of an arrow: one maker, or the instances of one entry.

    Attributes:
        text: the name, and how many of several obligations are covered, such as `move (5) 3 of 5`.
        makers: the makers.
        paint: the name of the paint of their status; empty without a status.
    """

    text: str
    makers: tuple[ChangeMaker, ...]
    paint: str

    @property
    def obligations(self) -> tuple[Obligation, ...]:
        """The obligations that runs visit with the arrow."""
        return tuple(each.obligation for each in self.makers if each.obligation is not None)


class ArrowWay(NamedTuple):
    """What edges share that are one arrow.

    Attributes:
        source: the number of the node, or `ANY_OTHER`.
        target: the number of the node; the source itself for a change within a group of values.
        style: the kind of its makers.
        is_meanwhile: whether it is thin: the value before is there only after a change during the operation.
        is_bound: whether it is marked with `≤`.
    """

    source: int
    target: int
    style: ArrowStyle
    is_meanwhile: bool
    is_bound: bool


class DrawnArrow(Struct, frozen=True):
    """Edges with one way and one status.

    Attributes:
        way: where it goes, and its style.
        paint: the name of the paint of its status; empty without a status.
        lines: the makers.
    """

    way: ArrowWay
    paint: str
    lines: tuple[MakerLine, ...]


class DrawnNode(Struct, frozen=True):
    """A value, or a group of values.

    Attributes:
        label: the value.
        is_nominal: whether it is or has the nominal value.
        is_allowed: whether runs may begin with it or with one of its values.
        is_present: whether it is or has the value at a moment that is shown.
    """

    label: str
    is_nominal: bool
    is_allowed: bool
    is_present: bool = False


class DrawnAutomaton(Struct, frozen=True):
    """The automaton of a variable, or of equal variables of several objects.

    Attributes:
        title: the variable.
        variables: the names of all its variables.
        nodes: its values.
        arrows: the changes.
    """

    title: str
    variables: tuple[str, ...]
    nodes: tuple[DrawnNode, ...]
    arrows: tuple[DrawnArrow, ...]


def drawn_automata(
    automata: ModelAutomata, chosen: Iterable[Automaton], statuses: EdgeStatuses
) -> tuple[DrawnAutomaton, ...]:
    """Return automata as pictures show them, in order; those of equal objects are one, at the place of the first."""
    names = _EntryNames(automata)
    alike: dict[object, list[Automaton]] = {}
    for each in chosen:
        alike.setdefault(names.shape(each), []).append(each)
    return tuple(_drawn(group, names, statuses) for group in alike.values())


class _EntryNames:
    """The names of makers and variables without the objects that equal automata differ in."""

    def __init__(self, automata: ModelAutomata) -> None:
        self.folds = InstanceFolds.of(automata.model)

    def shape(self, automaton: Automaton) -> object:
        """Return a key that equal automata of several objects share."""
        name = automaton.variable.name
        if name not in self.folds.indexed:
            return name
        edges = {(self.entry(e.maker, name), str(e.maker.kind), *astuple(e)[1:]): None for e in automaton.edges}
        groups = tuple(self.value(group, name) for group in automaton.groups)
        return self.folds.indexed[name], groups, tuple(sorted(edges))

    def entry(self, maker: ChangeMaker, name: str) -> str:
        """Return the name of the entry of a maker, or its name without the objects of the variable `name`."""
        lifted = None if maker.obligation is None else self.folds.entry_of(maker.obligation)
        if lifted is None:
            lifted = self.folds.indexed.get(maker.name) or self.inside(maker.name, name)
        return f"{lifted}{maker.suffix}{_WORDS.get(maker.kind, '')}"

    def value(self, group: ValueGroup, name: str) -> str:
        """Return the label of a group of values; a star stands for an object of the variable, but not for a number."""
        return self.inside(str(group), name) if isinstance(group.values[0], str) else str(group)

    def inside(self, text: str, name: str) -> str:
        """Return a text with a star for each object of a variable."""
        own = name.split(".")[1:] if name in self.folds.indexed else []
        return ".".join("*" if part in own else part for part in text.split("."))


def _drawn(group: Sequence[Automaton], names: _EntryNames, statuses: EdgeStatuses) -> DrawnAutomaton:
    first = group[0]
    title = names.folds.indexed[first.variable.name] if len(group) > 1 else first.variable.name
    variables = tuple(each.variable.name for each in group)
    nodes = tuple(
        DrawnNode(
            names.value(values, first.variable.name) if len(group) > 1 else str(values),
            any(each.variable.initial in each.groups[number].values for each in group),
            any(each.groups[number].is_allowed for each in group),
        )
        for number, values in enumerate(first.groups)
    )
    return DrawnAutomaton(title, variables, nodes, tuple(_arrows(group, names, statuses)))


def _arrows(group: Sequence[Automaton], names: _EntryNames, statuses: EdgeStatuses) -> Iterator[DrawnArrow]:
    """Yield the arrows of equal automata: first edges of one entry become a line, then lines become an arrow."""
    by_entry: dict[tuple[ArrowWay, str], dict[ChangeMaker, None]] = {}
    for automaton in group:
        for e in automaton.edges:
            style = _STYLES.get(e.maker.kind, ArrowStyle.OUTSIDE)
            way = ArrowWay(e.source, e.target, style, e.is_meanwhile, e.is_bound)
            by_entry.setdefault((way, names.entry(e.maker, automaton.variable.name)), {})[e.maker] = None
    lines: dict[tuple[ArrowWay, str], list[MakerLine]] = {}
    for (way, entry), makers in by_entry.items():
        line = _line(way, entry, tuple(makers), statuses)
        lines.setdefault((way, line.paint), []).append(line)
    for (way, paint), found in lines.items():
        yield DrawnArrow(way, paint, tuple(found))


def _line(way: ArrowWay, entry: str, makers: tuple[ChangeMaker, ...], statuses: EdgeStatuses) -> MakerLine:
    name = f"{makers[0]}{_WORDS.get(makers[0].kind, '')}" if len(makers) == 1 else f"{entry} ({len(makers)})"
    obligations = [maker.obligation for maker in makers if maker.obligation is not None]
    begin = f"{'↻ ' if way.source == way.target else ''}{'≤ ' if way.is_bound else ''}"
    return MakerLine(f"{begin}{name}{statuses.share(obligations)}", makers, statuses.paint(obligations))
