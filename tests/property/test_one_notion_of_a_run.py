"""A run is a run, whatever makes it: cases, proofs and statuses of random models, beside a second interpreter."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING

import pytest
from msgspec.structs import replace

from scbm.cases import Case
from scbm.cases.coverage import Obligation, Statuses, WaiverReview
from scbm.cases.trace import End, PlanReceived
from scbm.cli.options.status_options import stored_evidence
from scbm.closing import CloseLimits, Closer, Closing, Decision
from scbm.closing.certificate_files import CertificateFile, CheckedCertificate
from scbm.closing.proved_statuses import StatusEvidence, claims_of
from scbm.closing.runs.all_runs import AllRuns, RunScope
from scbm.files import read_model, write_case, write_model
from scbm.model import BehaviorModel, GoalOrder
from scbm.proofcheck import certificate_text, check_certificate
from scbm.running.simulation import Simulator
from scbm.store import StoredCertificate, read_history, write_store, written_recipe
from scbm.testing import Campaign, CaseResult, Execution, RandomCases, Shrinker, Tester
from scbm.testing.shrinking.shrinker import UnshrinkableError
from support.disturbed_cases import disturbed
from support.opened_models import varied
from support.profiles import share, slow_where
from support.reference_runs import ReferenceVisits, WalkedTrace, impossible_changes, reference_visits
from support.stores import a_run

if TYPE_CHECKING:
    from conftest import Ran

    Scbm = Callable[..., Ran]

OFTEN = (5, 7)
"""Open models whose runs are quick to follow; the usual run has them only."""

NUMBERS = slow_where(lambda number: number not in OFTEN, range(share(1_000, usual=30)))
SUITES = slow_where(lambda number: number != OFTEN[-1], range(share(200, usual=10)))
"""Models of which five suites are judged each, so that there are 1,000 suites; each takes seconds."""

FEW = range(share(20, usual=3))
"""Models that the command line closes."""

WITHOUT_PLAN = (End.TIME_LIMIT.value, End.UNSOLVABLE.value)
"""The ends of a run without a plan, and of its smallest case: the first one waits for changes from outside (7.11)."""

MOMENTS = 2_000
"""Maximum number of moments of runs that the reference finds; most models have fewer."""

LIMITS = CloseLimits(situations=1_000, planning=2_000, random=10, changes=10, beyond=200, candidates=5)


@cache
def model_of(number: int) -> BehaviorModel:
    """A model as its file says it."""
    return read_model(write_model(varied(number)))


@cache
def visits_of(number: int) -> ReferenceVisits:
    return reference_visits(model_of(number), MOMENTS)


@cache
def closing_of(number: int) -> Closing:
    return Closer(model_of(number), LIMITS).close()


def drawn(number: int) -> Iterator[Case]:
    """Random cases over networks with faults, with moving inputs and without; every third has two goals."""
    model = model_of(number)
    for moves_inputs in (False, True):
        *others, last = RandomCases(model, network=None, moves_inputs=moves_inputs).first(3, number)
        first, (name, predicate) = last.goals[0], model.goals[number % len(model.goals)]
        yield from (*others, last.with_goals([first, replace(first, name=name, predicate=predicate)]))


def visits_no_run_has(number: int, execution: Execution) -> list[str]:
    """What a case visits without force and no run visits; empty if proofs are not about such cases."""
    model, known = model_of(number), visits_of(number)
    goals = [goal.name for goal in execution.case.goals]
    is_outside = len(goals) > 1 and model.runs.goals is GoalOrder.SINGLE
    if not known.is_complete or is_outside or any(name not in dict(model.goals) for name in goals):
        return []
    found = Tester(model).obligations.names(execution.visited_freely)
    return [name for name in found if name not in known.names]


def assert_is_run(number: int, execution: Execution) -> None:
    """A case is a possible run, but for what is marked as forced; and its saved case gives the same run."""
    model = model_of(number)
    assert impossible_changes(model, execution.trace) == []
    assert visits_no_run_has(number, execution) == []
    assert Tester(model).execute(replace(execution.recorded_case, origin=None)).digest == execution.digest


@pytest.mark.parametrize("number", NUMBERS)
def test_the_graph_of_all_runs_visits_what_the_reference_visits(number: int) -> None:
    model, known = model_of(number), visits_of(number)
    scope = RunScope(is_open=True, goals=model.runs.goals)
    runs = AllRuns(model, CloseLimits(situations=3 * MOMENTS), lambda _: None, scope)
    in_graph = runs.visits.obligations.names((runs.visited | runs.cut_off) & runs.visits.mask)
    if runs.stopped is None:
        assert [name for name in known.names if name not in in_graph] == []
    if known.is_complete and not known.has_livelock:  # after a livelock the graph counts each state of the cycle
        assert [name for name in in_graph if name not in known.names] == []


def lacks_plan(execution: Execution) -> bool:
    """Whether some answer of the planner to the run was that no plan exists."""
    plans = (record for record in execution.trace.records if isinstance(record, PlanReceived))
    return any(plan.status == End.UNSOLVABLE.value for plan in plans)


@pytest.mark.parametrize("number", NUMBERS)
def test_random_cases_and_their_smallest_cases_are_runs(number: int) -> None:
    tester = Tester(model_of(number))
    shrinker = Shrinker(tester, most_runs=100)
    for case in drawn(number):
        execution = tester.execute(case)
        assert_is_run(number, execution)
        for failure in execution.verdict.failures[:2]:
            try:
                shrunk = shrinker.shrink(execution, failure)
            except UnshrinkableError:
                continue
            assert_is_run(number, shrunk.execution)
            assert shrunk.failure in shrunk.execution.verdict.failures
            ends = (failure.subject, shrunk.failure.subject)
            assert shrunk.failure.is_like(failure) or (ends == WITHOUT_PLAN and lacks_plan(execution))
            assert shrunk.execution.forced_by is None


@pytest.mark.parametrize("number", NUMBERS)
def test_changes_and_injections_of_cases_are_judged_as_the_reference_judges_them(number: int) -> None:
    model, random = model_of(number), Random(number)
    tester, simulator = Tester(model), Simulator(model)
    for case in (disturbed(each, model, random) for each in drawn(number) for _ in range(4)):
        choices = tester.choices_of(case)
        run = simulator.run(case, choices)
        walked = WalkedTrace(model, run.records)
        assert (walked.impossible, walked.needlessly_forced) == ([], [])
        assert run.impossible is None or not walked.is_possible(dict(run.impossible.changes), run.impossible.by)
        assert visits_no_run_has(number, tester.judged(case, run, choices.taken)) == []


@pytest.mark.parametrize("number", NUMBERS)
def test_cases_of_closing_are_runs_and_its_proofs_exclude_none(number: int) -> None:
    closing, visited = closing_of(number), visits_of(number).names
    for each in closing.cases:
        assert_is_run(number, each.execution)
    proved = [d.obligation for d in closing.decided if d.decision in (Decision.UNCOVERABLE, Decision.EXCLUDED)]
    assert [str(obligation) for obligation in proved if str(obligation) in visited] == []


# statuses


@pytest.mark.parametrize("number", SUITES)
def test_all_who_say_statuses_say_the_same(number: int, tmp_path: Path) -> None:
    model, random = model_of(number), Random(number)
    tester = Tester(model)
    known = [tester.execute(case) for case in drawn(number)]
    known += [tester.execute(replace(disturbed(e.case, model, random), name=f"{e.case.name}-disturbed")) for e in known]
    known += [made.execution for made in closing_of(number).cases]
    pool = [replace(e, case=replace(e.case, name=f"{n}-{e.case.name}")) for n, e in enumerate(known)]
    for suite_number in range(5):
        suite = [each.result for each in random.sample(pool, random.randint(0, min(5, len(pool))))]
        closing = Closer(model, LIMITS).close(Campaign.of(model, suite))
        cases = [*suite, *(made.execution.result for made in closing.cases)]
        statuses = {d.obligation: (d.decision, d.is_forced) for d in closing.decided}
        certificates = checked(closing)
        assert of_test(closing.model, cases, certificates) == statuses
        assert of_store(closing.model, cases, certificates, tmp_path / f"{suite_number}.db") == statuses
        assert excluded_and_visited(closing, pool) == []
        if not suite_number:
            every = Campaign.of(model, cases)
            assert decided(Closer(model, LIMITS).close(every)) == statuses
            asked = random.choice(tester.obligations.all)
            assert decided(Closer(model, LIMITS).close(every, (asked,))) == {asked: statuses[asked]}


def decided(closing: Closing) -> dict[Obligation, tuple[Decision, bool]]:
    return {each.obligation: (each.decision, each.is_forced) for each in closing.decided}


def checked(closing: Closing) -> list[CheckedCertificate]:
    """The certificates of a closing, all of which are sound."""
    reasons = {str(each.obligation): each.reason for each in closing.decided}
    files = [CertificateFile(certificate, Path(name), None, reasons) for name, certificate in closing.certificates]
    assert [check_certificate(file.certificate, closing.model) for file in files] == [()] * len(files)
    return [CheckedCertificate(file, is_of_this_model=True) for file in files]


def of_test(
    model: BehaviorModel, cases: list[CaseResult], certificates: list[CheckedCertificate]
) -> dict[Obligation, tuple[Decision, bool]]:
    """What `scbm test --certificates` says of these cases."""
    campaign = Campaign.of(model, cases)
    evidence = StatusEvidence.of(certificates, WaiverReview(), model)
    return in_statuses(evidence.statuses(campaign.coverage, campaign.forced))


def of_store(
    model: BehaviorModel, cases: list[CaseResult], certificates: list[CheckedCertificate], path: Path
) -> dict[Obligation, tuple[Decision, bool]]:
    """What `scbm report` says of a store with these cases and certificates."""
    if not cases:
        return of_test(model, cases, certificates)  # there is no store without a case
    kept = [
        StoredCertificate.of(str(each.file.path), certificate_text(each.file.certificate), dict(claims_of(each)))
        for each in certificates
    ]
    with write_store(path, model, a_run(1, model)) as writer:
        writer.keep_certificates(kept)
        for position, result in enumerate(cases, start=1):
            writer.add(position, written_recipe(result.case, model, f"{result.case.name}.yaml"), result)
    history = read_history(path)
    evidence = stored_evidence(history, None, None, [])
    return in_statuses(history.statuses if evidence is None else evidence.statuses(history.coverage, history.forced))


def in_statuses(statuses: Statuses) -> dict[Obligation, tuple[Decision, bool]]:
    return {each.obligation: (each.decision, each.is_forced) for each in statuses.entries}


def excluded_and_visited(closing: Closing, executions: Iterable[Execution]) -> list[str]:
    """What a closing calls uncoverable or excluded, and a case that proofs are about visits without force."""
    model = closing.model
    goals = dict(model.goals)
    runs = [each for each in executions if not each.case.later or model.runs.goals is GoalOrder.SEQUENCE]
    runs = [each for each in runs if all(goal.name in goals for goal in each.case.goals)]
    free = 0
    for each in runs:
        free |= each.visited_freely
    proved = [d.obligation for d in closing.decided if d.decision in (Decision.UNCOVERABLE, Decision.EXCLUDED)]
    return [str(obligation) for obligation in proved if closing.bit(obligation) & free]


@pytest.mark.slow
@pytest.mark.parametrize("number", FEW)
def test_all_commands_say_the_same_statuses(number: int, tmp_path: Path, scbm: Scbm) -> None:
    model, file, out, store = model_of(number), tmp_path / "model.yaml", tmp_path / "closed", tmp_path / "runs.db"
    file.write_text(write_model(model))
    for case in drawn(number):
        (tmp_path / f"{case.name}.yaml").write_text(write_case(case, model, "model.yaml"))
    suite = [word for path in sorted(tmp_path.glob("seed-*.yaml")) for word in ("--suite", path)]
    limits = ("--max-states", LIMITS.situations, "--max-random", 10, "--max-changes", 10)
    closed = json.loads(scbm("close", file, *suite, "--out", out, "--json", *limits).out)
    statuses = {
        each["name"]: (each["decision"], each["is_forced"]) for each in (*closed["obligations"], *closed["queued"])
    }
    special = {
        name: status for name, status in statuses.items() if status[0] not in ("covered", "undecided") or status[1]
    }
    tested = scbm("test", file, *suite[1::2], out, "--certificates", out, "--store", store, "--no-shrink", "--json").out
    for report in (tested, scbm("report", store, "--json").out):
        listed = json.loads(report)["statuses"]["obligations"]
        assert {each["name"]: (each["status"], each["is_forced"]) for each in listed} == special
    for name in list(statuses)[:: max(1, len(statuses) // 3)]:
        explained = json.loads(scbm("explain", file, name, *suite, "--suite", out, "--json", *limits).out)
        (entry,) = explained["obligations"]
        assert (entry["decision"], entry["is_forced"]) == statuses[name]
