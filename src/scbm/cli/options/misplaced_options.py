"""The error for an option that the verb does not have, and other verbs have: which these are, and what to write."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model.visible_text import shell_word, shown_path
from scbm.reports.formats import FORMATS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

REPORT = "report"
"""The verb that writes the formats of `FORMATS`."""

_STORE = "--store"


def misplaced_option(
    option: str, verb: str, arguments: Sequence[str], options: Mapping[str, Sequence[str]]
) -> str | None:
    """Return the error for an option that `verb` does not have; `None` if no other verb has it either.

    Args:
        option: the option as it is written: `--html`.
        verb: the verb.
        arguments: the arguments of the verb.
        options: the options of each verb.
    """
    if option.removeprefix("--") in FORMATS and verb != REPORT:
        return f"`{option}` is an option of `scbm {REPORT}`: {_way_to_report(option, arguments, options[verb])}."
    owners = [f"`scbm {other}`" for other, names in options.items() if option in names]
    if not owners:
        return None
    return (
        f"`{option}` is an option of {_listed(owners)}, not of `scbm {verb}`; `scbm {verb} --help` shows its options."
    )


def _way_to_report(option: str, arguments: Sequence[str], options: Sequence[str]) -> str:
    """Return what writes a report in a format of `scbm report`: through a store, if the verb writes one."""
    given = _value_of(_STORE, arguments)
    store = shown_path(given or "results.db")
    command = f"scbm {REPORT} {store} {option} {shell_word(_value_of(option, arguments) or 'FILE')}"
    if given is not None:
        return f"leave it out here, then run `{command}`"
    if _STORE in options:
        return f"add `{_STORE} {store}`, then run `{command}`"
    return f"run the cases by `scbm test` with `{_STORE} {store}`, then run `{command}`"


def _value_of(option: str, arguments: Sequence[str]) -> str | None:
    """Return the value that an option has among the arguments; `None` if there is none."""
    for word, following in zip(arguments, [*arguments[1:], ""], strict=True):
        name, equals, value = word.partition("=")
        if name == option:
            found = value if equals else following
            return None if not found or found.startswith("-") else found
    return None


def _listed(words: Sequence[str]) -> str:
    *others, last = words
    return f"{', '.join(others)} and {last}" if others else last
