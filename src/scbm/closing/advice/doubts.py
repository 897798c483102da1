"""Doubts, the warnings of `scbm check`, as far as the text of a model shows them; each names a part of the file.

These are guards and requirements that cannot hold, planning guards that read the runner's variables, variables that
nothing reads, unhandled failures, replies without a deadline or after it, and waivers with doubtful dates.
`plan_doubts` explores the model.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.closing.advice.instant_operations import completes_at_once
from scbm.model import (
    Always,
    Assign,
    Constant,
    Never,
    Not,
    Outcome,
    RequestState,
    Severity,
    Slug,
    Truth,
    format_value,
)
from scbm.model.durations import format_duration
from scbm.model.predicates import conjuncts
from scbm.model.satisfiability import is_satisfiable
from scbm.model.sources import unassigned, undeclared
from scbm.testing.request_protocol import clears

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel, Operation, Predicate, Requirement, Resource, Transition


class Doubt(Struct, frozen=True):
    """One doubt.

    Attributes:
        slug: its identifier, which `scbm help SLUG` explains.
        message: one sentence.
        path: the keys that lead to the part of the model file, and the positions in lists.
        remedy: what to inspect or to change.
        severity: a warning, or a note about what is right and might surprise.
    """

    slug: Slug
    message: str
    path: tuple[int | str, ...]
    remedy: str | None = None
    severity: Severity = Severity.WARNING


class Unfinished(Struct, frozen=True):
    """A part of a check that a limit ended: it has no place in the file, and it is no doubt about the model.

    Attributes:
        clause: what was reached, or what is still unknown.
    """

    clause: str


def doubts_about_guards(model: BehaviorModel) -> Iterator[Doubt | Unfinished]:
    """Yield a doubt for each unsatisfiable predicate, and for planning guards that read the runner's variables."""
    for path, transition in _transitions(model):
        yield from _doubts_about(transition, path, model)
    for name, goal in model.goals:
        yield from _never(goal, f"the goal {name}", ("goals", name), model)
    yield from _never(model.initial_states, "`initial_states`", ("initial_states",), model)


def doubts_about_requirements(model: BehaviorModel) -> Iterator[Doubt]:
    """Yield a doubt for each requirement that all runs violate, and for each that no run can violate."""
    yield from _always_violated(model)
    yield from _never_violated(model)


def _always_violated(model: BehaviorModel) -> Iterator[Doubt]:
    """Yield a doubt for each `always p` whose p holds in no state, and for each `never p` whose p holds in all."""
    for name, sentence in ((each.name, each.sentence) for each in model.requirements):
        match sentence:
            case Always(predicate):
                required = predicate
            case Never(predicate):
                required = Not(predicate)
            case _:
                continue
        if is_satisfiable(required, model.running_space) is False:
            message = f"the requirement {name} can hold in no state: {sentence}"
            remedy = None
            if isinstance(predicate, Truth) and model.objects is not None:
                remedy = "only `where` leaves choices of objects out: `{requirement: always …, where: x != y}`"
            yield Doubt(Slug.GUARD_NEVER_HOLDS, message, ("requirements", name), remedy)


def _never_violated(model: BehaviorModel) -> Iterator[Doubt]:
    """Yield a doubt for each requirement that no run can violate.

    Of a requirement with parameters, some instances may be such: equal objects often satisfy it.
    """
    empty = {each.name: _requires_nothing(each, model) for each in model.requirements}
    lifted = {name: model.lifted_name("requirements", name) for name in empty}
    required = {lifted[name] for name, is_empty in empty.items() if not is_empty}
    for name, sentence in ((each.name, each.sentence) for each in model.requirements):
        if lifted[name] not in required:
            message = f"no run can violate the requirement {name}, so it requires nothing: {sentence}"
            remedy = "compare it with what the domains of its variables allow anyway"
            yield Doubt(Slug.REQUIREMENT_ALWAYS_HOLDS, message, ("requirements", name), remedy)


def _requires_nothing(requirement: Requirement, model: BehaviorModel) -> bool:
    needed = requirement.sentence.needed_to_violate
    return any(is_satisfiable(each, model.running_space) is False for each in needed)


def _transitions(model: BehaviorModel) -> Iterator[tuple[tuple[str, ...], Transition]]:
    for operation in model.operations:
        here = ("operations", operation.name)
        yield (*here, "pre"), operation.pre
        yield (*here, "post"), operation.post
        if operation.failed is not None:
            yield (*here, "failed"), operation.failed
    for transition in model.automatic_transitions:
        yield ("automatic_transitions", transition.name), transition


def written_as(path: tuple[str, ...], *keys: str) -> str:
    """Return guards or actions of a transition by the keys of the file: "`pre.g` of scan", "`g` of open_door"."""
    _, name, *below = path
    shown = " && ".join(".".join((*below, key)) for key in keys)
    return f"`{shown}` of {name}"


def _doubts_about(transition: Transition, path: tuple[str, ...], model: BehaviorModel) -> Iterator[Doubt | Unfinished]:
    alone = list(_never(transition.g, written_as(path, "g"), (*path, "g"), model))
    alone += _never(transition.gr, written_as(path, "gr"), (*path, "gr"), model)
    yield from alone or _never(transition.running_guard, written_as(path, "g", "gr"), (*path, "gr"), model)
    if path[-1] in ("pre", "post"):
        yield from _reads_runner(transition, path, model)


def _never(
    predicate: Predicate, what: str, path: tuple[str, ...], model: BehaviorModel
) -> Iterator[Doubt | Unfinished]:
    satisfiable = is_satisfiable(predicate, model.running_space)
    if satisfiable is False:
        yield Doubt(Slug.GUARD_NEVER_HOLDS, f"{what} holds in no state: {predicate}", path)
    elif satisfiable is None:
        yield Unfinished(f"it is unknown whether {what} can hold")


def _reads_runner(transition: Transition, path: tuple[str, ...], model: BehaviorModel) -> Iterator[Doubt]:
    read = [name for name in transition.g.reads() if model.running_space[name].role.is_runner]
    if read:
        message = f"{written_as(path, 'g')} reads {', '.join(read)}, which is constant while a plan is made"
        yield Doubt(Slug.PLANNER_READS_RUNNER, message, (*path, "g"), "move that part of the guard to `gr`")


def doubts_about_resources(model: BehaviorModel) -> Iterator[Doubt]:
    """Yield doubts about failures that nothing handles, and replies that are awaited without a deadline or in vain."""
    for resource in model.resources:
        outcomes = dict(resource.simulation.outcomes)
        users = [operation for operation in model.operations if _asks(operation, resource)]
        path = ("resources", resource.name, "simulation", "outcomes")
        if outcomes.get(Outcome.FAIL) and users and resource.request_state not in _watched(model):
            message = (
                f"{resource.name} can fail, and no `failed` or automatic transition reads {resource.request_state}"
            )
            remedy = f"add an automatic transition with `g: {resource.request_state} == failed && …`"
            yield Doubt(Slug.FAILURE_UNNOTICED, message, (*path, "fail"), remedy)
        timeless = [each.name for each in users if each.deadline_ns is None and not completes_at_once(each, model)]
        if outcomes.get(Outcome.TIMEOUT) and timeless:
            message = f"{resource.name} may not answer, and {', '.join(timeless)} would wait without a deadline"
            yield Doubt(Slug.NO_DEADLINE, message, (*path, "timeout"), "give them a `deadline`")
        for operation in users:
            yield from _too_early(operation, resource)


def _too_early(operation: Operation, resource: Resource) -> Iterator[Doubt]:
    """Yield a doubt about an operation that times out, and ends its request, before each simulated reply."""
    deadline_ns, shortest_ns = operation.deadline_ns, resource.simulation.latency.shortest_ns
    if deadline_ns is None or deadline_ns >= shortest_ns or not clears(operation.timedout, resource):
        return
    state = resource.request_state
    waits = (part for part in conjuncts(operation.post.running_guard) if part.reads() == (state,))
    if any(not part.holds({state: RequestState.EXECUTING.value}) for part in waits):
        limits = (
            f"its deadline is {format_duration(deadline_ns)}, and each latency at least {format_duration(shortest_ns)}"
        )
        message = f"{operation.name} times out before {resource.name} answers: {limits}"
        remedy = f"make the deadline longer, or `latency` in the `simulation` of {resource.name} shorter"
        yield Doubt(Slug.DEADLINE_TOO_SHORT, message, ("operations", operation.name, "deadline"), remedy)


def _asks(operation: Operation, resource: Resource) -> bool:
    """Return whether the operation sends a request to the resource when it starts."""
    return Assign(resource.trigger, Constant(True)) in operation.pre.running_actions


def _watched(model: BehaviorModel) -> frozenset[str]:
    """Return the variables that `failed` transitions and automatic transitions read."""
    failing = [operation.failed for operation in model.operations if operation.failed is not None]
    guards = [transition.running_guard for transition in (*failing, *model.automatic_transitions)]
    return frozenset(name for guard in guards for name in guard.reads())


def doubts_about_variables(model: BehaviorModel) -> Iterator[Doubt]:
    """Yield doubts about variables that nothing reads, about their sources, and about forbidden nominal values."""
    used = variables_in_use(model)
    for variable in model.variables:
        if variable.name not in used:
            message = f"nothing reads {variable.name}, and no request carries it"
            yield Doubt(Slug.UNUSED_VARIABLE, message, ("variables", variable.name))
    for name in undeclared(model):
        message = (
            f"only automatic transitions assign {name}, so it counts as an input, which may change at any time: "
            "declare `source: state` if nothing else changes it, else `source: input`"
        )
        yield Doubt(Slug.UNDECLARED_SOURCE, message, ("variables", name))
    for name in unassigned(model):
        message = f"`source: state` says that only the model changes {name}, and no action assigns it"
        remedy = "write `source: constant`, or `source: input` if something outside the model changes it"
        yield Doubt(Slug.NEVER_ASSIGNED, message, ("variables", name, "source"), remedy)
    nominal = model.nominal_state
    if not model.initial_states.holds(nominal):
        read = ", ".join(f"{name} == {format_value(nominal[name])}" for name in model.initial_states.reads())
        message = f"the nominal values do not satisfy `initial_states`: {read}"
        yield Doubt(Slug.INITIAL_STATE_NOMINAL, message, ("initial_states",))


def doubts_about_waivers(model: BehaviorModel, today: str) -> Iterator[Doubt]:
    """Yield a doubt for each waiver of a model that has expired on the date `today`, or is dated after it."""
    for number, waiver in enumerate(model.waivers):
        if waiver.is_expired(today):
            message = f"the waiver of {waiver.obligation} expired on {waiver.expires}, so it does not count"
            remedy = "cover the obligation, or decide again and write a later day"
            yield Doubt(Slug.WAIVER_DATE, message, ("waivers", number, "expires"), remedy)
        elif waiver.date > today:
            message = f"the waiver of {waiver.obligation} is of {waiver.date}, which is after today, {today}"
            yield Doubt(Slug.WAIVER_DATE, message, ("waivers", number, "date"), "write the day of the decision")


def variables_in_use(model: BehaviorModel) -> frozenset[str]:
    """Return the variables that a part of a model reads, or that a request carries."""
    return frozenset(_used(model))


def _used(model: BehaviorModel) -> Iterator[str]:
    for predicate in _predicates(model):
        yield from predicate.reads()
    for resource in model.resources:
        yield from resource.request
    outside = (action for each in model.environment for action in each.actions)
    for action in (*model.actions, *outside):
        yield from (name for name in action.reads() if name != action.target)


def _predicates(model: BehaviorModel) -> Iterator[Predicate]:
    yield from (transition.running_guard for transition in model.transitions)
    yield from (model.initial_states, *(goal for _, goal in model.goals))
    yield from (each.guard for each in model.environment)
    for requirement in model.requirements:
        yield from requirement.sentence.predicates
