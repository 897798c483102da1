"""`scbm test`: random cases, verdicts, and the coverability report."""

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated

import typer

from scbm.cli.arguments import read_limits
from scbm.cli.output import errors, results, write_json
from scbm.cli.report import draw_report
from scbm.notation import load_model
from scbm.testing import Campaign, CaseResult, RandomCases, Tester, campaign_json

_SLOW = 500
"""From so many cases on, progress is shown."""


def command(
    model: Annotated[Path, typer.Argument(help="The model file.", show_default=False)],
    *,
    cases: Annotated[int, typer.Option("--cases", min=0, max=10_000_000, help="How many random cases.")] = 20,
    seed: Annotated[int, typer.Option("--seed", help="Decides everything that is drawn.")] = 0,
    fail_under: Annotated[
        float | None, typer.Option("--fail-under", min=0, max=100, help="Exit with 1 if fewer per cent are visited.")
    ] = None,
    time_limit: Annotated[
        str | None, typer.Option("--time-limit", metavar="DURATION", help="Simulated time for each case. [1 h]")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> int:
    """Run random cases, judge them, and report how much of the model they visited."""
    loaded = load_model(model)
    tester = Tester(loaded, read_limits(time_limit))
    drawn = RandomCases(loaded, str(model)).first(cases, seed)
    campaign = tester.campaign(_with_progress(tester.results(drawn), cases), seed)
    if json:
        write_json(campaign_json(campaign))
    else:
        draw_report(campaign, str(model), results())
    return 1 if campaign.failed or not _reaches(campaign, fail_under) else 0


def _reaches(campaign: Campaign, fail_under: float | None) -> bool:
    """Whether the figure is good enough; says so if it is not."""
    if fail_under is None:
        return True
    figure = campaign.coverage.figure
    if figure.percent is None:
        errors().line(f"The model has no obligations, so --fail-under {fail_under:g} cannot be met.")
        return False
    if 100 * figure.visited < fail_under * figure.of:
        errors().line(f"Coverability {figure} is under {fail_under:g} %.")
        return False
    return True


def _with_progress(done: Iterable[CaseResult], count: int) -> Iterator[CaseResult]:
    """The results as they come, with a bar on a terminal if there are many."""
    if count < _SLOW or not sys.stderr.isatty():
        yield from done
        return
    from rich.console import Console  # noqa: PLC0415 - only where there is something to show
    from rich.progress import track  # noqa: PLC0415

    yield from track(done, "cases", count, console=Console(file=sys.stderr), transient=True)
