"""What is wrong with a certificate that can be read."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Flaw:
    """One reason why a certificate proves nothing.

    Attributes:
        where: the claim, the variable, or the situation and the event.
        reason: what is wrong there, lower case, without a full stop.
    """

    where: str
    reason: str

    def __str__(self) -> str:
        return f"{self.where}: {self.reason}"
