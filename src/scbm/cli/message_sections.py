"""The sections of `messages.md`: what each error and each warning means, with an example and a remedy."""

from __future__ import annotations

import re
from importlib.resources import files
from typing import TYPE_CHECKING, NamedTuple

from rich.text import Text

if TYPE_CHECKING:
    from collections.abc import Iterator

_BLOCK = re.compile(r"^```\w+\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_LINK = re.compile(r"\[([^]]+)\]\([^)]+\)")


class MessageGroup(NamedTuple):
    """The slugs below one heading, each with its section in Markdown, in the order of the file."""

    title: str
    sections: dict[str, str]


def message_groups() -> list[MessageGroup]:
    """Return all groups of slugs, in the order of the file."""
    groups = _parts(messages_text(), "## ")
    return [MessageGroup(title, _parts(text, "### ")) for title, text in groups.items()]


def messages_text() -> str:
    """Return the file with all sections, in Markdown."""
    return files("scbm.cli").joinpath("messages.md").read_text(encoding="utf-8")


def _parts(text: str, mark: str) -> dict[str, str]:
    """Return what stands below each heading of one level."""
    _, *parts = f"\n{text}".split(f"\n{mark}")
    return {title: body.strip() for title, _, body in (part.partition("\n") for part in parts)}


def section_lines(section: str) -> Iterator[Text]:
    """Return a section as lines of a report: each paragraph in one line, examples indented and as they are."""
    for index, part in enumerate(_BLOCK.split(section)):
        if index % 2:
            yield from (Text(f"    {line}".rstrip(), no_wrap=True) for line in part.splitlines())
            yield Text()
            continue
        for paragraph in filter(None, part.strip().split("\n\n")):
            items = re.split(r"\n(?=- )", _LINK.sub(r"\1", paragraph))
            yield from (Text(" ".join(item.split())) for item in items)
            yield Text()
