"""Cases from paths: what a case has to say about requests and changes so that its run follows a path.

A real runner follows the path, event by event, at plausible times: a default reply arrives when default replies do, and
environment transitions act at their rates, where that is possible. Default behavior is then left out of the case.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, assert_never

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases import (
    Case,
    CaseGoal,
    CaseLimits,
    Condition,
    ConditionKind,
    EnvironmentChange,
    Injection,
    OutcomeRule,
    RecordedPlan,
)
from scbm.cases.trace import BecameCurrent, OperationStepped, RunStarted
from scbm.model import Constant, Equal, OperationState, Outcome, Reference, State, conjunction
from scbm.planning import NoPlanFound, PlanLimits, Solved
from scbm.running import (
    AskPlan,
    CancelRequest,
    Effect,
    Event,
    GoalGiven,
    InjectionGiven,
    Measured,
    PlanAnswered,
    PlanStatus,
    ReplyArrived,
    Runner,
    RunnerOptions,
    SendRequest,
    TimePassed,
)
from scbm.running.outside_changes import OtherUser, TransitionMaker
from scbm.running.simulation import PlainReactions, plainly_measured
from scbm.running.simulation.rate_watch import RateWatch
from scbm.running.untimed.situations import MAX_ANSWERS, Happening, HappeningKind

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.cases import Reaction
    from scbm.cases.trace import Changes
    from scbm.closing.runs.walks import PathRun, RunPath
    from scbm.closing.scripts.chosen_plans import ChosenPlans
    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.planning import PlanCache
    from scbm.running import Program

_NEVER_NS = 10**30
_A_MOMENT_NS = 1_000_000
_A_WHILE_NS = 100_000_000
_AT_ONCE_PLANS = 10**9
_DEFAULTS = RunnerOptions()
_PLANNING_NS = 1_000_000_000
"""How long plans take where something happens while one is awaited."""
_TAKEN = Condition(ConditionKind.OCCUPIED)


class _ScriptedRequest(Struct):
    """A request of the run.

    Attributes:
        subject: its name in a case: the operation that executed, or the resource if none did.
        number: its number among the requests of this subject, from 1.
        number_of_event: the number of the event at which it was sent, from the beginning of the run.
        answer: the reply and its time; `None` if there was none.
        cancelled_ns: when it was cancelled; `None` if it was not.
    """

    resource: str
    subject: str
    number: int
    sent_ns: int
    number_of_event: int
    answer: tuple[int, Happening] | None = None
    cancelled_ns: int | None = None


class _StrayedError(Exception):
    """The next event of a path cannot happen in a real runner. The case is kept for the visits of its run."""


class CaseScripts:
    """Makes cases from paths.

    Attributes:
        plain: the default reply of each resource.
        plainly_failed: what a failed reply of each resource measures by default.
    """

    def __init__(
        self, model: BehaviorModel, program: Program, plans: PlanCache, chosen: ChosenPlans | None = None
    ) -> None:
        """`chosen` are the plans of paths on which it is decided how plans go on; else all plans are in `plans`."""
        self.model = model
        self.program = program
        self.plans = plans
        self.chosen = chosen
        plain = PlainReactions()
        self.plain = {resource.name: plain.react(resource) for resource in model.resources}
        self.plainly_failed = {each.name: plainly_measured(each, Outcome.FAIL) or () for each in model.resources}

    def case(self, path: RunPath, name: str, missing: Iterable[str] = ()) -> Case:
        """Return the case whose runs follow this path, with default behavior after it, and with its chosen plans.

        Args:
            path: the path.
            name: the name of the case.
            missing: the resources whose requests are in flight at the end of the path, and get no reply.
        """
        run = _ScriptedRun(self, path)
        run.follow()
        while run.needs_again:  # with a time limit or a time for plans that was not known before
            run = _ScriptedRun(self, path, run.ends_ns, run.planning_ns)
            run.follow()
        for resource in missing:
            run.lose_reply(resource)
        initial = State(self.model.space, dict(path.start.values))
        goals = _goals(path)
        first = goals[0]
        rules, injections = tuple(run.rules()), tuple(run.injections)
        case = Case(name, first.name, first.predicate, initial, rules, injections, limits=run.limits)
        environment = tuple(run.changes) or None
        case = replace(case, environment=environment, planning_ns=run.planning_ns, plans=run.chosen)
        return case.with_goals(goals)


def _goals(path: RunPath) -> tuple[CaseGoal, ...]:
    """Return the goals of a path. One that is given after changes waits for the last of them."""
    return tuple(CaseGoal(*run.goal, when=_hold(run.before[-1]) if run.before else None) for run in path.runs)


def _hold(change: Happening) -> Predicate:
    """Return the predicate that holds after a change from outside."""
    return conjunction([Equal(Reference(name), Constant(value)) for name, value in change.measured])


class _ScriptedRun:
    """A real runner that follows a path.

    Attributes:
        changes: the changes from outside.
        injections: the times in which other users occupy resources.
        ends_ns: the time limit of each goal; `None` if it ends no run.
        planning_ns: how long plans take.
        needs_again: whether the path has to be followed once more, with another time limit or another time for plans.
    """

    def __init__(self, scripts: CaseScripts, path: RunPath, ends_ns: int | None = None, planning_ns: int = 0) -> None:
        self._path = path
        self._planner = scripts.plans
        self._chosen = scripts.chosen
        self._choices: dict[int, tuple[AskPlan, list[int]]] = {}
        self._plan_limits = PlanLimits.of(scripts.model)
        self._plain, self._plainly_failed = scripts.plain, scripts.plainly_failed
        options = RunnerOptions(_NEVER_NS if ends_ns is None else ends_ns, _AT_ONCE_PLANS)
        self._program = scripts.program
        self._runner = Runner(scripts.program, path.start.values, options)
        self._rates = RateWatch(scripts.program)
        self._now_ns = 0
        self._requests: dict[int, _ScriptedRequest] = {}
        self._in_flight: dict[str, int] = {}
        self._counts: dict[str, int] = {}
        self._operation: str | None = None
        self._asked: AskPlan | None = None
        self._asked_ns = 0
        self._plans = 0
        self._events = 0
        self._knows_limit = ends_ns is not None
        self._began_ns = 0
        self._left = [happening for run in path.runs for happening in (*run.before, *run.happenings)]
        self.ends_ns = ends_ns
        self.planning_ns = planning_ns
        self.needs_again = False
        self.changes: list[EnvironmentChange] = []
        self.injections: list[Injection] = []
        self._runner.changes_pending = lambda _: any(each.kind is HappeningKind.OUTSIDE for each in self._left)
        for goal in _goals(path):
            self._handle(GoalGiven(goal.name, goal.predicate, goal.when))

    def follow(self) -> None:
        """Let all events of the path happen, in order, until one cannot."""
        # With changes from outside each answer is an event of the path, as something may come before it.
        answers_alone = not any(happening.kind is HappeningKind.OUTSIDE for happening in self._left)
        try:
            for run in self._path.runs:
                for change in run.before:
                    self._go_on(is_at_rest=True)
                    self._change(change)
                for happening in run.happenings:
                    if answers_alone:
                        self._answer_if_alone()
                    if happening.kind is HappeningKind.NEXT:
                        self._choose(happening.number)
                        continue
                    self._go_on(is_at_rest=False)
                    self._happen(happening, run)
                if answers_alone or run is self._path.runs[-1]:
                    self._answer_if_alone()
        except _StrayedError:
            return

    def lose_reply(self, resource: str) -> None:
        """Let no reply come to the request that is in flight to a resource."""
        if resource in self._in_flight:
            self._requests[self._in_flight[resource]].cancelled_ns = _NEVER_NS

    def _go_on(self, *, is_at_rest: bool) -> None:
        """Prepare for the next event of the path; raise `_StrayedError` if it cannot happen."""
        if self._runner.is_at_rest != is_at_rest:
            raise _StrayedError
        del self._left[0]
        self._events += 1

    def _happen(self, happening: Happening, run: PathRun) -> None:
        """Let the next event of a run of the path happen."""
        match happening.kind:
            case HappeningKind.REPLY:
                self._reply(happening)
            case HappeningKind.DEADLINE:
                self._pass()
            case HappeningKind.TIME_LIMIT:
                self._reach_time_limit(run)
            case HappeningKind.ANSWER:
                if self._asked is not None:  # else it has answered, as nothing but a change could come first
                    self._answer()
            case HappeningKind.OUTSIDE:
                self._change(happening)
            case HappeningKind.GIVE_UP:
                pass  # a simulated run ends where no plan exists, unless an injection is pending
            case HappeningKind.PLAN_LIMIT:  # no case is made of runs that go on after it
                raise _StrayedError
            case HappeningKind.NEXT | HappeningKind.GOAL:
                raise ValueError(f"no case is made of runs in which this happens: {happening.kind.value}")
            case _:
                assert_never(happening.kind)

    def _choose(self, number: int) -> None:
        """Note how the last plan goes on; the runner had this plan since the answer."""
        if not self._choices:
            raise _StrayedError
        del self._left[0]
        self._choices[max(self._choices)][1].append(number)

    def _reach_time_limit(self, run: PathRun) -> None:
        """Let the time limit end a run; if it is not known yet, choose it and go no further."""
        if self._knows_limit:
            self._pass()
            return
        self.ends_ns = self._soon_ns() - self._began_ns
        if run is not self._path.runs[-1]:
            self.needs_again = True
            raise _StrayedError

    def _take_time_to_plan(self) -> None:
        """Begin again, without a time limit, if something happens while a plan is awaited, and plans take no time."""
        if self._asked is not None and not self.planning_ns:
            self.ends_ns, self.planning_ns, self.needs_again = None, _PLANNING_NS, True
            raise _StrayedError

    @property
    def _answer_ns(self) -> int:
        """The time at which the planner answers; far away if it was not asked."""
        return _NEVER_NS if self._asked is None else self._asked_ns + self.planning_ns

    @property
    def _limit_ns(self) -> int:
        """The time before which the next event has to happen: of the next deadline, or of the answer of the planner."""
        deadline_ns = self._runner.deadline_ns
        if deadline_ns is None:  # all goals have ended before, so nothing is waited for
            raise _StrayedError
        return min(deadline_ns, self._answer_ns)

    @property
    def limits(self) -> CaseLimits:
        """Return the limits that the case needs beyond the default ones."""
        if self.ends_ns is not None:
            return CaseLimits(self.ends_ns, None)
        time_ns = 2 * self._now_ns if 2 * self._now_ns > _DEFAULTS.time_limit_ns else None
        plans = 2 * self._plans if 2 * self._plans > _DEFAULTS.plan_limit else None
        return CaseLimits(time_ns, plans)

    def rules(self) -> list[OutcomeRule]:
        """Return the rules for requests that differ from the default; equal rules in a row become one."""
        rules: list[OutcomeRule] = []
        for subject in self._counts:
            last: OutcomeRule | None = None
            for request in self._requests.values():
                if request.subject != subject:
                    continue
                rule = self._rule(request)
                if rule is not None and last is not None and _continues(last, rule):
                    rules[-1] = last = replace(last, last=rule.last)
                elif rule is not None:
                    rules.append(rule)
                    last = rule
        return rules

    def _rule(self, request: _ScriptedRequest) -> OutcomeRule | None:
        """Return the rule for one request; `None` if it has the default behavior."""
        plain = self._plain[request.resource]
        plainly_ns = request.sent_ns + plain.latency_ns
        rule = OutcomeRule(request.subject, request.number, request.number)
        if request.answer is not None:
            at_ns, happening = request.answer
            return self._answered(replace(rule, latency_ns=at_ns - request.sent_ns), happening, plain)
        if request.cancelled_ns is not None:
            return replace(rule, outcome=Outcome.TIMEOUT) if plainly_ns <= request.cancelled_ns else None
        if plainly_ns > self._now_ns:
            return None
        behind_ns = self._now_ns + max(plain.latency_ns, _A_MOMENT_NS)  # after everything that was decided
        return replace(rule, latency_ns=behind_ns - request.sent_ns)

    def _answered(self, rule: OutcomeRule, happening: Happening, plain: Reaction) -> OutcomeRule | None:
        if rule.latency_ns == plain.latency_ns:
            rule = replace(rule, latency_ns=None)
        if not happening.succeeded:
            is_plain = happening.measured == self._plainly_failed[plain.resource]
            return replace(rule, outcome=Outcome.FAIL, measured=None if is_plain else happening.measured)
        if happening.measured != (plain.measured or ()):
            rule = replace(rule, measured=happening.measured)
        return None if rule.latency_ns is None and rule.measured is None else replace(rule, outcome=Outcome.SUCCEED)

    def _reply(self, happening: Happening) -> None:
        if happening.resource not in self._in_flight:  # a time limit that a later run needs has ended this one
            raise _StrayedError
        self._take_time_to_plan()
        identity = self._in_flight.pop(happening.resource)
        request = self._requests[identity]
        self._now_ns = self._reply_ns(request)
        request.answer = (self._now_ns, happening)
        self._handle(ReplyArrived(identity, happening.succeeded, happening.measured))

    def _reply_ns(self, request: _ScriptedRequest) -> int:
        """Return the time of a reply: the default latency if that is in time and in order; else soon."""
        plainly_ns, limit_ns = request.sent_ns + self._plain[request.resource].latency_ns, self._limit_ns
        # After a deadline that passed during its request a reply comes later, as deadlines pass last in their instant.
        is_at_once = request.number_of_event == self._events
        soon_ns = self._now_ns if is_at_once else min(self._now_ns + _A_MOMENT_NS, limit_ns)
        return plainly_ns if soon_ns <= plainly_ns <= limit_ns else soon_ns

    def _soon_ns(self) -> int:
        """Return a moment at which nothing else happens, before the next deadline if there is time."""
        return max(min(self._now_ns + _A_MOMENT_NS // 2, (self._now_ns + self._limit_ns) // 2), 1)

    def _change(self, happening: Happening) -> None:
        """Let something outside the model change variables, or another user occupy or leave a shared resource."""
        self._take_time_to_plan()
        self._now_ns = self._outside_ns(happening)
        if happening.by is OtherUser:
            self._use(happening)
            return
        if happening.by is TransitionMaker:
            self._rates.act(happening.resource, self._now_ns)
            self.changes.append(EnvironmentChange(self._now_ns, None, happening.resource))
            self._handle(Measured(self._made_by(happening.resource), happening.resource))
        else:
            self.changes.append(EnvironmentChange(self._now_ns, happening.measured))
            self._handle(Measured(happening.measured))

    def _made_by(self, transition: str) -> Changes:
        """Return what an environment transition changes in the present state."""
        before, makers = self._runner.packed_state, self._program.outside.transitions
        after = (after for each in makers if each.name == transition for after in each.following(before, ()))
        return self._program.packing.changes(before, next(after, before))

    def _use(self, happening: Happening) -> None:
        """Let another user occupy a shared resource, or leave it."""
        is_left = any(each.resource == happening.resource and each.hold_ns is None for each in self.injections)
        given = Injection("other_user", happening.measured)
        if is_left:
            self._leave(happening.resource)
        else:
            name = f"other_user_{len(self.injections) + 1}"
            given = Injection(name, at_ns=self._now_ns, resource=happening.resource, condition=_TAKEN)
            self.injections.append(given)
        self._handle(InjectionGiven(given))

    def _leave(self, resource: str) -> None:
        """Let the injection that occupies a resource end now."""
        for number, injection in enumerate(self.injections):
            if injection.resource == resource and injection.hold_ns is None:
                held_ns = self._now_ns - (injection.at_ns or 0)
                self.injections[number] = replace(injection, hold_ns=held_ns)

    def _outside_ns(self, happening: Happening) -> int:
        """Return the time of a change from outside: where its rate allows, if possible before the next plain reply."""
        limit_ns = self._limit_ns
        requests = [self._requests[identity] for identity in self._in_flight.values()]
        replies_ns = [request.sent_ns + self._plain[request.resource].latency_ns for request in requests]
        next_ns = min([at_ns for at_ns in replies_ns if at_ns > self._now_ns + 1], default=None)
        if next_ns is None:
            at_ns = min(self._now_ns + _A_WHILE_NS, (self._now_ns + limit_ns) // 2)
        else:
            middle_ns = (self._now_ns + min(next_ns, limit_ns)) // 2
            rounded_ns = middle_ns // _A_MOMENT_NS * _A_MOMENT_NS
            at_ns = rounded_ns if rounded_ns > self._now_ns else middle_ns
        if happening.by is not TransitionMaker:
            return at_ns
        allowed_ns = self._rates.first_ns(happening.resource, at_ns)
        return at_ns if allowed_ns is None or allowed_ns >= limit_ns else allowed_ns

    def _pass(self) -> None:
        deadline_ns = self._runner.deadline_ns
        assert deadline_ns is not None  # noqa: S101 - a timer runs
        self._now_ns = deadline_ns
        self._handle(TimePassed())

    def _answer_if_alone(self) -> None:
        """Let the planner answer where nothing else can happen; that answer is no event of the path.

        A run that asks again in a state in which it has asked since the last event would do so without end.
        """
        asked_in: dict[tuple[Value, ...], None] = {}
        while self._asked is not None and not self._in_flight and len(asked_in) < MAX_ANSWERS:
            state = tuple(self._asked.state.values())
            if state in asked_in:
                return
            asked_in[state] = None
            self._answer()

    def _answer(self) -> None:
        asked, deadline_ns = self._asked, self._runner.deadline_ns
        assert asked is not None  # noqa: S101 - only a request for a plan is answered
        if deadline_ns is not None and self._answer_ns > deadline_ns:  # a time limit that another run needs comes first
            raise _StrayedError
        self._asked = None
        self._plans += 1
        answer = self._planner.plan(asked.state, asked.goal, self._plan_limits)
        plan = answer.plan if isinstance(answer, Solved) else ()
        if self._chosen is not None and isinstance(answer, Solved):
            self._choices[asked.ask] = (asked, [])
            plan = self._chosen.plan(asked, [each.number for each in self._left if each.kind is HappeningKind.NEXT])
        self._now_ns = max(self._now_ns, self._asked_ns + self.planning_ns)
        self._handle(PlanAnswered(asked.ask, PlanStatus(answer.status), plan))

    @property
    def chosen(self) -> tuple[RecordedPlan, ...]:
        """The chosen plans, by the numbers of questions; nothing where canonical plans are followed."""
        if self._chosen is None or not self._choices:
            return ()
        plans = {ask: RecordedPlan(Solved.status, self._chosen.plan(*each)) for ask, each in self._choices.items()}
        return tuple(plans.get(ask, RecordedPlan(NoPlanFound.status)) for ask in range(1, max(plans) + 1))

    def _handle(self, event: Event) -> None:
        """Let the runner handle an event now, and follow what it does."""
        self._perform(self._runner.handle(event, self._now_ns))
        self._rates.observe(self._runner.packed_state, self._now_ns)

    def _perform(self, effects: Iterable[Effect]) -> None:
        for effect in effects:
            match effect:
                case SendRequest(identity, resource):
                    self._requests[identity] = self._request(resource)
                    self._in_flight[resource] = identity
                case BecameCurrent(operation=operation):
                    self._operation = operation
                case OperationStepped(target=OperationState.INITIAL):
                    self._operation = None
                case CancelRequest(identity, resource):
                    self._requests[identity].cancelled_ns = self._now_ns
                    if self._in_flight.get(resource) == identity:
                        del self._in_flight[resource]
                case AskPlan():
                    self._asked, self._asked_ns = effect, self._now_ns
                case RunStarted(at_ns):
                    self._began_ns = at_ns

    def _request(self, resource: str) -> _ScriptedRequest:
        """Return a request that is sent now; cases name it by its operation where one executes."""
        subjects = (resource,) if self._operation is None else (resource, self._operation)
        for subject in dict.fromkeys(subjects):
            self._counts[subject] = self._counts.get(subject, 0) + 1
        is_clear = self._operation is not None and self._operation not in self._plain
        subject = self._operation if is_clear and self._operation is not None else resource
        return _ScriptedRequest(resource, subject, self._counts[subject], self._now_ns, self._events)


def _continues(last: OutcomeRule, rule: OutcomeRule) -> bool:
    """Return whether a rule has the same content as the last one, for the next request."""
    return last.last is not None and rule == replace(last, first=last.last + 1, last=last.last + 1)
