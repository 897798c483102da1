"""`--fail-under`: how much has to be visited, of everything or of one kind."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from scbm.cases.coverage import KINDS, Threshold
from scbm.cli.output.terminal import errors
from scbm.files import suggestion
from scbm.model import Diagnostic, InputError, Place, Slug

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.cases.coverage import Coverage

OPTION = "--fail-under"
HELP = "Exit with 1 if fewer per cent are visited: `90`, or of one kind: `executing=100`."

_ALL_PERCENT = 100
_NUMBER = re.compile(r"(\d+(?:\.\d+)?)\s*%?", re.ASCII)


def read_thresholds(texts: Sequence[str]) -> tuple[Threshold, ...]:
    """Each as `90`, or as `executing=100`. Raises `InputError` with all that is wrong with them."""
    wrong: list[Diagnostic] = []
    thresholds = []
    for text in texts:
        kind, equals, number = text.rpartition("=")
        kind = kind.strip() if equals else "all"
        percent = _percent(number)
        if kind not in KINDS:
            remedy = suggestion(kind, list(KINDS), "kinds are")
            place = Place(OPTION, 1, 1, max(1, len(kind)))
            wrong.append(Diagnostic(Slug.BAD_OPTION, f"there is no kind `{kind}`", place, remedy, text))
        elif percent is None:
            place = Place(OPTION, 1, len(text) - len(number) + 1, max(1, len(number)))
            remedy = "write `90`, or `executing=100`"
            message = f"`{number}` is not a number from 0 to 100"
            wrong.append(Diagnostic(Slug.BAD_OPTION, message, place, remedy, text))
        else:
            thresholds.append(Threshold(percent, kind))
    if wrong:
        raise InputError(wrong)
    return tuple(thresholds)


def _percent(text: str) -> float | None:
    match = _NUMBER.fullmatch(text.strip())
    percent = float(match[1]) if match else None
    return percent if percent is not None and percent <= _ALL_PERCENT else None


def meets(coverage: Coverage, thresholds: Sequence[Threshold]) -> bool:
    """Whether enough was visited; says of each kind of which it was not."""
    missed = [threshold for threshold in thresholds if not threshold.is_met(coverage)]
    for threshold in missed:
        errors().line(_missed_sentence(threshold, coverage))
    return not missed


def _missed_sentence(threshold: Threshold, coverage: Coverage) -> str:
    figure = threshold.figure(coverage)
    kind = "" if threshold.kind == "all" else f"{threshold.kind}="
    if not figure.of:
        of_kind = f" for `{threshold.kind}`" if kind else ""
        return f"The model has no obligations{of_kind}, so {OPTION} {kind}{threshold.percent:g} cannot be met."
    what = f"Coverability of `{threshold.kind}`, {figure}," if kind else f"Coverability {figure}"
    return f"{what} is under {threshold.percent:g} %."
