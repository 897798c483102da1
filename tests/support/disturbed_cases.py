"""Random changes from outside and random injections for cases, possible or not."""

from __future__ import annotations

from random import Random

from msgspec.structs import replace

from scbm.cases import Case, CaseLimits, Condition, ConditionKind, EnvironmentChange, Injection
from scbm.model import BehaviorModel, Constant, Equal, Predicate, Reference, Role

SECOND_NS = 1_000_000_000

_CONDITIONS = (ConditionKind.OCCUPIED, ConditionKind.OCCUPIED, ConditionKind.DEAD, ConditionKind.WELL)


def disturbed(case: Case, model: BehaviorModel, random: Random) -> Case:
    """The case with changes under `environment`, or with injections, or with both; plans may take some time."""
    kind = random.random()
    changes = [_change(model, random) for _ in range(random.randint(0, 4))] if kind < 0.7 else None
    injections = [_injection(f"i{n}", model, random) for n in range(random.randint(0, 3))] if kind > 0.4 else []
    return replace(
        case,
        environment=None if changes is None else tuple(changes),
        injections=tuple(injections),
        limits=CaseLimits(60 * SECOND_NS),
        planning_ns=random.choice((0, 0, SECOND_NS // 10)),
    )


def _change(model: BehaviorModel, random: Random) -> EnvironmentChange:
    """A change by an environment transition, or of up to three variables."""
    when = None if random.random() < 0.5 else _predicate(model, random)
    change = EnvironmentChange(_time(random) if when is None else None, (), "", when, _delay(random))
    if model.environment and random.random() < 0.5:
        transition = random.choice(model.environment)
        actions = tuple((action.target, action.value(model.nominal_state)) for action in transition.actions)
        is_named = random.random() < 0.7
        assign = None if is_named and random.random() < 0.5 else actions
        return replace(change, assign=assign, by=transition.name if is_named else "")
    known = [variable for variable in model.variables if len(variable.domain) > 1]
    chosen = random.sample(known, min(len(known), random.choice((1, 1, 2, 3))))
    return replace(change, assign=tuple((v.name, random.choice(v.domain.values)) for v in chosen))


def _injection(name: str, model: BehaviorModel, random: Random) -> Injection:
    """An injection that assigns one or two variables, or changes the condition of a resource."""
    when = None if random.random() < 0.5 else _predicate(model, random)
    after_ns = None if when is None else _delay(random)
    hold_ns = random.choice((None, 0, SECOND_NS // 10, 2 * SECOND_NS))
    injection = Injection(name, when=when, at_ns=_time(random), hold_ns=hold_ns, after_ns=after_ns)
    if model.resources and random.random() < 0.4:
        condition = Condition(random.choice(_CONDITIONS))
        return replace(injection, resource=random.choice(model.resources).name, condition=condition)
    known = [v for v in model.running_space if v.role in (Role.DECLARED, Role.RESOURCE)]
    chosen = random.sample(known, random.choice((1, 1, 2)))
    return replace(injection, assign=tuple((v.name, random.choice(v.domain.values)) for v in chosen))


def _predicate(model: BehaviorModel, random: Random) -> Predicate:
    variable = random.choice(model.running_space.variables)
    return Equal(Reference(variable.name), Constant(random.choice(variable.domain.values)))


def _time(random: Random) -> int:
    return random.choice((0, random.randint(0, SECOND_NS), random.randint(0, 20 * SECOND_NS)))


def _delay(random: Random) -> int:
    return random.choice((0, 0, SECOND_NS // 10))
