"""Options that several verbs have, each declared once; the verbs set the defaults."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scbm.cli.options.command_inputs import Reads
from scbm.cli.options.help_sections import HelpSection

FAIL_UNDER = "--fail-under"

Model = Annotated[Path, typer.Argument(help="The model file.", show_default=False), Reads("the model")]
Files = Annotated[
    list[Path] | None,
    typer.Argument(metavar="CASES...", help="Case files, and directories of them.", show_default=False),
    Reads("a case file"),
]
Cases = Annotated[
    int | None,
    HelpSection.CASES.option(
        "--cases", metavar="N", min=0, max=10_000_000, help="Number of random cases. [20; 0 with case files]"
    ),
]
Jobs = Annotated[
    int | None,
    HelpSection.RUNNING.option(
        "-j", "--jobs", metavar="N", min=1, max=1_024, help="Worker processes. [all cores, if it takes long]"
    ),
]
Cluster = Annotated[
    str | None,
    HelpSection.RUNNING.option(
        "--cluster", metavar="ADDRESS", help="Run the cases on this Dask cluster: `tcp://host:8786`."
    ),
]
Seed = Annotated[int, HelpSection.CASES.option("--seed", help="Seed of the random cases.")]
Network = Annotated[
    str | None,
    HelpSection.CASES.option("--network", help="Faults in random cases: `loss: 2 %, jitter: 20 ms`, or `drawn`."),
]
Inputs = Annotated[
    str | None,
    HelpSection.CASES.option(
        "--inputs",
        metavar="drawn",
        help="Move inputs and published values without environment transitions, too: `drawn`.",
    ),
]
MostGoals = Annotated[
    int | None,
    HelpSection.CASES.option(
        "--goals",
        metavar="N",
        min=1,
        max=1_000,
        help="Random cases have 1 to N goals in a row. [3; 1 for a model with single goals]",
    ),
]
Require = Annotated[
    list[str] | None, HelpSection.VERDICTS.option("--require", metavar="SENTENCE", help="An additional requirement.")
]
Store = Annotated[
    Path | None, HelpSection.OUTPUT.option("--store", metavar="FILE", help="Add the cases to this coverage store.")
]
Missing = Annotated[bool, HelpSection.OUTPUT.option("--missing", help="Show only the missed obligations, and why.")]
ShowAll = Annotated[
    bool, HelpSection.OUTPUT.option("--all", help="List each missed obligation, however many there are.")
]
FailUnder = Annotated[
    list[str] | None,
    HelpSection.VERDICTS.option(
        FAIL_UNDER,
        metavar="PERCENT",
        help="Exit with 1 if the visited percentage is lower: `90`, `executing=100`, `lifted=90`, `coverable=100`, "
        "`asserted=80`.",
    ),
]
Json = Annotated[bool, HelpSection.OUTPUT.option("--json", help="Print JSON.")]
ModelOfFile = Annotated[
    Path | None,
    HelpSection.CASES.option("--model", help="The model file. [the one that the file names]"),
    Reads("the model"),
]
SuiteFiles = Annotated[
    list[Path] | None,
    HelpSection.CASES.option("--suite", metavar="CASES", help="Case files, or a directory of them, to run first."),
    Reads("a case file"),
]
Goals = Annotated[str | None, HelpSection.CASES.option("--goal", help="A goal's name, or a predicate. [all goals]")]
StateValues = Annotated[
    list[str] | None,
    HelpSection.CASES.option("--state", metavar="VAR=VALUE", help="Change a variable of the nominal state."),
]
CaseTimeLimit = Annotated[
    str | None,
    HelpSection.RUNNING.option("--time-limit", metavar="DURATION", help="Simulated time for each case. [1 h]"),
]
RerunTimeLimit = Annotated[
    str | None,
    HelpSection.RUNNING.option("--time-limit", metavar="DURATION", help="Simulated time, if the case has no limit."),
]
AllChanges = Annotated[bool, HelpSection.OUTPUT.option("--all", help="Show changes of every variable.")]
TraceFile = Annotated[Path | None, HelpSection.OUTPUT.option("--trace", help="Write the trace to a file.")]
Bindings = Annotated[
    Path | None,
    HelpSection.NODES.option("--bindings", metavar="FILE", help="A file that binds resources to drivers."),
    Reads("the bindings"),
]
