"""Copies of a part: its names get a prefix, and its parameters are replaced by arguments."""

from __future__ import annotations

import re
from functools import partial
from typing import TYPE_CHECKING

from msgspec import Struct, field
from msgspec.structs import replace

from scbm.files.expansion.expanded_nodes import (
    MappingEntry,
    Piece,
    RewrittenScalar,
    entries_of,
    list_node,
    scalar_node,
    with_entries,
)
from scbm.files.expansion.stage_keys import BY_VARIABLE, KINDS_BELOW
from scbm.files.expansion.static_facts import WORD
from scbm.files.language.grammar import AGGREGATES, QUANTIFIERS
from scbm.files.language.scope import name_fault, reserved_names
from scbm.files.yaml.document import YamlNode
from scbm.model import Slug

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from scbm.files.expansion.stage_keys import NodeKind
    from scbm.files.yaml.error_collector import ErrorCollector
    from scbm.files.yaml.source_text import Scalar
    from scbm.model import Place

_TEXT_SECTIONS = ("goals", "requirements")
"""Sections whose entries are texts with names."""

_KINDS: dict[str, NodeKind] = {
    **dict.fromkeys(("where", "request", "measures", "publishes", "with", "guard", "assumes", "effects"), "names"),
    **dict.fromkeys(("on_timeout", "g", "gr", "a", "ar", "timedout", "actions", "goal"), "names"),
    "simulation": "simulation",
    "ros": "binding",
}
"""Keys under which names stand, as texts or as keys; under all others are values, times and words."""

_PLAIN_KEYS = ("may_end", "reachable_again", "requirements_on")
"""Keys under which no names stand, wherever they are."""

_TOKEN = re.compile(
    r"(?<!\w)(?!(?:min|max)\s*\(|(?:forall|exists|count|sum|min|max)\s+\w+\s+in\b)[A-Za-z_]\w*(?:\.\w+)*", re.ASCII
)
"""A name; `min` and `max` before a bracket are none, nor are words of quantifiers."""

_OPERATOR = re.compile(r"[-+]|[=!<>]=|[<>]|&&|\|\|")
"""An operator of predicates or sums; `->` and `<-` have one of these characters, too."""

_CONDITION = re.compile(r"[=!<>]=|>|<(?!-)|&&|\|\||!|\bin\b")
"""Tokens of conditions only: an argument with one of them cannot stand for an operand of a comparison or a sum."""

_AFTER_OPERAND = re.compile(r"\s*([=!<>]=|>|<|[-+](?!>)|in\b|\[|,)")
"""Tokens after an operand that is no whole condition."""

_BEFORE_OPERAND = re.compile(r"([=!<>]=|(?<!-)>|<-?|[-+]|[\[{,])\s*\Z")
"""Tokens before such an operand."""

_NUMBER = re.compile(r"\s*-?\d+\s*")

_VARIABLE = re.compile(r"[A-Za-z_][\w.]*(\[[\w\s,]*\])?", re.ASCII)
"""The name of a variable, perhaps with an index."""

_BOUND = re.compile(r"[A-Za-z_]\w*(?=\s+in\b|\s*:)", re.ASCII)
"""A parameter before its type."""

_QUANTIFIER = re.compile(
    rf"\b(?:{'|'.join((*QUANTIFIERS, *AGGREGATES))})\s+((?:[A-Za-z_]\w*(?:\s+in\s|\s*:)\s*\w+\s*,?\s*)+)\.", re.ASCII
)
"""A quantifier with its parameters."""

_BEFORE_TYPE = re.compile(rf"\b(?:{'|'.join((*QUANTIFIERS, *AGGREGATES))})\s[^.()]*(?:\sin\s|:)\s*\Z")
"""What stands before the type of a parameter of a quantifier."""

_NO_TYPE = "stands for a type here, and this is no name"


def head_of(key: str) -> str:
    """Return the name in the key of an entry, without its index or its parameters."""
    return key.partition("[")[0].rstrip()


def parameters_in_key(key: str) -> list[str]:
    """Return the parameters of an entry, which stand in the brackets of its key."""
    return _BOUND.findall(key.partition("[")[2])


def parameters_in_text(text: str) -> list[str]:
    """Return the parameters of the quantifiers of a predicate or an action."""
    return [name for found in _QUANTIFIER.finditer(text) for name in _BOUND.findall(found[1])]


def _bound_by(key: str) -> dict[str, str]:
    return dict.fromkeys(parameters_in_key(key), f"`{key}`")


class DeclaredNames:
    """The names that predicates, actions and lists can use and that a part declares."""

    def __init__(self, part: YamlNode) -> None:
        """Take the tree of a part, with the parts that it uses itself."""
        self._names: dict[str, None] = {}
        self._families: dict[str, None] = {}
        self._values: dict[str, None] = {}
        for key in _keys(part, "variables"):
            self._add(key, "")
        for key in _keys(part, "resources"):
            self._add(key, "", "_req_trigger", "_req_state")
        variables = part.get("variables")
        for node in variables.items.values() if variables is not None else ():
            domain = node.get("domain")
            self._values |= dict.fromkeys(each.text or "" for each in domain.elements) if domain is not None else {}
        for key in _keys(part, "operations"):
            self._add(key, ".state")

    def _add(self, key: str, *suffixes: str) -> None:
        """Add what an entry declares; `move[r in robot]` declares `move` and all names that begin with `move.`."""
        head = head_of(key)
        if head in reserved_names(""):
            return  # an error of its own; the word keeps its meaning
        if head == key:
            self._names |= dict.fromkeys(f"{head}{suffix}" for suffix in suffixes)
        else:
            self._families |= dict.fromkeys(f"{head}{'' if suffix == '.state' else suffix}" for suffix in suffixes)

    def __contains__(self, name: object) -> bool:
        if not isinstance(name, str) or name in self._names:
            return name in self._names
        return name in self._families or self.family_of(name) is not None

    def is_value(self, name: str, after: str) -> bool:
        """Return whether a name is a value of a domain here: `go` is one where the part has `go[r in robot]`, too.

        Args:
            name: a name that the part may declare.
            after: the text after the name.
        """
        return name in self._families and name in self._values and not after.lstrip().startswith("[")

    def family_of(self, name: str) -> str | None:
        """Return the name with an index that a dotted name begins with, such as `at` for `at.r1`; or `None`."""
        ends = (index for index, character in enumerate(name) if character == ".")
        return next((name[:end] for end in ends if name[:end] in self._families), None)


def _keys(part: YamlNode, section: str) -> Iterable[str]:
    node = part.get(section)
    return node.items if node is not None else ()


class PartCopy(Struct, frozen=True):
    """Makes one copy of a part.

    Attributes:
        prefix: what the names of the part begin with in the copy, such as `cnc1.`; empty for an included file.
        declared: the names that the part declares.
        arguments: the node that stands for each parameter.
        report: where errors go: an argument does not fit where its parameter stands.
        bound: the parameters of the entry that is copied, each with the entry for messages.
    """

    prefix: str
    declared: DeclaredNames
    arguments: Mapping[str, YamlNode]
    report: ErrorCollector
    bound: Mapping[str, str] = field(default_factory=dict)

    def section(self, name: str, node: YamlNode) -> YamlNode:
        """Return the copy of a section, whose keys are the names of its entries; without those that cannot be names."""
        has_names = name in _TEXT_SECTIONS
        return self._mapping(
            node,
            (
                None
                if name_fault(head_of(entry.key), name) is not None
                else replace(self, bound=_bound_by(entry.key)).section_entry(entry, has_names=has_names)
                for entry in entries_of(node)
            ),
        )

    def shared_section(self, node: YamlNode, file: str) -> YamlNode:
        """Return `types` or `tables` of a part; a parameter there is noted, as all uses share these sections.

        Args:
            node: the section, with the entries of the parts that the part uses itself.
            file: the file of the part, which alone has the parameters.
        """
        if not isinstance(node.plain, dict):
            return node  # which is noted
        return self._mapping(
            node,
            (
                entry._replace(node=self._mapping(entry.node, map(self._shared_entry, entries_of(entry.node))))
                if entry.place.file == file and isinstance(entry.node.plain, dict)
                else entry
                for entry in entries_of(node)
            ),
        )

    def _shared_entry(self, entry: MappingEntry) -> MappingEntry:
        return entry._replace(node=self._shared(entry.node, entry.key)) if entry.key in ("of", "rows") else entry

    def _shared(self, node: YamlNode, key: str) -> YamlNode:
        """Return a node under `of` or `rows`; parameters in it are noted, and stand for nothing."""
        if isinstance(node.plain, list):
            return list_node((self._shared(each, key) for each in node.elements), node.place, node.end)
        argument = self.arguments.get(node.text) if node.text is not None else None
        if argument is None or argument.text == node.text:
            return node
        slug, what = (Slug.UNKNOWN_TYPE, "a type") if key == "of" else (Slug.UNKNOWN_OBJECT, "an object")
        message = (
            f"the parameter `{node.text}` cannot stand for {what} here: all uses of a part share its types and tables"
        )
        self.report.add(slug, message, node.place, f"write {what}, or move this to the model that uses the part")
        return YamlNode(None, node.place, condemned=True, end=node.end)

    def section_entry(self, entry: MappingEntry, *, has_names: bool) -> MappingEntry | None:
        """Return the copy of an entry of a section; parameters that stand for types are replaced in its key.

        An argument that is no name of a type is noted; the entry is `None` then.
        """
        base, bracket, index = entry.key.partition("[")
        types = {word: self.arguments[word] for word in WORD.findall(index) if word in self.arguments}
        for word, argument in types.items():
            if argument.text is None or not WORD.fullmatch(argument.text):
                message = f"`{word}` {_NO_TYPE}"
                if not argument.condemned:
                    place = argument.place.used_at(entry.place)
                    self.report.add(Slug.WRONG_SHAPE, message, place, "give the name of a type")
                return None
        written = WORD.sub(lambda word: types[word[0]].text or word[0] if word[0] in types else word[0], index)
        node = self._copied(entry.node, "names" if has_names else None)
        return entry._replace(key=f"{self.prefix}{base}{bracket}{written}", node=node)

    def _copied(self, node: YamlNode, kind: NodeKind | None) -> YamlNode:
        """Return the copy of a node of a kind: of `names`, each word is one; `None` for a mapping of several kinds."""
        if node.scalar is not None:
            is_variable = kind == "argument" and (node.text in self.declared or node.text in self.arguments)
            return self._copied_scalar(node, node.scalar, has_names=is_variable or kind == "names")
        if isinstance(node.plain, list):
            copied = list_node((self._copied(each, kind) for each in node.elements), node.place, node.end)
            return replace(copied, condemned=node.condemned, origin=node.origin)
        return self._mapping(node, (self._entry(entry, kind) for entry in entries_of(node)))

    def _mapping(self, node: YamlNode, entries: Iterable[MappingEntry | None]) -> YamlNode:
        """Return a mapping with the entries whose keys are names; it is incomplete without the others."""
        copied = list(entries)
        mapping = with_entries(node, (entry for entry in copied if entry is not None))
        return replace(mapping, incomplete=True) if None in copied else mapping

    def _entry(self, entry: MappingEntry, kind: NodeKind | None) -> MappingEntry | None:
        if kind is None and entry.key == "name" and entry.node.scalar is not None and entry.node.text:
            return entry._replace(node=self._prefixed(entry.node, entry.node.scalar))
        key, place = (self._key(entry), self._key_place(entry)) if kind in BY_VARIABLE else (entry.key, entry.place)
        if key is None:
            return None
        return entry._replace(key=key, place=place, node=self._copied(entry.node, _kind_below(kind, entry.key)))

    def _key_place(self, entry: MappingEntry) -> Place:
        """Return where the key of a variable is written: that of an argument is in the file that uses the part."""
        argument = self.arguments.get(entry.key)
        return entry.place if argument is None else argument.place.used_at(entry.place)

    def _key(self, entry: MappingEntry) -> str | None:
        """Return a key that is the name of a variable: a parameter stands for the name that is its argument.

        An argument that is no name is noted; the key is `None` then.
        """
        key = entry.key
        argument = self.arguments.get(key)
        if argument is None:
            return self._indexed_key(entry)
        message = _misfit(argument, "", "")
        if message is None and argument.text is not None and _VARIABLE.fullmatch(argument.text):
            return argument.text
        message = message or "stands for the name of a variable here, and this is no name"
        if not argument.condemned:
            place = argument.place.used_at(entry.place)
            self.report.add(Slug.WRONG_SHAPE, f"`{key}` {message}", place, "give the name of a variable")
        return None

    def _indexed_key(self, entry: MappingEntry) -> str | None:
        """Return a key that is the name of a variable, perhaps with an index; `None` if an argument is no name."""
        key = entry.key
        parts: list[str] = []
        end = 0
        for token in _TOKEN.finditer(key):
            argument = self.arguments.get(token[0])
            text = self._name(token[0]) if argument is None else argument.text
            if argument is not None and (text is None or not _VARIABLE.fullmatch(text)):
                if not argument.condemned:
                    message = f"`{token[0]}` stands for a name here, and this is none"
                    place = argument.place.used_at(entry.place)
                    self.report.add(Slug.WRONG_SHAPE, message, place, "give one name")
                return None
            parts += (key[end : token.start()], text or token[0])
            end = token.end()
        return "".join((*parts, key[end:]))

    def _name(self, name: str) -> str | None:
        """Return a name of the part as the copy has it: with the prefix, and with arguments in a dotted index.

        `None` for a name that the part does not declare, and that begins with no parameter.
        """
        if name in self.declared:
            family = self.declared.family_of(name)
            if family is None:
                return f"{self.prefix}{name}"
            begin, index = f"{self.prefix}{family}", name.removeprefix(f"{family}.")
        else:
            head, _, index = name.partition(".")
            found = self._word(head)
            if found is None or not index:
                return None
            begin = found
        return ".".join((begin, *(self._word(word) or word for word in index.split("."))))

    def _word(self, name: str) -> str | None:
        """Return the argument for a parameter that is part of a dotted name; `None` for any other word."""
        argument = self.arguments.get(name)
        text = argument.text if argument is not None else None
        return text if text is not None and _TOKEN.fullmatch(text) else None

    def _prefixed(self, node: YamlNode, scalar: Scalar) -> YamlNode:
        """Return the name of a transition with the prefix."""
        pieces = (Piece.instead(self.prefix, scalar, 0, 1), Piece.copy(scalar))
        return scalar_node(RewrittenScalar(pieces), node.place, node.end)

    def _copied_scalar(self, node: YamlNode, scalar: Scalar, *, has_names: bool) -> YamlNode:
        if not scalar.style and scalar.text in self.arguments:
            argument = self.arguments[scalar.text]
            is_captured = has_names and self._is_captured(argument, self.bound, node.place)
            condemned = YamlNode(None, node.place, condemned=True, end=node.end)
            return condemned if is_captured else argument.used_at(node.place)
        if not has_names:
            return node
        if not self._fits(scalar):
            return YamlNode(None, node.place, condemned=True, end=node.end)
        pieces = list(self._pieces(scalar))
        if len(pieces) == 1 and pieces[0].is_copy:
            return node
        return scalar_node(RewrittenScalar(pieces), node.place, node.end)

    def _fits(self, scalar: Scalar) -> bool:
        """Return whether the arguments for the parameters in a text fit there; note those that do not."""
        wrong = 0
        text = scalar.text
        bound = {**self.bound, **dict.fromkeys(parameters_in_text(text), "a quantifier")}
        for token in _TOKEN.finditer(text):
            argument = self.arguments.get(token[0])
            if argument is None or argument.condemned:
                wrong += argument is not None or not self._fits_in_name(token[0], scalar, token.start())
                continue
            message = _misfit(argument, text[: token.start()], text[token.end() :])
            at = scalar.stretch(token.start(), token.end())
            if message is not None:
                wrong += 1
                remedy = "give the name of a type" if message == _NO_TYPE else "give one name, or one value"
                place = argument.place.used_at(at)
                self.report.add(Slug.WRONG_SHAPE, f"`{token[0]}` {message}", place, remedy)
            else:
                wrong += self._is_captured(argument, bound, at)
        return not wrong

    def _fits_in_name(self, name: str, scalar: Scalar, begin: int) -> bool:
        """Return whether the arguments for the parameters in a dotted name are names; note those that are not."""
        if self._name(name) is None:
            return True
        words = [word for word in name.split(".")[1:] if word in self.arguments and self._word(word) is None]
        for word in words:
            if not self.arguments[word].condemned:
                message = f"`{word}` stands for an object here, and this is no name"
                place = self.arguments[word].place.used_at(scalar.stretch(begin, begin + len(name)))
                self.report.add(Slug.WRONG_SHAPE, message, place, "give the name of an object")
        return not words

    def _is_captured(self, argument: YamlNode, bound: Mapping[str, str], at: Place) -> bool:
        """Return whether a name in an argument would be a parameter at the place `at` of the part, which is noted."""
        words = WORD.findall(argument.text) if argument.text is not None else ()
        word = next((word for word in words if word in bound), None)
        if word is not None:
            message = f"`{word}` in this argument is also a parameter of {bound[word]} in the part"
            remedy = "choose another name for the parameter in the file of the part"
            self.report.add(Slug.AMBIGUOUS_SYMBOL, message, argument.place.used_at(at), remedy)
        return word is not None

    def _pieces(self, scalar: Scalar) -> Iterator[Piece]:
        """Yield the pieces of a text with names: names of the part get the prefix, parameters become arguments."""
        end = 0
        for token in _TOKEN.finditer(scalar.text):
            argument = self.arguments.get(token[0])
            if argument is not None and argument.scalar is not None:
                yield Piece.copy(scalar, end, token.start())
                used = argument.scalar.used_at(partial(scalar.stretch, token.start(), token.end()))
                yield from _argument(used, is_whole=scalar.text.strip() == token[0])
                end = token.end()
            elif self.declared.is_value(token[0], scalar.text[token.end() :]):
                continue
            elif (name := self._name(token[0])) is not None and name != token[0]:
                yield Piece.copy(scalar, end, token.start())
                yield Piece.instead(name, scalar, token.start(), token.end())
                end = token.end()
        yield Piece.copy(scalar, end)


def _kind_below(kind: NodeKind | None, key: str) -> NodeKind | None:
    """Return the kind of what stands under a key of a mapping: names of the part, a binding, or values and words."""
    if kind == "names":
        return None if key in _PLAIN_KEYS else "names"
    below = KINDS_BELOW.get(kind, _KINDS)
    return below.get(key, below.get("*"))


def _misfit(argument: YamlNode, before: str, after: str) -> str | None:
    """Return why an argument cannot stand between two texts; `None` if it can."""
    if argument.condemned:
        return None
    if argument.scalar is None:
        found = "a list" if isinstance(argument.plain, list) else "a mapping"
        return f"stands for a name here, and this is {found}"
    text = argument.scalar.text
    if argument.plain is None or not text.strip():
        return "stands for a name here, and this is empty"
    if not _is_balanced(text):
        return "stands for one unit here, and the brackets of this do not match"
    is_operand = _AFTER_OPERAND.match(after) or _BEFORE_OPERAND.search(before)
    if is_operand and _CONDITION.search(text):
        return "stands for a name here, and this is a condition"
    return _NO_TYPE if _BEFORE_TYPE.search(before) and not WORD.fullmatch(text) else None


def _is_balanced(text: str) -> bool:
    """Return whether each bracket of a text closes one that it opens."""
    depth = 0
    for character in text:
        depth += (character == "(") - (character == ")")
        if depth < 0:
            return False
    return depth == 0


def _argument(argument: Scalar, *, is_whole: bool) -> Iterator[Piece]:
    """Yield the pieces of an argument; in brackets where it is an operand, as with `a + b` for `v` in `10 - v`."""
    is_single = is_whole or _NUMBER.fullmatch(argument.text) or not _OPERATOR.search(argument.text)
    if is_single or "<-" in argument.text:
        yield Piece.copy(argument)
        return
    end = len(argument.text)
    yield Piece.instead("(", argument, 0, 1)
    yield Piece.copy(argument)
    yield Piece.instead(")", argument, end - 1, end)
