"""What an action with a duration reads after the effects at its start.

A model checks all conditions before an action, and its effects read the values before it. So effects at the start must
not change what is read later, unless they make a condition true in any case.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from scbm.pddl.checks.declared_names import Kinds, PddlNames, Term
    from scbm.pddl.checks.pddl_nodes import PddlNode

_DIFFERENT = re.compile(r"\(not \(= (\S+) (\S+)\)\)")
_NOT = "(not "


class TimedRead(Struct, frozen=True):
    """A conjunct of the condition of an action with a duration, or a condition or value of an effect at its end.

    Attributes:
        node: the expression without its moment.
        moment: `start`, `all` or `end`.
        scope: the types of the variables that it can name.
        variables: the variables of the `forall` around it.
        text: a conjunct for `unified-planning`; empty for what effects read.
        is_value: whether it is a value, and no condition.
    """

    node: PddlNode
    moment: str
    scope: Mapping[str, Kinds]
    variables: Mapping[str, Kinds]
    text: str = ""
    is_value: bool = False


class StartChange(Struct, frozen=True):
    """An effect at the start of an action.

    Attributes:
        target: the fluent that changes.
        text: the effect for `unified-planning`, without its moment and its conditions.
        scope: the types of the variables that it can name.
        variables: the variables of the `forall` around it.
        is_certain: whether it happens in any case, and once.
    """

    target: PddlNode
    text: str
    scope: Mapping[str, Kinds]
    variables: Collection[str]
    is_certain: bool


class ChangedRead(NamedTuple):
    """A fluent that is read after a change.

    Attributes:
        node: the fluent where it is read.
        is_value: whether a value reads it, and no condition.
        pair: two terms of the action that differ where the change is of another fact; `None` without such terms.
    """

    node: PddlNode
    is_value: bool
    pair: tuple[str, str] | None


def changed_reads(
    reads: Sequence[TimedRead], changes: Sequence[StartChange], names: PddlNames
) -> Iterator[ChangedRead]:
    """Yield the fluents that are read after a change."""
    fixed = [each for each in reads if not each.variables]
    before = {each.text for each in fixed if each.moment == "start"}
    different = {frozenset(match.groups()) for each in fixed if (match := _DIFFERENT.fullmatch(each.text))}
    for condition in reads:
        if condition.moment == "start":
            continue
        for read in _fluents_in(condition.node, names):
            found = [each for each in changes if _may_change(each, read, condition, names, different)]
            if found and not _is_kept(read, condition, found, before):
                own = _own_variables(condition, found[0])
                terms = zip(read.parts[1:], found[0].target.parts[1:], strict=True)
                pairs = ((a.word, b.word) for a, b in terms if a.word != b.word and not {a.word, b.word} & own)
                yield ChangedRead(read, condition.is_value, next(pairs, None))


def _fluents_in(node: PddlNode, names: PddlNames) -> Iterator[PddlNode]:
    """Yield the predicates and functions in an expression; functions may have no brackets."""
    yield from node.lists()
    for word in node.words():
        fluent = names.fluents.get(word.word)
        if fluent is not None and fluent.is_numeric:
            yield word


def _may_change(
    change: StartChange,
    read: PddlNode,
    condition: TimedRead,
    names: PddlNames,
    different: Collection[frozenset[str]],
) -> bool:
    """Return whether an effect may change what a condition reads."""
    target = change.target
    if (read.head or read.word) != (target.head or target.word) or len(read.parts[1:]) != len(target.parts[1:]):
        return False
    own = _own_variables(condition, change)
    inner = _quantified(condition.node)
    scope = {name: kinds for name, kinds in condition.scope.items() if f"?{name}" not in inner}
    for mine, other in zip(read.parts[1:], target.parts[1:], strict=True):
        terms = _term(mine, scope, names), _term(other, change.scope, names)
        pair = frozenset(text for text, _ in terms)
        if not names.can_be_equal(*terms) or (pair in different and not pair & own):
            return False
    return True


def _own_variables(condition: TimedRead, change: StartChange) -> set[str]:
    """Return the variables of a condition and of an effect that are no parameters of the action."""
    return _quantified(condition.node) | {f"?{name}" for name in (*condition.variables, *change.variables)}


def _quantified(node: PddlNode) -> set[str]:
    """Return the words that stand between `forall` or `exists` and its condition."""
    quantifiers = [each for each in node.lists() if each.head in ("forall", "exists")]
    return {word.word for each in quantifiers for part in each.parts[1:2] for word in part.words()}


def _term(node: PddlNode, scope: Mapping[str, Kinds], names: PddlNames) -> Term:
    if node.word.startswith("?"):
        return node.word, scope.get(node.word[1:], ())
    return f"o-{node.word}", names.objects.get(node.word, ())


def _is_kept(read: PddlNode, condition: TimedRead, found: Sequence[StartChange], before: Collection[str]) -> bool:
    """Return whether a condition is a fact that the changes make true, or that they leave true."""
    is_negative = condition.text.startswith(_NOT)
    fact = condition.node.parts[1] if is_negative else condition.node
    if condition.variables or fact is not read:
        return False
    are_alike = all(each.text.startswith(_NOT) == is_negative for each in found)
    is_made = any(each.is_certain and each.text == condition.text for each in found)
    return (are_alike and condition.text in before) or (is_made and (are_alike or not is_negative))
