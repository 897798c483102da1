"""Checks a set of situations that no step of a run leaves, with no visit to a claimed obligation (`RunsArgument`).

The check is an induction over the events of a run. Its first situation is in the set, and every event leads to a
situation in the set, or to the end. So all situations of all runs are in the set, and an obligation that no step visits
is never visited.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from scbm.model import OperationState, Role, format_value
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, NO_OPERATION, PLAN_STATE
from scbm.proofcheck.certificate import Awaits, CertificateFlaw
from scbm.proofcheck.checked_run import UncheckableStepError
from scbm.proofcheck.guarded_parts import GuardedPart, may_leave, parts_of
from scbm.proofcheck.interpreter import Interpreter
from scbm.proofcheck.valuations import TooManyStepsError, valuations

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from scbm.model import BehaviorModel, Value
    from scbm.proofcheck.certificate import ClaimedObligation, RunsArgument, Situation
    from scbm.proofcheck.checked_run import CheckedStep


def check_variables(variables: Sequence[str], model: BehaviorModel) -> Iterator[CertificateFlaw]:
    """Yield a flaw for each way in which a variable that is not among `variables` could influence a run."""
    space = model.running_space
    possible = [variable.name for variable in space if variable.role is not Role.OPERATION_STATE]
    if list(variables) != [name for name in possible if name in variables]:
        yield CertificateFlaw(
            "the variables", "they are not some of the model without `<operation>.state`, each once and in order"
        )
        return
    left_out = [name for name in possible if name not in variables]
    for name, reason in _uses(variables, model):
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
    flaws = [*check_variables(argument.variables, model)]
    if [goal for goal, _ in argument.runs] != [goal for goal, _ in model.goals]:
        flaws.append(CertificateFlaw("the goals", "they are not those of the model, each once and in order"))
    yield from flaws
    if flaws:
        return
    names = tuple(str(obligation) for obligation in claimed)
    for (goal, predicate), (_, situations) in zip(model.goals, argument.runs, strict=True):
        interpreter = Interpreter(model, predicate, argument.variables)
        yield from _RunsCheck(goal, interpreter, argument.variables, situations, names).check(model)


def initial_states(variables: Sequence[str], model: BehaviorModel) -> Iterator[dict[str, Value]]:
    """Yield the initial states of runs, restricted to these variables and those of `initial_states`.

    These are the allowed combinations of random values, and the nominal state unless `initial_states` forbids it.

    Raises `TooManyStepsError`.
    """
    read = model.initial_states.reads()
    random = {v.name: v.random for v in model.space if v.name in variables or v.name in read}
    # What has one value only needs no choice, and what the predicate reads is chosen before the rest.
    order = sorted(random, key=lambda name: (len(random[name]) > 1, name not in read))
    choices = {name: random[name] for name in order}
    nominal = {name: model.nominal_state[name] for name in random}
    is_drawn = all(nominal[name] in choices[name] for name in order)
    if not is_drawn and model.initial_states.holds(nominal):
        yield nominal
    for state in valuations(model.initial_states, choices, MAX_INITIAL_STATES):
        yield {name: state[name] for name in random}


@dataclass(frozen=True, slots=True)
class _RunsCheck:
    """The situations of one goal, and the names of the obligations that are claimed."""

    goal: str
    interpreter: Interpreter
    variables: tuple[str, ...]
    situations: tuple[Situation, ...]
    claimed: tuple[str, ...]

    def check(self, model: BehaviorModel) -> Iterator[CertificateFlaw]:
        """Yield the flaws in the form of situations, or else in the steps between them."""
        malformed = [*self._malformed(model)]
        yield from malformed or self._wrong_steps(model)

    def _malformed(self, model: BehaviorModel) -> Iterator[CertificateFlaw]:
        for number, situation in enumerate(self.situations, start=1):
            reason = _what_is_malformed(situation, self.variables, model)
            if reason is not None:
                yield CertificateFlaw(f"goal {self.goal}, situation {number}", reason)

    def _wrong_steps(self, model: BehaviorModel) -> Iterator[CertificateFlaw]:
        listed = dict.fromkeys(self.situations)
        try:
            for state in initial_states(self.variables, model):
                where = f"goal {self.goal}, from {_shown(state)}"
                yield from self._check(partial(self.interpreter.begin, state), listed, where)
        except TooManyStepsError:
            yield CertificateFlaw(f"goal {self.goal}", "there are too many initial states to check")
        for number, situation in enumerate(self.situations, start=1):
            where = f"goal {self.goal}, situation {number}"
            for event in self.interpreter.events(situation):
                step = partial(self.interpreter.after, situation, event)
                yield from self._check(step, listed, f"{where}, {event}")
            yield from self._check_visited(self.interpreter.cut_off(situation), f"{where}, the time limit passes")

    def _check(
        self, take: Callable[[], CheckedStep], listed: dict[Situation, None], where: str
    ) -> Iterator[CertificateFlaw]:
        try:
            step = take()
        except UncheckableStepError as error:
            yield CertificateFlaw(where, str(error))
            return
        yield from self._check_visited(step.visited, where)
        yield from self._check_visited(step.cut_off, f"{where}, the limit of plans is reached")
        if step.situation is not None and step.situation not in listed:
            yield CertificateFlaw(
                where, f"leads to a situation that is not listed: {self._situation_words(step.situation)}"
            )

    def _check_visited(self, visited: tuple[str, ...], where: str) -> Iterator[CertificateFlaw]:
        for name in visited:
            if name in self.claimed:
                yield CertificateFlaw(where, f"visits {name}, which is claimed never to be visited")

    def _situation_words(self, situation: Situation) -> str:
        parts = [_shown(dict(zip(self.variables, situation.values, strict=True)))]
        parts += [f"queue {', '.join(situation.queue)}"] if situation.queue else []
        parts += [f"in flight {', '.join(situation.in_flight)}"] if situation.in_flight else []
        parts += [f"awaits {situation.awaits}"] if situation.awaits is not Awaits.NOTHING else []
        return "; ".join(parts)


def _shown(values: dict[str, Value]) -> str:
    text = ", ".join(f"{name}={format_value(value)}" for name, value in values.items())
    return text if len(text) <= _MAX_SHOWN else f"{text[:_MAX_SHOWN]}…"


def _what_is_malformed(situation: Situation, variables: tuple[str, ...], model: BehaviorModel) -> str | None:
    """Return why this is no situation of the model; `None` if it is one."""
    if len(situation.values) != len(variables):
        return f"it has {len(situation.values)} values for {len(variables)} variables"
    for name, value in zip(variables, situation.values, strict=True):
        if value not in model.running_space[name].domain:
            return f"{name} cannot be {format_value(value)}"
    operations = [operation.name for operation in model.operations]
    if not all(name in operations for name in situation.queue):
        return "its queue has something that is no operation"
    resources = [resource.name for resource in model.resources]
    if [*dict.fromkeys(n for n in situation.in_flight if n in resources)] != [*situation.in_flight]:
        return "what is in flight is not some of the resources, each once"
    return _what_contradicts(situation, dict(zip(variables, situation.values, strict=True)))


def _what_contradicts(situation: Situation, values: dict[str, Value]) -> str | None:
    if values[CURRENT_NAME] == NO_OPERATION and values[CURRENT_STATE] != OperationState.INITIAL:
        return "no operation is current, but current.state is not initial"
    if situation.awaits is not Awaits.NOTHING and values[CURRENT_NAME] != NO_OPERATION:
        return f"it awaits {situation.awaits} while an operation is current"
    if situation.queue and situation.awaits not in (Awaits.NOTHING, Awaits.PLAN):
        return f"it awaits {situation.awaits} while there is a queue"
    return None
