"""A test case: the inputs that decide a run, and the results that it expects (semantics 7.1).

Part of the inputs are reactions to requests: the reply of a resource, and the delivery of its messages (semantics 6).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases.network import Network
from scbm.model import FIRST_PLANNER, PlannerIdentity

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.cases.coverage import Obligation
    from scbm.cases.injections import EnvironmentChange, Injection
    from scbm.cases.trace import Changes, End
    from scbm.model import BehaviorModel, Outcome, Predicate, Requirement, State


Delivery: TypeAlias = tuple[int, ...]
"""The latency of each copy of a message that arrives, in nanoseconds."""

AT_ONCE: Delivery = (0,)
"""A message arrives once, without latency."""

LOST: Delivery = ()
"""A message does not arrive."""


class Reaction(Struct, frozen=True):
    """The complete reaction to one request.

    Attributes:
        resource: the resource that the request was sent to.
        outcome: success, failure, or no reply.
        latency_ns: the time from the arrival of the request to the reply.
        measured: the values that the reply carries; `None` if it carries none.
        request, reply, cancel: the delivery of each message; `None` leaves it to the network. The resource answers each
            copy of a request, and all these replies are delivered alike.
    """

    resource: str
    outcome: Outcome
    latency_ns: int
    measured: Changes | None = None
    request: Delivery | None = None
    reply: Delivery | None = None
    cancel: Delivery | None = None


class OutcomeRule(Struct, frozen=True):
    """The reaction that a case prescribes for some requests to a resource, or sent while an operation executes.

    Requests are numbered from 1, for each resource and for each operation. `None` prescribes nothing. If rules for an
    operation and for a resource apply to one request, the rule for the operation takes precedence.

    Attributes:
        subject: the name of a resource or of an operation.
        first: the number of the first request that the rule applies to.
        last: the number of the last one; `None` for all later requests.
        outcome, latency_ns, measured, request, reply, cancel: as in `Reaction`.
    """

    subject: str
    first: int
    last: int | None
    outcome: Outcome | None = None
    latency_ns: int | None = None
    measured: Changes | None = None
    request: Delivery | None = None
    reply: Delivery | None = None
    cancel: Delivery | None = None


class Expectations(Struct, frozen=True):
    """The results that a case expects; an attribute that is empty or `None` expects nothing.

    Attributes:
        verdict: how the run ends.
        plan: the operations of the first plan, all of them.
        order: operations that complete in this order; others may complete between them.
        final: predicates over the state at the end.
        visits: obligations that the run visits.
    """

    verdict: End | None = None
    plan: tuple[str, ...] | None = None
    order: tuple[str, ...] = ()
    final: tuple[Predicate, ...] = ()
    visits: tuple[Obligation, ...] = ()


_PERFECT = Network()
_NOTHING = Expectations()


class CaseGoal(Struct, frozen=True):
    """One goal of a case.

    Attributes:
        name: the name of the goal, or its predicate if it has no name.
        predicate: the goal as a predicate.
        when: the predicate that must hold for the runner to begin; `None` begins as soon as the run before has ended.
        expect: the expected results of the run for this goal.
        may_end: the ends that excuse a missed goal.
    """

    name: str
    predicate: Predicate
    when: Predicate | None = None
    expect: Expectations = _NOTHING
    may_end: tuple[End, ...] = ()


BETWEEN_GOALS = ", then "
"""The words between the goals of a case in reports and stores."""


class CaseGoalNames(NamedTuple):
    """The goals of a case.

    Attributes:
        name: the name of the case.
        goals: the names of its goals; of a goal that the model does not have, the predicate.
    """

    name: str
    goals: tuple[str, ...]


class Origin(Struct, frozen=True):
    """The random streams that a case draws from: those of case `number` (from 1) of the campaign with this seed.

    Attributes:
        seed: the seed.
        number: the number of the case.
        moves_inputs: whether inputs and published values that no environment transition changes are moved as well.
        goals: the largest number of goals that the case could have drawn.
    """

    seed: int
    number: int = 1
    moves_inputs: bool = False
    goals: int = 1


class CaseLimits(Struct, frozen=True):
    """The limits of a run; for `None` the caller of the simulation chooses the limit.

    Attributes:
        time_ns: maximum time for which a goal is pursued, in nanoseconds.
        plans: maximum number of plans for a goal.
    """

    time_ns: int | None = None
    plans: int | None = None


class RecordedPlan(Struct, frozen=True):
    """The answer of the planner to one question of a run.

    Attributes:
        status: the answer: `solved`, `unsolvable`, `limit_reached` or `no_plan_found`.
        plan: the operations, in order, if the answer is a plan.
    """

    status: str
    plan: tuple[str, ...] = ()


class RecordedGoal(Struct, frozen=True):
    """The recorded result of the run for one goal of a case; a part that is `None` is not recorded.

    Names and values are texts, so that a record can be read for a model that no longer has them.

    Attributes:
        end: how the run ended.
        visits: the names of exactly the obligations that it visited, those of one operation together.
        order: exactly the operations that completed, in their order.
        final: the values of all declared variables at its end.
        ended_ns: the simulated time from the beginning of the case to its end, in nanoseconds.
    """

    end: str
    visits: tuple[str, ...] | None = None
    order: tuple[str, ...] | None = None
    final: tuple[tuple[str, str], ...] | None = None
    ended_ns: int | None = None


class RecordedRun(Struct, frozen=True):
    """The result of the run that a case was saved from.

    Attributes:
        end: how the run for the last goal ended.
        trace: the digest of its trace; `None` if it is not recorded.
        planner: the planner that made its plans.
        goals: what the run for each goal did; empty if that is not recorded.
    """

    end: str
    trace: str | None = None
    planner: PlannerIdentity = FIRST_PLANNER
    goals: tuple[RecordedGoal, ...] = ()


class Case(Struct, frozen=True):
    """One test case. A choice that it leaves open has its default, or is drawn if it has an origin (decision 11).

    Most cases have one goal. `goal`, `predicate`, `expect` and `may_end` are those of the first one.

    Attributes:
        name: its name in reports.
        goal: the name of the first goal, or its predicate if it has no name.
        predicate: the first goal as a predicate.
        initial: the state in which the run begins.
        outcomes: the reactions of resources and network to requests.
        injections: the injections, in the order in which they are armed.
        network: how messages travel where `outcomes` does not decide it.
        limits: the limits of the run.
        requirements: requirements beside those of the model.
        expect: the expected results of the run for the first goal.
        origin: the random streams for choices that the case leaves open; `None` draws nothing.
        recorded: the result of the run that the case was saved from.
        plans: the answers of the planner, in the order of the questions; without them the planner is asked.
        environment: all changes from outside, in order. For `None` the environment acts at the rates of the model if
            the case has an origin, and not at all otherwise.
        may_end: the ends that excuse a missed first goal.
        later: the goals after the first one, in order.
        when: the predicate that must hold for the runner to begin with the first goal; `None` begins at once.
        planning_ns: how long each plan takes.
    """

    name: str
    goal: str
    predicate: Predicate
    initial: State
    outcomes: tuple[OutcomeRule, ...] = ()
    injections: tuple[Injection, ...] = ()
    network: Network = _PERFECT
    limits: CaseLimits = CaseLimits()
    requirements: tuple[Requirement, ...] = ()
    expect: Expectations = _NOTHING
    origin: Origin | None = None
    recorded: RecordedRun | None = None
    plans: tuple[RecordedPlan, ...] = ()
    environment: tuple[EnvironmentChange, ...] | None = None
    may_end: tuple[End, ...] = ()
    later: tuple[CaseGoal, ...] = ()
    when: Predicate | None = None
    planning_ns: int = 0

    @property
    def goals(self) -> tuple[CaseGoal, ...]:
        """All goals, in order."""
        return (CaseGoal(self.goal, self.predicate, self.when, self.expect, self.may_end), *self.later)

    def with_goals(self, goals: Sequence[CaseGoal]) -> Case:
        """Return the case with other goals, at least one."""
        first, *later = goals
        changed = replace(self, goal=first.name, predicate=first.predicate, expect=first.expect, later=tuple(later))
        return replace(changed, may_end=first.may_end, when=first.when)

    def goals_in(self, model: BehaviorModel) -> CaseGoalNames:
        """Return the names of its goals in a model."""
        known = dict(model.goals)
        names = (each.name if known.get(each.name) == each.predicate else str(each.predicate) for each in self.goals)
        return CaseGoalNames(self.name, tuple(names))

    @property
    def goal_names(self) -> str:
        """The names of all goals for reports, in order."""
        return BETWEEN_GOALS.join((self.goal, *(goal.name for goal in self.later)))

    @property
    def predicates(self) -> str:
        """The predicates of all goals for reports, in order."""
        return BETWEEN_GOALS.join((str(self.predicate), *(str(goal.predicate) for goal in self.later)))
