"""Obligations of entries with parameters: their statuses over all instances, and short lists of their names."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.cases.coverage import (
    LIFTED,
    Aspect,
    Coverage,
    Decision,
    Figure,
    InstanceFolds,
    LiftedStatuses,
    ObjectListVisits,
    Obligation,
    Obligations,
    Statuses,
    StatusProof,
    Threshold,
    WaiverReview,
    instances_of,
)
from scbm.cases.coverage.lifted_obligations import folded_decision
from scbm.closing.summaries import in_few_words
from scbm.files import read_model
from scbm.model import Waiver
from support.profiles import examples

C, U, E, W, X = (
    Decision.COVERED,
    Decision.UNCOVERABLE,
    Decision.EXCLUDED,
    Decision.WAIVED,
    Decision.UNDECIDED,
)

MODEL = read_model(
    """behavior_model: doors
types: {door: [d1, d2]}
variables:
  open[door]: {domain: bool, initial: false}
operations:
  open_it[d in door]:
    pre: {g: open.d == false}
    post: {g: true, a: [open.d <- true]}
  rest: {pre: {g: true}, post: {g: true}}
automatic_transitions:
  shut[d in door]: {g: open.d == true, a: [open.d <- false]}
"""
)


def coverage_of(*visited: Obligation) -> Coverage:
    obligations = Obligations.of(MODEL)
    return Coverage(obligations, (("case", sum(map(obligations.bit, visited))),))


@pytest.mark.parametrize(
    ("decisions", "folded"),
    [
        ([C, U, X], C),
        ([U, U], U),
        ([U, E], E),
        ([U, W, E], W),
        ([W, E], W),
        ([X, W, E, U], X),
    ],
)
def test_a_lifted_obligation_has_the_first_status_of_its_instances(decisions: list[Decision], folded: Decision) -> None:
    assert folded_decision(decisions) is folded
    assert folded_decision(reversed(decisions)) is folded


def test_the_lifted_figure_counts_entries_once() -> None:
    coverage = coverage_of(Obligation("open_it.d2", Aspect.EXECUTING), Obligation("shut.d1", Aspect.TAKEN))
    lifted = LiftedStatuses.of(MODEL, Statuses.of(coverage))
    assert lifted is not None
    assert coverage.figure == Figure(2, 17)
    assert lifted.figure == Figure(2, 11)
    by_name = {str(entry.obligation): entry for entry in lifted.entries}
    executing = by_name["open_it/executing"]
    assert (executing.is_lifted, executing.decision, executing.missed, len(executing.decisions)) == (True, C, 1, 2)
    assert not by_name["rest/failed"].is_lifted
    assert by_name["automatic/shut"].decision is C


def test_what_all_instances_prove_cannot_be_covered() -> None:
    proof = StatusProof(Decision.UNCOVERABLE, "no request fails", "c")
    proofs = {f"open_it.d{number}/failed": proof for number in (1, 2)} | {"open_it.d1/timedout": proof}
    lifted = LiftedStatuses.of(MODEL, Statuses.of(coverage_of(), proofs))
    assert lifted is not None
    assert lifted.counts[Decision.UNCOVERABLE] == 1
    assert lifted.coverable == Figure(0, 10)


def test_visited_instances_under_other_objects_count_like_instances() -> None:
    obligations = Obligations.of(MODEL)
    visits = {name: obligations.bit(Obligation(f"open_it.{name}", Aspect.FAILED)) for name in ("d1", "d2")}
    free = ObjectListVisits.of(MODEL, 2, visits["d1"] | visits["d2"], visits["d2"])
    forced = ObjectListVisits.of(MODEL, 1, visits["d1"], visits["d1"])
    proof = StatusProof(Decision.UNCOVERABLE, "no request fails", "c")
    statuses = Statuses.of(coverage_of(), {f"open_it.d{number}/failed": proof for number in (1, 2)})
    for others, decision, visited in (((), U, 0), ((free,), C, 1), ((forced,), X, 1), ((forced, free), C, 1)):
        lifted = LiftedStatuses.of(MODEL, statuses, others)
        assert lifted is not None
        (entry,) = (each for each in lifted.entries if str(each.obligation) == "open_it/failed")
        assert (entry.decision, entry.missed, lifted.figure.visited) == (decision, 2, visited)
        assert lifted.alone.counts[U] == 1


def test_an_instance_that_only_a_forced_state_covers_is_visited() -> None:
    coverage = coverage_of(Obligation("open_it.d2", Aspect.FAILED))
    lifted = LiftedStatuses.of(MODEL, Statuses.of(coverage, forced=coverage.visited))
    assert lifted is not None
    assert lifted.figure == Figure(1, 11)
    assert lifted.counts[X] == 11


@pytest.mark.parametrize(
    ("proofs", "waived", "status", "missed"),
    [
        ((), (), X, 1),
        (("d1", "d2"), (), U, 1),
        (("d2",), (), X, 1),
        (("d1",), (), X, 1),
        ((), ("d1", "d2"), W, 1),
        ((), ("d1",), X, 1),
    ],
)
def test_the_figure_counts_forced_visits_whatever_the_status_is(
    proofs: tuple[str, ...], waived: tuple[str, ...], status: Decision, missed: int
) -> None:
    coverage = coverage_of(Obligation("open_it.d2", Aspect.DISABLED))
    proof = StatusProof(Decision.UNCOVERABLE, "never disabled", "c")
    waivers = tuple(Waiver(f"open_it.{name}/disabled", "r", "Ada", "2026-11-20") for name in waived)
    statuses = Statuses.of(
        coverage,
        {f"open_it.{name}/disabled": proof for name in proofs},
        WaiverReview(waivers),
        forced=coverage.visited,
    )
    lifted = LiftedStatuses.of(MODEL, statuses)
    assert lifted is not None
    (entry,) = (each for each in lifted.entries if str(each.obligation) == "open_it/disabled")
    assert (entry.is_visited, entry.decision, entry.missed) == (True, status, missed)
    assert lifted.figure == Figure(1, 11)
    assert lifted.coverable.visited == 0


def test_a_lifted_name_stands_for_all_instances() -> None:
    obligations = Obligations.of(MODEL)
    assert [str(each) for each in instances_of("open_it/failed", MODEL, obligations)] == [
        "open_it.d1/failed",
        "open_it.d2/failed",
    ]
    assert len(list(instances_of("open_it", MODEL, obligations))) == 12
    assert [str(each) for each in instances_of("automatic/shut", MODEL, obligations)] == [
        "automatic/shut.d1",
        "automatic/shut.d2",
    ]
    assert list(instances_of("rest/failed", MODEL, obligations)) == []


def test_a_model_without_parameters_has_no_lifted_statuses() -> None:
    model = read_model("behavior_model: m\nvariables: {}\noperations: {a: {pre: {g: true}, post: {g: true}}}\n")
    assert LiftedStatuses.of(model, Statuses.of(Coverage(Obligations.of(model), ()))) is None


def test_a_threshold_can_be_for_the_lifted_figure() -> None:
    coverage = coverage_of()
    assert Threshold(90, LIFTED).figure(coverage, lifted=Figure(9, 10)) == Figure(9, 10)
    assert Threshold(90, LIFTED).is_met(coverage, lifted=Figure(9, 10))
    assert not Threshold(90, LIFTED).is_met(coverage, lifted=Figure(8, 10))
    assert Threshold(90, LIFTED).figure(coverage) == coverage.figure


@given(st.lists(st.tuples(st.integers(0), st.integers(0)), max_size=3), st.integers(0))
@examples(60)
def test_the_united_figure_is_that_of_the_names_without_objects(others: list[tuple[int, int]], own: int) -> None:
    obligations = Obligations.of(MODEL)
    everything = (1 << len(obligations.all)) - 1
    visited = [own & everything, *(bits & everything for bits, _ in others)]
    names = {
        (re.sub(r"\.d\d", "", each.subject), each.aspect)
        for bits in visited
        for each in obligations
        if bits & obligations.bit(each) and each.counts
    }
    coverage = Coverage(obligations, (("case", visited[0]),))
    joined = [ObjectListVisits.of(MODEL, 1, bits & everything, bits & forced & everything) for bits, forced in others]
    lifted = LiftedStatuses.of(MODEL, Statuses.of(coverage), joined)
    assert lifted is not None
    assert lifted.figure == Figure(len(names), 11)
    backwards = LiftedStatuses.of(MODEL, Statuses.of(coverage), joined[::-1])
    assert backwards is not None
    assert backwards.counts == lifted.counts


FOLDED_MODEL = read_model(
    """behavior_model: doors
types: {door: [d1, d2, d3, d4, d5]}
variables:
  open[door]: {domain: bool, initial: false}
operations:
  open_it[d in door]: {pre: {g: open.d == false}, post: {g: true, a: [open.d <- true]}}
  rest: {pre: {g: true}, post: {g: true}}
automatic_transitions:
  open_it[d in door]: {g: open.d == true, a: [open.d <- false]}
"""
)
FOLDS = InstanceFolds.of(FOLDED_MODEL)
DOORS = [f"open_it.d{number}" for number in range(1, 6)]


def test_all_instances_are_one_name_with_their_number() -> None:
    assert FOLDS.folded([*DOORS[:2], "rest", *DOORS[2:]]) == ("open_it (5)", "rest")


def test_many_instances_are_counted_and_few_are_named() -> None:
    assert FOLDS.folded(DOORS[:4]) == ("open_it (4 of 5)",)
    assert FOLDS.folded(DOORS[1:4]) == tuple(DOORS[1:4])


def test_names_of_models_without_parameters_stay() -> None:
    assert InstanceFolds({}, {}).folded(["open_it.d1", "rest"]) == ("open_it.d1", "rest")


def test_groups_of_obligations_are_folded_by_kind() -> None:
    about = [Obligation(name, aspect) for name in DOORS for aspect in (Aspect.FAILED, Aspect.TIMEDOUT, Aspect.TAKEN)]
    assert in_few_words(about, FOLDS) == ("open_it (5): failed, timedout", "automatic/open_it (5)")
    assert in_few_words(about[:3]) == ("open_it.d1: failed, timedout", "automatic/open_it.d1")
