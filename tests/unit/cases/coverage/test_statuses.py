"""The statuses of obligations, and the figure of what can be covered."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from scbm.cases.coverage import (
    STATE_ASPECTS,
    Aspect,
    Coverage,
    Decision,
    Figure,
    Obligation,
    Obligations,
    Statuses,
    StatusProof,
    WaiverReview,
    count_statuses,
    coverable_figure,
    status_counts_in_words,
)
from scbm.model import Waiver
from support.wording import Wording


def test_statuses_stand_in_the_order_in_which_they_apply() -> None:
    assert [status.value for status in Decision] == [
        "covered",
        "uncoverable",
        "excluded",
        "waived",
        "undecided",
    ]


def test_what_can_be_covered_leaves_out_uncoverable_excluded_and_waived_obligations() -> None:
    counts = count_statuses([*Decision, Decision.COVERED])
    assert coverable_figure(counts) == Figure(2, 3)


def test_statuses_that_are_rare_are_named_only_where_they_occur(wording: Wording) -> None:
    counts = count_statuses([Decision.COVERED, Decision.COVERED])
    wording(status_counts_in_words(counts))
    wording(status_counts_in_words(count_statuses(Decision)))


NAMES = [Obligation("scan", aspect) for aspect in STATE_ASPECTS] + [Obligation("stop", Aspect.TAKEN)]
DISABLED, EXECUTING, FAILED, TIMEDOUT, COMPLETED, TAKEN = NAMES


def statuses_of(
    visited: tuple[Obligation, ...] = (),
    proofs: Mapping[Obligation, Decision] = MappingProxyType({}),
    waivers: tuple[Waiver, ...] = (),
    forced: tuple[Obligation, ...] = (),
) -> Statuses:
    obligations = Obligations(NAMES)
    bits = sum(map(obligations.bit, (*visited, *forced)))
    coverage = Coverage(obligations, (("one", bits),))
    proved = {str(o): StatusProof(decision, "nothing does", "a.json") for o, decision in proofs.items()}
    only_forced = sum(map(obligations.bit, forced))
    return Statuses.of(coverage, proved, WaiverReview.on("2026-11-23", waivers), forced=only_forced)


def waiver(obligation: Obligation, expires: str | None = None) -> Waiver:
    return Waiver(str(obligation), "no sensor", "Ada", "2026-01-01", expires)


def test_the_first_status_that_holds_is_the_status() -> None:
    statuses = statuses_of(
        visited=(DISABLED,),
        proofs={DISABLED: Decision.UNCOVERABLE, EXECUTING: Decision.UNCOVERABLE, FAILED: Decision.EXCLUDED},
        waivers=tuple(map(waiver, NAMES[:-1])),
        forced=(EXECUTING, FAILED, TIMEDOUT, TAKEN),
    )
    assert [entry.decision for entry in statuses.entries] == [
        Decision.COVERED,
        Decision.UNCOVERABLE,
        Decision.EXCLUDED,
        Decision.WAIVED,
        Decision.WAIVED,
        Decision.UNDECIDED,
    ]
    assert [entry.is_forced for entry in statuses.entries] == [False, True, True, True, False, True]
    assert statuses.forced == 4
    assert statuses.coverable == Figure(1, 2)


def test_a_waived_obligation_that_a_case_visits_is_reported() -> None:
    statuses = statuses_of(visited=(FAILED,), waivers=(waiver(FAILED), waiver(TAKEN)))
    assert [each.obligation for each in statuses.visited_waivers] == ["scan/failed"]
    assert statuses.decision(FAILED) is Decision.COVERED
    assert statuses.decision(TAKEN) is Decision.WAIVED
    assert statuses.by_obligation[TAKEN].reason == "no sensor (Ada, 2026-01-01)"


def test_a_waiver_of_what_only_forced_states_visit_is_in_use(wording: Wording) -> None:
    statuses = statuses_of(waivers=(waiver(FAILED), waiver(TAKEN)), forced=(FAILED, TIMEDOUT))
    assert statuses.visited_waivers == ()
    entry = statuses.by_obligation[FAILED]
    assert (entry.decision, entry.is_visited) == (Decision.WAIVED, True)
    wording(entry.reason)
    wording(entry.forced_in_words)
    assert statuses.by_obligation[TAKEN].forced_in_words == ""
    wording(statuses.by_obligation[TIMEDOUT].forced_in_words)


def test_a_waiver_of_what_is_proved_and_only_forced_states_visit_is_not_reported_as_visited(wording: Wording) -> None:
    statuses = statuses_of(proofs={FAILED: Decision.UNCOVERABLE}, waivers=(waiver(FAILED),), forced=(FAILED,))
    assert statuses.visited_waivers == ()
    wording(statuses.by_obligation[FAILED].forced_in_words)


def test_an_expired_waiver_does_not_count_and_is_reported() -> None:
    statuses = statuses_of(waivers=(waiver(FAILED, "2026-11-22"), waiver(TAKEN, "2026-11-23")))
    assert statuses.decision(FAILED) is Decision.UNDECIDED
    assert statuses.decision(TAKEN) is Decision.WAIVED
    assert [each.obligation for each in statuses.expired_waivers] == ["scan/failed"]


def test_visits_alone_give_plain_statuses() -> None:
    assert statuses_of(visited=(DISABLED,)).are_plain
    assert statuses_of().coverable == Figure(0, 6)
    assert not statuses_of(waivers=(waiver(FAILED, "2026-01-01"),)).are_plain


def test_a_proof_that_a_case_contradicts_is_reported() -> None:
    proofs = {FAILED: Decision.UNCOVERABLE, TAKEN: Decision.UNCOVERABLE, DISABLED: Decision.EXCLUDED}
    statuses = statuses_of(visited=(FAILED, DISABLED), proofs=proofs, forced=(TAKEN,))
    assert statuses.decision(FAILED) is Decision.COVERED
    assert [name for name, _ in statuses.contradicted] == ["scan/failed"]
    assert not statuses.are_plain
