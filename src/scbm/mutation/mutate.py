"""`scbm mutate`: changes the model in one small way at a time, and shows which changes the cases notice."""

from pathlib import Path
from typing import Annotated

from scbm.cli.campaigns.test_campaign import CampaignOptions
from scbm.cli.options.closing_options import DEFAULT_LIMITS, MaxPlanning, MaxStates
from scbm.cli.options.help_sections import HelpSection
from scbm.cli.options.planner_options import RunPlanner
from scbm.cli.options.verb_options import (
    Cases,
    CaseTimeLimit,
    Files,
    Inputs,
    Jobs,
    Json,
    Model,
    MostGoals,
    Network,
    Require,
    Seed,
)
from scbm.cli.output.terminal import errors
from scbm.closing import CloseLimits
from scbm.mutation.git_revision import changed_since
from scbm.mutation.mutation_campaign import (
    MutationOptions,
    MutationOutput,
    carry_out_mutants,
    read_operators,
    read_oracle,
    read_score,
)
from scbm.mutation.mutation_work import MutationWork


def command(
    model: Model,
    files: Files = None,
    *,
    cases: Cases = None,
    seed: Seed = 0,
    network: Network = None,
    inputs: Inputs = None,
    goals: MostGoals = None,
    require: Require = None,
    oracle: Annotated[
        str | None,
        HelpSection.VERDICTS.option(
            "--oracle",
            metavar="recorded",
            help="Fail a case also if its run differs from its run on the model: `recorded`.",
        ),
    ] = None,
    fail_under: Annotated[
        list[str] | None,
        HelpSection.VERDICTS.option(
            "--fail-under",
            metavar="PERCENT",
            help="Exit with 1 if the percentage of killed mutants is lower: `mutants=90`.",
        ),
    ] = None,
    operators: Annotated[
        list[str] | None,
        HelpSection.RUNNING.option(
            "--operators",
            metavar="NAMES",
            help="Only these mutation operators, or groups of them: `guards,deadline-none`.",
        ),
    ] = None,
    since: Annotated[
        str | None,
        HelpSection.RUNNING.option(
            "--since",
            metavar="REVISION",
            help="Only mutants of parts of the model that changed since this revision in git: `main`.",
        ),
    ] = None,
    jobs: Jobs = None,
    time_limit: CaseTimeLimit = None,
    planner: RunPlanner,
    equivalence: Annotated[
        bool,
        HelpSection.LIMITS.option(
            "--equivalence/--no-equivalence", help="Prove that mutants are equivalent, or find witnesses."
        ),
    ] = True,
    max_states: MaxStates = DEFAULT_LIMITS.situations,
    max_planning: MaxPlanning = DEFAULT_LIMITS.planning,
    html: Annotated[
        Path | None,
        HelpSection.FILES.option("--html", metavar="FILE", help="A page with all mutants at their lines of the model."),
    ] = None,
    sarif: Annotated[
        Path | None,
        HelpSection.FILES.option("--sarif", metavar="FILE", help="The mutants that no case killed, for code scanning."),
    ] = None,
    witnesses: Annotated[
        Path | None,
        HelpSection.OUTPUT.option(
            "--witnesses", metavar="DIRECTORY", help="Directory for cases in which mutants differ from the model."
        ),
    ] = None,
    store: Annotated[
        Path | None,
        HelpSection.OUTPUT.option(
            "--store",
            metavar="FILE",
            help="Keep the results of mutants in this coverage store, and reuse those that it has.",
        ),
    ] = None,
    json: Json = False,
) -> int:
    """Change the model in one small way at a time, and report which changes its cases notice."""
    wanted = CampaignOptions(
        model, files or [], cases, seed, network, require or [], time_limit, planner, inputs=inputs, goals=goals
    )
    thresholds = read_score(fail_under or [])
    chosen, records = read_operators(operators or []), read_oracle(oracle)
    suite = wanted.suite({})
    entries = None if since is None else changed_since(since, suite.model, model)
    if entries == ():
        errors().prose(f"{model}: nothing that has mutants changed since {since}")
    limits = CloseLimits(max_states, planning=max_planning) if equivalence else None
    if equivalence and not suite.model.goals:
        errors().prose(f"{model}: no mutant is proved equivalent: proofs are about goals of the model, and it has none")
    work = MutationWork(suite.work, chosen, entries, records, finds_visitors=store is not None)
    output = MutationOutput(thresholds, witnesses, html, sarif, json)
    return carry_out_mutants(suite, work, MutationOptions(jobs, limits, store), output)
