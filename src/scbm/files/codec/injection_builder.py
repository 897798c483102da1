"""From what a case says of injections to injections that do not contradict each other."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

from scbm.cases import Condition, ConditionKind, Injection
from scbm.files.codec.case_words import CONDITION_WORDS, INJECTION_KEYS
from scbm.files.language.scope import Where
from scbm.model import Slug
from scbm.model.durations import format_duration
from scbm.model.predicates import TRUE, Predicate
from scbm.model.values import Value, format_value

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.codec.case_parts import CaseParts
    from scbm.files.yaml.document import YamlNode
    from scbm.model import Place

MAX_INJECTIONS = 1_000

_FACTOR = re.compile(r"\d{1,6}(\.\d{1,6})?", re.ASCII)


@dataclass(frozen=True, slots=True)
class _Effect:
    """That an injection gives something a value.

    Attributes:
        target: what gets it; one name for all that stands for one thing.
        shown: the same, as people call it.
        value: what it gets.
        words: the same, as it is written.
        injection: which one.
        place: where that stands.
    """

    target: str
    shown: str
    value: Value | Condition
    words: str
    injection: Injection
    place: Place

    @property
    def moment(self) -> tuple[int, str]:
        """When it acts: not before a time, and when a predicate holds."""
        return self.injection.at_ns or 0, str(self.injection.when or TRUE)

    @property
    def hold_end_ns(self) -> int | None:
        """Until when it is held, if that is a time that is known."""
        at_ns, when = self.moment
        hold_ns = self.injection.hold_ns
        return None if hold_ns is None or when != str(TRUE) else at_ns + hold_ns


class InjectionBuilder:
    """Reads what stands under `injections`."""

    def __init__(self, parts: CaseParts) -> None:
        self._parts = parts
        self._effects: list[_Effect] = []
        self._places: dict[str, Place] = {}

    def injections(self, node: YamlNode | None) -> tuple[Injection, ...]:
        """The injections, in the order of the file."""
        elements = node.elements if node is not None else []
        if len(elements) > MAX_INJECTIONS:
            message = f"{len(elements)} injections are too many: the most is {MAX_INJECTIONS}"
            self._parts.add(Slug.BAD_NUMBER, message, elements[MAX_INJECTIONS].place)
            return ()
        built = [self._injection(number, element) for number, element in enumerate(elements, start=1)]
        self._refuse_contradictions()
        return tuple(built)

    def _injection(self, number: int, node: YamlNode) -> Injection:
        # A key that is told of as unknown may be meant as one that is missing.
        if isinstance(node.plain, dict) and not node.incomplete and all(key in INJECTION_KEYS for key in node.items):
            self._check_keys(node)
        resource = self._parts.resource(node.get("resource"))
        when = node.get("when")
        injection = Injection(
            self._name(number, node),
            self._parts.assigned(node.get("set")),
            None if when is None else self._when(when),
            self._parts.time(node.get("at")),
            self._parts.time(node.get("hold")),
            None if resource is None else resource.name,
            self._condition(node.get("becomes")),
        )
        self._effects += self._effects_of(injection, node)
        return injection

    def _when(self, node: YamlNode) -> Predicate:
        return self._parts.predicate(node, Where.GUARD)

    def _name(self, number: int, node: YamlNode) -> str:
        written = node.get("name")
        name = self._parts.name(written) if written is not None else f"injection_{number}"
        place = node.place if written is None else written.place
        if name is None:
            return f"injection_{number}"
        if name == "network":
            self._parts.add(Slug.RESERVED_NAME, "`network` has a meaning of its own", place, "choose another name")
        if name in self._places:
            message = f"two injections are called `{name}`, the other in line {self._places[name].line}"
            self._parts.add(Slug.DUPLICATE_NAME, message, place, "choose another name")
        self._places.setdefault(name, place)
        return name

    def _check_keys(self, node: YamlNode) -> None:
        """An injection sets variables, or it changes the condition of a resource."""
        has = {key: key in node.items for key in ("set", "resource", "becomes")}
        if has["set"] and (has["resource"] or has["becomes"]):
            other = "resource" if has["resource"] else "becomes"
            message = f"an injection has `set`, or `resource` and `becomes`, and this has `set` and `{other}`"
            self._parts.add(Slug.CONTRADICTION, message, node.key_places[other], "make two injections of it")
        elif has["resource"] and not has["becomes"]:
            remedy = "add for example `becomes: dead`"
            self._parts.add(Slug.MISSING_KEY, "`becomes` is missing in this injection", node.place, remedy)
        elif has["becomes"] and not has["resource"]:
            remedy = "say which resource it acts on: `resource: …`"
            self._parts.add(Slug.MISSING_KEY, "`resource` is missing in this injection", node.place, remedy)
        elif not has["set"] and not has["resource"]:
            remedy = "add `set: {variable: value}`, or `resource: …` and `becomes: …`"
            self._parts.add(Slug.MISSING_KEY, "this injection changes nothing", node.place, remedy)
        if has["set"] and node.items["set"].plain == {}:
            message = "`set` is empty, so this injection changes nothing"
            self._parts.add(Slug.WRONG_SHAPE, message, node.key_places["set"], "write for example `set: {light: red}`")

    def _condition(self, node: YamlNode | None) -> Condition | None:
        if node is None or node.plain is None:
            return None
        slower = node.get("slower")
        if slower is not None:
            factor = self._factor(slower)
            return None if factor is None else Condition(ConditionKind.SLOWER, factor)
        if node.text == ConditionKind.SLOWER.value:
            message = "`slower` needs to know how many times slower"
            self._parts.add(Slug.WRONG_SHAPE, message, node.place, "write for example `{slower: 3}`")
            return None
        word = self._parts.word(node, (*CONDITION_WORDS, ConditionKind.SLOWER.value), "a condition of a resource")
        return None if word is None else Condition(ConditionKind(word))

    def _factor(self, node: YamlNode) -> Fraction | None:
        if node.text is None or node.plain is None:
            return None
        factor = Fraction(node.text) if _FACTOR.fullmatch(node.text) else None
        if factor is not None and factor >= 1:
            return factor
        message = f"`{node.text}` is not a number of times that something can be slower"
        self._parts.add(Slug.BAD_NUMBER, message, node.place, "write a number from 1 to 999999, such as `3` or `1.5`")
        return None

    # contradictions

    def _effects_of(self, injection: Injection, node: YamlNode) -> Iterator[_Effect]:
        assigned = node.get("set")
        for name, value in injection.assign if assigned is not None else ():
            assert assigned is not None  # noqa: S101 - it has items
            target = self._parts.alias(name)
            words = format_value(value)
            yield _Effect(f"variable {target}", f"`{name}`", value, words, injection, assigned.key_places[name])
        if injection.resource is not None and injection.condition is not None:
            target, words = f"resource {injection.resource}", str(injection.condition)
            place = node.key_places["becomes"]
            yield _Effect(target, f"`{injection.resource}`", injection.condition, words, injection, place)

    def _refuse_contradictions(self) -> None:
        """Complains of injections that want different things of one variable or resource at one time."""
        by_target: dict[str, list[_Effect]] = {}
        for effect in self._effects:
            by_target.setdefault(effect.target, []).append(effect)
        for effects in by_target.values():
            self._refuse_same_moment(effects)
            self._refuse_while_held(effects)

    def _refuse_same_moment(self, effects: list[_Effect]) -> None:
        first: dict[tuple[int, str], _Effect] = {}
        for effect in effects:
            other = first.setdefault(effect.moment, effect)
            if other.value != effect.value:
                self._refuse(effect, other, "both act at the same moment")

    def _refuse_while_held(self, effects: list[_Effect]) -> None:
        """Of injections at known times, one must not change what another one still holds."""
        timed = [effect for effect in effects if effect.moment[1] == str(TRUE)]
        timed.sort(key=lambda effect: effect.moment[0])
        holding: _Effect | None = None
        for effect in timed:
            at_ns = effect.moment[0]
            end_ns = holding.hold_end_ns if holding is not None else None
            begun = holding is not None and holding.value != effect.value and holding.moment[0] < at_ns
            if begun and holding is not None and end_ns is not None and at_ns < end_ns:
                self._refuse(effect, holding, f"`{holding.injection.name}` holds it until {format_duration(end_ns)}")
            if end_ns is None or (effect.hold_end_ns or 0) >= end_ns:
                holding = effect

    def _refuse(self, effect: _Effect, other: _Effect, why: str) -> None:
        """Complains at the one that stands later in the file."""
        early, late = sorted((effect, other), key=lambda each: (each.place.line, each.place.column))
        message = (
            f"`{late.injection.name}` makes {late.shown} {late.words}, and `{early.injection.name}` in line "
            f"{early.place.line} makes {early.shown} {early.words}; {why}"
        )
        self._parts.add(Slug.CONTRADICTION, message, late.place, "give them different times, or leave out one of them")
