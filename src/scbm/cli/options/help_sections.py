"""The sections of the help of a verb: which options stand together, and in which order."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperCommand, TyperOption

if TYPE_CHECKING:
    from collections.abc import Sequence

    from typer._click import Context, HelpFormatter, Parameter
    from typer.models import OptionInfo

_MAX_UNDIVIDED = 8
"""Maximum number of options that the help shows without sections, `--help` included: a reader finds each of so few."""


class HelpSection(StrEnum):
    """A section of options, which declares them; the help has the sections in this order."""

    CASES = "Cases"
    VERDICTS = "Requirements and thresholds"
    RUNNING = "Running"
    PLANNER = "Planner"
    LIMITS = "Search limits"
    NODES = "Nodes"
    FILES = "Report files"
    OUTPUT = "Output"
    OTHER = "Other options"

    def option(self, *names: str, **settings: Any) -> OptionInfo:  # noqa: ANN401 - those of `typer.Option`
        """Return an option of this section, declared as by `typer.Option`."""
        option: OptionInfo = typer.Option(*names, rich_help_panel=self, **settings)
        return option


class VerbCommand(TyperCommand):
    """A verb whose help divides many options into sections."""

    def format_options(self, ctx: Context, formatter: HelpFormatter) -> None:
        """Write the arguments, then the options: each section of `HelpSection` that has any, or all in one."""
        parameters = self.get_params(ctx)
        _write("Arguments", [each for each in parameters if not isinstance(each, TyperOption)], ctx, formatter)
        options = [each for each in parameters if isinstance(each, TyperOption)]
        if len(options) <= _MAX_UNDIVIDED:
            _write("Options", options, ctx, formatter)
            return
        for section in HelpSection:
            members = [each for each in options if (each.rich_help_panel or HelpSection.OTHER) == section]
            _write(section, members, ctx, formatter)


def _write(title: str, parameters: Sequence[Parameter], ctx: Context, formatter: HelpFormatter) -> None:
    rows = [row for each in parameters if (row := each.get_help_record(ctx)) is not None]
    if rows:
        with formatter.section(title):
            formatter.write_dl(rows)
