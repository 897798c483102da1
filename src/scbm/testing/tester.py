"""Runs cases of one model in simulation, judges runs of any origin, and measures what they visit."""

from __future__ import annotations

from copy import copy
from functools import cached_property
from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.cases import RecordedPlan, RecordedRun
from scbm.cases.coverage import Obligations, visited_by
from scbm.cases.trace import (
    InjectionApplied,
    PlanReceived,
    PutBack,
    ResourceChanged,
    Trace,
    connection_sentence,
    ranges_of_goals,
    sentence_of,
)
from scbm.model import InitialStates, RunPlans, format_moment
from scbm.model.struct_classes import PartlyCompared
from scbm.planning import (
    PLANNERS,
    DrawnPlans,
    PlanCache,
    PreferredPlans,
    ShortestPlans,
    planner_of,
    planner_of_random_runs,
)
from scbm.running.simulation import (
    Choices,
    DrawnMoves,
    DrawnReactions,
    PlainReactions,
    RecordedMoves,
    Simulator,
    leave_nothing_open,
)
from scbm.testing.built_in_requirements import BuiltInJudge
from scbm.testing.campaign import CaseResult
from scbm.testing.continuations.unjudged import Unjudged
from scbm.testing.random_streams import draw_plans, environment_stream, message_stream, reaction_stream
from scbm.testing.recorded_results import RecordCheck, check_record, goals_to_record
from scbm.testing.requirement_monitors import find_violations
from scbm.testing.verdicts import (
    ExcuseRules,
    Outcomes,
    Verdict,
    find_unused,
    impossible,
    judge,
    lost,
    never_came,
    silent_outside,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from scbm.cases import Case, EnvironmentChange, Reaction, RecordedGoal
    from scbm.cases.trace import Record, RunSpans, Sentence
    from scbm.cases.trace.repetitions import Repetition
    from scbm.model import BehaviorModel, PlannerIdentity, Predicate, Value
    from scbm.planning import Answer, PlanLimits, Planner, PlanSource
    from scbm.running import RunnerOptions
    from scbm.running.program import Program
    from scbm.running.simulation import Simulated
    from scbm.running.simulation.device_hazards import Hazard
    from scbm.running.simulation.environment_moves import EnvironmentMoves
    from scbm.running.simulation.excluded_values import ExcludedValue
    from scbm.testing.event_logs.event_log import EventLog
    from scbm.testing.requirement_monitors import Violation


class Execution(PartlyCompared, frozen=True, dict=True):
    """A case that was run, or that was lost: then its trace ends at the loss.

    Attributes:
        case: the case as it was given.
        reactions: what happened to its requests, in order.
        trace: what happened.
        verdict: what that means.
        ended_ns: how long the run took, in time of the run.
        violations: the first violation of each requirement that was broken.
        visited: the obligations that it visited, as bits.
        unused: the clauses of the case that had no effect, one sentence each.
        log: of a real run what happened to the runner; the case alone does not give that run again.
        forced: of what it visited the obligations that it visited only after its state was forced, as bits.
        forced_by: the index in the trace of the record from which on the state is forced; `None` if it never is.
        moves: what the environment changed; `None` if nothing decided about it.
        model: the model; `None` if its result is not to be recorded.
        notes: what a reader of the run should know, one sentence each: changes at other times than rates allow, and on
            a mutant the changes that were left out.
        excluded: over nodes the values that drivers sent and the model excludes.
        unjudged: why `non_blocking` does not judge the case; `None` if it does, or is switched off.
        hazards: in a simulation what devices did and the controller did not know.
    """

    case: Case
    reactions: tuple[Reaction, ...]
    trace: Trace
    verdict: Verdict
    ended_ns: int
    violations: tuple[Violation, ...]
    visited: int
    unused: tuple[str, ...] = ()
    log: EventLog | None = None
    forced: int = 0
    forced_by: int | None = None
    moves: tuple[EnvironmentChange, ...] | None = None
    model: BehaviorModel | None = None
    notes: tuple[str, ...] = ()
    excluded: tuple[ExcludedValue, ...] = ()
    unjudged: Unjudged | None = None
    hazards: tuple[Hazard, ...] = ()
    uncompared = ("model",)

    def __repr__(self) -> str:
        return f"<Execution of {self.case.name}: {'passed' if self.verdict.passed else 'failed'}>"

    def __str__(self) -> str:
        """Return the run as lines: how it ended, what happened and when, and why the case failed."""
        nominal = {} if self.model is None else self.model.nominal_state
        events = ((record.at_ns, self.sentence(record, nominal)) for record in self.trace.records)
        lines = [f"{format_moment(at_ns):>11}  {each.numbered_text}" for at_ns, each in events if each.label]
        ended = f"{self.case.name}: {self.verdict.end_in_words} after {format_moment(self.ended_ns)}"
        return "\n".join([ended, *lines, *(f"failed: {failure}" for failure in self.verdict.failures)])

    @property
    def result(self) -> CaseResult:
        """The result that a campaign keeps."""
        requests, excluded = len(self.reactions), len(self.excluded)
        visits = (self.visited, self.unused, self.forced, excluded, self.hazards, self.unjudged)
        return CaseResult(self.case, requests, self.verdict, self.ended_ns, *visits)

    @property
    def visited_freely(self) -> int:
        """The visits before its state was forced, as bits; all visits if nothing was forced."""
        return self.visited & ~self.forced

    @property
    def repetition(self) -> Repetition | None:
        """The turn that repeats until the end of the last run for a goal; `None` if none does."""
        from scbm.cases.trace.repetitions import find_repetition  # noqa: PLC0415 - few runs are shown

        return find_repetition(self.trace.records)

    @cached_property
    def spans(self) -> RunSpans:
        """The spans of operations, requests, plans and faults in the run."""
        from scbm.cases.trace import spans_of  # noqa: PLC0415 - few runs are shown

        held = {each.name: each.hold_ns for each in self.case.injections if each.hold_ns is not None}
        return spans_of(self.trace.records, self.ended_ns, held)

    def sentence(self, record: Record, nominal: Mapping[str, Value]) -> Sentence:
        """Return the sentence for a record of the run; `nominal` is the nominal state of the model."""
        if isinstance(record, ResourceChanged) and self._has_lost_or_found(record):
            return connection_sentence(record)
        return sentence_of(record, nominal)

    def _has_lost_or_found(self, record: ResourceChanged) -> bool:
        """Return whether a resource was lost or came back with its node or driver, without an injection of the case."""
        injections = [injection.name for injection in self.case.injections]
        restarted = [restart.resource for restart in self.case.network.restarts_of_resources]
        return self.log is not None and record.injection not in injections and record.resource not in restarted

    @property
    def digest(self) -> str:
        """The digest of the trace."""
        from scbm.cases.trace import trace_digest  # noqa: PLC0415 - few runs are recorded

        return trace_digest(self.trace)

    @property
    def closed_case(self) -> Case:
        """The case with all decisions of its run written into it: it gives the same trace without draws.

        Faults that the reactions do not record, such as partitions, stay; the other effects of the network become rules
        of requests.
        """
        outcomes = leave_nothing_open(self.reactions)
        moves = self.case.environment if self.moves is None else self.moves
        kept = replace(self.case, outcomes=outcomes, network=self.case.network.kept, plans=self.plans_to_keep)
        return kept if moves is None else replace(kept, environment=moves)

    @property
    def plans_to_keep(self) -> tuple[RecordedPlan, ...]:
        """The answers of the planner, if another program made them, or they were drawn: the next ones may differ."""
        entry = PLANNERS.get(self.trace.planner.name)
        return self.case.plans if entry is not None and not entry.is_external else self.answers

    @property
    def answers(self) -> tuple[RecordedPlan, ...]:
        """The answers of the planner in the run, whichever planner it was."""
        received = {record.ask: record for record in self.trace.records if isinstance(record, PlanReceived)}
        asks = range(1, max(received, default=0) + 1)
        return tuple(
            RecordedPlan(received[ask].status, received[ask].plan) if ask in received else _OUTDATED for ask in asks
        )

    @property
    def recorded(self) -> RecordedRun:
        """The end and the digest of the run, and what the run for each goal did if the case passed in simulation."""
        goals = self.recorded_goals if self.verdict.passed else ()
        return RecordedRun(self.verdict.end.value, self.digest, self.trace.planner, goals)

    @property
    def recorded_goals(self) -> tuple[RecordedGoal, ...]:
        """The recorded result of each goal; empty for a run over nodes, whose times differ from run to run."""
        if self.model is None or self.log is not None:
            return ()
        return goals_to_record(self.trace.records, self.model, Obligations.of(self.model))

    @property
    def recorded_case(self) -> Case:
        """The closed case with the result of its run."""
        return replace(self.closed_case, recorded=self.recorded)


_OUTDATED = RecordedPlan("no_plan_found")
"""Stands for an answer that the runner ignored."""


class Tester:
    """Runs cases of one model in simulation, and judges them; it also judges runs over nodes, and lost ones."""

    __test__ = False  # its name looks to pytest like that of a class of tests

    def __init__(
        self,
        model: BehaviorModel,
        options: RunnerOptions | None = None,
        plan_limits: PlanLimits | None = None,
        plans: PlanSource | None = None,
        program: Program | None = None,
    ) -> None:
        """Prepare runs.

        Args:
            model: the model.
            options: the limits of runs; by default those of `RunnerOptions`.
            plan_limits: the limits of each plan; by default those of the model.
            plans: answers questions for plans; by default a cache of the planner's answers.
            program: the compiled model, if it is compiled.
        """
        self.model = model
        self.obligations = Obligations.of(model)
        self._initial = InitialStates(model)
        self._simulator = Simulator(model, options, plan_limits, plans, program)
        self._plain = PlainReactions()
        self._excuses = ExcuseRules.of(model)
        self._built_ins = BuiltInJudge(model, self._excuses, program)

    def of_mutant(self, mutant: BehaviorModel, *, plans_alike: bool) -> Tester:
        """Return a tester of a mutant of the model; it judges runs by the properties and excuses of the model.

        For `plans_alike` see `Simulator.of_mutant`.
        """
        tester = copy(self)
        tester.model, tester._initial = mutant, InitialStates(mutant)  # noqa: SLF001 - of a copy
        tester._simulator = self._simulator.of_mutant(mutant, plans_alike=plans_alike)  # noqa: SLF001 - of a copy
        tester._built_ins = BuiltInJudge(mutant, self._excuses)  # noqa: SLF001 - as above; a rule about its requests
        vars(tester).pop("_shortest", None)  # a cached property about the planner
        return tester

    @property
    def program(self) -> Program:
        """The compiled model."""
        return self._simulator.program

    def plan(self, state: Mapping[str, Value], goal: Predicate) -> Answer:
        """Return the plan that a run gets in a state of the world, unless plans are drawn or its case has them."""
        return self._simulator.plans.plan(state, goal, self._simulator.plan_limits)

    @property
    def planner(self) -> Planner:
        """The planner of runs."""
        return self._simulator.planner

    def execute(self, case: Case, most_records: int | None = None, preferred: Sequence[RecordedPlan] = ()) -> Execution:
        """Run one case. Open choices are drawn from its origin, or take their defaults if it has none.

        Args:
            case: the case.
            most_records: maximum number of records; `None` for no limit.
            preferred: plans that the run gets where they are plans, and shortest ones in a model with drawn plans; only
                for a case that draws none.

        Raises:
            TooLongError: more happens than `most_records`.
            UnplannedError: the source of plans refuses a plan.
            ValueError: the network of the case is a matter of chance, and the case has no origin.
        """
        choices = self.choices_of(case, preferred)
        run = self._simulator.run(case, choices, most_records)
        planner = None if choices.plans is None else planner_of_random_runs(self.model)
        return self.judged(case, run, choices.taken, planner=planner)

    def judged(
        self,
        case: Case,
        run: Simulated,
        reactions: Sequence[Reaction],
        log: EventLog | None = None,
        planner: PlannerIdentity | None = None,
    ) -> Execution:
        """Return a run, simulated or over nodes, with its verdict and the obligations that it visited.

        Args:
            case: what was run.
            run: its end and its records.
            reactions: what happened to its requests, in order.
            log: of a real run what happened to the runner.
            planner: what made the plans of the run, if neither the log nor the model names it.
        """
        if run.impossible is not None:
            trace = Trace(self.model.name, case.name, run.records)
            verdict = impossible(run.impossible)
            found = Execution(case, tuple(reactions), trace, verdict, run.ended_ns, (), 0)
            return replace(found, moves=run.moves, model=self.model, unjudged=Unjudged.NO_RUN)
        violations = find_violations((*self.model.requirements, *case.requirements), run.records)
        visited = visited_by(run.records, self.obligations)
        names = self.obligations.names(visited) if case.expect.visits else ()
        by_goal = self._visited_by_goal(run.records) if case.later else ()
        real = log.real if log else ()
        forced_by = self._forced_by(case, log, run.records)
        outcomes = Outcomes(run.end, run.records, reactions, violations, names, real, by_goal, run.hazards)
        built_in = self._built_ins.find_violations(case, outcomes, forced_by)
        violations += built_in.violations
        outcomes = replace(outcomes, violations=violations)
        trace = Trace(self.model.name, case.name, run.records, planner or self._planner_of(case, log))
        verdict = judge(case, outcomes, self._excuses)
        record = RecordCheck() if log else check_record(case, trace, self.model, self.obligations)
        if record.failures:
            verdict = replace(verdict, failures=(*verdict.failures, *record.failures))
        unused = (*find_unused(case, run.records), *map(never_came, run.missing), *record.unused)
        forced = 0 if forced_by is None else visited & ~visited_by(run.records[:forced_by], self.obligations)
        return Execution(
            case,
            tuple(reactions),
            trace,
            verdict,
            run.ended_ns,
            violations,
            visited,
            unused,
            log,
            forced,
            forced_by,
            run.moves,
            self.model,
            (
                *run.off_rates,
                *(f"{change}; it is left out" for change in run.left_out),
                *silent_outside(case, outcomes, verdict, self._excuses),
            ),
            self._excluded(log, run.records),
            built_in.unjudged,
            run.hazards,
        )

    def _excluded(self, log: EventLog | None, records: Sequence[Record]) -> tuple[ExcludedValue, ...]:
        """Return the values that drivers sent and the model excludes; in a simulation there are none."""
        if log is None:
            return ()
        from scbm.running.simulation.excluded_values import excluded_values  # noqa: PLC0415 - few runs are over nodes

        return tuple(excluded_values(self.program, records))

    def _forced_by(self, case: Case, log: EventLog | None, records: Sequence[Record]) -> int | None:
        """Return the index of the record from which on the state is forced: 0 if no run begins in the initial state."""
        if not self._initial.can_begin(case.initial):
            return 0
        if log is None and not case.injections:
            return None
        forcing = (i for i, r in enumerate(records) if isinstance(r, (InjectionApplied, PutBack)) and r.forced)
        return next(forcing, None)

    def _visited_by_goal(self, records: Sequence[Record]) -> tuple[Sequence[str], ...]:
        """Return the names of the obligations that the run for each goal visited."""
        runs = (records[indices.start : indices.stop] for indices in ranges_of_goals(records))
        return tuple(self.obligations.names(visited_by(run, self.obligations)) for run in runs)

    def _planner_of(self, case: Case, log: EventLog | None) -> PlannerIdentity:
        """Return the planner that made the plans of a run; it need not be installed if the case has the plans."""
        if log is not None:
            return log.planner
        if case.plans and case.recorded is not None:
            return case.recorded.planner
        if case.plans and self.model.runs.plans is RunPlans.DRAWN:
            return planner_of_random_runs(self.model)
        return planner_of(self.model)

    def lost(self, case: Case, why: str, run: Simulated | None = None, log: EventLog | None = None) -> Execution:
        """Return a case whose run was not finished, because a node was lost: it failed, and its visits do not count.

        Args:
            case: what was run.
            why: a clause, such as `the controller was lost`.
            run: the run up to the loss; `None` if it had not begun.
            log: its log.
        """
        records = () if run is None else run.records
        trace = Trace(self.model.name, case.name, records)
        ended_ns = 0 if run is None else run.ended_ns
        reactions, excluded = () if log is None else log.reactions, self._excluded(log, records)
        found = Execution(case, reactions, trace, lost(why), ended_ns, (), 0, (), log, excluded=excluded)
        return replace(found, unjudged=Unjudged.NO_RUN)

    def options_of(self, case: Case) -> RunnerOptions:
        """Return the options of the runner for a case."""
        return self._simulator.options_for(case.limits)

    def choices_of(self, case: Case, preferred: Sequence[RecordedPlan] = ()) -> Choices:
        """Return the choices for a case; made anew for each run. For `preferred` see `execute`."""
        moves, plans = self._moves_of(case), self._plans_of(case, preferred)
        if case.origin is None:
            return Choices(self._plain, case.outcomes, case.network, environment=moves, plans=plans)
        messages = message_stream(case.origin) if case.network.draws else None
        reactions = DrawnReactions(reaction_stream(case.origin))
        return Choices(reactions, case.outcomes, case.network, messages, moves, plans=plans)

    def _plans_of(self, case: Case, preferred: Sequence[RecordedPlan]) -> PlanSource | None:
        """Return what decides about plans beside the planner; `None` if the planner or the case decides alone."""
        if case.plans:
            return None
        is_drawn = self.model.runs.plans is RunPlans.DRAWN
        if is_drawn and case.origin is not None:
            return DrawnPlans(self._shortest, draw_plans(case.origin))
        return PreferredPlans(self._shortest, preferred, may_be_longer=not is_drawn) if preferred else None

    @cached_property
    def _shortest(self) -> ShortestPlans:
        """The shortest plans of the model; its searches share the cache of the runs where there is one."""
        planner, plans = self._simulator.planner, self._simulator.plans
        return ShortestPlans(planner, plans if isinstance(plans, PlanCache) else PlanCache(planner))

    def _moves_of(self, case: Case) -> EnvironmentMoves | None:
        """Return what decides about the environment: the case, or rates; `None` where nothing can change."""
        if case.environment is not None:
            return RecordedMoves(self._simulator.program, case.environment)
        if case.origin is None or not (self.model.environment or case.origin.moves_inputs):
            return None
        moves_inputs = case.origin.moves_inputs
        drawn = DrawnMoves(self._simulator.program, environment_stream(case.origin), moves_inputs=moves_inputs)
        return None if drawn.is_idle else drawn

    def results(self, cases: Iterable[Case]) -> Iterator[CaseResult]:
        """Run cases one by one and measures what each visits."""
        for case in cases:
            yield self.execute(case).result
