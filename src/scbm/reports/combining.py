"""What came of uniting stores, for people and for machines."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Any

from rich.text import Text

from scbm.reports.since import in_all
from scbm.reports.words import counted
from scbm.testing import coverage_json

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.storing import Combined, Dropped

FORMAT_VERSION = 1


def combined_report(combined: Combined, target: str) -> Iterator[Text]:
    """What the new store holds; before that, what of earlier versions of the model does not count any more."""
    for path, dropped in combined.dropped:
        if dropped:
            yield Text(f"{path}: of an earlier version of the model; dropped what means something else now")
            yield from _told(dropped)
        else:
            yield Text(f"{path}: of an earlier version of the model; all that it visited is unchanged")
    history = combined.history
    yield in_all(len(history.cases), history.coverage.figure, target).append(f", {counted(len(history.runs), 'run')}")


def _told(dropped: Sequence[Dropped]) -> Iterator[Text]:
    for subject, group in groupby(dropped, key=lambda d: d.obligation.subject):
        of_subject = list(group)
        aspects = ", ".join(d.obligation.aspect.value for d in of_subject)
        yield Text(f"  {subject}: {aspects}").append(
            "   it is gone" if of_subject[0].is_gone else "   it was edited", "dim"
        )


def combined_json(combined: Combined, target: str) -> dict[str, Any]:
    """The same as data that `json` can write."""
    history = combined.history
    return {
        "format_version": FORMAT_VERSION,
        "model": history.model.name,
        "store": target,
        "cases": len(history.cases),
        "runs": len(history.runs),
        "coverage": coverage_json(history.coverage),
        "dropped": [
            {"store": str(path), "obligation": str(d.obligation), "reason": "gone" if d.is_gone else "edited"}
            for path, dropped in combined.dropped
            for d in dropped
        ],
    }
