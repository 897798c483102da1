"""The coverability report of the paper (Section VII) for the terminal, and beneath it what was missed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rich.text import Text

from scbm.cases.coverage import Aspect, Obligation
from scbm.model import Outcome
from scbm.reports.figure_table import COLUMNS, counted, figures, headline, missed_table
from scbm.reports.terminal.findings_report import told_findings, told_unused
from scbm.reports.terminal.missing_report import told_missing

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases.coverage import Coverage
    from scbm.testing import Answers, Campaign, Finding

_REAL = "Real resources"
_UNDISTURBED = "nothing came between a plan and its next operation: an injection of a case can"
_UNFAILING = "no request fails: a case can force it under `outcomes`, and so can a share in the model's"
_ANSWERED = "every request is answered: a case can force `timeout` under `outcomes`, or `--network` lose messages"


@dataclass(frozen=True, slots=True)
class Setting:
    """What a report tells beside the results.

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


def coverage_report(campaign: Campaign, setting: Setting) -> Iterator[Text]:
    """The report of a campaign, line by line."""
    coverage = campaign.coverage
    yield Text("Coverability report: ", style="bold").append(campaign.model.name)
    yield Text()
    yield headline(coverage.figure)
    duration = f"{campaign.simulated_ns / 1e9:.2f} s {setting.where or 'simulated'}"
    yield Text(f"  Testing duration: {duration}, {_cases(campaign, setting)}")
    yield from _early(setting)
    yield Text()
    yield from figures(coverage)
    yield from _told_answers(setting.answers)
    yield from told_findings(campaign, setting.findings, setting.commands)
    yield from told_unused(campaign)
    yield from missed_table(campaign.model, coverage)
    yield from _reasons(campaign, setting)


def missing_report(campaign: Campaign, setting: Setting) -> Iterator[Text]:
    """Only what failed, what is missing, and why."""
    yield from told_missing(campaign.model, campaign.coverage, setting.file)
    yield from _early(setting)
    yield from _told_answers(setting.answers)
    yield from told_findings(campaign, setting.findings, setting.commands)


def _early(setting: Setting) -> Iterator[Text]:
    if setting.ended_early:
        yield Text(f"  {setting.ended_early}", style="bold yellow")


def _told_answers(answers: Sequence[Answers]) -> Iterator[Text]:
    """What real resources were asked, and what came of it; nothing if all are simulated."""
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
    """Why each kind of obligation is missed, and the command or the change that closes it."""
    told = [line for aspect in (*COLUMNS, Aspect.TAKEN) for line in _reason(aspect, campaign, setting)]
    if told:
        yield Text()
        yield Text("What closes it", style="bold")
        yield from told


def _reason(aspect: Aspect, campaign: Campaign, setting: Setting) -> Iterator[Text]:
    coverage = campaign.coverage
    missed = coverage.missed(aspect)
    by_chance = [obligation for obligation in missed if not _is_unqueued(obligation, coverage)]
    more = 4 * max(len(campaign.results), 5)
    if missed and aspect is Aspect.QUEUED:
        yield _advice(aspect, len(missed), "in no plan: another goal, or another initial state, has to need them")
    elif missed and aspect is Aspect.DISABLED:
        yield _advice(aspect, len(missed), _UNDISTURBED)
    elif missed and aspect is Aspect.TIMEDOUT and not (_may(campaign, Outcome.TIMEOUT) or setting.loses_messages):
        yield from _never_late(missed, campaign)
    elif missed and aspect is Aspect.FAILED and not _may(campaign, Outcome.FAIL):
        yield _advice(aspect, len(missed), _UNFAILING)
    elif by_chance and aspect is Aspect.TAKEN:
        yield _advice(aspect, len(by_chance), "their guards did not hold in these runs: see above what they wait for")
    elif by_chance:
        command = f"scbm test {setting.file} --cases {more} --seed {setting.seed}{setting.options}"
        advice = f"perhaps by chance: {command}"
        yield _advice(aspect, len(by_chance), advice)


def _is_unqueued(obligation: Obligation, coverage: Coverage) -> bool:
    return Obligation(obligation.subject, Aspect.QUEUED) in coverage.missed(Aspect.QUEUED)


def _never_late(missed: tuple[Obligation, ...], campaign: Campaign) -> Iterator[Text]:
    """Why operations do not time out where every request is answered."""
    timeless = [o for o in missed if campaign.model.operation(o.subject).deadline_ns is None]
    if timeless:
        yield _advice(Aspect.TIMEDOUT, len(timeless), "these have no `deadline`, so they never time out")
    if len(timeless) < len(missed):
        yield _advice(Aspect.TIMEDOUT, len(missed) - len(timeless), _ANSWERED)


def _may(campaign: Campaign, outcome: Outcome) -> bool:
    """Whether some simulated resource may react so."""
    outcomes = [pair for resource in campaign.model.resources for pair in resource.simulation.outcomes]
    return any(possible is outcome and probability for possible, probability in outcomes)


def _advice(aspect: Aspect, count: int, advice: str) -> Text:
    return Text(f"  {count:>3} {aspect.value:<10} ").append(advice, style="dim")
