"""The states in which the runner of a mutant, or the world around it, does something else than that of the original."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from scbm.model import OperationState, RateKind
from scbm.model.sources import inputs
from scbm.model.variables import CURRENT_STATE
from scbm.running.lifecycle import timer_ns
from scbm.running.micro_steps import next_automatic

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model import BehaviorModel, Operation, Transition
    from scbm.mutation.equivalence.observed_runs import ObservedRuns, StateOfGoal
    from scbm.running import Program
    from scbm.running.lifecycle import LifecycleState
    from scbm.running.micro_steps import AutomaticMove


class StateDifference(NamedTuple):
    """A state of the original in which a mutant does something else.

    Attributes:
        where: the state.
        at_deadline: whether the difference is in what follows when the timer of the current operation passes.
    """

    where: StateOfGoal
    at_deadline: bool = False


class RunnerDifferences:
    """The differences between the runners of a model and of one mutant."""

    def __init__(self, observed: ObservedRuns, mutant: Program) -> None:
        """Compare later. `mutant` has the variables of the original (`comparable`)."""
        self._observed = observed
        self._original = observed.program
        self._mutant = mutant

    def __iter__(self) -> Iterator[StateDifference]:
        """Yield the states with a difference, those of each part in the order of exploration."""
        yield from self._of_operations()
        yield from self._of_automatic_transitions()
        yield from self._of_requests()

    # operations

    def _of_operations(self) -> Iterator[StateDifference]:
        for before, after in zip(self._original.model.operations, self._mutant.model.operations, strict=True):
            if _running_parts(before) != _running_parts(after):
                yield from self._of_operation(before.name)

    def _of_operation(self, name: str) -> Iterator[StateDifference]:
        for where in self._observed.tried(name):
            if self._move(self._original, where.state) != self._move(self._mutant, where.state):
                yield StateDifference(where)
        for where in self._observed.settled(name):
            if self._at_deadline(self._original, where.state) != self._at_deadline(self._mutant, where.state):
                yield StateDifference(where, at_deadline=True)

    def _move(self, program: Program, state: int, *, timer_passed: bool = False) -> tuple[object, ...] | None:
        """Return what a runner does with the current operation, as far as its record shows it."""
        current = program.current(state)
        move = None if current is None else current.move(state, timer_passed=timer_passed)
        if move is None:
            return None
        return move.rule.target, move.rule.plan, move.transition.name, move.after & self._observed.kept

    def _at_deadline(self, program: Program, state: int) -> tuple[object, ...] | None:
        """Return the time that the current operation may be in its state, and what the runner does then."""
        current = program.current(state)
        limit_ns = None if current is None else _limit_ns(current, program, state)
        return None if limit_ns is None else (limit_ns, self._move(program, state, timer_passed=True))

    # automatic transitions

    def _of_automatic_transitions(self) -> Iterator[StateDifference]:
        originals, mutants = self._original.model.automatic_transitions, self._mutant.model.automatic_transitions
        if originals == mutants:
            return
        changed = _changed_slices(originals, mutants)
        tests = [step.test for step in self._original.automatic[changed[0]]]
        tests += [step.test for step in self._mutant.automatic[changed[1]]]
        for where in self._observed:
            if any(test(where.state) for test in tests) and self._is_other_automatic(where.state):
                yield StateDifference(where)

    def _is_other_automatic(self, state: int) -> bool:
        before, after = next_automatic(self._original, state), next_automatic(self._mutant, state)
        return self._record(before) != self._record(after)

    def _record(self, move: AutomaticMove | None) -> tuple[object, ...] | None:
        return None if move is None else (move.transition.name, move.after & self._observed.kept)

    # requests

    def _of_requests(self) -> Iterator[StateDifference]:
        for before, after in zip(self._original.model.resources, self._mutant.model.resources, strict=True):
            if before.request != after.request:
                yield from (StateDifference(where) for where in self._observed.sent(before.name))


def _limit_ns(current: LifecycleState, program: Program, state: int) -> int | None:
    own = OperationState(str(program.packing.value(state, CURRENT_STATE)))
    return timer_ns(current.operation, own)


def _running_parts(operation: Operation) -> tuple[object, ...]:
    """Return everything of an operation that the runner reads."""
    lives = (operation.pre, operation.post, operation.failed)
    parts = [None if each is None else (each.name, each.running_guard, each.running_actions) for each in lives]
    return (*parts, operation.timedout, operation.deadline_ns, operation.disabled_deadline_ns)


def _changed_slices(before: Sequence[Transition], after: Sequence[Transition]) -> tuple[slice, slice]:
    """Return the positions of the transitions between the common beginning and the common end of two sequences."""
    begin = 0
    while begin < min(len(before), len(after)) and before[begin] == after[begin]:
        begin += 1
    end = 0
    while end < min(len(before), len(after)) - begin and before[-1 - end] == after[-1 - end]:
        end += 1
    return slice(begin, len(before) - end), slice(begin, len(after) - end)


class WorldDifferences:
    """The differences between the worlds of a model and of one mutant: where runs start, what changes in them."""

    def __init__(self, observed: ObservedRuns, mutant: Program) -> None:
        self._observed = observed
        self._original = observed.program
        self._mutant = mutant

    @property
    def has_other_starts(self) -> bool:
        """Whether runs begin in other states."""
        return self._starts(self._original.model) != self._starts(self._mutant.model)

    @staticmethod
    def _starts(model: BehaviorModel) -> list[tuple[object, ...]]:
        """Return the nominal values, which cases have that name none, and the random ones."""
        return [(variable.initial, variable.random) for variable in model.variables]

    @property
    def new_inputs(self) -> tuple[str, ...]:
        """The inputs that only the mutant reads, and not declared in the original: its runs never change them."""
        known = dict.fromkeys((*self._original.model.read, *inputs(self._original.model)))
        return tuple(name for name in inputs(self._mutant.model) if name not in known)

    @property
    def has_other_changes(self) -> bool:
        """Whether an environment transition does something else in a state of a run."""
        before, after = self._original.model.environment, self._mutant.model.environment
        if before == after:
            return False
        rates = {each.name: each.rate for each in before}
        if any(rates.get(each.name, each.rate) != each.rate for each in after):
            return True
        return any(
            self._changes(self._original, state) != self._changes(self._mutant, state) for _, state in self._observed
        )

    @property
    def without_rate(self) -> str | None:
        """The first environment transition that differs and has no rate, so that no simulation shows it."""
        before, after = self._original.model.environment, self._mutant.model.environment
        changed = (each for each in (*before, *after) if each not in before or each not in after)
        return next((each.name for each in changed if each.rate is None), None)

    def _changes(self, program: Program, state: int) -> list[tuple[str, int]]:
        """Return the environment transitions that can fire; a clock of `after` runs even where one changes nothing."""
        kept, found = self._observed.kept, []
        for step, transition in zip(program.environment, program.model.environment, strict=True):
            after = step.update(state) if step.test(state) else None
            has_clock = transition.rate is not None and transition.rate.kind is RateKind.AFTER
            if after is not None and (has_clock or (after ^ state) & kept):
                found.append((step.name, after & kept))
        return found
