"""The keys of the injections of a case: what the tester changes.

Injections of one case must not contradict each other.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction
from functools import cache
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from scbm.cases import CONDITIONS, Condition, ConditionKind, EnvironmentChange, Injection
from scbm.cases.trace import NETWORK, SENT
from scbm.files.codec.key_types import (
    CASE_NAME_TYPE,
    NAME_NODE,
    RESOURCE_NAME,
    TIME,
    VALUE,
    NamesType,
    ScalarOrMappingType,
    ScalarType,
    is_short,
    predicate_type,
)
from scbm.files.codec.keys import Key, Keys
from scbm.files.language.quantities import format_decimal
from scbm.files.language.scope import Where
from scbm.model import Slug
from scbm.model.durations import format_duration
from scbm.model.predicates import TRUE, Predicate
from scbm.model.values import Value, format_value

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases.trace import Changes
    from scbm.files.codec.keys import ShapeCheck, Spot
    from scbm.files.codec.value_reader import ValueReader
    from scbm.files.yaml.document import YamlNode
    from scbm.model import BehaviorModel, Place


MAX_INJECTIONS = 1_000
"""The maximum number of injections of a case."""

_FACTOR = re.compile(r"\d{1,6}(\.\d{1,6})?", re.ASCII)


def _read_factor(reader: ValueReader, node: YamlNode, text: str) -> Fraction | None:
    factor = Fraction(text) if _FACTOR.fullmatch(text) else None
    if factor is not None and factor >= 1:
        return factor
    message = f"`{text}` is not a factor from 1 to 999999"
    reader.add(Slug.BAD_NUMBER, message, node.place, "write for example `3` or `1.5`")
    return None


_FACTOR_TYPE = ScalarType(
    "number",
    "a number such as `3`",
    {"type": "number", "minimum": 1},
    _read_factor,
    lambda factor: int(factor) if factor.denominator == 1 else float(format_decimal(factor)),
)


@cache
def _factor_key(kind: ConditionKind, *, required: bool) -> Key[Fraction]:
    """Return the key of a condition with a factor."""

    def factor_of(condition: Condition) -> Fraction | None:
        return condition.factor if condition.kind is kind else None

    key = Key(_FACTOR_TYPE, kind.factor_help, required=required, source=factor_of)
    key.__set_name__(ConditionKeys, kind.value)
    return key


class FactorKeys(Mapping[str, Key[Fraction]]):
    """The keys of conditions with a factor by name: those of `CONDITIONS`, read each time."""

    def __getitem__(self, name: str) -> Key[Fraction]:
        """Return the key of a condition."""
        kind = CONDITIONS[name]
        if not kind.has_factor:
            raise KeyError(name)
        return _factor_key(kind, required=len(self) == 1)

    def __iter__(self) -> Iterator[str]:
        """Yield the names of the conditions with a factor."""
        return (name for name, kind in CONDITIONS.items() if kind.has_factor)

    def __len__(self) -> int:
        """Return the number of conditions with a factor."""
        return sum(1 for _ in self)


class ConditionKeys(Keys):
    """A condition of a resource with a number."""

    in_flow = True
    declared = FactorKeys()

    @classmethod
    def check(cls, spot: Spot, check: ShapeCheck) -> None:
        """Note also a mapping without a condition, or with several."""
        super().check(spot, check)
        if len(spot.node.items.keys() & cls.declared.keys()) != 1 and len(cls.declared) > 1:
            check.wrong_shape(spot, "a mapping with one condition", f"the conditions are: {', '.join(cls.declared)}")

    def condition(self) -> Condition | None:
        """Return the condition that a word or a mapping describes."""
        node = self.node
        for name in self.declared:
            if self.has(name):
                factor: Fraction | None = self.value_of(name)
                return None if factor is None else Condition(CONDITIONS[name], factor)
        if node.text is None or node.plain is None:
            return None
        word = self.reader.word(node, node.text, tuple(CONDITIONS), "a condition of a resource")
        if word is None:
            return None
        if CONDITIONS[word].has_factor:
            message = f"`{word}` needs a factor"
            self.reader.add(Slug.WRONG_SHAPE, message, node.place, f"write for example `{{{word}: 3}}`")
            return None
        return Condition(CONDITIONS[word])


def _condition_data(condition: Condition) -> str | dict[str, Any]:
    return ConditionKeys.write(condition) if condition.kind.has_factor else condition.kind.value


_CONDITION = ScalarOrMappingType(
    ConditionKeys,
    "condition",
    "a condition such as `dead`, or `{slower: 3}`",
    {"enum": [name for name, kind in CONDITIONS.items() if not kind.has_factor]},
    _condition_data,
)


class InjectionKeys(Keys):
    """A change that the tester makes once during the run: `set`, or `resource` with `becomes`."""

    name = Key(
        CASE_NAME_TYPE,
        "What the trace calls the injection; unique, and not `network`.",
        absent="`injection_1`, … by its place in the list",
        source=lambda injection: injection.name or None,
    )
    when: Key[Predicate] = Key(
        predicate_type(Where.GUARD),
        "The injection acts as soon as this holds; a predicate as in a guard.",
        shown=True,
        source="when",
    )
    after = Key(
        TIME,
        "The injection acts this long after `when` became true, whether `when` still holds or not.",
        absent="`0 s`",
        source="after_ns",
    )
    at = Key(TIME, "The injection does not act before this time of the run.", absent="`0 s`", source="at_ns")
    set = Key(
        NamesType(VALUE, "variable → value", is_short),
        "Variables and their new values, such as an automatic transition may assign; not empty.",
        source="assign",
    )
    resource = Key(RESOURCE_NAME, "The resource whose condition changes, instead of `set`.", source="resource")
    becomes = Key(
        _CONDITION,
        "The new condition of the resource: `occupied`, `dead`, `failing`, `{slower: 3}`, or `well`.",
        source="condition",
    )
    hold = Key(
        TIME,
        "After this time, the injection restores the variables that nothing else has changed since.",
        absent="not restored",
        source="hold_ns",
    )

    def injection(self, name: str) -> Injection:
        """Return the injection under a name; valid only if no error is noted."""
        if self.is_clear:
            self._check_combination()
        return Injection(
            name,
            self._assigned(),
            self.when,
            self.at,
            self.hold,
            None if self.resource is None else self.resource.name,
            None if self.becomes is None else self.becomes.condition(),
            self.after,
        )

    def _check_combination(self) -> None:
        """Note that an injection does not set variables, and does not change the condition of a resource either."""
        add, node = self.reader.add, self.node
        has_set, has_resource, has_becomes = self.has("set"), self.has("resource"), self.has("becomes")
        if has_set and (has_resource or has_becomes):
            other = "resource" if has_resource else "becomes"
            message = f"an injection has `set`, or `resource` and `becomes`, and this has `set` and `{other}`"
            add(Slug.CONTRADICTION, message, self.place(other), "make two injections of it")
        elif has_resource and not has_becomes:
            remedy = "add for example `becomes: dead`"
            add(Slug.MISSING_KEY, "`becomes` is missing in this injection", node.place, remedy)
        elif has_becomes and not has_resource:
            remedy = "say which resource it acts on: `resource: …`"
            add(Slug.MISSING_KEY, "`resource` is missing in this injection", node.place, remedy)
        elif not has_set and not has_resource:
            remedy = "add `set: {variable: value}`, or `resource: …` and `becomes: …`"
            add(Slug.MISSING_KEY, "this injection changes nothing", node.place, remedy)
        if self.has("after") and not self.has("when"):
            message = "`after` counts from when `when` became true, and this injection has no `when`"
            add(Slug.MISSING_KEY, message, self.place("after"), "add `when: …`, or write `at` in place of `after`")
        if has_set and node.items["set"].plain == {}:
            message = "`set` is empty, so this injection changes nothing"
            add(Slug.WRONG_SHAPE, message, self.place("set"), "write for example `set: {light: red}`")

    def _assigned(self) -> Changes:
        """Return the values of the variables under `set`, all of which an automatic transition may assign."""
        values: dict[str, tuple[str, Value]] = {}
        for variable, value, entry in self.reader.assignments(self.set):
            target = self.reader.alias(variable.name)
            if not variable.assignable:
                message = f"`{variable.name}` is kept by the runner, and a case cannot assign it"
                self.reader.add(Slug.NOT_ASSIGNABLE, message, entry.place)
            elif variable.role.is_runner and value not in variable.assignable:
                allowed = " or ".join(f"`{format_value(allowed)}`" for allowed in variable.assignable)
                message = f"a case may assign only {allowed} to `{variable.name}`"
                self.reader.add(Slug.NOT_ASSIGNABLE, message, entry.node.place)
            elif target in values:
                message = f"`{variable.name}` is assigned twice; an injection sets all its variables at once"
                self.reader.add(Slug.ASSIGNED_TWICE, message, entry.place, f"the other is `{values[target][0]}`")
            else:
                values[target] = (variable.name, value)
        return tuple(values.values())


# what the environment does


class EnvironmentChangeKeys(Keys):
    """A change from outside at a settled moment: `at` a time, or `when` a predicate has held for some time."""

    in_flow = True

    at = Key(TIME, "The time of the run.", absent="`when`", source="at_ns")
    when: Key[Predicate] = Key(
        predicate_type(Where.GUARD),
        "The change comes as soon as this holds, once the change before it has come; instead of `at`.",
        absent="`at`",
        source="when",
    )
    after = Key(
        TIME,
        "The change comes this long after `when` became true, whether `when` still holds or not.",
        absent="`0 s`",
        source=lambda change: change.after_ns or None,
    )
    by = Key(
        NAME_NODE,
        "The environment transition that makes the change; its guard has to hold then.",
        absent="anything that can make it",
        source=lambda change: change.by or None,
    )
    set = Key(
        NamesType(VALUE, "variable → value", is_short),
        "The variables that change, with their new values; empty for nothing but the end of a wait.",
        absent="what the actions of `by` make",
        source="assign",
        always_written=True,
    )

    def change(self, model: BehaviorModel, known: Mapping[str, tuple[Value, ...]]) -> EnvironmentChange:
        """Return the change; valid only if no error is noted.

        Args:
            model: the model.
            known: for each variable that changes from outside the values that it can get there.
        """
        if self.is_clear:
            self._check_combination()
        if self.by is not None:
            transitions = [each.name for each in model.environment]
            self.reader.word(self.by, self.by.text or "", transitions, "an environment transition of the model")
        name = "" if self.by is None else self.by.text or ""
        values = None if self.set is None else self._values(known)
        return EnvironmentChange(self.at if self.when is None else None, values, name, self.when, self.after or 0)

    def _check_combination(self) -> None:
        """Note a change without a moment, or with two, and one that says nothing about what changes."""
        add, node = self.reader.add, self.node
        if self.has("at") and self.has("when"):
            message = "a change has `at` or `when`, and this has both"
            add(Slug.CONTRADICTION, message, self.place("when"), "to wait after `when`, write `after` instead of `at`")
        elif not self.has("at") and not self.has("when"):
            remedy = "add `at: 2 s`, or `when: PREDICATE`"
            add(Slug.MISSING_KEY, "`at` or `when` is missing in this change", node.place, remedy)
        if self.has("after") and not self.has("when"):
            message = "`after` counts from when `when` became true, and this change has no `when`"
            add(Slug.MISSING_KEY, message, self.place("after"), "add `when: …`, or write `at` in place of `after`")
        if not self.has("set") and not self.has("by"):
            remedy = "add `set: {variable: value}`, or `by: TRANSITION`"
            add(Slug.MISSING_KEY, "`set` is missing in this change", node.place, remedy)

    def _values(self, known: Mapping[str, tuple[Value, ...]]) -> Changes:
        values = []
        for variable, value, entry in self.reader.assignments(self.set):
            if variable.name not in known:
                message = f"nothing outside the model changes `{variable.name}`"
                remedy = "use an injection, or declare `source: input` for it"
                self.reader.add(Slug.NOT_ASSIGNABLE, message, entry.place, remedy)
            elif value not in known[variable.name]:
                message = f"no resource sends {format_value(value)} for `{variable.name}`"
                remedy = f"it can get {', '.join(map(format_value, known[variable.name]))}"
                self.reader.add(Slug.VALUE_OUTSIDE_DOMAIN, message, entry.node.place, remedy)
            else:
                values.append((variable.name, value))
        return tuple(values)


# all injections of a case


class _InjectedValue(Struct, frozen=True):
    """A value that an injection gives to a variable or a resource.

    Attributes:
        target: what gets the value; one name for all that stands for one thing.
        shown: the same, as messages call it.
        value: the value.
        words: the same, as it is written.
        injection: which injection.
        place: where the target stands in the file.
    """

    target: str
    shown: str
    value: Value | Condition
    words: str
    injection: Injection
    place: Place

    @property
    def moment(self) -> tuple[int, str, int]:
        """When the injection acts: not before a time, when a predicate holds, and how long after that."""
        return self.injection.at_ns or 0, str(self.injection.when or TRUE), self.injection.after_ns or 0

    @property
    def hold_end_ns(self) -> int | None:
        """Until when the value is held, if that is a known time."""
        at_ns, when, after_ns = self.moment
        hold_ns = self.injection.hold_ns
        return None if hold_ns is None or when != str(TRUE) else at_ns + after_ns + hold_ns


class InjectionsReader:
    """Reads all injections of a case, and notes those that contradict each other."""

    def __init__(self, reader: ValueReader) -> None:
        self._reader = reader
        self._injected: list[_InjectedValue] = []
        self._places: dict[str, Place] = {}

    def injections(self, elements: Sequence[InjectionKeys]) -> tuple[Injection, ...]:
        """Return the injections, in the order of the file; valid only if no error is noted."""
        if len(elements) > MAX_INJECTIONS:
            message = f"{len(elements)} injections are too many: the most is {MAX_INJECTIONS}"
            self._reader.add(Slug.BAD_NUMBER, message, elements[MAX_INJECTIONS].node.place)
            return ()
        built = []
        for number, keys in enumerate(elements, start=1):
            injection = keys.injection(self._name(number, keys))
            self._injected += self._values_of(injection, keys)
            built.append(injection)
        self._refuse_contradictions()
        return tuple(built)

    def _name(self, number: int, keys: InjectionKeys) -> str:
        written = keys.node.get("name")
        if written is not None and keys.name is None:
            return f"injection_{number}"
        name = keys.name or f"injection_{number}"
        place = keys.node.place if written is None else written.place
        if name in (NETWORK, SENT):
            self._reader.add(Slug.RESERVED_NAME, f"`{name}` is a reserved word", place, "choose another name")
        if name in self._places:
            message = f"two injections are called `{name}`, the other in line {self._places[name].line}"
            self._reader.add(Slug.DUPLICATE_NAME, message, place, "choose another name")
        self._places.setdefault(name, place)
        return name

    # contradictions

    def _values_of(self, injection: Injection, keys: InjectionKeys) -> Iterator[_InjectedValue]:
        places = {entry.name: entry.place for entry in keys.set or ()}
        for name, value in injection.assign:
            target, place = self._reader.alias(name), places[name]
            yield _InjectedValue(f"variable {target}", f"`{name}`", value, format_value(value), injection, place)
        if injection.resource is not None and injection.condition is not None:
            target, condition = f"resource {injection.resource}", injection.condition
            shown, place = f"`{injection.resource}`", keys.place("becomes")
            yield _InjectedValue(target, shown, condition, str(condition), injection, place)

    def _refuse_contradictions(self) -> None:
        """Note injections that give one variable or resource different values at one time."""
        by_target: dict[str, list[_InjectedValue]] = {}
        for injected in self._injected:
            by_target.setdefault(injected.target, []).append(injected)
        for values in by_target.values():
            self._refuse_same_moment(values)
            self._refuse_while_held(values)

    def _refuse_same_moment(self, values: list[_InjectedValue]) -> None:
        first: dict[tuple[int, str, int], _InjectedValue] = {}
        for injected in values:
            other = first.setdefault(injected.moment, injected)
            if other.value != injected.value:
                self._refuse(injected, other, "both act at the same moment")

    def _refuse_while_held(self, values: list[_InjectedValue]) -> None:
        """Note an injection at a known time that changes a value while another one holds it."""
        timed = [injected for injected in values if injected.moment[1:] == (str(TRUE), 0)]
        timed.sort(key=lambda injected: injected.moment[0])
        holding: _InjectedValue | None = None
        for injected in timed:
            at_ns = injected.moment[0]
            end_ns = holding.hold_end_ns if holding is not None else None
            begun = holding is not None and holding.value != injected.value and holding.moment[0] < at_ns
            if begun and holding is not None and end_ns is not None and at_ns < end_ns:
                self._refuse(injected, holding, f"`{holding.injection.name}` holds it until {format_duration(end_ns)}")
            if end_ns is None or (injected.hold_end_ns or 0) >= end_ns:
                holding = injected

    def _refuse(self, injected: _InjectedValue, other: _InjectedValue, why: str) -> None:
        """Note a contradiction at the injection that stands later in the file."""
        early, late = sorted((injected, other), key=lambda each: (each.place.line, each.place.column))
        message = (
            f"`{late.injection.name}` makes {late.shown} {late.words}, and `{early.injection.name}` in line "
            f"{early.place.line} makes {early.shown} {early.words}; {why}"
        )
        remedy = "give them different times, or leave out one of them"
        self._reader.add(Slug.CONTRADICTION, message, late.place, remedy)
