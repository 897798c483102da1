"""What stands between a cell and its first run, or its next one."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable


class Lack(StrEnum):
    """What sort of thing is missing or wrong: who tells of it says what to do."""

    RIVAL = "another tester is at work"
    FOREIGN = "a node was not started for this tester"
    VERSION = "a node speaks another version"
    MODEL = "a node has another version of the model"
    TIME_SCALE = "a real resource cannot be made faster"
    CHILD = "a node that was started here cannot work"
    CONTROLLER = "nobody is the controller"
    RESOURCES = "nobody simulates some resources"
    STRANGER = "somebody is there who cannot be understood"
    DRIVER = "a real resource is not reached"


@dataclass(frozen=True, slots=True)
class Reason:
    """One thing that is missing or wrong.

    Attributes:
        lack: what sort of thing.
        message: one sentence, lower case, without a full stop.
        resources: those that nobody simulates, as far as that is known.
    """

    lack: Lack
    message: str
    resources: tuple[str, ...] = ()


class NotReadyError(Exception):
    """A cell is not what a tester needs."""

    def __init__(self, reasons: Iterable[Reason]) -> None:
        self.reasons = tuple(reasons)
        super().__init__("; ".join(reason.message for reason in self.reasons))
