"""Predicates with parameters: a formula that one choice of objects turns into a ground text or into true or false."""

from __future__ import annotations

from abc import ABC, abstractmethod
from enum import IntEnum
from itertools import product
from math import prod
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from msgspec import Struct, field

from scbm.files.expansion.static_facts import joined
from scbm.files.expansion.thresholds import Joint, Threshold, at_least, copies
from scbm.model import Slug

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from scbm.files.expansion.lifted_tokens import Piece, Pieces

Choice: TypeAlias = "Mapping[str, str]"
"""An object for each parameter."""

MAX_INSTANCES = 10_000
"""Maximum number of instances of one quantifier, with those around it."""

_MAX_WORK = 2_000_000
"""Maximum number of instances of all quantifiers of a file, so that a refusal takes a few seconds at most."""

_MAX_CHARACTERS = 4 * 1024 * 1024
"""Maximum number of characters of all ground texts of a file: a file that is written by hand cannot have more."""


class Tightness(IntEnum):
    """How tightly the outermost connective of a ground text binds."""

    IMPLICATION = 0
    DISJUNCTION = 1
    CONJUNCTION = 2
    ATOM = 3


class GroundText(NamedTuple):
    """A ground predicate: its pieces, and how tightly it binds."""

    pieces: Pieces
    tightness: Tightness


Ground: TypeAlias = "GroundText | bool"


class LiftedFault(Exception):  # noqa: N818 - it never leaves this package; outside it is a diagnostic
    """An error in a lifted text: its slug, message, characters in the text, and remedy."""

    def __init__(self, slug: Slug, message: str, begin: int, end: int, remedy: str | None = None) -> None:
        super().__init__(message)
        self.slug = slug
        self.message = message
        self.begin = begin
        self.end = end
        self.remedy = remedy


class Formula(ABC):
    """A predicate with parameters.

    Attributes:
        parameters: the parameters that it reads.
        is_static: whether it reads no variable, so that each choice makes it true or false.
    """

    parameters: frozenset[str]
    is_static: bool

    @abstractmethod
    def ground(self, choice: Choice) -> Ground:
        """Return the predicate for a choice of objects. Raises `LiftedFault`."""

    def least_characters(self) -> int:
        """Return how many characters each ground text has at least; 0 if a choice may make it true or false."""
        return 0

    def conjuncts(self) -> tuple[Formula, ...]:
        """Return the operands of a conjunction, and the formula itself otherwise."""
        return (self,)

    def candidates(self, name: str, choice: Choice) -> Collection[str] | None:  # noqa: ARG002 - others use both
        """Return the objects that a parameter can have, given objects of some others; `None` if that is not known."""
        return None


class ConstantFormula(Formula):
    """`true` or `false`."""

    parameters = frozenset()
    is_static = True

    def __init__(self, truth: bool) -> None:  # noqa: FBT001 - it is what the formula is
        self._truth = truth

    def ground(self, choice: Choice) -> Ground:  # noqa: ARG002 - the same for all choices
        """Return the constant."""
        return self._truth


class ObjectTerm(Struct, frozen=True):
    """An object, or a parameter that stands for one."""

    name: str
    is_parameter: bool

    def object_in(self, choice: Choice) -> str:
        """Return the object for a choice."""
        return choice[self.name] if self.is_parameter else self.name


def parameters_of(terms: Iterable[ObjectTerm]) -> frozenset[str]:
    """Return the names of the parameters among terms."""
    return frozenset(term.name for term in terms if term.is_parameter)


class TableFormula(Formula):
    """A row of a table, two equal objects, or an object of a set: some terms are one of known tuples of objects."""

    is_static = True

    def __init__(self, terms: Sequence[ObjectTerm], rows: Mapping[tuple[str, ...], None]) -> None:
        """Take the terms, and the rows as keys: their order, unlike that of a set, is the same in each process."""
        self.parameters = parameters_of(terms)
        self._terms = tuple(terms)
        self._rows = rows
        self._joins: dict[tuple[int, ...], dict[tuple[str, ...], dict[str, None]]] = {}

    def ground(self, choice: Choice) -> Ground:
        """Return whether there is such a row."""
        return tuple([choice[t.name] if t.is_parameter else t.name for t in self._terms]) in self._rows

    def candidates(self, name: str, choice: Choice) -> Collection[str] | None:
        """Return the objects of a column in the rows with the objects of a choice, as far as there are some."""
        known = [i for i, t in enumerate(self._terms) if not t.is_parameter or (t.name != name and t.name in choice)]
        column = next(i for i, t in enumerate(self._terms) if t.is_parameter and t.name == name)
        columns = (column, *known)
        if columns not in self._joins:
            self._joins[columns] = self._join(columns)
        return self._joins[columns].get(tuple([self._terms[i].object_in(choice) for i in known]), ())

    def _join(self, columns: tuple[int, ...]) -> dict[tuple[str, ...], dict[str, None]]:
        """Return the objects of the first of some columns by those of the others."""
        found: dict[tuple[str, ...], dict[str, None]] = {}
        for row in self._rows:
            first, *others = [row[column] for column in columns]
            found.setdefault(tuple(others), {})[first] = None
        return found


class EqualityFormula(Formula):
    """`p == q` or `p != q` of objects."""

    is_static = True

    def __init__(self, left: ObjectTerm, right: ObjectTerm, *, equal: bool) -> None:
        self.parameters = parameters_of((left, right))
        self._left = left
        self._right = right
        self._equal = equal

    def ground(self, choice: Choice) -> Ground:
        """Return whether the objects are equal, or whether they differ."""
        return (self._left.object_in(choice) == self._right.object_in(choice)) is self._equal

    def candidates(self, name: str, choice: Choice) -> Collection[str] | None:
        """Return the other object of an equality."""
        own = ObjectTerm(name, is_parameter=True)
        other = self._right if self._left == own else self._left
        is_known = self._equal and (not other.is_parameter or other.name in choice)
        return (other.object_in(choice),) if is_known else None


class TextSlot(ABC):
    """A part of an atom whose text depends on the choice; it has at least one character."""

    parameters: frozenset[str]

    @abstractmethod
    def piece(self, choice: Choice) -> Piece:
        """Return the text for a choice. Raises `LiftedFault`."""


class ObjectSlot(TextSlot):
    """A parameter, which becomes its object."""

    def __init__(self, name: str, begin: int, end: int) -> None:
        self.parameters = frozenset((name,))
        self._name = name
        self._begin = begin
        self._end = end

    def piece(self, choice: Choice) -> Piece:
        """Return the object."""
        return choice[self._name], self._begin, self._end


class IndexedName(Struct):
    """A name with an index: of variables, resources or operations, or of the variables that these own.

    Attributes:
        section: the section that declares it.
        base: the name without its index.
        stem: what the ground name begins with, before the objects.
        suffix: what the ground name ends with, after the objects.
        kinds: for messages, the type of each index.
        objects: the objects that each index can have.
        declared: the objects of the ground names that exist.
    """

    section: str
    base: str
    stem: str
    suffix: str
    kinds: tuple[str, ...]
    objects: tuple[dict[str, None], ...] = ()
    declared: dict[tuple[str, ...], None] = field(default_factory=dict)

    @property
    def has_state(self) -> bool:
        """Whether the runner keeps the state of what is named: of an operation."""
        return self.section == "operations"

    @property
    def arity(self) -> int:
        """The number of indices."""
        return len(self.kinds)

    @property
    def shown(self) -> str:
        """The name with the types of its index, for messages."""
        return f"{self.base}[{', '.join(self.kinds)}]"


class IndexSlot(TextSlot):
    """A name with an index, which becomes a ground name."""

    def __init__(self, indexed: IndexedName, terms: Sequence[ObjectTerm], suffix: str, begin: int, end: int) -> None:
        self.parameters = parameters_of(terms)
        self._indexed = indexed
        self._terms = tuple(terms)
        self._suffix = suffix
        self._begin = begin
        self._end = end

    def piece(self, choice: Choice) -> Piece:
        """Return the ground name."""
        objects = tuple([choice[term.name] if term.is_parameter else term.name for term in self._terms])
        name = f"{self._indexed.stem}{joined(objects)}{self._indexed.suffix}"
        if objects not in self._indexed.declared:
            remedy = f"`{self._indexed.base}` is not declared for these objects"
            raise LiftedFault(Slug.WRONG_INDEX, f"there is no `{name}`", self._begin, self._end, remedy)
        return name + self._suffix, self._begin, self._end


class AtomFormula(Formula):
    """A predicate that reads variables, or a part of one that the language underneath reads: texts and slots."""

    is_static = False

    def __init__(self, parts: Sequence[Piece | TextSlot]) -> None:
        self._parts = tuple(parts)
        slots = (part.parameters for part in parts if isinstance(part, TextSlot))
        self.parameters = frozenset().union(*slots)

    def least_characters(self) -> int:
        """Return the number of characters, with one for each part that depends on the choice."""
        return sum(1 if isinstance(part, TextSlot) else len(part[0]) for part in self._parts)

    def pieces(self, choice: Choice) -> Pieces:
        """Return the text for a choice. Raises `LiftedFault`."""
        return [part.piece(choice) if isinstance(part, TextSlot) else part for part in self._parts]

    def ground(self, choice: Choice) -> Ground:
        """Return the atom."""
        return GroundText(self.pieces(choice), Tightness.ATOM)


class NegatedFormula(Formula):
    """`!p`."""

    def __init__(self, operand: Formula, begin: int) -> None:
        self.parameters = operand.parameters
        self.is_static = operand.is_static
        self._operand = operand
        self._begin = begin

    def ground(self, choice: Choice) -> Ground:
        """Return the negation."""
        return negated(self._operand.ground(choice), self._begin)

    def least_characters(self) -> int:
        """Return that of the operand."""
        return self._operand.least_characters()


class JointFormula(Formula):
    """A conjunction or a disjunction; operands that are true or false for a choice are left out."""

    def __init__(self, tightness: Tightness, operands: Sequence[Formula], span: tuple[int, int]) -> None:
        """Take the operands, and where the first connective between them stands."""
        self.parameters = frozenset().union(*(operand.parameters for operand in operands))
        self.is_static = all(operand.is_static for operand in operands)
        self._tightness = tightness
        self._operands = tuple(operands)
        self._span = span

    def ground(self, choice: Choice) -> Ground:
        """Return the operands that depend on variables, or what the others decide."""
        return joint(self._tightness, (operand.ground(choice) for operand in self._operands), self._span)

    def least_characters(self) -> int:
        """Return the sum of the operands, unless one of them may decide the formula."""
        return _least_sum(self._operands)

    def conjuncts(self) -> tuple[Formula, ...]:
        """Return the operands of a conjunction."""
        if self._tightness is not Tightness.CONJUNCTION:
            return (self,)
        return tuple(part for operand in self._operands for part in operand.conjuncts())

    def candidates(self, name: str, choice: Choice) -> Collection[str] | None:
        """Return what the operands of a disjunction allow, if each of them reads the parameter."""
        found: dict[str, None] = {}
        for operand in self._operands:
            more = operand.candidates(name, choice) if name in operand.parameters else None
            if more is None or self._tightness is not Tightness.DISJUNCTION:
                return None
            found |= dict.fromkeys(more)
        return found


class ImpliedFormula(Formula):
    """`p -> q`."""

    def __init__(self, left: Formula, right: Formula, span: tuple[int, int]) -> None:
        self.parameters = left.parameters | right.parameters
        self.is_static = left.is_static and right.is_static
        self._left = left
        self._right = right
        self._span = span

    def ground(self, choice: Choice) -> Ground:
        """Return the implication, or what one of its sides decides."""
        left = self._left.ground(choice)
        right = self._right.ground(choice)
        if isinstance(left, bool):
            return right if left else True
        if isinstance(right, bool):
            return right or negated(left, self._span[0])
        arrow = (" -> ", *self._span)
        text = [*bracketed(left, Tightness.DISJUNCTION, self._span), arrow, *right.pieces]
        return GroundText(text, Tightness.IMPLICATION)

    def least_characters(self) -> int:
        """Return the sum of both sides, unless one of them may decide the formula."""
        return _least_sum((self._left, self._right))


class GroupFormula(Formula):
    """A predicate in brackets, which remain around connectives."""

    def __init__(self, inner: Formula, begin: int, end: int) -> None:
        self.parameters = inner.parameters
        self.is_static = inner.is_static
        self._inner = inner
        self._begin = begin
        self._end = end

    def ground(self, choice: Choice) -> Ground:
        """Return the predicate; with its brackets if it has a connective."""
        inner = self._inner.ground(choice)
        if isinstance(inner, bool) or inner.tightness is Tightness.ATOM:
            return inner
        opening, closing = ("(", self._begin, self._begin + 1), (")", self._end - 1, self._end)
        return GroundText([opening, *inner.pieces, closing], Tightness.ATOM)

    def least_characters(self) -> int:
        """Return that of the predicate in the brackets."""
        return self._inner.least_characters()

    def conjuncts(self) -> tuple[Formula, ...]:
        """Return the conjuncts of the predicate in the brackets."""
        return self._inner.conjuncts()

    def candidates(self, name: str, choice: Choice) -> Collection[str] | None:
        """Return what the predicate in the brackets allows."""
        return self._inner.candidates(name, choice)


def _least_sum(operands: Sequence[Formula]) -> int:
    sizes = [operand.least_characters() for operand in operands]
    return sum(sizes) if all(sizes) else 0


class WorkLimit:
    """Counts the instances of all quantifiers of one file, and the characters of its ground texts.

    Attributes:
        is_exceeded: whether one of them was too large, which is noted; nothing more is built then.
    """

    def __init__(self) -> None:
        self._instances = 0
        self._characters = 0
        self._expected = 0
        self.is_exceeded = False

    def expect_characters(self, number: int, begin: int, end: int) -> None:
        """Count characters that texts will have at least. Raises `LiftedFault` if there would be too many."""
        self._expected += number
        self._refuse_characters(self._expected, begin, end)

    def count_characters(self, number: int, begin: int, end: int) -> None:
        """Count the characters of one more text. Raises `LiftedFault` if there are too many."""
        self._characters += number
        self._refuse_characters(self._characters, begin, end)

    def _refuse_characters(self, number: int, begin: int, end: int) -> None:
        if number > _MAX_CHARACTERS:
            self.is_exceeded = True
            message = f"the file has more than {_MAX_CHARACTERS:,} characters when it is written out"
            remedy = "use fewer objects, or fewer quantifiers in entries with parameters"
            raise LiftedFault(Slug.TOO_MANY_INSTANCES, message, begin, end, remedy)

    def count(self, begin: int, end: int) -> None:
        """Count one more instance. Raises `LiftedFault` if there are too many."""
        self._instances += 1
        if self._instances > _MAX_WORK:
            self.is_exceeded = True
            message = f"the quantifiers of this file have more than {_MAX_WORK:,} instances"
            raise LiftedFault(Slug.TOO_MANY_INSTANCES, message, begin, end, "use fewer objects")


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


class QuantifiedFormula(Formula):
    """`forall` (a conjunction) or `exists` (a disjunction) over objects."""

    def __init__(self, tightness: Tightness, bound: Bound, body: Formula) -> None:
        self.parameters = body.parameters - frozenset(bound.objects)
        self.is_static = body.is_static
        self._tightness = tightness
        self._bound = bound
        self._body = body

    def ground(self, choice: Choice) -> Ground:
        """Return the body for all objects, joined; no objects make `forall` true and `exists` false."""
        instances = (self._body.ground(inner) for inner in self._bound.choices(choice))
        return joint(self._tightness, instances, (self._bound.begin, self._bound.end))

    def least_characters(self) -> int:
        """Return that of the body for all objects."""
        return self._bound.count * self._body.least_characters()


def relation_holds(relation: str, count: int, number: int) -> bool:
    """Return whether a count has a relation to a number."""
    match relation:
        case "<" | "<=":
            return count < number or (relation == "<=" and count == number)
        case ">" | ">=":
            return count > number or (relation == ">=" and count == number)
    return (count == number) is (relation == "==")


class CountedFormula(Formula):
    """`count … relation number`: compares the number of objects for which a predicate holds."""

    def __init__(self, bound: Bound, body: Formula, relation: str, number: int) -> None:
        self.parameters = body.parameters - frozenset(bound.objects)
        self.is_static = body.is_static
        self._bound = bound
        self._body = body
        self._relation = relation
        self._number = number

    def ground(self, choice: Choice) -> Ground:
        """Return the comparison as a formula, or what the static instances decide."""
        instances = [self._body.ground(inner) for inner in self._bound.choices(choice)]
        texts = [each for each in instances if not isinstance(each, bool)]
        number = self._number - sum(each for each in instances if isinstance(each, bool))
        match self._relation:
            case ">=":
                return self._at_least(number, texts)
            case ">":
                return self._at_least(number + 1, texts)
            case "<":
                return self._negated(self._at_least(number, texts))
            case "<=":
                return self._negated(self._at_least(number + 1, texts))
        fewer = self._negated(self._at_least(number + 1, texts))
        exactly = joint(Tightness.CONJUNCTION, (self._at_least(number, texts), fewer), self._span)
        return exactly if self._relation == "==" else self._negated(exactly)

    @property
    def _span(self) -> tuple[int, int]:
        return self._bound.begin, self._bound.end

    def _negated(self, ground: Ground) -> Ground:
        return negated(ground, self._bound.begin)

    def _at_least(self, number: int, texts: Sequence[GroundText]) -> Ground:
        size = copies(number, len(texts))
        if size > MAX_INSTANCES:
            message = f"this count would be a predicate with {size:,} comparisons; at most {MAX_INSTANCES:,} are built"
            raise LiftedFault(Slug.TOO_MANY_INSTANCES, message, *self._span, "keep the number in a variable")
        return self._rendered(at_least(number, len(texts)), texts)

    def _rendered(self, formula: Threshold, texts: Sequence[GroundText]) -> Ground:
        if isinstance(formula, Joint):
            tightness = Tightness.CONJUNCTION if formula.connective == "&&" else Tightness.DISJUNCTION
            return joint(tightness, (self._rendered(each, texts) for each in formula.operands), self._span)
        return formula if isinstance(formula, bool) else texts[formula]


_SYMBOLS = {Tightness.CONJUNCTION: " && ", Tightness.DISJUNCTION: " || "}


def joint(tightness: Tightness, operands: Iterable[Ground], span: tuple[int, int]) -> Ground:
    """Return a conjunction or a disjunction; its connectives stand for the characters of `span`."""
    decides = tightness is Tightness.DISJUNCTION
    texts: list[GroundText] = []
    for operand in operands:
        if not isinstance(operand, bool):
            texts.append(operand)
        elif operand is decides:
            return decides
    if not texts:
        return not decides
    if len(texts) == 1:
        return texts[0]
    pieces: Pieces = []
    for text in texts:
        if pieces:
            pieces.append((_SYMBOLS[tightness], *span))
        pieces += bracketed(text, tightness, span)
    return GroundText(pieces, tightness)


def bracketed(text: GroundText, tightness: Tightness, span: tuple[int, int]) -> Pieces:
    """Return the pieces of an operand; in brackets if it binds less tightly than the connective around it."""
    if text.tightness >= tightness:
        return text.pieces
    return [("(", *span), *text.pieces, (")", *span)]


def negated(ground: Ground, begin: int) -> Ground:
    """Return the negation, whose `!` stands for the character at `begin`."""
    if isinstance(ground, bool):
        return not ground
    span = begin, begin + 1
    return GroundText([("!", *span), *bracketed(ground, Tightness.ATOM, span)], Tightness.ATOM)
