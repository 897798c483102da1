"""The events of a YAML text: by the fast parser in C where it agrees with the parser in Python, else by the latter.

The parser in C (libyaml, package `ruamel.yaml.clib`) is ten times as fast. It follows YAML 1.1, and it differs in rare
texts: tabs, marks of documents, directives, anchors, tags, and the places of missing values. The parser in Python
reads these texts, and all texts with errors, so errors and places do not depend on whether the package is installed.
"""

from __future__ import annotations

import re
from itertools import islice
from typing import TYPE_CHECKING

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    CollectionEndEvent,
    CollectionStartEvent,
    DocumentEndEvent,
    DocumentStartEvent,
    NodeEvent,
    ScalarEvent,
)

from scbm.files.yaml.yaml_faults import yaml_fault
from scbm.model import Diagnostic, InputError, Slug

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from ruamel.yaml.events import Event

    from scbm.files.yaml.source_text import SourceText

_FAULTS = (YAMLError, ValueError, IndexError, AssertionError, AttributeError)
"""The exceptions of both parsers."""

_PLAIN = re.compile(r"[\n\r\x20-\x7e]*")
"""A text of ASCII that both parsers treat alike, as most texts."""

_UNUSUAL = r"[^\n\r\x20-\x7e\xa0-\u2027\u202a-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]"
"""A character that the parsers treat differently: tabs, control characters, line ends of Unicode, byte order marks.

It is compiled when it is needed: so many characters take 1 % of the time of a command.
"""


MAX_NODES = 200_000
"""Maximum number of nodes of a document; a published model of 3,160 operations has 76,027."""

MAX_DEPTH = 30
"""Maximum number of levels of a document. Both parsers take time in the square of the number of open brackets."""


def events_of(source: SourceText) -> Iterator[Event]:
    """Yield the events of a YAML text. Raises `InputError` where it is not YAML, has too many nodes or is too deep."""
    fast = fast_events(source)
    if fast is not None:
        _refuse_many(fast, source)
        yield from fast
        return
    try:
        yield from _of_limited_depth(YAML(typ="safe", pure=True).parse(source.text), source)
    except _FAULTS as error:
        raise InputError([yaml_fault(error, source)]) from None


def _of_limited_depth(events: Iterable[Event], source: SourceText) -> Iterator[Event]:
    """Yield events as the parser finds them. Raises `InputError` at the first node that is too deep."""
    depth = 0
    for event in events:
        if depth > MAX_DEPTH and isinstance(event, NodeEvent):
            raise too_large(source, f"nested more than {MAX_DEPTH} levels deep", event.start_mark.index)
        depth += isinstance(event, CollectionStartEvent) - isinstance(event, CollectionEndEvent)
        yield event


def too_many_nodes(source: SourceText, index: int) -> InputError:
    """Return the error for a document with too many nodes, at the first node that is one too many."""
    return too_large(source, f"more than {MAX_NODES} YAML nodes; an alias counts as often as it is used", index)


def too_large(source: SourceText, message: str, index: int) -> InputError:
    """Return the error for a document that is larger than a limit allows."""
    place = source.place(index)
    return InputError([Diagnostic(Slug.YAML_TOO_LARGE, message, place, source_line=source.lines[place.line - 1])])


def _refuse_many(events: Sequence[Event], source: SourceText) -> None:
    """Raise `InputError` for too many nodes before the first one is read, which takes longer than parsing."""
    if len(events) <= MAX_NODES:
        return
    nodes = (event for event in events if isinstance(event, NodeEvent))
    surplus = next(islice(nodes, MAX_NODES, None), None)
    if surplus is not None:
        raise too_many_nodes(source, surplus.start_mark.index)


def fast_events(source: SourceText) -> list[Event] | None:
    """Return the events by the parser in C; `None` if it is not installed, or where the parsers could differ.

    Raises `InputError` where the text is too deep.
    """
    text = source.text
    if not _PLAIN.fullmatch(text) and re.search(_UNUSUAL, text):
        return None
    events: list[Event] = []
    try:
        for event in _of_limited_depth(YAML(typ="safe").parse(text), source):
            if _is_doubtful(event):
                return None
            events.append(event)
    except _FAULTS:
        return None
    return events


def _is_doubtful(event: Event) -> bool:
    """Return whether the parser in Python may give another event: the parsers differ there, or a place may."""
    if isinstance(event, DocumentStartEvent | DocumentEndEvent):
        return bool(event.explicit)
    if isinstance(event, ScalarEvent) and not event.value and not event.style:
        return True
    if isinstance(event, NodeEvent) and event.anchor is not None:
        return True
    return isinstance(event, AliasEvent) or getattr(event, "tag", None) is not None
