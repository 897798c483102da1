"""The automata that a picture shows: all, or those of named variables, operations, transitions and resources."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.cases.coverage import InstanceFolds
from scbm.drawing.automata import ANY_OTHER
from scbm.drawing.model_changes import ChangeMaker, MakerKind
from scbm.files import suggestion
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.model.variables import request_state_name, trigger_name

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from scbm.drawing.automata import Automaton, ModelAutomata
    from scbm.model import BehaviorModel


def named_automata(automata: ModelAutomata, names: Sequence[str]) -> tuple[Automaton, ...]:
    """Return the automata of named parts, in the order of the model; without names those of a whole picture.

    A variable stands for its whole automaton; any other part for the edges that it makes and the values that these
    touch, a resource also for those of the operations that send it requests.

    Raises:
        InputError: with an error for each name that the model does not have.
    """
    if not names:
        return automata.drawn
    variables = _instances(automata.model, (variable.name for variable in automata.model.variables))
    makers = _makers(automata.model)
    _refuse_unknown(names, automata.model, {**variables, **makers})
    whole = dict.fromkeys(each for name in names for each in variables.get(name, ()))
    making = dict.fromkeys(each for name in names for each in makers.get(name, ()))
    found = []
    for each in automata.automata:
        part = _with_edges(each, lambda maker: (maker.kind in _OUTSIDE, maker.name) in making)
        if each.variable.name in whole:
            found.append(each)
        elif part.edges and each.variable.name not in automata.carried:
            found.append(part)
    return tuple(found)


def automata_of_operation(automata: ModelAutomata, operation: str) -> tuple[Automaton, ...]:
    """Return what an operation changes: the automata of drawn variables with its edges alone."""
    own = (MakerKind.START, MakerKind.END)
    parts = (_with_edges(each, lambda maker: maker.kind in own and maker.name == operation) for each in automata.drawn)
    return tuple(part for part in parts if part.edges)


_OUTSIDE = (MakerKind.REPLY, MakerKind.PUBLISHED, MakerKind.INPUT)
"""Makers that have the names of resources and of variables; all others share the names of operations."""


def _with_edges(automaton: Automaton, is_chosen: Callable[[ChangeMaker], bool]) -> Automaton:
    """Return an automaton with the edges of some makers, and with the values that these touch."""
    edges = [edge for edge in automaton.edges if is_chosen(edge.maker)]
    touched = [n for n in range(len(automaton.groups)) if any(n in (edge.source, edge.target) for edge in edges)]
    places = {ANY_OTHER: ANY_OTHER, **{number: place for place, number in enumerate(touched)}}
    moved = tuple(replace(edge, source=places[edge.source], target=places[edge.target]) for edge in edges)
    return replace(automaton, groups=tuple(automaton.groups[number] for number in touched), edges=moved)


def _instances(model: BehaviorModel, names: Iterable[str]) -> dict[str, list[str]]:
    """Return the names that each name stands for, and each entry with parameters, such as `at` and `at[robot]`."""
    indexed = InstanceFolds.of(model).indexed
    found: dict[str, list[str]] = {}
    for name in names:
        entry = indexed.get(name, name)
        for each in dict.fromkeys((name, entry, entry.partition("[")[0])):
            found.setdefault(each, []).append(name)
    return found


def _makers(model: BehaviorModel) -> dict[str, list[tuple[bool, str]]]:
    """Return the makers that each name stands for: whether they are resources or inputs, and their names."""
    found: dict[str, list[tuple[bool, str]]] = {}
    for section in ("operations", "automatic_transitions", "environment"):
        for name in (each.name for each in getattr(model, section)):
            for entry in dict.fromkeys((name, model.lifted_name(section, name))):
                found.setdefault(entry, []).append((False, name))
    for entry, resources in _instances(model, (resource.name for resource in model.resources)).items():
        triggers = [trigger_name(name) for name in resources]
        sending = (o.name for o in model.operations if any(a.target in triggers for a in o.pre.running_actions))
        found.setdefault(entry, []).extend((True, name) for name in resources)
        found[entry].extend((False, name) for name in sending)
    return found


def _refuse_unknown(names: Sequence[str], model: BehaviorModel, known: Iterable[str]) -> None:
    """Raise `InputError` with an error for each unknown name."""
    listed = list(known)
    owners = {make(each.name): each.name for each in model.resources for make in (trigger_name, request_state_name)}
    wrong = []
    for name in names:
        if name in owners:
            message = f"`{name}` belongs to the requests of {owners[name]}, and has no picture"
            wrong.append(_unknown(name, message, f"draw the resource: `{owners[name]}`"))
        elif name not in listed:
            message = f"the model has no variable, operation, transition or resource `{name}`"
            wrong.append(_unknown(name, message, suggestion(name, listed, "the model has")))
    if wrong:
        raise InputError(wrong)


def _unknown(name: str, message: str, remedy: str | None) -> Diagnostic:
    return Diagnostic(Slug.UNKNOWN_NAME, message, Place("NAME", 1, 1, max(1, len(name))), remedy, name)
