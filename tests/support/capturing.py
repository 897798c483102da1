"""Simulated runs, taken down as the logs that real runs leave."""

from __future__ import annotations

from fractions import Fraction

from scbm.cases import Case
from scbm.cases.trace import MessageDisturbed, Record, ResourceChanged, Trace, trace_digest
from scbm.model import BehaviorModel
from scbm.planning import PlanLimits
from scbm.running import Effect, Event, GoalGiven, InjectionGiven, Runner, RunnerOptions
from scbm.running.simulation import Choices, DrawnReactions, PlainReactions, Simulated, Simulator
from scbm.running.simulation.simulator import _SimulationRun
from scbm.testing.event_logs.event_log import EventLog, LogStep
from scbm.testing.random_streams import message_stream, reaction_stream

DIGEST = "0" * 64


def captured(
    model: BehaviorModel,
    case: Case,
    options: RunnerOptions | None = None,
    plan_limits: PlanLimits | None = None,
) -> tuple[EventLog, tuple[Record, ...]]:
    """A case run in simulation: the log of its events, and its records as the simulation has them."""
    simulator = _CapturingSimulator(model, options, plan_limits)
    if case.origin is None:
        choices = Choices(PlainReactions(), case.outcomes, case.network)
    else:
        messages = message_stream(case.origin) if case.network.draws else None
        drawn = DrawnReactions(reaction_stream(case.origin))
        choices = Choices(drawn, case.outcomes, case.network, messages)
    run = simulator.run(case, choices)
    trace = trace_digest(Trace(model.name, case.name, run.records))
    steps, in_force = tuple(simulator.steps), simulator.options_in_force
    log = EventLog(model.name, DIGEST, case, in_force, Fraction(20), (), steps, choices.taken, run.end, trace)
    return log, run.records


class _CapturingSimulator(Simulator):
    """Keeps what its runner was given, and what its network noted."""

    steps: list[LogStep]
    options_in_force: RunnerOptions

    def run(self, case: Case, choices: Choices, most_records: int | None = None) -> Simulated:
        self.steps = []
        self.options_in_force = self.options_for(case.limits)
        tape = _Tape(self.steps)
        run = _SimulationRun(self, _CapturedRunner(self, case, tape), choices, case)
        run._records = tape
        for injection in case.injections:
            run.schedule(0, InjectionGiven(injection))
        for goal in case.goals:
            run.schedule(0, GoalGiven(goal.name, goal.predicate, goal.when))
        run.plan_restarts(case.network.restarts)
        return run.finish(most_records)


class _Tape(list[Record]):
    """The records of a run; what the network says becomes a step too, at its place behind the event before it."""

    def __init__(self, steps: list[LogStep]) -> None:
        super().__init__()
        self.steps = steps
        self.since = 0

    def append(self, record: Record) -> None:
        if isinstance(record, MessageDisturbed) or (
            isinstance(record, ResourceChanged) and record.injection == "network"
        ):
            self.steps.append(LogStep(record.at_ns, record, len(self) - self.since))
        super().append(record)


class _CapturedRunner(Runner):
    def __init__(self, simulator: _CapturingSimulator, case: Case, tape: _Tape) -> None:
        super().__init__(simulator.program, case.initial, simulator.options_in_force)
        self._tape = tape

    def handle(self, event: Event, now_ns: int) -> list[Effect]:
        self._tape.since = len(self._tape)
        self._tape.steps.append(LogStep(now_ns, event))
        return super().handle(event, now_ns)
