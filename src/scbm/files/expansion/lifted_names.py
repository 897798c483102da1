"""The names that lifted texts can use: parameters in scope, objects, types, tables, and names with an index."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple, Protocol

from scbm.files.expansion.formulas import IndexedName, ObjectTerm, WorkLimit
from scbm.files.expansion.static_facts import StaticFacts
from scbm.files.spelling import suggestion
from scbm.model import Slug

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from scbm.files.expansion.lifted_tokens import LiftedToken


class NoteFault(Protocol):
    """A callback that notes an error about the characters `begin..end` of a lifted text."""

    def __call__(self, slug: Slug, message: str, begin: int, end: int, remedy: str | None = None) -> None:
        """Note an error or a warning; an error without a message follows from others, and only makes the text wrong."""


@dataclass(frozen=True, slots=True)
class LiftedNames:
    """The names of a lifted model.

    Attributes:
        facts: types and tables.
        indexed: the names with an index.
        plain: the names without one: variables, those of resources and of the runner.
        symbols: the values of domains that list them; a name with an index may be one of them.
        limit: counts the instances of quantifiers.
    """

    facts: StaticFacts = field(default_factory=StaticFacts)
    indexed: Mapping[str, IndexedName] = field(default_factory=dict)
    plain: frozenset[str] = frozenset()
    symbols: frozenset[str] = frozenset()
    limit: WorkLimit = field(default_factory=WorkLimit)

    def has_index(self, text: str) -> bool:
        """Return whether a text begins with a name that has an index, and with that index."""
        return any(text.startswith((f"{name}[", f"{name}.")) for name in self.indexed)


class DottedIndex(NamedTuple):
    """A dotted name as a name with an index: `robot_at.r` as `robot_at` and `r`."""

    indexed: IndexedName
    parts: list[tuple[str, int, int]]
    suffix: str


@dataclass(frozen=True, slots=True)
class LiftedScope:
    """The names that one lifted text can use, with the types of its parameters.

    Attributes:
        names: the names of the model.
        parameters: the parameters with the objects that each stands for.
        kinds: their types, for messages.
    """

    names: LiftedNames
    parameters: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    kinds: Mapping[str, str] = field(default_factory=dict)

    def with_parameters(self, kinds: Mapping[str, str]) -> LiftedScope:
        """Return the scope within a quantifier, or within a lifted entry."""
        objects = {name: self.names.facts.objects(kind) for name, kind in kinds.items()}
        return LiftedScope(self.names, {**self.parameters, **objects}, {**self.kinds, **kinds})

    def term(self, word: str) -> ObjectTerm | None:
        """Return the parameter or the object of this name; `None` for any other name."""
        if word in self.parameters:
            return ObjectTerm(word, is_parameter=True)
        if word in self.names.facts.places and word not in self.names.plain:
            return ObjectTerm(word, is_parameter=False)
        return None

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
        term = self.term(word)
        allowed = indexed.objects[place]
        kind = indexed.kinds[place]
        if term is None:
            moved = self._moved_suffix(indexed, word)
            if moved is not None:
                note(Slug.UNKNOWN_OBJECT, f"there is no object `{word}`", begin, end, f"did you mean `{moved}`?")
                return None
            self._refuse_term(word, begin, end, kind, note)
            return None
        if term.is_parameter:
            if allowed.keys().isdisjoint(self.parameters[word]) and self.parameters[word]:
                message = f"`{word}` is a `{self.kinds[word]}`, and here stands a `{kind}`"
                note(Slug.WRONG_INDEX, message, begin, end)
                return None
        elif word not in allowed:
            remedy = suggestion(word, allowed, "its objects are")
            note(Slug.WRONG_INDEX, f"`{word}` is not an object of the type `{kind}`", begin, end, remedy)
            return None
        return term

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
        if not facts.is_whole:
            note(Slug.UNKNOWN_OBJECT, "", begin, end)
            return
        known = [*self.parameters, *(facts.places if kind is None else facts.objects(kind))]
        remedy = suggestion(word, known, "parameters and objects here are")
        note(Slug.UNKNOWN_OBJECT, f"there is no parameter or object `{word}`", begin, end, remedy)

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
        if term.is_parameter:
            return f"`{term.name}` is a `{self.kinds[term.name]}`"
        types = self.names.facts.types
        kind = min((kind for kind, objects in types.items() if term.name in objects), key=lambda kind: len(types[kind]))
        return f"`{term.name}` is a `{kind}`"

    def refuse_missing_index(self, indexed: IndexedName, begin: int, end: int, note: NoteFault) -> None:
        """Note a name that needs an index and has none."""
        names = {kind: name for name, kind in self.kinds.items()}
        parts = [names.get(kind, kind) for kind in indexed.kinds]
        message = f"`{indexed.shown}` needs an index here"
        remedy = f"write for example `{indexed.base}[{', '.join(parts)}]` or `{'.'.join((indexed.base, *parts))}`"
        note(Slug.WRONG_INDEX, message, begin, end, remedy)


def _indices(count: int) -> str:
    return f"{count} ind{'ex' if count == 1 else 'ices'}"
