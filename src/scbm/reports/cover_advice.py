"""What would cover a missed obligation: chance only where it can help, else what is missing for it.

An obligation needs a way to happen, a share of the outcome that this way waits for, and inputs that move. Guards are
compared with the states of some runs, where these are known.
"""

from __future__ import annotations

import re
from enum import Enum
from functools import cached_property
from itertools import islice
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct

from scbm.cases.coverage import Aspect, InstanceFolds, Obligation
from scbm.cases.trace import BecameCurrent, PlanAsked, PlanReceived, RunnerStarted, RunStarted
from scbm.model import And, Equal, OperationState, Outcome, Reference, RequestState, Role, RunPlans, conjunction
from scbm.model.predicates import TRUE, Constant, conjuncts
from scbm.model.satisfiability import is_satisfiable
from scbm.model.sources import free_groups, is_triggered, moved
from scbm.model.variables import CURRENT_NAME, operation_state_name
from scbm.model.visible_text import counted
from scbm.planning import DEFAULT_PLANNER, PLANNERS, Solved
from scbm.testing.request_protocol import clears, sets

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from scbm.cases.coverage import Coverage
    from scbm.model import Action, BehaviorModel, Operation, Predicate, Resource, Transition, Value
    from scbm.store import History
    from scbm.testing import CampaignResult, Execution

    _Step: TypeAlias = tuple[Obligation, Predicate, tuple[Action, ...]]

_FEW_CASES = 20
"""Fewer cases than this say little about the goals and initial states of a model."""

_MAX_CASES = 20
"""Maximum number of cases that are run again to see the states of their runs."""

_MAX_STATES = 5_000
"""Maximum number of states of runs that guards are compared with."""

_MAX_NAMED = 3
"""Maximum number of names in one advice; the others are counted."""


class CoverMeans(Enum):
    """The means to cover an obligation, with their words; `{}` stands for what is missing."""

    CHANCE = "perhaps by chance: run more cases"
    CHOSEN_PLANS = (
        "only cases with `plans:` execute them: write another one with such plans, as random cases may never plan them"
    )
    NEW_GOAL = "no plan needs them: add a goal or an initial state that needs them"
    UNASSUMED = (
        "no plan needs them: guards or goals on the plans read {}, but plans count on a measured value only if "
        "`assumes` lists it"
    )
    UNREAD = "no plan needs them: no guard or goal on the plans reads what they change ({}){}"
    PLANNED_AT_ONCE = (
        "they start in the moment of the plan, and plans take no time in random cases: give a case `planning: 1 s` and "
        "a change of {} meanwhile, or run `scbm close`"
    )
    UNDISTURBED = "no case disabled them while next in a plan: add an injection"
    NO_WAY = "no way to fail: add a `failed` transition, or an automatic one that sets their state to `failed`"
    NO_FAILURES = (
        "no share of failures in `simulation` of {}: give it one there, or force `fail` under `outcomes` of a case"
    )
    NO_SUCCESS = "no share of successes in `simulation` of {}: give it one there"
    NOT_MEASURED = (
        "they wait for {}, which no reply in `simulation` of {} measures: give that value a weight there, or force "
        "`measured` under `outcomes` of a case"
    )
    NOT_MOVED = "they wait for {}, which changes with `--inputs drawn` only"
    NO_RATE = "they wait for {}, and no environment transition that assigns it has a rate"
    NEVER_HELD = "they wait for {}, which held in none of {}"
    NOT_SENT = "they wait for replies of {}, but nothing is requested there"
    LATE = (
        "no reply of {} comes before the deadline of its request: make the `deadline` longer or the `latency` shorter"
    )
    ANSWERED = (
        "all requests to {} are answered in time: force `timeout` under `outcomes` of a case, or let `--network` lose "
        "messages"
    )
    ON_TIME = "nothing is requested: they time out only if their guard under `post` does not hold before the deadline"
    TIMELESS = "they have no `deadline`, so they never time out"
    AT_ONCE = "they complete as soon as they start, so they never time out"
    GUARDED = "their guards never held: see above what they wait for"


_BESIDE_EXECUTION = (
    CoverMeans.UNDISTURBED,
    CoverMeans.NO_WAY,
    CoverMeans.ON_TIME,
    CoverMeans.TIMELESS,
    CoverMeans.AT_ONCE,
)
"""What is missing even if the operation is in plans one day."""


class CoverAdvice(Struct, frozen=True):
    """The advice for one obligation.

    Attributes:
        means: the means to cover it.
        missing: what is missing, for the words of the means.
        states: the number of states that a guard was compared with, in words; or where a plan could read a change.
    """

    means: CoverMeans
    missing: str = ""
    states: str = ""

    @property
    def words(self) -> str:
        """The advice as a clause about several obligations."""
        return self.means.value.format(self.missing, self.states)

    @property
    def about_one(self) -> str:
        """The advice as a clause about one obligation."""
        return _IN_SINGULAR.sub(lambda found: _SINGULAR[found[0]], self.words)

    @property
    def is_named(self) -> bool:
        """Whether the advice is about these obligations alone, so that reports name them."""
        is_about = "{" in self.means.value and self.means is not CoverMeans.ANSWERED
        return is_about or self.means in (CoverMeans.NO_WAY, CoverMeans.NEW_GOAL)


_SINGULAR = {"they wait": "it waits", "they complete": "it completes", "they change": "it changes"} | {
    "they have": "it has",
    "they time": "it times",
    "they never time": "it never times",
    "they start": "it starts",
    "they were current": "it was current",
    "their guards never": "its guard never",
    "their": "its",
    "needs them": "needs it",
    "execute them": "execute it",
    "plan them": "plan it",
    "disabled them": "disabled it",
}
_IN_SINGULAR = re.compile("|".join(_SINGULAR))


def joined_advice(advice: Sequence[CoverAdvice]) -> CoverAdvice:
    """Return one advice for obligations that lack the same means, with what the first of them lack."""
    first = advice[0]
    return CoverAdvice(first.means, in_few(tuple(dict.fromkeys(each.missing for each in advice))), first.states)


CHANCE = CoverAdvice(CoverMeans.CHANCE)


def _no_runs() -> Iterator[Execution]:
    """Yield no runs."""
    return iter(())


class CampaignKind(Struct, frozen=True, dict=True):
    """What kind of cases ran.

    Attributes:
        loses_messages: whether the network could lose messages.
        moves_inputs: whether inputs moved that no environment transition changes.
        real: the resources that were real: their simulation says nothing about them.
        runs: runs the cases again, in their order; by default their runs are not to be had.
    """

    loses_messages: bool = False
    moves_inputs: bool = False
    real: tuple[str, ...] = ()
    runs: Callable[[], Iterator[Execution]] = _no_runs

    @staticmethod
    def of_campaign(result: CampaignResult) -> CampaignKind:
        """Return the kind of the cases of a campaign, with their runs unless they ran over nodes."""
        from scbm.testing import Tester  # noqa: PLC0415 - not all reports need it

        def runs() -> Iterator[Execution]:
            execute, case = Tester(result.model).execute, result.campaign.source.case
            yield from (execute(case(position)) for position in range(1, result.campaign.count + 1))

        suite, real = result.suite, tuple(answers.resource for answers in result.answers)
        return CampaignKind(suite.loses_messages, suite.moves_inputs, real, _no_runs if result.where else runs)

    @staticmethod
    def of_store(history: History) -> CampaignKind:
        """Return the kind of the cases of a store, with their runs in simulation."""
        from scbm.store import Drawn, Replays  # noqa: PLC0415 - only reports of stores need it

        def runs() -> Iterator[Execution]:
            execute = Replays(history).execute
            yield from (run for case in history.cases if not case.is_over_nodes and (run := execute(case)) is not None)

        drawn = [case.recipe for case in history.cases if isinstance(case.recipe, Drawn)]
        real = (name for case in history.cases for name in case.recipe.real or ())
        return CampaignKind(
            any(recipe.network for recipe in drawn),
            any(recipe.moves_inputs for recipe in drawn),
            tuple(dict.fromkeys(real)),
            runs,
        )

    @cached_property
    def seen(self) -> tuple[tuple[Mapping[str, Value], ...], int]:
        """The different states of the first runs, in the order in which they are reached, and the number of runs."""
        found: dict[tuple[Value, ...], Mapping[str, Value]] = {}
        for run in self._first_runs:
            state: dict[str, Value] = {}
            for record in run.trace.records:
                if isinstance(record, (RunnerStarted, RunStarted)):
                    state |= record.state
                state |= dict(record.changes)
                if len(found) < _MAX_STATES:
                    found.setdefault(tuple(state.values()), dict(state))
        return tuple(found.values()), len(self._first_runs)

    @cached_property
    def _first_runs(self) -> tuple[Execution, ...]:
        return tuple(islice(self.runs(), _MAX_CASES))

    @cached_property
    def unplanned(self) -> Mapping[str, None]:
        """The goals of the first runs for which plans were asked, and none was found."""
        found: dict[str, bool] = {}
        for run in self._first_runs:
            goal = ""
            for record in run.trace.records:
                if isinstance(record, RunStarted):
                    goal = record.goal
                elif isinstance(record, PlanReceived):
                    found[goal] = found.get(goal, False) or record.status == Solved.status
        return {name: None for name, is_planned in found.items() if not is_planned}

    @cached_property
    def chosen(self) -> Mapping[str, None]:
        """The operations that execute in the first runs only where the case has `plans:`."""
        found: dict[bool, dict[str, None]] = {True: {}, False: {}}
        for run in self._first_runs:
            current = (record.operation for record in run.trace.records if isinstance(record, BecameCurrent))
            found[bool(run.case.plans)].update(dict.fromkeys(current))
        return {name: None for name in found[True] if name not in found[False]}

    @cached_property
    def waiting(self) -> Mapping[str, None]:
        """The operations that became current after the moment in which their plan was asked for, in the first runs."""
        found: dict[str, None] = {}
        asked_ns = 0
        for record in (record for run in self._first_runs for record in run.trace.records):
            if isinstance(record, PlanAsked):
                asked_ns = record.at_ns
            elif isinstance(record, BecameCurrent) and record.at_ns > asked_ns:
                found[record.operation] = None
        return found

    @property
    def states(self) -> tuple[Mapping[str, Value], ...]:
        """The states that guards are compared with; none if no run is to be had."""
        return self.seen[0]

    @cached_property
    def while_current(self) -> Mapping[Value, Sequence[Mapping[str, Value]]]:
        """The states that guards are compared with, by the operation that is current in them."""
        found: dict[Value, list[Mapping[str, Value]]] = {}
        for state in self.states:
            found.setdefault(state[CURRENT_NAME], []).append(state)
        return found

    def states_in_words(self, count: int | None = None) -> str:
        """Return the number of states that guards are compared with, by default all, and the number of cases."""
        return f"{counted(len(self.states) if count is None else count, 'state')} of {counted(self.seen[1], 'case')}"


def in_few(names: Sequence[str]) -> str:
    """Return the first names, and the number of the others."""
    more = len(names) - _MAX_NAMED
    return ", ".join(names) if more <= 0 else f"{', '.join(names[:_MAX_NAMED])} and {more} more"


def has_few_cases(coverage: Coverage) -> bool:
    """Return whether cases, written or random, are so few that more of them may visit what these missed."""
    return coverage.count < _FEW_CASES


def _has_varying_plans(model: BehaviorModel) -> bool:
    """Return whether random cases can have different plans: by goals, initial states, drawn values or outcomes."""
    is_drawn = any(len(variable.random) > 1 for variable in model.variables)
    simulations = [each.simulation for each in model.resources]
    is_simulated = any(len(each.cumulative) > 1 or each.measured for each in simulations)
    return len(model.goals) > 1 or is_drawn or is_simulated or bool(model.environment)


class CoverAdvisor:
    """Gives advice about the missed obligations of one coverage."""

    def __init__(self, model: BehaviorModel, coverage: Coverage, kind: CampaignKind) -> None:
        self._model = model
        self._coverage = coverage
        self._kind = kind
        self._visits = coverage.visits()
        self._possible = {each: None for each, count in self._visits.items() if count}
        self._known: dict[Obligation, CoverAdvice] = {}
        self._held: dict[Predicate, bool] = {}
        self._are_drawn: dict[Predicate, bool] = {}
        self._resources = {resource.request_state: resource for resource in model.resources}
        free = dict.fromkeys(name for group in free_groups(model) for name in group.names)
        rated = {a.target: None for each in model.environment if each.rate is not None for a in each.actions}
        self._unmoved = {} if kind.moves_inputs else free
        self._unrated = {name: None for name in moved(model) if name not in rated}
        self._moving = dict.fromkeys((*rated, *(free if kind.moves_inputs else ())))

    def advice(self, obligation: Obligation) -> CoverAdvice:
        """Return the advice for an obligation that no case visits."""
        if obligation not in self._known:
            if not self._known:
                self._find_possible()
            self._known[obligation] = self._find(obligation)
        return self._known[obligation]

    def _find_possible(self) -> None:
        """Find the steps that chance can take: each of them waits for others of them only, and so on."""
        todo = [each for each in self._coverage.obligations if each not in self._possible]
        todo = [each for each in todo if each.aspect is not Aspect.DISABLED]
        found = todo
        while found:
            ready = (each for each in todo if (needed := _needed(each)) is None or needed in self._possible)
            found = [each for each in ready if self._find(each) == CHANCE]
            self._possible |= dict.fromkeys(found)
            self._are_drawn.clear()
            todo = [each for each in todo if each not in self._possible and each.aspect is not Aspect.QUEUED]

    def is_due(self, obligation: Obligation) -> bool:
        """Return whether a report shows the advice: it is no consequence of an operation that never executes."""
        needed = _needed(obligation)
        return needed is None or bool(self._visits[needed]) or self.advice(obligation).means in _BESIDE_EXECUTION

    def _find(self, obligation: Obligation) -> CoverAdvice:
        if obligation.aspect is Aspect.TAKEN:
            transition = next(t for t in self._model.automatic_transitions if t.name == obligation.subject)
            return self._of_guards(transition.running_guard)
        operation = self._model.operation(obligation.subject)
        of_aspect: dict[Aspect, Callable[[Operation], CoverAdvice]] = {
            Aspect.QUEUED: self._queued,
            Aspect.DISABLED: self._disabled,
            Aspect.EXECUTING: lambda each: self._of_guards(each.pre.running_guard, each),
            Aspect.FAILED: self._failed,
            Aspect.TIMEDOUT: self._timedout,
            Aspect.COMPLETED: lambda each: self._of_guards(each.post.running_guard, each),
        }
        found = of_aspect[obligation.aspect](operation)
        if found == CHANCE and self._have_known_plans and operation.name in self._kind.chosen:
            return CoverAdvice(CoverMeans.CHOSEN_PLANS)
        return found

    @property
    def _have_known_plans(self) -> bool:
        """Whether all cases are known, and random ones have plans of the planner: no drawn ones, nor of a program."""
        is_external = PLANNERS[self._model.planner.name or DEFAULT_PLANNER].is_external
        is_canonical = self._model.runs.plans is RunPlans.CANONICAL and not is_external
        return is_canonical and self._coverage.count <= _MAX_CASES

    # operations

    def _queued(self, operation: Operation) -> CoverAdvice:
        """Return why no plan has an operation: nothing on the plans reads what it changes, or another goal would."""
        resources = self._model.resources
        requests = dict.fromkeys(name for each in resources for name in (each.trigger, each.request_state))
        assigned = dict.fromkeys(action.target for action in (*operation.pre.a, *operation.post.a))
        asked = [each for each in resources if sets(operation.pre.running_actions, each)]
        changed = {name: None for name in (*assigned, *(n for r in asked for n in r.measures)) if name not in requests}
        read = {name: None for name in self._read_on_plans if name in changed}
        if self._on_plans and read.keys().isdisjoint(assigned):
            names = self._folds.in_entries(in_few([*(read or changed)]) or "nothing")
            if read:
                return CoverAdvice(CoverMeans.UNASSUMED, names)
            where = f"; the plans have {self._plans}: one of them may lack a condition, or add a goal that reads it"
            return CoverAdvice(CoverMeans.UNREAD, names, where)
        varies = has_few_cases(self._coverage) and _has_varying_plans(self._model)
        return CHANCE if varies else CoverAdvice(CoverMeans.NEW_GOAL)

    @cached_property
    def _on_plans(self) -> Sequence[Operation]:
        return [each for each in self._model.operations if self._visits[Obligation(each.name, Aspect.QUEUED)]]

    @cached_property
    def _plans(self) -> str:
        return in_few(self._folds.folded(each.name for each in self._on_plans))

    @cached_property
    def _folds(self) -> InstanceFolds:
        return InstanceFolds.of(self._model)

    @cached_property
    def _read_on_plans(self) -> Mapping[str, None]:
        """The variables that the operations on the plans read, and the goals that plans reach."""
        guards = [part.g for each in self._on_plans for part in (each.pre, each.post)]
        guards += [goal for name, goal in self._model.goals if name not in self._kind.unplanned]
        return dict.fromkeys(name for guard in guards for name in guard.reads())

    def _disabled(self, operation: Operation) -> CoverAdvice:
        """Return how an operation becomes disabled: by an input that its guard reads, else by an injection.

        What the planner reads holds in the moment of the plan, so that a change of it must come later.
        """
        pre, moving = operation.pre, (*self._unmoved, *self._moving)
        read = [name for name in pre.running_guard.reads() if name in moving]
        if not read:
            return CoverAdvice(CoverMeans.UNDISTURBED)
        is_late = any(name in moving for name in pre.gr.reads()) or operation.name in self._kind.waiting
        if not is_late and self._kind.states:
            return CoverAdvice(CoverMeans.PLANNED_AT_ONCE, read[0])
        name = next((name for name in read if name in self._unmoved), None)
        return CHANCE if name is None else CoverAdvice(CoverMeans.NOT_MOVED, f"a change of {name}")

    def _failed(self, operation: Operation) -> CoverAdvice:
        """Return how an operation fails; of several ways one that chance can take is preferred."""
        found = [self._of_guards(guard, operation) for guard in self._ways_to_fail(operation)]
        if not found:
            return CoverAdvice(CoverMeans.NO_WAY)
        return CHANCE if CHANCE in found else found[0]

    def _ways_to_fail(self, operation: Operation) -> Iterator[Predicate]:
        """Yield the guards that fail an operation: its own, and those about its requests and about itself."""
        if operation.failed is not None:
            yield operation.failed.running_guard
        used = dict.fromkeys(resource.request_state for resource in self._used(operation))
        for transition in _failing(operation, self._model):
            waited = [name for name in transition.running_guard.reads() if name in self._resources]
            others = (self._resources[name] for name in waited if not used)
            is_own = not waited or any(name in used for name in waited) or any(map(self._may_outlive, others))
            guard, own = transition.running_guard, operation_state_name(operation.name)
            others_rest = (
                Equal(Reference(name), Constant(OperationState.INITIAL.value))
                for name in guard.reads()
                if name != own and self._model.running_space[name].role is Role.OPERATION_STATE
            )
            current = And((guard, Equal(Reference(CURRENT_NAME), Constant(operation.name)), *others_rest))
            if is_own and is_satisfiable(current, self._model.running_space) is not False:
                yield transition.running_guard

    def _may_outlive(self, resource: Resource) -> bool:
        """Return whether a request to a resource can be in flight while another operation executes."""
        users = [each for each in self._model.operations if sets(each.pre.running_actions, resource)]
        ends = [each.post.running_actions for each in users]
        ends += [each.timedout for each in users if each.deadline_ns is not None]
        return not all(clears(actions, resource) for actions in ends)

    def _timedout(self, operation: Operation) -> CoverAdvice:
        from scbm.closing.advice.instant_operations import completes_at_once  # noqa: PLC0415 - few reports need it

        if operation.deadline_ns is None:
            return CoverAdvice(CoverMeans.AT_ONCE if completes_at_once(operation, self._model) else CoverMeans.TIMELESS)
        used = self._used(operation)
        if used and (self._kind.loses_messages or any(self._may_miss(each, operation) for each in used)):
            return CHANCE
        waits = (part for part in conjuncts(operation.post.running_guard) if not self._is_about_requests(part))
        found = [advice for advice in map(self._lacking, waits) if advice is not None]
        if found:
            return found[0]
        if not used:
            return CoverAdvice(CoverMeans.ON_TIME)
        return CoverAdvice(CoverMeans.ANSWERED, in_few([each.name for each in used]))

    def _may_miss(self, resource: Resource, operation: Operation) -> bool:
        """Return whether a simulated resource may let the deadline of an operation pass."""
        latency, deadline_ns = resource.simulation.latency, operation.deadline_ns
        is_late = latency.longest_ns is None or (deadline_ns is not None and latency.longest_ns > deadline_ns)
        return is_late or self._has_share(resource, Outcome.TIMEOUT) or self._ignores_failure(resource, operation)

    def _ignores_failure(self, resource: Resource, operation: Operation) -> bool:
        """Return whether a resource can fail, and an operation waits on."""
        awaited = map(self._awaited, conjuncts(operation.post.running_guard))
        completes = any(each is resource and Outcome.FAIL in outcomes for each, outcomes in awaited)
        is_noticed = completes or next(self._ways_to_fail(operation), None) is not None
        return not is_noticed and self._has_share(resource, Outcome.FAIL)

    def _used(self, operation: Operation) -> list[Resource]:
        """Return the resources whose requests an operation reads or changes."""
        parts = [part for part in (operation.pre, operation.post, operation.failed) if part is not None]
        names = dict.fromkeys(name for part in parts for name in part.running_guard.reads())
        names |= dict.fromkeys(a.target for part in parts for a in part.running_actions)
        names |= dict.fromkeys(action.target for action in operation.timedout)
        return [each for each in self._model.resources if each.request_state in names or each.trigger in names]

    # guards

    def _of_guards(self, guard: Predicate, operation: Operation | None = None) -> CoverAdvice:
        """Return what a guard waits for that nothing in these runs gives; chance if there is no such condition.

        Args:
            guard: the guard.
            operation: the operation that waits for replies, while it is current; by default each that asks for them.
        """
        parts = conjuncts(guard)
        lacking = next((found for part in parts if (found := self._lacking(part, operation)) is not None), None)
        if lacking is not None:
            return lacking
        undrawn = [part for part in parts if not self._is_drawn(part)]
        waits = next((part for part in undrawn if not self._has_held(part)), None)
        if not self._kind.states:
            return CHANCE if waits is None or len(undrawn) < len(parts) else CoverAdvice(CoverMeans.GUARDED)
        if waits is not None:
            return CoverAdvice(CoverMeans.NEVER_HELD, f"`{waits}`", self._kind.states_in_words())
        return self._of_states([part for part in undrawn if not self._varies(part)], operation)

    def _of_states(self, parts: Sequence[Predicate], operation: Operation | None) -> CoverAdvice:
        """Return which conditions never hold together while an operation is current; chance if no state is known."""
        from scbm.closing.proofs.blame import blame  # noqa: PLC0415 - few reports need it

        states = self._kind.states if operation is None else self._kind.while_current.get(operation.name, [])
        waits = blame(parts, lambda part: any(map(part.holds, states))) if states else ()
        if not waits:
            return CHANCE
        compared = self._kind.states_in_words(len(states)) + ("" if operation is None else " while they were current")
        return CoverAdvice(CoverMeans.NEVER_HELD, f"`{conjunction(waits)}`", compared)

    def _lacking(self, part: Predicate, operation: Operation | None = None) -> CoverAdvice | None:
        """Return what a condition lacks whatever chance does: a reply, or an input that moves."""
        resource, outcomes = self._awaited(part)
        unanswered = self._unanswered(resource, outcomes, operation) if resource and outcomes else None
        if unanswered is not None:
            return unanswered
        if self._has_held(part):
            return None
        read = part.reads()
        unmoved = next((name for name in read if name in self._unmoved), None)
        if unmoved is not None:
            return CoverAdvice(CoverMeans.NOT_MOVED, f"`{part}`")
        if any(name in self._unrated for name in read):
            return CoverAdvice(CoverMeans.NO_RATE, f"`{part}`")
        measuring = [each for each in self._model.resources if any(name in each.measures for name in read)]
        if not measuring or self._may_be_drawn(part) or any(self._assigning(part)):
            return None
        reasons = [self._unanswered(each, tuple(_REPLIES.values()), None) for each in measuring]
        not_measured = CoverAdvice(CoverMeans.NOT_MEASURED, f"`{part}`", in_few([each.name for each in measuring]))
        return not_measured if None in reasons else reasons[0]

    def _awaited(self, part: Predicate) -> tuple[Resource | None, tuple[Outcome, ...]]:
        """Return the resource whose reply a condition waits for, and the outcomes that it accepts."""
        read = part.reads()
        resource = self._resources.get(read[0]) if len(read) == 1 else None
        if resource is None:
            return None, ()
        accepted = [state for state in RequestState if part.holds({read[0]: state.value})]
        if any(state not in _REPLIES for state in accepted):
            return resource, ()
        return resource, tuple(_REPLIES[state] for state in accepted)

    def _unanswered(
        self, resource: Resource, outcomes: Sequence[Outcome], operation: Operation | None
    ) -> CoverAdvice | None:
        """Return why no such reply of a resource comes: no request, each ends with its deadline, or no share of it."""
        steps = [step for step in self._senders[resource.trigger] if step in self._possible]
        if not steps:
            return CoverAdvice(CoverMeans.NOT_SENT, resource.name)
        own = [each for each in steps if operation is not None and each.subject == operation.name] or steps
        are_late = resource.name not in self._kind.real and all(self._ends_before(each, resource) for each in own)
        if are_late and not self._may_outlive(resource):
            return CoverAdvice(CoverMeans.LATE, resource.name)
        if any(self._has_share(resource, each) for each in outcomes):
            return None
        means = CoverMeans.NO_FAILURES if Outcome.FAIL in outcomes else CoverMeans.NO_SUCCESS
        return CoverAdvice(means, resource.name)

    @cached_property
    def _senders(self) -> Mapping[str, Sequence[Obligation]]:
        """The steps that send requests, by the trigger."""
        by_target = self._steps_by_target
        return {
            each.trigger: [step for step, _, actions in by_target.get(each.trigger, ()) if sets(actions, each)]
            for each in self._model.resources
        }

    def _ends_before(self, step: Obligation, resource: Resource) -> bool:
        """Return whether an operation that sends a request as it starts times out before each simulated reply."""
        if step.aspect is not Aspect.EXECUTING:
            return False
        deadline_ns = self._model.operation(step.subject).deadline_ns
        return deadline_ns is not None and deadline_ns < resource.simulation.latency.shortest_ns

    def _has_share(self, resource: Resource, outcome: Outcome) -> bool:
        is_real = resource.name in self._kind.real
        return is_real or any(each is outcome and share for each, share in resource.simulation.outcomes)

    def _is_about_requests(self, part: Predicate) -> bool:
        return any(name in self._resources for name in part.reads())

    def _has_held(self, part: Predicate) -> bool:
        """Return whether a condition held in a known state; if none is known, whether it holds at first."""
        if part not in self._held:
            initial = {variable.name: variable.initial for variable in self._model.running_space}
            self._held[part] = any(map(part.holds, self._kind.states or (initial,)))
        return self._held[part]

    def _is_drawn(self, part: Predicate) -> bool:
        """Return whether chance can make a condition hold: it draws what it reads, or a step that assigns it."""
        if part not in self._are_drawn:
            follows = (self._may_follow(*step) for step in self._assigning(part))
            self._are_drawn[part] = bool(self._awaited(part)[1]) or self._may_be_drawn(part) or any(follows)
        return self._are_drawn[part]

    def _varies(self, part: Predicate) -> bool:
        """Return whether faults or automatic transitions make a condition hold: they come at different moments."""
        faults = (step for step, _ in self._assigning(part) if step.aspect not in (Aspect.EXECUTING, Aspect.COMPLETED))
        return any(step in self._possible for step in faults)

    def _assigning(self, part: Predicate) -> Iterator[tuple[Obligation, tuple[Action, ...]]]:
        """Yield the steps that make a condition hold which they do not need: they assign what it reads."""
        assigning = dict.fromkeys(step for name in part.reads() for step in self._steps_by_target.get(name, ()))
        for obligation, guard, actions in assigning:
            if part not in conjuncts(guard) and self._may_hold_after(part, actions):
                yield obligation, actions

    @cached_property
    def _steps_by_target(self) -> Mapping[str, Sequence[_Step]]:
        found: dict[str, list[_Step]] = {}
        for step in self._steps:
            for name in dict.fromkeys(action.target for action in step[2]):
                found.setdefault(name, []).append(step)
        return found

    def _may_be_drawn(self, part: Predicate) -> bool:
        """Return whether a condition reads what chance draws, and may hold for the values that it draws."""
        drawn = {name: self._drawn[name] for name in part.reads() if name in self._drawn and self._is_set(name)}
        return bool(drawn) and is_satisfiable(part, self._model.running_space, drawn) is not False

    def _is_set(self, name: str) -> bool:
        """Return whether a drawn variable gets its values: by itself, or by a reply that comes."""
        if name in self._moving or len(self._model.space[name].random) > 1:
            return True
        measuring = (each for each in self._model.resources if name in each.measures)
        return any(self._unanswered(each, tuple(_REPLIES.values()), None) is None for each in measuring)

    @cached_property
    def _drawn(self) -> Mapping[str, tuple[Value, ...]]:
        """The variables that chance draws, each with the values that it then has, those of known states included."""
        found: dict[str, dict[Value, None]] = {}
        for variable in self._model.variables:
            if variable.name in self._moving:
                found[variable.name] = dict.fromkeys(variable.domain.values)
            elif len(variable.random) > 1:
                found[variable.name] = dict.fromkeys(variable.random)
        for resource in self._model.resources:
            is_real = resource.name in self._kind.real
            outcomes = [outcome for outcome in Outcome if self._has_share(resource, outcome)]
            for name in resource.measures if is_triggered(resource, self._model) else ():
                drawn = [each.possible for o in outcomes for each in resource.drawn(o) if each.name == name]
                values = [resource.sends(self._model.space[name])] if is_real else drawn
                found.setdefault(name, {}).update(dict.fromkeys(value for each in values for value in each))
        states = self._kind.states
        known = {name: (self._model.space[name].initial, *(state[name] for state in states)) for name in found}
        return {name: tuple(dict.fromkeys((*values, *known[name]))) for name, values in found.items()}

    def _may_follow(self, obligation: Obligation, actions: Sequence[Action]) -> bool:
        """Return whether chance can take a step that was not taken, or once more a fault that is counted."""
        if not self._visits[obligation]:
            return obligation in self._possible
        return obligation.aspect in (Aspect.FAILED, Aspect.TIMEDOUT) and any(action.reads() for action in actions)

    @staticmethod
    def _may_hold_after(part: Predicate, actions: Sequence[Action]) -> bool:
        """Return whether a condition on one variable may hold after actions; of several variables it may always."""
        read = part.reads()
        values = [action.value({}) for action in actions if action.target in read and not action.reads()]
        return len(read) > 1 or not values or any(part.holds({read[0]: value}) for value in values)

    @cached_property
    def _steps(self) -> tuple[_Step, ...]:
        """The steps that change variables, with the obligation that each visits, and their guards."""
        found = [
            (Obligation(each.name, aspect), step.running_guard, step.running_actions)
            for each in self._model.operations
            for aspect, step in (
                (Aspect.EXECUTING, each.pre),
                (Aspect.COMPLETED, each.post),
                (Aspect.FAILED, each.failed),
            )
            if step is not None
        ]
        found += [(Obligation(each.name, Aspect.TIMEDOUT), TRUE, each.timedout) for each in self._model.operations]
        automatic = self._model.automatic_transitions
        found += [(Obligation(t.name, Aspect.TAKEN), t.running_guard, t.running_actions) for t in automatic]
        return tuple(found)


_WHILE_EXECUTING = (Aspect.FAILED, Aspect.TIMEDOUT, Aspect.COMPLETED)


def _needed(obligation: Obligation) -> Obligation | None:
    """Return the obligation that comes before one of the same operation; the first one needs none."""
    if obligation.aspect in (Aspect.TAKEN, Aspect.QUEUED):
        return None
    needed = Aspect.EXECUTING if obligation.aspect in _WHILE_EXECUTING else Aspect.QUEUED
    return Obligation(obligation.subject, needed)


_REPLIES = {RequestState.SUCCEEDED: Outcome.SUCCEED, RequestState.FAILED: Outcome.FAIL}


def _failing(operation: Operation, model: BehaviorModel) -> list[Transition]:
    """Return the automatic transitions that may fail an operation."""
    from scbm.closing.proofs.proofs import failing_transitions  # noqa: PLC0415 - few reports need it

    names = failing_transitions(operation, model)
    return [transition for transition in model.automatic_transitions if transition.name in names]
