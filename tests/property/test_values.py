"""Values that the analysis excludes for a variable never occur, and excluded obligations are never visited.

The checker of certificates agrees, too.
"""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from scbm.cases.coverage import Obligations
from scbm.cases.trace import Record, RunStarted
from scbm.closing.proofs.possible_values import possible_values, ruled_out
from scbm.closing.proofs.proofs import structural_facts
from scbm.model import BehaviorModel, InputError, Value
from scbm.planning import PlanLimits
from scbm.proofcheck import StructureArgument, ValuesArgument
from scbm.proofcheck.certificate import claimable_obligations
from scbm.proofcheck.structure_check import check_structure
from scbm.proofcheck.values_check import check_values
from scbm.running import RunnerOptions
from scbm.testing import RandomCases, Tester
from support.profiles import examples
from support.strategies import SECOND_NS, running_models

OPTIONS = RunnerOptions(time_limit_ns=100 * SECOND_NS, plan_limit=12, livelock_bound=60)
LIMITS = PlanLimits(length=50, expansions=5_000)


def _seen(records: tuple[Record, ...]) -> list[tuple[str, Value]]:
    """All values that the variables of a run have, one after the other."""
    seen: list[tuple[str, Value]] = []
    for record in records:
        if isinstance(record, RunStarted):
            seen += record.state
        seen += record.changes
    return seen


@pytest.mark.slow
@given(running_models(), st.integers(0, 2**32))
@settings(examples(300), suppress_health_check=[HealthCheck.too_slow])
def test_runs_stay_within_the_values_and_visit_nothing_that_is_ruled_out(model: BehaviorModel, seed: int) -> None:
    values = possible_values(model)
    refused = [obligation for obligation, _ in ruled_out(model, values)]
    refused += [obligation for obligation, _, _ in structural_facts(model)]
    names = [str(obligation) for obligation in refused]
    tester = Tester(model, OPTIONS, LIMITS)
    try:
        cases = list(RandomCases(model).first(6, seed))
    except InputError:
        assume(False)
        raise
    for case in cases:
        execution = tester.execute(case)
        assert [(name, value) for name, value in _seen(execution.trace.records) if value not in values[name]] == []
        visited = Obligations.of(model).names(execution.visited)
        assert [name for name in names if name in visited] == []


@given(running_models())
@examples(60, usual=4)
def test_the_values_do_not_depend_on_the_order_of_the_file(model: BehaviorModel) -> None:
    turned = replace(
        model,
        resources=tuple(reversed(model.resources)),
        automatic_transitions=tuple(reversed(model.automatic_transitions)),
    )
    assert possible_values(turned) == possible_values(model)


@pytest.mark.slow
@given(running_models())
@settings(examples(200), suppress_health_check=[HealthCheck.too_slow])
def test_the_check_finds_no_flaw_in_what_is_ruled_out(model: BehaviorModel) -> None:
    values = possible_values(model)
    known = {str(obligation): obligation for obligation in claimable_obligations(model)}
    claimed = [known[str(obligation)] for obligation, _ in ruled_out(model, values)]
    assert list(check_values(claimed, ValuesArgument(dict(values)), model)) == []
    facts = structural_facts(model)
    argument = StructureArgument(tuple(fact for _, fact, _ in facts))
    assert list(check_structure([known[str(obligation)] for obligation, _, _ in facts], argument, model)) == []
