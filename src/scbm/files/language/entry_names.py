"""The names of entries: what is a name, and which words cannot be one."""

from __future__ import annotations

import re
from typing import NamedTuple

from scbm.files.language.grammar import keywords
from scbm.model import Slug
from scbm.model.variables import NO_OPERATION

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*", re.ASCII)
"""The syntax of names; dots join the names of parts, entries and objects."""

_NEARLY_NAME = re.compile(r"[\w .-]{1,60}", re.ASCII)
"""A text that is a name once its spaces and signs are replaced."""

_RESERVED_OPERATIONS = (NO_OPERATION, "current", "plan", "automatic")
"""Words that operations cannot have as names: other names begin with them, or they mean "no operation"."""


class NameFault(NamedTuple):
    """The fault of the name of an entry."""

    slug: Slug
    message: str
    remedy: str


def reserved_names(section: str) -> tuple[str, ...]:
    """Return the words that entries of a section of a model cannot have as their names."""
    return (*keywords(), *(_RESERVED_OPERATIONS if section == "operations" else ()))


def name_fault(name: str, section: str = "") -> NameFault | None:
    """Return what is wrong with the name of an entry of a section; `None` if it can have this name."""
    if not NAME.fullmatch(name):
        message = f"`{name}` is not a name" if name else "a name is missing"
        return NameFault(Slug.BAD_NAME, message, _name_remedy(name))
    if name in reserved_names(section):
        return NameFault(Slug.RESERVED_NAME, f"`{name}` is a reserved word", "choose another name")
    return None


def _name_remedy(name: str) -> str:
    fixed = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")
    if not fixed or fixed[0].isdigit() or not _NEARLY_NAME.fullmatch(name):
        return "names are letters from a to z, digits and `_`, and begin with a letter"
    return f"write `{fixed}`"
