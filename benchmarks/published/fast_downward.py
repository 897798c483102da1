"""Fast Downward as a peer: a model as a task in SAS+, and one run of its search on it.

SAS+ is what Fast Downward's translator makes of PDDL: variables with values, and operators with conjunctions. The peer
starts with the variables of the model, and the time of its translator is not counted.
"""

from __future__ import annotations

import re
import resource
import subprocess
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

from published.model_parts import GOAL
from scbm.model.normal_form import AllOf, OneOf, indices_of, normal_form
from scbm.planning import Planner

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel
    from scbm.model.normal_form import NormalForm
    from scbm.planning.engines.joint_moves import JointMove

GREEDY = ("--evaluator", "hff=ff()", "--search", "lazy_greedy([hff], preferred=[hff])")
BLIND = ("--search", "astar(blind())")

MEMORY_BYTES = 2 << 30
"""Fast Downward may use no more memory than this."""


@dataclass(frozen=True)
class PeerRun:
    """One run.

    Attributes:
        search_s: the time of the search as Fast Downward prints it, in seconds of CPU.
        whole_s: the CPU of the whole process.
        expanded: the number of expanded states.
        length: the length of the plan.
    """

    search_s: float
    whole_s: float
    expanded: int
    length: int


def binary() -> Path | None:
    """Return the program of `up-fast-downward`; `None` if that is not installed."""
    spec = find_spec("up_fast_downward")
    if spec is None or spec.origin is None:
        return None
    found = Path(spec.origin).parent / "downward" / "builds" / "release" / "bin" / "downward"
    return found if found.exists() else None


def run(program: Path, task: str, options: tuple[str, ...], directory: Path, timeout_s: float) -> PeerRun | None:
    """Return what a run took; `None` if it found no plan within time and memory."""
    plan = directory / "plan"
    plan.unlink(missing_ok=True)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    limited = ("prlimit", f"--as={MEMORY_BYTES}", str(program), *options, "--internal-plan-file", str(plan))
    try:
        ran = subprocess.run(
            limited, input=task, capture_output=True, text=True, check=False, timeout=timeout_s, cwd=directory
        )
    except subprocess.TimeoutExpired:
        return None
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if not plan.exists():
        return None
    whole_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return PeerRun(
        float(_figure(ran.stdout, r"Search time: ([0-9.]+)s")),
        whole_s,
        int(_figure(ran.stdout, r"Expanded (\d+) state")),
        int(_figure(ran.stdout, r"Plan length: (\d+) step")),
    )


def _figure(output: str, pattern: str) -> str:
    found = re.search(pattern, output)
    if found is None:
        raise ValueError(f"no {pattern!r} in the output of Fast Downward:\n{output}")
    return found[1]


def sas_task(model: BehaviorModel) -> str:
    """Return the planning part of a model from its nominal state; `ValueError` for a guard that SAS+ cannot state."""
    goal = dict(model.goals)[GOAL]
    task = Planner(model).problem(goal).task
    fields = task.packing.fields
    start = task.pack(model.nominal_state)
    wanted = dict(_single(literal) for literal in _literals(normal_form(goal, task.packing.space)))
    operators = [
        text
        for move in task.moves.joint
        if move.guard is not False
        for text in _operators(task.operations[move.index], move)
    ]
    lines = ["begin_version", "3", "end_version", "begin_metric", "0", "end_metric", str(len(fields))]
    for index, field in enumerate(fields):
        values = [f"Atom {field.variable.name}({value})" for value in field.variable.domain.values]
        lines += ["begin_variable", f"var{index}", "-1", str(len(values)), *values, "end_variable"]
    lines += ["0", "begin_state", *(str(field.index(start)) for field in fields), "end_state"]
    lines += [
        "begin_goal",
        str(len(wanted)),
        *(f"{variable} {value}" for variable, value in wanted.items()),
        "end_goal",
    ]
    return "\n".join([*lines, str(len(operators)), *operators, "0", ""])


def _literals(form: NormalForm) -> tuple[OneOf, ...]:
    parts = form.parts if isinstance(form, AllOf) else () if form is True else (form,)
    literals = tuple(part for part in parts if isinstance(part, OneOf))
    if len(literals) < len(parts):
        raise ValueError(f"not a conjunction of values: {form}")
    return literals


def _single(literal: OneOf) -> tuple[int, int]:
    (value,) = indices_of(literal.allowed)
    return literal.variable, value


def _operators(name: str, move: JointMove) -> Iterator[str]:
    """Yield an operator for each combination of values that the move distinguishes."""
    choices = {literal.variable: indices_of(literal.allowed) for literal in _literals(move.guard)}
    for write in move.writes:
        if len(set(write.indices)) > 1:
            choices.setdefault(write.source, tuple(range(len(write.indices))))
    for number, values in enumerate(product(*choices.values())):
        given = dict(zip(choices, values, strict=True))
        after = {write.target: write.indices[given.get(write.source, 0)] for write in move.writes}
        yield _operator(f"{name}-{number}", given, after)


def _operator(name: str, given: dict[int, int], after: dict[int, int | None]) -> str:
    changed = {variable: value for variable, value in after.items() if given.get(variable) != value}
    kept = [f"{variable} {value}" for variable, value in given.items() if variable not in changed]
    effects = [f"0 {variable} {given.get(variable, -1)} {value}" for variable, value in changed.items()]
    return "\n".join(["begin_operator", name, str(len(kept)), *kept, str(len(effects)), *effects, "1", "end_operator"])
