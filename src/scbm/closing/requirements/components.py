"""Strongly connected components: the parts of a graph in which each node leads to each other one."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator, Mapping, Sequence

_Node = TypeVar("_Node", bound="Hashable")


def components(following: Mapping[_Node, Sequence[_Node]]) -> Iterator[dict[_Node, None]]:
    """Yield the components of a graph, by Kosaraju's algorithm; a node alone is one, too.

    Args:
        following: for each node those that follow it; all of them are nodes.
    """
    before: dict[_Node, list[_Node]] = {node: [] for node in following}
    for node, targets in following.items():
        for target in targets:
            before[target].append(node)
    seen: dict[_Node, None] = {}
    for root in reversed(_in_order_of_ends(following)):
        if root not in seen:
            component = {root: None}
            pending = [root]
            while pending:
                for node in before[pending.pop()]:
                    if node not in seen and node not in component:
                        component[node] = None
                        pending.append(node)
            seen |= component
            yield component


def _in_order_of_ends(following: Mapping[_Node, Sequence[_Node]]) -> list[_Node]:
    """Return the nodes in the order in which a depth-first search leaves them."""
    seen: dict[_Node, None] = {}
    left: list[_Node] = []
    for root in following:
        if root in seen:
            continue
        seen[root] = None
        path = [(root, iter(following[root]))]
        while path:
            node, targets = path[-1]
            for target in targets:
                if target not in seen:
                    seen[target] = None
                    path.append((target, iter(following[target])))
                    break
            else:
                path.pop()
                left.append(node)
    return left
