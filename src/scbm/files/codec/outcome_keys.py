"""The keys of what a case forces on requests: `outcomes`, read into rules and written from them."""

from __future__ import annotations

from heapq import heappop, heappush
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from msgspec.structs import replace

from scbm.cases import LOST, Delivery, OutcomeRule
from scbm.files.codec.key_types import COUNT, TIME, VALUE, NamesType, ScalarOrListType, ScalarType, flow_list
from scbm.files.codec.keys import DefaultKey, Key, Keys, KeyType
from scbm.files.language.quantities import DURATION_PATTERN
from scbm.files.spelling import nearest, suggestion
from scbm.files.yaml.yaml_writer import FlowMapping
from scbm.model import Slug
from scbm.model.durations import format_duration
from scbm.model.resources import Outcome

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.cases.trace import Changes
    from scbm.files.codec.keys import Definitions, ShapeCheck, Spot
    from scbm.files.codec.value_reader import Entry, ValueReader
    from scbm.files.yaml.document import YamlNode

MAX_TIMES = 10_000
"""The maximum number of requests of one element; longer runs are out of reach of a test."""

MAX_COPIES = 10
"""The maximum number of copies of a message that arrive."""

ANY = "any"
"""The outcome of a request that the case leaves open."""

_FEW = 2
"""Up to this number, equal elements in a row are written one by one; more are counted."""

_OUTCOME_WORDS = (*(outcome.value for outcome in Outcome), ANY)


def _read_outcome(reader: ValueReader, node: YamlNode, text: str) -> Outcome | None:
    word = reader.word(node, text, _OUTCOME_WORDS, "an outcome of a request")
    return None if word in (None, ANY) else Outcome(word)


def _read_delivery(reader: ValueReader, node: YamlNode) -> Delivery | None:
    if isinstance(node.plain, list):
        times = [TIME.read(element, reader) for element in node.elements]
        if len(times) > MAX_COPIES:
            message = f"{len(times)} copies of a message are too many: the most is {MAX_COPIES}"
            reader.add(Slug.BAD_NUMBER, message, node.place)
        return tuple(time_ns for time_ns in times if time_ns is not None)
    if node.text == "lost":
        return LOST
    if node.text is not None and nearest(node.text, ["lost"]):
        reader.word(node, node.text, ["lost"], "a way for a message to travel")
        return None
    time_ns = TIME.read(node, reader)
    return None if time_ns is None else (time_ns,)


def _delivery_data(delivery: Delivery) -> str | list[str]:
    times = [format_duration(time_ns) for time_ns in delivery]
    return times if len(times) > 1 else "".join(times) or "lost"


_OUTCOME = ScalarType(
    "outcome", "an outcome such as `fail`", {"enum": list(_OUTCOME_WORDS)}, _read_outcome, lambda outcome: outcome.value
)
_TIMES = ScalarType(
    f"1 to {MAX_TIMES}",
    "a whole number",
    {"type": "integer", "minimum": 1},
    lambda reader, node, text: reader.whole_number(node, text, 1, MAX_TIMES),
)
_DELIVERY = ScalarOrListType(
    f"`lost`, duration, or list of up to {MAX_COPIES} durations",
    "`lost`, a duration, or a list of durations",
    {
        "description": "`lost`, how long it is under way, or that of each copy that arrives.",
        "anyOf": [
            {"const": "lost"},
            {"type": "string", "pattern": DURATION_PATTERN},
            {"type": "array", "items": {"type": "string", "pattern": DURATION_PATTERN}},
        ],
    },
    "a duration such as `10 ms`",
    _read_delivery,
    _delivery_data,
)


def _nothing(_: object) -> None:
    """Return nothing: such a key is written with the element that it counts."""


class OutcomeKeys(Keys):
    """The rule of a case for one request or for several."""

    outcome = Key(
        _OUTCOME, "How the request ends: `succeed`, `fail`, `timeout` (no reply), or `any` (left open).", shown=ANY
    )
    after = Key(
        TIME,
        "The time from the arrival of the request to the reply; not with `timeout`.",
        absent="left open",
        source=lambda rule: None if rule.outcome is Outcome.TIMEOUT else rule.latency_ns,
    )
    measured = Key(
        NamesType(VALUE, "variable → value", in_flow=lambda _: True),
        "What the reply measures: variables that the resource measures. Under the name of an "
        "operation, variables that any resource measures.",
        absent="left open",
        source=lambda rule: None if rule.outcome is Outcome.TIMEOUT else rule.measured,
        always_written=True,
    )
    request = Key(
        _DELIVERY,
        "How the request travels: `lost`, how long, or how long each copy of it.",
        absent="left open",
        always_written=True,
    )
    reply = Key(
        _DELIVERY,
        "How the reply travels; not with `timeout`.",
        absent="left open",
        source=lambda rule: None if rule.outcome is Outcome.TIMEOUT else rule.reply,
        always_written=True,
    )
    cancel = Key(_DELIVERY, "How the cancellation travels.", absent="left open", always_written=True)
    times = DefaultKey(
        _TIMES,
        "To how many requests the element applies; in a list only, and not with `from`.",
        default=1,
        source=_nothing,
    )
    from_ = DefaultKey(
        COUNT,
        "The first request that the element applies to, counted from 1; it applies to all later ones, "
        "too. In a list, only the last element has it.",
        name="from",
        default=1,
        source=_nothing,
    )


_RULE = "an outcome such as `fail`, a mapping such as `{outcome: fail, after: 2 s}`, or a list of them"
_ELEMENT = "an outcome such as `fail`, or a mapping such as `{outcome: fail, after: 2 s}`"


class RuleType(KeyType[OutcomeKeys], frozen=True):
    """An outcome, a mapping, or a list of both: what happens to the requests of one name."""

    words = "rule"

    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Note nothing at all, and what is wrong with the mappings."""
        if isinstance(spot.node.plain, list):
            for element in spot.elements():
                self._check_element(element, check, _ELEMENT)
        else:
            self._check_element(spot, check, _RULE)

    def _check_element(self, spot: Spot, check: ShapeCheck, expected: str) -> None:
        if isinstance(spot.node.plain, dict):
            OutcomeKeys.check(spot, check)
        elif spot.node.plain is None or isinstance(spot.node.plain, list):
            check.wrong_shape(spot, expected)

    def read(self, node: YamlNode, reader: ValueReader) -> OutcomeKeys:
        """Bind the keys to the node, which may be a scalar or a list."""
        return OutcomeKeys(node, reader)

    def write(self, value: object) -> object:
        """Return the stretches of requests as a word, a mapping or a list."""
        stretches: Any = value
        return _rule_data(stretches)

    def schema(self, definitions: Definitions) -> dict[str, Any]:
        """Return the JSON Schema."""
        element = [{"enum": list(_OUTCOME_WORDS)}, definitions.reference(OutcomeKeys)]
        return {"anyOf": [*element, {"type": "array", "items": {"anyOf": element}}]}

    def mappings(self) -> tuple[type[Keys], ...]:
        """Return the mapping that says more than an outcome."""
        return (OutcomeKeys,)


# reading


class RuleReader:
    """Reads the rules of a case for the requests of its model."""

    def __init__(self, reader: ValueReader) -> None:
        self._reader = reader
        self._measures = {resource.name: resource.measures for resource in reader.scope.resources.values()}
        self._operations = reader.scope.operations

    def rules(self, entries: Iterable[Entry[OutcomeKeys]]) -> tuple[OutcomeRule, ...]:
        """Return the rules, in the order of the file; valid only if no error is noted."""
        rules: list[OutcomeRule] = []
        for entry in entries:
            self._check_subject(entry)
            is_list = bool(entry.node.elements)
            read = self._listed if is_list else self._alone
            rules += read(entry.name, OutcomeKeys(entry.node, self._reader))
        return tuple(rules)

    def _check_subject(self, entry: Entry[OutcomeKeys]) -> None:
        subject = entry.name
        if subject in self._measures and subject in self._operations:
            message = f"the model has a resource `{subject}` and an operation `{subject}`"
            self._reader.add(Slug.AMBIGUOUS_SUBJECT, message, entry.place, "rename one of them in the model")
        elif subject not in self._measures and subject not in self._operations:
            remedy = suggestion(subject, dict.fromkeys([*self._measures, *self._operations]), "there are")
            message = f"there is no resource and no operation `{subject}`"
            self._reader.add(Slug.UNKNOWN_RESOURCE, message, entry.place, remedy)

    def _alone(self, subject: str, keys: OutcomeKeys) -> Iterator[OutcomeRule]:
        """Yield a rule that is not in a list: of every request, or of those from a number on."""
        if keys.has("times"):
            message = "`times` is for entries of a list, and this is not one"
            remedy = f"put a `- ` before it: `- {{outcome: …, times: {keys.node.items['times'].text}}}`"
            self._reader.add(Slug.WRONG_SHAPE, message, keys.place("times"), remedy)
        yield from self._rule(subject, keys, keys.from_, None)

    def _listed(self, subject: str, keys: OutcomeKeys) -> Iterator[OutcomeRule]:
        """Yield the rules of the elements of a list."""
        first: int | None = 1
        for element in keys.node.elements:
            rule = OutcomeKeys(element, self._reader)
            if first is None:
                message = "this element never applies: the one before applies to all later requests"
                remedy = "put the element with `from` at the end"
                self._reader.add(Slug.NEVER_COMES, message, element.place, remedy)
                yield from self._rule(subject, rule, 1, 1)  # so that its own errors are noted, too
            elif rule.has("from"):
                yield from self._rule(subject, rule, self._begin(rule, first), None)
                first = None
            else:
                times = rule.times
                yield from self._rule(subject, rule, first, first + times - 1)
                first += times

    def _begin(self, keys: OutcomeKeys, first: int) -> int:
        """Return the request that an element begins with, where the list covers all before `first`."""
        if keys.has("times"):
            message = "`from` applies to all later requests, so `times` has no effect"
            self._reader.add(Slug.CONTRADICTION, message, keys.place("times"), "leave out one of them")
        node = keys.node.items["from"]
        begin = COUNT.read(node, self._reader)
        if begin is not None and begin < first:
            message = (
                f"the list already covers the first {first - 1} requests, and this element begins with request {begin}"
            )
            self._reader.add(Slug.NEVER_COMES, message, node.place, f"write `from: {first}` or more")
        return max(begin or first, first)

    def _rule(self, subject: str, keys: OutcomeKeys, first: int, last: int | None) -> Iterator[OutcomeRule]:
        """Yield the rule of an element; nothing if it leaves all open."""
        is_mapping = isinstance(keys.node.plain, dict)
        outcome = keys.outcome if is_mapping else _OUTCOME.read(keys.node, self._reader)
        rule = OutcomeRule(subject, first, last, outcome)
        if is_mapping:
            self._refuse_contradiction(keys, outcome)
            rule = replace(
                rule,
                latency_ns=keys.after,
                measured=self._measured(subject, keys.measured),
                request=keys.request,
                reply=keys.reply,
                cancel=keys.cancel,
            )
        if rule != OutcomeRule(subject, first, last):
            yield rule

    def _refuse_contradiction(self, keys: OutcomeKeys, outcome: Outcome | None) -> None:
        """Note keys without effect: a request that times out has no reply."""
        silent = ("after", "reply", "measured") if outcome is Outcome.TIMEOUT else ()
        for key in (key for key in silent if keys.has(key)):
            message = f"a request that times out has no reply, so `{key}` has no effect"
            self._reader.add(Slug.CONTRADICTION, message, keys.place(key), f"leave out `{key}`")

    def _measured(self, subject: str, entries: tuple[Entry[YamlNode | None], ...] | None) -> Changes | None:
        if entries is None:
            return None
        measures = [name for names in self._measures.values() for name in names]
        cannot = "no resource measures"
        if subject in self._measures:
            measures, cannot = list(self._measures[subject]), f"`{subject}` does not measure"
        values = []
        for variable, value, entry in self._reader.assignments(entries):
            if variable.name in measures:
                values.append((variable.name, value))
                continue
            near = nearest(variable.name, measures)
            remedy = f"did you mean `{near}`?" if near else _measured_remedy(measures)
            self._reader.add(Slug.UNKNOWN_VARIABLE, f"{cannot} `{variable.name}`", entry.place, remedy)
        return tuple(values)


def _measured_remedy(known: list[str]) -> str:
    return f"it measures: {', '.join(known)}" if known else "leave it out, or add `measures:` to the resource"


# writing


class _Stretch(NamedTuple):
    """Requests in a row to which the same happens.

    Attributes:
        first: the number of the first one.
        last: that of the last one; `None` for all that follow.
        data: what happens to them, as it is written.
    """

    first: int
    last: int | None
    data: dict[str, Any]


def stretches_of(outcomes: Iterable[OutcomeRule]) -> dict[str, list[_Stretch]]:
    """Return for each name with rules its requests in order. Of several rules for one request, the first counts."""
    by_subject: dict[str, list[OutcomeRule]] = {}
    for forced in outcomes:
        by_subject.setdefault(forced.subject, []).append(forced)
    stretches = {subject: list(_stretches(rules)) for subject, rules in by_subject.items()}
    return {subject: found for subject, found in stretches.items() if found}


def _stretches(rules: list[OutcomeRule]) -> Iterator[_Stretch]:
    ends = (rule.last + 1 for rule in rules if rule.last is not None)
    cuts = sorted({rule.first for rule in rules}.union(ends))
    beginning = sorted(range(len(rules)), key=lambda index: rules[index].first, reverse=True)
    current: list[int] = []  # a heap of the rules that have begun, by their position; ended ones are popped late
    for first, end in pairwise([*cuts, None]):
        assert first is not None  # noqa: S101 - it is a cut
        while beginning and rules[beginning[-1]].first == first:
            heappush(current, beginning.pop())
        while current and (rules[current[0]].last or first) < first:
            heappop(current)
        data = OutcomeKeys.write(rules[current[0]]) if current else {}
        if data:
            yield _Stretch(first, None if end is None else end - 1, data)


def _rule_data(stretches: list[_Stretch]) -> Any:  # noqa: ANN401 - a word, a mapping or a list
    first, last, data = stretches[0]
    if last is None:
        return _element_data(data, {"from": first} if first > 1 else {})
    elements: list[Any] = []
    covered = 0
    for stretch in _counted(stretches):
        if stretch.last is None:
            elements.append(_element_data(stretch.data, {"from": stretch.first}))
            break
        elements += _repeated({}, stretch.first - covered - 1, few=_FEW)
        elements += _repeated(stretch.data, stretch.last - stretch.first + 1, few=1)
        covered = stretch.last
    return flow_list(elements) if all(isinstance(element, str) for element in elements) else elements


def _counted(stretches: list[_Stretch]) -> Iterator[_Stretch]:
    """Yield the same stretches, where more than a few equal ones of a single request are joined."""
    row: list[_Stretch] = []
    for stretch in stretches:
        if row and not (stretch.first == stretch.last == row[-1].first + 1 and stretch.data == row[-1].data):
            yield from _joined(row)
            row = []
        if stretch.first == stretch.last:
            row.append(stretch)
        else:
            yield stretch
    yield from _joined(row)


def _joined(row: list[_Stretch]) -> list[_Stretch]:
    return row if len(row) <= _FEW else [_Stretch(row[0].first, row[-1].last, row[0].data)]


def _repeated(data: dict[str, Any], times: int, few: int) -> Iterator[Any]:
    """Yield equal elements for so many requests; up to a few of them are written one by one."""
    if times <= few:
        yield from [_element_data(data, {})] * times
        return
    for written in range(0, times, MAX_TIMES):
        part = min(MAX_TIMES, times - written)
        yield _element_data(data, {"times": part} if part > 1 else {})


def _element_data(data: dict[str, Any], requests: dict[str, int]) -> str | dict[str, Any]:
    """Return an element: a word if there is only an outcome."""
    data = data or {"outcome": ANY}
    if not requests and data.keys() == {"outcome"}:
        return str(data["outcome"])
    return FlowMapping(data | requests)
