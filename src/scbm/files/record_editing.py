"""Replaces the key `recorded` in the text of a case file and keeps the comments and the layout of the rest.

The result is read again and compared with the expected case, so that an edit never changes anything else.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.files.codec.case_files import read_case, write_recorded
from scbm.files.yaml.yaml_layout import YamlLayout
from scbm.model import InputError

if TYPE_CHECKING:
    from scbm.cases import Case, RecordedRun
    from scbm.files.yaml.yaml_layout import YamlPiece
    from scbm.model import BehaviorModel

_MARK = "\ufeff"
_KEY = "recorded"


def with_record(text: str, file: str, recorded: RecordedRun, model: BehaviorModel) -> str:
    """Return the text of a case with another recorded run, which replaces the one that the text has.

    Comments inside the replaced part are lost; all else stays as it is.

    Args:
        text: the text of a case.
        file: the name of the text in errors.
        recorded: the run.
        model: the model of the case.

    Raises:
        InputError: the text is not a case of the model, or its layout does not allow the edit.
    """
    expected = replace(read_case(text, model, file), recorded=recorded)
    body = text.removeprefix(_MARK)
    layout = YamlLayout(body)
    edited = _in_flow(layout, recorded) if layout.root.is_flow else _in_block(layout, recorded)
    if not _describes(edited, expected, model):
        message = "this case has a layout to which no record can be added safely; the file is unchanged"
        raise layout.error(
            _KEY, file, message, "write the keys of the case in lines, without anchors, each as `key: value`"
        )
    return text[: len(text) - len(body)] + edited


def _in_block(layout: YamlLayout, recorded: RecordedRun) -> str:
    """Return the text of a case in lines with the record in the place of its old one, or at the end."""
    text, last = layout.text, layout.limit
    indentation = layout.indentation(layout.root.entries[0][0]) or ""
    lines = write_recorded(recorded).rstrip("\n").split("\n")
    written = f"{layout.line_end}{indentation}".join(lines)
    old = _old(layout)
    if old is not None:
        key, value = old
        return f"{text[: key.begin]}{written}{text[max(value.end, key.end) :]}"
    stop = layout.line_stop(len(text[:last].rstrip()))
    return f"{text[:stop]}{layout.line_end}{indentation}{written}{text[stop:]}"


def _in_flow(layout: YamlLayout, recorded: RecordedRun) -> str:
    """Return the text of a case in braces with the record in the place of its old one, or behind the last entry."""
    text = layout.text
    written = write_recorded(recorded, in_flow=True)
    old = _old(layout)
    if old is not None:
        key, value = old
        return f"{text[: key.begin]}{written}{text[max(value.end, key.end) :]}"
    _, last = layout.root.entries[-1]
    return f"{text[: last.end]}, {written}{text[last.end :]}"


def _old(layout: YamlLayout) -> tuple[YamlPiece, YamlPiece] | None:
    """Return the key and the value of the old record; `None` if the text has none."""
    sought = layout.key(_KEY)
    return next((entry for entry in layout.root.entries if entry[0] is sought), None)


def _describes(text: str, expected: Case, model: BehaviorModel) -> bool:
    try:
        return read_case(text, model) == expected
    except InputError:
        return False
