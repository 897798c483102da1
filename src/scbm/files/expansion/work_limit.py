"""Limits of what one file is expanded to, so that a file that is too large is refused in a few seconds."""

from __future__ import annotations

from scbm.files.language.syntax import MAX_CHARACTERS, SyntaxFault
from scbm.model import Slug

MAX_INSTANCES = 10_000
"""Maximum number of instances of one quantifier, with those around it."""

_MAX_WORK = 2_000_000
"""Maximum number of instances of all quantifiers of a file, so that a refusal takes a few seconds at most."""

_MAX_CHARACTERS = 4 * 1024 * 1024
"""Maximum number of characters of all ground texts of a file: a file that is written by hand cannot have more."""


class WorkLimit:
    """Counts the instances of all quantifiers of one file, and the characters of its ground texts.

    Attributes:
        is_exceeded: whether one of them was too large, which is noted; nothing more is built then.
    """

    def __init__(self) -> None:
        self._instances = 0
        self._characters = 0
        self._expected = 0
        self.is_exceeded = False

    def expect_characters(self, number: int, begin: int, end: int) -> None:
        """Count characters that texts will have at least. Raises `SyntaxFault` if there would be too many."""
        self._expected += number
        self._refuse_characters(self._expected, begin, end)

    def count_characters(self, number: int, end: int) -> None:
        """Count the characters of one more text. Raises `SyntaxFault` if it has too many, or all texts have.

        Args:
            number: the number of its characters.
            end: that of the lifted text, which errors underline.
        """
        if number > MAX_CHARACTERS:
            message = f"this text has about {number:,} characters written out; at most {MAX_CHARACTERS:,} fit"
            raise SyntaxFault(Slug.TOO_MANY_INSTANCES, message, 0, end, "use fewer objects")
        self._characters += number
        self._refuse_characters(self._characters, 0, end)

    def _refuse_characters(self, number: int, begin: int, end: int) -> None:
        if number > _MAX_CHARACTERS:
            self.is_exceeded = True
            message = f"the file has more than {_MAX_CHARACTERS:,} characters when it is written out"
            remedy = "use fewer objects, or fewer quantifiers in entries with parameters"
            raise SyntaxFault(Slug.TOO_MANY_INSTANCES, message, begin, end, remedy)

    def count(self, begin: int, end: int) -> None:
        """Count one more instance. Raises `SyntaxFault` if there are too many."""
        self._instances += 1
        if self._instances > _MAX_WORK:
            self.is_exceeded = True
            message = f"the quantifiers of this file have more than {_MAX_WORK:,} instances"
            raise SyntaxFault(Slug.TOO_MANY_INSTANCES, message, begin, end, "use fewer objects")
