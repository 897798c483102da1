"""Reads a domain and a problem of PDDL with `unified-planning` (extra `pddl`)."""

from __future__ import annotations

import re
from importlib import import_module
from typing import TYPE_CHECKING, Any

from scbm.files.pddl.exclusive import proved_invariants
from scbm.files.pddl.pddl_task import (
    FALSE,
    TRUE,
    PddlDuration,
    PddlEffect,
    PddlFluent,
    PddlFormula,
    PddlLiftedAction,
    PddlTask,
)
from scbm.model import Diagnostic, InputError, Place, Slug

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.pddl.pddl_task import EffectKind, FormulaKind
    from scbm.files.pddl.pddl_text import PddlText
    from scbm.model import Diagnostic as Error

_LINE_AND_COLUMN = re.compile(r"line:? (?P<line>\d+),? col(?:umn)?:? ?(?P<column>\d+)|line:(?P<l>\d+), col:(?P<c>\d+)")

_KINDS: dict[str, FormulaKind] = {
    "AND": "and",
    "OR": "or",
    "NOT": "not",
    "EQUALS": "equals",
    "LE": "<=",
    "LT": "<",
    "PLUS": "+",
    "MINUS": "-",
}
"""The operators of `unified-planning` that are those of a formula."""

_REFUSED = {
    ":derived": ("derived predicates", "all"),
    ":constraints": ("constraints on plans", "all"),
    ":process": ("processes", "all"),
    ":event": ("events", "all"),
    "preference": ("preferences", "last"),
    "either": ("`either`", "next"),
    "scale-up": ("products", "increase"),
    "scale-down": ("quotients", "decrease"),
}
"""Expressions that a model cannot express, by their first word, and what of each is read to find further errors."""

_BLANKS = {":metric": "all", **{word: kept for word, (_, kept) in _REFUSED.items()}}
"""Sections that are removed before the library reads the file; a metric says nothing about the length of plans."""


def read_pddl(domain: PddlText, problem: PddlText) -> PddlTask:
    """Return the problem of a domain, with what a model cannot express as its errors.

    Raise `InputError` if the files are no PDDL, or if the extra is missing.
    """
    refused = [
        text.error(f"{what} cannot be expressed in a model", place, "leave them out of the import")
        for text in (domain, problem)
        for word, (what, _) in _REFUSED.items()
        for place in text.sections(word)
    ]
    refused += [
        domain.error("changes that go on with time cannot be expressed in a model", place, "write an effect at the end")
        for place in domain.uses("#t")
    ]
    refused += [
        text.error("functions whose values are objects cannot be expressed in a model", place, "write a predicate")
        for text in (domain, problem)
        for place in text.object_functions()
    ]
    refused += [
        problem.error("facts at given times cannot be expressed in a model", place, "leave them out of the import")
        for place in problem.timed_facts()
    ]
    declared, used = domain.named("domain"), problem.named(":domain")
    if declared is not None and used is not None and declared[0] != used[0]:
        message = f"the problem is one of the domain `{used[0]}`, and the domain is called `{declared[0]}`"
        refused.append(problem.error(message, used[1], "name the files of one domain", Slug.BAD_PDDL))
    try:
        parsed = _parsed(domain, problem)
    except InputError as error:
        missing = any(each.slug == Slug.PDDL_MISSING for each in error.diagnostics)
        raise InputError(error.diagnostics if missing or not refused else refused) from None
    return _TaskReader(domain, problem, refused).task(parsed)


def _parsed(domain: PddlText, problem: PddlText) -> Any:  # noqa: ANN401 - a library that is optional, without types
    try:
        reader = import_module("unified_planning.io").PDDLReader
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "unified_planning":
            raise
        message = "unified-planning is not installed, which reads PDDL"
        remedy = "run `pip install 'scbm[pddl]'`"
        raise InputError([Diagnostic(Slug.PDDL_MISSING, message, Place("scbm import pddl"), remedy)]) from None
    first, second = domain.without(_BLANKS), problem.without(_BLANKS)
    try:
        return reader().parse_problem_string(first, second)
    except Exception as error:  # noqa: BLE001 - the library raises errors of many kinds for wrong files
        fault = error
    try:  # only for wrong files: the library reads about 100 actions in a second
        reader().parse_problem_string(first)
    except Exception as error:  # noqa: BLE001 - the same
        raise InputError([_syntax_error(domain, error)]) from None
    raise InputError([_syntax_error(problem, fault)]) from None


def _syntax_error(text: PddlText, error: Exception) -> Error:
    shown = " ".join(str(error).split()) or type(error).__name__
    match = _LINE_AND_COLUMN.search(shown)
    place = text.first("define")
    if match is not None:
        place = text.at(int(match["line"] or match["l"]), int(match["column"] or match["c"]))
        shown = shown[: match.start()].removesuffix("From ").rstrip(" (.,")
    shown = re.sub(r"\s*\(at char \d+\)?", "", shown)
    return text.error(f"this is no PDDL that can be read: {shown[:300]}", place, slug=Slug.BAD_PDDL)


class _TaskReader:
    """Turns a problem of `unified-planning` into a task, and collects what a model cannot express."""

    def __init__(self, domain: PddlText, problem: PddlText, refused: list[Error]) -> None:
        self._domain = domain
        self._problem = problem
        self._errors = dict.fromkeys(refused)
        self._action: str | None = None

    def task(self, problem: Any) -> PddlTask:  # noqa: ANN401 - of the library
        fluents = {
            fluent.name: PddlFluent(
                fluent.name,
                tuple((each.name, _type_name(each.type)) for each in fluent.signature),
                not fluent.type.is_bool_type(),
            )
            for fluent in problem.fluents
        }
        types: dict[str, str | None] = {}
        for kind in problem.user_types:
            types[kind.name] = kind.father.name if kind.father is not None else None
        actions = tuple(self._action_of(action) for action in problem.actions)
        self._action = None
        goals = tuple(self._formula(goal) for goal in problem.goals)
        initial: dict[str, dict[tuple[str, ...], int]] = {name: {} for name in fluents}
        for fact, value in problem.explicit_initial_values.items():
            objects = tuple(argument.object().name for argument in fact.args)
            number = self._constant(value, fact.fluent().name)
            initial[fact.fluent().name][objects] = number
        invariants = proved_invariants(problem)
        return PddlTask(
            problem.name or "imported",
            types,
            {each.name: _type_name(each.type) for each in problem.all_objects},
            fluents,
            actions,
            initial,
            goals,
            invariants.exclusive,
            invariants.all,
            tuple(self._errors),
        )

    def _refuse(self, message: str, *words: str, remedy: str | None = None) -> None:
        text = self._domain if self._action is not None else self._problem
        place = text.first(*words)
        if self._action is not None:
            place = text.inside_action(self._action, words[0]) if words else text.action(self._action)
        self._errors[text.error(message, place, remedy)] = None

    def _action_of(self, action: Any) -> PddlLiftedAction:  # noqa: ANN401 - of the library
        self._action = action.name
        duration = None
        if hasattr(action, "duration"):
            bounds = action.duration
            duration = PddlDuration(self._formula(bounds.lower), self._formula(bounds.upper))
            conditions, effects = self._timed_parts(action)
        else:
            conditions = tuple(self._formula(each) for each in action.preconditions)
            effects = tuple(self._effect(each, 1) for each in action.effects)
        parameters = tuple((each.name, _type_name(each.type)) for each in action.parameters)
        return PddlLiftedAction(action.name, parameters, conditions, effects, duration)

    def _timed_parts(self, action: Any) -> tuple[tuple[PddlFormula, ...], tuple[PddlEffect, ...]]:  # noqa: ANN401 - of the library
        effects = tuple(
            self._effect(each, int(not timing.is_from_start()))
            for timing, several in action.effects.items()
            for each in several
        )
        started = {(each.fluent, each.value) for each in effects if each.moment == 0 and each.condition == TRUE}
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

    def _constant(self, value: Any, fluent: str = "") -> int:  # noqa: ANN401 - of the library
        if value.is_bool_constant():
            return int(value.bool_constant_value())
        number = value.constant_value()
        if number != int(number):
            shown = f"{float(number):g}"
            of = f", the value of `{fluent}`," if fluent else ""
            message = f"{shown}{of} is no whole number, and variables have whole numbers"
            self._refuse(message, shown, *([fluent] if fluent else []), remedy="write it in smaller units")
        return int(number)

    def _formula(self, node: Any) -> PddlFormula:  # noqa: ANN401, C901, PLR0911 - of the library; a branch for each kind
        kind = node.node_type.name
        if node.is_bool_constant():
            return TRUE if node.bool_constant_value() else FALSE
        if kind in {"INT_CONSTANT", "REAL_CONSTANT"}:
            return PddlFormula("number", number=self._constant(node))
        if node.is_fluent_exp():
            return PddlFormula("fluent", tuple(map(self._formula, node.args)), node.fluent().name)
        if node.is_parameter_exp():
            return PddlFormula("parameter", name=node.parameter().name)
        if node.is_variable_exp():
            return PddlFormula("parameter", name=node.variable().name)
        if node.is_object_exp():
            return PddlFormula("object", name=node.object().name)
        if kind in {"FORALL", "EXISTS"}:
            variables = tuple((each.name, _type_name(each.type)) for each in node.variables())
            parts = tuple(map(self._formula, node.args))
            return PddlFormula("forall" if kind == "FORALL" else "exists", parts, variables=variables)
        parts = tuple(map(self._formula, node.args))
        if kind == "IMPLIES":
            return PddlFormula("or", (PddlFormula("not", parts[:1]), parts[1]))
        if kind == "IFF":
            return PddlFormula("or", (PddlFormula("and", parts), PddlFormula("and", tuple(map(negated, parts)))))
        if kind not in _KINDS:
            message = f"`{node}` cannot be expressed in a model"
            self._refuse(message, {"TIMES": "*", "DIV": "/"}.get(kind, kind.lower()))
            return TRUE
        return PddlFormula(_KINDS[kind], parts)


def _type_name(kind: Any) -> str:  # noqa: ANN401 - of the library
    return str(kind.name)


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
