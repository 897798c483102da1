"""Lifted predicates that read variables: one choice of objects makes a ground syntax tree of them, or true or false."""

from __future__ import annotations

from itertools import product
from math import prod
from typing import TYPE_CHECKING, Literal, TypeAlias

from lark import Token, Tree
from msgspec import Struct

from scbm.files.expansion.object_formulas import Formula, GroundTree
from scbm.files.expansion.thresholds import Joint, Threshold, at_least, copies
from scbm.files.expansion.work_limit import MAX_INSTANCES, LiftedFault
from scbm.model import Slug

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from scbm.files.expansion.lifted_names import NameSlot
    from scbm.files.expansion.object_formulas import Choice
    from scbm.files.expansion.work_limit import WorkLimit
    from scbm.files.language.syntax import SyntaxTree

Ground: TypeAlias = "GroundTree | bool"
Connective: TypeAlias = Literal["conjunction", "disjunction"]


class AtomFormula(Formula):
    """A part of a text that reads variables: its syntax tree, and the names in it that depend on the choice.

    The resolver reads its ground trees, one for each choice of objects for the parameters in it.
    """

    is_static = False

    def __init__(self, tree: SyntaxTree, slots: Mapping[int, NameSlot]) -> None:
        """Take the tree, and the slots by where their names begin."""
        self._tree = tree
        self._slots = slots
        self.parameters = frozenset().union(*(slot.parameters for slot in slots.values()))
        self._order = tuple(sorted(self.parameters))
        self._known: dict[tuple[str, ...], GroundTree] = {}
        tokens = tree.scan_values(lambda _: True)
        self.least = sum([2 if token.start_pos in slots else len(token) + 1 for token in tokens])

    def ground(self, choice: Choice) -> GroundTree:
        """Return the atom, which is built once for the same objects."""
        objects = tuple([choice[name] for name in self._order])
        found = self._known.get(objects)
        if found is None:
            names = {begin: slot.name(choice) for begin, slot in self._slots.items()}
            tree = _with_names(self._tree, names) if names else self._tree
            found = GroundTree(tree, self.least + sum(map(len, names.values())))
            self._known[objects] = found
        return found


def _with_names(tree: SyntaxTree, names: Mapping[int, str]) -> SyntaxTree:
    """Return a tree with other names, which have the places of those that they replace."""
    children: list[SyntaxTree | Token] = []
    for child in tree.children:
        if isinstance(child, Token):
            name = names.get(child.start_pos) if child.type == "NAME" and child.start_pos is not None else None
            children.append(child if name is None else Token.new_borrow_pos("NAME", name, child))
        else:
            children.append(_with_names(child, names))
    return Tree(tree.data, children, tree.meta)


class CompoundFormula(Formula):
    """A formula of others."""

    def __init__(self, tree: SyntaxTree, operands: Sequence[Formula]) -> None:
        """Take the lifted syntax tree, whose place ground trees have, and the formulas of its parts."""
        self.parameters = frozenset().union(*(operand.parameters for operand in operands))
        self.is_static = all(operand.is_static for operand in operands)
        sizes = [operand.least for operand in operands]
        self.least = sum(sizes) if all(sizes) else 0
        self._tree = tree
        self._operands = tuple(operands)


class NegatedFormula(CompoundFormula):
    """`!p`."""

    def ground(self, choice: Choice) -> Ground:
        """Return the negation."""
        return negated(self._operands[0].ground(choice), self._tree)


class ConjunctionFormula(CompoundFormula):
    """`p && q`; operands that are true for a choice are left out."""

    def ground(self, choice: Choice) -> Ground:
        """Return the operands that depend on variables, or what the others decide."""
        return joint("conjunction", (operand.ground(choice) for operand in self._operands), self._tree)

    def conjuncts(self) -> tuple[Formula, ...]:
        """Return the operands."""
        return tuple(part for operand in self._operands for part in operand.conjuncts())


class DisjunctionFormula(CompoundFormula):
    """`p || q`; operands that are false for a choice are left out."""

    def ground(self, choice: Choice) -> Ground:
        """Return the operands that depend on variables, or what the others decide."""
        return joint("disjunction", (operand.ground(choice) for operand in self._operands), self._tree)

    def candidates(self, name: str, choice: Choice) -> Collection[str] | None:
        """Return what the operands allow, if each of them reads the parameter."""
        found: dict[str, None] = {}
        for operand in self._operands:
            more = operand.candidates(name, choice) if name in operand.parameters else None
            if more is None:
                return None
            found |= dict.fromkeys(more)
        return found


class ImpliedFormula(CompoundFormula):
    """`p -> q`."""

    def ground(self, choice: Choice) -> Ground:
        """Return the implication, or what one of its sides decides."""
        left, right = (operand.ground(choice) for operand in self._operands)
        if isinstance(left, bool):
            return right if left else True
        if isinstance(right, bool):
            return right or negated(left, self._tree)
        tree: SyntaxTree = Tree("implication", [left.tree, right.tree], self._tree.meta)
        return GroundTree(tree, left.characters + right.characters + 4)


class GroupFormula(CompoundFormula):
    """A predicate in brackets, which remain around connectives."""

    def ground(self, choice: Choice) -> Ground:
        """Return the predicate; with its brackets if it has a connective."""
        inner = self._operands[0].ground(choice)
        if isinstance(inner, bool) or inner.tree.data not in _CONNECTIVES:
            return inner
        return GroundTree(Tree("group", [inner.tree], self._tree.meta), inner.characters + 2)

    def conjuncts(self) -> tuple[Formula, ...]:
        """Return the conjuncts of the predicate in the brackets."""
        return self._operands[0].conjuncts()

    def candidates(self, name: str, choice: Choice) -> Collection[str] | None:
        """Return what the predicate in the brackets allows."""
        return self._operands[0].candidates(name, choice)


class Bound(Struct, frozen=True):
    """The parameters of a quantifier with their objects, where it stands, and the count of instances."""

    objects: Mapping[str, tuple[str, ...]]
    begin: int
    end: int
    limit: WorkLimit

    @property
    def count(self) -> int:
        """The number of choices."""
        return prod(map(len, self.objects.values()))

    def choices(self, outer: Choice) -> Iterator[dict[str, str]]:
        """Yield the choices that extend an outer one, the last parameter fastest. Raises `LiftedFault`."""
        names = list(self.objects)
        for combination in product(*self.objects.values()):
            self.limit.count(self.begin, self.end)
            yield {**outer, **dict(zip(names, combination, strict=True))}


class BoundFormula(CompoundFormula):
    """A formula with parameters of its own."""

    def __init__(self, tree: SyntaxTree, operands: Sequence[Formula], bound: Bound) -> None:
        super().__init__(tree, operands)
        self.parameters -= frozenset(bound.objects)
        self.least *= bound.count
        self._bound = bound

    def _instances(self, choice: Choice) -> Iterator[Ground]:
        """Yield the body for all objects. Raises `LiftedFault`."""
        return (self._operands[0].ground(inner) for inner in self._bound.choices(choice))


class QuantifiedFormula(BoundFormula):
    """`forall` (a conjunction) or `exists` (a disjunction) over objects."""

    def ground(self, choice: Choice) -> Ground:
        """Return the body for all objects, joined; no objects make `forall` true and `exists` false."""
        is_forall = self._tree.children[0] == "forall"
        return joint("conjunction" if is_forall else "disjunction", self._instances(choice), self._tree)


def relation_holds(relation: str, count: int, number: int) -> bool:
    """Return whether a count has a relation to a number."""
    match relation:
        case "<" | "<=":
            return count < number or (relation == "<=" and count == number)
        case ">" | ">=":
            return count > number or (relation == ">=" and count == number)
    return (count == number) is (relation == "==")


class CountedFormula(BoundFormula):
    """`count … relation number`: compares the number of objects for which a predicate holds."""

    def __init__(self, tree: SyntaxTree, bound: Bound, body: Formula, relation: str, number: int) -> None:
        super().__init__(tree, (body,), bound)
        self.least = 0  # for some choices, the count may be decided
        self._relation = relation
        self._number = number

    def ground(self, choice: Choice) -> Ground:
        """Return the comparison as a formula, or what the static instances decide."""
        instances = [*self._instances(choice)]
        trees = [each for each in instances if not isinstance(each, bool)]
        number = self._number - sum(each for each in instances if isinstance(each, bool))
        match self._relation:
            case ">=":
                return self._at_least(number, trees)
            case ">":
                return self._at_least(number + 1, trees)
            case "<":
                return self._negated(self._at_least(number, trees))
            case "<=":
                return self._negated(self._at_least(number + 1, trees))
        fewer = self._negated(self._at_least(number + 1, trees))
        exactly = joint("conjunction", (self._at_least(number, trees), fewer), self._tree)
        return exactly if self._relation == "==" else self._negated(exactly)

    def _negated(self, ground: Ground) -> Ground:
        return negated(ground, self._tree)

    def _at_least(self, number: int, trees: Sequence[GroundTree]) -> Ground:
        size = copies(number, len(trees))
        if size > MAX_INSTANCES:
            message = f"this count would be a predicate with {size:,} comparisons; at most {MAX_INSTANCES:,} are built"
            span = self._bound.begin, self._bound.end
            raise LiftedFault(Slug.TOO_MANY_INSTANCES, message, *span, "keep the number in a variable")
        return self._rendered(at_least(number, len(trees)), trees)

    def _rendered(self, formula: Threshold, trees: Sequence[GroundTree]) -> Ground:
        if isinstance(formula, Joint):
            connective: Connective = "conjunction" if formula.connective == "&&" else "disjunction"
            return joint(connective, (self._rendered(each, trees) for each in formula.operands), self._tree)
        return formula if isinstance(formula, bool) else trees[formula]


_CONNECTIVES = ("conjunction", "disjunction", "implication")


def joint(connective: Connective, operands: Iterable[Ground], like: SyntaxTree) -> Ground:
    """Return a conjunction or a disjunction, which stands where `like` stands; an operand of its kind joins it."""
    decides = connective == "disjunction"
    trees: list[GroundTree] = []
    for operand in operands:
        if not isinstance(operand, bool):
            trees.append(operand)
        elif operand is decides:
            return decides
    if not trees:
        return not decides
    if len(trees) == 1:
        return trees[0]
    children: list[SyntaxTree | Token] = []
    for each in trees:
        children += each.tree.children if each.tree.data == connective else [each.tree]
    return GroundTree(Tree(connective, children, like.meta), sum(each.characters + 4 for each in trees))


def negated(ground: Ground, like: SyntaxTree) -> Ground:
    """Return the negation, which stands where `like` stands."""
    if isinstance(ground, bool):
        return not ground
    return GroundTree(Tree("no", [ground.tree], like.meta), ground.characters + 1)


def as_tree(ground: Ground, like: SyntaxTree) -> GroundTree:
    """Return a ground predicate as a tree: that of `true` or `false` stands where `like` stands."""
    if isinstance(ground, GroundTree):
        return ground
    word = Token("TRUE" if ground else "FALSE", str(ground).lower(), like.meta.start_pos, end_pos=like.meta.end_pos)
    return GroundTree(Tree("bare", [Tree("term", [word], like.meta)], like.meta), len(word))
