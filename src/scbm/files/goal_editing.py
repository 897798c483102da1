"""Adds goals to the text of a model file and keeps its comments and layout.

The result is read again and compared with the expected model, so that an edit never changes anything else.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from msgspec.structs import replace
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.events import NodeEvent, ScalarEvent

from scbm.files.codec.model_files import read_model
from scbm.files.file_writer import replace_file
from scbm.files.language.expressions import parse_predicate
from scbm.files.language.scope import Scope
from scbm.files.yaml.text_files import read_file
from scbm.files.yaml.yaml_layout import TextEdit, YamlLayout, with_edits
from scbm.model import Diagnostic, InputError, Place, Slug

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from scbm.files.yaml.yaml_layout import YamlPiece
    from scbm.model import BehaviorModel

_MARK = "\ufeff"
_SECTION = "goals"
_COMMENT = re.compile(r"#[^\r\n]*")
_SPACES = 2
"""The indentation of entries where the file shows none."""


class _NewGoal(NamedTuple):
    """A goal to be added.

    Attributes:
        name: the name of the goal.
        predicate: the text of its predicate.
        comment: a comment above the goal, where the layout allows one.
    """

    name: str
    predicate: str
    comment: str | None = None


def add_goals(path: Path, goals: Sequence[tuple[str, str, str | None]]) -> None:
    """Add goals to a model file, all or none. Raises `InputError` as `with_goals`, or if the file cannot be written."""
    text = with_goals(read_file(path), str(path), goals)
    try:
        replace_file(path, text.encode())
    except OSError as error:
        message = f"cannot write the file: {(error.strerror or str(error)).lower()}"
        raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place(str(path)))]) from None


def with_goals(text: str, file: str, goals: Sequence[tuple[str, str, str | None]]) -> str:
    """Return the text of a model with more goals, in the style of the text.

    A goal that the model has already, with this name and this predicate, is not added again.

    Args:
        text: the text of a model.
        file: the name of the text in errors.
        goals: for each goal its name, its predicate, and a comment.

    Raises:
        InputError: the text is not a model, a predicate does not fit the model, a name is taken, or the layout of the
            text does not allow the edit.
    """
    model = read_model(text, file)
    new = [goal for goal in (_NewGoal(*goal) for goal in goals) if not _is_there(model, goal)]
    if not new:
        return text
    expected = _expected(model, new, file)
    body = text.removeprefix(_MARK)
    edited = _edited(body, new)
    if edited is None or not _describes(edited, expected):
        raise _layout_error(body, new, file)
    return text[: len(text) - len(body)] + edited


def _is_there(model: BehaviorModel, goal: _NewGoal) -> bool:
    known = model.goal(goal.name)
    return known is not None and known == parse_predicate(goal.predicate, Scope.of(model), file=goal.name)


def _expected(model: BehaviorModel, goals: Sequence[_NewGoal], file: str) -> BehaviorModel:
    """Return the model that the edited text must describe."""
    scope = Scope.of(model)
    taken = dict(model.goals)
    for goal in goals:
        if goal.name in taken:
            message = f"the model has a goal `{goal.name}` already"
            raise InputError([Diagnostic(Slug.DUPLICATE_NAME, message, Place(file), "choose another name")])
        taken[goal.name] = parse_predicate(goal.predicate, scope, file=goal.name)
    return replace(model, goals=tuple(taken.items()))


def _describes(text: str, expected: BehaviorModel) -> bool:
    try:
        return read_model(text) == expected
    except InputError:
        return False


def _layout_error(text: str, goals: Sequence[_NewGoal], file: str) -> InputError:
    """Return the error for a layout that does not allow the edit."""
    entries = "; ".join(f"`{_entry(goal, in_flow=False)}`" for goal in goals)
    message = f"`{_SECTION}` has a layout that cannot be edited safely; the file is unchanged"
    return YamlLayout(text).error(_SECTION, file, message, f"add it by hand: {entries}")


def _edited(text: str, goals: Sequence[_NewGoal]) -> str | None:
    """Return the text with the goals; `None` if the layout does not allow the edit."""
    layout = YamlLayout(text)
    edits = _edits(layout, layout.section(_SECTION), goals)
    return with_edits(text, edits) if edits else None


def _edits(layout: YamlLayout, section: YamlPiece | None, goals: Sequence[_NewGoal]) -> list[TextEdit]:
    if section is None and layout.root.is_flow:
        entries = ", ".join(_entry(goal, in_flow=True) for goal in goals)
        return _into_flow(layout, layout.root, [(f"{_SECTION}: {{{entries}}}", None)])
    if section is None:
        return _as_section(layout, goals)
    if section.is_block:
        return _into_block(layout, section, goals)
    if not section.is_flow:
        return []
    if layout.root.is_block and not section.entries and not layout.text[section.begin : section.end].strip("{ }"):
        return _into_empty_braces(layout, section, goals)
    return _into_flow(layout, section, [(_entry(goal, in_flow=True), goal.comment) for goal in goals])


def _into_block(layout: YamlLayout, section: YamlPiece, goals: Sequence[_NewGoal]) -> list[TextEdit]:
    """Return the edits that add lines after the last entry and after the comments that belong to it."""
    indentation = layout.indentation(section.entries[0][0])
    if indentation is None:
        return []
    last = section.entries[-1]
    stop = layout.behind_comments(last[1].end, len(indentation))
    is_spaced = len(section.entries) > 1 and layout.has_blank_line(section.entries[-2][1].end, last[0].begin)
    return [TextEdit(stop, stop, _lines(layout, indentation, goals, is_spaced=is_spaced))]


def _into_empty_braces(layout: YamlLayout, section: YamlPiece, goals: Sequence[_NewGoal]) -> list[TextEdit]:
    """Return the edits that replace the braces of `goals: {}` by lines."""
    key = layout.key(_SECTION) or section
    colon = layout.text.find(":", key.end) + 1
    stop = layout.line_stop(section.end)
    indentation = (layout.indentation(key) or "") + _step(layout)
    return [TextEdit(colon, section.end, ""), TextEdit(stop, stop, _lines(layout, indentation, goals))]


def _as_section(layout: YamlLayout, goals: Sequence[_NewGoal]) -> list[TextEdit]:
    """Return the edit that adds a section at the end."""
    text = layout.text[: layout.limit]
    stop = layout.line_stop(len(text.rstrip()))
    keys = [key for key, _ in layout.root.entries]
    ends = [value.end for _, value in layout.root.entries]
    is_spaced = any(layout.has_blank_line(end, key.begin) for end, key in zip(ends, keys[1:], strict=False))
    indentation = layout.indentation(keys[0]) or ""
    head = f"{layout.line_end * (2 if is_spaced else 1)}{indentation}{_SECTION}:"
    return [TextEdit(stop, stop, head + _lines(layout, indentation + _step(layout), goals))]


def _step(layout: YamlLayout) -> str:
    """Return the indentation of entries relative to the keys of their sections."""
    for key, value in layout.root.entries:
        outer = layout.indentation(key)
        inner = layout.indentation(value.entries[0][0]) if value.is_block and value.entries else None
        if outer is not None and inner is not None:
            return inner[len(outer) :]
    return " " * _SPACES


def _into_flow(layout: YamlLayout, piece: YamlPiece, entries: Sequence[tuple[str, str | None]]) -> list[TextEdit]:
    """Return the edits that add entries before the closing brace; each gets a line if the last entry has one."""
    if not piece.entries:
        begin = layout.text.index("{", piece.begin) + 1
        return [TextEdit(begin, begin, ", ".join(entry for entry, _ in entries))]
    key, value = piece.entries[-1]
    comma = _comma(layout.text, value.end, piece.end - 1)
    indentation = layout.indentation(key)
    behind = value.end if comma is None else comma + 1
    if indentation is None:
        added = ", ".join(entry for entry, _ in entries)
        return [TextEdit(behind, behind, f", {added}" if comma is None else f" {added},")]
    lines = [line for entry, comment in entries for line in (*_comments(comment), f"{entry},")]
    lines = lines if comma is not None else [*lines[:-1], lines[-1].removesuffix(",")]
    added = "".join(f"{layout.line_end}{indentation}{line}" for line in lines)
    brace = piece.end - 1
    stop = min(layout.line_stop(behind), len(layout.text[:brace].rstrip()))
    separator = [] if comma is not None else [TextEdit(value.end, value.end, ",")]
    return [*separator, TextEdit(max(stop, behind), max(stop, behind), added)]


def _comma(text: str, begin: int, end: int) -> int | None:
    """Return the position of the comma after the last entry; `None` if it has none."""
    blanked = _COMMENT.sub(lambda match: " " * len(match[0]), text[begin:end])
    index = blanked.find(",")
    return None if index < 0 else begin + index


def _lines(layout: YamlLayout, indentation: str, goals: Sequence[_NewGoal], *, is_spaced: bool = False) -> str:
    """Return the goals as lines, each preceded by a line end."""
    lines: list[str] = []
    for goal in goals:
        lines += [""] if is_spaced else []
        lines += [f"{indentation}{line}" for line in (*_comments(goal.comment), _entry(goal, in_flow=False))]
    return "".join(f"{layout.line_end}{line}" for line in lines)


def _comments(comment: str | None) -> list[str]:
    lines = comment.splitlines() if comment else []
    return ["# " + "".join(character for character in line if character.isprintable()) for line in lines]


# how a predicate is written


def _entry(goal: _NewGoal, *, in_flow: bool) -> str:
    return f"{goal.name}: {_quoted(goal.predicate, in_flow=in_flow)}"


def _quoted(text: str, *, in_flow: bool) -> str:
    """Return the text as a YAML scalar: without quotes where it needs none."""
    if _reads_as(text, text, in_flow=in_flow):
        return text
    doubled = text.replace("'", "''")
    return f"'{doubled}'"


def _reads_as(written: str, text: str, *, in_flow: bool) -> bool:
    """Return whether YAML reads a written value as this text."""
    document = f"{{k: {written}, z: z}}" if in_flow else f"k: {written}\n"
    try:
        events = list(YAML(typ="safe", pure=True).parse(document))
    except YAMLError:
        return False
    nodes = [event for event in events if isinstance(event, NodeEvent)]
    values = [event.value for event in nodes if isinstance(event, ScalarEvent) and event.tag is None]
    rest = ["z", "z"] if in_flow else []
    return len(nodes) == len(values) + 1 and values == ["k", text, *rest]
