"""The limits of closing as options. None is a time, so every machine decides the same model alike."""

from __future__ import annotations

from typing import Annotated

import typer

from scbm.cli.options.help_sections import HelpSection
from scbm.closing import CloseLimits

DEFAULT_LIMITS = CloseLimits()

MaxStates = Annotated[
    int,
    typer.Option(
        "--max-states",
        metavar="N",
        min=1,
        help="Maximum number of explored situations of runs.",
        rich_help_panel=HelpSection.LIMITS,
    ),
]
MaxPlanning = Annotated[
    int,
    typer.Option(
        "--max-planning",
        metavar="N",
        min=1,
        help="Maximum number of states to plan all runs for one goal.",
        rich_help_panel=HelpSection.LIMITS,
    ),
]
MaxRandom = Annotated[
    int,
    typer.Option(
        "--max-random",
        metavar="N",
        min=0,
        help="Maximum number of random cases of the search, if runs are many.",
        rich_help_panel=HelpSection.LIMITS,
    ),
]
MaxChanges = Annotated[
    int,
    typer.Option(
        "--max-changes",
        metavar="N",
        min=0,
        help="Maximum number of changed cases after them, if runs are many.",
        rich_help_panel=HelpSection.LIMITS,
    ),
]


def limit_text(limits: CloseLimits) -> str:
    """Return the options for the limits that are not the default ones, with a blank before each."""
    options = {
        "--max-states": (limits.situations, DEFAULT_LIMITS.situations),
        "--max-planning": (limits.planning, DEFAULT_LIMITS.planning),
        "--max-random": (limits.random, DEFAULT_LIMITS.random),
        "--max-changes": (limits.changes, DEFAULT_LIMITS.changes),
    }
    return "".join(f" {option} {value}" for option, (value, default) in options.items() if value != default)
