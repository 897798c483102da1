"""The graph of all runs where its exploration ends early."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.closing import Closer, Decision
from scbm.closing.runs.all_runs import AllRuns, CloseLimits, RunScope
from scbm.model import GoalOrder, PlanSet
from support.opened_models import opened
from support.random_models import random_model, small_random_model

MODEL = 64
FEW_PLANNING_STATES = CloseLimits(planning=15, situations=3_000)


@pytest.mark.longer
def test_a_graph_whose_planning_became_too_large_keeps_the_positions_that_were_found() -> None:
    runs = AllRuns(random_model(MODEL), FEW_PLANNING_STATES, lambda _: None)
    cut_off = [graph for graph in runs.graphs if graph.planning_too_large]
    assert cut_off
    for graph in cut_off:
        assert not graph.complete
        assert len(graph.reach) == len(graph.positions) + 1
        assert list(graph.edges(len(graph.positions))) == []


@pytest.mark.slow
def test_sets_decide_what_became_too_large_to_plan() -> None:
    model = random_model(MODEL)
    closing = Closer(model, replace(FEW_PLANNING_STATES, beyond=100)).close()
    assert Decision.UNDECIDED not in {decided.decision for decided in closing.decided}
    assert "sets-canonical" in {decided.certificate for decided in closing.decided}


def test_the_path_to_a_node_follows_the_edges_of_the_graph() -> None:
    for graph in AllRuns(random_model(2), CloseLimits(), lambda _: None).graphs:
        for node in range(1, len(graph.positions) + 1):
            here = 0
            for edge in graph.path_to(node):
                assert edge in list(graph.edges(here))
                here = edge.target
            assert here == node


@pytest.mark.parametrize("number", [1, 9])
@pytest.mark.parametrize("goals", GoalOrder)
@pytest.mark.parametrize("plans", PlanSet)
def test_an_exploration_goes_on_to_what_a_higher_limit_gives(number: int, goals: GoalOrder, plans: PlanSet) -> None:
    model, scope = opened(small_random_model(number), number), RunScope(is_open=True, goals=goals, plans=plans)
    few, more = CloseLimits(situations=30, planning=2_000), CloseLimits(situations=400, planning=20_000)
    runs = AllRuns(model, few, lambda _: None, scope, may_go_on=True)
    assert runs.may_grow
    further = runs.within(more)
    assert further is runs
    assert _content(further) == _content(AllRuns(model, more, lambda _: None, scope))


def test_an_exploration_begins_anew_where_the_lower_limit_of_planning_ended_it() -> None:
    model, scope = opened(small_random_model(1), 1), RunScope(is_open=True, plans=PlanSet.ANY)
    runs = AllRuns(model, CloseLimits(planning=1), lambda _: None, scope, may_go_on=True)
    assert runs.option == "--max-planning"
    assert _content(runs.within(CloseLimits())) == _content(AllRuns(model, CloseLimits(), lambda _: None, scope))


def _content(runs: AllRuns) -> tuple[object, ...]:
    """Return everything that was explored."""
    graphs = [
        (
            graph.positions,
            graph.complete,
            graph.visits,
            graph.cut_offs,
            graph.reach,
            [[(edge, graph.label(edge.number)) for edge in graph.edges(node)] for node in range(len(graph.reach))],
            [graph.path_to(node) for node in range(len(graph.reach))],
        )
        for graph in runs.graphs
    ]
    return graphs, [list(each) for each in runs.evaluated], runs.asked, runs.stopped, runs.option
