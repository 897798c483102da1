"""The one breadth-first loop: its order, its paths, and that it can be stopped and continued."""

from __future__ import annotations

from scbm.planning.engines.breadth_first import BreadthFirst

# 0 -> 1, 2; both lead to 3; 3 leads to 4 and back to 0
GRAPH = {0: (("a", 1), ("b", 2)), 1: (("c", 3),), 2: (("d", 3),), 3: (("e", 4), ("f", 0)), 4: ()}


def _exploration(*starts: int) -> BreadthFirst[int, str]:
    return BreadthFirst(starts, GRAPH.__getitem__)


def test_states_are_found_level_by_level_each_by_its_first_shortest_path() -> None:
    exploration = _exploration(0)
    assert exploration.expand_all() is None
    assert exploration.states == [0, 1, 2, 3, 4]
    assert exploration.actions_to(4) == ["a", "c", "e"]
    assert [exploration.depth(state) for state in exploration.states] == [0, 1, 1, 2, 3]
    assert (exploration.expanded, exploration.frontier) == (5, 0)


def test_an_exploration_ends_at_the_first_new_goal_and_counts_the_state_that_led_there() -> None:
    exploration = _exploration(0)
    assert exploration.expand_all(lambda state: state > 1) == 2
    assert exploration.expanded == 1
    assert exploration.actions_to(2) == ["b"]
    assert _exploration(4).expand_all(lambda state: state == 4) is None  # an initial state is not asked


def test_an_exploration_can_be_stopped_after_any_state_and_continued() -> None:
    exploration = _exploration(0)
    exploration.expand(2)
    assert (exploration.states, exploration.expanded, exploration.frontier) == ([0, 1, 2, 3], 2, 2)
    exploration.expand(2)
    assert exploration.expanded == 2
    exploration.expand_level()
    assert (exploration.states, exploration.expanded) == ([0, 1, 2, 3, 4], 4)


def test_initial_states_are_counted_once_and_have_no_path() -> None:
    exploration = _exploration(3, 1, 3)
    assert exploration.states == [3, 1]
    assert exploration.actions_to(1) == []
