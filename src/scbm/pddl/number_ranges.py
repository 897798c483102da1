"""The ranges of numeric fluents: as the user gives them, or as conditions of the actions bound them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from scbm.files.codec.variable_keys import MAX_VALUES
from scbm.files.spelling import nearest, suggestion
from scbm.model import Diagnostic, Place, Slug
from scbm.pddl.constant_terms import UnknownValueError, decimal, values_of
from scbm.pddl.pddl_reader import conjuncts, negated
from scbm.pddl.pddl_task import PddlFormula
from scbm.pddl.temporary_facts import takes_back

if TYPE_CHECKING:
    from collections.abc import Sequence
    from fractions import Fraction

    from scbm.pddl.pddl_task import FormulaKind, PddlEffect, PddlFluent, PddlLiftedAction, PddlNumber, PddlTask
    from scbm.pddl.pddl_text import PddlText

_RANGE = re.compile(r"(?P<name>[^=]+)=(?P<low>-?\d+)\.\.(?P<high>-?\d+)")

_DIGITS = 20
"""So many digits and signs of a range are read: a domain has numbers of at most 18 digits."""


class NumberRanges:
    """The lowest and the highest value of each numeric fluent.

    An action that subtracts k needs a condition `fluent >= b`: the lowest value after it is b - k. So for the highest.
    Here b and k are numbers, or terms over functions that no action changes.

    Attributes:
        errors: fluents without a bound, and options that are wrong.
    """

    def __init__(self, task: PddlTask, fluents: Sequence[PddlFluent], domain: PddlText, asked: Sequence[str]) -> None:
        self.errors: list[Diagnostic] = []
        self._task = task
        self._domain = domain
        self._ranges: dict[str, tuple[PddlNumber, PddlNumber]] = {}
        self._misspelt: dict[str | None, None] = {}
        given = self._given(asked, [each.name for each in fluents])
        for fluent in fluents:
            values = list(task.initial[fluent.name].values()) or [0]
            if fluent.name in given:
                low, high = given[fluent.name]
                if min(values) < low or max(values) > high:
                    first = f"{decimal(min(values))}..{decimal(max(values))}"
                    message = f"`{fluent.name}` begins with {first}, outside of {low}..{high}"
                    self._wrong(message, None)
                self._ranges[fluent.name] = low, high
            else:
                self._ranges[fluent.name] = self._inferred(fluent.name, min(values), max(values))

    def shown(self, name: str) -> str:
        """Return the domain of a fluent as text."""
        low, high = self._ranges[name]
        return f"{low}..{high}"

    def decided(self, comparison: PddlFormula) -> bool | None:
        """Return whether a comparison with a number outside of the range holds; `None` for others."""
        left, right = comparison.parts
        fluent, number = (left, right) if right.kind == "number" else (right, left)
        if fluent.kind != "fluent" or fluent.name not in self._ranges or number.kind != "number":
            return None
        low, high = self._ranges[fluent.name]
        if low <= number.number <= high:
            return None
        return comparison.kind != "equals" and (number.number > high) == (fluent is left)

    def _given(self, asked: Sequence[str], known: Sequence[str]) -> dict[str, tuple[int, int]]:
        given: dict[str, tuple[int, int]] = {}
        for text in asked:
            plain = text.replace(" ", "").lower()
            match = _RANGE.fullmatch(plain)
            ends = (0, -1) if match is None else (int(match["low"][:_DIGITS]), int(match["high"][:_DIGITS]))
            if match is None or ends[0] > ends[1]:
                self._wrong(f"`{text}` is no range of a function", "write `FUNCTION=0..10`")
                self._misspelt[nearest(plain.partition("=")[0], known)] = None
            elif match["name"] in given:
                self._wrong(f"`{match['name']}` has two ranges", "give one")
            elif match["name"] not in known:
                message = f"`{match['name']}` is no function that conditions read"
                self._wrong(message, suggestion(match["name"], known, "functions"))
                self._misspelt[nearest(match["name"], known)] = None
            elif ends[1] - ends[0] >= MAX_VALUES or max(map(abs, ends)) >= 10 ** (_DIGITS - 2):
                message = f"a variable can have {MAX_VALUES} values, and `{text}` is larger"
                self._wrong(message, "give a narrower range, or write the numbers of the problem in larger units")
                self._misspelt[match["name"]] = None
            else:
                given[match["name"]] = ends
        return given

    def _wrong(self, message: str, remedy: str | None) -> None:
        self.errors.append(Diagnostic(Slug.BAD_OPTION, message, Place("--range"), remedy))

    def _inferred(self, name: str, low: PddlNumber, high: PddlNumber) -> tuple[PddlNumber, PddlNumber]:
        for action in self._task.actions:
            for effect in action.effects:
                if effect.fluent.name != name or any(_is_sum_zero(effect, other) for other in action.effects):
                    continue
                bounds = self._after(action, effect)
                if bounds is None and name in self._misspelt:
                    return low, high  # the option for it has an error already
                if bounds is None:
                    message = f"nothing bounds `{name}`, which {action.name} changes"
                    place = self._domain.inside_effect(action.name, name)
                    remedy = f"give its range: `--range {name}=0..10`"
                    self.errors.append(self._domain.error(message, place, remedy))
                    return low, high
                low, high = min(low, bounds[0], bounds[1]), max(high, bounds[1], bounds[0])
        return low, high

    def _after(self, action: PddlLiftedAction, effect: PddlEffect) -> tuple[PddlNumber, PddlNumber] | None:
        """Return bounds of the new value, as far as the action gives them."""
        steps = self._values(effect.value)
        if steps is None:
            return None
        if effect.kind == "assign":
            return min(steps), max(steps)
        sign: FormulaKind = "+" if effect.kind == "increase" else "-"
        rises = {(step >= 0) == (sign == "+") for step in steps}
        if len(rises) > 1:
            return None
        is_upper = rises == {True}
        more = self._added_by_others(action, effect)
        bounds = []
        for condition in (c for each in (*action.conditions, effect.condition) for c in conjuncts(each)):
            bound = _bound(condition, effect.fluent, is_upper=is_upper)
            values = None if bound is None else self._values(PddlFormula(sign, (bound, effect.value)))
            if values is not None and more is not None:
                beyond = more - int(condition.kind == "<")
                bounds.append(max(values) + beyond if is_upper else min(values) - beyond)
        if not bounds:
            return None
        nearest = min(bounds) if is_upper else max(bounds)
        return nearest, nearest

    def _added_by_others(self, action: PddlLiftedAction, effect: PddlEffect) -> Fraction | int | None:
        """Return how much more an action may add to a number for equal objects; `None` if that is not known."""
        conditions = [each for condition in action.conditions for each in conjuncts(condition)]
        total: Fraction | int = 0
        for other in action.effects:
            if (other.fluent.name, other.kind) == (effect.fluent.name, effect.kind) and other is not effect:
                pairs = list(zip(effect.fluent.parts, other.fluent.parts, strict=True))
                both = [PddlFormula("equals", each) for pair in pairs for each in (pair, pair[::-1])]
                steps = self._values(other.value)
                if any(negated(each) in conditions for each in both):
                    continue
                if steps is None:
                    return None
                total += max(map(abs, steps))
        return total

    def _values(self, term: PddlFormula) -> list[Fraction] | None:
        """Return the values of a term over constant functions; `None` of another term."""
        try:
            return values_of(term, self._task)
        except UnknownValueError:
            return None


def _is_sum_zero(effect: PddlEffect, other: PddlEffect) -> bool:
    """Return whether one of two effects subtracts at the start of an action what the other one adds at its end."""
    first, last = sorted((effect, other), key=lambda each: each.moment)
    return first.moment < last.moment and first.kind != "assign" and takes_back(first, last)


def _bound(condition: PddlFormula, fluent: PddlFormula, *, is_upper: bool) -> PddlFormula | None:
    """Return the term that bounds a fluent by a condition; `None` if there is none."""
    if condition.kind not in {"<=", "<", "equals"}:
        return None
    left, right = condition.parts
    if left == fluent and (is_upper or condition.kind == "equals"):
        return right
    if right == fluent and (not is_upper or condition.kind == "equals"):
        return left
    return None
