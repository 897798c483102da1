"""The terminal report about mutants, for results that are made by hand."""

from __future__ import annotations

from collections.abc import Callable
from itertools import cycle

import pytest
from msgspec.structs import replace

from scbm.cases import Case
from scbm.cases.coverage import MutantStatus
from scbm.files import read_located
from scbm.model import PlannerChoice, State
from scbm.mutation import MutantResult, mutants_of
from scbm.mutation.report.mutation_report import mutation_report
from scbm.mutation.report.mutation_summary import MutationSummary
from support.models import SCAN_CELL
from support.wording import Wording


def _summary(failing: tuple[str, ...] = ()) -> MutationSummary:
    """Results of all statuses, whatever the mutants are."""
    model, places = read_located(SCAN_CELL, "cell.yaml")
    goal, predicate = model.goals[0]
    witness = Case("witness-1", goal, predicate, State.nominal(model.space))
    statuses = cycle(MutantStatus)
    results = []
    for number, (mutant, status) in enumerate(zip(mutants_of(model), statuses, strict=False)):
        case, reason = ("late", "the goal was not reached") if status is MutantStatus.KILLED else ("", "")
        if status is MutantStatus.SURVIVED and number % 3:
            results.append(MutantResult(mutant, status, witness=witness, is_benign=number % 2 == 0, is_killable=True))
            continue
        if status in (MutantStatus.SURVIVED, MutantStatus.UNDECIDED):
            reason = "a limit ended the search; a larger `--max-states` may decide it"
        results.append(MutantResult(mutant, status, case, reason, runs=1, skipped=2))
    return MutationSummary(model, "cell.yaml", places, "1 written case", 1, failing, tuple(results), "scbm mutate")


def _text(columns: int, failing: tuple[str, ...] = ()) -> str:
    return "".join(f"{line.plain}\n" for line in mutation_report(_summary(failing), columns))


@pytest.mark.parametrize("columns", [80, 60])
def test_the_report_fits_its_width(golden: Callable[[str, str], None], columns: int) -> None:
    text = _text(columns)
    assert max(map(len, text.splitlines())) <= columns
    golden(f"mutants-{columns}.txt", text)


def test_cases_that_fail_on_the_model_are_named(wording: Wording) -> None:
    wording(line for line in _text(100, ("a", "b", "c", "d")).splitlines() if "a, b, c, …" in line)


def test_witnesses_are_listed_once_with_their_mutants() -> None:
    summary = _summary()
    ((witness, (_, *names)),) = summary.witnesses
    assert witness.name == "witness-1"
    killable = [result.mutant.name for result in summary.results if result.is_killable]
    assert sorted(names) == sorted(killable)


def test_the_score_leaves_out_equivalent_mutants() -> None:
    counts = _summary().counts
    assert counts.score.of == counts.total - counts.of_status(MutantStatus.EQUIVALENT)
    assert counts.score.visited == counts.of_status(MutantStatus.KILLED)


def test_the_report_names_what_proofs_assume(wording: Wording) -> None:
    summary = _summary()
    wording(summary.assumptions)
    proofless = replace(summary, results=tuple(r for r in summary.results if r.status is not MutantStatus.EQUIVALENT))
    assert proofless.assumptions == ()


def test_the_planner_of_the_model_is_named(wording: Wording) -> None:
    summary = _summary()
    greedy = replace(summary, model=replace(summary.model, planner=PlannerChoice("greedy")))
    assert [each for each in greedy.assumptions if each not in summary.assumptions] == [
        each.replace("canonical", "greedy") for each in summary.assumptions if "canonical" in each
    ]
    wording(each for each in greedy.assumptions if "greedy" in each)
