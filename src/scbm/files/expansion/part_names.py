"""Copies of a part: its names get a prefix, and its parameters are replaced by arguments."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from scbm.files.expansion.expanded_nodes import (
    MappingEntry,
    Piece,
    RewrittenScalar,
    entries_of,
    list_node,
    scalar_node,
    with_entries,
)
from scbm.files.expansion.stage_keys import BINDING_PARTS, BY_VARIABLE
from scbm.files.language.scope import name_fault, reserved_names
from scbm.files.yaml.document import YamlNode
from scbm.model import Slug

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from scbm.files.yaml.source_text import Scalar
    from scbm.files.yaml.text_files import ErrorCollector

NAMED_SECTIONS = (
    "variables",
    "resources",
    "operations",
    "automatic_transitions",
    "environment",
    "goals",
    "requirements",
)
"""The sections of a model whose entries have names, in the order of the reference."""

_TEXT_SECTIONS = ("goals", "requirements")
"""Sections whose entries are texts with names."""

_TEXT_KEYS = (
    *("where", "request", "measures", "publishes", "measured", "with", "guard", "effects", "on_timeout"),
    *("g", "gr", "a", "ar", "timedout", "actions", "goal"),
)
"""Keys under which names stand, as texts or as keys; under all others are values, times and words."""

_PLAIN_KEYS = ("may_end",)
"""Keys under which no names stand, wherever they are."""

_TOKEN = re.compile(r"(?<!\w)(?!(?:min|max)\s*\()[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*", re.ASCII)
"""A name; `min` and `max` before a bracket are none."""

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


def head_of(key: str) -> str:
    """Return the name in the key of an entry, without its index or its parameters."""
    return key.partition("[")[0].rstrip()


class DeclaredNames:
    """The names that predicates, actions and lists can use and that a part declares."""

    def __init__(self, part: YamlNode) -> None:
        """Take the tree of a part, with the parts that it uses itself."""
        self._names: dict[str, None] = {}
        self._families: dict[str, None] = {}
        for key in _keys(part, "variables"):
            self._add(key, "")
        for key in _keys(part, "resources"):
            self._add(key, "", "_req_trigger", "_req_state")
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
        ends = (index for index, character in enumerate(name) if character == ".")
        return name in self._families or any(name[:end] in self._families for end in ends)


def _keys(part: YamlNode, section: str) -> Iterable[str]:
    node = part.get(section)
    return node.items if node is not None else ()


@dataclass(frozen=True, slots=True)
class PartCopy:
    """Makes one copy of a part.

    Attributes:
        prefix: what the names of the part begin with in the copy, such as `cnc1.`; empty for an included file.
        declared: the names that the part declares.
        arguments: the node that stands for each parameter.
        report: where errors go: an argument does not fit where its parameter stands.
    """

    prefix: str
    declared: DeclaredNames
    arguments: Mapping[str, YamlNode]
    report: ErrorCollector

    def section(self, name: str, node: YamlNode) -> YamlNode:
        """Return the copy of a section, whose keys are the names of its entries; without those that cannot be names."""
        has_names = name in _TEXT_SECTIONS
        return self._mapping(
            node,
            (
                None
                if name_fault(head_of(entry.key), name) is not None
                else entry._replace(key=f"{self.prefix}{entry.key}", node=self._copied(entry.node, has_names=has_names))
                for entry in entries_of(node)
            ),
        )

    def _copied(self, node: YamlNode, *, has_names: bool) -> YamlNode:
        if node.scalar is not None:
            return self._copied_scalar(node, node.scalar, has_names=has_names)
        if isinstance(node.plain, list):
            copied = list_node(
                (self._copied(each, has_names=has_names) for each in node.elements), node.place, node.end
            )
            return replace(copied, condemned=node.condemned, origin=node.origin)
        return self._mapping(node, (self._entry(entry, has_names=has_names) for entry in entries_of(node)))

    def _mapping(self, node: YamlNode, entries: Iterable[MappingEntry | None]) -> YamlNode:
        """Return a mapping with the entries whose keys are names; it is incomplete without the others."""
        copied = list(entries)
        mapping = with_entries(node, (entry for entry in copied if entry is not None))
        return replace(mapping, incomplete=True) if None in copied else mapping

    def _entry(self, entry: MappingEntry, *, has_names: bool) -> MappingEntry | None:
        key = self._key(entry.key) if has_names else entry.key
        if key is None:
            return None
        if entry.key == "ros" and not has_names:
            return entry._replace(node=self._bound(entry.node, "binding"))
        if entry.key == "name" and entry.node.scalar is not None and entry.node.text and not has_names:
            return entry._replace(node=self._prefixed(entry.node, entry.node.scalar))
        below = (has_names or entry.key in _TEXT_KEYS) and entry.key not in _PLAIN_KEYS
        return entry._replace(key=key, node=self._copied(entry.node, has_names=below))

    def _bound(self, node: YamlNode, kind: str) -> YamlNode:
        """Return the copy of a part of a binding: its names of variables are those of the copy, other words stay."""
        if node.scalar is not None:
            is_variable = kind == "argument" and (node.text in self.declared or node.text in self.arguments)
            return self._copied_scalar(node, node.scalar, has_names=is_variable)
        if isinstance(node.plain, list):
            return self._copied(node, has_names=False)
        return self._mapping(node, (self._bound_entry(entry, kind) for entry in entries_of(node)))

    def _bound_entry(self, entry: MappingEntry, kind: str) -> MappingEntry | None:
        key = self._key(entry.key) if kind in BY_VARIABLE else entry.key
        inner = BINDING_PARTS.get(kind, {})
        below = inner.get(entry.key) or inner.get("*", "words")
        return None if key is None else entry._replace(key=key, node=self._bound(entry.node, below))

    def _key(self, key: str) -> str | None:
        """Return a key that is the name of a variable: a parameter stands for the name that is its argument.

        An argument that is no name is noted; the key is `None` then.
        """
        argument = self.arguments.get(key)
        if argument is None:
            return f"{self.prefix}{key}" if key in self.declared else key
        message = _misfit(argument, "", "")
        if message is None and argument.text is not None and _VARIABLE.fullmatch(argument.text):
            return argument.text
        message = message or "stands for the name of a variable here, and this is no name"
        if not argument.condemned:
            self.report.add(Slug.WRONG_SHAPE, f"`{key}` {message}", argument.place, "give the name of a variable")
        return None

    def _prefixed(self, node: YamlNode, scalar: Scalar) -> YamlNode:
        """Return the name of a transition with the prefix."""
        pieces = (Piece.instead(self.prefix, scalar, 0, 1), Piece.copy(scalar))
        return scalar_node(RewrittenScalar(pieces), node.place, node.end)

    def _copied_scalar(self, node: YamlNode, scalar: Scalar, *, has_names: bool) -> YamlNode:
        if not scalar.style and scalar.text in self.arguments:
            return self.arguments[scalar.text]
        if not has_names:
            return node
        if not self._fits(scalar.text):
            return YamlNode(None, node.place, condemned=True, end=node.end)
        pieces = list(self._pieces(scalar))
        if len(pieces) == 1 and pieces[0].is_copy:
            return node
        return scalar_node(RewrittenScalar(pieces), node.place, node.end)

    def _fits(self, text: str) -> bool:
        """Return whether the arguments for the parameters in a text fit there; note those that do not."""
        wrong = 0
        for token in _TOKEN.finditer(text):
            argument = self.arguments.get(token[0])
            message = None if argument is None else _misfit(argument, text[: token.start()], text[token.end() :])
            if argument is not None and message is not None:
                wrong += 1
                remedy = "give one name, or one value"
                self.report.add(Slug.WRONG_SHAPE, f"`{token[0]}` {message}", argument.place, remedy)
        return not wrong

    def _pieces(self, scalar: Scalar) -> Iterator[Piece]:
        """Yield the pieces of a text with names: names of the part get the prefix, parameters become arguments."""
        end = 0
        for token in _TOKEN.finditer(scalar.text):
            argument = self.arguments.get(token[0])
            if argument is not None and argument.scalar is not None:
                yield Piece.copy(scalar, end, token.start())
                yield from _argument(argument.scalar, is_whole=scalar.text.strip() == token[0])
                end = token.end()
            elif token[0] in self.declared and self.prefix:
                yield Piece.copy(scalar, end, token.start())
                yield Piece.instead(f"{self.prefix}{token[0]}", scalar, token.start(), token.end())
                end = token.end()
        yield Piece.copy(scalar, end)


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
    return None


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
