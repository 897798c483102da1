"""The coverability report of the paper (Section VII) for the terminal, and beneath it what was missed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rich.text import Text

from scbm.cases.coverage import Aspect, Obligation
from scbm.model import Outcome
from scbm.reports.figure_table import (
    COLUMNS,
    DEFAULT_COLUMNS,
    command_text,
    counted,
    figures,
    headline,
    missed_table,
    shown_path,
    wrapped,
)
from scbm.reports.terminal.findings_report import told_findings, told_unused
from scbm.reports.terminal.missing_report import told_missing

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases.coverage import Coverage
    from scbm.testing import Answers, Campaign, Finding

_REAL = "Real resources"
_FEW_CASES = 20
"""Fewer random cases than this say little about the goals and initial states of a model."""

_UNPLANNED = "no plan needs them: add a goal or an initial state that does"
_UNDISTURBED = "no case disabled them while next in a plan: add an injection"
_UNFAILING = "no request fails: force it under `outcomes` of a case, or give it a share in those of the model"
_ANSWERED = "every request is answered: force `timeout` under `outcomes` of a case, or let `--network` lose messages"
_TIMELESS = "they have no `deadline`, so they never time out"
_GUARDED = "their guards never held: see above what they wait for"
_BY_CHANCE = "perhaps by chance: run more cases"
_ADVICE_INDENT = 17


@dataclass(frozen=True, slots=True)
class Setting:
    """What a report shows beside the results.

    Attributes:
        file: the model file, for the commands that are suggested.
        seed: what random cases are drawn from.
        random: how many of the cases were drawn.
        options: further options that draw such cases, each with a blank before it.
        findings: what failed, and why.
        commands: for each finding the command that shows it again.
        groups: how many cases of each sort there are, in words; if empty, written ones and random ones.
        loses_messages: whether the network of the random cases may have done so.
        where: where the cases were run, in words; in simulation, if it is empty.
        answers: how each real resource answered.
        ended_early: how far the campaign came if something ended it before its last case, in words.
        columns: the width of the report.
    """

    file: str
    seed: int = 0
    random: int = 0
    options: str = ""
    findings: tuple[Finding, ...] = ()
    commands: tuple[str, ...] = ()
    groups: tuple[str, ...] = ()
    loses_messages: bool = False
    where: str = ""
    answers: tuple[Answers, ...] = ()
    ended_early: str = ""
    columns: int = DEFAULT_COLUMNS


def coverage_report(campaign: Campaign, setting: Setting) -> Iterator[Text]:
    """The report of a campaign, line by line."""
    coverage = campaign.coverage
    yield Text("Coverability report: ", style="bold").append(campaign.model.name)
    yield Text()
    yield headline(coverage.figure, setting.columns)
    duration = f"{campaign.simulated_ns / 1e9:.2f} s {setting.where or 'simulated'}"
    yield Text(f"  Testing duration: {duration}, {_cases(campaign, setting)}")
    yield from _early(setting)
    yield Text()
    yield from figures(coverage, setting.columns)
    yield from _told_answers(setting.answers)
    yield from told_findings(campaign, setting.findings, setting.commands)
    yield from told_unused(campaign)
    yield from missed_table(campaign.model, coverage, setting.columns)
    yield from _reasons(campaign, setting)


def missing_report(campaign: Campaign, setting: Setting) -> Iterator[Text]:
    """Only what failed, what is missing, and why."""
    yield from told_missing(campaign.model, campaign.coverage, setting.file, setting.columns)
    yield from _early(setting)
    yield from _told_answers(setting.answers)
    yield from told_findings(campaign, setting.findings, setting.commands)


def _early(setting: Setting) -> Iterator[Text]:
    if setting.ended_early:
        yield Text(f"  {setting.ended_early}", style="bold yellow")


def _told_answers(answers: Sequence[Answers]) -> Iterator[Text]:
    """Yield the numbers of requests to real resources by their outcome; nothing if all are simulated."""
    if not answers:
        return
    width = max(len(_REAL), *(len(of_one.resource) + 2 for of_one in answers))
    yield Text()
    yield Text(f"{_REAL:<{width}}      sent  succeeded  failed  timed out  given up", style="bold")
    for of_one in answers:
        counts = f"{of_one.sent:>10}{of_one.succeeded:>11}{of_one.failed:>8}{of_one.timed_out:>11}{of_one.given_up:>10}"
        yield Text(f"{'  ' + of_one.resource:<{width}}{counts}", style="bold red" if of_one.is_silent else "")


def _cases(campaign: Campaign, setting: Setting) -> str:
    ends: dict[str, int] = {}
    for result in campaign.results:
        end = result.verdict.end.replace("_", " ")
        ends[end] = ends.get(end, 0) + 1
    told = ", ".join(f"{count} {end}" for end, count in ends.items())
    *others, last = setting.groups or _groups(campaign, setting)
    groups = f"{', '.join(others)} and {last}" if others else last
    failed = f"; {len(campaign.failed)} failed" if campaign.failed else ""
    return f"{groups}{': ' + told if told else ''}{failed}"


def _groups(campaign: Campaign, setting: Setting) -> Iterator[str]:
    written = len(campaign.results) - setting.random
    if written:
        yield counted(written, "written case")
    if setting.random or not written:
        yield f"{counted(setting.random, 'random case')} of seed {setting.seed}"


def _reasons(campaign: Campaign, setting: Setting) -> Iterator[Text]:
    """Yield why each kind of obligation is missed and what would cover it, and the command that runs more cases."""
    told = [(aspect, *each) for aspect in (*COLUMNS, Aspect.TAKEN) for each in _advice(aspect, campaign, setting)]
    if not told:
        return
    yield Text()
    yield Text("How to cover the rest", style="bold")
    for aspect, count, advice in told:
        first, *others = wrapped(advice, setting.columns, f"  {count:>3} {aspect.value:<10} ", _ADVICE_INDENT)
        yield Text(first[:_ADVICE_INDENT]).append(first[_ADVICE_INDENT:], style="dim")
        yield from (Text(line, style="dim") for line in others)
    if any(advice == _BY_CHANCE for _, _, advice in told):
        more = 4 * max(len(campaign.results), 5)
        command = f"scbm test {shown_path(setting.file)} --cases {more} --seed {setting.seed}{setting.options}"
        yield command_text("  ", command)


def _advice(aspect: Aspect, campaign: Campaign, setting: Setting) -> Iterator[tuple[int, str]]:
    """Yield for the missed obligations of an aspect how many of them need what."""
    coverage = campaign.coverage
    missed = coverage.missed(aspect)
    planned = [obligation for obligation in missed if not _is_unqueued(obligation, coverage)]
    timeless = [
        o for o in missed if aspect is Aspect.TIMEDOUT and campaign.model.operation(o.subject).deadline_ns is None
    ]
    timed = [obligation for obligation in planned if obligation not in timeless]
    if timeless:
        yield len(timeless), _TIMELESS
    if aspect is Aspect.QUEUED:
        is_few = 0 < setting.random < _FEW_CASES
        advice = [(len(missed), _BY_CHANCE if is_few else _UNPLANNED)]
    elif aspect is Aspect.DISABLED:
        advice = [(len(missed), _UNDISTURBED)]
    elif aspect is Aspect.TIMEDOUT and not (_may(campaign, Outcome.TIMEOUT) or setting.loses_messages):
        advice = [(len(missed) - len(timeless), _ANSWERED)]
    elif aspect is Aspect.FAILED and not _may(campaign, Outcome.FAIL):
        advice = [(len(missed), _UNFAILING)]
    else:
        advice = [(len(timed), _GUARDED if aspect is Aspect.TAKEN else _BY_CHANCE)]
    yield from ((count, words) for count, words in advice if count)


def _is_unqueued(obligation: Obligation, coverage: Coverage) -> bool:
    return Obligation(obligation.subject, Aspect.QUEUED) in coverage.missed(Aspect.QUEUED)


def _may(campaign: Campaign, outcome: Outcome) -> bool:
    """Return whether some simulated resource may react so."""
    outcomes = [pair for resource in campaign.model.resources for pair in resource.simulation.outcomes]
    return any(possible is outcome and probability for possible, probability in outcomes)
