"""Explanations of obligations for the terminal: how one is covered, or why it is not."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace
from rich.text import Text

from scbm.cases.coverage import FORCED_NOTE, Aspect, InstanceFolds
from scbm.cases.coverage.assumptions import assumptions
from scbm.cases.trace import PlanReceived
from scbm.closing import Decision
from scbm.closing.decisions import SuggestionKind
from scbm.closing.summaries import in_few_words, plan_in_words, reason_about_it
from scbm.model import PlanSet, format_moment, format_value
from scbm.model.requirements import BUILT_IN_NAMES, OPTIONAL_NAMES
from scbm.model.visible_text import counted
from scbm.proofcheck import SetsArgument, StructureArgument, ValuesArgument
from scbm.reports.figure_table import DEFAULT_COLUMNS, command_text, wrapped
from scbm.reports.run.event_lines import event_lines
from scbm.reports.terminal.closing_report import ended_lines, status_words
from scbm.reports.terminal.timeline import draw_line

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from scbm.cases import Case
    from scbm.cases.coverage import Obligation
    from scbm.closing import Suggestion
    from scbm.closing.decisions import DecidedRequirement, StageEnd
    from scbm.closing.explanations import Explanation, SearchedRuns, Visit
    from scbm.model import BehaviorModel, Requirement
    from scbm.reports.run.event_lines import EventLine
    from scbm.testing import Execution

_LINES = 8
"""Maximum number of log lines that are shown before and with a visit; the last line is the visit."""

_ARROW = " → "

_MAX_LISTED = 6
"""Maximum number of faults, and of changes from outside, that are shown before a visit: the last ones."""

_FOLLOWS_FROM = {
    StructureArgument.kind: "the model file",
    ValuesArgument.kind: "the values that transitions and replies can give the variables",
    SetsArgument.kind: "a set of all situations that runs can be in, whichever plans are chosen",
    f"{SetsArgument.kind}-{PlanSet.CANONICAL}": "a set of all situations that runs with canonical plans can be in",
}
_STYLES = {
    Decision.COVERED: "bold green",
    Decision.UNCOVERABLE: "bold",
    Decision.EXCLUDED: "bold",
    Decision.WAIVED: "bold",
    Decision.UNDECIDED: "bold red",
}


class ExplainedRequirement(Struct, frozen=True):
    """A requirement that is to be explained.

    Attributes:
        name: its name.
        requirement: that of the model; `None` for a built-in one.
    """

    name: str
    requirement: Requirement | None

    def is_about(self, decided: DecidedRequirement) -> bool:
        """Return whether a decision is about it."""
        return decided.name == self.name and decided.is_built_in == (self.requirement is None)

    def assumes(self, sentence: str) -> bool:
        """Return whether its answer has an assumption: those of one built-in requirement begin with its name."""
        name = sentence.partition(":")[0]
        return name not in BUILT_IN_NAMES or (name == self.name and self.requirement is None)


def requirement_explanation(
    asked: ExplainedRequirement, decided: DecidedRequirement, miss: str, assumed: Sequence[str], columns: int
) -> Iterator[Text]:
    """Yield what closing says of a requirement.

    Args:
        asked: the requirement.
        decided: the decision.
        miss: how near runs come to violating it, as a clause; empty if that is not known.
        assumed: what the answer assumes.
        columns: the width of the report.
    """
    says = (
        (BUILT_IN_NAMES | OPTIONAL_NAMES)[asked.name] if asked.requirement is None else str(asked.requirement.sentence)
    )
    yield Text(asked.name, style="bold").append(f": {says}", "not bold")
    others = decided.other_plans
    parts = [status_words(decided), *([f"{decided.reason}"] if decided.case else []), *([miss] if miss else [])]
    if others is not None:
        parts.append(others.reason if others.case else f"not decided with other plans: {others.reason}")
    parts += [f"certificate: {decided.certificate}"] if decided.certificate else []
    for part in parts:
        yield from (Text(line) for line in wrapped(part, columns, "  ", 4))
    if decided.option is not None:
        yield Text(f"  {decided.option} raises this limit", style="dim")
    if assumed:
        yield Text("  This assumes:")
        for sentence in assumed:
            yield from (Text(line, style="dim") for line in wrapped(sentence, columns, " " * 6, 8))


def violation_picture(decided: DecidedRequirement, execution: Execution, model: BehaviorModel) -> Iterator[Text]:
    """Yield the last lines of the log of the new case that violates a requirement, up to the violation."""
    about = (decided.name, decided.is_built_in)
    violation = next(each for each in execution.violations if (each.requirement, each.is_built_in) == about)
    yield Text("  The run until then:")
    yield from _drawn(list(event_lines(model, execution, violation.record + 1)))


def explanation_lines(  # noqa: PLR0913, PLR0917 - what closing found, and how it is shown
    explanations: Sequence[Explanation],
    model: BehaviorModel,
    files: Mapping[str, str],
    command: str,
    ended: Sequence[StageEnd] = (),
    columns: int = DEFAULT_COLUMNS,
) -> Iterator[Text]:
    """Yield all explanations with a blank line between them; each reason appears once.

    Args:
        explanations: the explanations, in the order of the model.
        model: the model that has these obligations.
        files: the file of each case of the suite, by the name of the case.
        command: the `scbm close` command that suggestions extend.
        ended: the stages of closing that ended early.
        columns: the width of the text.
    """
    writer = _ExplanationText(model, files, command)
    for number, alike in enumerate(_alike(explanations, InstanceFolds.of(model))):
        yield from [Text()] if number else []
        yield from writer.lines(alike)
    assumed = assumptions(model, [each.decided.decision for each in explanations])
    if assumed:
        yield Text()
        yield from (Text(part, style="dim") for part in wrapped(" ".join(assumed), columns, "Assumed: ", 2))
    if any(each.decided.decision is Decision.UNDECIDED for each in explanations):
        yield from ended_lines(ended)


def case_lines(text: str, command: str | None, path: str | None = None, first: str | None = None) -> Iterator[Text]:
    """Yield a case as YAML, and the command that runs it.

    Args:
        text: the case.
        command: for a shell.
        path: the file of the case.
        first: a sentence about what to do before the command.
    """
    yield Text()
    if path is not None:
        yield Text(f"# {path}", style="dim")
    for line in text.splitlines():
        yield Text(line, no_wrap=True)
    if command:
        yield Text()
        if first:
            yield Text(first)
        yield command_text("Again: " if first is None else "  ", command)


def _alike(explanations: Iterable[Explanation], folds: InstanceFolds) -> Iterator[list[Explanation]]:
    """Yield groups of explanations: those that are not covered for the same reason, and each of the others alone.

    Reasons that differ only in the names of the instances are the same.
    """
    groups: dict[object, list[Explanation]] = {}
    for explanation in explanations:
        decided = explanation.decided
        entry = folds.entry_of(decided.obligation)
        about = decided.reason
        if entry is not None:
            about = folds.in_entries(reason_about_it(decided.reason, decided.obligation.subject))
        key = (decided.decision, entry, about) if explanation.visit is None else decided.obligation
        groups.setdefault(key, []).append(explanation)
    yield from groups.values()


class _ExplanationText:
    """Writes explanations one after the other, and repeats no suggestion, case or search."""

    def __init__(self, model: BehaviorModel, files: Mapping[str, str], command: str) -> None:
        self._model = model
        self._folds = InstanceFolds.of(model)
        self._files = files
        self._command = command
        self._suggestions: dict[Suggestion, None] = {}
        self._searched: dict[SearchedRuns, None] = {}
        self._cases: dict[str, None] = {}

    def lines(self, alike: Sequence[Explanation]) -> Iterator[Text]:
        """Yield the text of explanations that differ only in their obligations."""
        explanation = alike[0]
        decided = explanation.decided
        by = f" by {decided.case}" if decided.decision is Decision.COVERED else ""
        by += f"; {FORCED_NOTE}" if decided.is_forced else ""
        name = str(decided.obligation)
        is_of_many = len({each.decided.obligation.subject for each in alike}) > 1
        if len(alike) > 1:
            name = ", ".join(in_few_words((each.decided.obligation for each in alike), self._folds))
        yield (
            Text(name, style="bold")
            .append("  ")
            .append(f"{decided.decision.words}{by}", style=_STYLES[decided.decision])
        )
        if decided.decision is not Decision.COVERED:
            of_it = self._folds.in_entries(reason_about_it(decided.reason, decided.obligation.subject))
            yield from self._not_covered(explanation, of_it if is_of_many else decided.reason)
        if explanation.visit is not None:
            yield from self._visit(explanation.visit, decided.obligation)
        suggestions: dict[tuple[str, str | None], Suggestion] = {}  # those of instances have the same text
        for suggestion in (suggestion for each in alike for suggestion in each.suggestions):
            text = suggestion.text
            if is_of_many and suggestion.name is None:
                text = self._folds.in_entries(text)
            suggestions.setdefault((text, suggestion.name), replace(suggestion, text=text))
        for suggestion in suggestions.values():
            if suggestion not in self._suggestions:
                yield from _suggestion(suggestion, self._command)
            self._suggestions[suggestion] = None

    def _not_covered(self, explanation: Explanation, reason: str) -> Iterator[Text]:
        yield Text(f"  {_sentence(reason)}")
        if explanation.searched is not None:
            if explanation.searched not in self._searched:
                yield Text(f"  {_search_sentence(explanation.searched)}")
            self._searched[explanation.searched] = None
        elif explanation.decided.certificate in _FOLLOWS_FROM:
            yield Text(f"  That follows from {_FOLLOWS_FROM[explanation.decided.certificate]}; no run was searched.")

    def _visit(self, visit: Visit, obligation: Obligation) -> Iterator[Text]:
        case = visit.execution.case
        is_new = case.name not in self._cases
        self._cases[case.name] = None
        if is_new:
            yield from _case(case, self._model, self._files)
        if obligation.aspect is not Aspect.QUEUED and visit.plan:
            plan = plan_in_words(visit.plan, _ARROW)
            yield Text(f"  The plan then has {counted(len(visit.plan), 'operation')}: {plan}.")
        yield from _events(visit)
        yield Text(f"  At {format_moment(visit.at_ns)} {visit_sentence(obligation)}:")
        yield from _picture(visit, self._model)
        if is_new:
            yield from (Text(f"  {_sentence(note)}") for note in visit.execution.notes)
            end = visit.execution.verdict.end.replace("_", " ")
            yield Text(f"  The run ends {end} after {format_moment(visit.execution.ended_ns)}.")


def _case(case: Case, model: BehaviorModel, files: Mapping[str, str]) -> Iterator[Text]:
    whose = f"a case of the suite, in {files[case.name]}" if case.name in files else "a new case, made by closing"
    yield Text(f"  {case.name} is {whose}.")
    yield Text(f"  It begins in {_beginning(case, model)}. Its goal is {_goal(case)}.")


def _beginning(case: Case, model: BehaviorModel) -> str:
    nominal = model.nominal_state
    different = [f"{name} = {format_value(value)}" for name, value in case.initial.items() if nominal[name] != value]
    return f"the nominal state except for {', '.join(different)}" if different else "the nominal state"


def _goal(case: Case) -> str:
    goals = ((goal.name, str(goal.predicate)) for goal in case.goals)
    return ", then ".join(text if name == text else f"{name}: {text}" for name, text in goals)


def _events(visit: Visit) -> Iterator[Text]:
    """Yield the faults that were injected before the visit, and what changed from outside."""
    if visit.wrong:
        yield from _listed("Faults injected before the visit:", visit.wrong)
    else:
        yield Text("  No fault is injected before the visit.")
    if visit.outside:
        yield from _listed("Changes from outside before the visit:", visit.outside)


def _listed(heading: str, sentences: Sequence[str]) -> Iterator[Text]:
    """Yield a heading and sentences; only the last ones if there are many."""
    yield Text(f"  {heading}")
    left_out = len(sentences) - _MAX_LISTED
    if left_out > 0:
        yield Text(f"    … {left_out} earlier ones", style="dim")
    for words in islice(sentences, max(0, left_out), None):
        yield Text(f"    {words}")


def _picture(visit: Visit, model: BehaviorModel) -> Iterator[Text]:
    """Yield the last lines of the run's log up to the visit, from one with a time; the plan stands above them."""
    *before, last = event_lines(model, visit.execution, visit.record + 1)
    return _drawn([*(line for line in before if line.begins_moment or not isinstance(line.record, PlanReceived)), last])


def _drawn(every: Sequence[EventLine]) -> Iterator[Text]:
    """Yield the last lines of a log, from one with a time."""
    lines = every[-_LINES:]
    first = next((index for index, line in enumerate(lines) if line.begins_moment), 0)
    for line in lines[first:]:
        yield Text("  ").append_text(draw_line(_with_short_plan(line)))


def _with_short_plan(line: EventLine) -> EventLine:
    if not isinstance(line.record, PlanReceived) or not line.record.plan:
        return line
    plan = line.record.plan
    return replace(line, outcome=f"{len(plan)}: {plan_in_words(plan, _ARROW)}")


def _search_sentence(searched: SearchedRuns) -> str:
    count = searched.initial_states
    states = "all initial states" if count is None else counted(count, "initial state")
    if not searched.situations:
        return f"Searched: {states} and {counted(searched.goals, 'goal')}."
    situations = f"{searched.situations:,} situation{'' if searched.situations == 1 else 's'}"
    return (
        f"Searched: {states}, {counted(searched.goals, 'goal')}, and {situations}, "
        "all that runs reach between two events."
    )


def _suggestion(suggestion: Suggestion, command: str) -> Iterator[Text]:
    change = "" if suggestion.kind is SuggestionKind.INSTANT else "Suggested change: "
    yield Text(f"  {change}{_sentence(suggestion.text)}")
    if suggestion.name is not None:
        yield command_text("    ", f"{command} --write {suggestion.name}")


def _sentence(words: str) -> str:
    """Return the words with a full stop; they may begin with a name, so they get no capital."""
    return words if words.endswith((".", "!", "?")) else f"{words}."


def visit_sentence(obligation: Obligation) -> str:
    """Return a sentence for the visit of an obligation, such as `scan is disabled`."""
    subject = str(obligation) if obligation.aspect is Aspect.TAKEN else obligation.subject
    return f"{subject} {_WORDS[obligation.aspect]}"


_WORDS = {
    Aspect.TAKEN: "is taken",
    Aspect.QUEUED: "is in a plan",
    Aspect.DISABLED: "is disabled",
    Aspect.EXECUTING: "executes",
    Aspect.TIMEDOUT: "times out",
    Aspect.FAILED: "fails",
    Aspect.COMPLETED: "completes",
}
