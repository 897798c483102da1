"""The model file as a file of code in a tracefile of LCOV: its branches are the obligations (decision 21)."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from scbm.cases.coverage import status_counts_in_words
from scbm.model.visible_text import in_one_line
from scbm.reports.ci.marked_lines import as_code, mark_file
from scbm.reports.ci.xml_text import portable
from scbm.reports.status_lines import status_warnings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.reports.ci.marked_lines import MarkedFile, MarkedLine
    from scbm.store import History


_NO_WORD = re.compile(r"\W", re.ASCII)
"""Characters that the name of a test cannot contain."""


def lcov_info(history: History) -> str:
    """Return a tracefile for `lcov` 1 and 2, `genhtml`, and tools that read the same format.

    Raises:
        InputError: the source of the history is not a model.
    """
    marked = as_code(mark_file(history.model, history.source, history.coverage))
    return "".join(f"{line}\n" for line in _records(history, marked))


def _records(history: History, marked: MarkedFile) -> Iterator[str]:
    yield from (f"# {in_one_line(comment)}" for comment in _comments(history))
    yield f"TN:{_NO_WORD.sub('_', history.model.name)}"
    yield f"SF:{in_one_line(portable(history.source.path))}"
    yield from (f"FN:{part.number},{part.name}" for part in marked.parts)
    yield from (f"FNDA:{part.hits},{part.name}" for part in marked.parts)
    yield f"FNF:{len(marked.parts)}"
    yield f"FNH:{sum(part.hits > 0 for part in marked.parts)}"
    counts = [count for line in marked.measured for _, count in line.obligations]
    yield from (record for line in marked.measured for record in _branches(line))
    yield f"BRF:{len(counts)}"
    yield f"BRH:{sum(count > 0 for count in counts)}"
    yield from (f"DA:{line.number},{line.hits}" for line in marked.measured)
    yield f"LF:{len(marked.measured)}"
    yield f"LH:{sum(bool(line.hits) for line in marked.measured)}"
    yield "end_of_record"


def _comments(history: History) -> Iterator[str]:
    """Yield the statuses as comments, for people: the format has no place for them, and tools skip comments."""
    statuses = history.decided
    if statuses is None:
        return
    yield f"SCBM-IAS {history.coverage.figure}; {statuses.coverable} of what can be covered"
    yield status_counts_in_words(statuses.counts)
    yield from (f"assumed: {sentence}" for sentence in statuses.assumptions)
    for entry in statuses.entries:
        if not entry.is_plain:
            yield f"{entry.obligation}: {entry.words}"
    yield from status_warnings(statuses)


def _branches(line: MarkedLine) -> Iterator[str]:
    """Yield the branches of a line; `-` means that the line was not executed."""
    for index, (_, count) in enumerate(line.obligations):
        yield f"BRDA:{line.number},0,{index},{count if line.hits else '-'}"
