"""`scbm run`: runs one goal against simulated resources, and prints a timeline."""

from typing import Annotated

from msgspec.structs import replace

from scbm.cases import Case, CaseLimits, Origin
from scbm.cli.options.campaign_options import read_inputs
from scbm.cli.options.help_sections import HelpSection
from scbm.cli.options.option_errors import OptionReader, option_error
from scbm.cli.options.option_values import (
    allowed_state,
    read_faults,
    read_goal,
    read_requirements,
    read_state,
    read_time_limit,
)
from scbm.cli.options.planner_options import RunPlanner
from scbm.cli.options.verb_options import AllChanges, Inputs, Json, Model, MostGoals, Require, StateValues, TraceFile
from scbm.cli.output.shown_run import show_run
from scbm.files import FileWriter, load_model
from scbm.model import BehaviorModel, Requirement
from scbm.testing import RandomCases, Tester, draw_network
from scbm.testing.random_cases import most_goals


def command(
    model: Model,
    *,
    goal: Annotated[str | None, HelpSection.CASES.option("--goal", help="A goal's name, or a predicate.")] = None,
    state: StateValues = None,
    seed: Annotated[int, HelpSection.CASES.option("--seed", help="Seed of the replies of the resources.")] = 0,
    case: Annotated[
        int | None,
        HelpSection.CASES.option(
            "--case", metavar="N", min=1, help="Goal and initial state of this case of `scbm test --seed`."
        ),
    ] = None,
    network: Annotated[
        str | None,
        HelpSection.CASES.option("--network", help="Faults of the network: `loss: 2 %, jitter: 20 ms`, or `drawn`."),
    ] = None,
    inputs: Inputs = None,
    goals: MostGoals = None,
    require: Require = None,
    time_limit: Annotated[
        str | None,
        HelpSection.RUNNING.option("--time-limit", metavar="DURATION", help="Simulated time for the goal. [1 h]"),
    ] = None,
    planner: RunPlanner,
    every: AllChanges = False,
    trace: TraceFile = None,
    json: Json = False,
) -> int:
    """Run one goal against simulated resources, and show what happens."""
    writer = FileWriter(model=model)
    writer.refuse_outputs({"--trace": trace})
    written, options = load_model(model), OptionReader()
    loaded = options.read(lambda: planner.applied(written), written)
    faults = options.read(lambda: read_faults(network, loaded), None)
    requirements: tuple[Requirement, ...] = options.read(lambda: read_requirements(require or [], loaded), ())
    time_limit_ns = options.read(lambda: read_time_limit(time_limit), None)
    moves_inputs = options.read(lambda: read_inputs(inputs), default=False)
    options.read(lambda: _refuse_goals(goals if case is None else None), None)
    origin = Origin(seed, case or 1, moves_inputs, 1 if case is None else goals or most_goals(loaded))
    asked = options.last(lambda: _case(loaded, str(model), goal, state, origin, drawn=case is not None))
    asked = replace(
        asked,
        network=draw_network(loaded, Origin(seed, case or 1)) if faults is None else faults,
        requirements=requirements,
        limits=CaseLimits(time_ns=time_limit_ns),
    )
    execution = Tester(loaded).execute(asked)
    show_run(loaded, execution, trace=trace, writer=writer, json=json, every=every)
    return 0 if execution.verdict.passed else 1


def _refuse_goals(goals: int | None) -> None:
    """Raise `InputError` for a number of goals that are not drawn."""
    if goals is not None:
        raise option_error("--goals", "this is for random cases", "add for example `--case 1`")


def _case(
    model: BehaviorModel, file: str, goal: str | None, state: list[str] | None, origin: Origin, *, drawn: bool
) -> Case:
    """Return the case of the options: a random case of `scbm test`, or one with the given goal and state."""
    if drawn:
        if goal is not None or state:
            raise option_error(
                "--case", "`--case` draws goal and initial state, so `--goal` and `--state` do not go with it"
            )
        drawn_cases = RandomCases(model, file, moves_inputs=origin.moves_inputs, goals=origin.goals)
        return drawn_cases.case(origin.seed, origin.number)
    if goal is None:
        names = ", ".join(name for name, _ in model.goals) or "none in this model"
        raise option_error(
            "--goal", "a run needs a goal", f"goals: {names}; or write a predicate; or draw a case: `--case 1`"
        )
    name, predicate = read_goal(goal, model)
    initial = allowed_state(read_state(state or [], model), model)
    return Case(f"seed-{origin.seed}", name, predicate, initial, origin=origin)
