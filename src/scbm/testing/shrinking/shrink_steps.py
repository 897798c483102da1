"""The steps of shrinking: each yields smaller or simpler cases to try in place of a failing one.

A step knows nothing of what a case does. It leaves something out, or puts something plainer in its place; whether the
case still fails is found out by running it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, cast

from msgspec.structs import replace

from scbm.cases import Network, WindowFault
from scbm.model import And
from scbm.testing.shrinking.case_sizes import MESSAGES, RULE_FIELDS, can_be_left_out

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from scbm.cases import Case, EnvironmentChange, FaultWindow, Injection, OutcomeRule
    from scbm.model import BehaviorModel, Predicate

_Part = TypeVar("_Part")

Step: TypeAlias = "Callable[[Case, BehaviorModel], Iterator[Case]]"


def _plainest(case: Case, _: BehaviorModel) -> Iterator[Case]:
    yield replace(case, outcomes=(), injections=(), network=Network())
    yield replace(case, outcomes=())
    yield replace(case, injections=())
    yield replace(case, network=Network())
    if case.environment:
        yield replace(case, environment=())


def _without_parts(case: Case, model: BehaviorModel) -> Iterator[Case]:
    """Leave out injections, faults or forced outcomes: first half of them, in the end one."""
    for kept in _fewer(case.injections):
        yield replace(case, injections=kept)
    for fault, value in case.network.faults():
        for kept_windows in _fewer(value) if isinstance(fault, WindowFault) else ():
            yield replace(case, network=case.network.with_value(fault, kept_windows))
    yield from without_changes(case, model)
    for kept_rules in _fewer(case.outcomes):
        yield replace(case, outcomes=kept_rules)


def without_changes(case: Case, model: BehaviorModel) -> Iterator[Case]:
    """Leave out changes from outside: all of the same variables, pairs of these, and single ones; long slices first.

    A gate that opens and closes makes pairs: without one change of a pair the next one is impossible.
    """
    changes = case.environment or ()
    groups: dict[tuple[str, ...], list[int]] = {}
    for index, change in enumerate(changes):
        groups.setdefault(_assigned(change, model), []).append(index)
    for group in groups.values():
        yield replace(case, environment=_at_others(changes, group))
    for group in groups.values():
        for first in (0, 1):
            pairs = tuple(zip(group[first::2], group[first + 1 :: 2], strict=False))
            for kept_pairs in _fewer(pairs):
                left_out = [index for pair in pairs if pair not in kept_pairs for index in pair]
                yield replace(case, environment=_at_others(changes, left_out))
    for kept_changes in _fewer(changes):
        yield replace(case, environment=kept_changes)


def _at_others(parts: tuple[_Part, ...], left_out: list[int]) -> tuple[_Part, ...]:
    """Return the parts without those at some indices."""
    gone = dict.fromkeys(left_out)
    return tuple(part for index, part in enumerate(parts) if index not in gone)


def _assigned(change: EnvironmentChange, model: BehaviorModel) -> tuple[str, ...]:
    """Return the variables that a change assigns, in alphabetical order."""
    if change.assign is not None:
        return tuple(sorted(name for name, _ in change.assign))
    maker = (each.actions for each in model.environment if each.name == change.by)
    return tuple(sorted({action.target for actions in maker for action in actions}))


def _without_planning_time(case: Case, _: BehaviorModel) -> Iterator[Case]:
    """Let plans take no time."""
    if case.planning_ns:
        yield replace(case, planning_ns=0)


def _fewer(parts: tuple[_Part, ...]) -> Iterator[tuple[_Part, ...]]:
    """Yield the parts without a slice of them, long slices first."""
    length = len(parts)
    while length:
        for begin in range(0, len(parts), length):
            yield parts[:begin] + parts[begin + length :]
        length //= 2


def _plainer_rules(case: Case, _: BehaviorModel) -> Iterator[Case]:
    """Leave out one field of a rule."""
    for index, rule in enumerate(case.outcomes):
        for field in RULE_FIELDS:
            if getattr(rule, field) is not None:
                left_out: dict[str, Any] = {field: None}
                yield replace(case, outcomes=_replaced(case.outcomes, index, replace(rule, **left_out)))


def _earlier_rules(case: Case, _: BehaviorModel) -> Iterator[Case]:
    """Move the rule of one request to an earlier one, and drop the rules between."""
    for rule in case.outcomes:
        if rule.first != rule.last:
            continue
        for number in dict.fromkeys((1, rule.first // 2, rule.first - 1)):
            if 0 < number < rule.first:
                moved = replace(rule, first=number, last=number)
                kept = [other for other in case.outcomes if not _lies_between(other, number, rule)]
                yield replace(case, outcomes=tuple(sorted((*kept, moved), key=lambda r: (r.subject, r.first))))


def _rounder_latencies(case: Case, _: BehaviorModel) -> Iterator[Case]:
    for index, rule in enumerate(case.outcomes):
        for rounder in _rounder_rule(rule):
            yield replace(case, outcomes=_replaced(case.outcomes, index, rounder))


def _rounder_rule(rule: OutcomeRule) -> Iterator[OutcomeRule]:
    for latency_ns in _rounder(rule.latency_ns or 0):
        yield replace(rule, latency_ns=latency_ns)
    for field in MESSAGES:
        for copy, delay_ns in enumerate(getattr(rule, field) or ()):
            for rounded_ns in _rounder(delay_ns):
                changed: dict[str, Any] = {field: _replaced(getattr(rule, field), copy, rounded_ns)}
                yield replace(rule, **changed)


def _lies_between(other: OutcomeRule, number: int, rule: OutcomeRule) -> bool:
    """Return whether a rule speaks of requests from `number` up to that of `rule`."""
    return other.subject == rule.subject and other.first <= rule.first and (other.last or number) >= number


def _plainer_injections(case: Case, _: BehaviorModel) -> Iterator[Case]:
    for index, injection in enumerate(case.injections):
        for plainer in _plainer(injection):
            yield replace(case, injections=_replaced(case.injections, index, plainer))


def _plainer(injection: Injection) -> Iterator[Injection]:
    if injection.hold_ns is not None:
        yield replace(injection, hold_ns=None)
    if injection.at_ns is not None:
        yield replace(injection, at_ns=None)
    if injection.after_ns is not None:
        yield replace(injection, after_ns=None)
    if injection.when is not None:
        yield replace(injection, when=None, after_ns=None)
    if len(injection.assign) > 1:
        for kept in _fewer(injection.assign):
            if kept:
                yield replace(injection, assign=kept)
    for at_ns in _rounder(injection.at_ns or 0):
        yield replace(injection, at_ns=at_ns or None)
    for after_ns in _rounder(injection.after_ns or 0):
        yield replace(injection, after_ns=after_ns or None)


def _computed_changes(case: Case, _: BehaviorModel) -> Iterator[Case]:
    """Let environment transitions say what they change."""
    changes = case.environment or ()
    computed = tuple(replace(change, assign=None) if change.by else change for change in changes)
    if computed != changes:
        yield replace(case, environment=computed)


def _rounder_changes(case: Case, _: BehaviorModel) -> Iterator[Case]:
    """Let what the environment changes come at the beginning, or round its times."""
    changes = case.environment or ()
    for index, change in enumerate(changes):
        if change.when is not None:
            yield replace(case, environment=_replaced(changes, index, replace(change, when=None, at_ns=0, after_ns=0)))
        for at_ns in _rounder(change.at_ns or 0):
            yield replace(case, environment=_replaced(changes, index, replace(change, at_ns=at_ns)))
        for after_ns in _rounder(change.after_ns):
            yield replace(case, environment=_replaced(changes, index, replace(change, after_ns=after_ns)))


def _plainer_faults(case: Case, _: BehaviorModel) -> Iterator[Case]:
    """Leave out one network fault, or round the times of its windows."""
    network = case.network
    for fault, _ in network.faults():
        if can_be_left_out(fault):
            yield replace(case, network=network.with_value(fault, fault.default))
    for window_fault, index, window in network.windows():
        for rounder in _rounder_window(window):
            changed = _replaced(network.value_of(window_fault), index, rounder)
            yield replace(case, network=network.with_value(window_fault, changed))


def _rounder_window(window: FaultWindow) -> Iterator[FaultWindow]:
    struct = cast("Any", window)
    for time_ns in _rounder(window.at_ns):
        yield replace(struct, at_ns=time_ns)
    for time_ns in _rounder(window.for_ns):
        yield replace(struct, for_ns=time_ns)


def _rounder(time_ns: int) -> Iterator[int]:
    """Yield 0, then the time rounded down and up to seconds, tenths and thousandths."""
    if not time_ns:
        return
    yield 0
    for unit_ns in (1_000_000_000, 100_000_000, 1_000_000):
        for rounded_ns in (time_ns // unit_ns * unit_ns, -(-time_ns // unit_ns) * unit_ns):
            if rounded_ns not in (0, time_ns):
                yield rounded_ns


def _plainer_state(case: Case, model: BehaviorModel) -> Iterator[Case]:
    """Start in the nominal state, or one variable nearer to it; or in another state that the model lists."""
    yield replace(case, initial=model.nominal_state)
    for variable in model.space:
        values = (variable.initial, *(value for value in variable.random if value != variable.initial))
        for value in values:
            if case.initial[variable.name] != value:
                yield replace(case, initial=case.initial.replace({variable.name: value}))


def _fewer_goals(case: Case, _: BehaviorModel) -> Iterator[Case]:
    """Leave out goals, or what a goal waits for."""
    for kept in _fewer(case.goals):
        if kept:
            yield case.with_goals((replace(kept[0], when=None), *kept[1:]))
    for index, goal in enumerate(case.goals):
        if goal.when is not None:
            yield case.with_goals(_replaced(case.goals, index, replace(goal, when=None)))


def _other_goals(case: Case, model: BehaviorModel) -> Iterator[Case]:
    """Pursue another goal of the model in place of one, or a part of one."""
    for index, pursued in enumerate(case.goals):
        for name, goal in model.goals:
            if goal != pursued.predicate:
                yield case.with_goals(_replaced(case.goals, index, replace(pursued, name=name, predicate=goal)))
        for goal in dict.fromkeys((pursued.predicate, *(goal for _, goal in model.goals))):
            for part in goal.operands if isinstance(goal, And) else ():
                other = replace(pursued, name=_name(part, model), predicate=part)
                yield case.with_goals(_replaced(case.goals, index, other))


def _name(goal: Predicate, model: BehaviorModel) -> str:
    return next((name for name, named in model.goals if named == goal), str(goal))


def _replaced(parts: tuple[_Part, ...], index: int, part: _Part) -> tuple[_Part, ...]:
    return (*parts[:index], part, *parts[index + 1 :])


STEPS: tuple[Step, ...] = (
    _computed_changes,
    _plainest,
    _without_planning_time,
    _fewer_goals,
    _without_parts,
    _plainer_state,
    _other_goals,
    _earlier_rules,
    _plainer_rules,
    _rounder_latencies,
    _plainer_injections,
    _rounder_changes,
    _plainer_faults,
)
"""In the order in which they are tried."""
