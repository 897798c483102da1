"""Suggestions for uncoverable obligations: a goal, a deadline, a way to fail; or the guard that prevents them.

Every suggestion is based on a search: goals are verified, and conjuncts are blamed by the states of runs. This module
knows the model and the planner; oracles answer questions about runs.
"""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases.coverage import Aspect, Obligation, Obligations
from scbm.closing.advice.goal_search import GoalSearch, goal_name
from scbm.closing.decisions import Suggestion, SuggestionKind
from scbm.closing.proofs.blame import blame, contradicting, contradiction, shadowing
from scbm.closing.proofs.proofs import structural_facts, ways_to_fail
from scbm.closing.summaries import listed, plan_in_words
from scbm.model import (
    And,
    Constant,
    Equal,
    Not,
    OperationState,
    Reference,
    RequestState,
    Role,
    conjunction,
    format_value,
)
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE
from scbm.running.compiled_steps import OperationPart
from scbm.running.lifecycle import is_current_in, states_trying

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from scbm.model import BehaviorModel, Operation, Predicate, State, Transition, Value

_EXAMPLE = ", or an automatic transition like "
"""The text before an example of an automatic transition that would fail an operation."""

_INTERLOCK = "an interlock can stay as it is: it does not count as coverable"

_MAX_TRIED = 10
"""Maximum number of goals that are verified for one operation."""

_MAX_INSTANCES = 3
"""Maximum number of instances of a lifted operation for which goals are looked for: others are much like them."""


class TriedVisits(NamedTuple):
    """The obligations that cases visit which were tried for a changed model.

    Attributes:
        freely: those that they visit before anything is forced.
        by_force: those that they visit in forced states only (semantics 9.10).
    """

    freely: frozenset[Obligation] = frozenset()
    by_force: frozenset[Obligation] = frozenset()


class Oracles(Struct, frozen=True):
    """Answers to questions about the runs of a model.

    Attributes:
        can_hold: whether a predicate holds in any state in which a run evaluates guards.
        states_where: those of these states in which a predicate holds, with all variables of the running space; `None`
            if they are not known.
        visits: what executed cases for the last goal of an extended model visit.
    """

    can_hold: Callable[[Predicate], bool]
    states_where: Callable[[Predicate], Iterable[Mapping[str, Value]]] | None
    visits: Callable[[BehaviorModel], TriedVisits]


def suggest(
    model: BehaviorModel, uncoverable: Sequence[Obligation], oracles: Oracles, search: GoalSearch
) -> tuple[Suggestion, ...]:
    """Return suggestions, in the order of the obligations; for some obligations there is none.

    Args:
        model: the model.
        uncoverable: the obligations of the model that are proved uncoverable, *queued* included.
        oracles: answers to questions about its runs.
        search: finds goals for its operations.
    """
    return in_order_of(_Suggestions(model, dict.fromkeys(uncoverable), oracles, search).all(), model)


def in_order_of(suggestions: Iterable[Suggestion], model: BehaviorModel) -> tuple[Suggestion, ...]:
    """Return suggestions in the order of the obligations of a model; those about one obligation keep their order."""
    order = {obligation: number for number, obligation in enumerate(Obligations.of(model))}
    return tuple(sorted(suggestions, key=lambda suggestion: min(map(order.__getitem__, suggestion.obligations))))


class _Suggestions:
    def __init__(
        self, model: BehaviorModel, uncoverable: dict[Obligation, None], oracles: Oracles, search: GoalSearch
    ) -> None:
        self._model = model
        self._uncoverable = uncoverable
        self._oracles = oracles
        self._search = search
        self._settled = dict.fromkeys(obligation for obligation, _, _ in structural_facts(model))
        self._unplanned: dict[str, list[str]] = {}  # instances that no plan has, by the lifted operation

    def all(self) -> Iterator[Suggestion]:
        """Yield the suggestions, those for operations first."""
        yield from self._and_alike([*self._for_operations()])
        for transition in self._model.automatic_transitions:
            obligation = Obligation(transition.name, Aspect.TAKEN)
            if obligation in self._uncoverable:
                yield from self._never_taken(transition, obligation)

    def _and_alike(self, suggestions: Sequence[Suggestion]) -> Iterator[Suggestion]:
        """Yield the suggestions; the last one about a goal for a lifted operation says which instances are left."""
        last = {self._entry(each): each for each in suggestions if each.kind is SuggestionKind.GOAL}
        for each in suggestions:
            entry = self._entry(each)
            left = self._unplanned.get(entry, [])[_MAX_INSTANCES:]
            if left and last.get(entry) is each:
                others = f"{len(left):,} more instances of {entry} are" if len(left) > 1 else f"{left[0]} is"
                yield replace(each, text=f"{each.text}; {others} in no plan either")
            else:
                yield each

    def _entry(self, suggestion: Suggestion) -> str:
        return self._model.lifted_name("operations", suggestion.obligations[0].subject)

    def _for_operations(self) -> Iterator[Suggestion]:
        for operation in self._model.operations:
            if self._misses(operation, Aspect.EXECUTING):
                yield from self._never_executes(operation)
            elif self._is_instant(operation):
                yield from self._instant(operation)
                continue
            else:
                yield from self._never_ends(operation)
            yield from self._lacks(operation)

    def _misses(self, operation: Operation, aspect: Aspect) -> bool:
        return Obligation(operation.name, aspect) in self._uncoverable

    # operations that complete at once

    def _is_instant(self, operation: Operation) -> bool:
        """Return whether an operation completes as soon as it executes: its postcondition always holds then."""
        executes = is_current_in(operation.name, (OperationState.EXECUTING,))
        waits = And((executes, Not(operation.post.running_guard)))
        return self._oracles.can_hold(executes) and not self._oracles.can_hold(waits)

    def _instant(self, operation: Operation) -> Iterator[Suggestion]:
        """Say why nothing goes wrong while an operation executes that completes at once."""
        aspects = (Aspect.FAILED, Aspect.TIMEDOUT)
        about = tuple(Obligation(operation.name, aspect) for aspect in aspects if self._misses(operation, aspect))
        if about:
            yield Suggestion(about, SuggestionKind.INSTANT, "it completes instantly, so nothing can fail")

    # operations that lack something

    def _lacks(self, operation: Operation) -> Iterator[Suggestion]:
        """Suggest a deadline, or a way to fail."""
        name = operation.name
        if self._misses(operation, Aspect.FAILED) and not [*self._ways_to_fail(operation)]:
            text = f"add a `failed` transition to {name}{self._like(operation)}"
            yield Suggestion((Obligation(name, Aspect.FAILED),), SuggestionKind.FAILURE, text)
        if self._misses(operation, Aspect.TIMEDOUT) and operation.deadline_ns is None:
            text = f"give {name} a `deadline`, so that it can time out"
            yield Suggestion((Obligation(name, Aspect.TIMEDOUT),), SuggestionKind.DEADLINE, text)

    def _like(self, operation: Operation) -> str:
        """Return the automatic transition that would fail the operation when its request fails, if it sends one."""
        targets = [action.target for action in operation.pre.running_actions]
        for resource in self._model.resources:
            if resource.trigger in targets:
                executes = _is(CURRENT_STATE, OperationState.EXECUTING.value)
                guard = And((_is(resource.request_state, RequestState.FAILED.value), executes))
                actions = (
                    f"{CURRENT_STATE} <- {OperationState.FAILED.value}, "
                    f"{resource.request_state} <- {RequestState.INITIAL.value}, {resource.trigger} <- false"
                )
                return f"{_EXAMPLE}`{{g: {guard}, a: [{actions}]}}`"
        return ""

    # operations that never execute

    def _never_executes(self, operation: Operation) -> Iterator[Suggestion]:
        if not self._oracles.can_hold(_is(CURRENT_NAME, operation.name)):
            yield from self._goal(operation)
            return
        follows = (Aspect.EXECUTING, Aspect.FAILED, Aspect.TIMEDOUT, Aspect.COMPLETED)
        about = tuple(obligation for obligation in self._open(operation) if obligation.aspect in follows)
        when = is_current_in(operation.name, states_trying(OperationPart.PRE))
        what = f"the precondition of {operation.name}"
        yield from self._guard(about, what, operation.pre, when, f"when {operation.name} is current")

    def _open(self, operation: Operation) -> tuple[Obligation, ...]:
        """Return what is uncoverable of an operation, except what the structure of the model settles."""
        return tuple(
            obligation
            for obligation in Obligations.of(self._model)
            if obligation.subject == operation.name
            and obligation.aspect is not Aspect.TAKEN
            and obligation in self._uncoverable
            and obligation not in self._settled
        )

    def _goal(self, operation: Operation) -> Iterator[Suggestion]:
        """Suggest the first goal for which a run executes the operation, for a few instances of a lifted one."""
        alike = self._unplanned.setdefault(self._model.lifted_name("operations", operation.name), [])
        alike.append(operation.name)
        if len(alike) > _MAX_INSTANCES:
            return
        first = tuple(o for o in self._open(operation) if o.aspect in (Aspect.EXECUTING, Aspect.QUEUED))
        name = goal_name(self._model, operation.name)
        for goal in islice(self._search.candidates(operation.name), _MAX_TRIED):
            extended = replace(self._model, goals=(*self._model.goals, (name, goal)))
            visits = self._oracles.visits(extended)
            if first and all(obligation in visits.freely for obligation in first):
                served = tuple(obligation for obligation in self._open(operation) if obligation in visits.freely)
                forced = tuple(obligation for obligation in self._open(operation) if obligation in visits.by_force)
                text = f"add a goal that {operation.name} is needed for, such as {goal}{self._example(operation, goal)}"
                text += forced_states_clause("cases for this goal", forced)
                yield Suggestion(served, SuggestionKind.GOAL, text, name, goal, by_force=forced)
                return

    def _example(self, operation: Operation, goal: Predicate) -> str:
        """Return the text about an example of a plan to the goal."""
        example = self._search.example(operation.name, goal)
        if example is None:
            return ""
        start, plan = example
        return f"; a plan for it from {_drawn(start)}: {plan_in_words(plan, ' -> ')}"

    # operations that execute, and do not complete or fail

    def _never_ends(self, operation: Operation) -> Iterator[Suggestion]:
        name = operation.name
        when = is_current_in(name, (OperationState.EXECUTING,))
        if self._misses(operation, Aspect.COMPLETED):
            about = (Obligation(name, Aspect.COMPLETED),)
            what = f"the postcondition of {name}"
            yield from self._guard(about, what, operation.post, when, f"while {name} executes")
        if self._misses(operation, Aspect.FAILED):
            about = (Obligation(name, Aspect.FAILED),)
            for what, transition in self._ways_to_fail(operation):
                yield from self._guard(about, what, transition, when, f"while {name} executes")

    def _ways_to_fail(self, operation: Operation) -> Iterator[tuple[str, Transition]]:
        if operation.failed is not None:
            yield f"`failed` of {operation.name}", operation.failed
        for transition in ways_to_fail(operation, self._model):
            yield f"the guard of {_automatic(transition.name)}", transition

    # automatic transitions

    def _never_taken(self, transition: Transition, obligation: Obligation) -> Iterator[Suggestion]:
        space = self._model.running_space
        failed = (
            action.target
            for action in transition.running_actions
            if space[action.target].role in (Role.OPERATION_STATE, Role.CURRENT_STATE)
        )
        executing = [_is(name, OperationState.EXECUTING.value) for name in failed]
        what = f"the guard of {obligation}"
        contradicted = contradiction((transition.g, transition.gr), self._model)
        blamed = contradicted or blame((transition.g, transition.gr, *executing), self._oracles.can_hold)
        if blamed:
            is_contradiction = bool(contradicted)
            found = _blaming((obligation,), what, blamed, "in any run", is_contradiction=is_contradiction)
            yield found if is_contradiction else replace(found, text=f"{found.text}; {_INTERLOCK}")
            return
        where = self._oracles.states_where
        before = shadowing(self._model, transition, where(transition.running_guard)) if where else ()
        if before:
            goes = "always goes" if len(before) == 1 else "always go"
            text = (
                f"where {obligation} could be taken, {listed([*map(_automatic, before)])} {goes} first: "
                f"move {obligation} up, or make the guards exclude each other"
            )
            yield Suggestion((obligation,), SuggestionKind.SHADOWED, text, blamed=before)

    # guards

    def _guard(
        self, about: tuple[Obligation, ...], what: str, transition: Transition, when: Predicate, where: str
    ) -> Iterator[Suggestion]:
        """Blame the conjuncts of a guard that never hold when it is evaluated, if it is ever evaluated."""
        if not self._oracles.can_hold(when):
            return
        guards = (transition.g, transition.gr)
        contradicted = contradiction(guards, self._model)
        blamed = contradicted or blame(guards, lambda part: self._oracles.can_hold(conjunction((when, part))))
        if blamed:
            yield _blaming(about, what, blamed, where, is_contradiction=bool(contradicted))


def forced_states_clause(cases: str, by_force: Sequence[Obligation]) -> str:
    """Return the clause about obligations that some cases visit in forced states only; empty if there are none."""
    return f"; {cases} visit {listed([*map(str, by_force)])} in forced states only" if by_force else ""


def grouped(suggestions: Iterable[Suggestion]) -> tuple[Suggestion, ...]:
    """Return the suggestions for people: those that would add the same thing to several operations become one."""
    groups: dict[object, list[Suggestion]] = {}
    for number, suggestion in enumerate(suggestions):
        key: object = suggestion.kind if suggestion.kind in _ALIKE else number
        if suggestion.kind is SuggestionKind.GUARD:
            key = _about_all(suggestion)
        groups.setdefault(key, []).append(suggestion)
    return tuple(alike[0] if len(alike) == 1 else _as_one(alike) for alike in groups.values())


def _about_all(suggestion: Suggestion) -> str:
    """Return the text of a suggestion for all operations of which it says the same."""
    return suggestion.text.replace(f"while {suggestion.obligations[0].subject} executes", "while they execute")


_ALIKE = {
    SuggestionKind.FAILURE: "add a `failed` transition to each",
    SuggestionKind.DEADLINE: "give each a `deadline`, so that it can time out",
    SuggestionKind.INSTANT: "each completes instantly, so nothing can fail",
}


def _as_one(alike: Sequence[Suggestion]) -> Suggestion:
    kind = alike[0].kind
    about = tuple(dict.fromkeys(obligation for each in alike for obligation in each.obligations))
    if kind is SuggestionKind.GUARD:
        return replace(alike[0], obligations=about, text=_about_all(alike[0]))
    examples = [each.text.partition(_EXAMPLE)[2] for each in alike]
    example = next((f"{_EXAMPLE}{example}" for example in examples if example), "")
    return Suggestion(about, kind, f"{_ALIKE[kind]}{example}")


def _blaming(
    about: tuple[Obligation, ...], what: str, blamed: Sequence[Predicate], when: str, *, is_contradiction: bool
) -> Suggestion:
    parts = tuple(map(str, blamed))
    if is_contradiction:
        text = f"{contradicting(what, blamed)}; change the guard"
        return Suggestion(about, SuggestionKind.GUARD, text, blamed=parts)
    never = "which never holds" if len(parts) == 1 else "which never hold together"
    text = f"{what} needs {listed(parts)}, {never} {when}: change the guard, or add a transition that makes it hold"
    return Suggestion(about, SuggestionKind.GUARD, text, blamed=parts)


def _automatic(name: str) -> str:
    return str(Obligation(name, Aspect.TAKEN))


def _is(name: str, value: Value) -> Predicate:
    return Equal(Reference(name), Constant(value))


def _drawn(start: State) -> str:
    """Return the values by which an initial state differs from the nominal one."""
    drawn = [variable for variable in start.space if start[variable.name] != variable.initial]
    values = " && ".join(f"{variable.name} == {format_value(start[variable.name])}" for variable in drawn)
    return values or "the nominal state"
