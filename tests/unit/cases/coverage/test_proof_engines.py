"""The engines of proofs in figures and in words."""

from __future__ import annotations

from scbm.cases.coverage import (
    STATE_ASPECTS,
    Coverage,
    Decision,
    Obligation,
    Obligations,
    Statuses,
    StatusProof,
    count_engines,
    engine_counts_in_words,
)
from scbm.cases.coverage.proof_engines import ENGINE_WORDS
from scbm.proofcheck.certificate_arguments import ARGUMENTS
from support.wording import Wording


def test_each_kind_of_argument_about_obligations_is_an_engine() -> None:
    kinds = {kind for kind, form in ARGUMENTS.items() if form.noun == "obligation"}
    assert set(ENGINE_WORDS) == kinds


def test_engines_without_proofs_are_left_out(wording: Wording) -> None:
    assert engine_counts_in_words(count_engines([None])) == ""
    wording(engine_counts_in_words(count_engines(["sets", None, "structure", "sets"])))
    wording(engine_counts_in_words(count_engines(["another", *ENGINE_WORDS])))


def test_statuses_count_the_proofs_that_decide() -> None:
    names = [Obligation("scan", aspect) for aspect in STATE_ASPECTS]
    obligations = Obligations(names)
    coverage = Coverage(obligations, (("one", obligations.bit(names[0])),))
    proofs = {str(name): StatusProof(Decision.UNCOVERABLE, "no run", "c.json", "sets") for name in names}
    assert Statuses.of(coverage, proofs).engines == {"sets": len(names) - 1}
