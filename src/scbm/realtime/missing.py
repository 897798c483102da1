"""Which real drivers are not there, and why."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.realtime.links import Link


@dataclass
class MissingDrivers:
    """Looks for real resources.

    Attributes:
        links: those to real resources, by their names.
    """

    links: Mapping[str, Link]
    _suspects: tuple[str, ...] = ()

    def look(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """A sentence about each that is not there; and those of them that no waiting mends.

        A driver that does not go with its binding may just be being replaced: it is believed at the second look.
        """
        before, self._suspects = self._suspects, ()
        troubles, mismatched = [], []
        for name, link in self.links.items():
            if link.is_there:
                continue
            alone = link.why_alone()
            why = f"nobody is at {_listed(link.missing)}" if alone is None else alone.why
            troubles.append(f"`{name}` is not reached: {why}")
            if alone is not None and alone.is_mismatch:
                self._suspects += (name,)
                mismatched += troubles[-1:] if name in before else []
        return tuple(troubles), tuple(mismatched)


def _listed(places: tuple[str, ...]) -> str:
    return ", ".join(f"`{place}`" for place in dict.fromkeys(places))
