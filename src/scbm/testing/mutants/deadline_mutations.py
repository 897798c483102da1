"""Mutation operators for deadlines: none, shorter, and longer."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from typing import TYPE_CHECKING

from scbm.model import format_duration
from scbm.testing.mutants.model_parts import with_operation
from scbm.testing.mutants.mutation import Mutant, MutatedPart, Mutation, SubjectKind

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel, Operation


class DeadlineMutation(Mutation):
    """Changes a `deadline` or a `disabled_deadline`."""

    group = "deadlines"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each deadline."""
        for operation in model.operations:
            if operation.deadline_ns is not None:
                new_ns = self.changed_ns(operation.deadline_ns)
                kept = operation.timedout if new_ns is not None else ()
                changed = replace(operation, deadline_ns=new_ns, timedout=kept)
                yield self._mutant(operation, changed, MutatedPart.DEADLINE, with_operation(model, changed))
            if operation.disabled_deadline_ns is not None:
                changed = replace(operation, disabled_deadline_ns=self.changed_ns(operation.disabled_deadline_ns))
                yield self._mutant(operation, changed, MutatedPart.DISABLED_DEADLINE, with_operation(model, changed))

    @abstractmethod
    def changed_ns(self, deadline_ns: int) -> int | None:
        """Return the changed deadline in nanoseconds; `None` for none."""

    def _mutant(self, old: Operation, new: Operation, part: MutatedPart, model: BehaviorModel) -> Mutant:
        before, after = _written(old, part), _written(new, part)
        parts = (part,) if old.timedout == new.timedout else (part, MutatedPart.TIMEDOUT)
        return Mutant(
            name=f"{old.name}/{part}/{after or 'none'}",
            operator=self.name,
            kind=SubjectKind.OPERATION,
            subject=old.name,
            parts=parts,
            path=("operations", old.name, part),
            before=f"{part}: {before}",
            after=after and f"{part}: {after}",
            change=f"{before} → {after or 'none'}",
            model=model,
        )


def _written(operation: Operation, part: MutatedPart) -> str:
    deadline_ns = operation.deadline_ns if part is MutatedPart.DEADLINE else operation.disabled_deadline_ns
    return "" if deadline_ns is None else format_duration(deadline_ns)


class NoDeadline(DeadlineMutation):
    """Leaves out a deadline; the `timedout` actions of the operation go with its `deadline`."""

    name = "deadline-none"
    summary = "an operation has no `deadline` (and no `timedout`), or no `disabled_deadline`"

    def changed_ns(self, deadline_ns: int) -> None:
        """Return no deadline."""
        del deadline_ns


class ShorterDeadline(DeadlineMutation):
    """Divides a deadline by 10."""

    name = "deadline-shorter"
    summary = "a deadline is a tenth"

    def changed_ns(self, deadline_ns: int) -> int:
        """Return a tenth, in whole nanoseconds."""
        return deadline_ns // 10


class LongerDeadline(DeadlineMutation):
    """Multiplies a deadline by 10."""

    name = "deadline-longer"
    summary = "a deadline is ten times as long"

    def changed_ns(self, deadline_ns: int) -> int:
        """Return ten times the deadline."""
        return deadline_ns * 10
