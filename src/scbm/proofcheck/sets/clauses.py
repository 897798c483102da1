"""Formulas as clauses for a solver of satisfiability, and the question whether assumptions can hold together.

The solver comes with `python-sat` (extra `proofs`). It shares nothing with the decision diagrams that find sets.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

TRUE = 1
"""The literal that always holds; its negation never does."""


class Clauses:
    """Clauses over literals: numbers, of which -n is the negation of n."""

    def __init__(self) -> None:
        """Raise `ImportError` where no solver is installed."""
        from pysat.solvers import Solver  # noqa: PLC0415 - of an extra that few need

        self._solver = Solver(name="cadical153")
        self._last = TRUE
        self._known: dict[tuple[int, ...], int] = {}
        self.add(TRUE)

    def new(self) -> int:
        """Return a new literal."""
        self._last += 1
        return self._last

    def add(self, *literals: int) -> None:
        """Let at least one of some literals hold."""
        self._solver.add_clause(literals)

    def all_of(self, literals: Iterable[int]) -> int:
        """Return the literal that holds where all of some do."""
        parts = tuple(sorted({literal: None for literal in literals if literal != TRUE}))
        if -TRUE in parts or any(-part in parts for part in parts if part > 0):
            return -TRUE
        if len(parts) <= 1:
            return parts[0] if parts else TRUE
        if parts not in self._known:
            found = self._known[parts] = self.new()
            for part in parts:
                self.add(-found, part)
            self.add(found, *(-part for part in parts))
        return self._known[parts]

    def any_of(self, literals: Iterable[int]) -> int:
        """Return the literal that holds where one of some does."""
        return -self.all_of(-literal for literal in literals)

    def can_hold(self, assumptions: Sequence[int]) -> bool:
        """Return whether some literals can hold together."""
        return bool(self._solver.solve(assumptions=list(dict.fromkeys(assumptions))))

    def holds(self, literal: int) -> bool:
        """Return whether a literal holds in the valuation that the last question has found."""
        model = self._solver.get_model()
        number = abs(literal)
        value = number > len(model) or model[number - 1] > 0
        return value if literal > 0 else not value

    def close(self) -> None:
        """Free the memory of the solver."""
        self._solver.delete()
