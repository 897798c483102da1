"""Decision diagrams: sets of valuations of bits, by the library `dd`, with CUDD where its wheel is installed.

A diagram of a set depends on the order of the bits alone. The order is fixed when a manager is made, so a diagram has
as many nodes under CUDD as in pure Python. Limits count these nodes, not those that an engine keeps besides.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence


class Diagram(Protocol):
    """A set of valuations of bits; equal sets are equal."""

    @property
    def var(self) -> str:
        """The bit that it compares first; of a set that is neither empty nor full."""
        ...

    @property
    def dag_size(self) -> int:
        """The number of nodes, the leaf included; a set and its complement have the same."""
        ...

    @property
    def low(self) -> Diagram:
        """The node where the first bit is 0; its complement counts if the set is `negated`."""
        ...

    @property
    def high(self) -> Diagram:
        """The node where the first bit is 1, likewise."""
        ...

    @property
    def negated(self) -> bool:
        """Whether the set is the complement of its node."""
        ...

    def __and__(self, other: Diagram) -> Diagram: ...
    def __or__(self, other: Diagram) -> Diagram: ...
    def __invert__(self) -> Diagram: ...


class DiagramManager(Protocol):
    """Makes diagrams over the same bits."""

    false: Diagram
    true: Diagram

    def declare(self, *names: str) -> None:
        """Add bits behind those that exist."""
        ...

    def var(self, name: str) -> Diagram:
        """Return where a bit is 1."""
        ...

    def cube(self, bits: Mapping[str, bool]) -> Diagram:
        """Return where bits have values."""
        ...

    def exist(self, names: Iterable[str], diagram: Diagram) -> Diagram:
        """Return the set with any values of some bits."""
        ...

    def configure(self, **options: object) -> object:
        """Set options of the engine."""
        ...


ENGINES: Mapping[str, str] = {"cudd": "dd.cudd", "python": "dd.autoref"}
"""The engines by name, the fastest first, with the modules that have them. All give the same sets."""


def diagram_manager(bits: Sequence[str]) -> DiagramManager | None:
    """Return a manager of these bits, in this order from the top; `None` where no engine is installed."""
    for module in ENGINES.values():
        try:
            manager: DiagramManager = import_module(module).BDD()
        except ImportError:
            continue
        manager.configure(reordering=False)
        manager.declare(*bits)
        return manager
    return None


def forget_unused(manager: DiagramManager) -> None:
    """Free the nodes of diagrams that are used no longer, where the engine does not do so by itself."""
    forget = getattr(manager, "collect_garbage", None)
    if forget is not None:
        forget()
