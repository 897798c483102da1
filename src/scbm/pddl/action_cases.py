"""Divides an action into cases that set each variable once: without conditions of effects, and without aliases.

Effects with conditions become one case for each choice of the conditions that hold. Where two parameters that stand for
one object would make an action set one variable twice, there is one case for different objects and one for the same.
"""

from __future__ import annotations

from itertools import combinations, product
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.pddl.constant_terms import folded
from scbm.pddl.parameter_join import substituted
from scbm.pddl.pddl_reader import conjuncts, negated
from scbm.pddl.pddl_task import FALSE, TRUE, PddlFormula

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from scbm.pddl.parameter_join import ParameterJoin
    from scbm.pddl.pddl_task import EffectKind, FormulaKind, PddlEffect, PddlLiftedAction

MAX_ACTION_CASES = 32
"""An action is divided into so many operations at most: more would be no model that people read."""


ZERO = PddlFormula("number", number=0)


class VariableChange(Struct, frozen=True):
    """The variable that a case sets, with its index.

    Attributes:
        fluent: the fluent of the variable.
        key: the index.
        value: the value; `None` for the value of a group in which no fact holds.
        rank: of two changes of one variable the one with the higher rank happens last.
    """

    fluent: str
    key: tuple[PddlFormula, ...]
    value: PddlFormula | None
    kind: EffectKind
    rank: int


class ActionCase(Struct, frozen=True):
    """One operation: its parameters, its condition, and what it changes."""

    parameters: tuple[tuple[str, str], ...]
    conditions: tuple[PddlFormula, ...]
    changes: tuple[VariableChange, ...]
    binding: Mapping[str, PddlFormula]


class TooManyCasesError(Exception):
    """An action has more cases than a model can have operations for it.

    Attributes:
        have_conditions: whether effects have conditions, so that each choice of these is a case.
    """

    def __init__(self, *, have_conditions: bool) -> None:
        super().__init__(have_conditions)
        self.have_conditions = have_conditions


class ValueClashError(Exception):
    """An action gives a variable two values at once."""

    def __init__(self, fluent: str) -> None:
        super().__init__(fluent)
        self.fluent = fluent


def cases_of(
    action: PddlLiftedAction,
    objects_of: Callable[[str], tuple[str, ...]],
    change_of: Callable[[PddlEffect], VariableChange],
    simplified: Callable[[PddlFormula], PddlFormula],
    join: ParameterJoin,
) -> list[ActionCase]:
    """Return the cases of an action.

    Args:
        action: the action.
        objects_of: the objects of a type.
        change_of: the change that an effect without condition is.
        simplified: a formula with its static facts decided.
        join: decides whether conditions hold for some objects.
    """
    rules = _CaseRules({name: objects_of(kind) for name, kind in action.parameters}, simplified, join)
    effects = [each for effect in action.effects for each in _instances(effect, objects_of)]
    effects = [replace(each, condition=simplified(each.condition)) for each in effects]
    effects = [each for each in effects if each.condition != FALSE]
    conditions = list(dict.fromkeys(each.condition for each in effects if each.condition != TRUE))
    if 2 ** len(conditions) > MAX_ACTION_CASES:
        raise TooManyCasesError(have_conditions=bool(conditions))
    cases: list[ActionCase] = []
    for chosen in product((True, False), repeat=len(conditions)):
        holding = [c for c, holds in zip(conditions, chosen, strict=True) if holds]
        denied = [negated(c) for c, holds in zip(conditions, chosen, strict=True) if not holds]
        changes = [change_of(each) for each in effects if each.condition == TRUE or each.condition in holding]
        guard = [part for each in (*action.conditions, *holding, *denied) for part in conjuncts(each)]
        case = ActionCase(action.parameters, tuple(guard), tuple(changes), {})
        for each in _without_aliases(case, rules):
            cases.append(_without_contradictions(each, rules))
            if len(cases) > MAX_ACTION_CASES:
                raise TooManyCasesError(have_conditions=bool(conditions))
    return [case for case in cases if rules.admits(case)] or cases[:1]


def _instances(effect: PddlEffect, objects_of: Callable[[str], tuple[str, ...]]) -> Iterator[PddlEffect]:
    """Yield an effect once for each choice of the objects that it is for."""
    names = [name for name, _ in effect.variables]
    for choice in product(*(objects_of(kind) for _, kind in effect.variables)):
        binding = {name: PddlFormula("object", name=each) for name, each in zip(names, choice, strict=True)}
        yield replace(
            effect,
            fluent=substituted(effect.fluent, binding),
            value=substituted(effect.value, binding),
            condition=substituted(effect.condition, binding),
            variables=(),
        )


_Equality = tuple[PddlFormula, PddlFormula]


class _CaseRules(Struct, frozen=True):
    """The facts on which the cases of one action depend.

    Attributes:
        domains: the objects of each parameter.
        simplified: returns a formula with its static facts decided.
        join: decides whether conditions hold for some objects.
    """

    domains: Mapping[str, tuple[str, ...]]
    simplified: Callable[[PddlFormula], PddlFormula]
    join: ParameterJoin

    def conjuncts(self, conditions: Iterable[PddlFormula]) -> tuple[PddlFormula, ...]:
        """Return the conjuncts of conditions, simplified, each once."""
        return tuple(dict.fromkeys(part for each in conditions for part in conjuncts(self.simplified(each))))

    def admits(self, case: ActionCase, *, facts: bool = True) -> bool:
        """Return whether the condition of a case holds for some objects; without `facts`, as far as tables decide."""
        objects = {name: self.domains[name] for name, _ in case.parameters}
        return self.join.admits(objects, self.conjuncts(case.conditions), facts=facts)


def _without_aliases(
    case: ActionCase, rules: _CaseRules, apart: tuple[frozenset[_Equality], ...] = ()
) -> Iterator[ActionCase]:
    """Yield cases whose changes are of different variables.

    A case for equal objects is left out if no objects satisfy its condition. So is one that would give a number two
    values: PDDL has no such action.
    """
    conditions = rules.conjuncts(case.conditions)
    if FALSE in conditions or any(negated(each) in conditions for each in conditions):
        return
    if case.binding and not rules.admits(case):
        return
    try:
        changes = _merged(case.changes)
    except ValueClashError:
        if case.binding:
            return
        raise
    case = replace(case, conditions=conditions, changes=tuple(changes))
    for equalities in _clashes(changes, rules.domains):
        if any(known <= equalities for known in apart):
            continue
        if any(negated(PddlFormula("equals", pair)) in conditions for pair in _both_ways(equalities)):
            continue
        different = tuple(PddlFormula("equals", pair) for pair in sorted(equalities, key=repr))
        unequal = negated(PddlFormula("and", different) if len(different) > 1 else different[0])
        other = replace(case, conditions=(*conditions, unequal))
        yield from _without_aliases(other, rules, (*apart, equalities))
        yield from _without_aliases(_joined_case(case, equalities, rules.domains), rules, apart)
        return
    yield case


def _without_contradictions(case: ActionCase, rules: _CaseRules) -> ActionCase:
    """Return a case whose parameters differ where equal ones satisfy its tables, and never its other conditions."""
    for pair in combinations(case.parameters, 2):
        first, second = (PddlFormula("parameter", name=name) for name, _ in pair)
        equalities = [PddlFormula("equals", both) for both in ((first, second), (second, first))]
        if not _can_be_equal(first, second, rules.domains) or any(negated(e) in case.conditions for e in equalities):
            continue
        joined = _joined_case(case, frozenset({(first, second)}), rules.domains)
        if not rules.admits(joined) and rules.admits(joined, facts=False):
            case = replace(case, conditions=(*case.conditions, negated(equalities[0])))
    return case


def _both_ways(equalities: frozenset[_Equality]) -> Iterator[_Equality]:
    if len(equalities) == 1:
        for left, right in equalities:
            yield left, right
            yield right, left


def _merged(changes: Sequence[VariableChange]) -> list[VariableChange]:
    """Return one change of each variable: the last value, and the sum of what is added; nothing for a sum of 0."""
    made: dict[tuple[str, tuple[PddlFormula, ...]], VariableChange] = {}
    for change in sorted(changes, key=lambda each: each.rank):
        variable = change.fluent, change.key
        known = made.get(variable)
        if known is not None and change.kind != "assign":
            made[variable] = _sum(known, change)
            continue
        if known is not None and known.rank == change.rank and known != change:
            raise ValueClashError(change.fluent)
        made[variable] = change
    order = dict.fromkeys((change.fluent, change.key) for change in changes)
    return [made[variable] for variable in order if made[variable].kind == "assign" or made[variable].value != ZERO]


def _sum(first: VariableChange, last: VariableChange) -> VariableChange:
    """Return two changes of a number as one: the last one adds to it or subtracts from it."""
    if first.kind == "assign" and first.rank == last.rank:
        raise ValueClashError(first.fluent)
    assert first.value is not None  # noqa: S101 - numbers have values
    assert last.value is not None  # noqa: S101 - as above
    if first.kind in {last.kind, "assign"}:
        sign: FormulaKind = "-" if last.kind == "decrease" and first.kind == "assign" else "+"
        return replace(first, value=folded(PddlFormula(sign, (first.value, last.value))), rank=last.rank)
    value = ZERO if first.value == last.value else folded(PddlFormula("-", (first.value, last.value)))
    return replace(first, value=value, rank=last.rank)


def _clashes(
    changes: Sequence[VariableChange], domains: Mapping[str, tuple[str, ...]]
) -> Iterator[frozenset[_Equality]]:
    """Yield what has to be equal for two changes to be of one variable."""
    for number, first in enumerate(changes):
        for second in changes[:number]:
            if first.fluent == second.fluent:
                pairs = [_in_order(a, b, domains) for a, b in zip(second.key, first.key, strict=True) if a != b]
                if pairs and all(_can_be_equal(a, b, domains) for a, b in pairs):
                    yield frozenset(pairs)


def _in_order(first: PddlFormula, second: PddlFormula, domains: Mapping[str, tuple[str, ...]]) -> _Equality:
    """Return two terms in the order of the parameters, objects last."""
    names = list(domains)
    known = [names.index(term.name) if term.kind == "parameter" else len(names) for term in (first, second)]
    return (first, second) if known[0] <= known[1] else (second, first)


def _can_be_equal(first: PddlFormula, second: PddlFormula, domains: Mapping[str, tuple[str, ...]]) -> bool:
    left, right = ([t.name] if t.kind == "object" else domains[t.name] for t in (first, second))
    return any(each in right for each in left)


def _joined_case(
    case: ActionCase, equalities: frozenset[_Equality], domains: Mapping[str, tuple[str, ...]]
) -> ActionCase:
    """Return a case with terms that are equal written as one."""
    for pair in sorted(equalities, key=repr):
        first, second = (substituted(each, case.binding) for each in pair)
        if first == second:
            continue
        kept, gone = (first, second) if second.kind == "parameter" else (second, first)
        if gone.kind != "parameter":
            return replace(case, conditions=(FALSE,))
        names = [name for name, _ in case.parameters]
        both_parameters = kept.kind == "parameter"
        if both_parameters and names.index(gone.name) < names.index(kept.name):
            kept, gone = gone, kept
        if both_parameters and len(domains[gone.name]) < len(domains[kept.name]):
            case = _with_type(case, kept.name, dict(case.parameters)[gone.name])
        case = _with_binding(case, {gone.name: kept})
    return case


def _with_type(case: ActionCase, parameter: str, kind: str) -> ActionCase:
    return replace(case, parameters=tuple((n, kind if n == parameter else k) for n, k in case.parameters))


def _with_binding(case: ActionCase, binding: Mapping[str, PddlFormula]) -> ActionCase:
    return ActionCase(
        tuple(each for each in case.parameters if each[0] not in binding),
        tuple(substituted(each, binding) for each in case.conditions),
        tuple(
            replace(
                each,
                key=tuple(substituted(term, binding) for term in each.key),
                value=None if each.value is None else substituted(each.value, binding),
            )
            for each in case.changes
        ),
        {name: substituted(term, binding) for name, term in case.binding.items()} | dict(binding),
    )
