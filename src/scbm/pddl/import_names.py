"""Names of a model for the names of PDDL: words without hyphens, each for one thing."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.pddl.pddl_task import PddlTask

_WORDS = (
    *("true", "false", "in", "always", "never", "after", "before", "until", "leads", "within", "forall", "exists"),
    *("count", "min", "max", "where", "elapsed", "none", "current", "plan", "automatic", "nothing", "bool"),
    *("state", "name", "initial", "disabled", "executing", "timedout", "failed", "completed"),
)
"""Words that have a meaning of their own in texts of a model, or that follow objects in ground names."""


class ImportNames:
    """The names of a model for the types, objects, fluents and actions of a task."""

    def __init__(self, task: PddlTask) -> None:
        self._taken = dict.fromkeys(_WORDS)
        self.types = {name: self.fresh(name) for name in task.types}
        self.objects = {name: self.fresh(name) for name in task.objects}
        types = dict.fromkeys(self.types.values())
        self._taken = {word: None for word in self._taken if word not in types}
        self.fluents = {name: self.fresh(name) for name in task.fluents}
        self.actions = {action.name: self.fresh(action.name) for action in task.actions}

    def fresh(self, name: str) -> str:
        """Return a name for a name of PDDL that no other thing of the model has."""
        word = base = _word(name)
        number = 1
        while word in self._taken:
            number += 1
            word = f"{base}_{number}"
        self._taken[word] = None
        return word

    def parameters(self, names: list[str]) -> dict[str, str]:
        """Return the names of the parameters of one entry."""
        made: dict[str, str] = {}
        for name in names:
            word = base = _word(name)
            number = 1
            while word in self._taken or word in made.values():
                number += 1
                word = f"{base}_{number}"
            made[name] = word
        return made


def _word(name: str) -> str:
    word = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return word if not word[:1].isdigit() else f"x{word}"
