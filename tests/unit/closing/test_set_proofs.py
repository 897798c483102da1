"""Proofs by a set of situations: what they say, what ends their search, and when closing looks for them."""

from __future__ import annotations

import pytest

from scbm.cases.coverage import Obligations
from scbm.closing import CloseLimits, Closer, Decision
from scbm.closing.symbolic import decision_diagrams
from scbm.closing.symbolic.reached_sets import SetLimits
from scbm.closing.symbolic.set_proofs import SetProofs
from scbm.files import read_model
from scbm.proofcheck import check_certificate
from support.wording import Wording

CELL = """
behavior_model: cell
variables:
  at: {domain: 0..40, initial: 0}
  lamp: {domain: [dark, lit], initial: dark, source: state}
operations:
  move: {pre: {g: at < 40, a: [at += 1]}, post: {g: true}}
  back: {pre: {g: at > 0, gr: lamp == lit && at < 40, a: [at -= 1]}, post: {g: true}, deadline: 5 s}
  wait: {pre: {g: at == 7}, post: {g: true, gr: lamp == lit && at < 7}, failed: {g: lamp == lit}, deadline: 5 s}
  idle: {pre: {g: at == 40 && lamp == lit}, post: {g: true}}
automatic_transitions:
  light: {g: lamp == lit && at == 3, a: [lamp <- dark]}
  shadowed: {g: at == 9 && current.name == wait, a: [lamp <- dark]}
goals:
  end: at == 40
"""


def test_each_proof_has_a_reason(wording: Wording) -> None:
    model = read_model(CELL)
    sets = SetProofs.of(model, -1, lambda _: None)
    assert sets is not None
    proved = [each for each in Obligations.of(model) if sets.proves(each)]
    assert {"move/disabled", "wait/completed", "wait/failed", "idle/queued"} <= {str(each) for each in proved}
    assert sets.never == sum(Obligations.of(model).bit(each) for each in proved)
    for each in proved:
        wording(f"{each}: {sets.reason(each)}")


@pytest.mark.parametrize("limits", [SetLimits(nodes=10), SetLimits(work=100)])
def test_a_limit_of_nodes_ends_the_search(limits: SetLimits) -> None:
    assert SetProofs.of(read_model(CELL), -1, lambda _: None, limits) is None


def test_without_an_engine_there_is_no_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decision_diagrams, "ENGINES", {"none": "no_such_module"})
    assert SetProofs.of(read_model(CELL), -1, lambda _: None) is None


def test_large_domains_in_one_comparison_end_the_search() -> None:
    text = CELL.replace("domain: 0..40", "domain: 0..400").replace("at < 40", "at + other < 40")
    model = read_model(text.replace("  lamp:", "  other: {domain: 0..400, initial: 0, source: state}\n  lamp:", 1))
    assert SetProofs.of(model, -1, lambda _: None) is None


def test_closing_uses_a_set_where_situations_are_too_many() -> None:
    model = read_model(CELL)
    closing = Closer(model, CloseLimits(situations=20, random=5, changes=5, beyond=10)).close()
    by_set = {str(d.obligation) for d in closing.decided if d.certificate == "sets"}
    assert {"move/disabled", "wait/queued"} & by_set
    assert all(d.decision is Decision.UNCOVERABLE for d in closing.decided if d.certificate == "sets")
    certificate = dict(closing.certificates)["sets"]
    assert by_set == set(certificate.claims)
    assert check_certificate(certificate, model) == ()
