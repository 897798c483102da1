"""Lifted predicates that read variables: one choice of objects makes a ground syntax tree of them, or true or false."""

from __future__ import annotations

from itertools import product
from math import prod
from typing import TYPE_CHECKING, Literal, NoReturn, TypeAlias

from lark import Token, Tree
from msgspec import Struct

from scbm.files.expansion.object_formulas import Formula, GroundTree
from scbm.files.expansion.thresholds import Joint, Threshold, at_least, copies
from scbm.files.expansion.work_limit import MAX_INSTANCES
from scbm.files.language.syntax import SyntaxFault
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

    def __init__(self, tree: SyntaxTree, slots: Mapping[int, NameSlot], bounds: Mapping[int, Bound]) -> None:
        """Take the tree, the slots by where their names begin, and the parameters of the terms over objects in it."""
        self._tree = tree
        self._slots = slots
        self._bounds = bounds
        bound = frozenset(name for each in bounds.values() for name in each.objects)
        self.parameters = frozenset().union(*(slot.parameters for slot in slots.values())) - bound
        self._order = tuple(sorted(self.parameters))
        self._known: dict[tuple[str, ...], GroundTree] = {}
        tokens = tree.scan_values(lambda _: True)
        self.least = sum([2 if token.start_pos in slots else len(token) + 1 for token in tokens])

    def ground(self, choice: Choice) -> GroundTree:
        """Return the atom, which is built once for the same objects. Raises `SyntaxFault`."""
        objects = tuple([choice[name] for name in self._order])
        found = self._known.get(objects)
        if found is None:
            found = self._known[objects] = self.case(choice, {})
        return found

    def case(self, choice: Choice, counts: Mapping[int, int]) -> GroundTree:
        """Return the atom with a number for each count in it, by where that begins. Raises `SyntaxFault`."""
        if not self._slots and not self._bounds and not counts:
            return GroundTree(self._tree, self.least)
        tree = self._ground(self._tree, choice, counts)
        return GroundTree(tree, sum([len(token) + 1 for token in tree.scan_values(lambda _: True)]))

    def _ground(self, tree: SyntaxTree, choice: Choice, counts: Mapping[int, int]) -> SyntaxTree:
        match tree.data:
            case "aggregate":
                return self._term(tree, choice, counts)
            case "counted":
                word = _first(tree)
                return _number(counts[word.start_pos or 0], word)
        children: list[SyntaxTree | Token] = [
            self._named(child, choice) if isinstance(child, Token) else self._ground(child, choice, counts)
            for child in tree.children
        ]
        return Tree(tree.data, children, tree.meta)

    def _named(self, token: Token, choice: Choice) -> Token:
        slot = self._slots.get(token.start_pos or 0) if token.type == "NAME" else None
        if slot is None:
            return token
        name = slot.name(choice)
        return Token.new_borrow_pos("INTEGER" if name.isdecimal() else "NAME", name, token)

    def _term(self, tree: SyntaxTree, choice: Choice, counts: Mapping[int, int]) -> SyntaxTree:
        """Return `sum`, `min` or `max` over objects as a sum, or as `min` or `max` of terms."""
        word, body = _first(tree), tree.children[-1]
        assert isinstance(body, Tree)  # noqa: S101 - the grammar says so
        terms = [self._ground(body, inner, counts) for inner in self._bounds[word.start_pos or 0].choices(choice)]
        if len(terms) == 1 or not terms:
            return terms[0] if terms else _number(0, word)
        if word != "sum":
            return Tree("extreme", [Token.new_borrow_pos("EXTREME", str(word), word), *terms], tree.meta)
        plus = Token.new_borrow_pos("SIGN", "+", word)
        return Tree("sum", [terms[0], *(each for term in terms[1:] for each in (plus, term))], tree.meta)


def _first(tree: SyntaxTree) -> Token:
    word = tree.children[0]
    assert isinstance(word, Token)  # noqa: S101 - the grammar says so
    return word


def _number(number: int, like: Token) -> SyntaxTree:
    """Return a number as a term that stands where a word stands."""
    term: SyntaxTree = Tree("term", [Token.new_borrow_pos("INTEGER", str(number), like)])
    term.meta.start_pos, term.meta.end_pos = like.start_pos or 0, like.end_pos or 0
    return term


class UndecidedFormula(Formula):
    """A part with an error: the word `true` in ground trees, so that it decides neither choices nor other parts."""

    parameters = frozenset()
    is_static = False

    def __init__(self, tree: SyntaxTree) -> None:
        """Take the lifted syntax tree, whose place the word has."""
        self._tree = _as_word(True, tree)

    def ground(self, choice: Choice) -> GroundTree:  # noqa: ARG002 - the same for all choices
        """Return the word."""
        return self._tree


def _as_word(truth: bool, like: SyntaxTree) -> GroundTree:  # noqa: FBT001 - it is what the word is
    """Return `true` or `false` as a predicate that stands where `like` stands."""
    text, meta = str(truth).lower(), like.meta
    word = Token(text.upper(), text, meta.start_pos, end_pos=meta.end_pos)
    return GroundTree(Tree("bare", [Tree("term", [word], meta)], meta), len(text))


class CompoundFormula(Formula):
    """A formula of others.

    Attributes:
        is_empty: whether it is about objects of types without any.
    """

    is_empty = False

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
        first, second = self._operands
        left = first.ground(choice)
        if left is False:
            return True  # what follows may have an index that no name has
        right = second.ground(choice)
        if left is True:
            return right
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
        """Yield the choices that extend an outer one, the last parameter fastest. Raises `SyntaxFault`."""
        names = list(self.objects)
        for combination in product(*self.objects.values()):
            self.limit.count(self.begin, self.end)
            yield {**outer, **dict(zip(names, combination, strict=True))}


class BoundFormula(CompoundFormula):
    """A formula with parameters of its own."""

    def __init__(self, tree: SyntaxTree, body: Formula, bound: Bound) -> None:
        super().__init__(tree, (body,))
        self.parameters -= frozenset(bound.objects)
        self.least *= bound.count
        self.is_empty = not bound.count
        self._bound = bound

    def _instances(self, choice: Choice) -> Iterator[Ground]:
        """Yield the body for all objects. Raises `SyntaxFault`."""
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
    """`count …`, the number of objects for which a predicate holds, compared with a number."""

    def __init__(self, tree: SyntaxTree, body: Formula, bound: Bound, relation: str = "==", number: int = 0) -> None:
        super().__init__(tree, body, bound)
        self.least = 0  # for some choices, the count may be decided
        self._relation = relation
        self._number = number

    def ground(self, choice: Choice) -> Ground:
        """Return the comparison as a formula, or what the static instances decide."""
        return self._compared([*self._instances(choice)], self._relation, self._number)

    def exact(self, choice: Choice) -> list[Ground]:
        """Return for each number from 0 on the predicate that so many instances hold."""
        most = self._bound.count
        size = sum(copies(number, most) for number in range(most + 1))
        if size > MAX_INSTANCES:
            self._refuse_size(size)
        instances = [*self._instances(choice)]
        return [self._compared(instances, "==", number) for number in range(most + 1)]

    def _compared(self, instances: Sequence[Ground], relation: str, number: int) -> Ground:
        trees = [each for each in instances if not isinstance(each, bool)]
        number -= sum(each for each in instances if isinstance(each, bool))
        match relation:
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
        return exactly if relation == "==" else self._negated(exactly)

    def _negated(self, ground: Ground) -> Ground:
        return negated(ground, self._tree)

    def _at_least(self, number: int, trees: Sequence[GroundTree]) -> Ground:
        size = copies(number, len(trees))
        if size > MAX_INSTANCES:
            self._refuse_size(size)
        return self._rendered(at_least(number, len(trees)), trees)

    def _refuse_size(self, size: int) -> NoReturn:
        message = f"this count would be a predicate with {size:,} comparisons; at most {MAX_INSTANCES:,} are built"
        span = self._bound.begin, self._bound.end
        raise SyntaxFault(Slug.TOO_MANY_INSTANCES, message, *span, "keep the number in a variable")

    def _rendered(self, formula: Threshold, trees: Sequence[GroundTree]) -> Ground:
        if isinstance(formula, Joint):
            connective: Connective = "conjunction" if formula.connective == "&&" else "disjunction"
            return joint(connective, (self._rendered(each, trees) for each in formula.operands), self._tree)
        return formula if isinstance(formula, bool) else trees[formula]


class IntegerFormula(Formula):
    """A comparison of terms over integers that are objects, such as `i + 1 < j`."""

    is_static = True

    def __init__(self, atom: AtomFormula) -> None:
        self.parameters = atom.parameters
        self._atom = atom

    def ground(self, choice: Choice) -> bool:
        """Return whether the comparison holds."""
        left, relation, right = self._atom.ground(choice).tree.children
        first, second = (value_of(side) if isinstance(side, Tree) else None for side in (left, right))
        assert first is not None  # noqa: S101 - it reads no variable
        assert second is not None  # noqa: S101 - it reads no variable
        return relation_holds(str(relation), first, second)


class CountCasesFormula(Formula):
    """A comparison with counts among its terms: for each number that they can have, the comparison with that number."""

    def __init__(self, tree: SyntaxTree, atom: AtomFormula, counts: Mapping[int, CountedFormula]) -> None:
        """Take the comparison, the same as an atom, and its counts by where they begin."""
        self.parameters = atom.parameters.union(*(each.parameters for each in counts.values()))
        self.is_static = False
        self._tree = tree
        self._atom = atom
        self._counts = tuple(counts.items())

    def ground(self, choice: Choice) -> Ground:
        """Return the cases that can hold, joined. Raises `SyntaxFault`."""
        exact = [(begin, counted.exact(choice)) for begin, counted in self._counts]
        return self._cases(choice, exact, {})

    def _cases(self, choice: Choice, exact: Sequence[tuple[int, list[Ground]]], numbers: Mapping[int, int]) -> Ground:
        if not exact:
            return self._case(choice, numbers)
        (begin, grounds), *others = exact
        possible = [(number, ground) for number, ground in enumerate(grounds) if ground is not False]
        parts = ((ground, self._cases(choice, others, {**numbers, begin: number})) for number, ground in possible)
        return joint("disjunction", (joint("conjunction", part, self._tree) for part in parts), self._tree)

    def _case(self, choice: Choice, numbers: Mapping[int, int]) -> Ground:
        ground = self._atom.case(choice, numbers)
        left, relation, right = ground.tree.children
        values = [value_of(side) for side in (left, right) if isinstance(side, Tree)]
        first, second = values
        if first is not None and second is not None:
            return relation_holds(str(relation), first, second)
        return ground._replace(tree=Tree("case", ground.tree.children, ground.tree.meta))


def value_of(term: SyntaxTree) -> int | None:
    """Return the value of a ground term of numbers; `None` if it reads a variable."""
    operands = [child for child in term.children if isinstance(child, Tree)]
    if term.data == "term":
        word = _first(term)
        return int(word) if word.type == "INTEGER" else None
    known = [value for each in operands if (value := value_of(each)) is not None]
    if len(known) < len(operands):
        return None
    if term.data == "extreme":
        return min(known) if _first(term) == "min" else max(known)
    signs = (-1 if child == "-" else 1 for child in term.children if isinstance(child, Token))
    return known[0] + sum(sign * value for sign, value in zip(signs, known[1:], strict=True))


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


class SentenceFormula(Formula):
    """A requirement: predicates, and words and durations between them."""

    is_static = False

    def __init__(self, tree: SyntaxTree, predicates: Mapping[int, Formula]) -> None:
        """Take the tree, and the predicates by their index among its children."""
        self.parameters = frozenset().union(*(each.parameters for each in predicates.values()))
        self.least = sum(each.least for each in predicates.values())
        self._tree = tree
        self._predicates = predicates

    def ground(self, choice: Choice) -> GroundTree:
        """Return the requirement; what the choice makes true or false of its predicates stands there as a word."""
        grounds = {index: self._as_tree(each.ground(choice)) for index, each in self._predicates.items()}
        children = [grounds[at].tree if at in grounds else child for at, child in enumerate(self._tree.children)]
        characters = sum(each.characters for each in grounds.values())
        return GroundTree(Tree(self._tree.data, children, self._tree.meta), characters)

    def _as_tree(self, ground: Ground) -> GroundTree:
        return ground if isinstance(ground, GroundTree) else _as_word(ground, self._tree)
