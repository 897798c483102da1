"""A YAML text as a tree of nodes that know their place, down to the character inside a scalar.

Only data: no tags, no merge keys, no types of Python. A text that is not such YAML is an `InputError`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, ScalarNode, SequenceNode

from scbm.errors import Diagnostic, InputError, Place, Slug

if TYPE_CHECKING:
    from scbm.notation.report import Report

MOST_NODES = 200_000
MOST_DEPTH = 30

_CORE = "tag:yaml.org,2002:"

Plain: TypeAlias = "None | bool | int | float | str | list[Plain] | dict[str, Plain]"


@dataclass(slots=True)
class Node:
    """A piece of a document.

    Attributes:
        plain: its data as Python has it: dictionaries, lists, strings, numbers, booleans, `None`.
        place: where it begins.
        text: what a scalar says, whatever it stands for.
        extent: for a scalar, where it begins and ends in the source.
        style: for a scalar, the YAML style: a quote, `|`, `>`, or nothing.
        items: the children of a mapping by key.
        key_places: where those keys stand.
        elements: the children of a sequence.
    """

    plain: Plain
    place: Place
    text: str | None = None
    extent: tuple[int, int] = (0, 0)
    style: str = ""
    items: dict[str, Node] = field(default_factory=dict)
    key_places: dict[str, Place] = field(default_factory=dict)
    elements: list[Node] = field(default_factory=list)

    def get(self, key: str) -> Node | None:
        """The child under a key, if this is a mapping that has it."""
        return self.items.get(key)

    def at(self, path: tuple[int | str, ...]) -> Node:
        """The node at the end of a path, or the last one on the way that exists."""
        node = self
        for step in path:
            if isinstance(step, int) and step < len(node.elements):
                node = node.elements[step]
            elif isinstance(step, str) and step in node.items:
                node = node.items[step]
            else:
                break
        return node


class Source:
    """The text of a file, and the places in it."""

    def __init__(self, text: str, file: str) -> None:
        self.text = text
        self.file = file
        self.lines = text.splitlines()
        self._starts = [0]
        for line in text.splitlines(keepends=True):
            self._starts.append(self._starts[-1] + len(line))

    def place(self, index: int, length: int = 1) -> Place:
        """The place of the character at `index`."""
        low, high = 0, len(self._starts) - 1
        while low < high:
            middle = (low + high + 1) // 2
            if self._starts[middle] <= index:
                low = middle
            else:
                high = middle - 1
        if low == len(self.lines) and low:  # the end of a text that ends its last line
            low -= 1
        column = min(index - self._starts[low], len(self.lines[low]) if self.lines else 0) + 1
        return Place(self.file, low + 1, column, length)

    def span(self, node: Node, begin: int, end: int) -> Place:
        """The place of the characters `begin..end` inside a scalar; what lies on the first line of them."""
        offsets = self._align(node)
        last = len(offsets) - 1
        first_index = offsets[min(begin, last)]
        end_index = offsets[min(max(end - 1, begin), last)] + 1
        place = self.place(first_index)
        line_end = self._starts[place.line - 1] + len(self.lines[place.line - 1]) if self.lines else 0
        return self.place(first_index, max(1, min(end_index, line_end) - first_index))

    def _align(self, node: Node) -> list[int]:
        """For each character of a scalar, its index in the source; then the index behind the last.

        Quotes, indentation, folded line ends and escapes make the two differ. The characters of the scalar are
        looked up in the source in their order; white space stands for any white space.
        """
        index, end = node.extent
        if node.style in ("|", ">"):
            index = self.text.find("\n", index) + 1
        elif node.style:
            index += 1
        offsets = []
        for character in node.text or "":
            if character.isspace():
                offsets.append(min(index, end))
                index += index < end and self.text[index].isspace()
                continue
            while index < end and self.text[index] != character:
                index += 1
            offsets.append(min(index, max(end - 1, 0)))
            index += 1
        return [*offsets, min(index, end)]


def read_document(source: Source, report: Report) -> Node | None:
    """The tree of a YAML text. Notes duplicate keys and the like in `report`; `None` for an empty document.

    Raises:
        InputError: the text is not YAML, or it is larger or deeper than any model.
    """
    try:
        composed = YAML(typ="safe", pure=True).compose(source.text)
    except MarkedYAMLError as error:
        raise InputError([_syntax_error(error, source)]) from None
    except (YAMLError, ValueError, IndexError, RecursionError, AssertionError, AttributeError) as error:
        message = str(error).splitlines()[0] if str(error) else type(error).__name__
        diagnostic = Diagnostic(Slug.YAML_SYNTAX, f"this is not YAML: {message}", Place(source.file, 1))
        raise InputError([diagnostic]) from None
    return None if composed is None else _Reader(source, report).node(composed, 0)


def _syntax_error(error: MarkedYAMLError, source: Source) -> Diagnostic:
    mark = error.problem_mark or error.context_mark
    index = mark.index if mark is not None else 0
    place = source.place(index)
    line = source.lines[place.line - 1] if source.lines else ""
    message = " ".join(part for part in (error.context, error.problem) if part) or "this is not YAML"
    remedy = None
    value = line.split(": ", 1)[-1].lstrip("- ")
    if value.startswith("!"):
        remedy = f'a value that begins with `!` needs quotes: "{value}"'
    elif value.startswith(("&", "*", "%", "@", "`")):
        remedy = f"a value that begins with `{value[0]}` needs quotes"
    elif "\t" in line[: len(line) - len(line.lstrip())]:
        remedy = "indent with spaces: YAML does not allow tabs there"
    elif "mapping values are not allowed" in message:
        remedy = "a `: ` inside a value needs quotes around the value, or the line before lacks something"
    slug = Slug.YAML_TAG if value.startswith("!") else Slug.YAML_SYNTAX
    return Diagnostic(slug, f"this is not YAML: {message}", place, remedy, line)


class _Reader:
    """Turns composed nodes into ours, counting them: an alias is read as often as it is used."""

    def __init__(self, source: Source, report: Report) -> None:
        self._source = source
        self._report = report
        self._count = 0

    def node(self, composed: Any, depth: int) -> Node:  # noqa: ANN401 - ruamel's nodes have no common type
        self._count += 1
        place = self._source.place(composed.start_mark.index)
        if self._count > MOST_NODES or depth > MOST_DEPTH:
            raise InputError([Diagnostic(Slug.YAML_TOO_LARGE, self._limit(depth), place)])
        tag = str(composed.tag)
        if not tag.startswith(_CORE):
            shown = self._source.text[composed.start_mark.index : composed.end_mark.index].split("\n")[0]
            self._report.add(
                Slug.YAML_TAG,
                f"`{shown.split()[0] if shown.split() else tag}` is read as a YAML tag",
                place,
                f'a value that begins with `!` needs quotes: "{shown.strip()}"',
            )
        if isinstance(composed, MappingNode):
            return self._mapping(composed, place, depth)
        if isinstance(composed, SequenceNode):
            elements = [self.node(child, depth + 1) for child in composed.value]
            return Node([element.plain for element in elements], place, elements=elements)
        return self._scalar(composed, place)

    @staticmethod
    def _limit(depth: int) -> str:
        if depth > MOST_DEPTH:
            return f"nested more than {MOST_DEPTH} levels deep"
        return f"more than {MOST_NODES} YAML nodes, aliases counted as often as they are used"

    def _mapping(self, composed: MappingNode, place: Place, depth: int) -> Node:
        node = Node({}, place)
        for key_node, value_node in composed.value:
            key_place = self._source.place(key_node.start_mark.index)
            if not isinstance(key_node, ScalarNode):
                self._report.add(Slug.WRONG_SHAPE, "a key must be a name", key_place)
                continue
            key = str(key_node.value)
            key_place = self._source.place(key_node.start_mark.index, max(1, len(key)))
            if key == "<<" or str(key_node.tag).endswith(":merge"):
                self._report.add(Slug.UNKNOWN_KEY, "merge keys (`<<`) are not part of model files", key_place)
                continue
            child = self.node(value_node, depth + 1)
            if key in node.items:
                first = node.key_places[key]
                self._report.add(
                    Slug.DUPLICATE_KEY, f"`{key}` stands here twice, first in line {first.line}", key_place
                )
                continue
            node.items[key] = child
            node.key_places[key] = key_place
        node.plain = {key: child.plain for key, child in node.items.items()}
        return node

    def _scalar(self, composed: ScalarNode, place: Place) -> Node:
        text = str(composed.value)
        extent = (composed.start_mark.index, composed.end_mark.index)
        on_one_line = composed.start_mark.line == composed.end_mark.line
        length = max(1, extent[1] - extent[0]) if on_one_line else 1
        place = Place(place.file, place.line, place.column, length)
        tag = str(composed.tag)
        if not tag.startswith(_CORE):
            return Node(text, place)  # complained of already: nothing more is to be read in it
        return Node(_plain(text, tag), place, text=text, extent=extent, style=composed.style or "")


def _plain(text: str, tag: str) -> Plain:
    match tag.rpartition(":")[2]:
        case "null":
            return None
        case "bool":
            return text.lower() == "true"
        case "int":
            return _integer(text)
        case "float":
            return _float(text)
        case _:
            return text


def _integer(text: str) -> int | str:
    """Decimal integers only; `0x1F` and `1_000` stay text, which no place for an integer accepts."""
    digits = text.removeprefix("-").removeprefix("+")
    return int(text) if digits.isascii() and digits.isdigit() and len(digits) < 19 else text  # noqa: PLR2004 - 64 bits


def _float(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
