"""Which changes of a run are edges of the automata of its model, named by what made them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import takewhile

from scbm.cases.coverage import Aspect
from scbm.cases.trace import (
    AutomaticTaken,
    InjectionApplied,
    MeasurementReceived,
    OperationStepped,
    PutBack,
    Record,
    ReplyReceived,
    state_after,
)
from scbm.drawing.automata import ANY_OTHER, Automaton, ModelAutomata
from scbm.drawing.model_changes import ChangeMaker, MakerKind
from scbm.model import Value
from scbm.testing import Execution

OUTSIDE = (MakerKind.ENVIRONMENT, MakerKind.INPUT, MakerKind.PUBLISHED)


def changes_without_edge(drawn: ModelAutomata, execution: Execution) -> list[str]:
    """Return the changes of drawn variables up to the first forced state that are no edge of what made them."""
    return [words for words, is_edge in changes_of(drawn, execution) if not is_edge]


def changes_of(drawn: ModelAutomata, execution: Execution) -> Iterator[tuple[str, bool]]:
    """Yield each change of a declared variable that requests do more than carry, and whether it is an edge."""
    automata = {automaton.variable.name: automaton for automaton in drawn.drawn}
    names = [v.name for v in drawn.model.variables if v.name not in drawn.carried]
    records = list(takewhile(lambda each: not getattr(each, "forced", False), execution.trace.records))
    records = records[: execution.forced_by]
    values = state_after(records[:1])
    for record in records:
        for name, after in record.changes:
            if name in names and values[name] != after:
                makers = makers_of(automata[name], values[name], after) if name in automata else []
                yield f"{name}: {values[name]} -> {after}, {record}", any(made(each, record) for each in makers)
        values.update(record.changes)


def makers_of(automaton: Automaton, before: Value, after: Value) -> list[ChangeMaker]:
    """Return who can change one value of a variable into another one."""
    group_of = {value: number for number, group in enumerate(automaton.groups) for value in group.values}
    sources = (ANY_OTHER, group_of[before])
    return [each.maker for each in automaton.edges if each.source in sources and each.target == group_of[after]]


def made(maker: ChangeMaker, record: Record) -> bool:
    """Return whether a maker can have made the changes of a record."""
    match record:
        case OperationStepped(operation=name, target=target):
            return (maker.name, maker.aspect) == (name, Aspect(target.value))
        case AutomaticTaken(transition=name):
            return (maker.name, maker.aspect) == (name, Aspect.TAKEN)
        case ReplyReceived(resource=name):
            return (maker.kind, maker.name) == (MakerKind.REPLY, name)
        case MeasurementReceived(by=name) if name:
            return (maker.kind, maker.name) == (MakerKind.ENVIRONMENT, name)
        case MeasurementReceived() | InjectionApplied() | PutBack():
            return maker.kind in OUTSIDE
    return False
