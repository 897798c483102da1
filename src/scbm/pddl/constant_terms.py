"""The values of terms over functions that no action changes, and numbers that a model has no form for."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

from scbm.pddl.pddl_task import PddlFormula

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from scbm.model import Diagnostic
    from scbm.pddl.pddl_task import PddlLiftedAction, PddlNumber, PddlTask
    from scbm.pddl.pddl_text import PddlText

_ARITHMETIC = ("+", "-", "*", "/")

_DIGITS = 50
"""Decimals with more digits are shown as quotients; numbers of PDDL have at most 18, and their sums no more."""


class UnknownValueError(Exception):
    """A term has no value; the message says why."""


def folded(formula: PddlFormula) -> PddlFormula:
    """Return a term of numbers as one number, and any other term as it is."""
    if formula.kind not in _ARITHMETIC or any(part.kind != "number" for part in formula.parts):
        return formula
    try:
        value = _calculated(formula.kind, [Fraction(part.number) for part in formula.parts])
    except UnknownValueError:
        return formula
    return PddlFormula("number", number=int(value) if value.denominator == 1 else value)


def _calculated(sign: str, values: list[Fraction]) -> Fraction:
    total, *others = values
    for each in others:
        if sign == "/" and not each:
            message = "divides by zero"
            raise UnknownValueError(message)
        total = {"+": total + each, "-": total - each, "*": total * each}[sign] if sign != "/" else total / each
    return total


def values_of(term: PddlFormula, task: PddlTask) -> list[Fraction]:
    """Return the values of a term over constant functions, for all parameters for which the problem gives values.

    Raise `UnknownValueError` if the term depends on a function that an action changes, or has no values.
    """
    changed = {effect.fluent.name for action in task.actions for effect in action.effects}
    functions = list(dict.fromkeys(_functions(term)))
    for each in functions:
        if each.name in changed:
            message = f"depends on `{each.name}`, which an action changes"
            raise UnknownValueError(message)
    values = list(dict.fromkeys(_value(term, row, task) for row in _rows(functions, task)))
    if not values:
        names = " and ".join(dict.fromkeys(f"`{each.name}`" for each in functions))
        message = f"depends on {names}, and the problem gives no values for the same objects"
        raise UnknownValueError(message)
    return values


def _functions(term: PddlFormula) -> Iterator[PddlFormula]:
    if term.kind == "fluent":
        yield term
    for part in term.parts:
        yield from _functions(part)


def _rows(functions: Iterable[PddlFormula], task: PddlTask) -> list[dict[str, str]]:
    """Return the objects for the parameters of functions for which the problem gives all of their values."""
    rows: list[dict[str, str]] = [{}]
    for function in functions:
        extended = []
        for row in rows:
            for fact in task.initial[function.name]:
                joined = _joined(row, function, fact)
                if joined is not None:
                    extended.append(joined)
        rows = [dict(each) for each in dict.fromkeys(tuple(sorted(row.items())) for row in extended)]
    return rows


def _joined(row: Mapping[str, str], function: PddlFormula, fact: tuple[str, ...]) -> dict[str, str] | None:
    joined = dict(row)
    for term, name in zip(function.parts, fact, strict=True):
        known = term.name if term.kind == "object" else joined.setdefault(term.name, name)
        if known != name:
            return None
    return joined


def _value(term: PddlFormula, row: Mapping[str, str], task: PddlTask) -> Fraction:
    if term.kind == "number":
        return Fraction(term.number)
    if term.kind == "fluent":
        objects = tuple(row[each.name] if each.kind == "parameter" else each.name for each in term.parts)
        return Fraction(task.initial[term.name][objects])
    return _calculated(term.kind, [_value(part, row, task) for part in term.parts])


def number_faults(
    task: PddlTask, domain: PddlText, problem: PddlText, read: Mapping[str, None]
) -> Iterator[Diagnostic]:
    """Yield an error for each product, quotient and fraction that a condition or an effect on a read fluent has."""
    for action in task.actions:
        formulas = [*action.conditions, *(effect.condition for effect in action.effects)]
        formulas += [effect.value for effect in action.effects if effect.fluent.name in read]
        for formula in formulas:
            yield from _faults_in(formula, domain, action)
    for goal in task.goals:
        yield from _faults_in(goal, problem, None)
    for name, values in task.initial.items():
        for fact, value in values.items():
            if name in read and isinstance(value, Fraction):
                message = (
                    f"{decimal(value)}, the value of `{name}`, is no whole number, and variables have whole numbers"
                )
                place = problem.initial_value(name, fact)
                yield problem.error(message, place, f"write all numbers that `{name}` depends on in smaller units")


def _faults_in(formula: PddlFormula, text: PddlText, action: PddlLiftedAction | None) -> Iterator[Diagnostic]:
    for part in formula.parts:
        yield from _faults_in(part, text, action)
    if formula.kind in {"*", "/"}:
        what = "products" if formula.kind == "*" else "quotients"
        message = f"{what} of functions cannot be expressed in a model, except as durations"
        remedy = "write a function of its own with the values"
        place = text.first(formula.kind, ":goal") if action is None else text.inside_action(action.name, formula.kind)
        yield text.error(message, place, remedy)
    elif isinstance(formula.number, Fraction):
        shown = decimal(formula.number)
        place = text.first(shown, ":goal") if action is None else text.inside_action(action.name, shown)
        message = f"{shown} is no whole number, and variables have whole numbers"
        yield text.error(message, place, "write it in smaller units")


def decimal(value: PddlNumber) -> str:
    """Return a number without rounding: as a decimal, or as a quotient if no decimal has its value."""
    number = Fraction(value)
    digits = next((count for count in range(_DIGITS) if (number * 10**count).denominator == 1), None)
    if not digits:
        return str(number)
    whole, rest = divmod(abs(int(number * 10**digits)), 10**digits)
    return f"{'-' * (number < 0)}{whole}.{rest:0{digits}}"
