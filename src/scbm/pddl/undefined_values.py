"""Functions of PDDL that have no value for some objects: there, no condition that reads them holds."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.pddl.pddl_reader import conjuncts, inner_formulas
from scbm.pddl.pddl_task import TRUE, PddlFluent, PddlFormula

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model import Diagnostic, Place
    from scbm.pddl.pddl_task import Fact, PddlLiftedAction, PddlTask
    from scbm.pddl.pddl_text import PddlText


class UndefinedValues:
    """The values that a problem does not give, for the functions that conditions and effects read.

    Attributes:
        task: the problem; its actions require that what they read has a value, unless other conditions imply it.
        partial: the functions that have values for some objects only.
        errors: values that the problem has to give.
    """

    def __init__(
        self,
        task: PddlTask,
        texts: tuple[PddlText, PddlText],
        read: Mapping[str, None],
        objects_of: Mapping[str, Sequence[str]],
    ) -> None:
        self.task = task
        self.errors: list[Diagnostic] = []
        self._domain, self._problem = texts
        self._changed = dict.fromkeys(effect.fluent.name for action in task.actions for effect in action.effects)
        self._given: dict[str, str] = {}
        for name in read:
            fluent = task.fluents[name]
            choices = product(*(objects_of[kind] for kind in fluent.types))
            missing = next((fact for fact in choices if fact not in task.initial[name]), None)
            if fluent.is_numeric and missing is not None:
                if name in self._changed or not task.initial[name]:
                    self._note(name, missing)
                else:
                    self._given[name] = self._fresh(f"{name}-given")
        self.partial = [*self._given]
        if self._given:
            self._require_values()

    def _fresh(self, name: str) -> str:
        while name in self.task.fluents:
            name += "-2"
        return name

    def _note(self, name: str, missing: Fact) -> None:
        fact = f"({' '.join((name, *missing))})"
        message = f"the problem gives no value of `{fact}`, and actions or the goal read it"
        self.errors.append(
            self._problem.error(message, self._problem.first(":init"), f"write `(= {fact} 0)`, or another value")
        )

    def _require_values(self) -> None:
        actions = tuple(self._with_required_values(action) for action in self.task.actions)
        for goal in self.task.goals:
            for each in inner_formulas(goal):
                if each.kind == "fluent" and each.name in self._given:
                    self._refuse(each.name, self._problem, self._problem.first(":goal"))
        tables = {table: PddlFluent(table, self.task.fluents[name].parameters) for name, table in self._given.items()}
        rows = {table: dict.fromkeys(self.task.initial[name], 1) for name, table in self._given.items()}
        self.task = replace(
            self.task, actions=actions, fluents={**self.task.fluents, **tables}, initial={**self.task.initial, **rows}
        )

    def _with_required_values(self, action: PddlLiftedAction) -> PddlLiftedAction:
        """Return an action that requires a value of each function that it reads."""
        conditions = [part for each in action.conditions for part in conjuncts(each)]
        plain = [(c.parts[0] if c.kind == "not" else c) for c in conditions]
        readers = [each for each in plain if each.kind in {"<=", "<", "equals"}]
        effects = [each for each in action.effects if each.condition == TRUE and not each.variables]
        readers += [effect.value for effect in effects]
        needed = dict.fromkeys(use for each in readers for use in self._uses(each))
        others = [c for c, inner in zip(conditions, plain, strict=True) if inner not in readers]
        others += [e.condition for e in action.effects] + [e.value for e in action.effects if e not in effects]
        for use in dict.fromkeys(use for each in others for use in self._uses(each)):
            if use not in needed:
                self._refuse(use.name, self._domain, self._domain.inside_action(action.name, use.name))
        added = [
            PddlFormula("fluent", use.parts, self._given[use.name]) for use in needed if not self._implied(use, plain)
        ]
        return replace(action, conditions=(*added, *action.conditions))

    def _uses(self, formula: PddlFormula) -> Iterator[PddlFormula]:
        return (each for each in inner_formulas(formula) if each.kind == "fluent" and each.name in self._given)

    def _implied(self, use: PddlFormula, conditions: Sequence[PddlFormula]) -> bool:
        """Return whether a fact that no action changes implies that a function has a value."""
        values = self.task.initial[use.name]
        for each in conditions:
            if (
                each.kind == "fluent"
                and each.name not in self._changed
                and all(part in each.parts for part in use.parts)
            ):
                places = [each.parts.index(part) for part in use.parts]
                rows = [row for row, holds in self.task.initial[each.name].items() if holds]
                if all(tuple(row[place] for place in places) in values for row in rows):
                    return True
        return False

    def _refuse(self, name: str, text: PddlText, place: Place) -> None:
        message = f"`{name}` has no value for some objects, and stands in a part of a condition or effect here"
        self.errors.append(text.error(message, place, f"give all values of `{name}` in `:init`"))
