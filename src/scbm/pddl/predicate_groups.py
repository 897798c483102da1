"""Predicates that become one variable each: at most one value of one of their parameters holds at a time."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, TypeVar

from msgspec.structs import replace

from scbm.files.spelling import suggestion
from scbm.model import Diagnostic, Place, Severity, Slug
from scbm.pddl.pddl_reader import conjuncts
from scbm.pddl.pddl_task import TRUE, PddlFormula

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from scbm.pddl.pddl_task import Fact, PddlEffect, PddlLiftedAction, PddlTask
    from scbm.pddl.pddl_text import PddlText

_Item = TypeVar("_Item")

_REMEDY = "leave out its `--group`"


class PredicateGroups:
    """The groups that the user names, and those that are proved.

    Attributes:
        chosen: for each predicate with a group, the index of the parameter whose values exclude each other.
        unproved: the predicates of `chosen` for which only the word of the user says so.
        errors: options that are wrong, and groups that the problem contradicts.
        warnings: one for each unproved group.
    """

    def __init__(
        self, task: PddlTask, domain: PddlText, problem: PddlText, static: Collection[str], asked: Sequence[str]
    ) -> None:
        self._task = task
        self._domain = domain
        self._problem = problem
        self.chosen: dict[str, int] = {}
        self.unproved: list[str] = []
        self.errors: dict[Diagnostic, None] = {}
        self.warnings: list[Diagnostic] = []
        for text in asked:
            self._choose(text, static)
        for name, index in task.exclusive.items():
            usable = name in task.fluents and name not in static and name not in self.chosen
            if usable and not any(True for _ in self._faults(name, index)):
                self.chosen[name] = index

    def is_complete(self, name: str, objects_of: Mapping[str, Sequence[str]]) -> bool:
        """Return whether some value of a group holds always, so that no value for nothing is needed."""
        index = self.chosen[name]
        keys = [without(fact, index) for fact, value in self._task.initial[name].items() if value]
        types = without(self._task.fluents[name].types, index)
        if len(keys) != len(list(product(*(objects_of[kind] for kind in types)))):
            return False
        for action in self._task.actions:
            effects = [effect for effect in action.effects if effect.fluent.name == name]
            added = [(without(e.fluent.parts, index), e.condition, e.moment) for e in effects if e.value == TRUE]
            for effect in effects:
                key = without(effect.fluent.parts, index), effect.condition
                if effect.value != TRUE and not any(a[:2] == key and a[2] >= effect.moment for a in added):
                    return False
        return True

    # groups that the user names

    def _choose(self, text: str, static: Collection[str]) -> None:
        asked = self._asked(text, static)
        if asked is None:
            return
        name, index = asked
        if self.chosen.get(name, index) != index:
            self._wrong_option(f"`{name}` has two groups, and a predicate can have one", "leave out one of them")
            return
        faults = list(self._faults(name, index))
        self.errors |= dict.fromkeys(faults)
        self.chosen[name] = index
        if not faults and not self._is_proved(name, index):
            self.unproved.append(name)
            self.warnings.append(self._doubt(name, index))

    def _asked(self, text: str, static: Collection[str]) -> tuple[str, int] | None:
        name, _, parameter = text.lower().partition(".")
        known = [n for n, f in self._task.fluents.items() if f.parameters and not f.is_numeric and n not in static]
        if name not in known:
            message = f"`{name}` is no predicate with parameters that changes"
            self._wrong_option(message, suggestion(name, known, "predicates"))
            return None
        names = [each for each, _ in self._task.fluents[name].parameters]
        if not parameter:
            return name, len(names) - 1
        if parameter.lstrip("?") not in names:
            message = f"`{name}` has no parameter `{parameter}`"
            self._wrong_option(message, suggestion(parameter, names, "parameters"))
            return None
        return name, names.index(parameter.lstrip("?"))

    def _wrong_option(self, message: str, remedy: str | None) -> None:
        self.errors[Diagnostic(Slug.BAD_OPTION, message, Place("--group"), remedy)] = None

    def _is_proved(self, name: str, index: int) -> bool:
        parts = (part for invariant in self._task.invariants for part in invariant)
        return self._task.exclusive.get(name) == index or any((p.fluent, p.counted) == (name, index) for p in parts)

    def _doubt(self, name: str, index: int) -> Diagnostic:
        """Return the warning about a group without a proof, at an action that may give it a second value."""
        parameter = self._task.fluents[name].parameters[index][0]
        place, reason = self._domain.declared(name), "no proof was found"
        for action in self._task.actions:
            doubtful = [e for e in _additions(action, name) if self._replaced(action, e, index) is None]
            if doubtful:
                place = self._place_of(action, doubtful[0])
                reason = f"{action.name} makes it true without a condition on the value before"
                break
        message = f"nothing proves that `{name}` holds for one `{parameter}` at a time: {reason}"
        lost = "its variable keeps the last one only, and plans may be wrong"
        remedy = f"leave out `--group {name}` if two can hold at once: {lost}"
        return replace(self._domain.error(message, place, remedy, Slug.PDDL_GROUP_UNPROVED), severity=Severity.WARNING)

    def _place_of(self, action: PddlLiftedAction, effect: PddlEffect) -> Place:
        terms = effect.fluent.parts
        words = [f"?{term.name}" if term.kind == "parameter" else term.name for term in terms]
        return self._domain.inside_effect(action.name, effect.fluent.name, *words)

    # contradictions

    def _faults(self, name: str, index: int) -> Iterator[Diagnostic]:
        """Yield the reasons why the values of a parameter cannot be those of one variable."""
        yield from self._initial_faults(name, index)
        for action in self._task.actions:
            for effect in action.effects:
                if effect.fluent.name == name:
                    reason = self._contradiction(action, effect, index)
                    if reason:
                        message = f"`{name}` cannot be one variable because of {action.name}: {reason}"
                        yield self._domain.error(message, self._place_of(action, effect), _REMEDY)

    def _initial_faults(self, name: str, index: int) -> Iterator[Diagnostic]:
        first: dict[Fact, str] = {}
        for fact, value in self._task.initial[name].items():
            key, each = without(fact, index), fact[index]
            if value and key in first:
                message = f"`{name}` cannot be one variable: it holds for {first[key]} and {each} at first"
                yield self._problem.error(message, self._problem.in_section(":init", name, fact), _REMEDY)
            elif value:
                first[key] = each

    def _contradiction(self, action: PddlLiftedAction, effect: PddlEffect, index: int) -> str:
        """Return why an effect contradicts a group; an empty text if it does not."""
        key = without(effect.fluent.parts, index)
        added = [e for e in _additions(action, effect.fluent.name) if without(e.fluent.parts, index) == key]
        if effect.value == TRUE:
            if effect.variables or any(e.fluent != effect.fluent for e in added):
                return "it adds several values of it"
            kept = self._replaced(action, effect, index)
            if kept is not None and not _deletes(action, kept, effect):
                return "it adds a value, and does not delete the value that its precondition requires"
            return ""
        if any(e.condition == effect.condition and not e.variables for e in added):
            return ""
        if effect.variables or effect.fluent not in _required(action, effect):
            return "it deletes a value that its precondition does not require"
        return ""

    @staticmethod
    def _replaced(action: PddlLiftedAction, effect: PddlEffect, index: int) -> PddlFormula | None:
        """Return the fact of a group that an action requires before an effect adds one; `None` if there is none."""
        required = _required(action, effect)
        if effect.fluent in required:
            return effect.fluent
        key = without(effect.fluent.parts, index)
        for each in required:
            if each.kind == "fluent" and each.name == effect.fluent.name and without(each.parts, index) == key:
                pair = each.parts[index], effect.fluent.parts[index]
                same = any(PddlFormula("equals", both) in required for both in (pair, pair[::-1]))
                return effect.fluent if same else each
        return None


def without(items: Sequence[_Item], index: int) -> tuple[_Item, ...]:
    """Return the items without that of an index."""
    return (*items[:index], *items[index + 1 :])


def _additions(action: PddlLiftedAction, name: str) -> list[PddlEffect]:
    return [effect for effect in action.effects if effect.fluent.name == name and effect.value == TRUE]


def _required(action: PddlLiftedAction, effect: PddlEffect) -> list[PddlFormula]:
    """Return the conditions of an effect and of its action."""
    return [c for each in (*action.conditions, effect.condition) for c in conjuncts(each)]


def _deletes(action: PddlLiftedAction, fact: PddlFormula, added: PddlEffect) -> bool:
    """Return whether an action deletes a fact wherever it adds another one."""
    if fact == added.fluent:
        return True
    return any(e.fluent == fact and e.value != TRUE and e.condition in (TRUE, added.condition) for e in action.effects)
