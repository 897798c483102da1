"""The limits of closing as options. None is a time, so every machine decides the same model alike."""

from __future__ import annotations

from typing import Annotated

from scbm.cli.options.help_sections import HelpSection
from scbm.cli.options.registry_options import OptionGroup
from scbm.closing import CloseLimits

DEFAULT_LIMITS = CloseLimits()

MaxStates = Annotated[
    int,
    HelpSection.LIMITS.option(
        "--max-states", metavar="N", min=1, help="Maximum number of situations in the graph of all runs."
    ),
]
MaxPlanning = Annotated[
    int,
    HelpSection.LIMITS.option(
        "--max-planning", metavar="N", min=1, help="Maximum number of states for planning all runs to one goal."
    ),
]
MaxRandom = Annotated[
    int,
    HelpSection.LIMITS.option(
        "--max-random", metavar="N", min=0, help="Maximum number of random cases if there are too many runs to explore."
    ),
]
MaxChanges = Annotated[
    int,
    HelpSection.LIMITS.option(
        "--max-changes", metavar="N", min=0, help="Maximum number of changed cases after the random cases."
    ),
]


def _closing_limits(
    *,
    max_states: MaxStates = DEFAULT_LIMITS.situations,
    max_planning: MaxPlanning = DEFAULT_LIMITS.planning,
    max_random: MaxRandom = DEFAULT_LIMITS.random,
    max_changes: MaxChanges = DEFAULT_LIMITS.changes,
) -> CloseLimits:
    return CloseLimits(max_states, planning=max_planning, random=max_random, changes=max_changes)


ClosingLimits = Annotated[CloseLimits, OptionGroup(_closing_limits)]
"""All of these options."""


def limit_text(limits: CloseLimits) -> str:
    """Return the options for the limits that are not the default ones, with a blank before each."""
    options = {
        "--max-states": (limits.situations, DEFAULT_LIMITS.situations),
        "--max-planning": (limits.planning, DEFAULT_LIMITS.planning),
        "--max-random": (limits.random, DEFAULT_LIMITS.random),
        "--max-changes": (limits.changes, DEFAULT_LIMITS.changes),
    }
    return "".join(f" {option} {value}" for option, (value, default) in options.items() if value != default)
