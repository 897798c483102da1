"""How far a campaign is: a bar on a terminal, and lines elsewhere if it takes long."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from time import monotonic
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from scbm.testing import CaseResult

_SLOW_S = 10.0
"""A campaign that has taken so long gets a line for each further case."""


@contextmanager
def bar(count: int) -> Iterator[tuple[Callable[[str], None], Callable[[Iterator[CaseResult]], Iterator[CaseResult]]]]:
    """What to call with the case that runs, and what lets results through and counts them."""
    from rich.console import Console  # noqa: PLC0415 - only where there is something to show
    from rich.progress import Progress  # noqa: PLC0415

    with Progress(console=Console(file=sys.stderr), transient=True) as progress:
        task = progress.add_task("cases", total=count)

        def counted(results: Iterator[CaseResult]) -> Iterator[CaseResult]:
            for result in results:
                progress.advance(task)
                yield result

        yield lambda name: progress.update(task, description=name), counted


def with_lines(
    results: Iterator[CaseResult], count: int, tell: Callable[[str], None], now_s: Callable[[], float] = monotonic
) -> Iterator[CaseResult]:
    """Yield the results; print a line for each once ten seconds have passed."""
    begun_s = now_s()
    for number, result in enumerate(results, start=1):
        if now_s() - begun_s >= _SLOW_S:
            tell(f"{number} of {count}: {result.case.name} {_ended(result)}")
        yield result


def _ended(result: CaseResult) -> str:
    verdict = result.verdict
    return str(verdict.end) if verdict.passed else f"{verdict.end}, failed: {verdict.failures[0].message}"


@contextmanager
def activity_display(words: str) -> Iterator[Callable[[str], None]]:
    """Show on a terminal what a command does now; yield what changes the words. Elsewhere nothing is shown."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console  # noqa: PLC0415 - only where there is something to show
    from rich.markup import escape  # noqa: PLC0415

    with Console(file=sys.stderr).status(escape(words)) as status:
        yield lambda text: status.update(escape(text))
