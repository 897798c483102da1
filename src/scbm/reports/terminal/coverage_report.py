"""The coverability report of the paper (Section VII) for the terminal, and the report of what was missed.

The report has the reason for each missed obligation, and the commands that cover it.
"""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from rich.text import Text

from scbm.cases.coverage import Aspect, Decision, InstanceFolds, Obligation
from scbm.closing.summaries import aspects_in_words
from scbm.model.visible_text import counted, shown_path
from scbm.reports.cover_advice import CampaignKind, CoverAdvisor, CoverMeans, in_few, joined_advice
from scbm.reports.figure_table import (
    COLUMNS,
    DEFAULT_COLUMNS,
    STATUS_MARKS,
    command_text,
    figures,
    hazard_lines,
    missed_table,
    requirement_lines,
    short_of_goal_in_words,
    verdict_lines,
    wrapped,
)
from scbm.reports.missed_reasons import close_command, missed_reasons
from scbm.reports.status_lines import asserted_line, figure_lines, unasserted_lines
from scbm.reports.terminal.failure_report import finding_lines, unused_lines
from scbm.reports.terminal.missed_listing import is_too_long, reason_lines
from scbm.running.simulation.excluded_values import EXCLUDED

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model import BehaviorModel
    from scbm.reports.cover_advice import CoverAdvice
    from scbm.reports.missed_reasons import Missed
    from scbm.store import History
    from scbm.testing import Answers, Campaign, CampaignResult


_CLOSES = "writes a case for each, or a proof that there is none"


def missing_lines(
    result: CampaignResult | History,
    file: str,
    kind: CampaignKind,
    columns: int = DEFAULT_COLUMNS,
    *,
    shows_all: bool = False,
) -> Iterator[Text]:
    """Yield the missed obligations with their reasons, and the commands that cover them.

    Args:
        result: what the cases of a campaign or of a store showed.
        file: the model file, for the commands.
        kind: the kind of the cases.
        columns: the width of the report.
        shows_all: whether a long listing is shown, instead of the reasons alone.
    """
    model = result.model
    missed = missed_reasons(result, file, kind)
    yield (
        Text("Missing in ")
        .append(model.name, style="bold")
        .append(f": {_count(missed)} of {result.coverage.figure.of}")
    )
    yield Text()
    yield from figure_lines(result, columns)
    if not missed:
        return
    listing = list(_listing(model, missed, columns))
    yield from reason_lines(model, missed, columns) if is_too_long(listing, shows_all=shows_all) else listing
    undecided = [each for each in missed if each.status is Decision.UNDECIDED]
    if not undecided:
        return
    yield Text()
    yield Text("How to cover the rest", style="bold")
    yield command_text("  ", close_command(file), _CLOSES)
    yield command_text("  ", undecided[0].command, "explains one of them")
    yield command_text("  ", f"scbm test {shown_path(file)} closed", "runs these cases")


def _listing(model: BehaviorModel, missed: Sequence[Missed], columns: int) -> Iterator[Text]:
    """Yield the missed obligations, those of one operation, transition, or entry with parameters together."""
    folds = InstanceFolds.of(model)
    order = {name: index for index, name in enumerate(dict.fromkeys(m.obligation.subject for m in missed))}
    by_subject = sorted(missed, key=lambda m: (m.obligation.aspect is Aspect.TAKEN, order[m.obligation.subject]))
    for (entry, is_lifted, _), group in groupby(by_subject, key=lambda m: _entry_of(m.obligation, folds)):
        yield Text()
        if is_lifted:
            yield from _of_entry(entry, list(group), folds, columns)
        else:
            yield from _of_subject(list(group))


def _count(missed: Sequence[Missed]) -> str:
    counting = sum(m.obligation.counts for m in missed)
    beside = len(missed) - counting
    parts = counted(counting, "obligation")
    return f"{parts}, and {beside} queued," if beside else parts


def _of_subject(missed: Sequence[Missed]) -> Iterator[Text]:
    """Yield the missed aspects of an operation or an automatic transition, one line for each reason."""
    first = missed[0].obligation
    yield Text("  at: " if first.aspect is Aspect.TAKEN else "  op: ").append(first.subject, style="bold")
    reasons = dict.fromkeys((m.status, m.reason) for m in missed)
    parts = {r: ", ".join(m.obligation.aspect.value for m in missed if (m.status, m.reason) == r) for r in reasons}
    width = max(map(len, parts.values()))
    for (status, reason), aspects in parts.items():
        style = "red" if status is Decision.UNDECIDED else "dim"
        yield Text(f"      {STATUS_MARKS[status]} {aspects:<{width}}  ", style=style).append(reason, style="not red")


def _entry_of(obligation: Obligation, folds: InstanceFolds) -> tuple[str, bool, bool]:
    """Return the entry of the model file that an obligation comes from, whether it has parameters, and its kind."""
    entry = folds.entry_of(obligation)
    return entry or obligation.subject, entry is not None, obligation.aspect is Aspect.TAKEN


def _of_entry(entry: str, missed: Sequence[Missed], folds: InstanceFolds, columns: int) -> Iterator[Text]:
    """Yield the missed aspects of an entry with parameters; below each reason its instances, if it is not that of all.

    Instances that miss the same aspects for the same reason share a line.
    """
    is_automatic = missed[0].obligation.aspect is Aspect.TAKEN
    count = folds.count(entry, is_automatic=is_automatic)
    yield Text("  at: " if is_automatic else "  op: ").append(entry, style="bold").append(f" ({count})")
    reasons: dict[tuple[str, Decision, str], list[Aspect]] = {}
    for each in missed:
        reasons.setdefault((each.obligation.subject, each.status, each.reason), []).append(each.obligation.aspect)
    alike: dict[tuple[str, Decision, str], list[str]] = {}
    for (subject, status, reason), aspects in reasons.items():
        alike.setdefault((aspects_in_words(aspects), status, reason), []).append(subject)
    width = max(len(aspects) for aspects, _, _ in alike)
    for (names, status, reason), subjects in alike.items():
        style = "red" if status is Decision.UNDECIDED else "dim"
        yield Text(f"      {STATUS_MARKS[status]} {names:<{width}}  ", style=style).append(reason, style="not red")
        if len(subjects) < count:
            yield from (Text(line, style="dim") for line in wrapped(", ".join(subjects), columns, " " * 10, 12))


_REAL = "Real resources"
_ADVICE_INDENT = 17


def coverage_report(
    result: CampaignResult, columns: int = DEFAULT_COLUMNS, *, shows_all: bool = False
) -> Iterator[Text]:
    """Yield the report of a campaign; `shows_all` shows a long table of what is missing, not the reasons alone."""
    campaign, coverage = result.campaign, result.coverage
    yield from _unreached(result, columns)
    yield Text("Coverability report: ", style="bold").append(campaign.model.name)
    yield Text()
    yield from figure_lines(result, columns)
    if result.evidence is not None:
        yield from asserted_line(result.evidence, columns)
    duration = f"{campaign.simulated_ns / 1e9:.2f} s {result.where or 'simulated'}"
    yield Text(f"  Testing duration: {duration}, {_cases(result)}")
    yield from verdict_lines(campaign.count, campaign.failed_count)
    yield from _short_of_goal(campaign)
    yield from _early(result)
    yield from _forecast(result)
    shown = result.requirements if result.store is not None else [r for r in result.requirements if r.is_notable]
    yield from requirement_lines(shown, columns)
    yield Text()
    yield from figures(coverage, columns)
    yield from _driver_lines(result, columns)
    yield from finding_lines(campaign, result.findings, result.commands)
    yield from _hazards(campaign, columns)
    yield from unused_lines(campaign)
    table = list(missed_table(campaign.model, result.statuses, columns))
    is_short = is_too_long(table, shows_all=shows_all)
    if is_short:
        missed = missed_reasons(result, str(result.suite.file), CampaignKind.of_campaign(result))
        yield from reason_lines(campaign.model, missed, columns)
    else:
        yield from table
    if result.evidence is not None:
        yield from unasserted_lines(result.evidence, columns, result.mutate_command)
    yield from _reasons(result, columns, has_reasons=is_short)


def _unreached(result: CampaignResult, columns: int) -> Iterator[Text]:
    """Yield that no random case reached its goal, whatever excuses them, and the command that shows the first one."""
    count = result.campaign.drawn
    if not count or result.random_reached:
        return
    cases = f"None of {count} random cases reached its" if count > 1 else "The random case did not reach its"
    words = f"{cases} goal: nothing behind that point is tested"
    yield from (Text(line, style="bold red") for line in wrapped(words, columns, "", 2))
    if not result.where:
        first = next(result.suite.drawn_names)
        yield command_text("  see why: ", result.suite.again(first) or "")
    yield Text()


def _short_of_goal(campaign: Campaign) -> Iterator[Text]:
    """Yield how many cases passed although they missed a goal, and why; nothing if there are none."""
    words = short_of_goal_in_words(campaign.summary.short_count, dict(campaign.summary.short))
    if words:
        yield Text(f"  Passed short of the goal: {words}")


def missing_report(
    result: CampaignResult, columns: int = DEFAULT_COLUMNS, *, shows_all: bool = False
) -> Iterator[Text]:
    """Yield the failures, the missed obligations and their reasons; `shows_all` lists each of many obligations."""
    kind = CampaignKind.of_campaign(result)
    yield from _unreached(result, columns)
    yield from missing_lines(result, str(result.suite.file), kind, columns, shows_all=shows_all)
    yield from _early(result)
    yield from _driver_lines(result, columns)
    yield from finding_lines(result.campaign, result.findings, result.commands)
    yield from _hazards(result.campaign, columns)


def _hazards(campaign: Campaign, columns: int) -> Iterator[Text]:
    """Yield the hazards at devices; nothing if there are none."""
    summary = campaign.summary
    named = [(campaign.source.name(position), hazard) for position, hazard in summary.hazards]
    yield from hazard_lines(named, summary.hazard_count, columns)


def _forecast(result: CampaignResult) -> Iterator[Text]:
    """Yield what more random cases would visit, where that can be estimated and is not everything already."""
    campaign = result.campaign
    if result.dry is not None:
        yield Text(f"  {_dry_words(result)}")
    found = None if result.where or result.groups else campaign.forecast
    figure = campaign.coverage.figure
    if found is not None and not figure.is_complete:
        more = found.visited - figure.visited
        yield Text(f"  Forecast: {found.cases} cases would visit {more:.1f} ± {found.error:.1f} obligations more")


def _dry_words(result: CampaignResult) -> str:
    """Return whether the last random cases visited something new."""
    summary = result.campaign.summary
    drawn = counted(result.campaign.drawn, "random case")
    if result.is_dry:
        return f"Dry: the last {result.dry} of {drawn} visited nothing new"
    return f"Not dry: {drawn} ran, and {summary.last - max(summary.last_new, summary.written)} after the last new visit"


def _early(result: CampaignResult) -> Iterator[Text]:
    if result.ended_early:
        yield Text(f"  {result.ended_early}", style="bold yellow")


def _driver_lines(result: CampaignResult, columns: int) -> Iterator[Text]:
    """Yield what real resources did: how they answered, and what they sent that the model excludes."""
    yield from _answer_lines(result.answers)
    if result.excluded:
        yield Text()
        yield Text(f"{EXCLUDED[0].upper()}{EXCLUDED[1:]}", style="bold red")
    for each in result.excluded:
        words = f"{counted(each.count, 'value')} in {counted(each.cases, 'case')}; the first in {each.first_case}:"
        yield Text(f"  {each.variable}: {words}")
        yield from map(Text, wrapped(str(each.first), columns, " " * 4, 6))


def _answer_lines(answers: Sequence[Answers]) -> Iterator[Text]:
    """Yield the numbers of requests to real resources by their outcome; nothing if all are simulated."""
    if not answers:
        return
    width = max(len(_REAL), *(len(of_one.resource) + 2 for of_one in answers))
    yield Text()
    yield Text(f"{_REAL:<{width}}      sent  succeeded  failed  timed out  given up", style="bold")
    for of_one in answers:
        counts = f"{of_one.sent:>10}{of_one.succeeded:>11}{of_one.failed:>8}{of_one.timed_out:>11}{of_one.given_up:>10}"
        yield Text(f"{'  ' + of_one.resource:<{width}}{counts}", style="bold red" if of_one.is_silent else "")
        goals = [f"{count} {fate.replace('_', ' ')}" for fate, count in of_one.goals.items()]
        if goals:
            yield Text(f"    goals: {', '.join(goals)}")


def _cases(result: CampaignResult) -> str:
    parts = ", ".join(f"{count} {end}" for end, count in result.campaign.summary.ends)
    *others, last = result.groups or _groups(result)
    groups = f"{', '.join(others)} and {last}" if others else last
    return f"{groups}{': ' + parts if parts else ''}"


def _groups(result: CampaignResult) -> Iterator[str]:
    drawn = result.campaign.drawn
    written = result.campaign.count - drawn
    if written:
        yield counted(written, "written case")
    if drawn or not written:
        yield f"{counted(drawn, 'random case')} of seed {result.suite.seed}"


def _reasons(result: CampaignResult, columns: int, *, has_reasons: bool) -> Iterator[Text]:
    """Yield why each kind of obligation is missed and what would cover it, and the commands that run more cases.

    Where the reasons are above, the commands alone are shown.
    """
    parts, suite = _advice(result), result.suite
    if not parts:
        return
    yield Text()
    yield Text("How to cover the rest", style="bold")
    folds = InstanceFolds.of(result.campaign.model)
    for (aspect, _), advice in [] if has_reasons else parts.items():
        names = folds.folded([name for name, _ in advice], is_automatic=aspect is Aspect.TAKEN)
        words = _joined_advice(names, [each for _, each in advice], columns - _ADVICE_INDENT)
        first, *others = wrapped(words, columns, f"  {len(advice):>3} {aspect.value:<10} ", _ADVICE_INDENT)
        yield Text(first[:_ADVICE_INDENT]).append(first[_ADVICE_INDENT:], style="dim")
        yield from (Text(line, style="dim") for line in others)
    if has_reasons:
        yield command_text(
            "  ", close_command(str(suite.file)), "writes a case for each, or a proof that there is none"
        )
    means_found = dict.fromkeys(means for _, means in parts)
    words = f" {shown_path(str(suite.file))}{suite.arguments} --cases"
    drawing = f" --seed {suite.seed}{suite.network_option}{suite.planner_option}"
    if CoverMeans.CHANCE in means_found:
        yield command_text(
            "  ", f"{result.verb}{words} {4 * max(result.campaign.count, 5)}{drawing}{result.node_options}"
        )
    if CoverMeans.NOT_MOVED in means_found:
        yield command_text("  ", f"scbm test{words} {max(result.campaign.drawn, 20)}{drawing} --inputs drawn")


def _advice(result: CampaignResult) -> dict[tuple[Aspect, CoverMeans], list[tuple[str, CoverAdvice]]]:
    """Return the advice for the missed obligations of each aspect and means, with the names of their entries."""
    campaign = result.campaign
    advisor = CoverAdvisor(campaign.model, campaign.coverage, CampaignKind.of_campaign(result))
    found: dict[tuple[Aspect, CoverMeans], list[tuple[str, CoverAdvice]]] = {}
    for aspect in (*COLUMNS, Aspect.TAKEN):
        for missed in campaign.coverage.missed(aspect):
            is_open = result.decided is None or result.decided.decision(missed) is Decision.UNDECIDED
            if is_open and advisor.is_due(missed):
                advice = advisor.advice(missed)
                found.setdefault((aspect, advice.means), []).append((missed.subject, advice))
    return found


def _joined_advice(names: Sequence[str], advice: Sequence[CoverAdvice], width: int) -> str:
    """Return one clause for all obligations that lack the same means, with their names if it is about them alone."""
    joined = joined_advice(advice)
    if not joined.is_named:
        return joined.words
    words = joined.about_one if len(advice) == 1 else joined.words
    return f"{in_few(names)}: {words}" if max(map(len, names)) < width else words
