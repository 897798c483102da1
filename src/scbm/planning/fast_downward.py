"""Fast Downward as a planner, through `unified-planning`: the extra `fast-downward` (GPL-3.0, never in the core).

The planning part of a model goes out as PDDL, and the names of operations come back. Its answers are external: they
depend on the program that is installed, and on a limit of wall time.
"""

from __future__ import annotations

from importlib import import_module, metadata
from typing import TYPE_CHECKING, Any

from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.planning.pddl_export import MAX_CASES, PddlDomain
from scbm.planning.plan_answers import Limit, LimitReached, NoPlanFound, PlanLimits, Solved, Unsolvable

if TYPE_CHECKING:
    from scbm.planning.plan_answers import Answer
    from scbm.planning.planning_task import PlanProblem

DEFAULT_TIME_NS = 30_000_000_000
"""The limit of wall time of a search that has no other."""

_MAX_OPTIMAL_CASES = 1_000
"""Maximum number of actions for an operation: LM-cut refuses conditional effects, so many old values are told apart."""

_TRANSLATION = ["--invariant-generation-max-time", "0"]
"""No search for invariants: for the propositions of a model it takes up to 12 s, the rest of a translation 0.1 s."""

_DISTRIBUTION = "up-fast-downward"
_INSTALL = "pip install 'scbm[fast-downward]'"


def lama_first(problem: PlanProblem, limits: PlanLimits) -> Answer:
    """Return some plan: the first one of LAMA."""
    return _answer(problem, limits, "fast-downward", MAX_CASES)


def optimal(problem: PlanProblem, limits: PlanLimits) -> Answer:
    """Return a plan of proved length: A* with the heuristic LM-cut."""
    return _answer(problem, limits, "fast-downward-opt", _MAX_OPTIMAL_CASES)


def program_version() -> str:
    """Return the version of the installed program. Raise `InputError` if the extra is missing."""
    try:
        return metadata.version(_DISTRIBUTION)
    except metadata.PackageNotFoundError:
        raise _missing() from None


def _missing() -> InputError:
    message = "Fast Downward is not installed"
    return InputError([Diagnostic(Slug.PLANNER_MISSING, message, Place("planner fast-downward"), f"run `{_INSTALL}`")])


def _answer(problem: PlanProblem, limits: PlanLimits, engine: str, most_cases: int) -> Answer:
    if problem.is_goal(problem.start):
        return Solved((), 0)
    parts = problem.problem
    domain = PddlDomain(parts.model, [parts.goal], most_cases)
    state = {**parts.model.nominal_state} | problem.task.packing.values(problem.start)
    result = _solved(domain.text, domain.problem("problem", state, parts.goal), engine, limits)
    match result.status.name:
        case "SOLVED_SATISFICING" | "SOLVED_OPTIMALLY":
            plan = tuple(domain.operations[step.action.name] for step in result.plan.actions)
            return Solved(plan, 0) if len(plan) <= limits.length else LimitReached(Limit.LENGTH, 0)
        case "UNSOLVABLE_PROVEN":
            return Unsolvable(0)
        case "UNSOLVABLE_INCOMPLETELY":
            return NoPlanFound(0)
        case "TIMEOUT":
            return LimitReached(Limit.TIME, 0)
        case "MEMOUT":
            return LimitReached(Limit.MEMORY, 0)
        case status:
            output = " ".join(entry.message for entry in result.log_messages or ())
            last = " ".join(output.split())[-300:]
            message = f"Fast Downward ended without an answer ({status.lower().replace('_', ' ')}): {last}"
            raise InputError([Diagnostic(Slug.PLANNER_FAILED, message, Place("planner fast-downward"))])


def _solved(domain: str, problem: str, engine: str, limits: PlanLimits) -> Any:  # noqa: ANN401 - a library that is optional
    program_version()
    shortcuts, reader = import_module("unified_planning.shortcuts"), import_module("unified_planning.io")
    shortcuts.get_environment().credits_stream = None
    time_ns = DEFAULT_TIME_NS if limits.time_ns is None else limits.time_ns
    parsed = reader.PDDLReader().parse_problem_string(domain, problem)
    with shortcuts.OneshotPlanner(name=engine) as planner:
        command = planner._base_cmd  # noqa: SLF001 - the only way to a file of its own, see below

        def with_own_file(plan_file: str) -> list[Any]:
            """Add a unique intermediate file: by default all searches in one directory would share `output.sas`."""
            return [*command(plan_file), "--sas-file", f"{plan_file}.sas"]

        planner._base_cmd = with_own_file  # noqa: SLF001 - as above
        planner._fd_translate_options = _TRANSLATION  # noqa: SLF001 - the engine for optimal plans takes no options
        return planner.solve(parsed, timeout=time_ns / 1e9)
