"""Templates of YAML nodes: a lifted node is parsed once, and each choice of objects makes a ground node of it."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from math import prod
from typing import TYPE_CHECKING, TypeAlias, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from scbm.files.expansion.expanded_nodes import (
    MappingEntry,
    ParsedScalar,
    Piece,
    RewrittenScalar,
    entries_of,
    list_node,
    scalar_node,
    text_node,
    with_entries,
)
from scbm.files.expansion.lifted_reader import LiftedReader
from scbm.files.expansion.object_formulas import ConstantFormula, Formula
from scbm.files.expansion.stage_keys import BY_VARIABLE, KINDS_BELOW
from scbm.files.language.syntax import SyntaxFault, refuse_depth
from scbm.files.spelling import suggestion
from scbm.files.yaml.document import YamlNode
from scbm.model import Slug

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from scbm.files.expansion.lifted_names import LiftedScope
    from scbm.files.expansion.object_formulas import Choice, GroundTree
    from scbm.files.expansion.stage_keys import NodeKind
    from scbm.files.language.syntax import Start, SyntaxTree
    from scbm.files.yaml.error_collector import ErrorCollector
    from scbm.files.yaml.source_text import Scalar
    from scbm.model import Place

T = TypeVar("T")

KINDS: dict[str, NodeKind] = {
    **dict.fromkeys(("g", "gr", "guard", "goal"), "predicate"),
    **dict.fromkeys(("a", "ar", "timedout", "actions", "effects", "on_timeout"), "actions"),
    **dict.fromkeys(("request", "measures", "publishes"), "names"),
    **dict.fromkeys(("name", "reason"), "text"),
    **dict.fromkeys(("initial", "random"), "term"),
    **dict.fromkeys(("with", "assumes"), "assignments"),
    "ros": "binding",
    "simulation": "simulation",
    "requirement": "requirement",
}
"""The keys whose texts can have parameters, wherever they stand in an entry; all others are copied."""

_TRUE, _FALSE = ConstantFormula(True), ConstantFormula(False)

_MAX_UNCHECKED = 1_000
"""A ground text with fewer characters is not as deep as the language allows."""

_WARNINGS = (Slug.COUNT_ALWAYS_HOLDS,)
"""The slugs of warnings; all others are of errors."""

_IN_TEXT = re.compile(r"\{([A-Za-z_]\w*)\}", re.ASCII)
"""A parameter in a text for people or for drivers, such as the name of a topic."""


class NodeTemplate(ABC):
    """A lifted node."""

    @abstractmethod
    def nodes(self, choice: Choice) -> list[YamlNode]:
        """Return the ground nodes: one, or for an action with `forall` any number."""

    def node(self, choice: Choice) -> YamlNode:
        """Return the ground node of a template that makes one."""
        return self.nodes(choice)[0]

    def below(self, *keys: str) -> NodeTemplate | None:
        """Return the template at the end of a path of keys of mappings; `None` if there is none."""
        return None if keys else self

    def expect(self, instances: int) -> None:  # noqa: B027 - a copied node and a name are small
        """Count what the ground nodes for so many choices have at least.

        Raises:
            InputError: the file would be too large.
        """


class CopyTemplate(NodeTemplate):
    """A node without parameters."""

    def __init__(self, node: YamlNode) -> None:
        self._nodes = [node]

    def nodes(self, choice: Choice) -> list[YamlNode]:  # noqa: ARG002 - the same for all choices
        """Return the node itself."""
        return self._nodes


_Made: TypeAlias = "GroundTree | RewrittenScalar | bool"
"""What a choice of objects makes of a text."""


class ScalarTemplate(NodeTemplate):
    """A scalar node whose text is parsed.

    Attributes:
        lifted: the node.
        least: how many characters each ground text has at least.
        is_wrong: whether the text has an error.
        is_plain: whether there is nothing to expand in it.
    """

    least = 0

    def __init__(self, node: YamlNode, scope: LiftedScope, report: ErrorCollector) -> None:
        self.lifted = node
        self.is_wrong = False
        self.is_plain = False
        self._is_too_large = False
        self._has_fault = False
        self._report = report
        self._limit = scope.names.limit

    @abstractmethod
    def made(self, choice: Choice) -> _Made:
        """Return what a choice of objects makes of the text. Raises `SyntaxFault`."""

    def parsed(self, scope: LiftedScope, start: Start, read: Callable[[LiftedReader, SyntaxTree], T]) -> T | None:
        """Return what a reader makes of the tree of the text; `None` after a syntax error.

        The node of a text with nothing to expand has its tree for all choices.
        """
        reader = LiftedReader(self._written.text, scope, self.note)
        tree = reader.tree(start)
        found = None if tree is None else read(reader, tree)
        if tree is not None and not reader.is_lifted and not self.is_wrong:
            self.is_plain = True
            self.lifted = replace(self.lifted, scalar=ParsedScalar(self._written, tree))
        if isinstance(found, Formula):
            self.is_wrong = self._is_too_large  # other wrong parts decide nothing, and the rest is read
        return found

    @property
    def _written(self) -> Scalar:
        assert self.lifted.scalar is not None  # noqa: S101 - its text was parsed
        return self.lifted.scalar

    def note(self, slug: Slug, message: str, begin: int, end: int, remedy: str | None = None) -> None:
        """Note an error or a warning about characters of the text; an error without a message follows from others."""
        if slug in _WARNINGS:
            self._report.warn(slug, message, self._written.stretch(begin, end), remedy)
            return
        self.is_wrong = True
        self._is_too_large = self._is_too_large or slug is Slug.TOO_MANY_INSTANCES
        if message:
            self._report.add(slug, message, self._written.stretch(begin, end), remedy)
        else:
            self._report.leaves_out = True

    def rewritten(self, names: Mapping[tuple[int, int], str]) -> RewrittenScalar:
        """Return the text with other names; each stands for the characters that it replaces."""
        pieces: list[Piece] = []
        copied = 0
        for (begin, end), name in names.items():
            pieces += [Piece.copy(self._written, copied, begin), Piece.instead(name, self._written, begin, end)]
            copied = end
        return RewrittenScalar([*pieces, Piece.copy(self._written, copied)])

    def expect(self, instances: int) -> None:
        """Count the characters that the ground texts will have at least. Raises `InputError` if there are too many."""
        if self.is_plain or self.is_wrong or self.lifted.scalar is None:
            return
        try:
            self._limit.expect_characters(instances * self.least, 0, len(self._written.text))
        except SyntaxFault as fault:
            self.note_fault(fault)
            self.is_wrong = True

    def note_fault(self, fault: SyntaxFault) -> None:
        """Note the first part that cannot be expanded. Raises `InputError` if the file is too large as a whole."""
        if fault.message and not self._has_fault:
            self._report.add(fault.slug, fault.message, self._written.stretch(fault.begin, fault.end), fault.remedy)
        self._has_fault = True
        if self._limit.is_exceeded:
            raise self._report.error()

    def nodes(self, choice: Choice) -> list[YamlNode]:
        """Return the ground node; for a text that cannot be read or expanded one without a text, of the same shape."""
        if self.is_plain and not self.is_wrong:
            return [self.lifted]
        if not self.is_wrong:
            try:
                return [self._node(self.made(choice))]
            except SyntaxFault as fault:
                self.note_fault(fault)
        return [YamlNode(self.lifted.plain, self.lifted.place, end=self.lifted.end)]

    def _node(self, made: _Made) -> YamlNode:
        if isinstance(made, bool):
            return text_node(str(made).lower(), self.lifted.place, self.lifted.end)
        characters = len(made.text) if isinstance(made, RewrittenScalar) else made.characters
        written = self._written
        self._limit.count_characters(characters, len(written.text))
        if isinstance(made, RewrittenScalar):
            return scalar_node(made, self.lifted.place, self.lifted.end)
        if characters > _MAX_UNCHECKED:
            refuse_depth(made.tree)
        return replace(self.lifted, scalar=ParsedScalar(written, made.tree))


class ConditionTemplate(ScalarTemplate):
    """One predicate."""

    def __init__(self, node: YamlNode, scope: LiftedScope, report: ErrorCollector, *, is_static: bool) -> None:
        """Parse the predicate; with `is_static`, note each part of it that reads a variable."""
        super().__init__(node, scope, report)
        self.formula: Formula = _TRUE if node.plain is not False else _FALSE
        if is_static and not node.condemned and _is_empty(node):
            _refuse_empty(node, report)
            self.is_wrong = True
        elif node.scalar is None or node.plain is None or isinstance(node.plain, bool):
            self.is_plain = True  # the codec notes what it is instead
        else:
            read = LiftedReader.static_predicate if is_static else LiftedReader.predicate
            self.formula = self.parsed(scope, "predicate", read) or self.formula
        self.least = self.formula.least

    def made(self, choice: Choice) -> _Made:
        """Return the ground predicate."""
        return self.formula.ground(choice)


class PredicateTemplate(NodeTemplate):
    """A predicate, or a list of predicates that is their conjunction."""

    def __init__(self, node: YamlNode, scope: LiftedScope, report: ErrorCollector, *, is_static: bool = False) -> None:
        """Parse the predicates; with `is_static`, note each part of them that reads a variable."""
        self._node = node
        elements = node.elements if isinstance(node.plain, list) else [node]
        self._parts = [ConditionTemplate(element, scope, report, is_static=is_static) for element in elements]

    def conditions(self) -> Iterator[Formula]:
        """Yield the conjuncts that read no variable and have no error: they decide which choices there are."""
        return (each for part in self._parts for each in part.formula.conjuncts() if each.is_static)

    def expect(self, instances: int) -> None:
        """Count the predicates without those that a choice may decide."""
        for part in self._parts:
            part.expect(instances)

    def nodes(self, choice: Choice) -> list[YamlNode]:
        """Return the predicate; of a list, what is not true for this choice."""
        ground = [part.node(choice) for part in self._parts]
        if not isinstance(self._node.plain, list):
            return ground
        pairs = zip(self._parts, ground, strict=True)
        left = [node for part, node in pairs if node.plain is not True or part.is_plain]
        if ground and not left:
            return [text_node("true", self._node.place, self._node.end)]
        return [list_node(left, self._node.place, self._node.end)]


def _is_empty(node: YamlNode) -> bool:
    """Return whether a node has no text, a blank one, or `null` or `~`, which YAML reads as nothing."""
    return node.plain is None or not (node.text or "").strip()


def _refuse_empty(node: YamlNode, report: ErrorCollector) -> None:
    """Note that nothing stands under `where`, or a mapping: that is no condition."""
    message = "expected a condition under `where`" if isinstance(node.plain, dict) else "an empty condition"
    remedy = "write for example `where: connected(from, to) && from != to`, or leave out `where`"
    report.add(Slug.PREDICATE_SYNTAX, message, node.place, remedy)


class RequirementTemplate(ScalarTemplate):
    """A requirement: predicates, and durations between them."""

    def __init__(self, node: YamlNode, scope: LiftedScope, report: ErrorCollector) -> None:
        super().__init__(node, scope, report)
        self._requirement = self.parsed(scope, "requirement", LiftedReader.requirement)
        self.least = 0 if self._requirement is None else self._requirement.least

    def made(self, choice: Choice) -> _Made:
        """Return the requirement."""
        return True if self._requirement is None else self._requirement.ground(choice)


class ActionTemplate(ScalarTemplate):
    """An action; with `forall`, one for each object."""

    def __init__(self, node: YamlNode, scope: LiftedScope, report: ErrorCollector) -> None:
        super().__init__(node, scope, report)
        self._action = self.parsed(scope, "action", LiftedReader.action)
        if self._action is not None:
            self.least = self._action.atom.least * prod(bound.count for bound in self._action.bounds)

    def made(self, choice: Choice) -> _Made:
        """Return the action for a choice that has objects for its `forall`, too."""
        return True if self._action is None else self._action.atom.ground(choice)

    def nodes(self, choice: Choice) -> list[YamlNode]:
        """Return the actions."""
        if self.is_wrong:
            return super().nodes(choice)
        choices: list[Choice] = [choice]
        try:
            for bound in self._action.bounds if self._action is not None else ():
                choices = [inner for outer in choices for inner in bound.choices(outer)]
        except SyntaxFault as fault:
            self.note_fault(fault)
            self.is_wrong = True
            choices = [choice]
        ground = super().nodes
        return [node for each in choices for node in ground(each)]


class NameTemplate(ScalarTemplate):
    """A text that is one name or one value."""

    def __init__(self, node: YamlNode, scope: LiftedScope, report: ErrorCollector) -> None:
        super().__init__(node, scope, report)
        self._slots = LiftedReader(node.text or "", scope, self.note).names()
        self.is_plain = not self._slots

    def made(self, choice: Choice) -> _Made:
        """Return the ground name."""
        return self.rewritten({span: slot.name(choice) for span, slot in self._slots.items()})


def refuse_parameters_in_text(node: YamlNode, report: ErrorCollector, remedy: str) -> None:
    """Note each `{r}` in a text for people whose entry has no parameters, although it stands for several instances."""
    scalar = node.scalar
    if scalar is None:
        return
    for match in _IN_TEXT.finditer(scalar.text):
        message = f"there is no parameter `{match[1]}`"
        report.add(Slug.UNKNOWN_OBJECT, message, scalar.stretch(*match.span(1)), remedy)


class TextTemplate(ScalarTemplate):
    """A text for people or for drivers, in which `{r}` stands for an object."""

    def __init__(self, node: YamlNode, scope: LiftedScope, report: ErrorCollector) -> None:
        super().__init__(node, scope, report)
        found = [*_IN_TEXT.finditer(node.text or "")] if scope.parameters or scope.misses_parameters else []
        self._parameters = {match.span(): match[1] for match in found if match[1] in scope.parameters}
        self.is_plain = not self._parameters
        self.is_wrong = any(scope.is_unread(match[1]) for match in found)
        for match in found:
            if match[1] not in scope.parameters and not scope.is_unread(match[1]):
                remedy = suggestion(match[1], scope.parameters, "the parameters here are")
                self.note(Slug.UNKNOWN_OBJECT, f"there is no parameter `{match[1]}`", *match.span(1), remedy)

    def made(self, choice: Choice) -> _Made:
        """Return the text with the names of objects."""
        return self.rewritten({span: choice[name] for span, name in self._parameters.items()})


class ListTemplate(NodeTemplate):
    """A list."""

    def __init__(self, node: YamlNode, elements: Sequence[NodeTemplate]) -> None:
        self._node = node
        self._elements = elements

    def expect(self, instances: int) -> None:
        """Count what the elements have."""
        for element in self._elements:
            element.expect(instances)

    def nodes(self, choice: Choice) -> list[YamlNode]:
        """Return the list with the nodes of all its elements."""
        elements = [made for element in self._elements for made in element.nodes(choice)]
        return [list_node(elements, self._node.place, self._node.end)]


class MappingTemplate(NodeTemplate):
    """A mapping; its keys can be names with an index."""

    def __init__(
        self,
        node: YamlNode,
        entries: Sequence[tuple[MappingEntry, NodeTemplate, NodeTemplate | None]],
        report: ErrorCollector,
    ) -> None:
        """Take the entries, with the templates of their values and of those of their keys that have an index."""
        self._node = node
        self._entries = entries
        self._report = report

    def below(self, *keys: str) -> NodeTemplate | None:
        """Return the template at the end of a path of keys."""
        values = (value for entry, value, _ in self._entries if keys and entry.key == keys[0])
        return super().below(*keys) if not keys else next((value.below(*keys[1:]) for value in values), None)

    def expect(self, instances: int) -> None:
        """Count what the values have."""
        for _, value, _ in self._entries:
            value.expect(instances)

    def nodes(self, choice: Choice) -> list[YamlNode]:
        """Return the mapping; it is incomplete without the entries whose keys have errors, or occur twice."""
        ground: dict[str, MappingEntry] = {}
        written: dict[str, MappingEntry] = {}
        for entry, value, key in self._entries:
            name = entry.key if key is None else key.node(choice).text
            if name in written:
                self._refuse_duplicate(name, entry, written[name])
            elif name is not None:
                written[name] = entry
                ground[name] = MappingEntry(name, entry.place, value.node(choice), entry.end)
        mapping = with_entries(self._node, ground.values())
        return [replace(mapping, incomplete=True) if len(ground) < len(self._entries) else mapping]

    def _refuse_duplicate(self, name: str, entry: MappingEntry, first: MappingEntry) -> None:
        """Note keys that stand for one variable: for some choices, their parameters are the same object."""
        message = f"`{entry.key}`, and `{first.key}` in line {first.place.line}, both are `{name}`"
        remedy = "leave out one of them, or exclude these objects with `where`"
        self._report.add(Slug.DUPLICATE_KEY, message, entry.place, remedy)


def _argument_template(node: YamlNode, scope: LiftedScope, report: ErrorCollector) -> NodeTemplate:
    """Return the template of an argument of a request: a variable, or a text."""
    return (NameTemplate if scope.names.has_index(node.text or "") else TextTemplate)(node, scope, report)


_OF_DRIVERS: tuple[NodeKind, ...] = ("binding", "call", "choice", "calls", "fields", "argument", "readings")
"""The kinds of what stands under `ros`."""

_TEMPLATES: dict[NodeKind, Callable[[YamlNode, LiftedScope, ErrorCollector], NodeTemplate]] = {
    **dict.fromkeys(_OF_DRIVERS, TextTemplate),
    "argument": _argument_template,
    "predicate": PredicateTemplate,
    "requirement": RequirementTemplate,
    "actions": ActionTemplate,
    "names": NameTemplate,
    "assignments": NameTemplate,
    "term": NameTemplate,
    "text": TextTemplate,
}
"""The templates of scalars by what stands under their key."""


class TemplateMaker(Struct, frozen=True):
    """Makes the templates of the nodes of one entry."""

    scope: LiftedScope
    report: ErrorCollector

    def template(self, node: YamlNode, kind: NodeKind | None = None) -> NodeTemplate:
        """Return the template of a node under a key of this kind; `None` for a mapping with keys of several kinds."""
        if node.condemned or kind == "copy" or (kind == "simulation" and not isinstance(node.plain, dict)):
            return CopyTemplate(node)
        if kind == "predicate" and not isinstance(node.plain, dict):
            return PredicateTemplate(node, self.scope, self.report)
        if isinstance(node.plain, dict):
            return self._mapping(node, kind)
        if isinstance(node.plain, list) and kind != "requirement":
            return ListTemplate(node, [self._scalar_or_copy(element, kind) for element in node.elements])
        return self._scalar_or_copy(node, kind)

    def _scalar_or_copy(self, node: YamlNode, kind: NodeKind | None) -> NodeTemplate:
        if isinstance(node.plain, (dict, list)):
            return self.template(node, kind if kind in ("text", *_OF_DRIVERS) else None)
        if kind is None or node.text is None or node.plain is None or node.condemned:
            return CopyTemplate(node)
        return _TEMPLATES[kind](node, self.scope, self.report)

    def _mapping(self, node: YamlNode, kind: NodeKind | None) -> NodeTemplate:
        below = KINDS_BELOW.get(kind)
        entries = []
        for entry in entries_of(node):
            inner = KINDS.get(entry.key) if below is None else below.get(entry.key, below.get("*"))
            key = self._key(entry) if kind in BY_VARIABLE else None
            entries.append((entry, self.template(entry.node, inner), key))
        return MappingTemplate(node, entries, self.report)

    def _key(self, entry: MappingEntry) -> NodeTemplate:
        return NameTemplate(text_node(entry.key, entry.place, entry.end), self.scope, self.report)


def without(node: YamlNode, key: str) -> YamlNode:
    """Return a mapping without a key."""
    return with_entries(node, (entry for entry in entries_of(node) if entry.key != key))


def last_line(node: YamlNode) -> int:
    """Return the number of the last line of a node."""
    lines = [last_line(child) for child in (*node.items.values(), *node.elements)]
    lines += [place.line for place in node.key_places.values()]
    if node.scalar is not None and node.scalar.text:
        lines.append(node.scalar.stretch(len(node.scalar.text) - 1, len(node.scalar.text)).line)
    return max([node.place.line, *lines])


def listed_at(place: Place, end: int, words: Sequence[str]) -> YamlNode:
    """Return a list of words that stands for one place."""
    return list_node([text_node(word, place, end) for word in words], place, end)
