"""The graph of all runs where its exploration ends early."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.closing import Closer, Decision
from scbm.closing.runs.all_runs import AllRuns, CloseLimits
from support.random_models import random_model

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
def test_closing_says_undecided_where_planning_became_too_large() -> None:
    model = random_model(MODEL)
    closing = Closer(model, replace(FEW_PLANNING_STATES, beyond=100)).close()
    assert Decision.UNDECIDED in {decided.decision for decided in closing.decided}


def test_the_path_to_a_node_follows_the_edges_of_the_graph() -> None:
    for graph in AllRuns(random_model(2), CloseLimits(), lambda _: None).graphs:
        for node in range(1, len(graph.positions) + 1):
            here = 0
            for edge in graph.path_to(node):
                assert edge in list(graph.edges(here))
                here = edge.target
            assert here == node
