"""Facts and numbers that have a value only while an action executes, and the conditions that need this value.

Operations of a model do not overlap, and all effects of an action with a duration happen at its end. So no operation
would ever find such a value.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from scbm.pddl.pddl_task import TRUE, PddlFormula

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model import Diagnostic
    from scbm.pddl.pddl_task import PddlEffect, PddlLiftedAction, PddlTask
    from scbm.pddl.pddl_text import PddlText


class _Need(NamedTuple):
    """A fluent that a condition reads.

    Attributes:
        fluent: the fluent with its arguments.
        is_high: whether the condition needs it to be true, or large; otherwise false, or small.
        scope: the types of the parameters and variables.
    """

    fluent: PddlFormula
    is_high: bool
    scope: Mapping[str, str]


def temporary_faults(
    task: PddlTask, domain: PddlText, problem: PddlText, objects_of: Mapping[str, Sequence[str]]
) -> Iterator[Diagnostic]:
    """Yield an error for each condition that needs a value that only lasts while an action executes."""

    def domain_of(term: PddlFormula, scope: Mapping[str, str]) -> set[str]:
        return {*objects_of[scope[term.name]]} if term.kind == "parameter" else {term.name}

    for action in task.actions:
        for given in _temporary_values(action):
            name = given.fluent.name
            for reader, need in _readers(task, action, given.fluent):
                pairs = zip(given.fluent.parts, need.fluent.parts, strict=False)
                is_same = (need.fluent.name, need.is_high) == (name, given.is_high)
                if not is_same or not all(domain_of(a, given.scope) & domain_of(b, need.scope) for a, b in pairs):
                    continue
                value = "true" if given.is_high else "false"
                what = f"`{name}` to be {value}, and {action.name} makes it {value}"
                if task.fluents[name].is_numeric:
                    what = f"a value of `{name}` that {action.name} gives it"
                who = "the goal" if reader is None else reader.name
                place = problem.in_section(":goal", name) if reader is None else domain.inside_action(who, name)
                remedy = f"split {action.name} into two actions: one for its start, and one for its end"
                text = problem if reader is None else domain
                yield text.error(f"{who} needs {what} only until {action.name} ends", place, remedy)


def _readers(
    task: PddlTask, action: PddlLiftedAction, fluent: PddlFormula
) -> Iterator[tuple[PddlLiftedAction | None, _Need]]:
    """Yield what conditions and goals need, with the action of each; an action may read a fact that it changes."""
    for goal in task.goals:
        yield from ((None, need) for need in _needs(goal, {}))
    for reader in task.actions:
        scope = dict(reader.parameters)
        effects = [(effect.condition, {**scope, **dict(effect.variables)}) for effect in reader.effects]
        for condition, inside in (*((each, scope) for each in reader.conditions), *effects):
            for need in _needs(condition, inside):
                if reader is not action or need.fluent != fluent:
                    yield reader, need


def _temporary_values(action: PddlLiftedAction) -> Iterator[_Need]:
    """Yield the values that an action gives at its start and takes back at its end."""
    for first in action.effects:
        scope = {**dict(action.parameters), **dict(first.variables)}
        if first.moment == 0 and any(each.moment == 1 and takes_back(first, each) for each in action.effects):
            is_number = first.value.kind not in {"and", "or"}
            for is_high in (True, False):
                gives = first.kind == "assign" if is_number else is_high == (first.value == TRUE)
                gives = gives or (is_number and first.kind == ("increase" if is_high else "decrease"))
                held = PddlFormula("not", (first.fluent,)) if not is_high else first.fluent
                if gives and held not in action.conditions:
                    yield _Need(first.fluent, is_high, scope)


def takes_back(first: PddlEffect, last: PddlEffect) -> bool:
    """Return whether the effect at the end gives a fluent another value than that at the start."""
    variables = {*dict(first.variables), *dict(last.variables)}
    if first.fluent.name != last.fluent.name or any(
        a != b and not {a.name, b.name} & variables for a, b in zip(first.fluent.parts, last.fluent.parts, strict=True)
    ):
        return False
    if first.kind == last.kind == "assign":
        return first.value != last.value
    return {first.kind, last.kind} == {"increase", "decrease"} and first.value == last.value


def _needs(formula: PddlFormula, scope: Mapping[str, str], *, holds: bool = True) -> Iterator[_Need]:
    """Yield the fluents that a condition reads, each with the value that it needs."""
    match formula.kind:
        case "fluent":
            yield _Need(formula, holds, scope)
        case "<=" | "<":
            left, right = formula.parts
            yield from _needs(left, scope, holds=not holds)
            yield from _needs(right, scope, holds=holds)
        case "equals" | "*" | "/":
            yield from (
                need
                for part in formula.parts
                for is_high in (True, False)
                for need in _needs(part, scope, holds=is_high)
            )
        case "-":
            first, *others = formula.parts
            yield from _needs(first, scope, holds=holds)
            yield from (need for part in others for need in _needs(part, scope, holds=not holds))
        case _:
            inside = {**scope, **dict(formula.variables)}
            for part in formula.parts:
                yield from _needs(part, inside, holds=holds != (formula.kind == "not"))
