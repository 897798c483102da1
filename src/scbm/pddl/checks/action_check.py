"""Checks the actions of a domain, and writes them for `unified-planning`: each effect alone, with its conditions."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.pddl.checks.condition_check import COMPARISONS, ConditionCheck
from scbm.pddl.checks.declared_names import NAME, remedy_for
from scbm.pddl.checks.start_changes import StartChange, TimedRead, changed_reads

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.pddl.checks.declared_names import Kinds, PddlNames
    from scbm.pddl.checks.pddl_nodes import FileFaults, PddlNode

_KEYS = {
    ":action": (":parameters", ":precondition", ":effect"),
    ":durative-action": (":parameters", ":duration", ":condition", ":effect"),
}
_REFUSED_KEYS = (":observe",)
_CHANGES = ("assign", "increase", "decrease", "scale-up", "scale-down")
_TIMED = "begin with `at start`, `over all` or `at end`"


class _EffectContext(Struct, frozen=True):
    """What stands around an effect.

    Attributes:
        scope: the types of the variables that it can name.
        variables: the variables of the `forall` around it.
        conditions: the texts of the conditions of the `when` around it.
        moment: `start` or `end`; empty for an action without duration.
    """

    scope: Mapping[str, Kinds]
    variables: Mapping[str, Kinds]
    conditions: tuple[str, ...] = ()
    moment: str = ""


class ActionCheck:
    """Checks the actions of a domain."""

    def __init__(self, names: PddlNames, faults: FileFaults) -> None:
        self._names = names
        self._faults = faults
        self._conditions = ConditionCheck(names, faults, is_domain=True)
        self._effects: list[str] = []
        self._started: list[StartChange] = []
        self._read: list[TimedRead] = []

    def action(self, node: PddlNode) -> tuple[str, str]:
        """Return the name of an action, and the action as a text for `unified-planning`."""
        kind, name = node.head, self._name(node)
        keys = self._keys(node)
        given = keys.get(":parameters")
        parameters = self._names.read_parameters(given.parts, self._faults) if given is not None else {}
        self._effects, self._started, self._read = [], [], []
        self._conditions.duration = None
        duration = self._duration(keys[":duration"], parameters) if ":duration" in keys else ""
        condition = keys.get(":condition" if kind == ":durative-action" else ":precondition")
        if condition is None:
            shown = "(and)"
        elif kind == ":durative-action":
            shown = f"(and {' '.join(self._timed_conditions(condition, parameters, {}))})"
        else:
            shown = self._conditions.condition(condition, parameters)
        effect = keys.get(":effect")
        if effect is not None:
            around = _EffectContext(parameters, {})
            self._timed_effect(effect, around) if kind == ":durative-action" else self._effect(effect, around)
            before = self._faults.found
            if not self._effects and not before:
                self._faults.wrong(effect, f"`{name}` has no effect", "write what it changes, or leave out the action")
            self._check_changes_at_start()
        effects = f"(and {' '.join(self._effects)})"
        words = f":duration {duration} :condition" if kind == ":durative-action" else ":precondition"
        start = f"({kind} a-{name} :parameters ({self._names.parameters_text(parameters)})"
        return name, f"{start} {words} {shown} :effect {effects})"

    def _name(self, node: PddlNode) -> str:
        if len(node.parts) > 1 and NAME.fullmatch(node.parts[1].word):
            return node.parts[1].word
        place = node.parts[1] if len(node.parts) > 1 and not node.parts[1].word.startswith(":") else node
        remedy = "names begin with a letter, and have letters, digits, `-` and `_`"
        self._faults.wrong(place, f"a name is expected after `{node.head}`", remedy)
        return "x"

    def _keys(self, node: PddlNode) -> dict[str, PddlNode]:
        """Return the parts of an action by their keys."""
        found: dict[str, PddlNode] = {}
        known = _KEYS[node.head]
        rest = [*node.parts[1:]]
        if rest and not rest[0].word.startswith(":"):
            rest.pop(0)  # the name
        while rest:
            key = rest.pop(0)
            value = rest.pop(0) if rest and not rest[0].word.startswith(":") else None
            if key.word in _REFUSED_KEYS:
                self._faults.refuse(key, "observations cannot be expressed in a model", "leave them out of the import")
            elif not key.word.startswith(":"):
                shown = "this expression" if key.is_list else f"`{key.word}`"
                self._faults.wrong(key, f"a key is expected in place of {shown}", f"keys: {', '.join(known)}")
            elif key.word not in known:
                remedy = remedy_for(key.word, known, f"keys: {', '.join(known)}")
                self._faults.wrong(key, f"`{node.head}` has no key `{key.word}`", remedy)
            elif key.word in found:
                self._faults.wrong(key, f"`{key.word}` stands twice in this action", "leave out one of them")
            elif value is None or not value.is_list:
                self._faults.wrong(key, f"an expression in brackets is expected after `{key.word}`", "write it")
                found[key.word] = type(node)("", (), key.place)
            else:
                found[key.word] = value
        for key_word in (":parameters", ":duration", ":effect"):
            if key_word in known and key_word not in found and not self._has_error_inside(node):
                remedy = "write `:parameters ()` for none" if key_word == ":parameters" else f"write `{key_word} (…)`"
                self._faults.wrong(node.parts[min(1, len(node.parts) - 1)], f"the action has no `{key_word}`", remedy)
        return found

    def _has_error_inside(self, node: PddlNode) -> bool:
        """Return whether the keys of an action have an error, from which others may follow."""
        places = {part.place for part in node.parts}
        return any(each.place in places for each in self._faults.found)

    # conditions and durations of actions with a duration

    def _timed_conditions(  # noqa: PLR0911 - one branch for each kind
        self, node: PddlNode, scope: Mapping[str, Kinds], bound: Mapping[str, Kinds]
    ) -> list[str]:
        if not self._conditions.is_expression(node, "condition"):
            return []
        match node.head:
            case "":
                return []
            case "and":
                return [text for each in node.parts[1:] for text in self._timed_conditions(each, scope, bound)]
            case "forall" if self._conditions.has_parts(node, 2, "(forall (?NAME - TYPE) (over all CONDITION))"):
                own = self._conditions.variables(node.parts[1])
                return self._timed_conditions(node.parts[2], {**scope, **own}, {**bound, **own})
            case "preference":
                inner = self._conditions.preferred(node)
                return [] if inner is node else self._timed_conditions(inner, scope, bound)
            case "forall":
                return []
            case _:
                pass
        if not self._is_timed(node, ("start", "all", "end")):
            message = f"conditions of an action with a duration {_TIMED}"
            is_close = node.head in ("at", "over") and len(node.parts) == 3 and node.parts[2].is_list  # noqa: PLR2004 - as above
            self._faults.wrong(node, message, None if is_close else f"write `(over all {_short(node)})`")
            return []
        inside = self._conditions.condition(node.parts[2], scope)
        if bound:
            inside = f"(forall ({self._names.parameters_text(bound)}) {inside})"
        for each in self._flat(node.parts[2]):
            text = self._conditions.condition(each, scope)
            self._read.append(TimedRead(each, node.parts[1].word, scope, bound, text))
        return [f"({node.head} {node.parts[1].word} {inside})"]

    @staticmethod
    def _is_timed(node: PddlNode, moments: tuple[str, ...]) -> bool:
        if len(node.parts) != 3 or not node.parts[2].is_list:  # noqa: PLR2004 - `at`, the moment, the expression
            return False
        pair = node.head, node.parts[1].word
        return pair in (("at", "start"), ("at", "end"), ("over", "all")) and pair[1] in moments

    def _duration(self, node: PddlNode, scope: Mapping[str, Kinds]) -> str:
        bounds: dict[str, str] = {}
        self._read_bounds(node, scope, bounds)
        if "=" in bounds and len(bounds) == 1:
            self._conditions.duration = bounds["="]
            return f"(= ?duration {bounds['=']})"
        upper = next((f"({sign} ?duration {bounds[sign]})" for sign in ("<=", "<") if sign in bounds), None)
        if upper is None or "=" in bounds:
            if not self._has_error_in(node):
                message = "the duration has no longest value" if upper is None else "the duration has several values"
                self._faults.wrong(
                    node, message, "write `(= ?duration NUMBER)`, or `(<= ?duration NUMBER)` for a bound"
                )
            return "(= ?duration 0)"
        lower = next(
            (f"({sign} ?duration {bounds[sign]})" for sign in (">=", ">") if sign in bounds), "(>= ?duration 0)"
        )
        return f"(and {lower} {upper})"

    def _has_error_in(self, node: PddlNode) -> bool:
        places = {node.spot, node.place, *(each.place for each in node.words())}
        return any(each.place in places for each in self._faults.found)

    def _read_bounds(self, node: PddlNode, scope: Mapping[str, Kinds], bounds: dict[str, str]) -> None:
        if not node.parts:
            return
        if node.head == "and":
            for each in node.parts[1:]:
                self._read_bounds(each, scope, bounds)
        elif self._is_timed(node, ("start", "end")):
            self._read_bounds(node.parts[2], scope, bounds)
        elif node.head in ("=", *COMPARISONS) and len(node.parts) == 3 and node.parts[1].word == "?duration":  # noqa: PLR2004 - sign, `?duration`, number
            if node.head in bounds:
                self._faults.wrong(node, "the duration has this bound already", "leave out one of them")
            bounds[node.head] = self._conditions.number(node.parts[2], scope)
        else:
            form = "`(= ?duration NUMBER)`, or `(and (>= ?duration NUMBER) (<= ?duration NUMBER))`"
            self._faults.wrong(node, f"`{_short(node)}` is no bound of the duration", f"write {form}")

    # effects

    def _effect(self, node: PddlNode, around: _EffectContext) -> None:  # noqa: C901 - one branch for each kind
        if not self._conditions.is_expression(node, "effect"):
            return
        operands = node.parts[1:]
        match node.head:
            case "":
                return
            case "and":
                for each in operands:
                    self._effect(each, around)
            case "forall" if self._conditions.has_parts(node, 2, "(forall (?NAME - TYPE) EFFECT)"):
                self._effect(operands[1], self._bound(operands[0], around))
            case "when" if self._conditions.has_parts(node, 2, "(when CONDITION EFFECT)"):
                condition = self._conditions.condition(operands[0], around.scope)
                self._add_later(operands[0], around)
                self._effect(operands[1], replace(around, conditions=(*around.conditions, condition)))
            case "not" if self._conditions.has_parts(node, 1, "(not FACT)"):
                if self._is_fact(operands[0]):
                    fact = self._conditions.fluent(operands[0], around.scope, is_numeric=False)
                    self._add(f"(not {fact})", operands[0], around)
            case word if word in _CHANGES:
                self._change(node, around)
            case _ if node.head not in ("forall", "when", "not") and self._is_fact(node):
                fact = self._conditions.fluent(node, around.scope, is_numeric=False)
                self._add(fact, node, around)
            case _:
                pass

    def _is_fact(self, node: PddlNode) -> bool:
        """Return whether an effect is that of a fact; else note an error."""
        if not self._conditions.is_expression(node, "fact"):
            return False
        if node.head in ("or", "imply", "exists", "=", "not", "and", "forall", "when", "preference", *COMPARISONS, ""):
            remedy = "write `(assign (FUNCTION) NUMBER)`" if node.head == "=" else "write each fact that changes"
            self._faults.wrong(node, f"`{node.head or '()'}` is no change of a fact", remedy)
            return False
        return True

    def _bound(self, node: PddlNode, around: _EffectContext) -> _EffectContext:
        """Return the context inside a `forall`."""
        own = self._conditions.variables(node)
        for name in own:
            if name in around.variables:
                self._faults.wrong(node, f"the variable `?{name}` is bound twice in one effect", "choose another name")
        return replace(around, scope={**around.scope, **own}, variables={**around.variables, **own})

    def _change(self, node: PddlNode, around: _EffectContext) -> None:
        """Check the change of a number."""
        if not self._conditions.has_parts(node, 2, f"({node.head} (FUNCTION) NUMBER)"):
            return
        _, target, value = node.parts
        if target.is_list:
            if not self._conditions.is_expression(target, "function"):
                return
            shown = self._conditions.fluent(target, around.scope, is_numeric=True)
        else:
            shown = self._conditions.number(target, around.scope)
            if target.word not in self._names.fluents:
                return
        word = node.head
        if word in {"scale-up", "scale-down"}:
            what = "products" if word == "scale-up" else "quotients"
            self._faults.refuse(node, f"{what} cannot be expressed in a model", "write `increase` or `decrease`")
            word = "increase" if word == "scale-up" else "decrease"
        self._add_later(value, around, is_value=True)
        text = f"({word} {shown} {self._conditions.number(value, around.scope)})"
        if word != "assign":
            self._check_counted(node, text, around)
        self._add(text, target, around)

    def _check_counted(self, node: PddlNode, text: str, around: _EffectContext) -> None:
        """Refuse to add to a number once for each object of a `forall` that the effect does not name."""
        words = re.findall(r"[^\s()]+", " ".join((text, *around.conditions)))
        for name in around.variables:
            if f"?{name}" not in words:
                message = f"`{node.head}` happens once for each `?{name}`, which it does not name"
                self._faults.refuse(node, message, "write the sum, without `forall`")

    def _add(self, text: str, target: PddlNode, around: _EffectContext) -> None:
        if not all(map(self._names.have_objects, around.variables.values())):
            self._effects.append("")  # for each of no objects, even where the effect does not name them
            return
        if around.moment == "start":
            is_certain = not around.conditions and not around.variables
            self._started.append(StartChange(target, text, around.scope, around.variables, is_certain))
        if around.conditions:
            text = f"(when (and {' '.join(around.conditions)}) {text})"
        if around.moment:
            text = f"(at {around.moment} {text})"
        if around.variables:
            text = f"(forall ({self._names.parameters_text(around.variables)}) {text})"
        self._effects.append(text)

    # effects of actions with a duration

    def _timed_effect(self, node: PddlNode, around: _EffectContext) -> None:
        if not self._conditions.is_expression(node, "effect") or not node.parts:
            return
        operands = node.parts[1:]
        match node.head:
            case "and":
                for each in operands:
                    self._timed_effect(each, around)
            case "forall" if self._conditions.has_parts(node, 2, "(forall (?NAME - TYPE) EFFECT)"):
                self._timed_effect(operands[1], self._bound(operands[0], around))
            case "when" if self._conditions.has_parts(node, 2, "(when (at end CONDITION) (at end EFFECT))"):
                self._timed_when(operands[0], operands[1], around)
            case "forall" | "when":
                return
            case word if word in _CHANGES and any(each.word == "#t" for each in node.words()):
                self._change(node, around)
                if self._effects:
                    self._effects.pop()  # a change that goes on, which is an error already
            case _ if self._is_timed(node, ("start", "end")):
                self._effect(operands[1], replace(around, moment=operands[0].word))
            case _:
                message = "effects of an action with a duration begin with `at start` or `at end`"
                self._faults.wrong(node, message, f"write `(at end {_short(node)})`")

    def _timed_when(self, condition: PddlNode, effect: PddlNode, around: _EffectContext) -> None:
        """Check an effect with a condition: the condition is that before the action, at the start or not."""
        timed = list(self._flat(condition))
        known = len(self._read)
        texts = self._timed_conditions(condition, around.scope, {})
        inside = [text.split(" ", 2)[2][:-1] for text in texts]
        later = [each for each in timed if each.parts[1:] and each.parts[1].word != "start"]
        if effect.head == "at" and effect.parts[1:] and effect.parts[1].word == "start" and later:
            message = "an effect at the start has a condition that is later than the start"
            self._faults.wrong(later[0], message, "write `at start` for the condition, too")
        conditions = (*around.conditions, *inside)
        self._read[known:] = [
            replace(each, variables={**around.variables, **each.variables}, text="")
            for each in self._read[known:]
            if each.moment != "start"
        ]
        self._timed_effect(effect, replace(around, conditions=conditions))

    def _flat(self, node: PddlNode) -> list[PddlNode]:
        return [inner for each in node.parts[1:] for inner in self._flat(each)] if node.head == "and" else [node]

    def _add_later(self, node: PddlNode, around: _EffectContext, *, is_value: bool = False) -> None:
        """Note what an effect at the end reads."""
        if around.moment == "end":
            self._read.append(TimedRead(node, "end", around.scope, around.variables, is_value=is_value))

    def _check_changes_at_start(self) -> None:
        """Refuse what an action reads after it has changed it at its start."""
        for read, is_value, pair in changed_reads(self._read, self._started, self._names):
            what, remedy = "condition", "write what holds before the action, with `at start`"
            if is_value:
                what, remedy = "value", "write both effects at one moment"
            if pair is not None:
                remedy = f"{remedy}, or `(at start (not (= {' '.join(pair)})))`"
            name = read.head or read.word
            message = f"the {what} reads `{name}` after this action has changed it at its start"
            self._faults.refuse(read, message, remedy)


def _short(node: PddlNode) -> str:
    text = str(node)
    return text if len(text) <= 60 else f"{text[:59]}…"  # noqa: PLR2004 - so much fits into a line with a message
