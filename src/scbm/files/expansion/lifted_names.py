"""The names that lifted texts can use: parameters in scope, objects, types, tables, and names with an index."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, NamedTuple, Protocol

from msgspec import Struct, field
from msgspec.structs import replace

from scbm.files.expansion.object_formulas import ObjectTerm, parameters_of
from scbm.files.expansion.static_facts import StaticFacts
from scbm.files.expansion.work_limit import WorkLimit
from scbm.files.language.grammar import keywords
from scbm.files.language.syntax import SyntaxFault
from scbm.files.spelling import suggestion
from scbm.model import Slug

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from scbm.files.expansion.object_formulas import Choice


class LiftedToken(NamedTuple):
    """A token of a lifted text.

    Attributes:
        text: its characters.
        begin: where it begins in the lifted text.
        end: where it ends.
        is_name: whether it is a name or a keyword, with or without dots.
    """

    text: str
    begin: int
    end: int
    is_name: bool


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
        is_whole: whether no key that declares it has an error.
    """

    section: str
    base: str
    stem: str
    suffix: str
    kinds: tuple[str, ...]
    objects: tuple[dict[str, None], ...] = ()
    declared: dict[tuple[str, ...], None] = field(default_factory=dict)
    is_whole: bool = True

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


class NameSlot(ABC):
    """A name in a text that depends on the choice; it has at least one character."""

    parameters: frozenset[str]

    @abstractmethod
    def name(self, choice: Choice) -> str:
        """Return the ground name for a choice. Raises `SyntaxFault`."""


class ObjectSlot(NameSlot):
    """A parameter, which becomes its object."""

    def __init__(self, name: str) -> None:
        self.parameters = frozenset((name,))
        self._name = name

    def name(self, choice: Choice) -> str:
        """Return the object."""
        return choice[self._name]


class IndexSlot(NameSlot):
    """A name with an index, which becomes a ground name."""

    def __init__(self, indexed: IndexedName, terms: Sequence[ObjectTerm], suffix: str, begin: int, end: int) -> None:
        self.parameters = parameters_of(terms)
        self._indexed = indexed
        self._terms = tuple(terms)
        self._suffix = suffix
        self._begin = begin
        self._end = end

    def name(self, choice: Choice) -> str:
        """Return the ground name."""
        objects = tuple(
            [t.object_in(choice) if t.added else choice[t.name] if t.is_parameter else t.name for t in self._terms]
        )
        name = f"{'.'.join((self._indexed.stem, *objects))}{self._indexed.suffix}"
        if objects not in self._indexed.declared:
            remedy = f"`{self._indexed.base}` is not declared for these objects"
            if any(term.added for term in self._terms):
                remedy = f"exclude it by a condition that stands before, or by `where`: {remedy}"
            message = f"there is no `{name}`" if self._indexed.is_whole else ""
            raise SyntaxFault(Slug.WRONG_INDEX, message, self._begin, self._end, remedy)
        return name + self._suffix


_ADDED = re.compile(r"([A-Za-z_]\w*)\s*([+-])\s*(\d{1,9})", re.ASCII)
"""A number that is added to a parameter, in an index."""

_INDEX_WORD = re.compile(r"[\w.]+")
"""What may be a parameter or an object in an index."""


class NoteFault(Protocol):
    """A callback that notes an error about the characters `begin..end` of a lifted text."""

    def __call__(self, slug: Slug, message: str, begin: int, end: int, remedy: str | None = None) -> None:
        """Note an error or a warning; an error without a message follows from others, and only makes the text wrong."""


class LiftedNames(Struct, frozen=True):
    """The names of a lifted model.

    Attributes:
        facts: types and tables.
        indexed: the names with an index.
        plain: the names without one: variables, those of resources and of the runner.
        symbols: the values of domains that list them; a name with an index may be one of them.
        limit: counts the instances of quantifiers.
        is_whole: whether all declarations could be read; if not, an unknown name may be that of a variable.
    """

    facts: StaticFacts = field(default_factory=StaticFacts)
    indexed: Mapping[str, IndexedName] = field(default_factory=dict)
    plain: frozenset[str] = frozenset()
    symbols: frozenset[str] = frozenset()
    limit: WorkLimit = field(default_factory=WorkLimit)
    is_whole: bool = True

    @property
    def plain_in_order(self) -> list[str]:
        """The names without an index, sorted."""
        return sorted(self.plain)

    def has_index(self, text: str) -> bool:
        """Return whether a text begins with a name that has an index, and with that index."""
        return any(text.startswith((f"{name}[", f"{name}.")) for name in self.indexed)


class DottedIndex(NamedTuple):
    """A dotted name as a name with an index: `robot_at.r` as `robot_at` and `r`."""

    indexed: IndexedName
    parts: list[tuple[str, int, int]]
    suffix: str


class LiftedScope(Struct, frozen=True):
    """The names that one lifted text can use, with the types of its parameters.

    Attributes:
        names: the names of the model.
        parameters: the parameters with the objects that each stands for.
        kinds: their types, for messages.
        part_file: the file of the part where the text stands; `None` in a model.
        misses_parameters: whether the parameters of the entry could not be read, so that an unknown word may be one.
        may_be_unread: whether parameters are missing, or the type of one could not be read or does not exist.
    """

    names: LiftedNames
    parameters: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    kinds: Mapping[str, str] = field(default_factory=dict)
    part_file: str | None = None
    misses_parameters: bool = False
    may_be_unread: bool = False

    def with_parameters(self, kinds: Mapping[str, str]) -> LiftedScope:
        """Return the scope within a quantifier, or within a lifted entry."""
        objects = {name: self.names.facts.objects(kind) for name, kind in kinds.items()}
        may_be_unread = self.may_be_unread or any(kind not in self.names.facts.types for kind in kinds.values())
        parameters, kinds = {**self.parameters, **objects}, {**self.kinds, **kinds}
        return replace(self, parameters=parameters, kinds=kinds, may_be_unread=may_be_unread)

    def hidden_by(self, name: str) -> str | None:
        """Return what a parameter of this name would hide: an object or a variable; `None` if it hides neither.

        In a part, only names that its own file declares count: it cannot know others, and its variables have a prefix.
        """
        place = self.names.facts.places.get(name)
        if place is not None and self.part_file in (None, place.file):
            return "an object"
        is_variable = name in self.names.plain or name in self.names.indexed
        return "a variable" if is_variable and self.part_file is None else None

    def term(self, word: str) -> ObjectTerm | None:
        """Return the parameter or the object of this name; `None` for any other name."""
        if word in self.parameters:
            return ObjectTerm(word, is_parameter=True)
        if word in self.names.facts.integers or (word in self.names.facts.places and word not in self.names.plain):
            return ObjectTerm(word, is_parameter=False)
        return None

    def is_unread(self, word: str) -> bool:
        """Return whether a word is a parameter with an error, or may be one that could not be read."""
        if word in self.kinds:
            return self.kinds[word] not in self.names.facts.types
        names = self.names
        is_known = any(word in known for known in (names.plain, names.indexed, names.symbols, names.facts.types))
        return self.misses_parameters and not is_known and self.term(word) is None and word not in keywords()

    def is_integer(self, word: str) -> bool:
        """Return whether a word is a parameter that stands for integers."""
        return word in self.kinds and self.names.facts.is_of_integers(self.kinds[word])

    def dotted(self, token: LiftedToken) -> DottedIndex | None:
        """Return a name with dots as a name with an index; `None` if it begins with none."""
        if token.text in self.names.plain:
            return None
        words = token.text.split(".")
        for length in range(len(words) - 1, 0, -1):
            indexed = self.names.indexed.get(".".join(words[:length]))
            if indexed is not None:
                return self._split(token, indexed, words, length)
        return None

    def _split(self, token: LiftedToken, indexed: IndexedName, words: Sequence[str], length: int) -> DottedIndex:
        parts: list[tuple[str, int, int]] = []
        at = token.begin + len(indexed.base) + 1
        for word in words[length:]:
            parts.append((word, at, at + len(word)))
            at += len(word) + 1
        is_state = len(parts) == indexed.arity + 1 and parts[-1][0] == "state" and indexed.has_state
        return DottedIndex(indexed, parts[:-1] if is_state else parts, ".state" if is_state else "")

    def index(
        self, indexed: IndexedName, parts: Sequence[tuple[str, int, int]], begin: int, end: int, note: NoteFault
    ) -> list[ObjectTerm] | None:
        """Return the terms of an index that is written as `parts`; `None` if it does not fit, which is noted."""
        if len(parts) != indexed.arity:
            message = f"`{indexed.shown}` has {_indices(indexed.arity)}, and this has {len(parts)}"
            note(Slug.WRONG_INDEX, message, begin, end)
            return None
        terms = [self._index_term(indexed, place, part, note) for place, part in enumerate(parts)]
        whole = [term for term in terms if term is not None]
        return whole if len(whole) == len(terms) else None

    def _index_term(
        self, indexed: IndexedName, place: int, part: tuple[str, int, int], note: NoteFault
    ) -> ObjectTerm | None:
        word, begin, end = part
        added = _ADDED.fullmatch(word)
        if added is not None:
            return self._added_term(added, begin, end, note)
        if not _INDEX_WORD.fullmatch(word):
            example = "write a parameter or an object, or for integers `i + 1` with a parameter `i`"
            note(Slug.WRONG_INDEX, f"`{word}` is no index", begin, end, example)
            return None
        term = self.term(word)
        allowed = indexed.objects[place]
        kind = indexed.kinds[place]
        if term is None:
            moved = self._moved_suffix(indexed, word)
            if moved is None:
                self._refuse_term(word, begin, end, kind, note)
            else:
                note(Slug.UNKNOWN_OBJECT, f"there is no object `{word}`", begin, end, f"did you mean `{moved}`?")
            return None
        if term.is_parameter:
            if allowed.keys().isdisjoint(self.parameters[word]) and self.parameters[word]:
                is_sure = not self.names.facts.misses_names
                message = f"`{word}` is a `{self.kinds[word]}`, and here stands a `{kind}`" if is_sure else ""
                note(Slug.WRONG_INDEX, message, begin, end)
                return None
        elif word not in allowed:
            remedy = suggestion(word, allowed, "its objects are")
            is_sure = not self.names.facts.misses_names
            message = f"`{word}` is not an object of the type `{kind}`" if is_sure else ""
            note(Slug.WRONG_INDEX, message, begin, end, remedy)
            return None
        return term

    def _added_term(self, added: re.Match[str], begin: int, end: int, note: NoteFault) -> ObjectTerm | None:
        """Return `i + 1` for a parameter that stands for integers; `None` for any other name, which is noted."""
        name = added[1]
        if self.is_integer(name):
            return ObjectTerm(name, is_parameter=True, added=int(f"{added[2]}{added[3]}"))
        term = self.term(name)
        if term is None:
            self.refuse_unknown(name, begin, begin + len(name), note)
        elif not term.is_parameter:
            remedy = "write the name of the object that is meant"
            note(Slug.WRONG_INDEX, f"`{name}` is an object, and numbers are added to parameters", begin, end, remedy)
        else:
            kind = self.kinds[name]
            is_read = not self.names.facts.is_unread(kind)
            message = f"`{name}` is a `{kind}`, and numbers are added to integers alone" if is_read else ""
            note(Slug.WRONG_INDEX, message, begin, end, f"declare integers as objects: `{kind}: 1..4`")
        return None

    def _moved_suffix(self, indexed: IndexedName, word: str) -> str | None:
        """Return `cnc_req_state.m` for the word `m_req_state` in `cnc.m_req_state`; `None` for other words."""
        ends = (index for index, character in enumerate(word) if character == "_")
        found = (f"{indexed.base}{word[end:]}.{word[:end]}" for end in ends if self.term(word[:end]) is not None)
        return next((name for name in found if name.rpartition(".")[0] in self.names.indexed), None)

    def _refuse_term(self, word: str, begin: int, end: int, kind: str, note: NoteFault) -> None:
        if word in self.names.plain or word in self.names.indexed:
            message = f"an index is a parameter or an object, and `{word}` is a variable"
            note(Slug.WRONG_INDEX, message, begin, end, "objects are chosen as the model is read")
            return
        self.refuse_unknown(word, begin, end, note, kind)

    def refuse_unknown(self, word: str, begin: int, end: int, note: NoteFault, kind: str | None = None) -> None:
        """Note a word that is neither a parameter nor an object, unless the types could not be read."""
        facts = self.names.facts
        if not facts.is_whole or self.misses_parameters:
            note(Slug.UNKNOWN_OBJECT, "", begin, end)
            return
        if word in facts.types:
            alike = [name for name, own in self.kinds.items() if own == word]
            example = next(iter((*alike, *facts.objects(word))), None)
            remedy = f"write for example `{example}`" if example is not None else None
            message = f"`{word}` is a type, and here stands a parameter or an object"
            note(Slug.UNKNOWN_OBJECT, message, begin, end, remedy)
            return
        known = [*self.parameters, *(facts.places if kind is None else facts.objects(kind))]
        remedy = suggestion(word, known, "parameters and objects here are")
        note(Slug.UNKNOWN_OBJECT, f"there is no parameter or object `{word}`", begin, end, remedy)

    @property
    def terms(self) -> list[str]:
        """The parameters in scope, and all objects."""
        return [*self.parameters, *self.names.facts.places]

    def refuse_unlike_term(self, term: ObjectTerm, token: LiftedToken, note: NoteFault) -> None:
        """Note what is compared with a parameter or an object, and is neither itself."""
        kind = self._kind_of(term)
        if token.text in self.names.plain or token.text in self.names.indexed:
            message = f"`{token.text}` is a variable, and here stands a parameter or an object"
            note(Slug.UNKNOWN_OBJECT, message, token.begin, token.end, f"write `{token.text} == {term.name}`")
        elif token.is_name and token.text not in ("true", "false"):
            self._refuse_unknown_object(token, kind, term.name, note)
        else:
            is_read = not self.names.facts.is_unread(kind)
            message = f"{self._described(term)}, and `{token.text}` is no object" if is_read else ""
            remedy = suggestion(token.text, self.names.facts.objects(kind), "its objects are")
            note(Slug.DIFFERENT_KINDS, message, token.begin, token.end, remedy)

    def _refuse_unknown_object(self, token: LiftedToken, kind: str, other: str, note: NoteFault) -> None:
        """Note a word that is compared with `other`, and is no parameter or object of its type."""
        facts = self.names.facts
        if facts.is_unread(kind) or self.is_unread(token.text):
            self.refuse_unknown(token.text, token.begin, token.end, note)
            return
        objects = facts.objects(kind)
        alike = [name for name, own in self.parameters.items() if not self._is_disjoint(own, objects)]
        known = [name for name in (*alike, *objects) if name != other]
        remedy = suggestion(token.text, known, f"parameters and objects of the type `{kind}` are")
        message = f"there is no parameter or object `{token.text}`" if facts.is_whole else ""
        note(Slug.UNKNOWN_OBJECT, message, token.begin, token.end, remedy)

    def refuse_order(self, term: ObjectTerm, token: LiftedToken, note: NoteFault) -> None:
        """Note a parameter or an object that is compared by `<` and the like."""
        is_read = not self.names.facts.is_unread(self._kind_of(term))
        message = f"{self._described(term)}, and only integers are more or less than others" if is_read else ""
        remedy = "compare objects with `==` or `!=`, or with a table that has their order"
        note(Slug.ORDER_NEEDS_INTEGERS, message, token.begin, token.end, remedy)

    def refuse_bare(self, term: ObjectTerm, token: LiftedToken, note: NoteFault) -> None:
        """Note a parameter or an object that stands where a condition is needed."""
        what = "a parameter" if term.is_parameter else "an object"
        objects = [name for name in self.names.facts.objects(self._kind_of(term)) if name != term.name]
        remedy = f"compare it: `{term.name} == {objects[0] if objects else term.name}`"
        message = f"`{term.name}` is {what}, and a condition is needed here"
        note(Slug.NOT_A_PREDICATE, message, token.begin, token.end, remedy)

    def refuse_unlike(self, left: ObjectTerm, right: ObjectTerm, span: tuple[int, int], note: NoteFault) -> None:
        """Note two terms that are compared and can never be the same object."""
        objects = self._objects(left)
        if (left.is_parameter or right.is_parameter) and objects and self._is_disjoint(objects, self._objects(right)):
            message = f"{self._described(left)}, and {self._described(right)}: they have no object in common"
            note(Slug.DISJOINT_DOMAINS, message, *span)

    def refuse_other_type(self, term: ObjectTerm, kind: str, token: LiftedToken, note: NoteFault) -> None:
        """Note a term that is never an object of the type that is needed where it stands."""
        if self._is_disjoint(self._objects(term), self.names.facts.objects(kind)):
            message = f"{self._described(term)}, and a `{kind}` is needed here"
            note(Slug.DISJOINT_DOMAINS, message, token.begin, token.end)

    def refuse_unrelated_type(self, term: ObjectTerm, kind: str, token: LiftedToken, note: NoteFault) -> None:
        """Note a term that is asked whether it is of a type, and never is; an object may be of a supertype of it."""
        types = self.names.facts.types
        objects = set(types[kind])
        if term.is_parameter or not any(term.name in of and objects < set(of) for of in types.values()):
            self.refuse_other_type(term, kind, token, note)

    def _objects(self, term: ObjectTerm) -> tuple[str, ...]:
        return self.parameters[term.name] if term.is_parameter else (term.name,)

    def _is_disjoint(self, objects: tuple[str, ...], others: tuple[str, ...]) -> bool:
        """Return whether two types have no object in common; types without objects fit all others."""
        return bool(objects) and bool(others) and self.names.facts.is_whole and set(objects).isdisjoint(others)

    def _described(self, term: ObjectTerm) -> str:
        return f"`{term.name}` is a `{self._kind_of(term)}`"

    def _kind_of(self, term: ObjectTerm) -> str:
        """Return the type of a parameter, or the smallest type of an object."""
        if term.is_parameter:
            return self.kinds[term.name]
        types = self.names.facts.types
        return min((kind for kind, objects in types.items() if term.name in objects), key=lambda kind: len(types[kind]))

    def refuse_missing_index(self, indexed: IndexedName, begin: int, end: int, note: NoteFault) -> None:
        """Note a name that needs an index and has none."""
        names = {kind: name for name, kind in self.kinds.items()}
        known = zip(indexed.kinds, indexed.objects, strict=True)
        parts = [names.get(kind) or next(iter(objects), kind) for kind, objects in known]
        message = f"`{indexed.shown}` needs an index here"
        remedy = f"write for example `{'.'.join((indexed.base, *parts))}` or `{indexed.base}[{', '.join(parts)}]`"
        note(Slug.WRONG_INDEX, message, begin, end, remedy)


def _indices(count: int) -> str:
    return f"{count} ind{'ex' if count == 1 else 'ices'}"
