"""Doubts about guards: predicates that are unsatisfiable, and planning guards that read the runner's variables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.closing.advice.doubts import Doubt
from scbm.model import Slug
from scbm.model.satisfiability import is_satisfiable

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel, Predicate, Transition


def doubts_about_guards(model: BehaviorModel) -> Iterator[Doubt]:
    """Yield a doubt for every unsatisfiable predicate, and for planning guards that read the runner's variables."""
    for path, transition in _transitions(model):
        yield from _doubts_about(transition, path, model)
    for name, goal in model.goals:
        yield from _never(goal, f"the goal {name}", ("goals", name), model)
    yield from _never(model.initial_states, "`initial_states`", ("initial_states",), model)


def _transitions(model: BehaviorModel) -> Iterator[tuple[tuple[str, ...], Transition]]:
    for operation in model.operations:
        here = ("operations", operation.name)
        yield (*here, "pre"), operation.pre
        yield (*here, "post"), operation.post
        if operation.failed is not None:
            yield (*here, "failed"), operation.failed
    for transition in model.automatic_transitions:
        yield ("automatic_transitions", transition.name), transition


def _doubts_about(transition: Transition, path: tuple[str, ...], model: BehaviorModel) -> Iterator[Doubt]:
    alone = list(_never(transition.g, f"`g` of {transition.name}", (*path, "g"), model))
    alone += _never(transition.gr, f"`gr` of {transition.name}", (*path, "gr"), model)
    yield from alone or _never(transition.running_guard, f"`g && gr` of {transition.name}", (*path, "gr"), model)
    if path[-1] in ("pre", "post"):
        yield from _reads_runner(transition, path, model)


def _never(predicate: Predicate, what: str, path: tuple[str, ...], model: BehaviorModel) -> Iterator[Doubt]:
    satisfiable = is_satisfiable(predicate, model.running_space)
    if satisfiable is False:
        yield Doubt(Slug.GUARD_NEVER_HOLDS, f"{what} holds in no state: {predicate}", path)
    elif satisfiable is None:
        yield Doubt(Slug.CHECK_INCOMPLETE, f"it is unknown whether {what} can hold: the search met its limit", path)


def _reads_runner(transition: Transition, path: tuple[str, ...], model: BehaviorModel) -> Iterator[Doubt]:
    read = [name for name in transition.g.reads() if model.running_space[name].role.is_runner]
    if read:
        message = f"`g` of {transition.name} reads {', '.join(read)}, which is constant while a plan is made"
        yield Doubt(Slug.PLANNER_READS_RUNNER, message, (*path, "g"), "move that part of the guard to `gr`")
