"""Mutation operators for actions of operations and automatic transitions."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING

from scbm.model import Add, Assign, Constant, Reference, Role
from scbm.model.variables import trigger_name
from scbm.testing.mutants.expression_edits import after, can_meet, other_calculations, other_constants, replaced
from scbm.testing.mutants.model_parts import clean_up_of, planned_actions_of, timedout_of, transitions_of
from scbm.testing.mutants.mutation import Mutant, Mutation, SubjectKind, line_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import Action, BehaviorModel, StateSpace
    from scbm.testing.mutants.model_parts import ActionsPart, TransitionPart


class DropAction(Mutation):
    """Leaves out one action of a pre- or postcondition."""

    name = "action-drop"
    group = "actions"
    summary = "an action of a pre- or postcondition is left out"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each action of each operation."""
        for part in planned_actions_of(model):
            yield from self.without_one(part)

    def without_one(self, part: ActionsPart) -> Iterator[Mutant]:
        """Yield a mutant without each action of a part."""
        for index, action in enumerate(part.value):
            yield self.of_part(part, f"drop:{action}", replaced(part.value, index))


class DropCleanUp(DropAction):
    """Leaves out one action of `failed`, of `timedout`, or of an automatic transition."""

    name = "clean-up-drop"
    group = "clean-up"
    summary = "an action of `failed`, of `timedout` or of an automatic transition is left out"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each action; none leaves an automatic transition without actions."""
        single = [t.name for t in model.automatic_transitions if len(t.running_actions) == 1]
        for part in clean_up_of(model):
            if part.kind is not SubjectKind.AUTOMATIC or part.subject not in single:
                yield from self.without_one(part)


class OtherActionValue(Mutation):
    """Assigns the next value of the domain or another sum, or counts in the other direction."""

    name = "action-value"
    group = "actions"
    summary = "an action assigns the next value of the domain or another sum, or counts in the other direction"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each action of a constant, a sum or a count."""
        for part in chain(planned_actions_of(model), clean_up_of(model)):
            for index, action in enumerate(part.value):
                for other in other_actions(action, model.running_space):
                    changed = replaced(part.value, index, other)
                    yield self.of_part(part, f"value:{other}", changed, f"{action} → {other}")


def other_actions(action: Action, space: StateSpace) -> Iterator[Action]:
    """Yield the action with the next value that a model may assign, with another sum, or counting the other way."""
    match action:
        case Add(target, amount):
            yield Add(target, -amount)
        case Assign(target, Constant(value)):
            for other in after(value, space[target].assignable):
                yield Assign(target, Constant(other))
                return
        case Assign(target, source):
            changed = (*other_calculations(source), *other_constants(source))
            yield from (Assign(target, other) for other in changed if can_meet(Reference(target), other, space))


class MoveAction(Mutation):
    """Moves one action from `a` to `ar`, or from `ar` to `a`."""

    name = "action-move"
    group = "actions"
    summary = "an action moves between `a` and `ar`, so the planner ignores it or sees it"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each action of each transition that the planner reads; `plan.state` stays in `ar`."""
        for transition in transitions_of(model):
            if transition.is_planned:
                yield from self._moved(transition, "a", "ar", model.running_space)
                yield from self._moved(transition, "ar", "a", model.running_space)

    def _moved(self, part: TransitionPart, source: str, target: str, space: StateSpace) -> Iterator[Mutant]:
        old, new = part.actions(source), part.actions(target)
        for index, action in enumerate(old.value):
            if space[action.target].role is Role.PLAN_STATE:
                continue
            kept = replaced(old.value, index)
            grown = (*new.value, action)
            a, ar = (kept, grown) if source == "a" else (grown, kept)
            yield Mutant(
                name=f"{part.subject}/{old.part}/move:{action}",
                operator=self.name,
                kind=part.kind,
                subject=part.subject,
                parts=(old.part, new.part),
                path=old.path,
                before=f"{line_of(old, old.value)}; {line_of(new, new.value)}",
                after=f"{line_of(old, kept)}; {line_of(new, grown)}",
                change=f"move {action} to {new.part}",
                model=part.put(replace(part.transition, a=a, ar=ar)),
            )


class OtherTrigger(Mutation):
    """Assigns the trigger of the next resource in an operation."""

    name = "trigger-other"
    group = "resources"
    summary = "an operation assigns the trigger of the next resource"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each assignment of a trigger in operations; no transition assigns one trigger twice."""
        triggers = [trigger_name(resource.name) for resource in model.resources]
        for part, assigned in _parts_of_operations(model):
            for index, action in enumerate(part.value):
                if action.target in triggers and isinstance(action, Assign):
                    free = [name for name in after(action.target, triggers) if name not in assigned]
                    for name in free[:1]:
                        other = replace(action, target=name)
                        changed = replaced(part.value, index, other)
                        yield self.of_part(part, f"trigger:{other}", changed, f"{action} → {other}")


def _parts_of_operations(model: BehaviorModel) -> Iterator[tuple[ActionsPart, tuple[str, ...]]]:
    """Yield the actions of all operations, each with the variables that the same transition assigns."""
    for transition in transitions_of(model):
        if transition.kind is SubjectKind.OPERATION:
            assigned = tuple(action.target for action in transition.transition.running_actions)
            yield transition.actions("a"), assigned
            yield transition.actions("ar"), assigned
    for operation in model.operations:
        yield timedout_of(model, operation), tuple(action.target for action in operation.timedout)
