"""`scbm combine`: combines coverage stores."""

from pathlib import Path
from typing import Annotated

import typer

from scbm.cli.options.command_inputs import Reads
from scbm.cli.options.verb_options import Json
from scbm.cli.output.terminal import results, write_json
from scbm.reports.terminal.store_report import combined_json, combined_report
from scbm.store import combine_stores


def command(
    stores: Annotated[
        list[Path], typer.Argument(metavar="STORE...", help="Coverage stores.", show_default=False), Reads("a store")
    ],
    *,
    out: Annotated[
        Path, typer.Option("--out", "-o", metavar="FILE", help="The store to write; it may be one of STORE.")
    ],
    across_edits: Annotated[
        bool,
        typer.Option(
            "--across-edits",
            help="Keep the visits that are still valid in the model of the last store; list the rest.",
        ),
    ] = False,
    json: Json = False,
) -> int:
    """Combine coverage stores of one model into one store."""
    combined = combine_stores(stores, out, across_edits=across_edits)
    if json:
        write_json(combined_json(combined, str(out)))
    else:
        results().lines(combined_report(combined, str(out)))
    return 0
