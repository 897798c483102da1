"""What command lines that run many cases say of them, each option once; the verbs say the defaults."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scbm.cli.options import threshold_option

Model = Annotated[Path, typer.Argument(help="The model file.", show_default=False)]
Files = Annotated[
    list[Path] | None,
    typer.Argument(metavar="CASES", help="Case files, and directories of them.", show_default=False),
]
Cases = Annotated[
    int | None,
    typer.Option("--cases", min=0, max=10_000_000, help="How many random cases. [20; 0 beside case files]"),
]
Seed = Annotated[int, typer.Option("--seed", help="Seed of everything that is drawn.")]
Network = Annotated[
    str | None, typer.Option("--network", help="Faults in random cases: `loss: 2 %, jitter: 20 ms`, or `drawn`.")
]
Require = Annotated[list[str] | None, typer.Option("--require", metavar="SENTENCE", help="An additional requirement.")]
Store = Annotated[Path | None, typer.Option("--store", metavar="FILE", help="Add the cases to this coverage store.")]
Missing = Annotated[bool, typer.Option("--missing", help="Show only the missed obligations, and why.")]
FailUnder = Annotated[
    list[str] | None, typer.Option(threshold_option.OPTION, metavar="PERCENT", help=threshold_option.HELP)
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]
