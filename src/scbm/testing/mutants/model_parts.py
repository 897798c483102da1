"""The parts of a model that mutation operators change: guards and lists of actions, each with a way to replace it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Generic, TypeAlias, TypeVar

from scbm.cases.coverage import Obligations
from scbm.model import Action, Predicate
from scbm.testing.mutants.mutation import MutatedPart, SubjectKind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from scbm.model import BehaviorModel, EnvironmentTransition, Operation, Transition

T = TypeVar("T")
_Put: TypeAlias = "Callable[[Transition], BehaviorModel]"


@dataclass(frozen=True, slots=True)
class ModelPart(Generic[T]):
    """One part of a model.

    Attributes:
        kind: the kind of the entry that has the part.
        subject: the name of that entry.
        part: which part of the entry it is.
        path: the keys that lead to the part in the model file.
        value: the part.
        put: returns the model with another value of the part.
    """

    kind: SubjectKind
    subject: str
    part: MutatedPart
    path: tuple[str, ...]
    value: T
    put: Callable[[T], BehaviorModel]


GuardPart: TypeAlias = ModelPart[Predicate]
ActionsPart: TypeAlias = ModelPart[tuple[Action, ...]]


@dataclass(frozen=True, slots=True)
class TransitionPart:
    """A running transition of a model: `pre`, `post` or `failed` of an operation, or an automatic transition.

    Attributes:
        kind: operation, or automatic transition.
        subject: the name of that.
        key: `pre`, `post` or `failed`; empty for an automatic transition.
        transition: the transition.
        put: returns the model with another transition in its place.
    """

    kind: SubjectKind
    subject: str
    key: str
    transition: Transition
    put: _Put

    @property
    def is_planned(self) -> bool:
        """Whether the planner reads the transition."""
        return self.key in ("pre", "post")

    @property
    def path(self) -> tuple[str, ...]:
        """The keys that lead to the transition in the model file."""
        if self.kind is SubjectKind.AUTOMATIC:
            return ("automatic_transitions", self.subject)
        return ("operations", self.subject, self.key)

    def guard(self, key: str) -> GuardPart:
        """Return the guard `g` or `gr`."""
        value = self.transition.g if key == "g" else self.transition.gr
        return ModelPart(self.kind, self.subject, self._part(key), (*self.path, key), value, self._put_guard(key))

    def actions(self, key: str) -> ActionsPart:
        """Return the actions `a` or `ar`."""
        value = self.transition.a if key == "a" else self.transition.ar
        return ModelPart(self.kind, self.subject, self._part(key), (*self.path, key), value, self._put_actions(key))

    def _part(self, key: str) -> MutatedPart:
        return MutatedPart(f"{self.key}.{key}" if self.key else key)

    def _put_guard(self, key: str) -> Callable[[Predicate], BehaviorModel]:
        def put(guard: Predicate) -> BehaviorModel:
            changed = replace(self.transition, g=guard) if key == "g" else replace(self.transition, gr=guard)
            return self.put(changed)

        return put

    def _put_actions(self, key: str) -> Callable[[tuple[Action, ...]], BehaviorModel]:
        def put(actions: tuple[Action, ...]) -> BehaviorModel:
            changed = replace(self.transition, a=actions) if key == "a" else replace(self.transition, ar=actions)
            return self.put(changed)

        return put


def transitions_of(model: BehaviorModel) -> Iterator[TransitionPart]:
    """Yield the transitions of all operations, then the automatic transitions."""
    for operation in model.operations:
        yield from _life(model, operation)
    for transition in model.automatic_transitions:

        def put(changed: Transition, old: Transition = transition) -> BehaviorModel:
            kept = (changed if each is old else each for each in model.automatic_transitions)
            return replace(model, automatic_transitions=tuple(kept))

        yield TransitionPart(SubjectKind.AUTOMATIC, transition.name, "", transition, put)


def _life(model: BehaviorModel, operation: Operation) -> Iterator[TransitionPart]:
    """Yield the transitions of one operation."""

    def put_pre(changed: Transition) -> BehaviorModel:
        return with_operation(model, replace(operation, pre=changed))

    def put_post(changed: Transition) -> BehaviorModel:
        return with_operation(model, replace(operation, post=changed))

    def put_failed(changed: Transition) -> BehaviorModel:
        return with_operation(model, replace(operation, failed=changed))

    kind, name = SubjectKind.OPERATION, operation.name
    yield TransitionPart(kind, name, "pre", operation.pre, put_pre)
    yield TransitionPart(kind, name, "post", operation.post, put_post)
    if operation.failed is not None:
        yield TransitionPart(kind, name, "failed", operation.failed, put_failed)


def guards_of(model: BehaviorModel) -> Iterator[GuardPart]:
    """Yield the guards `g` and `gr` of all operations, then of all automatic transitions."""
    for each in transitions_of(model):
        yield each.guard("g")
        yield each.guard("gr")


def planned_actions_of(model: BehaviorModel) -> Iterator[ActionsPart]:
    """Yield the actions of the pre- and postconditions of all operations."""
    for each in transitions_of(model):
        if each.is_planned:
            yield each.actions("a")
            yield each.actions("ar")


def clean_up_of(model: BehaviorModel) -> Iterator[ActionsPart]:
    """Yield the actions of `failed` and `timedout` of all operations, then of all automatic transitions."""
    for operation in model.operations:
        yield from (part for each in _life(model, operation) if each.key == "failed" for part in _both(each))
        yield timedout_of(model, operation)
    for each in transitions_of(model):
        if each.kind is SubjectKind.AUTOMATIC:
            yield from _both(each)


def timedout_of(model: BehaviorModel, operation: Operation) -> ActionsPart:
    """Return the `timedout` actions of an operation."""

    def put(actions: tuple[Action, ...]) -> BehaviorModel:
        return with_operation(model, replace(operation, timedout=actions))

    path = ("operations", operation.name, "timedout")
    return ModelPart(SubjectKind.OPERATION, operation.name, MutatedPart.TIMEDOUT, path, operation.timedout, put)


def _both(transition: TransitionPart) -> tuple[ActionsPart, ActionsPart]:
    return transition.actions("a"), transition.actions("ar")


def environment_guard(model: BehaviorModel, transition: EnvironmentTransition) -> GuardPart:
    """Return the guard of an environment transition."""

    def put(guard: Predicate) -> BehaviorModel:
        return _with_environment(model, replace(transition, guard=guard))

    path = ("environment", transition.name, "guard")
    part = MutatedPart.ENVIRONMENT_GUARD
    return ModelPart(SubjectKind.ENVIRONMENT, transition.name, part, path, transition.guard, put)


def environment_actions(model: BehaviorModel, transition: EnvironmentTransition) -> ActionsPart:
    """Return the actions of an environment transition."""

    def put(actions: tuple[Action, ...]) -> BehaviorModel:
        return _with_environment(model, replace(transition, actions=actions))

    path = ("environment", transition.name, "actions")
    part = MutatedPart.ENVIRONMENT_ACTIONS
    return ModelPart(SubjectKind.ENVIRONMENT, transition.name, part, path, transition.actions, put)


def with_operation(model: BehaviorModel, changed: Operation) -> BehaviorModel:
    """Return the model with another operation in the place of the one with the same name."""
    return replace(model, operations=tuple(changed if o.name == changed.name else o for o in model.operations))


def _with_environment(model: BehaviorModel, changed: EnvironmentTransition) -> BehaviorModel:
    return replace(model, environment=tuple(changed if e.name == changed.name else e for e in model.environment))


def with_known_waivers(model: BehaviorModel) -> BehaviorModel:
    """Return the model without waivers for obligations that it does not have."""
    if not model.waivers:
        return model
    known = [str(obligation) for obligation in Obligations.of(model)]
    return replace(model, waivers=tuple(waiver for waiver in model.waivers if waiver.obligation in known))
