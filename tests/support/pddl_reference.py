"""A slow and obvious reader of exported PDDL, to compare what it means with the model."""

from __future__ import annotations

import re
from collections import deque
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    Facts: TypeAlias = frozenset[str]

Expression: TypeAlias = Any
"""A word, or a list of expressions."""


def parsed(text: str) -> Expression:
    """The nested lists of a text in brackets."""
    stack: list[list[Expression]] = [[]]
    for word in re.findall(r"[()]|[^\s()]+", text):
        if word == "(":
            stack.append([])
        elif word == ")":
            stack[-2].append(stack.pop())
        else:
            stack[-1].append(word)
    return stack[0][0]


def holds(condition: Expression, facts: Facts) -> bool:
    head, *rest = condition
    if head == "and":
        return all(holds(part, facts) for part in rest)
    if head == "or":
        return any(holds(part, facts) for part in rest)
    return not holds(rest[0], facts) if head == "not" else head in facts


def shortest_length(domain: str, problem: str) -> int | None:
    """How many actions lead to the goal, by a breadth-first search over sets of facts; `None` if none do."""
    actions = [(s[s.index(":precondition") + 1], s[s.index(":effect") + 1]) for s in _sections(domain, ":action")]
    ((_, *init),) = _sections(problem, ":init")
    ((_, goal),) = _sections(problem, ":goal")
    start = frozenset(str(fact[0]) for fact in init)
    length, queue = {start: 0}, deque([start])
    while queue:
        facts = queue.popleft()
        if holds(goal, facts):
            return length[facts]
        for condition, effects in actions:
            if holds(condition, facts):
                after = _after(effects, facts)
                if after not in length:
                    length[after] = length[facts] + 1
                    queue.append(after)
    return None


def _after(effects: Expression, facts: Facts) -> Facts:
    removed = {str(effect[1][0]) for effect in effects[1:] if effect[0] == "not"}
    added = {str(effect[0]) for effect in effects[1:] if effect[0] != "not"}
    return facts - removed | added


def _sections(text: str, name: str) -> list[Expression]:
    return [section for section in parsed(text) if section[0] == name]
