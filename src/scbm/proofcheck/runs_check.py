"""Checks a set of situations that no step of a run leaves, with no visit to a claimed obligation (`RunsArgument`).

The check is an induction over the events of a run. Its first situation is in the set, and every event leads to a
situation in the set, or to the end. So all situations of all runs are in the set, and an obligation that no step visits
is never visited.
"""

from __future__ import annotations

from collections import deque
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING

from scbm.model import OperationState, Role, format_value
from scbm.model.sources import free_groups
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, NO_OPERATION, PLAN_STATE
from scbm.proofcheck.certificate import Awaits, CertificateFlaw
from scbm.proofcheck.checked_run import UncheckableStepError
from scbm.proofcheck.guarded_parts import GuardedPart, may_leave, parts_of
from scbm.proofcheck.interpreter import Interpreter
from scbm.proofcheck.valuations import TooManyStepsError, valuations

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.proofcheck.certificate import ClaimedObligation, GoalRuns, RunsArgument, Situation
    from scbm.proofcheck.checked_run import CheckedStep
    from scbm.proofcheck.guarded_parts import Values


def check_variables(
    variables: Sequence[str], model: BehaviorModel, read: Iterable[str] = ()
) -> Iterator[CertificateFlaw]:
    """Yield a flaw for each way in which a variable that is not among `variables` could influence a run.

    `read` are variables that requirements read.
    """
    space = model.running_space
    possible = [variable.name for variable in space if variable.role is not Role.OPERATION_STATE]
    if list(variables) != [name for name in possible if name in variables]:
        yield CertificateFlaw(
            "the variables", "they are not some of the model without `<operation>.state`, each once and in order"
        )
        return
    left_out = [name for name in possible if name not in variables]
    of_requirements = ((name, "a requirement reads it") for name in read)
    for name, reason in chain(_uses(variables, model), of_requirements):
        if name in left_out:
            yield CertificateFlaw(f"variable {name}", f"it is left out, but {reason}")


def _uses(kept: Sequence[str], model: BehaviorModel) -> Iterator[tuple[str, str]]:
    """Yield each variable that can influence a run, with the reason."""
    for resource in model.resources:
        for name in (resource.trigger, resource.request_state):
            yield name, "requests are sent by it"
    for name in (CURRENT_NAME, CURRENT_STATE, PLAN_STATE):
        yield name, "the runner keeps it"
    for goal, predicate in model.goals:
        for name in predicate.reads():
            yield name, f"the goal {goal} reads it"
    for part in parts_of(model):
        yield from _uses_of_part(part, kept, model)


def _uses_of_part(part: GuardedPart, kept: Sequence[str], model: BehaviorModel) -> Iterator[tuple[str, str]]:
    for name in part.guard.reads():
        yield name, f"the guard of {part.what} reads it"
    for action in part.actions:
        if part.is_automatic:
            yield action.target, f"{part.what} is taken only if it changes something: {action}"
        if may_leave(action, model.running_space):
            yield action.target, f"{part.what} is taken only if this fits: {action}"
        if action.target in kept:
            for name in action.reads():
                yield name, f"{part.what} reads it: {action}"


MAX_INITIAL_STATES = 4_000_000
"""Maximum number of initial states, complete or partial, that are tried."""
_MAX_SHOWN = 300
"""Maximum number of characters of a situation in a message."""


def check_runs(
    claimed: Sequence[ClaimedObligation], argument: RunsArgument, model: BehaviorModel
) -> Iterator[CertificateFlaw]:
    """Yield the flaws of the variables and goals, or else of the situations of each goal."""
    flaws = [*wrong_runs(argument, model)]
    yield from flaws
    if not flaws:
        names = tuple(str(obligation) for obligation in claimed)
        yield from _wrong_steps([*_checks(argument, model, names)], argument, model)


def wrong_runs(argument: RunsArgument, model: BehaviorModel, read: Iterable[str] = ()) -> Iterator[CertificateFlaw]:
    """Yield the flaws of the variables and goals, or else of the situations, but for their steps.

    `read` are variables that requirements read.
    """
    flaws = [*check_variables(argument.variables, model, read)]
    if not model.goals or [runs.goal for runs in argument.runs] != [goal for goal, _ in model.goals]:
        flaws.append(CertificateFlaw("the goals", "they are not those of the model, each once and in order"))
    yield from flaws
    if not flaws:
        yield from (flaw for check in _checks(argument, model, ()) for flaw in check.malformed())


def _checks(argument: RunsArgument, model: BehaviorModel, names: tuple[str, ...]) -> Iterator[_RunsCheck]:
    for (_, goal), runs in zip(model.goals, argument.runs, strict=True):
        yield _RunsCheck(runs, _interpreter(argument, goal, model), argument.variables, names)


def _interpreter(argument: RunsArgument, goal: Predicate, model: BehaviorModel) -> Interpreter:
    return Interpreter(model, goal, argument.variables, argument.goals, argument.plans)


def _wrong_steps(
    checks: Sequence[_RunsCheck], argument: RunsArgument, model: BehaviorModel
) -> Iterator[CertificateFlaw]:
    """Yield the flaws of the steps from all states in which the runner can be at rest, and from all situations."""
    rests: dict[tuple[Value, ...], Values] = {}
    try:
        for state in initial_states(argument.variables, model):
            yield from checks[0].wrong_start(state)
    except TooManyStepsError:
        yield CertificateFlaw("the initial states", "there are too many to check")
        return
    yield from _wrong_rests(checks, rests)
    for check in checks:
        yield from check.wrong_steps()
    yield from _wrong_rests(checks, rests)


def _wrong_rests(checks: Sequence[_RunsCheck], known: dict[tuple[Value, ...], Values]) -> Iterator[CertificateFlaw]:
    """Yield the flaws of what follows the new states in which the runner is at rest, and of what follows those."""
    todo = deque(rest for check in checks for rest in check.new_rests(known))
    while todo:
        rest = todo.popleft()
        yield from checks[0].wrong_at_rest(rest)
        for check in checks:
            yield from check.wrong_beginnings(rest)
            todo += check.new_rests(known)


def initial_states(variables: Sequence[str], model: BehaviorModel) -> Iterator[dict[str, Value]]:
    """Yield the initial states of runs, restricted to these variables and those of `initial_states`.

    These are the allowed combinations of random values, and the nominal state. In both, what changes freely from
    outside has any of its values (semantics 7.2).

    Raises `TooManyStepsError`.
    """
    read = model.initial_states.reads()
    for known in initial_values(model):
        values = {name: each for name, each in known.items() if name in variables or name in read}
        # What has one value only needs no choice, and what the predicate reads is chosen before the rest.
        order = sorted(values, key=lambda name: (len(values[name]) > 1, name not in read))
        choices = {name: values[name] for name in order}
        for state in valuations(model.initial_states, choices, MAX_INITIAL_STATES):
            yield {name: state[name] for name in values}


def initial_values(model: BehaviorModel) -> tuple[dict[str, tuple[Value, ...]], ...]:
    """Return the values of the variables of the world in which runs begin: nominal ones, and random ones besides.

    `initial_states` holds in the combinations that are allowed.
    """
    free = _free_values(model)
    random = {v.name: free.get(v.name, v.random) for v in model.space}
    nominal = {v.name: free.get(v.name, (v.initial,)) for v in model.space}
    is_drawn = all(value in random[name] for name, values in nominal.items() for value in values)
    return (random,) if is_drawn else (nominal, random)


def _free_values(model: BehaviorModel) -> dict[str, tuple[Value, ...]]:
    """Return the initial values of the variables that change freely from outside, nominal and random ones included."""
    found: dict[str, dict[Value, None]] = {}
    for group in free_groups(model):
        for name, values in group.values:
            variable = model.space[name]
            known = found.setdefault(name, dict.fromkeys((variable.initial, *variable.random)))
            known.update(dict.fromkeys(values))
    return {name: tuple(values) for name, values in found.items()}


class _RunsCheck:
    """The check of the situations of one goal."""

    def __init__(
        self, runs: GoalRuns, interpreter: Interpreter, variables: tuple[str, ...], claimed: tuple[str, ...]
    ) -> None:
        """`claimed` are the names of the obligations that are claimed."""
        self.interpreter = interpreter
        self._model = interpreter.model
        self._runs = runs
        self._variables = variables
        self._claimed = claimed
        self._listed = dict.fromkeys(runs.situations)
        self._ends: dict[tuple[Value, ...], Values] = {}

    def malformed(self) -> Iterator[CertificateFlaw]:
        """Yield what is no situation of the model."""
        goal, planned = self._runs.goal, self.interpreter.planned
        if self._runs.planned != planned:
            names = ", ".join(planned) or "none"
            yield CertificateFlaw(f"goal {goal}", f"plans to it depend on other variables than those named: {names}")
            return
        for number, situation in enumerate(self._runs.situations, start=1):
            reason = _what_is_malformed(situation, self._variables, self._model, planned)
            if reason is not None:
                yield CertificateFlaw(f"goal {goal}, situation {number}", reason)

    def wrong_steps(self) -> Iterator[CertificateFlaw]:
        """Yield the flaws of the steps from situations."""
        for number, situation in enumerate(self._runs.situations, start=1):
            where = f"goal {self._runs.goal}, situation {number}"
            for event in self.interpreter.events(situation):
                step = partial(self.interpreter.after, situation, event)
                yield from self._check(step, f"{where}, {event}")
            ended = self.interpreter.cut_off(situation)
            if ended is not None:
                self._keep(ended)
                yield from self._check_visited(ended.visited, f"{where}, the time limit passes")

    def wrong_start(self, state: dict[str, Value]) -> Iterator[CertificateFlaw]:
        """Yield the flaws of the step in which the runner starts in an initial state, and settles without a goal."""
        step = self.interpreter.start(state)
        self._keep(step)
        yield from self._check_visited(step.visited, f"the start, from {self._rest_words(step.values)}")

    def wrong_beginnings(self, rest: Values) -> Iterator[CertificateFlaw]:
        """Yield the flaws of the step in which the goal is given to a runner at rest."""
        where = f"goal {self._runs.goal}, from {self._rest_words(rest)}"
        yield from self._check(partial(self.interpreter.begin, rest), where)

    def wrong_at_rest(self, rest: Values) -> Iterator[CertificateFlaw]:
        """Yield the flaws of what follows while no goal is pursued."""
        for step in self.interpreter.at_rest(rest):
            self._keep(step)
            where = f"no goal, from {self._rest_words(rest)}"
            yield from self._check_visited(step.visited, where)

    def new_rests(self, known: dict[tuple[Value, ...], Values]) -> list[Values]:
        """Add the values in which runs have ended so far to the known ones, and return those that are new."""
        new = {key: values for key, values in self._ends.items() if key not in known}
        self._ends = {}
        known.update(new)
        return list(new.values())

    def _keep(self, step: CheckedStep) -> None:
        for values in step.rests:
            self._ends[tuple(values.values())] = values

    def _check(self, take: Callable[[], CheckedStep], where: str) -> Iterator[CertificateFlaw]:
        try:
            step = take()
        except UncheckableStepError as error:
            yield CertificateFlaw(where, str(error))
            return
        self._keep(step)
        yield from self._check_visited(step.visited, where)
        yield from self._check_visited(step.cut_off, f"{where}, the limit of plans is reached")
        if step.situation is not None and step.situation not in self._listed:
            yield CertificateFlaw(
                where, f"leads to a situation that is not listed: {self._situation_words(step.situation)}"
            )

    def _check_visited(self, visited: tuple[str, ...], where: str) -> Iterator[CertificateFlaw]:
        for name in visited:
            if name in self._claimed:
                yield CertificateFlaw(where, f"visits {name}, which is claimed never to be visited")

    def _rest_words(self, rest: Values) -> str:
        """Return the values of a runner at rest, without its own variables that are as at the beginning."""
        space = self._model.running_space
        shown = [n for n in self._variables if not space[n].role.is_runner or rest[n] != space[n].initial]
        return _shown({name: rest[name] for name in shown})

    def _situation_words(self, situation: Situation) -> str:
        parts = [_shown(dict(zip(self._variables, situation.values, strict=True)))]
        queue = ", ".join(map(format_value, situation.queue or ()))
        parts += [f"queue {queue}"] if situation.queue is not None else []
        parts += [f"in flight {', '.join(situation.in_flight)}"] if situation.in_flight else []
        parts += [f"awaits {situation.awaits}"] if situation.awaits is not Awaits.NOTHING else []
        return "; ".join(parts)


def _shown(values: dict[str, Value]) -> str:
    text = ", ".join(f"{name}={format_value(value)}" for name, value in values.items())
    return text if len(text) <= _MAX_SHOWN else f"{text[:_MAX_SHOWN]}…"


def _what_is_malformed(
    situation: Situation, variables: tuple[str, ...], model: BehaviorModel, planned: tuple[str, ...]
) -> str | None:
    """Return why this is no situation of the model; `None` if it is one."""
    if len(situation.values) != len(variables):
        return f"it has {len(situation.values)} values for {len(variables)} variables"
    for name, value in zip(variables, situation.values, strict=True):
        if value not in model.running_space[name].domain:
            return f"{name} cannot be {format_value(value)}"
    reason = None if situation.queue is None else _what_is_wrong_in(situation.queue, model, planned)
    if reason is not None:
        return reason
    resources = [resource.name for resource in model.resources]
    if [*dict.fromkeys(n for n in situation.in_flight if n in resources)] != [*situation.in_flight]:
        return "its requests in flight do not name resources of the model, each once"
    return _what_contradicts(situation, dict(zip(variables, situation.values, strict=True)))


def _what_is_wrong_in(queue: tuple[Value, ...], model: BehaviorModel, planned: tuple[str, ...]) -> str | None:
    if not planned:
        operations = [operation.name for operation in model.operations]
        return None if all(name in operations for name in queue) else "its queue has something that is no operation"
    domains = [model.space[name].domain for name in planned]
    if len(queue) != len(planned) or not all(value in domain for value, domain in zip(queue, domains, strict=True)):
        return "its queue is no state of the variables on which plans depend"
    return None


def _what_contradicts(situation: Situation, values: dict[str, Value]) -> str | None:
    if values[CURRENT_NAME] == NO_OPERATION and values[CURRENT_STATE] != OperationState.INITIAL:
        return "no operation is current, but current.state is not initial"
    if situation.awaits is not Awaits.NOTHING and values[CURRENT_NAME] != NO_OPERATION:
        return f"it awaits {situation.awaits} while an operation is current"
    if situation.queue is not None and situation.awaits not in (Awaits.NOTHING, Awaits.PLAN, Awaits.NEXT):
        return f"it awaits {situation.awaits} while there is a queue"
    return None
