"""Proofs that nothing visits an obligation, cheap arguments first; their certificates, and the runs that they explore.

The cheapest are facts of the model file: no deadline, no way to fail, a precondition that is true. For these each
operation is taken by itself; nothing that happens in runs is used.

What no run visits whichever plans are chosen is uncoverable. What no run visits under canonical plans, while others
may, is excluded by the planner.
"""

from __future__ import annotations

from functools import cache, partial
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases.coverage import Aspect, Obligation
from scbm.closing.proofs.nearest_misses import nearest_miss
from scbm.closing.proofs.possible_values import possible_values, ruled_out
from scbm.closing.runs.all_runs import AllRuns, RunScope
from scbm.files import digest_of
from scbm.model import (
    Constant,
    Equal,
    GoalOrder,
    Not,
    OperationState,
    PlanSet,
    Reference,
    Role,
    StateSpace,
)
from scbm.model.predicates import all_needed
from scbm.model.satisfiability import is_satisfiable
from scbm.model.sources import outside_groups
from scbm.model.variables import CURRENT_STATE, operation_state_name
from scbm.planning import planner_of
from scbm.planning.engines import may_leave
from scbm.proofcheck import (
    Awaits,
    Certificate,
    Fact,
    GoalRuns,
    RunsArgument,
    SetsArgument,
    Situation,
    StructureArgument,
    ValuesArgument,
)
from scbm.running.compiled_steps import OperationPart
from scbm.running.lifecycle import is_current_in, states_trying

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from scbm.closing.runs.all_runs import CloseLimits
    from scbm.closing.symbolic.set_proofs import SetProofs
    from scbm.model import BehaviorModel, Operation, PlannerIdentity, Predicate, Transition
    from scbm.planning import Planner
    from scbm.proofcheck import Argument


def structural_facts(model: BehaviorModel) -> tuple[tuple[Obligation, Fact, str], ...]:
    """Return the obligations that facts of the model file settle, each with its fact and a sentence for people.

    They are in the order of the operations; of one operation *disabled*, *failed*, *timedout*.
    """
    return tuple(found for operation in model.operations for found in _facts(operation, model))


def failing_transitions(operation: Operation, model: BehaviorModel) -> tuple[str, ...]:
    """Return the names of all transitions that may fail an operation: its own `failed`, then automatic ones."""
    own = [operation.failed.name] if operation.failed is not None else []
    states = (operation_state_name(operation.name), CURRENT_STATE)
    automatic = [
        transition.name
        for transition in model.automatic_transitions
        if any(action.target in states for action in transition.running_actions)
    ]
    return (*own, *automatic)


def ways_to_fail(operation: Operation, model: BehaviorModel) -> tuple[Transition, ...]:
    """Return the automatic transitions that are meant to fail an operation.

    Not those whose guard needs that another operation executes, or something of a request that the operation does not
    send: such a guard may hold meanwhile, but a model is not changed for it.
    """
    names, own = failing_transitions(operation, model), operation_state_name(operation.name)
    sent = [action.target for transition in (operation.pre, operation.post) for action in transition.running_actions]
    foreign = [each for each in (operation_state_name(other.name) for other in model.operations) if each != own]
    for resource in model.resources:
        foreign += [] if resource.trigger in sent else [resource.trigger, resource.request_state]
    known = dict.fromkeys(foreign)
    return tuple(
        transition
        for transition in model.automatic_transitions
        if transition.name in names
        and not any(name in known for part in all_needed(transition.running_guard) for name in part.reads())
    )


def _facts(operation: Operation, model: BehaviorModel) -> Iterator[tuple[Obligation, Fact, str]]:
    name = operation.name
    if _is_always_enabled(operation, model.running_space):
        why = f"the precondition of {name} always holds, so it is never disabled"
        yield Obligation(name, Aspect.DISABLED), Fact.ALWAYS_ENABLED, why
    if not failing_transitions(operation, model):
        why = f"{name} has no `failed` transition and no automatic transition assigns its state, so it never fails"
        yield Obligation(name, Aspect.FAILED), Fact.CANNOT_FAIL, why
    if operation.deadline_ns is None:
        yield Obligation(name, Aspect.TIMEDOUT), Fact.NO_DEADLINE, f"{name} has no `deadline`, so it never times out"


def _is_always_enabled(operation: Operation, space: StateSpace) -> bool:
    """Return whether the precondition is enabled in every state; `False` also if that is unknown."""
    if any(may_leave(action, space) for action in operation.pre.running_actions):
        return False
    guard = operation.pre.running_guard
    read = StateSpace(space[name] for name in guard.reads())
    return is_satisfiable(Not(guard), read) is False


class Proof(Struct, frozen=True):
    """The proof that nothing visits one obligation.

    Attributes:
        kind: the kind of its argument.
        reason: one sentence.
        plans: the plans of the runs that it is about.
    """

    kind: str
    reason: str
    plans: PlanSet = PlanSet.ANY

    @property
    def certificate(self) -> str:
        """The name of its certificate."""
        return self.kind if self.plans is PlanSet.ANY else f"{self.kind}-{self.plans}"


class Proofs:
    """The proofs of a model.

    Attributes:
        explored: the explored runs that prove something, those of any plans first.
        sets: the proofs by a set of all situations, once they were looked for and found.
        canonical_sets: those by a set of the situations of canonical plans, likewise.
    """

    def __init__(self, model: BehaviorModel) -> None:
        self.explored: tuple[AllRuns, ...] = ()
        self.sets: SetProofs | None = None
        self.canonical_sets: SetProofs | None = None
        self._known: dict[tuple[Obligation, int], Proof | None] = {}
        self._model = model
        self._facts = {obligation: (fact, reason) for obligation, fact, reason in structural_facts(model)}
        self._values = possible_values(model)
        self._ruled_out = dict(ruled_out(model, self._values))

    def cheap(self, obligation: Obligation) -> Proof | None:
        """Return a proof that needs no exploration of runs; `None` if there is none."""
        if obligation in self._facts:
            return Proof(StructureArgument.kind, self._facts[obligation][1])
        if obligation in self._ruled_out:
            return Proof(ValuesArgument.kind, self._ruled_out[obligation])
        if self.sets is not None and self.sets.proves(obligation):
            return Proof(SetsArgument.kind, self.sets.reason(obligation))
        return None

    def find(self, obligation: Obligation) -> Proof | None:
        """Return a proof, the strongest that there is; `None` if there is none."""
        proof = self.cheap(obligation)
        if proof is None:
            found = (self._by_runs(obligation, runs) for runs in self.explored)
            proof = next((each for each in found if each is not None), None)
        sets = self.canonical_sets
        if proof is None and sets is not None and sets.proves(obligation):
            return Proof(SetsArgument.kind, sets.reason(obligation), sets.plans)
        return proof

    def _by_runs(self, obligation: Obligation, runs: AllRuns) -> Proof | None:
        """Return the proof by exploration of all runs; memoized, as its reason looks at all of them."""
        key = obligation, id(runs)
        if key not in self._known:
            self._known[key] = by_runs(obligation, runs)
        return self._known[key]

    def certificates(self, proved: Sequence[tuple[Obligation, Proof]]) -> Iterator[tuple[str, Certificate]]:
        """Yield one certificate, with its name, for each argument that is needed; those of explored runs last."""
        digest = digest_of(self._model)
        canonical = Proof(SetsArgument.kind, "", PlanSet.CANONICAL).certificate
        kinds = (StructureArgument.kind, ValuesArgument.kind, SetsArgument.kind, canonical)
        known: list[tuple[str, AllRuns | None]] = [(kind, None) for kind in kinds]
        known += [(Proof(RunsArgument.kind, "", runs.plans).certificate, runs) for runs in self.explored]
        for name, runs in known:
            claims = tuple((obligation, proof) for obligation, proof in proved if proof.certificate == name)
            if claims:
                argument = self._argument(name, [obligation for obligation, _ in claims], runs)
                claimed = tuple(str(obligation) for obligation, _ in claims)
                planner = None if claims[0][1].plans is PlanSet.ANY else planner_of_proofs(self._model)
                yield name, Certificate(self._model.name, digest, claimed, argument, planner)

    def _argument(self, kind: str, claimed: Sequence[Obligation], runs: AllRuns | None) -> Argument:
        if kind == StructureArgument.kind:
            return StructureArgument(tuple(self._facts[obligation][0] for obligation in claimed))
        sets = self.sets if kind == SetsArgument.kind else self.canonical_sets
        if runs is None and kind.startswith(SetsArgument.kind) and sets is not None:
            return sets.argument
        return ValuesArgument(dict(self._values)) if runs is None else runs_argument(runs)


def planner_of_proofs(model: BehaviorModel) -> PlannerIdentity:
    """Return the planner without limits: they only end runs earlier, so claims about all runs hold with them too."""
    return replace(planner_of(model), max_length=None, max_expanded=None)


def by_runs(obligation: Obligation, runs: AllRuns) -> Proof | None:
    """Return a proof by exploration of all runs; `None` if a run visits the obligation, or they are incomplete.

    Runs of another planner than the canonical one prove nothing: the planner may choose other plans.
    """
    bit = runs.visits.bit(obligation.subject, obligation.aspect)
    if not runs.proves or (runs.visited | runs.cut_off) & bit:
        return None
    return Proof(RunsArgument.kind, _reason(obligation, runs), runs.plans)


def _reason(obligation: Obligation, runs: AllRuns) -> str:
    """Return a sentence: what keeps all runs from visiting an obligation, and where a run comes nearest."""
    name, visits, visited = obligation.subject, runs.visits, runs.visited
    if obligation.aspect is Aspect.TAKEN:
        return _reason_not_taken(obligation, runs)
    if not visited & visits.bit(name, Aspect.QUEUED):
        count = len(runs.model.goals)
        goals = "the only goal" if count == 1 else f"any of the {count} goals"
        return f"{name} is in no plan to {goals}"
    if not visited & visits.current(name):
        return f"{name} is planned, but every such run ends before the operation becomes current"
    if obligation.aspect is Aspect.DISABLED:
        which = " in any plan" if runs.plans is PlanSet.ANY else ""
        sentence = f"{name} is never disabled{which}, unless a case forces it"
        return f"{sentence}: its precondition holds whenever it is checked"
    return _reason_of_current(obligation, runs)


def _reason_of_current(obligation: Obligation, runs: AllRuns) -> str:
    """Return the sentence about an operation that becomes current, and then does not do something."""
    name, operation = obligation.subject, runs.model.operation(obligation.subject)
    if not runs.visited & runs.visits.bit(name, Aspect.EXECUTING):
        pre, waits = operation.pre, is_current_in(name, states_trying(OperationPart.PRE))
        why = _why((pre.g, pre.gr), runs, waits, "its precondition", " when it is current")
        return f"{name} never executes{why}"
    executes = is_current_in(name, (OperationState.EXECUTING,))
    if obligation.aspect is Aspect.COMPLETED:
        why = _why((operation.post.g, operation.post.gr), runs, executes, "its postcondition", " while it executes")
        return f"{name} executes, but it never completes{why}"
    if obligation.aspect is Aspect.FAILED:
        return f"{name} executes, but it never fails{_why_not_failed(operation, runs, executes)}"
    return f"{name} executes, but it never times out: nothing can happen before it ends"


def _why(guards: Sequence[Predicate], runs: AllRuns, when: Predicate, what: str, where: str) -> str:
    """Return the rest of a sentence: the conjuncts that never hold together, and the nearest miss."""
    miss = nearest_miss(guards, runs, when)
    return "" if miss is None else f": {miss.words(what, where)}"


def _why_not_failed(operation: Operation, runs: AllRuns, executes: Predicate) -> str:
    """Return the rest of the sentence for the way to fail that runs come nearest to."""
    model = runs.model
    own = [] if operation.failed is None else [("its `failed`", operation.failed)]
    automatic = [(str(Obligation(t.name, Aspect.TAKEN)), t) for t in ways_to_fail(operation, model)]
    found = [(what, nearest_miss((t.g, t.gr), runs, executes)) for what, t in (*own, *automatic)]
    misses = [(what, miss) for what, miss in found if miss is not None]
    if not misses:
        return ""
    # A guard about another operation that executes is no way for this one to fail.
    what, nearest = min(misses, key=lambda each: (each[1].is_about_runner(model.running_space), each[1].lacking))
    return f": {nearest.words(what, ' while it executes')}"


def _reason_not_taken(obligation: Obligation, runs: AllRuns) -> str:
    transition = next(t for t in runs.model.automatic_transitions if t.name == obligation.subject)
    space = runs.model.running_space
    fails = [
        Equal(Reference(action.target), Constant(OperationState.EXECUTING.value))
        for action in transition.running_actions
        if space[action.target].role in (Role.OPERATION_STATE, Role.CURRENT_STATE)
    ]
    miss = nearest_miss((transition.g, transition.gr, *fails), runs)
    if miss is not None:
        return f"no run takes {obligation}: {miss.words('it')}"
    return f"no run takes {obligation}: where its guard holds, an earlier one is taken, or it would change nothing"


def runs_argument(runs: AllRuns) -> RunsArgument:
    """Return the situations of explored runs as an argument of a certificate."""
    space = runs.program.packing.space
    names = tuple(name for name in runs.relevance.names if space[name].role is not Role.OPERATION_STATE)
    read = cache(runs.program.packing.reader(names))
    resources = runs.program.requests
    contents = [cache(runs.queues(goal).content) for _, goal in runs.model.goals]
    found: list[list[Situation]] = [[] for _ in runs.model.goals]
    for number, graph in enumerate(runs.graphs):
        for position in graph.positions:
            if not position.is_at_rest:
                goal = number if runs.goals is GoalOrder.SINGLE else position.goal
                queue = contents[goal](position.queue)
                in_flight = tuple(resources[number].resource.name for number in position.in_flight)
                found[goal].append(Situation(read(position.state), queue, in_flight, Awaits(position.awaits.value)))
    parts = zip(runs.model.goals, found, strict=True)
    named = (GoalRuns(name, tuple(situations), runs.planned_names(goal)) for (name, goal), situations in parts)
    return RunsArgument(names, tuple(named), runs.goals, runs.plans)


_MAX_OF_ANY_PLANS = 100_000
"""Maximum number of situations of runs with any plans in a model with canonical plans, mostly some times as many."""


_FEW_OF_ANY_PLANS = 10_000
"""So many situations of runs with any plans are explored before all of them are collected in a set."""


_TIMES_OF_CANONICAL_PLANS = 3
"""Runs with any plans mostly have at least so many times the situations of those with canonical plans."""

_FEW_PLANNED = 50_000
"""So many states of the world are expanded to plan these few runs."""


def scope_of_proofs(model: BehaviorModel, plans: PlanSet = PlanSet.CANONICAL) -> RunScope:
    """Return which runs proofs about a model are about."""
    return RunScope(bool(outside_groups(model)), model.runs.goals, plans)


def explored_for_proofs(  # noqa: PLR0913, PLR0917 - what is explored, how far, and what else proves
    model: BehaviorModel,
    limits: CloseLimits | None,
    progress: Callable[[str], None],
    missing: int,
    known: Sequence[AllRuns],
    by_sets: Callable[[int], SetProofs | None] = lambda _: None,
) -> tuple[AllRuns, ...]:
    """Return the explored runs that prove something about what is missing, those of any plans first.

    Args:
        model: the model.
        limits: the limits of the exploration; `None` for the known runs alone.
        progress: called with a description of each phase as it begins.
        missing: the obligations that are left to decide, as bits of `Visits`.
        known: runs that were explored before, of which some may be those of proofs.
        by_sets: returns the proofs by a set of all situations about what is missing, if there are any. What they prove
            is not looked for in explored runs.

    Raises:
        KeyboardInterrupt: the user ended the exploration.
    """
    is_canonical = all(runs.other_planner is None for runs in known)
    canonical = next((runs for runs in known if runs.scope == scope_of_proofs(model)), None)
    if canonical is not None:
        missing &= ~(canonical.visited | canonical.cut_off)  # no proof is about these
    found = []
    declared = model.runs.proved_plans
    for plans in dict.fromkeys((PlanSet.ANY, declared)):
        if not missing or (plans is not PlanSet.ANY and not is_canonical):
            break
        runs = canonical if plans is PlanSet.CANONICAL else None
        if runs is None:
            if limits is None:
                continue
            most = limits.situations if plans is declared else min(limits.situations, _MAX_OF_ANY_PLANS)
            least = canonical.situations + (canonical.stopped is not None) if canonical and is_canonical else 0
            planner = known[0].planner if known and is_canonical else None
            explored = partial(_explored, model, progress, scope_of_proofs(model, plans), missing, planner=planner)
            few = None
            bounds = replace(limits, situations=most)
            if plans is PlanSet.ANY:
                are_few = least * _TIMES_OF_CANONICAL_PLANS <= _few(bounds).situations
                few = explored(_few(bounds), may_go_on=True) if are_few else None
                runs = few if few is not None and few.stopped is None else None
                missing, left = (missing, 0) if runs is not None else _without_proved(missing, few, by_sets)
                if runs is None and (not left or (few is not None and _few(bounds) == bounds)):
                    continue
            if least > most:
                continue  # canonical plans are plans: with any of them, runs can be in no fewer situations
            runs = runs or explored(bounds, few)
        if runs.proves:
            found.append(runs)
            missing &= runs.visited | runs.cut_off
    return tuple(found)


def _explored(  # noqa: PLR0913, PLR0917 - as above
    model: BehaviorModel,
    progress: Callable[[str], None],
    scope: RunScope,
    missing: int,
    limits: CloseLimits,
    few: AllRuns | None = None,
    *,
    planner: Planner | None,
    may_go_on: bool = False,
) -> AllRuns:
    """Return the runs within limits: all that follow `few`, if these were explored."""
    if few is not None:
        runs = few.within(limits, only_proves=True)
    else:
        only_proves = not may_go_on
        runs = AllRuns(
            model, limits, progress, scope, until=missing, planner=planner, may_go_on=may_go_on, only_proves=only_proves
        )
    if runs.is_interrupted:
        raise KeyboardInterrupt
    return runs


def _few(limits: CloseLimits) -> CloseLimits:
    """Return the limits of the runs of any plans that are explored before sets are looked for."""
    situations, planning = min(limits.situations, _FEW_OF_ANY_PLANS), min(limits.planning, _FEW_PLANNED)
    return replace(limits, situations=situations, planning=planning)


def _without_proved(missing: int, few: AllRuns | None, by_sets: Callable[[int], SetProofs | None]) -> tuple[int, int]:
    """Return what is missing without what a set proves, and what of it more runs of any plans may prove.

    Args:
        missing: the obligations that are missing, as bits.
        few: some runs of any plans, if they were explored.
        by_sets: returns the proofs by a set about what is missing, if there are any.
    """
    left = missing if few is None else missing & ~(few.visited | few.cut_off)
    sets = by_sets(left) if left else None
    if sets is None:
        return missing, left
    return missing & ~sets.never, left & ~sets.never & ~sets.surely
