"""Who changes a variable (semantics 9.1): the model, a resource with or without a request, or the environment.

A source is declared, or inferred on the cautious side: a variable that is read and that nothing else changes is an
input, and so is a variable that only automatic transitions assign. Resources that publish, and the environment, change
variables at settled moments, whether the model asks for it or not. A variable that environment transitions assign
changes from outside by these alone; each other one takes any of its values.
So the states in which runs begin are here, too.
"""

from __future__ import annotations

from functools import cached_property
from itertools import product
from math import prod
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from scbm.model.predicates import Constant
from scbm.model.variables import State, VariableSource

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from scbm.model.behavior import BehaviorModel, EnvironmentTransition
    from scbm.model.operations import Action
    from scbm.model.resources import Resource
    from scbm.model.values import Value


class FreeGroup(Struct, frozen=True):
    """Variables that something outside the model changes freely, all or some of them at one moment.

    Attributes:
        name: the input, or the resource that publishes the variables.
        values: each variable with the values that it can take.
    """

    name: str
    values: tuple[tuple[str, tuple[Value, ...]], ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The variables."""
        return tuple(name for name, _ in self.values)

    def changes(self, names: Iterable[str]) -> Iterator[tuple[tuple[str, Value], ...]]:
        """Yield each choice of values for some of the variables `names`, at least one of them."""
        kept = dict.fromkeys(names)
        values = [(name, (None, *choices)) for name, choices in self.values if name in kept]
        for chosen in product(*(choices for _, choices in values)):
            found = tuple((name, value) for (name, _), value in zip(values, chosen, strict=True) if value is not None)
            if found:
                yield found


OutsideGroup: TypeAlias = "FreeGroup | EnvironmentTransition | Resource"
"""A source of changes from outside: variables that change freely, an environment transition, or a shared resource."""


def is_triggered(resource: Resource, model: BehaviorModel) -> bool:
    """Return whether an action of the model can trigger a request to a resource."""
    off = Constant(False)
    return any(action.target == resource.trigger and getattr(action, "source", None) != off for action in model.actions)


def replied(model: BehaviorModel) -> tuple[str, ...]:
    """Return the variables that a reply can change, in the order of the resources."""
    triggered = (resource for resource in model.resources if is_triggered(resource, model))
    return tuple(dict.fromkeys(name for resource in triggered for name in resource.measures))


def published_by(resource: Resource, model: BehaviorModel) -> tuple[str, ...]:
    """Return the variables that a resource can change without a request: it publishes them, or never gets requests."""
    unasked = () if is_triggered(resource, model) else resource.measures
    return tuple(dict.fromkeys((*resource.publishes, *unasked)))


def moved(model: BehaviorModel) -> tuple[str, ...]:
    """Return the variables that environment transitions assign, in the order of the transitions."""
    return tuple(dict.fromkeys(action.target for each in model.environment for action in each.actions))


def inputs(model: BehaviorModel) -> tuple[str, ...]:
    """Return the variables that the environment changes, declared or inferred, in the order of the model.

    Those that operations or resources change as well are among them only if the model declares it.
    """
    known = dict.fromkeys((*replied(model), *(name for r in model.resources for name in published_by(r, model))))
    known |= dict.fromkeys(action.target for action in _actions_of_operations(model))
    read = dict.fromkeys(model.read)
    found = []
    for variable in model.variables:
        is_free = variable.source is None and variable.name in read and variable.name not in known
        if variable.source is VariableSource.INPUT or is_free:
            found.append(variable.name)
    return tuple(found)


def undeclared(model: BehaviorModel) -> tuple[str, ...]:
    """Return the inputs that automatic transitions assign, and of which the model does not say whether they are."""
    assigned = dict.fromkeys(a.target for t in model.automatic_transitions for a in t.running_actions)
    assigned = {name: None for name in assigned if name not in moved(model)}
    by_name = {variable.name: variable for variable in model.variables}
    return tuple(name for name in inputs(model) if name in assigned and by_name[name].source is None)


def declared_as_states(model: BehaviorModel, names: Sequence[str]) -> BehaviorModel:
    """Return the model in which nothing but itself changes the variables `names`."""
    variables = (replace(v, source=VariableSource.STATE) if v.name in names else v for v in model.variables)
    return replace(model, variables=tuple(variables))


def unassigned(model: BehaviorModel) -> tuple[str, ...]:
    """Return the variables that only the model changes, as it declares, and that none of its actions assigns."""
    assigned = dict.fromkeys(action.target for action in model.actions)
    return tuple(v.name for v in model.variables if v.source is VariableSource.STATE and v.name not in assigned)


def still(model: BehaviorModel) -> tuple[str, ...]:
    """Return the variables that the course of a run can depend on and that nothing changes."""
    changed = dict.fromkeys((*replied(model), *changed_from_outside(model), *(a.target for a in model.actions)))
    read = dict.fromkeys(model.read)
    return tuple(v.name for v in model.variables if v.name in read and v.name not in changed)


def free_groups(model: BehaviorModel) -> tuple[FreeGroup, ...]:
    """Return what changes freely at settled moments: one group for each input and each resource that publishes.

    A message of a resource can carry several values at once. What environment transitions assign is in no group.
    """
    guarded = dict.fromkeys(moved(model))
    groups = [FreeGroup(n, ((n, model.space[n].domain.values),)) for n in inputs(model) if n not in guarded]
    for resource in model.resources:
        names = [name for name in published_by(resource, model) if name not in guarded]
        if names:
            values = tuple((name, resource.sends(model.space[name])) for name in names)
            groups.append(FreeGroup(resource.name, values))
    return tuple(groups)


def free_initial_values(model: BehaviorModel) -> dict[str, tuple[Value, ...]]:
    """Return for each variable that changes freely from outside the values that a run can begin with.

    These are the values that it can get from outside, the random ones and the nominal one, in the order of its domain.
    """
    found: dict[str, dict[Value, None]] = {}
    for group in free_groups(model):
        for name, values in group.values:
            variable = model.space[name]
            known = found.setdefault(name, dict.fromkeys((variable.initial, *variable.random)))
            known |= dict.fromkeys(values)
    return {name: tuple(v for v in model.space[name].domain.values if v in known) for name, known in found.items()}


def outside_groups(model: BehaviorModel) -> tuple[OutsideGroup, ...]:
    """Return everything that changes from outside at settled moments: groups, transitions, shared resources."""
    return (*free_groups(model), *model.environment, *(resource for resource in model.resources if resource.shared))


def changed_from_outside(model: BehaviorModel) -> tuple[str, ...]:
    """Return the variables that change from outside at settled moments, each once; no request states."""
    free = (name for group in free_groups(model) for name in group.names)
    return tuple(dict.fromkeys((*free, *moved(model))))


def outside_values(model: BehaviorModel) -> dict[str, tuple[Value, ...]]:
    """Return for each variable that changes from outside the values that it can get there, in the order of the domain.

    The actions of environment transitions may give any value of the domain.
    """
    found: dict[str, dict[Value, None]] = {}
    for group in free_groups(model):
        for name, values in group.values:
            found.setdefault(name, {}).update(dict.fromkeys(values))
    for name in moved(model):
        found[name] = dict.fromkeys(model.space[name].domain.values)
    return {name: tuple(v for v in model.space[name].domain.values if v in known) for name, known in found.items()}


def _actions_of_operations(model: BehaviorModel) -> Iterator[Action]:
    for operation in model.operations:
        for transition in (operation.pre, operation.post, operation.failed):
            if transition is not None:
                yield from transition.running_actions
        yield from operation.timedout


class InitialStates:
    """The combinations of random values of a model, numbered in the order of variables and values."""

    def __init__(self, model: BehaviorModel) -> None:
        self._model = model
        self.combinations = prod(len(variable.random) for variable in model.space)

    def combination(self, number: int) -> dict[str, Value]:
        """Return combination `number`, whether it is allowed or not; the last variable changes fastest."""
        values: dict[str, Value] = {}
        for variable in reversed(self._model.space.variables):
            number, index = divmod(number, len(variable.random))
            values[variable.name] = variable.random[index]
        return values

    def allows(self, values: Mapping[str, Value]) -> bool:
        """Return whether the model's `initial_states` predicate holds."""
        return self._model.initial_states.holds(values)

    def can_begin(self, values: Mapping[str, Value]) -> bool:
        """Return whether a run can begin in a state of the world (semantics 7.2)."""
        if not self._model.initial_states.holds(values):
            return False
        return any(all(values[name] in known for name, known in each.items()) for each in self._beginnings)

    @cached_property
    def _beginnings(self) -> tuple[dict[str, tuple[Value, ...]], ...]:
        return self.beginnings(is_open=True)

    def beginnings(self, *, is_open: bool) -> tuple[dict[str, tuple[Value, ...]], ...]:
        """Return the values of the variables in the states that runs begin with; all satisfy `initial_states`, too.

        The first mapping has the random values, the second one, if there is one, those of the nominal state.

        Args:
            is_open: whether variables that change freely from outside begin with any of their values.
        """
        free = free_initial_values(self._model) if is_open else {}
        random = {variable.name: free.get(variable.name, variable.random) for variable in self._model.space}
        nominal = {variable.name: free.get(variable.name, (variable.initial,)) for variable in self._model.space}
        is_drawn = all(frozenset(values) <= frozenset(random[name]) for name, values in nominal.items())
        return (random,) if is_drawn else (random, nominal)

    def allowed(self, most: int) -> Iterator[State]:
        """Yield the allowed states among the first `most` combinations, in order."""
        for number in range(min(most, self.combinations)):
            values = self.combination(number)
            if self.allows(values):
                yield State(self._model.space, values)
