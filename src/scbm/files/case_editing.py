"""Changes the text of a case to other data, and keeps every character of all parts that have the same data.

Comments, quotes and layout stay, and so do keys that the editor does not know. The new text is parsed again, and its
data are compared with the wanted ones, so that an edit never changes anything else.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scbm.files.codec.case_files import CaseDocument, parse_case
from scbm.files.yaml.yaml_layout import TextEdit, TextLines, with_edits
from scbm.files.yaml.yaml_writer import FlowList, FlowMapping, dump
from scbm.model import Diagnostic, InputError, Place, Slug

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.source_text import SourceText


def edited_case(document: CaseDocument, data: Mapping[str, Any]) -> CaseDocument:
    """Return a case with other data, changed as little as possible.

    Args:
        document: the case as it is.
        data: all data of the new case: dictionaries, lists, strings, numbers and booleans.

    Raises:
        InputError: the layout of the text does not allow the edit, as with an anchor in the changed part.
    """
    source = document.source
    text = with_edits(source.text, _TextEditor(source).root_edits(document.tree, data))
    edited = parse_case(text, source.file)
    if edited.tree.plain != data:
        message = "this case has a layout that cannot be edited safely; its text is unchanged"
        remedy = "write the keys of the case in lines, without anchors, each as `key: value`"
        raise InputError([Diagnostic(Slug.WRONG_SHAPE, message, Place(source.file), remedy)])
    return edited


def _flow(value: Any) -> str:  # noqa: ANN401 - any data
    """Return a value on one line, as it can stand in braces."""
    return dump(FlowMapping({"k": value})).strip().removeprefix("{k: ").removesuffix("}")


def _section(value: Any) -> Any:  # noqa: ANN401 - any data
    """Return a new section of a case in lines: one for each of its entries."""
    if isinstance(value, dict):
        return {key: _compact(each) for key, each in value.items()}
    return [_compact(each) for each in value] if isinstance(value, list) else value


def _compact(value: Any) -> Any:  # noqa: ANN401 - any data
    if isinstance(value, dict):
        return FlowMapping(value)
    return FlowList(value) if isinstance(value, list) else value


class _TextEditor(TextLines):
    """Makes the edits of one text."""

    def __init__(self, source: SourceText) -> None:
        super().__init__(source.text)
        self._source = source

    def root_edits(self, root: YamlNode, data: Mapping[str, Any]) -> Iterator[TextEdit]:
        """Yield the edits of a whole case; its new sections stand at its end, in lines."""
        added = {key: value for key, value in data.items() if key not in root.items}
        if not added or self._is_flow(root):
            yield from self._edits(root, dict(data))
            return
        yield from self._edits(root, {key: value for key, value in data.items() if key in root.items})
        indentation = " " * self._column(self._begin_of_key(root, next(iter(root.items))))
        lines = "".join(dump({key: _section(value)}) for key, value in added.items()).splitlines()
        stop = self.line_stop(root.value_ends[next(reversed(root.items))])
        yield TextEdit(stop, stop, "".join(f"{self.line_end}{indentation}{line}" for line in lines))

    def _edits(self, node: YamlNode, new: Any) -> Iterator[TextEdit]:  # noqa: ANN401 - any data
        old = node.plain
        if old == new and type(old) is type(new):
            return
        if isinstance(new, dict) and node.items:
            yield from self._mapping(node, new)
        elif isinstance(new, list) and node.elements:
            yield from self._sequence(node, new)
        else:
            yield self._replaced(node, new)

    def _replaced(self, node: YamlNode, new: Any) -> TextEdit:  # noqa: ANN401 - any data
        begin = self._begin(node)
        if node.scalar is not None and not node.scalar.text and not node.scalar.style:  # stands before the next part
            begin = len(self.text[:begin].rstrip())
        blank = " " if self.text[begin - 1 : begin] == ":" else ""
        return TextEdit(begin, max(begin, node.end), blank + _flow(new))

    def _mapping(self, node: YamlNode, new: dict[str, Any]) -> Iterator[TextEdit]:
        gone = [key for key in node.items if key not in new]
        starts = {key: self._begin_of_key(node, key) for key in node.items}
        if not new or (gone and (self._is_flow(node) or not all(map(self._begins_line, starts.values())))):
            yield self._replaced(node, new)
            return
        for key, child in node.items.items():
            if key in new:
                yield from self._edits(child, new[key])
            else:
                yield self._without_lines(starts[key], node.value_ends[key])
        added = [f"{_flow(key)}: {_flow(value)}" for key, value in new.items() if key not in node.items]
        end = node.value_ends[next(reversed(node.items))]
        if added and self._is_flow(node):
            yield TextEdit(end, end, "".join(f", {entry}" for entry in added))
        elif added:
            stop, indentation = self.line_stop(end), " " * self._column(starts[next(iter(node.items))])
            yield TextEdit(stop, stop, "".join(f"{self.line_end}{indentation}{entry}" for entry in added))

    def _sequence(self, node: YamlNode, new: list[Any]) -> Iterator[TextEdit]:
        """Yield the edits of a list: those between the elements at its beginning and at its end that are equal."""
        old = node.elements
        first = _common(old, new)
        last = min(_common(old[::-1], new[::-1]), len(old) - first, len(new) - first)
        before, after = old[first : len(old) - last], new[first : len(new) - last]
        if len(before) > len(after) and (not new or self._is_flow(node)):
            yield self._replaced(node, new)
            return
        for element, value in zip(before, after, strict=False):
            yield from self._edits(element, value)
        for element in before[len(after) :]:
            yield self._without_lines(self._dash(element), element.end)
        yield from self._inserted(node, first + len(before), after[len(before) :])

    def _inserted(self, node: YamlNode, index: int, values: Sequence[Any]) -> Iterator[TextEdit]:
        if not values:
            return
        written = list(map(_flow, values))
        if self._is_flow(node):
            begin = node.elements[index - 1].end if index else self._begin(node.elements[0])
            yield TextEdit(begin, begin, "".join(f", {each}" if index else f"{each}, " for each in written))
            return
        dash = self._dash(node.elements[0])
        indentation = " " * self._column(dash)
        stop = self.line_stop(node.elements[index - 1].end) if index else dash
        lines = [
            f"{self.line_end}{indentation}- {each}" if index else f"- {each}{self.line_end}{indentation}"
            for each in written
        ]
        yield TextEdit(stop, stop, "".join(lines))

    # positions

    def _begin(self, node: YamlNode) -> int:
        return self._source.index(node.place) if node.scalar is None else node.scalar.begin

    def _begin_of_key(self, node: YamlNode, key: str) -> int:
        return self._source.index(node.key_places[key])

    def _is_flow(self, node: YamlNode) -> bool:
        return self.text[self._begin(node) : self._begin(node) + 1] in ("{", "[")

    def _dash(self, element: YamlNode) -> int:
        return self.text.rindex("-", 0, self._begin(element))

    def _column(self, index: int) -> int:
        return index - self.line_begin(index)

    def _begins_line(self, index: int) -> bool:
        return not self.text[self.line_begin(index) : index].strip()

    def _without_lines(self, begin: int, end: int) -> TextEdit:
        """Return the edit that removes whole lines."""
        stop = self.text.find("\n", end)
        return TextEdit(self.line_begin(begin), len(self.text) if stop < 0 else stop + 1, "")


def _common(nodes: Sequence[YamlNode], values: Sequence[Any]) -> int:
    """Return the number of equal elements at the beginning."""
    count = 0
    for node, value in zip(nodes, values, strict=False):
        if node.plain != value:
            break
        count += 1
    return count
