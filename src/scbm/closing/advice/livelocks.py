"""Doubts about livelocks: cycles of automatic transitions.

Runs are not explored here (`scbm close` does that). Each planning state is taken at rest, and with each of its
operations executing and the requests of that operation executing, succeeded and failed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.closing.advice.doubts import Doubt
from scbm.model import OperationState, PlanState, RequestState, Slug
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, PLAN_STATE, operation_state_name
from scbm.running import Program
from scbm.running.automatic import describe_cycle, find_cycle
from scbm.running.lifecycle import OperationPart

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.closing.advice.plan_doubts import PlanningExploration
    from scbm.model import BehaviorModel

_MAX_CHAINS = 30_000
_BOUND = 1_000


def doubts_about_livelocks(model: BehaviorModel, exploration: PlanningExploration) -> Iterator[Doubt]:
    """Yield each cycle of automatic transitions once, with a state in which it begins."""
    program = Program(model)
    reported: dict[frozenset[str], None] = {}
    for chains, state in enumerate(_running_states(program, exploration)):
        if chains == _MAX_CHAINS:
            message = f"automatic transitions were checked in {_MAX_CHAINS} states only"
            yield Doubt(Slug.CHECK_INCOMPLETE, message, ("automatic_transitions",))
            return
        cycle = find_cycle(program, state, _BOUND)
        if cycle and frozenset(cycle) not in reported:
            reported[frozenset(cycle)] = None
            remedy = f"this happens where {_where(program, state, cycle)}"
            path = ("automatic_transitions", cycle[0])
            yield Doubt(Slug.AUTOMATIC_LIVELOCK, describe_cycle(cycle), path, remedy)


def _running_states(program: Program, exploration: PlanningExploration) -> Iterator[int]:
    """Yield states that runs can reach, packed for running."""
    task = exploration.planner.base_task
    pack = program.packing.pack
    rest = {variable.name: variable.initial for variable in program.packing.space}
    for state in exploration.reach.states:
        values = {**rest, **task.packing.values(state), PLAN_STATE: PlanState.EXECUTING.value}
        yield pack(values)
        for index, _ in task.successors(state):
            yield from _executing(program, pack(values), task.operations[index])


def _executing(program: Program, state: int, name: str) -> Iterator[int]:
    operation = program.operations[name]
    started = operation.parts[OperationPart.PRE].update(state)
    if started is None:
        return
    executing = OperationState.EXECUTING.value
    keep, bits = program.packing.assignment(
        {
            operation_state_name(name): executing,
            CURRENT_NAME: name,
            CURRENT_STATE: executing,
        }
    )
    started = started & keep | bits
    for request_state in (RequestState.EXECUTING, RequestState.SUCCEEDED, RequestState.FAILED):
        asked = started
        for line in program.requests:
            if started & line.trigger:
                keep, bits = program.packing.assignment({line.resource.request_state: request_state.value})
                asked = asked & keep | bits
        yield asked


def _where(program: Program, state: int, cycle: tuple[str, ...]) -> str:
    """Return the values that the guards of the cycle read."""
    values = program.packing.values(state)
    transitions = [t for t in program.model.automatic_transitions if t.name in cycle]
    read = dict.fromkeys(name for transition in transitions for name in transition.running_guard.reads())
    return ", ".join(f"{name} == {values[name]}".replace("True", "true").replace("False", "false") for name in read)
