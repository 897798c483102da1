"""In which cases a run of a mutant can differ from the run of the original (decision 50).

A run of a mutant equals that of the original if each evaluation of the changed part in it gives the same result. The
states in which parts are evaluated are known from the runs of the original. So a case is left out only if its run on
the mutant would be the same, record by record, but for the variables that requests carry.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import Assign, Constant, OperationState, RunPlans
from scbm.mutation.mutants import MutatedPart, SubjectKind
from scbm.planning import Solved
from scbm.running.micro_steps import next_automatic

if TYPE_CHECKING:
    from scbm.model import Action, BehaviorModel
    from scbm.mutation.evaluations import EvaluatedPlan, Evaluations
    from scbm.mutation.mutants import Mutant
    from scbm.planning import Answer
    from scbm.running.lifecycle import OperationMove
    from scbm.running.micro_steps import AutomaticMove
    from scbm.testing.tester import Tester

_PLANNED_GUARDS = (MutatedPart.PRE_G, MutatedPart.POST_G)
_PLANNED_ACTIONS = (MutatedPart.PRE_A, MutatedPart.POST_A)
_NOT_JUDGED = (MutatedPart.DEADLINE, MutatedPart.DISABLED_DEADLINE, MutatedPart.INITIAL)
"""Parts that the built-in requirements do not read."""

_TIMERS = {MutatedPart.DEADLINE: OperationState.EXECUTING, MutatedPart.DISABLED_DEADLINE: OperationState.DISABLED}


class RunDifferences:
    """Decides for the mutants of one model in which of some observed runs they can differ."""

    def __init__(self, original: Tester, evaluations: Evaluations) -> None:
        self._original = original
        self._evaluations = evaluations
        self._every = (1 << len(evaluations.questions)) - 1
        goals = dict.fromkeys(question.goal for questions in evaluations.questions for question in questions)
        self._read_by_goals = dict.fromkeys(name for goal in goals for name in goal.reads())

    def are_plans_alike(self, mutant: Mutant) -> bool:
        """Return whether each question of the runs for a plan has the same answer in both models, without planning."""
        if MutatedPart.OPERATIONS in mutant.parts or any(part in _PLANNED_GUARDS for part in mutant.parts):
            return False
        if not any(part in _PLANNED_ACTIONS for part in mutant.parts):
            return True
        changed = _changed_actions(self._original.model, mutant)
        space = self._original.planner.base_task.packing.space
        return all(
            isinstance(action, Assign)
            and isinstance(action.source, Constant)
            and action.target not in space
            and action.target not in self._read_by_goals
            for action in changed
        )

    def in_runner(self, mutant: Mutant, tester: Tester) -> int:
        """Return the cases whose runs can differ in the runner, in timers, requests or the world; plans are apart.

        Args:
            mutant: the mutant.
            tester: its tester.
        """
        match mutant.kind:
            case SubjectKind.VARIABLE:
                return self._every
            case SubjectKind.ENVIRONMENT:
                return self._evaluations.moved
            case SubjectKind.RESOURCE:
                return self._evaluations.requests.get(mutant.subject, 0)
            case SubjectKind.AUTOMATIC:
                return self._automatic(tester)
            case SubjectKind.OPERATION if MutatedPart.OPERATIONS in mutant.parts:
                return 0
            case SubjectKind.OPERATION:
                return self._moves(mutant, tester) | self._timers(mutant)

    def in_verdict(self, mutant: Mutant) -> int:
        """Return the cases whose equal runs may be judged otherwise.

        The built-in requirements read from the model which requests may outlive their operation, and when a resource is
        ready; they do so only where a request is left between operations.
        """
        return 0 if all(part in _NOT_JUDGED for part in mutant.parts) else self._evaluations.busy

    def _automatic(self, tester: Tester) -> int:
        old, new = self._original.program, tester.program
        found = 0
        for state, cases in self._evaluations.states.items():
            before, after = (_automatic_of(next_automatic(program, state)) for program in (old, new))
            found |= cases if before != after else 0
        return found

    def _moves(self, mutant: Mutant, tester: Tester) -> int:
        """Return the cases in which the operation makes another move somewhere."""
        found = 0
        for state, cases in self._evaluations.states_of(mutant.subject):
            if cases & ~found and self._differs(state, tester, timer_passed=False):
                found |= cases
        for timed in _TIMERS.values():
            for state, cases in self._evaluations.expired_in.get((mutant.subject, timed), {}).items():
                if cases & ~found and self._differs(state, tester, timer_passed=True):
                    found |= cases
        return found

    def _differs(self, state: int, tester: Tester, *, timer_passed: bool) -> bool:
        old, new = self._original.program.current(state), tester.program.current(state)
        assert old is not None and new is not None  # noqa: S101, PT018 - the operation is current
        return _move_of(old.move(state, timer_passed=timer_passed)) != _move_of(
            new.move(state, timer_passed=timer_passed)
        )

    def _timers(self, mutant: Mutant) -> int:
        """Return the cases in which another deadline passes at another time, or passes at all or no more."""
        found = 0
        for part, state in _TIMERS.items():
            if part not in mutant.parts:
                continue
            for cases in self._evaluations.expired_in.get((mutant.subject, state), {}).values():
                found |= cases
            deadline_ns = _deadline_ns(mutant, part)
            for number, longest_ns in self._evaluations.longest_ns.get((mutant.subject, state), {}).items():
                if deadline_ns is not None and longest_ns >= deadline_ns:
                    found |= 1 << number
        return found

    def in_plans(self, number: int, tester: Tester) -> bool:
        """Return whether a plan of case `number` can differ; `tester` is that of a mutant with plans of its own."""
        questions = self._evaluations.questions[number]
        if not questions:
            return False
        if self._original.model.runs.plans is RunPlans.DRAWN or self._evaluations.with_plans >> number & 1:
            return True
        return any(self._has_other_answer(question, tester) for question in questions)

    def _has_other_answer(self, question: EvaluatedPlan, tester: Tester) -> bool:
        state = self._original.program.packing.values(question.state)
        answer = tester.plan(state, question.goal)
        if (answer.status, _plan_of(answer)) != (question.status, question.plan):
            return True
        # A run that waits for a plan asks again once a variable has changed that the planner reads.
        is_waiting = question.status == "unsolvable"
        return is_waiting and _reads(question, tester) != _reads(question, self._original)


def _reads(question: EvaluatedPlan, tester: Tester) -> tuple[str, ...]:
    program = tester.program
    mask = program.planner_reads(question.goal)
    return tuple(name for name in program.packing.space.names if program.packing[name].mask & mask)


def _plan_of(answer: Answer) -> tuple[str, ...]:
    return answer.plan if isinstance(answer, Solved) else ()


def _automatic_of(move: AutomaticMove | None) -> tuple[str, str, int] | None:
    """Return the parts of a move that a run depends on."""
    if move is None:
        return None
    return move.transition.name, "" if move.failed is None else move.failed.name, move.after


def _move_of(move: OperationMove | None) -> tuple[object, ...] | None:
    """Return the parts of a move that a run depends on; timers are compared apart."""
    return None if move is None else (move.rule, move.transition.name, move.after)


def _deadline_ns(mutant: Mutant, part: MutatedPart) -> int | None:
    operation = mutant.model.operation(mutant.subject)
    return operation.deadline_ns if part is MutatedPart.DEADLINE else operation.disabled_deadline_ns


def _changed_actions(model: BehaviorModel, mutant: Mutant) -> tuple[Action, ...]:
    """Return the actions `a` of the changed operation that only one of the two models has."""
    before, after = (_planned(each, mutant.subject) for each in (model, mutant.model))
    pairs = list(zip(before, after, strict=True))
    gone = (action for old, new in pairs for action in old if action not in new)
    come = (action for old, new in pairs for action in new if action not in old)
    return (*gone, *come)


def _planned(model: BehaviorModel, name: str) -> tuple[tuple[Action, ...], tuple[Action, ...]]:
    operation = model.operation(name)
    return operation.pre.a, operation.post.a
