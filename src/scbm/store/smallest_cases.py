"""The smallest cases that a run found for its failures, as a store keeps them beside the cases that failed."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import asdict

from scbm.model.json_reader import convert_json, read_json
from scbm.model.visible_text import counted
from scbm.testing import FailureKind  # noqa: TC001 - msgspec reads it

if TYPE_CHECKING:
    from collections.abc import Sequence

_MAX_CHARACTERS = 16 * 1024 * 1024
"""The maximum length of the JSON text in a column; a store that holds a longer one is damaged."""


class SmallestCase(Struct, frozen=True):
    """The smallest case that was found for a failure.

    Attributes:
        kind: the kind of the failure.
        subject: the requirement, expectation or end that the failure is about.
        text: the case as YAML.
        path: the file of the case, as the command line named its directory; empty if it was not written.
        operations: how many operations start until it fails.
        choices: the number of its choices.
        operations_before: how many operations started in the case that was made smaller.
        choices_before: the number of choices of that case.
        matters: the choices that matter, each alone, in words.
    """

    kind: FailureKind
    subject: str
    text: str
    path: str
    operations: int
    choices: int
    operations_before: int
    choices_before: int
    matters: tuple[str, ...]

    @property
    def what_matters(self) -> tuple[str, ...]:
        """What the failure depends on, in words: the choices, or that no choice alone matters."""
        return self.matters or ("no choice alone" if self.choices else "nothing but the goal",)

    @property
    def sizes(self) -> str:
        """The size of the case and of the one that it was made from, in words."""
        now = f"{counted(self.operations, 'operation')}, {counted(self.choices, 'choice')}"
        return f"{now}; it had {self.operations_before} and {self.choices_before}"


def smallest_text(cases: Sequence[SmallestCase]) -> str | None:
    """Return the smallest cases of a case as its column has them; `None` if there are none."""
    return json.dumps([asdict(each) for each in cases], ensure_ascii=False) if cases else None


def read_smallest_text(text: str | None) -> tuple[SmallestCase, ...]:
    """Return the smallest cases that a column holds. Raise `ValueError` and others for other texts."""
    if text is None:
        return ()
    return tuple(convert_json(read_json(text, _MAX_CHARACTERS), list[SmallestCase]))
