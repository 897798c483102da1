"""Inputs: variables that the model reads and never sets, so that only the environment changes them.

Values of inputs are distinguished only as far as guards distinguish them (decision 17).
"""

from __future__ import annotations

from dataclasses import replace
from itertools import islice, product
from typing import TYPE_CHECKING

from scbm.cases import Case, Injection
from scbm.closing.scripts.disabling import HOLD_NS
from scbm.model import And, Constant, Equal, Implies, Member, Not, NotEqual, Or, Order, Reference, Truth, conjunction

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from scbm.model import BehaviorModel, Predicate, StateSpace, Transition, Value

_MAX_CHANGES = 4_096
"""Maximum number of combinations of values that are tried for one transition."""


def inputs(model: BehaviorModel) -> tuple[str, ...]:
    """Return the declared variables that no action assigns and no resource measures."""
    kept = dict.fromkeys(action.target for action in model.actions)
    kept |= dict.fromkeys(name for resource in model.resources for name in resource.measures)
    return tuple(variable.name for variable in model.variables if variable.name not in kept)


def with_free_inputs(model: BehaviorModel) -> BehaviorModel:
    """Return the model in which inputs may have any value from the beginning."""
    known = inputs(model)
    variables = (replace(v, random=v.domain.values) if v.name in known else v for v in model.variables)
    return replace(model, variables=tuple(variables))


def distinguishing_values(model: BehaviorModel, name: str) -> tuple[Value, ...]:
    """Return the first value of each class of values that no guard or goal distinguishes.

    Where the variable is compared with another one, or assigned to one, each value is a class of its own.
    """
    if any(name in action.reads() for action in model.actions):
        return model.space[name].domain.values
    predicates = [*(transition.running_guard for transition in model.transitions), *(goal for _, goal in model.goals)]
    leaves = [leaf for predicate in predicates for leaf in _leaves(predicate) if name in leaf.reads()]
    if any(len(leaf.reads()) > 1 for leaf in leaves):
        return model.space[name].domain.values
    kinds: dict[tuple[bool, ...], Value] = {}
    for value in model.space[name].domain.values:
        kinds.setdefault(tuple(leaf.holds({name: value}) for leaf in leaves), value)
    return tuple(kinds.values())


def _leaves(predicate: Predicate) -> Iterator[Equal | NotEqual | Order | Member]:
    match predicate:
        case Not(operand):
            yield from _leaves(operand)
        case And(operands) | Or(operands):
            for each in operands:
                yield from _leaves(each)
        case Implies(condition, consequence):
            yield from (*_leaves(condition), *_leaves(consequence))
        case Equal() | NotEqual() | Order() | Member():
            yield predicate


def with_inputs(model: BehaviorModel, transition: Transition, case: Case) -> Iterator[Case]:
    """Yield the case with an injection that changes inputs as soon as nothing else disables the transition."""
    known = inputs(model)
    names = [name for name in transition.running_guard.reads() if name in known]
    if not names:
        return
    choices = product(*(distinguishing_values(model, name) for name in names))
    for chosen in islice(choices, _MAX_CHANGES):
        values = dict(zip(names, chosen, strict=True))
        rest = residual(transition.running_guard, values, model.running_space)
        changed = tuple((name, value) for name, value in values.items() if case.initial[name] != value)
        if rest == Truth(False) or not changed:
            continue
        when = None if rest == Truth(True) else rest
        for hold_ns in (HOLD_NS, None):
            injected = Injection(f"{transition.name}_comes", changed, when, hold_ns=hold_ns)
            yield replace(case, injections=(*case.injections, injected))


def residual(predicate: Predicate, values: Mapping[str, Value], space: StateSpace) -> Predicate:
    """Return the predicate with the values of some variables substituted."""
    match predicate:
        case Not(operand):
            rest = residual(operand, values, space)
            return Truth(not rest.truth) if isinstance(rest, Truth) else Not(rest)
        case And(operands):
            return _all(residual(operand, values, space) for operand in operands)
        case Or(operands):
            return _any(residual(operand, values, space) for operand in operands)
        case Implies(condition, consequence):
            return residual(Or((Not(condition), consequence)), values, space)
        case Equal() | NotEqual() | Order() | Member() if any(name in values for name in predicate.reads()):
            return _leaf(predicate, values, space)
    return predicate


def _leaf(leaf: Equal | NotEqual | Order | Member, values: Mapping[str, Value], space: StateSpace) -> Predicate:
    """Return a leaf with values substituted: the set of values of its other variable for which it holds."""
    others = [name for name in leaf.reads() if name not in values]
    if not others:
        return Truth(leaf.holds(values))
    domain = space[others[0]].domain.values
    fitting = tuple(Constant(value) for value in domain if leaf.holds({**values, others[0]: value}))
    if len(fitting) in (0, len(domain)):
        return Truth(bool(fitting))
    other = Reference(others[0])
    return Equal(other, fitting[0]) if len(fitting) == 1 else Member(other, fitting)


def _all(parts: Iterable[Predicate]) -> Predicate:
    rest = tuple(parts)
    if Truth(False) in rest:
        return Truth(False)
    return conjunction(part for part in rest if part != Truth(True))


def _any(parts: Iterable[Predicate]) -> Predicate:
    rest = tuple(part for part in parts if part != Truth(False))
    if Truth(True) in rest:
        return Truth(True)
    if not rest:
        return Truth(False)
    return rest[0] if len(rest) == 1 else Or(rest)
