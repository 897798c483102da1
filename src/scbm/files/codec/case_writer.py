"""From a test case to a text that the loader reads as the same case."""

from __future__ import annotations

from heapq import heappop, heappush
from itertools import chain, pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from scbm.cases import CaseLimits, ConditionKind, Network
from scbm.files.codec.case_words import ANY
from scbm.files.codec.outcome_builder import MAX_TIMES
from scbm.files.language.quantities import format_decimal, format_share
from scbm.files.yaml.yaml_writer import FlowList, FlowMapping, dump
from scbm.model import Outcome, Truth, format_duration, format_value

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.cases import Case, Condition, Delivery, Expectations, Forced, Injection, Origin, Recorded
    from scbm.model import BehaviorModel, Predicate, Value

_MAX_COLUMNS = 100
"""A list or a mapping on one line is about so long at most."""

_FEW = 2
"""So many equal elements in a row are written one by one; more are counted."""


def write_case(case: Case, model: BehaviorModel, model_path: str | None, comment: Sequence[str] = ()) -> str:
    """The case as YAML, with every key that says more than its default.

    What cannot come of a request is left out: the reply of one that times out, and what is measured by one that fails.
    Where several rules of a name speak of one request, the first is written. Equal ones in a row are counted.

    Args:
        case: the case.
        model: the model that it is for.
        model_path: where that is, seen from the directory of the file that the text is for.
        comment: lines that stand above.
    """
    optional: dict[str, Any] = {
        "initial": _mapping({n: v for n, v in case.initial.items() if v != model.nominal_state[n]}),
        "outcomes": _outcomes(case.outcomes),
        "injections": [_injection(injection, number) for number, injection in enumerate(case.injections, start=1)],
        "network": _network(case.network),
        "limits": _limits(case.limits),
        "requirements": {requirement.name: str(requirement.sentence) for requirement in case.requirements},
        "expect": _expectations(case.expect),
        "drawn": _origin(case.origin),
        "recorded": _recorded(case.recorded),
    }
    said: dict[str, Any] = {"case": case.name}
    if model_path is not None:
        said["model"] = model_path
    said["goal"] = case.goal if model.goal(case.goal) == case.predicate else _predicate(case.predicate)
    text = dump(said | {key: value for key, value in optional.items() if value})
    lines = chain.from_iterable(words.splitlines() or [""] for words in comment)
    return "".join(f"{_comment(line)}\n" for line in lines) + text


def write_network(network: Network) -> str:
    """The network as `read_network` reads it: on one line, without braces."""
    return dump(FlowMapping(_network(network))).strip().removeprefix("{").removesuffix("}")


def _comment(line: str) -> str:
    shown = "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in line)
    return f"# {shown}".rstrip()


def _mapping(values: dict[str, Value]) -> dict[str, Any]:
    columns = sum(len(name) + len(format_value(value)) + 4 for name, value in values.items())
    return FlowMapping(values) if columns <= _MAX_COLUMNS else values


def _list(words: Iterable[str]) -> list[Any]:
    listed = list(words)
    return FlowList(listed) if sum(len(word) + 2 for word in listed) <= _MAX_COLUMNS else listed


def _predicate(predicate: Predicate) -> bool | str:
    return predicate.truth if isinstance(predicate, Truth) else str(predicate)


# outcomes


class _Stretch(NamedTuple):
    """Requests of which one thing is said: from a first to a last one, or for ever."""

    first: int
    last: int | None
    said: dict[str, Any]


def _outcomes(outcomes: Iterable[Forced]) -> dict[str, Any]:
    by_subject: dict[str, list[Forced]] = {}
    for forced in outcomes:
        by_subject.setdefault(forced.subject, []).append(forced)
    stretches = {subject: list(_stretches(rules)) for subject, rules in by_subject.items()}
    return {subject: _rule(told) for subject, told in stretches.items() if told}


def _stretches(rules: list[Forced]) -> Iterator[_Stretch]:
    """What the rules of one name say, in the order of its requests; of several for one request, the first."""
    ends = (rule.last + 1 for rule in rules if rule.last is not None)
    cuts = sorted({rule.first for rule in rules}.union(ends))
    beginning = sorted(range(len(rules)), key=lambda index: rules[index].first, reverse=True)
    speaking: list[int] = []  # a heap of the rules that have begun, by their place; those that are over go as they come
    for first, end in pairwise([*cuts, None]):
        assert first is not None  # noqa: S101 - it is a cut
        while beginning and rules[beginning[-1]].first == first:
            heappush(speaking, beginning.pop())
        while speaking and (rules[speaking[0]].last or first) < first:
            heappop(speaking)
        said = _said(rules[speaking[0]]) if speaking else {}
        if said:
            yield _Stretch(first, None if end is None else end - 1, said)


def _said(rule: Forced) -> dict[str, Any]:
    """What a rule says, but for the requests that it speaks of."""
    replies = rule.outcome is not Outcome.TIMEOUT
    measures = rule.outcome in (None, Outcome.SUCCEED)
    said = {
        "outcome": None if rule.outcome is None else rule.outcome.value,
        "after": format_duration(rule.latency_ns) if rule.latency_ns is not None and replies else None,
        "measured": FlowMapping(rule.measured) if rule.measured is not None and measures else None,
        "request": _delivery(rule.request),
        "reply": _delivery(rule.reply) if replies else None,
        "cancel": _delivery(rule.cancel),
    }
    return {key: value for key, value in said.items() if value is not None}


def _delivery(delivery: Delivery | None) -> str | list[str] | None:
    if delivery is None:
        return None
    times = [format_duration(time_ns) for time_ns in delivery]
    return times if len(times) > 1 else "".join(times) or "lost"


def _rule(stretches: list[_Stretch]) -> Any:  # noqa: ANN401 - a word, a mapping or a list
    first, last, said = stretches[0]
    if last is None:
        return _element(said, {"from": first} if first > 1 else {})
    elements: list[Any] = []
    told = 0
    for stretch in _counted(stretches):
        if stretch.last is None:
            elements.append(_element(stretch.said, {"from": stretch.first}))
            break
        elements += _repeated({}, stretch.first - told - 1, few=_FEW)
        elements += _repeated(stretch.said, stretch.last - stretch.first + 1, few=1)
        told = stretch.last
    return _list(elements) if all(isinstance(element, str) for element in elements) else elements


def _counted(stretches: list[_Stretch]) -> Iterator[_Stretch]:
    """The same, where more than a few single requests in a row of which the same is said are one stretch."""
    row: list[_Stretch] = []
    for stretch in stretches:
        if row and not (stretch.first == stretch.last == row[-1].first + 1 and stretch.said == row[-1].said):
            yield from _joined(row)
            row = []
        if stretch.first == stretch.last:
            row.append(stretch)
        else:
            yield stretch
    yield from _joined(row)


def _joined(row: list[_Stretch]) -> list[_Stretch]:
    return row if len(row) <= _FEW else [_Stretch(row[0].first, row[-1].last, row[0].said)]


def _repeated(said: dict[str, Any], times: int, few: int) -> Iterator[Any]:
    """Elements that say the same of so many requests; up to a few of them are written one by one."""
    if times <= few:
        yield from [_element(said, {})] * times
        return
    for told in range(0, times, MAX_TIMES):
        part = min(MAX_TIMES, times - told)
        yield _element(said, {"times": part} if part > 1 else {})


def _element(said: dict[str, Any], requests: dict[str, int]) -> str | dict[str, Any]:
    """What is said of some requests: a word if that is all."""
    said = said or {"outcome": ANY}
    if not requests and said.keys() == {"outcome"}:
        return str(said["outcome"])
    return FlowMapping(said | requests)


# injections and network


def _injection(injection: Injection, number: int) -> dict[str, Any]:
    written: dict[str, Any] = {} if injection.name == f"injection_{number}" else {"name": injection.name}
    if injection.when is not None:
        written["when"] = _predicate(injection.when)
    if injection.at_ns is not None:
        written["at"] = format_duration(injection.at_ns)
    if injection.assign:
        written["set"] = _mapping(dict(injection.assign))
    if injection.resource is not None:
        written["resource"] = injection.resource
    if injection.condition is not None:
        written["becomes"] = _condition(injection.condition)
    if injection.hold_ns is not None:
        written["hold"] = format_duration(injection.hold_ns)
    return written


def _condition(condition: Condition) -> str | dict[str, Any]:
    if condition.kind is not ConditionKind.SLOWER:
        return condition.kind.value
    factor = condition.factor
    return FlowMapping(slower=int(factor) if factor.denominator == 1 else float(format_decimal(factor)))


def _network(network: Network) -> dict[str, Any]:
    plain = Network()
    durations = ("latency", "jitter", "held_back")
    lengths = {key: (getattr(network, f"{key}_ns"), getattr(plain, f"{key}_ns")) for key in durations}
    said: dict[str, Any] = {key: format_duration(ns) for key, (ns, plain_ns) in lengths.items() if ns != plain_ns}
    shares = {"loss": network.loss, "duplication": network.duplication, "reordering": network.reordering}
    said |= {key: format_share(share) for key, share in shares.items() if share}
    said["partitions"] = [
        _fault(partition.at_ns, partition.for_ns, partition.resource) for partition in network.partitions
    ]
    said["restarts"] = [_fault(restart.at_ns, restart.for_ns or None, restart.resource) for restart in network.restarts]
    return {key: said[key] for key in _NETWORK_KEYS if said.get(key)}


_NETWORK_KEYS = ("latency", "jitter", "loss", "duplication", "reordering", "held_back", "partitions", "restarts")


def _fault(at_ns: int, for_ns: int | None, resource: str | None) -> dict[str, Any]:
    said = {} if resource is None else {"resource": resource}
    said["at"] = format_duration(at_ns)
    return FlowMapping(said if for_ns is None else said | {"for": format_duration(for_ns)})


# what must come of it, and where it comes from


def _limits(limits: CaseLimits) -> dict[str, Any]:
    said: dict[str, Any] = {} if limits.time_ns is None else {"time": format_duration(limits.time_ns)}
    return said if limits.plans is None else said | {"plans": limits.plans}


def _expectations(expect: Expectations) -> dict[str, Any]:
    said: dict[str, Any] = {} if expect.verdict is None else {"verdict": expect.verdict.value}
    if expect.plan is not None:
        said["plan"] = _list(expect.plan)
    if expect.order:
        said["order"] = _list(expect.order)
    if expect.final:
        final = [_predicate(predicate) for predicate in expect.final]
        said["final"] = final[0] if len(final) == 1 else final
    if expect.visits:
        said["visits"] = _list(str(obligation) for obligation in expect.visits)
    return said


def _origin(origin: Origin | None) -> dict[str, Any]:
    if origin is None:
        return {}
    return FlowMapping(seed=origin.seed) if origin.number == 1 else FlowMapping(seed=origin.seed, case=origin.number)


def _recorded(recorded: Recorded | None) -> dict[str, Any]:
    return {} if recorded is None else {"end": recorded.end, "trace": recorded.trace}
