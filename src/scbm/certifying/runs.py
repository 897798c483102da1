"""A set of situations that no step of any run leaves, and on whose steps nothing claimed is visited (`RunsArgument`).

That is an induction over the events of a run: its first situation is one of the set, and whatever comes next leads to
one of the set, or to the end. So all situations of all runs are among them, and what no step visits is never visited.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.certifying.certificate import Awaits
from scbm.certifying.flaws import Flaw
from scbm.certifying.interpreter import Interpreter
from scbm.certifying.relevance import check_variables
from scbm.certifying.valuations import TooManyStepsError, valuations
from scbm.model import OperationState, format_value
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, NO_OPERATION

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.certifying.certificate import RunsArgument, Situation
    from scbm.certifying.steps import Step
    from scbm.coverage import Obligation
    from scbm.model import BehaviorModel, Value

MOST_INITIAL_STATES = 4_000_000
"""So many initial states, allowed or not and whole or in part, are looked at."""
_MOST_SHOWN = 300
"""So many characters of a situation are told."""


def check_runs(claimed: Sequence[Obligation], argument: RunsArgument, model: BehaviorModel) -> Iterator[Flaw]:
    """What is wrong with the variables, or else with the goals, or else with the situations of each goal."""
    flaws = [*check_variables(argument.variables, model)]
    if [goal for goal, _ in argument.runs] != [goal for goal, _ in model.goals]:
        flaws.append(Flaw("the goals", "they are not those of the model, each once and in order"))
    yield from flaws
    if flaws:
        return
    names = tuple(str(obligation) for obligation in claimed)
    for (goal, predicate), (_, situations) in zip(model.goals, argument.runs, strict=True):
        interpreter = Interpreter(model, predicate, argument.variables)
        yield from _Runs(goal, interpreter, argument.variables, situations, names).check(model)


def initial_states(variables: Sequence[str], model: BehaviorModel) -> Iterator[dict[str, Value]]:
    """The allowed initial states of the world, as far as these variables and `initial_states` tell them apart.

    Raises `TooManyStepsError`.
    """
    read = model.initial_states.reads()
    random = {v.name: v.random for v in model.space if v.name in variables or v.name in read}
    # What has one value only needs no choice, and what the predicate reads is chosen before the rest.
    order = sorted(random, key=lambda name: (len(random[name]) > 1, name not in read))
    choices = {name: random[name] for name in order}
    for state in valuations(model.initial_states, choices, MOST_INITIAL_STATES):
        yield {name: state[name] for name in random}


@dataclass(frozen=True, slots=True)
class _Runs:
    """The situations of one goal, and the names of the obligations that are claimed."""

    goal: str
    interpreter: Interpreter
    variables: tuple[str, ...]
    situations: tuple[Situation, ...]
    claimed: tuple[str, ...]

    def check(self, model: BehaviorModel) -> Iterator[Flaw]:
        """What is wrong with the form of situations, or else with the steps between them."""
        malformed = [*self._malformed(model)]
        yield from malformed or self._wrong_steps(model)

    def _malformed(self, model: BehaviorModel) -> Iterator[Flaw]:
        for number, situation in enumerate(self.situations, start=1):
            reason = _what_is_malformed(situation, self.variables, model)
            if reason is not None:
                yield Flaw(f"goal {self.goal}, situation {number}", reason)

    def _wrong_steps(self, model: BehaviorModel) -> Iterator[Flaw]:
        listed = dict.fromkeys(self.situations)
        try:
            for state in initial_states(self.variables, model):
                where = f"goal {self.goal}, from {_shown(state)}"
                yield from self._check(self.interpreter.begin(state), listed, where)
        except TooManyStepsError:
            yield Flaw(f"goal {self.goal}", "there are too many initial states to check")
        for number, situation in enumerate(self.situations, start=1):
            where = f"goal {self.goal}, situation {number}"
            for event in self.interpreter.events(situation):
                yield from self._check(self.interpreter.after(situation, event), listed, f"{where}, {event}")
            yield from self._check_visited(self.interpreter.cut_off(situation), f"{where}, the time limit passes")

    def _check(self, step: Step, listed: dict[Situation, None], where: str) -> Iterator[Flaw]:
        yield from self._check_visited(step.visited, where)
        yield from self._check_visited(step.cut_off, f"{where}, the limit of plans is reached")
        if step.situation is not None and step.situation not in listed:
            yield Flaw(where, f"leads to a situation that is not listed: {self._told(step.situation)}")

    def _check_visited(self, visited: tuple[str, ...], where: str) -> Iterator[Flaw]:
        for name in visited:
            if name in self.claimed:
                yield Flaw(where, f"visits {name}, which is claimed never to be visited")

    def _told(self, situation: Situation) -> str:
        parts = [_shown(dict(zip(self.variables, situation.values, strict=True)))]
        parts += [f"queue {', '.join(situation.queue)}"] if situation.queue else []
        parts += [f"in flight {', '.join(situation.in_flight)}"] if situation.in_flight else []
        parts += [f"awaits {situation.awaits}"] if situation.awaits is not Awaits.NOTHING else []
        return "; ".join(parts)


def _shown(values: dict[str, Value]) -> str:
    text = ", ".join(f"{name}={format_value(value)}" for name, value in values.items())
    return text if len(text) <= _MOST_SHOWN else f"{text[:_MOST_SHOWN]}…"


def _what_is_malformed(situation: Situation, variables: tuple[str, ...], model: BehaviorModel) -> str | None:
    """Why this is no situation of the model at all."""
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
