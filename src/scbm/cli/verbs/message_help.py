"""`scbm help`: what an error or a warning means, with an example and a remedy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from scbm.cli.message_sections import message_groups, section_lines
from scbm.cli.options.option_errors import option_error
from scbm.cli.output.terminal import results
from scbm.cli.verb_registry import VERBS
from scbm.files.spelling import suggestion

if TYPE_CHECKING:
    from scbm.model import InputError

_MESSAGE = Annotated[
    str | None,
    typer.Argument(
        metavar="SLUG", help="The word in the brackets of the message. Without it, all are listed.", show_default=False
    ),
]

_FEW = 3
"""Maximum number of slugs that are suggested for a part of their name."""


def command(message: _MESSAGE = None) -> int:
    """Explain an error or a warning, such as `unknown-variable`, with an example and a remedy."""
    if message is None:
        _list_slugs()
        return 0
    slug = message.rstrip(":").removesuffix("]").rpartition("[")[2]
    sections = {name: text for group in message_groups() for name, text in group.sections.items()}
    if slug not in sections:
        raise _unknown(slug, list(sections))
    results().lines(section_lines(sections[slug]))
    results().line(f"Documentation: docs/reference/messages.md#{slug}")
    return 0


def _list_slugs() -> None:
    """Print the slugs of all groups."""
    for group in message_groups():
        results().prose(group.title)
        results().prose(f"  {', '.join(group.sections)}")


def _unknown(word: str, slugs: list[str]) -> InputError:
    """Return the error for a word that is no slug; people also ask for the help of a verb here."""
    with_word = [slug for slug in slugs if word in slug]
    remedy = suggestion(word, slugs, "`scbm help` lists all")
    if word in {name.partition(" ")[0] for name in VERBS}:
        remedy = f"run `scbm {word} --help` for the verb"
    elif 0 < len(with_word) <= _FEW:
        remedy = f"did you mean `{'` or `'.join(with_word)}`?"
    return option_error("SLUG", f"no message has the slug `{word}`", remedy, word)
