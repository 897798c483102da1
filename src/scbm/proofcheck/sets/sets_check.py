"""Checks a set of situations that no step of a run leaves, with no visit to a claimed obligation (`SetsArgument`).

The check is an induction over the micro-steps and events of a run: the first situations are in the set, each step leads
from the set into it, and no step in it visits a claimed obligation. Each condition is a question to a solver of
satisfiability, which knows nothing of how the set was found.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import PlanSet, Role, format_value
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, PLAN_STATE
from scbm.proofcheck.certificate import GOAL, PHASE, CertificateFlaw, SetPhase, predicted_name, request_name
from scbm.proofcheck.checker_planner import PlannedStates
from scbm.proofcheck.runs_check import check_variables, initial_values
from scbm.proofcheck.sets.clauses import Clauses
from scbm.proofcheck.sets.distances_check import DistancesCheck
from scbm.proofcheck.sets.set_literals import SetLiterals
from scbm.proofcheck.sets.set_steps import SetSteps
from scbm.proofcheck.sets.set_views import SituationView, TooManyChoicesError, ValueLiterals, new_values

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model import BehaviorModel, Value
    from scbm.proofcheck.certificate import ClaimedObligation, SetsArgument
    from scbm.proofcheck.sets.set_steps import SetStep

_MAX_SHOWN = 300
"""Maximum number of characters of a situation in a message."""


def set_variables(world: Sequence[str], planned: Sequence[str], model: BehaviorModel) -> dict[str, tuple[Value, ...]]:
    """Return the variables of situations with their values, in no order that matters.

    Args:
        world: the variables of the running space that can influence a run.
        planned: those on which plans depend.
        model: the model.
    """
    found: dict[str, tuple[Value, ...]] = {PHASE: tuple(phase.value for phase in SetPhase)}
    found[GOAL] = tuple(name for name, _ in model.goals)
    found |= {name: model.running_space[name].domain.values for name in world}
    found |= {predicted_name(name): model.space[name].domain.values for name in planned}
    return found | {request_name(resource.name): (False, True) for resource in model.resources}


def check_sets(
    claimed: Sequence[ClaimedObligation], argument: SetsArgument, model: BehaviorModel
) -> Iterator[CertificateFlaw]:
    """Yield the flaws of the shape, or else of the set."""
    yield from flaws_of_set(SetCheck, [str(obligation) for obligation in claimed], argument, model)


def flaws_of_set(
    kind: type[SetCheck],
    claimed: Sequence[str],
    argument: SetsArgument,
    model: BehaviorModel,
    read: Sequence[str] = (),
) -> Iterator[CertificateFlaw]:
    """Yield the flaws of the shape, or else those that one kind of check finds; `read` is what requirements read."""
    if not model.goals:
        yield CertificateFlaw("the goals", "the model has none, so there are no runs")
        return
    space = model.running_space
    world = [name for name in space.names if name in argument.variables]
    planned = [name for name in model.space.names if name in _planned_names(model)]
    variables = set_variables(world, planned, model)
    flaws = [*check_variables(world, model, read), *_wrong_shape(argument, variables, model)]
    yield from flaws
    if flaws:
        return
    try:
        yield from kind(argument, variables, planned, model).flaws(claimed)
    except ImportError:
        yield CertificateFlaw(
            "the set", "it is checked by python-sat, which is not installed: pip install 'scbm[proofs]'"
        )
    except TooManyChoicesError:
        yield CertificateFlaw("the set", "a comparison or an assignment of the model reads too many values to check")


def _planned_names(model: BehaviorModel) -> dict[str, None]:
    """Return the variables on which plans to any of the goals depend."""
    return dict.fromkeys(name for _, goal in model.goals for name in PlannedStates(model, goal).names)


def _wrong_shape(
    argument: SetsArgument, variables: Mapping[str, tuple[Value, ...]], model: BehaviorModel
) -> Iterator[CertificateFlaw]:
    """Yield why the nodes are no diagrams over the variables of situations."""
    if sorted(argument.variables) != sorted(variables):
        yield CertificateFlaw("the variables", "they are not those of situations, each once")
        return
    if any(name not in variables for name in model.initial_states.reads()):
        yield CertificateFlaw("the variables", "those that `initial_states` reads are not among them")
    sizes = [len(variables[name]) for name in argument.variables]
    levels = [len(sizes), len(sizes)]
    for number, node in enumerate(argument.nodes):
        where = f"node {number}"
        if not node or not node[0] < len(sizes) or len(node) != sizes[node[0]] + 1:
            yield CertificateFlaw(where, "it is no variable with a set for each of its values")
            return
        if not all(each < number + 2 and node[0] < levels[each] for each in node[1:]):
            yield CertificateFlaw(where, "it has sets that do not stand before it, or compare earlier variables")
            return
        levels.append(node[0])
    of_plans = (argument.dead, *argument.layers, *argument.choices)
    if not max(argument.reached, *of_plans) < len(levels):
        yield CertificateFlaw("the sets", "they are no nodes")
        return
    if len(argument.choices) != (0 if argument.plans is PlanSet.ANY else len(model.operations)):
        yield CertificateFlaw("the choices", "they are not those of the operations of the model, each once")
    yield from _no_predicted_states(argument, of_plans)


def _no_predicted_states(argument: SetsArgument, numbers: Sequence[int]) -> Iterator[CertificateFlaw]:
    """Yield a flaw for sets of predicted states that depend on something else."""
    todo, seen = list(numbers), dict[int, None]()
    while todo:
        number = todo.pop()
        if number < 2 or number in seen:  # noqa: PLR2004 - 0 and 1 are no nodes
            continue
        seen[number] = None
        level, *following = argument.nodes[number - 2]
        name = argument.variables[level]
        if name != GOAL and not name.startswith(predicted_name("")):
            yield CertificateFlaw("the predicted states", f"they depend on {name}")
            return
        todo += following


class SetCheck:
    """The questions about one set. Raises `ImportError`, `TooManyChoicesError`."""

    def __init__(
        self,
        argument: SetsArgument,
        variables: Mapping[str, tuple[Value, ...]],
        planned: Sequence[str],
        model: BehaviorModel,
    ) -> None:
        self._argument = argument
        self._variables = variables
        self._planned = planned
        self._model = model
        self._clauses = Clauses()
        self._before = {name: new_values(variables[name], self._clauses) for name in argument.variables}
        self._after = {name: new_values(variables[name], self._clauses) for name in argument.variables}
        before, after = (SetLiterals(argument, each, self._clauses) for each in (self._before, self._after))
        self._sets_before, self._sets_after = before, after
        self._in_set, self._leaves_set = before.inside(argument.reached), after.outside(argument.reached)
        self._is_dead, self._leads_on = before.inside(argument.dead), after.outside(argument.dead)
        names = [operation.name for operation in model.operations]
        self._layers = [(before.inside(number), before.outside(number)) for number in argument.layers]
        self._choices = [(before.inside(number), before.outside(number)) for number in argument.choices]
        chosen = dict(zip(names, (inside for inside, _ in self._choices), strict=True)) if self._choices else None
        self._steps = SetSteps(model, self._before, planned, before.outside(argument.dead), self._clauses, chosen)
        self._same = {name: self._equal(name, self._before[name]) for name in argument.variables}

    def _equal(self, name: str, values: ValueLiterals) -> int:
        """Return the assumption that a variable has these values afterwards."""
        found = self._clauses.new()
        for value, literal in values.items():
            self._clauses.add(-found, -literal, self._after[name][value])
        return found

    def _may_become(self, name: str, values: Sequence[Value]) -> int:
        """Return the assumption that a variable keeps its value or gets one of some values."""
        found, given = self._clauses.new(), [self._after[name][value] for value in values]
        for value, literal in self._before[name].items():
            self._clauses.add(-found, -literal, self._after[name][value], *given)
        return found

    def _effects(self, step: SetStep) -> list[int]:
        """Return the assumptions about what is after a step."""
        found = [self._equal(name, values) for name, values in step.given.items()]
        found += [self._may_become(name, values) for name, values in step.may_become]
        changed = dict.fromkeys((*step.given, *(name for name, _ in step.may_become)))
        found += [same for name, same in self._same.items() if name not in changed]
        return [*found, self._leads_on] if step.leads_on else found

    # questions

    def flaws(self, claimed: Sequence[str]) -> Iterator[CertificateFlaw]:
        """Yield all flaws."""
        yield from self._wrong_steps(claimed)
        self._clauses.close()

    def _wrong_steps(self, claimed: Sequence[str]) -> Iterator[CertificateFlaw]:
        """Yield the flaws of a set that steps leave, or in which they visit claimed obligations."""
        yield from self._wrong_dead_states()
        yield from self._wrong_plans()
        if self._clauses.can_hold([self._begins(), self._leaves_set]):
            yield CertificateFlaw("the start", f"a first situation is not in the set: {self._shown(self._after)}")
        for step in self._steps.steps():
            effects = self._effects(step)
            if self._clauses.can_hold([self._in_set, step.where, *effects, self._leaves_set]):
                before, after = self._shown(self._before), self._shown(self._after)
                yield CertificateFlaw(step.what, f"it leads from {before} out of the set, to {after}")
            visited = [str(each) for each in step.visits if str(each) in claimed]
            if visited and self._clauses.can_hold([self._in_set, step.where, *effects]):
                reason = f"{step.what} visits it from {self._shown(self._before)}"
                yield CertificateFlaw(f"claim {visited[0]}", reason)

    def _wrong_dead_states(self) -> Iterator[CertificateFlaw]:
        """Yield the flaws of dead states: the goal holds in one, or an operation leads out of them."""
        if self._argument.dead == 0:
            return
        if self._clauses.can_hold([self._is_dead, self._steps.predicted_goal()]):
            yield CertificateFlaw("the dead states", f"the goal holds in {self._shown(self._before)}")
        for operation in self._model.operations:
            enabled, given = self._steps.planned_step(operation)
            after = [self._equal(name, values) for name, values in given.items()]
            same = [literal for name, literal in self._same.items() if name not in given]
            if self._clauses.can_hold([self._is_dead, enabled, *after, *same, self._leads_on]):
                yield CertificateFlaw("the dead states", f"{operation.name} leads out of {self._shown(self._before)}")

    def _wrong_plans(self) -> Iterator[CertificateFlaw]:
        """Yield the flaws of layers and choices, where plans are canonical: here, and then those of operations."""
        if self._argument.plans is PlanSet.ANY:
            return
        goal, can_hold = self._steps.predicted_goal(), self._clauses.can_hold
        for number, (inside, _) in enumerate(self._layers):
            if can_hold([inside, goal if number else -goal]):
                yield CertificateFlaw(
                    f"layer {number}", f"the goal {'holds' if number else 'does not hold'} in one of its states"
                )
            if number and can_hold([inside, *(outside for _, outside in self._choices)]):
                yield CertificateFlaw(f"layer {number}", "no operation is chosen in one of its states")
        for operation, (inside, _) in zip(self._model.operations, self._choices, strict=True):
            if can_hold([inside, -self._steps.planned_step(operation)[0]]):
                yield CertificateFlaw("the choices", f"{operation.name} is chosen where it cannot follow")
        planned = self._clauses.any_of([self._before[PHASE][each] for each in (SetPhase.PLAN, SetPhase.PLANNED)])
        if can_hold([self._in_set, planned, *(outside for _, outside in self._layers)]):
            yield CertificateFlaw("the layers", f"the plan goes on in none of them: {self._shown(self._before)}")
        sizes = [len(self._variables[name]) for name in self._argument.variables]
        yield from DistancesCheck(self._argument, self._model, sizes).flaws()

    def _begins(self) -> int:
        """Return the literal that a situation afterwards is one in which runs begin (semantics 7.2)."""
        view = SituationView(self._after, self._model.running_space, self._clauses)
        beginnings = [
            self._clauses.all_of(view.has(name, *values) for name, values in beginning.items() if name in self._after)
            for beginning in initial_values(self._model)
        ]
        space = self._model.running_space
        runner = [view.has(name, space[name].initial) for name in (CURRENT_NAME, CURRENT_STATE, PLAN_STATE)]
        others = [name for name in self._variables if name not in space]
        first = [self._after[name][self._variables[name][0]] for name in others]
        allowed = view.holds(self._model.initial_states)
        return self._clauses.all_of([self._clauses.any_of(beginnings), *runner, *first, allowed])

    def _shown(self, literals: Mapping[str, ValueLiterals]) -> str:
        """Return a situation that the last question has found, as far as it is not as at the start."""
        space = self._model.running_space
        found = []
        for name, values in literals.items():
            value = next(value for value, literal in values.items() if self._clauses.holds(literal))
            usual = space[name].initial if name in space else self._variables[name][0]
            if value != usual and not (name in space and space[name].role is Role.OPERATION_STATE):
                found.append(f"{name}={format_value(value)}")
        text = ", ".join(found) or "the nominal state"
        return text if len(text) <= _MAX_SHOWN else f"{text[:_MAX_SHOWN]}…"
