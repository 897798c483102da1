"""A store as a summary in Markdown, for the page of a job, or a comment on a change, at GitHub or GitLab."""

from __future__ import annotations

import re
from html import escape
from typing import TYPE_CHECKING

from scbm.cases.coverage import (
    STATE_ASPECTS,
    Aspect,
    Decision,
    Figure,
    InstanceFolds,
    engine_counts_in_words,
    status_counts_in_words,
    visits_in_words,
)
from scbm.model.visible_text import counted, escaped
from scbm.reports.cover_advice import CampaignKind
from scbm.reports.figure_table import FORCED_MARK, short_of_goal_in_words
from scbm.reports.missed_reasons import close_command, missed_reasons
from scbm.reports.pictures import PICTURES
from scbm.reports.run_changes import NO_EARLIER_RUN, change_groups, run_in_words
from scbm.reports.status_lines import status_warnings, united_in_words
from scbm.reports.stored_cases import again, causes_of, durations, replay_command
from scbm.testing.batches.batch_summary import MAX_HAZARDS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases.coverage import LiftedStatuses
    from scbm.reports.missed_reasons import Missed
    from scbm.reports.run_changes import ChangeRow
    from scbm.reports.stored_cases import Cause
    from scbm.store import History, RunComparison

MAX_CHARACTERS = 65_536
"""Maximum length of a comment at GitHub; the summary of a step may be sixteen times as long."""

_ORDER = (*STATE_ASPECTS, Aspect.TAKEN, Aspect.QUEUED)
_BAR_WIDTH = 40
_SMALL_BAR_WIDTH = 16
_MAX_CAUSES = 20
_MAX_NAMED = 3
_MAX_ROWS = 100
_FEWEST_HIDDEN = 6
"""Lists of at least this length are folded."""

_MAX_OF_A_TEXT = 400
"""Maximum number of characters of a message or a name."""

_BLANKS = re.compile(r"\s+")
_MARKUP = re.compile(r"[\\`*_{}\[\]|~#$!]")
_BACKTICKS = re.compile(r"`+")


def markdown(history: History, missed: Sequence[Missed] | None = None, most_characters: int = MAX_CHARACTERS) -> str:
    """Return the figure, the failures, and the missed obligations with their reasons, the most important first.

    Args:
        history: the contents of the store.
        missed: the missed obligations to show; all of them, and the pictures, if `None`.
        most_characters: the maximum length; a sentence replaces the parts at the end that do not fit.
    """
    file = history.source.path
    pictures = [block for entry in PICTURES.values() for block in entry.blocks(history)] if missed is None else []
    if missed is None:
        kind = CampaignKind.of_store(history)
        missed = missed_reasons(history, file, kind)
    undecided = [each for each in missed if each.status is Decision.UNDECIDED]
    others = [each for each in missed if each.status is not Decision.UNDECIDED]
    blocks = [_headline(history), *_statuses(history), *_failed(causes_of(history), history)]
    blocks += [*_hazards(history), _figures(history), *_requirements(history)]
    blocks += [] if history.since is None else _since(history.since, history)
    folds = InstanceFolds.of(history.model)
    blocks += [*_missing(undecided, file, folds), *_not_needed(others, folds)]
    blocks += pictures
    return _joined(blocks, most_characters)


def _joined(blocks: Sequence[str], most_characters: int) -> str:
    """Return the blocks that fit, in their order, and a sentence about the others."""
    text = "\n".join(blocks)
    if len(text) <= most_characters:
        return text
    cut = "\n*The rest is left out, as this would be too long: `scbm report` shows all of it.*\n"
    kept = ""
    for block in blocks:
        if len(kept) + len(block) + 1 + len(cut) > most_characters:
            break
        kept += f"{block}\n"
    return kept + cut


def _headline(history: History) -> str:
    figure = history.coverage.figure
    mark = "❌" if history.failed else "✅" if history.cases else "⚪"
    bar = "" if figure.percent is None else f"`{_bar(figure, _BAR_WIDTH)}` "
    cases = f"{counted(len(history.cases), 'case')}: {', '.join(_ends(history))}" if history.cases else "no cases"
    visited = visits_in_words(figure, history.statuses.forced, FORCED_MARK)
    failed = f"**{len(history.failed)} failed**; " if history.failed else ""
    words = short_of_goal_in_words(history.short_count, history.short)
    short = f"\nPassed short of the goal: {_plain(words)}\n" if words else ""
    lifted = "" if history.lifted is None else _lifted_words(history.lifted)
    return (
        f"## {mark} SCBM-IAS of {_code(history.model.name)}: {figure}\n\n"
        f"{bar}{visited}\n\n{lifted}"
        f"{failed}{cases}; {durations(history)}\n{short}"
    )


def _lifted_words(lifted: LiftedStatuses) -> str:
    """Return the lifted figure, and from which objects it comes if there are several lists of them."""
    figure = lifted.figure
    united = f"; {_plain(united_in_words(lifted))}" if lifted.others else ""
    head = f"**{figure} lifted** ({figure.visited} of {figure.of})"
    return f"{head}: an operation with parameters counts once{united}\n\n"


def _statuses(history: History) -> Iterator[str]:
    """Yield the figure of what can be covered, the number of obligations of each status, and warnings."""
    statuses = history.decided
    if statuses is None:
        return
    figure = statuses.coverable
    counts = status_counts_in_words(statuses.counts)
    yield f"**{figure} of what can be covered** ({figure.visited} of {figure.of}): {_plain(counts)}\n"
    if statuses.engines:
        yield f"Proofs: {_plain(engine_counts_in_words(statuses.engines))}\n"
    if statuses.assumptions:
        yield f"Proofs assume: {_plain(' '.join(statuses.assumptions))}\n"
    warnings = [f"- ⚠️ {_plain(warning)}\n" for warning in status_warnings(statuses)]
    if warnings:
        yield "".join(warnings)


def _requirements(history: History) -> Iterator[str]:
    """Yield a table of the requirements, with what cases and closing say of them."""
    rows = [_row(_cell(each.name), _plain(each.words)) for each in history.requirements]
    if rows:
        yield f"{_table(('requirement', 'known of it'), rows)}\n"


def _not_needed(missed: Sequence[Missed], folds: InstanceFolds) -> Iterator[str]:
    """Yield the missed obligations that need not be covered, or cannot be, with the reasons; folded."""
    if not missed:
        return
    found = list(_rows_of(missed, folds))
    rows = [_row(names, _plain(reason)) for names, reason in found[:_MAX_ROWS]]
    more = f"\nand {len(found) - _MAX_ROWS} more\n" if len(found) > _MAX_ROWS else ""
    table = _table(("obligation", "status and reason"), rows)
    yield f"<details><summary><b>{len(missed)} with another status</b></summary>\n\n{table}{more}\n</details>\n"


def _rows_of(missed: Sequence[Missed], folds: InstanceFolds) -> Iterator[tuple[str, str]]:
    """Yield obligations with their reasons; instances of an entry that miss one aspect for one reason share a row."""
    alike: dict[tuple[Aspect, str, str], list[Missed]] = {}
    for each in missed:
        entry = folds.entry_of(each.obligation) or each.obligation.subject
        alike.setdefault((each.obligation.aspect, entry, each.reason), []).append(each)
    for (aspect, _, reason), group in alike.items():
        subjects = tuple(each.obligation.subject for each in group)
        words = folds.folded(subjects, is_automatic=aspect is Aspect.TAKEN)
        if words == subjects:
            yield ", ".join(_cell(str(each.obligation)) for each in group), reason
        else:
            yield f"{', '.join(map(_cell, words))}: {aspect.value}", reason


def _ends(history: History) -> Iterator[str]:
    ends: dict[str, int] = {}
    for case in history.cases:
        ends[case.verdict.end_in_words] = ends.get(case.verdict.end_in_words, 0) + 1
    return (f"{count} {end}" for end, count in ends.items())


def _failed(causes: Sequence[Cause], history: History) -> Iterator[str]:
    if not causes:
        return
    rows = [_row(*_cause(cause, history)) for cause in causes[:_MAX_CAUSES]]
    table = _table(("what failed", "cases", "see it"), rows)
    more = len(causes) - _MAX_CAUSES
    rest = f"\nand {counted(more, 'more cause')}\n" if more > 0 else ""
    yield f"### Failed: {counted(len(history.failed), 'case')}\n\n{table}{rest}"


def _hazards(history: History) -> Iterator[str]:
    """Yield the hazards at devices, a line for each of the first ones."""
    if history.hazards:
        lines = [f"- {_cell(label)}: {_plain(str(hazard))}\n" for label, hazard in history.hazards[:MAX_HAZARDS]]
        more = len(history.hazards) - MAX_HAZARDS
        lines += [f"- and {more} more\n"] if more > 0 else []
        yield f"### Hazards at devices: {len(history.hazards)}\n\n{''.join(lines)}"


def _cause(cause: Cause, history: History) -> tuple[str, str, str]:
    command = again(cause.case, history.source.path, history.runs)
    all_of_it = "all of its run: " if cause.case.is_over_nodes else ""
    small = cause.smallest
    if small is not None and small.path:
        command = replay_command(small)
        all_of_it = f"smallest case, {small.sizes}: "
    matters = "".join(f"; it matters: {_plain(choice)}" for choice in ([] if small is None else small.what_matters))
    return (
        f"**{cause.failure.kind.replace('_', ' ')}**: {_plain(cause.failure.message)}",
        _names(cause.labels),
        f"{all_of_it}{_cell(command)}{matters}" if command else "",
    )


def _since(since: RunComparison, history: History) -> Iterator[str]:
    """Yield the changes since an earlier run, as one table."""
    if since.then is None:
        yield f"### Since an earlier run\n\n{NO_EARLIER_RUN}\n"
        return
    then, now = (str(history.obligations.figure(run.visited)) for run in (since.then, since.now))
    rows = [_row("SCBM-IAS", "", then, now)]
    for change, group in change_groups(since):
        rows += [_row(change, _cell(str(row.subject)), *_then_and_now(row)) for row in group[:_MAX_ROWS]]
        rows += [_row(change, f"and {len(group) - _MAX_ROWS} more", "", "")] if len(group) > _MAX_ROWS else []
    yield f"### Since the run {run_in_words(since.then)}\n\n{_table(('', '', 'then', 'now'), rows)}"


def _then_and_now(row: ChangeRow) -> tuple[str, ...]:
    return tuple(_plain(each[0]) if row.is_case else _names(each) for each in (row.then, row.now))


def _names(labels: Sequence[str]) -> str:
    """Return the first names, and the number of the others; a dash for none."""
    more = f" and {len(labels) - _MAX_NAMED} more" if len(labels) > _MAX_NAMED else ""
    return f"{', '.join(map(_cell, labels[:_MAX_NAMED]))}{more}" or "-"


def _figures(history: History) -> str:
    coverage = history.coverage
    rows = []
    for aspect in _ORDER:
        figure = coverage.figure_of(aspect)
        beside = " (not in SCBM-IAS)" if aspect is Aspect.QUEUED else ""
        bar = f"`{_bar(figure, min(figure.of, _SMALL_BAR_WIDTH))}`" if figure.of else ""
        rows.append(_row(f"{aspect.value}{beside}", f"{figure.visited} / {figure.of}", bar))
    return _table(("", "visited", ""), rows)


def _missing(missed: Sequence[Missed], file: str, folds: InstanceFolds) -> Iterator[str]:
    """Yield the missed obligations of each aspect, and the commands that cover them."""
    if not missed:
        return
    yield (
        f"### Missing\n\nHow to cover one of them: {_code(missed[0].command)}. "
        f"All of them: {_code(close_command(file))}.\n"
    )
    for aspect in _ORDER:
        group = [each for each in missed if each.obligation.aspect is aspect]
        if group:
            yield _missing_of(aspect, group, folds)


def _missing_of(aspect: Aspect, group: Sequence[Missed], folds: InstanceFolds) -> str:
    """Return the missed obligations of an aspect, grouped by reason; a long list is folded.

    Instances of an entry with parameters have one name where they share the reason: `move (8)`, or `move (5 of 8)`.
    """
    subjects: dict[str, list[str]] = {}
    for each in group:
        subjects.setdefault(each.reason, []).append(each.obligation.subject)
    is_automatic = aspect is Aspect.TAKEN
    named = {reason: folds.folded(names, is_automatic=is_automatic) for reason, names in subjects.items()}
    count = sum(map(len, named.values()))
    rows, left = [], _MAX_ROWS
    for reason, names in named.items():
        rows += [_row(", ".join(map(_cell, names[:left])), _plain(reason))] if left else []
        left -= min(left, len(names))
    table = _table(("", "why"), rows)
    more = count - _MAX_ROWS
    body = f"{table}\nand {more} more\n" if more > 0 else table
    title = f"{len(group)} {aspect.value}"
    if count < _FEWEST_HIDDEN:
        return f"**{title}**\n\n{body}"
    return f"<details><summary><b>{title}</b></summary>\n\n{body}\n</details>\n"


def _bar(figure: Figure, width: int) -> str:
    """Return a bar that is full only if all is visited, and empty only if nothing is."""
    filled = round(width * figure.visited / figure.of) if figure.of else 0
    if 0 < figure.visited < figure.of:
        filled = min(max(filled, 1), width - 1)
    return "█" * filled + "░" * (width - filled)


def _table(heads: tuple[str, ...], rows: Sequence[str]) -> str:
    return "".join((_row(*heads), _row(*("---" for _ in heads)), *rows))


def _row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |\n"


def _cell(text: str) -> str:
    """Return a name or a command as code for a cell of a table."""
    return _code(text).replace("|", "\\|")


def _code(text: str) -> str:
    """Return a text as code."""
    shown = _shown(text)
    ticks = "`" * (1 + max((len(found) for found in _BACKTICKS.findall(shown)), default=0))
    blank = " " if shown.startswith("`") or shown.endswith("`") else ""
    return f"{ticks}{blank}{shown or ' '}{blank}{ticks}"


def _plain(text: str) -> str:
    """Return a text with all markup and mentions such as `@name` escaped."""
    plain = _MARKUP.sub(r"\\\g<0>", escape(_shown(text), quote=False))
    return plain.replace("@", "@<!-- -->")


def _shown(text: str) -> str:
    """Return a text as one line of limited length."""
    line = escaped(_BLANKS.sub(" ", text)).strip()
    return line if len(line) <= _MAX_OF_A_TEXT else f"{line[:_MAX_OF_A_TEXT]}…"
