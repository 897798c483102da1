"""Certificates about requirements: the checker agrees with the finder, and accepts no false claim, forged or not."""

from __future__ import annotations

from random import Random

import pytest

from property.test_user_requirements import LIMITS, model_of
from scbm.closing.requirements.blocking_search import BlockingSearch
from scbm.closing.requirements.request_monitor import RequestMonitor
from scbm.closing.requirements.sentence_monitor import SentenceMonitor
from scbm.closing.requirements.violating_cases import RequirementKey
from scbm.closing.requirements.violation_search import ViolationSearch
from scbm.closing.runs.all_runs import AllRuns
from scbm.model import BehaviorModel, GoalOrder
from scbm.model.requirements import LeadsTo
from scbm.proofcheck import certificate_text, check_certificate, read_certificate
from support.forged_certificates import claimed, continued, forged, watched_runs
from support.profiles import share, slow_beyond

MOST = 6_000
FEW = 400


def violated_by(model: BehaviorModel, runs: AllRuns) -> dict[RequirementKey, bool]:
    """Whether the finder says that a requirement is violated, for all that a certificate can claim."""
    found = {}
    for requirement in model.requirements:
        if not isinstance(requirement.sentence, LeadsTo):
            search = ViolationSearch(runs, SentenceMonitor(requirement, runs.scope.watched), MOST)
            found[RequirementKey(requirement.name)] = bool(search.violated())
    violated = ViolationSearch(runs, RequestMonitor(model, runs.program), MOST).violated()
    return found | {RequirementKey(n, is_built_in=True): n in violated for n in RequestMonitor.judges}


@pytest.mark.parametrize("number", slow_beyond(4, range(share(80, least=12))))
def test_the_checker_agrees_with_the_finder_and_accepts_no_forged_certificate(number: int) -> None:
    model, random = model_of(number), Random(f"forge {number}")
    runs = watched_runs(model, LIMITS)
    if runs.stopped is not None or runs.situations > FEW:
        pytest.skip("the model has too many situations")
    for key, is_violated in violated_by(model, runs).items():
        certificate = claimed(model, runs, key)
        assert bool(check_certificate(certificate, model)) == is_violated, key
        assert read_certificate(certificate_text(certificate)) == certificate
        if is_violated:
            assert all(check_certificate(each, model) for each in forged(certificate, random, 3)), key
    if model.runs.goals is GoalOrder.SEQUENCE:
        certificate = continued(model, runs)
        is_blocked = bool(BlockingSearch(runs).blocked)
        assert bool(check_certificate(certificate, model)) == is_blocked
        assert read_certificate(certificate_text(certificate)) == certificate
        if is_blocked:
            assert all(check_certificate(each, model) for each in forged(certificate, random, 12))
