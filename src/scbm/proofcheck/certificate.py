"""The parts of a certificate: obligations that no run without injections visits, and an argument why (decision 18).

Situations and arguments are records of the JSON of certificates: their fields are its keys, with their limits.
`CertificateFlaw` says why a certificate that can be read is not a proof. The names of obligations (semantics 8.1, 8.2)
are defined a second time for the checker; `scbm.cases.coverage` has the names for everything else. A test compares the
two.
"""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, ClassVar, Protocol, TypeAlias

from msgspec import Meta, Struct

from scbm.model import GoalOrder, PlanSet
from scbm.model.json_reader import MAX_COUNT, JsonRecord
from scbm.model.requirements import BUILT_IN_NAMES
from scbm.model.visible_text import printable

if TYPE_CHECKING:
    from scbm.model import BehaviorModel, PlannerIdentity


class ClaimedAspect(StrEnum):
    """The state of an operation, or the taking of a transition, that a claim is about."""

    DISABLED = "disabled"
    EXECUTING = "executing"
    FAILED = "failed"
    TIMEDOUT = "timedout"
    COMPLETED = "completed"
    QUEUED = "queued"
    TAKEN = "taken"


class ClaimedObligation(Struct, frozen=True):
    """One aspect of an operation, or the taking of an automatic transition."""

    subject: str
    aspect: ClaimedAspect

    def __str__(self) -> str:
        return f"automatic/{self.subject}" if self.aspect is ClaimedAspect.TAKEN else f"{self.subject}/{self.aspect}"


def claimable_obligations(model: BehaviorModel) -> tuple[ClaimedObligation, ...]:
    """Return everything that a certificate for a model may claim."""
    aspects = [aspect for aspect in ClaimedAspect if aspect is not ClaimedAspect.TAKEN]
    of_operations = [ClaimedObligation(operation.name, aspect) for operation in model.operations for aspect in aspects]
    return (*of_operations, *(ClaimedObligation(t.name, ClaimedAspect.TAKEN) for t in model.automatic_transitions))


class ClaimedRequirement(Struct, frozen=True):
    """A requirement of the model, or a built-in one, which may be called alike."""

    name: str
    is_built_in: bool = False

    def __str__(self) -> str:
        return f"{'built_in' if self.is_built_in else 'requirement'}/{self.name}"


def claimable_requirements(model: BehaviorModel) -> tuple[ClaimedRequirement, ...]:
    """Return everything that a certificate about requirements of a model may claim."""
    off = [name for name, _ in model.requirements_off]
    built_in = (ClaimedRequirement(name, is_built_in=True) for name in BUILT_IN_NAMES if name not in off)
    return (*built_in, *(ClaimedRequirement(requirement.name) for requirement in model.requirements))


class Fact(StrEnum):
    """Facts that the model file shows."""

    NO_DEADLINE = "no_deadline"
    """The operation has no deadline."""
    CANNOT_FAIL = "cannot_fail"
    """Nothing fails the operation: it has no `failed` transition, and no automatic one assigns its state."""
    ALWAYS_ENABLED = "always_enabled"
    """Whatever the state, `g && gr` of its precondition holds and its actions fit."""


MAX_WORD = 1_000
Word: TypeAlias = Annotated[str, Meta(min_length=1, max_length=MAX_WORD)]
"""A name, or a value that is a symbol."""

ListedValue: TypeAlias = bool | Annotated[int, Meta(ge=-MAX_COUNT - 1, le=MAX_COUNT)] | Word
"""A value of a variable."""


class StructureArgument(Struct, frozen=True):
    """Facts of the model file, one for each claim, in the same order."""

    kind: ClassVar[str] = "structure"
    facts: tuple[Fact, ...]


class ValuesArgument(Struct, frozen=True):
    """For each variable all values that it has in any run; other values are unreachable (delete relaxation).

    Attributes:
        values: for every variable of the running space its values, in the order of space and domain.
    """

    kind: ClassVar[str] = "values"
    values: dict[Word, tuple[ListedValue, ...]]


class Awaits(StrEnum):
    """What the runner waits for while no operation is current and its queue is empty."""

    NOTHING = "nothing"
    PLAN = "plan"
    """The answer of the planner, which will be the plan in `queue`."""
    UNSOLVABLE = "unsolvable"
    """The answer of the planner, which will be that no plan exists from the present state."""
    STALE = "stale"
    """The answer `unsolvable`, but the state has changed since the plan was requested."""
    CHANGE = "change"
    """Another state: no plan exists from the present one, and requests are in flight."""
    NEXT = "next"
    """The choice of the next operation among several plans; nothing else happens until then."""


Queue: TypeAlias = tuple[ListedValue, ...] | None
"""The operations of a plan that are left, or the state that the rest of the plan starts from; `None` without a plan."""


class Situation(JsonRecord, frozen=True, array_like=True):
    """A situation of a run between two events: the runner is settled, and the run has not ended.

    Attributes:
        values: of the variables of the argument, in their order. `current.name`, `current.state` and `plan.state` are
            among them; the other operation states follow from these.
        queue: what is left of the plan after the current operation; if `awaits` is `PLAN`, the plan that will be the
            answer. For canonical plans these are its operations, and `None` if none is left. For any plans it is
            the state from which the rest starts, by the planner's rules: the values of the variables in `planned` of
            its `GoalRuns`.
        in_flight: the resources with a pending request, in the order of their requests.
        awaits: what the runner waits for beside replies and deadlines.
    """

    values: tuple[ListedValue, ...]
    queue: Queue
    in_flight: tuple[Word, ...]
    awaits: Awaits = Awaits.NOTHING


class GoalRuns(JsonRecord, frozen=True):
    """The situations of the runs for one goal.

    Attributes:
        goal: its name.
        situations: all of them, each once.
        planned: for any plans, the variables on which plans to the goal depend; empty for canonical plans.
    """

    goal: Word
    situations: tuple[Situation, ...]
    planned: tuple[Word, ...] = ()


class RunsArgument(Struct, frozen=True):
    """All situations of all runs.

    Attributes:
        variables: the variables that can influence a run, in the order of the running space, without
            `<operation>.state`.
        runs: the runs for each goal of the model, in order.
        goals: whether each run has one goal, or goals follow each other.
        plans: the plans that the runner may get.
    """

    kind: ClassVar[str] = "runs"
    variables: tuple[Word, ...]
    runs: tuple[GoalRuns, ...]
    goals: GoalOrder = GoalOrder.SINGLE
    plans: PlanSet = PlanSet.CANONICAL


class RequirementsArgument(RunsArgument, frozen=True):
    """All situations of all runs, of which none violates the claimed requirements."""

    kind: ClassVar[str] = "requirements"


NodeNumber: TypeAlias = Annotated[int, Meta(ge=0, le=MAX_COUNT)]


class GoalContinuations(JsonRecord, frozen=True):
    """Why a goal stays reachable, or why nothing asks that it does.

    Attributes:
        goal: its name.
        distances: for each node the number of steps of a shortest continuation before the one that reaches the goal in
            a run for it, or -1; empty if plain runs make the goal unreachable.
        history: the nodes of such plain runs, in order; the last one is a rest.
        closed: the nodes of all continuations after them.
    """

    goal: Word
    distances: tuple[Annotated[int, Meta(ge=-1, le=MAX_COUNT)], ...] = ()
    history: tuple[NodeNumber, ...] = ()
    closed: tuple[NodeNumber, ...] = ()


class ContinuationsArgument(RunsArgument, frozen=True, kw_only=True):
    """All situations of all runs, and how continuations lead from them to goals.

    Attributes:
        rests: the values of the variables of each settled runner without a goal. The nodes are these, from 0, and then
            the situations of each goal.
        answers: one for each goal of the model, in order.
    """

    kind: ClassVar[str] = "continuations"
    rests: tuple[tuple[ListedValue, ...], ...]
    answers: tuple[GoalContinuations, ...]


PHASE, GOAL = "the phase", "the goal"
"""The variables of what the runner does, and of the goal that it pursues, in situations of sets."""


class SetPhase(StrEnum):
    """What the runner does in a situation of a set."""

    REST = "rest"
    """It is at rest, and a goal can be given."""
    OVER = "over"
    """It is at rest after the only goal."""
    NO_PLAN = "no plan"
    ASKING = "asking"
    """It waits for the planner."""
    PLAN = "plan"
    PLANNED = "planned"
    """No situation of a run: the operations of a plan are listed, from the predicted state on."""


def predicted_name(variable: str) -> str:
    """Return the name of a variable of the state from which the rest of a plan starts, by the planner's rules."""
    return f"predicted {variable}"


def request_name(resource: str) -> str:
    """Return the name of the variable that is true while a request is in flight."""
    return f"request {resource}"


SetNumber: TypeAlias = Annotated[int, Meta(ge=0, le=MAX_COUNT)]
SetNode: TypeAlias = tuple[SetNumber, ...]
"""The number of a variable, then for each of its values the number of a set.

Set 0 has no situation, set 1 has all, and set n + 2 is that of node n, which stands before this node.
"""


MAX_CHANGES = 20_000
"""Maximum number of combinations of values that the planner reads and changes for one operation of canonical plans."""


class SetsArgument(Struct, frozen=True):
    """A set of situations that no step of a run leaves, in the midst of settling included.

    Attributes:
        variables: the names of `set_variables`, in the order in which nodes compare them.
        nodes: the nodes of decision diagrams over these variables.
        reached: the number of the set.
        dead: the number of a set of predicted states from which no plan leads to the goal.
        goals: whether each run has one goal, or goals follow each other.
        plans: the plans that the runner may get.
        layers: for canonical plans, the numbers of the sets of predicted states from which the goal is no operation
            away, one, two, and so on.
        choices: for canonical plans, for each operation of the model, in order, the number of the set of predicted
            states in which it is the next one.
    """

    kind: ClassVar[str] = "sets"
    variables: tuple[Word, ...]
    nodes: tuple[SetNode, ...]
    reached: SetNumber
    dead: SetNumber
    goals: GoalOrder = GoalOrder.SINGLE
    plans: PlanSet = PlanSet.ANY
    layers: tuple[SetNumber, ...] = ()
    choices: tuple[SetNumber, ...] = ()


class RequirementSetsArgument(SetsArgument, frozen=True, kw_only=True):
    """A set of situations, in which no state violates the claimed requirements.

    Attributes:
        watched: for each claim, in order, the number of a set: of the situations in which a state can violate it. For
            `always` and `never` these are all, for `before` those until p has held, for `after … until` those since p
            has held and r has not.
    """

    kind: ClassVar[str] = "requirement_sets"
    watched: tuple[SetNumber, ...]


class Argument(Protocol):
    """Why no run visits the claimed obligations."""

    @property
    def kind(self) -> str:
        """The name of an entry of `ARGUMENTS`."""
        ...


class Certificate(Struct, frozen=True):
    """Claims with one argument for all of them.

    Attributes:
        model: the model's name.
        digest: the SHA-256 of the model as `scbm.files.write_model` writes it. A certificate of another version of the
            model is recognized by it.
        claims: at least one.
        planner: the planner of the runs that the claims are about; `None` if they are not about one planner alone.
    """

    model: str
    digest: str
    claims: tuple[str, ...]
    argument: Argument
    planner: PlannerIdentity | None = None

    @property
    def goals(self) -> GoalOrder:
        """The goals of the runs that the claims are about; facts and values hold for sequences of goals, too."""
        return self.argument.goals if isinstance(self.argument, RunsArgument | SetsArgument) else GoalOrder.SEQUENCE

    @property
    def plans(self) -> PlanSet:
        """The plans of the runs that the claims are about; facts and values hold for any plans."""
        return self.argument.plans if isinstance(self.argument, RunsArgument | SetsArgument) else PlanSet.ANY

    @property
    def is_about_requirements(self) -> bool:
        """Whether the claims are requirements, and not obligations."""
        return isinstance(self.argument, RequirementsArgument | ContinuationsArgument | RequirementSetsArgument)

    @property
    def is_for_any_plan(self) -> bool:
        """Whether the claims hold whichever plans are chosen."""
        return self.plans is PlanSet.ANY


class CertificateFlaw(Struct, frozen=True):
    """One reason why a certificate proves nothing.

    Attributes:
        where: the claim, the variable, or the situation and the event.
        reason: what is wrong there, lower case, without a full stop.
    """

    where: str
    reason: str

    def __str__(self) -> str:
        return printable(f"{self.where}: {self.reason}")
