"""The coverability report of the paper (Section VII) for the terminal, and beneath it what was missed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from scbm.cli.output import counted
from scbm.coverage import STATE_ASPECTS, Aspect, Obligation
from scbm.model import Outcome

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.cli.output import Output
    from scbm.coverage import Coverage, Figure
    from scbm.testing import Campaign, CaseResult

_BAR_WIDTH = 50
_COLUMNS = (Aspect.QUEUED, *STATE_ASPECTS)
_MOST_FAILED = 10
"""So many failed cases are shown; the rest is counted."""


def draw_report(campaign: Campaign, file: str, out: Output) -> None:
    """Draws the report of a campaign. `file` is the model file, for the commands that are suggested."""
    coverage = campaign.coverage
    out.line(Text("Coverability report: ", style="bold").append(campaign.model.name))
    out.line()
    out.line(_headline(coverage.figure))
    out.line(f"  Testing duration: {campaign.simulated_ns / 1e9:.2f} s simulated, {_cases(campaign)}")
    out.line()
    for line in _figures(coverage):
        out.line(line)
    for line in (*_failures(campaign, file), *_missed(campaign), *_reasons(campaign, file)):
        out.line(line)


def _headline(figure: Figure) -> Text:
    line = Text("  SCBM-IAS: ").append(str(figure), style="bold")
    return line if figure.percent is None else line.append("  ").append_text(_bar(figure, _BAR_WIDTH))


def _bar(figure: Figure, width: int) -> Text:
    """Never full before all is visited, never empty when something is."""
    if not figure.of:
        return Text()
    filled = round(width * figure.visited / figure.of)
    if 0 < figure.visited < figure.of:
        filled = min(max(filled, 1), width - 1)
    return Text("█" * filled, style="green").append("░" * (width - filled), style="red")


def _cases(campaign: Campaign) -> str:
    ends: dict[str, int] = {}
    for result in campaign.results:
        end = result.verdict.end.replace("_", " ")
        ends[end] = ends.get(end, 0) + 1
    told = ", ".join(f"{count} {end}" for end, count in ends.items())
    random = counted(len(campaign.results), "random case")
    failed = f"; {len(campaign.failed)} failed" if campaign.failed else ""
    return f"{random} of seed {campaign.seed}{': ' + told if told else ''}{failed}"


def _figures(coverage: Coverage) -> Iterator[Text]:
    for aspect in STATE_ASPECTS:
        yield _row(f"Visited {aspect} state", coverage.figure_of(aspect))
    yield _row("Automatic transitions taken", coverage.figure_of(Aspect.TAKEN))
    yield _row("Queued in a plan", coverage.figure_of(Aspect.QUEUED)).append("  (beside the figure)", style="dim")


def _row(label: str, figure: Figure) -> Text:
    line = Text(f"  {label + ':':<29}{figure.visited:>4} / {figure.of:<4}")
    line.append_text(_bar(figure, min(figure.of, _BAR_WIDTH)))
    line.rstrip()
    return line


def _failures(campaign: Campaign, file: str) -> Iterator[Text]:
    failed = campaign.failed
    if not failed:
        return
    yield Text()
    yield Text(f"Failed: {counted(len(failed), 'case')}", style="bold red")
    for result in failed[:_MOST_FAILED]:
        yield Text(f"  {result.case.name}, goal {result.case.goal}")
        for failure in result.verdict.failures:
            yield Text(f"    {failure}")
        yield Text("    again: ").append(_reproduction(result, file), style="cyan")
    if len(failed) > _MOST_FAILED:
        yield Text(f"  and {len(failed) - _MOST_FAILED} more")


def _reproduction(result: CaseResult, file: str) -> str:
    origin = result.case.origin
    return "" if origin is None else f"scbm run {file} --seed {origin.seed} --case {origin.number}"


def _missed(campaign: Campaign) -> Iterator[Text]:
    """A row for each operation that misses something, and the automatic transitions that were not taken."""
    coverage = campaign.coverage
    missed = frozenset((*coverage.missed(), *coverage.missed(Aspect.QUEUED)))
    if not missed:
        return
    rows = [o.name for o in campaign.model.operations if any(Obligation(o.name, a) in missed for a in _COLUMNS)]
    transitions = [t for t in campaign.model.automatic_transitions if Obligation(t.name, Aspect.TAKEN) in missed]
    width = max(len(name) for name in (*rows, *(transition.name for transition in transitions)))
    yield Text()
    heads = "".join(f"{aspect.value:^10}" for aspect in _COLUMNS).rstrip() if rows else ""
    yield Text(f"{'Missed (○)':<{width + 6}}", style="bold").append(heads)
    for name in rows:
        yield _marks(name, width, missed)
    for transition in transitions:
        line = Text(f"  at: {transition.name:<{width}}").append("    ○     ", style="red")
        yield line.append(f"waits for {transition.running_guard}")


def _marks(name: str, width: int, missed: frozenset[Obligation]) -> Text:
    row = Text(f"  op: {name:<{width}}")
    for aspect in _COLUMNS:
        is_missed = Obligation(name, aspect) in missed
        row.append(f"{'○' if is_missed else '●':^10}", style="red" if is_missed else "dim green")
    row.rstrip()
    return row


def _reasons(campaign: Campaign, file: str) -> Iterator[Text]:
    """Why each kind of obligation is missed, and the command or the change that closes it."""
    told = [line for aspect in (*_COLUMNS, Aspect.TAKEN) for line in _reason(aspect, campaign, file)]
    if told:
        yield Text()
        yield Text("What closes it", style="bold")
        yield from told


def _reason(aspect: Aspect, campaign: Campaign, file: str) -> Iterator[Text]:
    coverage = campaign.coverage
    missed = coverage.missed(aspect)
    by_chance = [obligation for obligation in missed if not _is_unqueued(obligation, coverage)]
    more = 4 * max(len(campaign.results), 5)
    if missed and aspect is Aspect.QUEUED:
        yield _advice(aspect, len(missed), "in no plan: another goal, or another initial state, has to need them")
    elif missed and aspect is Aspect.DISABLED:
        yield _advice(aspect, len(missed), "in these runs nothing came between a plan and its next operation")
    elif missed and aspect is Aspect.TIMEDOUT and not _may(campaign, Outcome.TIMEOUT):
        yield from _never_late(missed, campaign)
    elif missed and aspect is Aspect.FAILED and not _may(campaign, Outcome.FAIL):
        yield _advice(aspect, len(missed), "no request fails: give `fail` a share in `outcomes`")
    elif by_chance and aspect is Aspect.TAKEN:
        yield _advice(aspect, len(by_chance), "their guards did not hold in these runs: see above what they wait for")
    elif by_chance:
        advice = f"perhaps by chance: scbm test {file} --cases {more} --seed {campaign.seed}"
        yield _advice(aspect, len(by_chance), advice)


def _is_unqueued(obligation: Obligation, coverage: Coverage) -> bool:
    return Obligation(obligation.subject, Aspect.QUEUED) in coverage.missed(Aspect.QUEUED)


def _never_late(missed: tuple[Obligation, ...], campaign: Campaign) -> Iterator[Text]:
    """Why operations do not time out where every request is answered."""
    timeless = [o for o in missed if campaign.model.operation(o.subject).deadline_ns is None]
    if timeless:
        yield _advice(Aspect.TIMEDOUT, len(timeless), "these have no `deadline`, so they never time out")
    if len(timeless) < len(missed):
        advice = "all requests are answered: give `timeout` a share in `outcomes`"
        yield _advice(Aspect.TIMEDOUT, len(missed) - len(timeless), advice)


def _may(campaign: Campaign, outcome: Outcome) -> bool:
    """Whether some simulated resource may react so."""
    outcomes = [pair for resource in campaign.model.resources for pair in resource.simulation.outcomes]
    return any(possible is outcome and probability for possible, probability in outcomes)


def _advice(aspect: Aspect, count: int, advice: str) -> Text:
    return Text(f"  {count:>3} {aspect.value:<10} ").append(advice, style="dim")
