"""Reads a domain and a problem of PDDL with `unified-planning` (extra `pddl`)."""

from __future__ import annotations

from fractions import Fraction
from importlib import import_module
from typing import TYPE_CHECKING, Any

from msgspec.structs import replace

from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.pddl.checks.declared_names import ANY_OBJECT
from scbm.pddl.checks.pddl_check import checked_pddl
from scbm.pddl.constant_terms import folded
from scbm.pddl.exclusive import proved_invariants
from scbm.pddl.pddl_task import (
    FALSE,
    TRUE,
    PddlDuration,
    PddlEffect,
    PddlFluent,
    PddlFormula,
    PddlLiftedAction,
    PddlTask,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.pddl.checks.pddl_check import CheckedPddl
    from scbm.pddl.pddl_task import EffectKind, FormulaKind
    from scbm.pddl.pddl_text import PddlText

_KINDS: dict[str, FormulaKind] = {
    "AND": "and",
    "OR": "or",
    "NOT": "not",
    "EQUALS": "equals",
    "LE": "<=",
    "LT": "<",
    "PLUS": "+",
    "MINUS": "-",
    "TIMES": "*",
    "DIV": "/",
}
"""The operators of `unified-planning` that are those of a formula."""


def read_pddl(domain: PddlText, problem: PddlText) -> PddlTask:
    """Return the problem of a domain, with what a model cannot express as its errors.

    Raise `InputError` if the files are no PDDL, or if the extra is missing.
    """
    reader = _library_reader()
    checked = checked_pddl(domain, problem)
    return _TaskReader(checked).task(_parsed(reader, checked, domain, problem))


def _library_reader() -> Any:  # noqa: ANN401 - a library that is optional, without types
    try:
        return import_module("unified_planning.io").PDDLReader
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "unified_planning":
            raise
        message = "unified-planning is not installed, which reads PDDL"
        remedy = "run `pip install 'scbm[pddl]'`"
        raise InputError([Diagnostic(Slug.PDDL_MISSING, message, Place("scbm import pddl"), remedy)]) from None


def _parsed(reader: Any, checked: CheckedPddl, domain: PddlText, problem: PddlText) -> Any:  # noqa: ANN401 - of the library
    def read(actions: Sequence[str], *, init: bool, goal: bool) -> Any:  # noqa: ANN401 - of the library
        try:
            return reader().parse_problem_string(
                checked.domain_text(actions), checked.problem_text(init=init, goal=goal)
            )
        except Exception:  # noqa: BLE001 - the library raises errors of many kinds for texts that it does not read
            return None

    texts = [text for _, text in checked.actions]
    parsed = read(texts, init=True, goal=True)
    if parsed is not None:
        return parsed
    places = [domain.action(name) for name, text in checked.actions if read([text], init=False, goal=False) is None]
    if not places and read(texts, init=False, goal=True) is None:
        places = [problem.first(":goal")]
    if not places and read(texts, init=True, goal=False) is None:
        places = [problem.first(":init")]
    message = "unified-planning, which reads PDDL for the import, does not read this part"
    remedy = "write it with simpler expressions"
    found = [(problem if p.file == problem.file else domain, p) for p in places or [domain.first("define")]]
    raise InputError([text.error(message, place, remedy, Slug.BAD_PDDL) for text, place in found])


def _plain(name: str) -> str:
    """Return a name without the prefix that it has for the library."""
    return name if name == ANY_OBJECT else name[2:]


class _TaskReader:
    """Turns a problem of `unified-planning` into a task."""

    def __init__(self, checked: CheckedPddl) -> None:
        self._checked = checked

    def task(self, problem: Any) -> PddlTask:  # noqa: ANN401 - of the library
        fluents = {
            _plain(fluent.name): PddlFluent(
                _plain(fluent.name),
                self._checked.fluents[_plain(fluent.name)],
                not fluent.type.is_bool_type(),
            )
            for fluent in problem.fluents
        }
        types: dict[str, str | None] = {}
        for kind in problem.user_types:
            types[_plain(kind.name)] = _plain(kind.father.name) if kind.father is not None else None
        actions = tuple(self._action_of(action) for action in problem.actions)
        goals = tuple(self._formula(goal) for goal in problem.goals)
        initial: dict[str, dict[tuple[str, ...], int | Fraction]] = {name: {} for name in fluents}
        for fact, value in problem.explicit_initial_values.items():
            objects = tuple(_plain(argument.object().name) for argument in fact.args)
            name = _plain(fact.fluent().name)
            initial[name][objects] = self._constant(value)
        task = PddlTask(
            self._checked.name,
            types,
            {_plain(each.name): _type_name(each.type) for each in problem.all_objects},
            fluents,
            actions,
            initial,
            goals,
            errors=self._checked.errors,
            more_parents=self._checked.more_parents,
        )
        below = {
            kind.name: frozenset(f"o-{n}" for n in task.objects_of(_type_name(kind))) for kind in problem.user_types
        }
        invariants = proved_invariants(problem, below)
        plain = [tuple(part._replace(fluent=_plain(part.fluent)) for part in each) for each in invariants.all]
        exclusive = {_plain(name): index for name, index in invariants.exclusive.items()}
        return replace(task, exclusive=exclusive, invariants=tuple(plain))

    def _action_of(self, action: Any) -> PddlLiftedAction:  # noqa: ANN401 - of the library
        duration = None
        if hasattr(action, "duration"):
            bounds = action.duration
            duration = PddlDuration(self._formula(bounds.lower), self._formula(bounds.upper))
            conditions, effects = self._timed_parts(action)
        else:
            conditions = tuple(self._formula(each) for each in action.preconditions)
            effects = tuple(self._effect(each, 1) for each in action.effects)
        parameters = tuple((each.name, _type_name(each.type)) for each in action.parameters)
        return PddlLiftedAction(_plain(action.name), parameters, conditions, effects, duration)

    def _timed_parts(self, action: Any) -> tuple[tuple[PddlFormula, ...], tuple[PddlEffect, ...]]:  # noqa: ANN401 - of the library
        effects = tuple(
            self._effect(each, int(not timing.is_from_start()))
            for timing, several in action.effects.items()
            for each in several
        )
        started = {(each.fluent, each.value) for each in effects if _is_certain_at_start(each)}
        conditions = []
        for interval, several in action.conditions.items():
            at_start = interval.lower.is_from_start() and interval.upper.is_from_start()
            for each in several:
                formulas = conjuncts(self._formula(each))
                conditions += [f for f in formulas if at_start or _asserted(f) not in started]
        return tuple(dict.fromkeys(conditions)), effects

    def _effect(self, effect: Any, moment: int) -> PddlEffect:  # noqa: ANN401 - of the library
        kinds: dict[str, EffectKind] = {"ASSIGN": "assign", "INCREASE": "increase", "DECREASE": "decrease"}
        variables = tuple((each.name, _type_name(each.type)) for each in effect.forall)
        return PddlEffect(
            self._formula(effect.fluent),
            self._formula(effect.value),
            kinds[effect.kind.name],
            self._formula(effect.condition),
            variables,
            moment,
        )

    @staticmethod
    def _constant(value: Any) -> int | Fraction:  # noqa: ANN401 - of the library
        if value.is_bool_constant():
            return int(value.bool_constant_value())
        number = Fraction(value.constant_value())
        return int(number) if number.denominator == 1 else number

    def _formula(self, node: Any) -> PddlFormula:  # noqa: ANN401, PLR0911 - of the library; a branch for each kind
        kind = node.node_type.name
        if node.is_bool_constant():
            return TRUE if node.bool_constant_value() else FALSE
        if kind in {"INT_CONSTANT", "REAL_CONSTANT"}:
            return PddlFormula("number", number=self._constant(node))
        if node.is_fluent_exp():
            return PddlFormula("fluent", tuple(map(self._formula, node.args)), _plain(node.fluent().name))
        if node.is_parameter_exp():
            return PddlFormula("parameter", name=node.parameter().name)
        if node.is_variable_exp():
            return PddlFormula("parameter", name=node.variable().name)
        if node.is_object_exp():
            return PddlFormula("object", name=_plain(node.object().name))
        if kind in {"FORALL", "EXISTS"}:
            variables = tuple((each.name, _type_name(each.type)) for each in node.variables())
            parts = tuple(map(self._formula, node.args))
            return PddlFormula("forall" if kind == "FORALL" else "exists", parts, variables=variables)
        parts = tuple(map(self._formula, node.args))
        if kind == "IMPLIES":
            return PddlFormula("or", (PddlFormula("not", parts[:1]), parts[1]))
        if kind == "IFF":
            return PddlFormula("or", (PddlFormula("and", parts), PddlFormula("and", tuple(map(negated, parts)))))
        return folded(PddlFormula(_KINDS[kind], parts))


def _type_name(kind: Any) -> str:  # noqa: ANN401 - of the library
    return _plain(str(kind.name))


def _is_certain_at_start(effect: PddlEffect) -> bool:
    return effect.moment == 0 and effect.condition == TRUE and not effect.variables


def _asserted(formula: PddlFormula) -> tuple[PddlFormula, PddlFormula] | None:
    if formula.kind == "not":
        return formula.parts[0], FALSE
    return formula, TRUE


def conjuncts(formula: PddlFormula) -> list[PddlFormula]:
    """Return the conjuncts of a condition, none of them a conjunction."""
    if formula.kind != "and":
        return [formula]
    return [each for part in formula.parts for each in conjuncts(part)]


def negated(formula: PddlFormula) -> PddlFormula:
    """Return the negation of a condition."""
    return formula.parts[0] if formula.kind == "not" else PddlFormula("not", (formula,))


def inner_formulas(formula: PddlFormula) -> Iterator[PddlFormula]:
    """Yield a formula and all formulas in it."""
    yield formula
    for part in formula.parts:
        yield from inner_formulas(part)
