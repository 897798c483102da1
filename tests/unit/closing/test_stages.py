"""The stages of closing where the runs of a model are many, or planning for all of them is too much work."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Aspect
from scbm.closing import CloseLimits, Closer, Closing, Decision, closer
from scbm.closing.decisions import Stage
from scbm.closing.runs.all_runs import AllRuns
from scbm.closing.runs.run_graph import Start
from scbm.closing.scripts.case_plans import CasePlans
from scbm.closing.scripts.sampled_cases import SampledCases, as_closing_case
from scbm.files import load_model, read_model
from scbm.model import BehaviorModel, PlannerChoice, PlanSet
from scbm.testing import Execution, RandomCases, Tester
from support.shared_closings import shared_closing
from support.two_robots import two_robots
from support.wording import Wording

EXAMPLE = Path(__file__).parents[3] / "examples" / "robot_in_the_air"
NO_GRAPH = CloseLimits(situations=2, beyond=0)
"""Limits with which no graph of the example decides anything."""


@cache
def example(planner: str | None = None) -> BehaviorModel:
    return replace(load_model(EXAMPLE / "before.yaml"), planner=PlannerChoice(planner))


def counts(closing: Closing) -> dict[Decision, int]:
    decisions = [decided.decision for decided in closing.decided if decided.obligation.counts]
    return {decision: decisions.count(decision) for decision in Decision}


@pytest.mark.slow
def test_without_a_graph_random_and_changed_cases_cover_what_runs_can_visit() -> None:
    closing = shared_closing(example(), NO_GRAPH)
    assert counts(closing)[Decision.COVERED] == counts(shared_closing(example()))[Decision.COVERED] == 62
    assert closing.after.figure.visited == 76, "what is disabled by force included"
    assert all(made.execution.verdict.passed for made in closing.cases)
    assert all(made.case.origin is None for made in closing.cases), "a new case draws nothing"


@pytest.mark.slow
def test_random_cases_are_drawn_as_by_campaigns_and_what_they_cover_stays() -> None:
    tester, cases = Tester(example()), RandomCases(example()).first(5, 0)
    drawn = 0
    for case in cases:
        drawn |= tester.execute(case).visited
    closing = Closer(example(), replace(NO_GRAPH, random=5, changes=0)).close()
    assert not drawn & ~closing.after.visited


@pytest.mark.slow
def test_each_limit_has_an_effect() -> None:
    nothing = replace(NO_GRAPH, random=0, changes=0)
    covered = [
        counts(shared_closing(example(), limits))[Decision.COVERED]
        for limits in (nothing, replace(nothing, random=50), replace(nothing, random=50, changes=500))
    ]
    assert covered == sorted(set(covered))
    assert counts(Closer(example(), replace(nothing, situations=1_000)).close())[Decision.UNDECIDED] == 0


@pytest.mark.slow
def test_what_ended_a_stage_names_its_option() -> None:
    ended = Closer(example(), replace(NO_GRAPH, random=3, changes=1)).close().ended
    options = [(end.stage, end.option) for end in ended]
    assert options == [
        (Stage.RANDOM, "--max-random"),
        (Stage.SEARCH, "--max-changes"),
        (Stage.GRAPH, "--max-states"),
    ]
    assert shared_closing(example()).ended == ()


@pytest.mark.longer
def test_too_much_planning_names_its_option() -> None:
    planless = Closer(replace(example(), planner=PlannerChoice(max_expanded=1)), CloseLimits(planning=1)).close()
    assert [end.option for end in planless.ended] == ["--planner", "--max-planning"]
    assert counts(planless)[Decision.UNDECIDED] > 0


# interruptions


class _InterruptedProgress:
    """Ctrl-C as soon as a stage reports progress."""

    def __init__(self, beginning: str) -> None:
        self._beginning = beginning
        self._is_done = False

    def __call__(self, text: str) -> None:
        if f" open; {self._beginning}" in text and not self._is_done:
            self._is_done = True
            raise KeyboardInterrupt


def _interrupted(beginning: str, model: BehaviorModel | None = None) -> Closing:
    """Return the closing of the example without a graph, or of a smaller model with the usual limits."""
    limits = replace(NO_GRAPH, random=20, changes=20) if model is None else CloseLimits()
    return Closer(model or example(), limits, _InterruptedProgress(beginning)).close()


@pytest.mark.longer
@pytest.mark.parametrize(
    ("beginning", "stage"),
    [
        ("exploring the runs", Stage.GRAPH),
        ("random cases", Stage.RANDOM),
        ("guided search", Stage.SEARCH),
    ],
)
def test_an_interrupted_stage_is_named_and_what_was_decided_stays(beginning: str, stage: Stage) -> None:
    closing = _interrupted(beginning)
    assert [end.stage for end in closing.ended if end.is_interrupted] == [stage]
    assert closing.is_interrupted
    assert len(closing.decided) == len(closing.after.obligations.all)


def test_interrupted_suggestions_change_no_decision() -> None:
    model = two_robots("canonical")
    closing = _interrupted("looking for suggestions", model)
    assert [(end.stage, end.is_interrupted) for end in closing.ended] == [(Stage.SUGGESTIONS, True)]
    assert closing.suggestions == ()
    assert shared_closing(model).suggestions
    assert closing.decided == shared_closing(model).decided


@pytest.mark.slow
@pytest.mark.parametrize("beginning", ["exploring the runs", "looking for cases", "guided search"])
def test_an_interruption_leaves_the_cases_of_earlier_stages(beginning: str) -> None:
    for model in (None, two_robots()):
        closing = _interrupted(beginning, model)
        assert closing.cases
        assert counts(closing)[Decision.COVERED] > 0


@pytest.mark.slow
def test_an_interruption_while_cases_are_finished_loses_none(monkeypatch: pytest.MonkeyPatch) -> None:
    finish, calls = as_closing_case, list[Execution]()

    def interrupted(execution: Execution, needed: int, tester: Tester) -> Execution:
        calls.append(execution)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return finish(execution, needed, tester)

    monkeypatch.setattr("scbm.closing.closer.as_closing_case", interrupted)
    closing = Closer(example(), NO_GRAPH).close()
    monkeypatch.undo()
    assert closing.is_interrupted
    assert closing.cases == shared_closing(example(), NO_GRAPH).cases


# the limits of suggestions


def test_suggestions_have_a_limit_that_changes_no_decision(monkeypatch: pytest.MonkeyPatch) -> None:
    model = two_robots("canonical")
    whole = shared_closing(model)
    monkeypatch.setattr(closer, "_PLANNED_FOR_SUGGESTIONS", 0)
    closing = Closer(model).close()
    assert [(end.stage, end.option) for end in closing.ended] == [(Stage.SUGGESTIONS, "--max-planning")]
    assert closing.decided == whole.decided
    assert len(closing.suggestions) < len(whole.suggestions)


# progress


@pytest.mark.slow
def test_guided_search_names_the_obligation_that_it_works_at() -> None:
    lines: list[str] = []
    Closer(example(), NO_GRAPH, lines.append).close()
    names = [str(obligation) for obligation in Tester(example()).obligations.all]
    guided = [found[2] for text in lines if (found := text.partition(" open; guided search: "))[1]]
    assert any(text.split(",")[0] in names for text in guided)
    assert all("at most" in text for text in guided), "what is left"


@pytest.mark.slow
def test_a_search_beyond_the_graph_names_its_obligation() -> None:
    lines: list[str] = []
    Closer(example(), CloseLimits(situations=50, random=0, changes=0), lines.append).close()
    assert any("more situations" in text and "/" in text for text in lines)


# planners


def test_runs_of_another_planner_give_cases_and_only_proofs_about_any_plans(wording: Wording) -> None:
    closing = shared_closing(replace(two_robots("canonical"), planner=PlannerChoice("greedy")))
    assert counts(closing)[Decision.COVERED] > 0
    assert {certificate.plans for _, certificate in closing.certificates} <= {PlanSet.ANY}
    undecided = [decided for decided in closing.decided if decided.decision is Decision.UNDECIDED]
    assert undecided
    assert closing.ended == ()
    wording(undecided[0].reason)


LONG_WAY = """
behavior_model: two_ways
variables: {at: {domain: [home, hall, work], initial: home}}
operations:
  through_the_hall: {pre: {g: at == home}, post: {g: true, a: [at <- hall]}}
  on: {pre: {g: at == hall}, post: {g: true, a: [at <- work]}}
  straight: {pre: {g: at == home}, post: {g: true, a: [at <- work]}}
goals: {there: at == work}
"""


def test_what_only_canonical_plans_leave_out_is_no_proof_under_another_planner() -> None:
    model = read_model(LONG_WAY, "two_ways.yaml")
    decided = {str(d.obligation): d.decision for d in Closer(model).close().decided}
    assert decided["on/executing"] is Decision.EXCLUDED
    greedy = replace(model, planner=PlannerChoice("greedy"))
    decided = {str(d.obligation): d.decision for d in Closer(greedy).close().decided}
    assert decided["on/executing"] is Decision.UNDECIDED


def test_planning_of_another_planner_has_a_limit() -> None:
    runs = AllRuns(example("greedy"), CloseLimits(planning=20), lambda _: None)
    assert runs.option == "--max-planning"
    assert not runs.may_grow


# random and changed cases


@cache
def starts() -> Sequence[Start]:
    return AllRuns(example(), CloseLimits(), lambda _: None).starts


def sampled(progress: list[str]) -> SampledCases:
    plans = CasePlans(example())
    tester = Tester(example(), plans=plans)
    everything = (1 << len(tester.obligations.all)) - 1
    return SampledCases(tester, plans, everything, 0, progress.append)


@pytest.mark.slow
def test_random_cases_end_when_they_are_dry() -> None:
    lines: list[str] = []
    search = sampled(lines)
    search.sample(starts(), 5_000, 1_000_000)
    assert search.limit is None
    assert lines[-1] != lines[0]
    assert int(lines[-1].split()[2].replace(",", "")) < 5_000


@pytest.mark.longer
def test_changed_cases_fail_and_time_out_what_executes() -> None:
    search = sampled([])
    search.sample(starts(), 0, 1_000_000)
    before = search.missing
    search.change(100, 1_000_000)
    obligations = Tester(example()).obligations
    for aspect in (Aspect.FAILED, Aspect.TIMEDOUT):
        assert (before & ~search.missing & obligations.mask(aspect)).bit_count() > 1
