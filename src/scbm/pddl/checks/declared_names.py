"""The names that a domain and its problem declare: types, objects, predicates and functions."""

from __future__ import annotations

import re
from difflib import get_close_matches
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from scbm.files.spelling import nearest

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from scbm.pddl.checks.pddl_nodes import FileFaults, PddlNode

Kinds: TypeAlias = "tuple[str, ...]"
"""The types of a parameter: several for `either`; none if its type has an error."""

Term: TypeAlias = "tuple[str, Kinds]"
"""A variable or an object as a text for `unified-planning`, and its types."""

_TYPO = 0.8
"""The ratio of `difflib` from which on an undeclared parent is no type of its own: `thng` is not, beside `thing`."""

ANY_OBJECT = "object"
"""The type of what has no type; all types are below it."""

_UNKNOWN = ""
"""The parent of a type whose declaration has an error."""

NAME = re.compile(r"[a-z][a-z0-9_-]*")
_RESERVED = (
    *("and", "or", "not", "imply", "forall", "exists", "when", "preference", "either", "=", "<", ">", "<=", ">="),
    *("assign", "increase", "decrease", "scale-up", "scale-down", "define"),
)
"""Words with a meaning in conditions and effects, which no predicate can have as its name."""


class DeclaredFluent(Struct, frozen=True):
    """A predicate or a numeric function as it is declared."""

    name: str
    parameters: tuple[tuple[str, Kinds], ...]
    is_numeric: bool

    def __str__(self) -> str:
        kinds = [(n, f"(either {' '.join(k)})" if len(k) > 1 else shown_kinds(k)) for n, k in self.parameters]
        return f"({' '.join([self.name, *(f'?{name} - {kind}' for name, kind in kinds)])})"


def shown_kinds(kinds: Kinds) -> str:
    """Return types as a message shows them."""
    return " or ".join(kinds) or ANY_OBJECT


class PddlNames:
    """The names of a domain, and those of its problem after `read_objects`.

    Attributes:
        objects: the types of the objects: of the constants, until `read_objects` adds the objects of the problem.
        fluents: the predicates and functions.
        more_parents: for types that are declared with several types above them, those after the first one.
        problem_objects: the names of the objects of the problem, for messages about the domain.
    """

    def __init__(self) -> None:
        self._parents: dict[str, str] = {}
        self.more_parents: dict[str, dict[str, None]] = {}
        self._unions: dict[frozenset[str], str] = {}
        self._is_object_used = False
        self.objects: dict[str, Kinds] = {}
        self.fluents: dict[str, DeclaredFluent] = {}
        self._object_types: dict[str, None] = {}
        self.problem_objects: dict[str, None] = {}

    def reserve(self, objects: Sequence[PddlNode], of_problem: Iterable[str]) -> None:
        """Take the declarations of all objects, of both files, before these are read."""
        self._object_types = dict.fromkeys(kind.word for sign, kind in pairwise(objects) if sign.word == "-")
        self.problem_objects = dict.fromkeys(of_problem)

    # types

    def read_types(self, parts: Sequence[PddlNode], faults: FileFaults) -> None:
        """Read the types of a domain."""
        entries = list(_groups(parts, faults))
        written: dict[str, dict[str, None]] = {}
        for name, kind in entries:
            if not _is_name(name, faults, "type") or name.word == ANY_OBJECT:
                continue
            above = "" if kind is None else str(kind)
            if name.word in written and (not above or above in written[name.word]):
                faults.wrong(name, f"the type `{name.word}` is declared twice", "leave out one of them")
            written.setdefault(name.word, {})[above] = None
            self._parents[name.word] = ANY_OBJECT
        for _, kind in entries:
            if kind is not None and NAME.fullmatch(kind.word) and kind.word != ANY_OBJECT and not self._is_typo(kind):
                self._parents.setdefault(kind.word, ANY_OBJECT)
        for name, kind in entries:
            if kind is not None and name.word in self._parents:
                kinds = self.kinds(kind, faults)
                if len(kinds) > 1:
                    faults.refuse(kind, "a type below several types cannot be expressed in a model", "name one type")
                elif kinds and self.is_below(kinds[0], name.word):
                    faults.wrong(name, f"the type `{name.word}` is below itself", "name another type after the `-`")
                else:
                    self._add_parent(name.word, kinds[0] if kinds else _UNKNOWN)

    def _add_parent(self, name: str, parent: str) -> None:
        """Note a type above another one: the first one, or one more, unless it is above the type already."""
        if self._parents[name] == ANY_OBJECT:
            self._parents[name] = parent
        elif parent != ANY_OBJECT and not self.is_below(name, parent):
            self.more_parents.setdefault(name, {})[parent] = None

    def _above(self, kind: str) -> tuple[str, ...]:
        """Return the types just above a type."""
        return (self._parents[kind], *self.more_parents.get(kind, ()))

    def _is_typo(self, node: PddlNode) -> bool:
        """Return whether a parent that is declared nowhere is almost the name of a declared type."""
        return node.word not in self._parents and bool(get_close_matches(node.word, self._parents, 1, _TYPO))

    def kinds(self, node: PddlNode | None, faults: FileFaults) -> Kinds:
        """Return the types that an expression names; none if it has an error."""
        if node is None:
            return (ANY_OBJECT,)
        if node.is_list and (node.head != "either" or not node.parts[1:] or any(p.is_list for p in node.parts)):
            faults.wrong(node, "a type is expected here", "write the name of a type, or `(either TYPE TYPE)`")
            return ()
        words = node.parts[1:] if node.is_list else (node,)
        known = [each.word for each in words if self._is_type(each, faults)]
        if len(known) < len(words):
            return ()
        return tuple(k for k in dict.fromkeys(known) if not any(k != o and self.is_below(k, o) for o in known))

    def _is_type(self, node: PddlNode, faults: FileFaults) -> bool:
        if node.word in self._parents or node.word == ANY_OBJECT:
            return True
        remedy = remedy_for(node.word, self._parents, "declare it in `:types`")
        faults.wrong(node, f"there is no type `{node.word}`", remedy)
        return False

    def is_below(self, kind: str, other: str) -> bool:
        """Return whether a type is another one, or below it, as far as its declaration has no error."""
        if kind in (other, ANY_OBJECT, _UNKNOWN):
            return kind in (other, _UNKNOWN)
        return any(self.is_below(each, other) for each in self._above(kind))

    def fits(self, kinds: Kinds, wanted: Kinds) -> bool:
        """Return whether all objects of types are of one of the wanted types."""
        return not wanted or all(any(self.is_below(kind, each) for each in wanted) for kind in kinds)

    def can_be_equal(self, first: Term, second: Term) -> bool:
        """Return whether two terms can stand for one object."""
        objects = [term for term in (first, second) if term[0].startswith("o-")]
        if len(objects) > 1:
            return first == second
        candidates = [kinds for _, kinds in objects] or [(kind,) for kind in self._kinds_of_objects()]
        return any(self.fits(kinds, first[1]) and self.fits(kinds, second[1]) for kinds in candidates)

    def have_objects(self, kinds: Kinds) -> bool:
        """Return whether there are objects of some types."""
        return any(self.fits((kind,), kinds) for kind in self._kinds_of_objects())

    def _kinds_of_objects(self) -> list[str]:
        return [*(kind for kind in self._object_types if kind in self._parents), ANY_OBJECT]

    def read_unions(self, nodes: Iterable[PddlNode], faults: FileFaults) -> None:
        """Make a type for each `(either TYPE TYPE)` within expressions, above these types."""
        found: dict[frozenset[str], PddlNode] = {}
        for node in nodes:
            for each in _either_lists(node):
                words = [p.word for p in each.parts[1:]]
                if all(w in self._parents for w in words):
                    kinds = frozenset(k for k in words if not any(k != o and self.is_below(k, o) for o in words))
                    found.setdefault(kinds, each)
        for kinds in sorted(found, key=lambda kinds: (len(kinds), sorted(kinds))):
            if len(kinds) > 1:
                self._unite(kinds, found[kinds], faults)

    def _unite(self, kinds: frozenset[str], node: PddlNode, faults: FileFaults) -> None:
        members = dict.fromkeys(kind for kind in self._parents if kind in kinds)
        for inner, name in self._unions.items():
            if inner < kinds and all(k in members for k in inner):
                members = dict.fromkeys([*(k for k in members if k not in inner), name])
        first, *others = members
        common = [each for each in self._above(first) if all(each in self._above(other) for other in others)]
        if not common or not others:
            shown = shown_kinds(tuple(members))
            message = f"`either` of types that have no common type just above cannot be expressed in a model: {shown}"
            faults.refuse(node, message, "declare a type above them, and name it here")
            return
        parent = common[0]
        siblings = [kind for kind in self._parents if parent in self._above(kind)]
        if len(siblings) == len(members) and parent not in self._object_types:
            self._unions[kinds] = parent
            return
        base = name = "_or_".join(members)
        number = 1
        while name in self._parents:
            number += 1
            name = f"{base}_{number}"
        self._parents[name] = parent
        for kind in members:
            above = dict.fromkeys(each for each in self._above(kind) if each != parent)
            self._parents[kind] = name
            self.more_parents |= {kind: above} if above else {}
        self._unions[kinds] = name

    def type_text(self, kinds: Kinds) -> str:
        """Return the type for types in a text for `unified-planning`."""
        kind = self.one_type(kinds)
        self._is_object_used |= kind == ANY_OBJECT
        return kind if kind == ANY_OBJECT else f"t-{kind}"

    def one_type(self, kinds: Kinds) -> str:
        """Return the type for types: the one above them if there are several."""
        return self._unions.get(frozenset(kinds), ANY_OBJECT) if len(kinds) > 1 else kinds[0] if kinds else ANY_OBJECT

    def types_text(self) -> str:
        """Return the types as a text for `unified-planning`, which is complete after all other texts."""
        above = {kind: parent if parent == ANY_OBJECT else f"t-{parent}" for kind, parent in self._parents.items()}
        entries = [f"t-{kind} - {parent}" for kind, parent in above.items()]
        entries += [ANY_OBJECT] if self._is_object_used else []
        return f"(:types {' '.join(entries)})" if entries else ""

    # objects

    def read_objects(self, parts: Sequence[PddlNode], faults: FileFaults) -> str:
        """Read constants or objects, and return them as a text for `unified-planning`."""
        shown = []
        for name, kind in _groups(parts, faults):
            kinds = self.kinds(kind, faults)
            if len(kinds) > 1 and kind is not None:
                faults.refuse(kind, "an object of several types cannot be expressed in a model", "name one type")
            if not _is_name(name, faults, "object"):
                continue
            if name.word in self.objects:
                faults.wrong(name, f"the object `{name.word}` is declared twice", "leave out one of them")
            self.objects[name.word] = kinds
            shown.append(f"o-{name.word} - {self.type_text(kinds[:1])}")
        return " ".join(shown)

    # predicates and functions

    def read_fluents(self, parts: Sequence[PddlNode], faults: FileFaults, *, are_numeric: bool) -> str:
        """Read predicates or functions, and return them as a text for `unified-planning`."""
        what = "function" if are_numeric else "predicate"
        shown = []
        for node in self._fluent_nodes(parts, faults) if are_numeric else parts:
            if not node.head:
                faults.wrong(node, f"a {what} is expected here", f"write `(NAME ?PARAMETER - TYPE)` for a {what}")
                continue
            name = node.parts[0]
            parameters = self.read_parameters(node.parts[1:], faults)
            if not _is_name(name, faults, what):
                continue
            if name.word in _RESERVED:
                faults.wrong(
                    name, f"`{name.word}` has a meaning in conditions or effects already", "choose another name"
                )
            elif name.word in self.fluents:
                other = "function" if self.fluents[name.word].is_numeric else "predicate"
                faults.wrong(name, f"there is a {other} `{name.word}` already", "choose another name, or leave it out")
            declared = DeclaredFluent(name.word, tuple(parameters.items()), are_numeric)
            self.fluents.setdefault(name.word, declared)
            # `unified-planning` knows one type above another: it gets all arguments as objects, which are checked here
            given = dict.fromkeys(parameters, (ANY_OBJECT,)) if self.more_parents else parameters
            shown.append(f"(f-{name.word} {self.parameters_text(given)})")
        return " ".join(shown)

    def _fluent_nodes(self, parts: Sequence[PddlNode], faults: FileFaults) -> Iterator[PddlNode]:
        """Yield the functions of a section, without their types."""
        rest = list(parts)
        while rest:
            node = rest.pop(0)
            if node.word != "-":
                yield node
            elif not rest:
                faults.wrong(node, "a type is expected after this `-`", "write `- number`")
            else:
                kind = rest.pop(0)
                if kind.word != "number" and self.kinds(kind, faults):
                    message = "functions whose values are objects cannot be expressed in a model"
                    faults.refuse(kind, message, "write a predicate")

    def read_parameters(self, parts: Sequence[PddlNode], faults: FileFaults) -> dict[str, Kinds]:
        """Return the types of declared parameters or variables, by their names without `?`."""
        found: dict[str, Kinds] = {}
        for node, kind in _groups(parts, faults):
            kinds = self.kinds(kind, faults)
            if node.is_list or not node.word.startswith("?") or not NAME.fullmatch(node.word[1:]):
                remedy = f"write `?{node.word}`" if NAME.fullmatch(node.word) else "write `?NAME - TYPE`"
                faults.wrong(node, f"`{_short(node)}` is no parameter: parameters begin with `?` and a letter", remedy)
                found[node.word.lstrip("?")] = kinds
                continue
            if node.word[1:] in found:
                faults.wrong(node, f"the parameter `{node.word}` is declared twice", "choose another name")
            found[node.word[1:]] = kinds
        return found

    def parameters_text(self, parameters: Mapping[str, Kinds]) -> str:
        """Return parameters as a text for `unified-planning`."""
        return " ".join(f"?{name} - {self.type_text(kinds)}" for name, kinds in parameters.items())


def remedy_for(name: str, known: Iterable[str], otherwise: str) -> str:
    """Return the remedy for an unknown name: the most similar one, or what else to do."""
    near = nearest(name, known)
    return f"did you mean `{near}`?" if near else otherwise


def _short(node: PddlNode) -> str:
    text = str(node)
    return text if len(text) <= 40 else f"{text[:39]}…"  # noqa: PLR2004 - so much fits into a line with a message


def _is_name(node: PddlNode, faults: FileFaults, what: str) -> bool:
    if not node.is_list and NAME.fullmatch(node.word):
        return True
    message = f"`{_short(node)}` is no name for {'an' if what == 'object' else 'a'} {what}"
    faults.wrong(node, message, "names begin with a letter, and have letters, digits, `-` and `_`")
    return False


def _groups(parts: Sequence[PddlNode], faults: FileFaults) -> Iterator[tuple[PddlNode, PddlNode | None]]:
    """Yield the names of a list with types, each with its type; `None` without one."""
    waiting: list[PddlNode] = []
    rest = list(parts)
    while rest:
        node = rest.pop(0)
        if node.word.startswith("-") and NAME.fullmatch(node.word[1:]):
            faults.wrong(node, f"a blank is missing between `-` and `{node.word[1:]}`", f"write `- {node.word[1:]}`")
            rest.insert(0, replace(node, word=node.word[1:]))
        elif node.word.startswith("?") and node.word.endswith("-") and rest and NAME.fullmatch(rest[0].word):
            faults.wrong(node, f"a blank is missing between `{node.word[:-1]}` and `-`", f"write `{node.word[:-1]} -`")
            waiting.append(replace(node, word=node.word[:-1]))
        elif node.word != "-":
            waiting.append(node)
            continue
        if not waiting:
            faults.wrong(node, "no name stands before this `-`", "write `NAME - TYPE`")
        if not rest:
            faults.wrong(node, "a type is expected after this `-`", "write `NAME - TYPE`")
            break
        kind = rest.pop(0)
        yield from ((each, kind) for each in waiting)
        waiting = []
    yield from ((each, None) for each in waiting)


def _either_lists(node: PddlNode) -> Iterator[PddlNode]:
    if node.head == "either":
        yield node
    for part in node.parts:
        yield from _either_lists(part)
