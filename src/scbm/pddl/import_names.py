"""Names of a model for the names of PDDL: words without hyphens, each for one thing."""

from __future__ import annotations

import re
from itertools import count
from typing import TYPE_CHECKING

from scbm.files.language.grammar import QUANTIFIERS
from scbm.files.language.scope import reserved_names
from scbm.model.variables import resource_variables, runner_variables
from scbm.pddl.pddl_reader import inner_formulas

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from scbm.pddl.pddl_task import PddlTask

NOTHING = "nothing"
"""The value of a group in which no fact holds."""

_WORDS = ("min", "max", "where", "bool", "null", NOTHING)
"""Words that have a meaning of their own in the text of a model, besides those that `_reserved` reads from scbm."""

OPERATION_FORMS = ("{}", "start_{}", "complete_{}", "fail_{}")
"""The names that an operation brings: its own, and those of its transitions."""

RESOURCE_FORMS = ("{}", "{}_command", "{}_failed", *(each.name for each in resource_variables("{}")))
"""The names that a resource brings: its own, those of its variables, and that of its automatic transition."""


def _reserved() -> Iterator[str]:
    """Yield the words that no thing of a model is called: keywords, and what the variables of the runner have."""
    yield from (*_WORDS, *QUANTIFIERS, *reserved_names("operations"))
    runner = runner_variables(())
    yield from (word for each in runner for word in each.name.split("."))
    yield from (str(value) for each in (*runner, *resource_variables("")) for value in each.domain.values)


class ImportNames:
    """The names of a model for the types, objects, fluents and actions of a task.

    No two things have one name, and no parameter has the name of a thing, except that of a type.
    """

    def __init__(self, task: PddlTask) -> None:
        self._taken = dict.fromkeys(_reserved())
        self._bound: dict[str, None] = {}
        self.types = {name: self.fresh(name) for name in task.types}
        self.objects = {name: self.fresh(name) for name in task.objects}
        self.fluents = {name: self.fresh(name) for name in task.fluents}
        self.actions = {action.name: self.fresh(action.name, OPERATION_FORMS) for action in task.actions}
        self._bound = dict.fromkeys(map(_word, _parameters_in(task)))

    def fresh(self, name: str, forms: Sequence[str] = ("{}",)) -> str:
        """Return a name for a name of PDDL that no other thing of the model has, nor any of its forms."""
        word = self._free(name, forms, {*self._taken, *self._bound})
        self._taken |= dict.fromkeys(form.format(word) for form in forms)
        return word

    def parameters(self, names: Iterable[str], used: Collection[str] = ()) -> dict[str, str]:
        """Return the names of parameters of one entry; `used` are those that it has already."""
        taken = [word for word in self._taken if word not in self.types.values()]
        made: dict[str, str] = {}
        for name in names:
            made[name] = self._free(name, ("{}",), {*taken, *used, *made.values()})
        self._bound |= dict.fromkeys(made.values())
        return made

    @staticmethod
    def _free(name: str, forms: Sequence[str], taken: Collection[str]) -> str:
        base = _word(name)
        words = (base if number == 1 else f"{base}_{number}" for number in count(1))
        return next(word for word in words if not any(form.format(word) in taken for form in forms))


def _parameters_in(task: PddlTask) -> Iterator[str]:
    """Yield the names of all parameters and variables."""
    for fluent in task.fluents.values():
        yield from (name for name, _ in fluent.parameters)
    formulas = [*task.goals]
    for action in task.actions:
        yield from (name for name, _ in action.parameters)
        formulas += [*action.conditions, *(effect.condition for effect in action.effects)]
    yield from (name for each in formulas for inner in inner_formulas(each) for name, _ in inner.variables)


def _word(name: str) -> str:
    word = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return word if not word[:1].isdigit() else f"x{word}"
