"""Who uses which topic: one that carries requests or replies is used once in a cell.

A message of a driver does not say whom it is from. On a topic that two resources share each would hear what is meant
for the other, and a driver could not tell whose request it is asked.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.errors import Slug
from scbm.model.bindings import MessageType, TopicPair

if TYPE_CHECKING:
    from scbm.errors import Place
    from scbm.model.bindings import Binding
    from scbm.notation.parts import Parts


@dataclass(frozen=True, slots=True)
class _Use:
    """Where a topic is first used, and whether it carries requests or replies there."""

    where: str
    is_of_pair: bool


class TopicUses:
    """Notes topics, and complains of those that are shared and cannot be.

    Only topics of texts need be noted: others are of another type than requests and replies, which is told anyway.
    """

    def __init__(self, parts: Parts) -> None:
        self._parts = parts
        self._uses: dict[str, _Use] = {}

    def know(self, resource: str, binding: Binding) -> None:
        """The topics of a binding that stands elsewhere."""
        requests, where = binding.requests, f"for `{resource}`"
        pair = (requests.request, requests.reply) if isinstance(requests, TopicPair) else ()
        for name, kind in binding.topics():
            if kind is MessageType.STRING:
                self._uses.setdefault(name, _Use(where, name in pair))

    def note(self, name: str, place: Place, *, is_of_pair: bool) -> None:
        """A topic is used here."""
        before = self._uses.get(name)
        if before is None:
            self._uses[name] = _Use(f"in line {place.line}", is_of_pair)
        elif before.is_of_pair or is_of_pair:
            carries = "carries requests or replies" if before.is_of_pair else "is a measured topic"
            remedy = "what carries requests or replies carries nothing else: write a topic of its own"
            self._parts.add(Slug.BAD_BINDING, f"`{name}` {carries} {before.where}, too", place, remedy)
