"""The table of what was missed in a model with parameters: a row for each entry as it is written."""

from __future__ import annotations

from scbm.cases.coverage import Aspect, Coverage, Obligation, Obligations, Statuses, StatusProof, WaiverReview
from scbm.cases.coverage.statuses import Decision
from scbm.files import read_model
from scbm.model import BehaviorModel, Waiver
from scbm.reports.figure_table import missed_table

MODEL = read_model(
    """behavior_model: doors
types: {door: [d1, d2, d3]}
variables:
  open[door]: {domain: bool, initial: false}
operations:
  open_it[d in door]: {pre: {g: open.d == false}, post: {g: true, a: [open.d <- true]}}
  rest: {pre: {g: true}, post: {g: true}}
automatic_transitions:
  shut[d in door]: {g: open.d == true, a: [open.d <- false]}
"""
)


def lines(model: BehaviorModel, visited: list[Obligation], proofs: dict[str, StatusProof] | None = None) -> list[str]:
    obligations = Obligations.of(model)
    coverage = Coverage(obligations, (("case", sum(map(obligations.bit, visited))),))
    return [line.plain for line in missed_table(model, Statuses.of(coverage, proofs), 100)]


def test_a_row_counts_the_instances_that_are_missed() -> None:
    visited = [Obligation("open_it.d1", Aspect.EXECUTING), Obligation("rest", Aspect.COMPLETED)]
    found = lines(MODEL, visited)
    assert found[1].split()[:2] == ["Missed", "(○)"]
    assert [line.split() for line in found[2:-1]] == [
        ["op:", "open_it", "(3)", "○3", "○3", "○2", "○3", "○3", "○3"],
        ["op:", "rest", "○", "○", "○", "○", "○", "●"],
        ["at:", "shut", "(3)", "○3"],
        ["waits", "for", "open[door]", "==", "true"],
    ]


def test_a_cell_has_the_first_status_of_what_is_missed() -> None:
    proof = StatusProof(Decision.UNCOVERABLE, "never", "c")
    proofs = {f"open_it.d{number}/failed": proof for number in (1, 2, 3)} | {"automatic/shut.d1": proof}
    found = [line.split() for line in lines(MODEL, [], proofs)]
    assert found[2][6] == "\N{MULTIPLICATION SIGN}3"
    assert found[4] == ["at:", "shut", "(3)", "○2"]
    assert found[7] == ["\N{MULTIPLICATION SIGN}", "uncoverable"]


def test_a_cell_counts_the_instances_and_the_legend_has_the_marks_that_are_shown() -> None:
    coverage = Coverage(Obligations.of(MODEL), ())
    waived = WaiverReview((Waiver("open_it.d1/failed", "no", "Ada", "2026-11-20"),))
    found = [line.plain for line in missed_table(MODEL, Statuses.of(coverage, waivers=waived), 100)]
    assert found[2].split() == ["op:", "open_it", "(3)", "○3", "○3", "○3", "○2", "○3", "○3"]
    assert found[-1] == "  (n): n instances; ○n: n of them"
    everything = WaiverReview(tuple(Waiver(f"open_it.d{n}/failed", "no", "Ada", "2026-11-20") for n in (1, 2, 3)))
    shown = [line.plain for line in missed_table(MODEL, Statuses.of(coverage, waivers=everything), 100)]
    assert shown[2].split()[6] == "~3"
    assert shown[-1] == "  ~ waived"


def test_a_transition_shows_what_it_waits_for() -> None:
    model = read_model(
        """behavior_model: tables
types: {table: [a, b, c]}
variables:
  at: {domain: table, initial: a}
  on[table]: {domain: bool, initial: false}
operations: {rest: {pre: {g: true}, post: {g: true}}}
automatic_transitions:
  same[t in table]: {g: at != c && on.t == true, a: [on.t <- false]}
  other[t in table]: {g: at == t, a: [on.t <- true]}
  alone: {g: "forall t in table. (on.t == true)", a: [at <- a]}
"""
    )
    found = lines(model, [Obligation("other.a", Aspect.TAKEN)])
    assert [line.strip() for line in found if "waits for" in line] == [
        "waits for at != c && on[table] == true",
        "waits for at == b (and 1 more)",
        "waits for on.a == true && on.b == true && on.c == true",
    ]
    coverage = Coverage(Obligations.of(model), ())
    narrow = [line.plain for line in missed_table(model, Statuses.of(coverage), 60)]
    assert max(map(len, narrow)) <= 60


def test_entries_that_miss_nothing_have_no_row() -> None:
    everything = list(Obligations.of(MODEL))
    assert lines(MODEL, everything) == []
    assert len(lines(MODEL, [each for each in everything if each.subject != "rest"])) == 4
