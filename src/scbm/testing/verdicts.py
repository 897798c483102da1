"""Whether a case passed (semantics 7.4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.model import Outcome
from scbm.running import End, describe_cycle
from scbm.trace import RunEnded

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.simulating import Reaction
    from scbm.testing.cases import Case
    from scbm.testing.requirements import Violation
    from scbm.trace import Record


@dataclass(frozen=True, slots=True)
class Verdict:
    """How a case ended, and why it failed if it did.

    Attributes:
        end: the end of the run.
        failures: one sentence for each reason to call the case failed; none if it passed.
    """

    end: End
    failures: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether there is nothing to complain of."""
        return not self.failures


def judge(
    case: Case,
    end: End,
    records: Sequence[Record],
    reactions: Sequence[Reaction],
    violations: Sequence[Violation],
) -> Verdict:
    """The verdict on a run: what it ended in, what went wrong, and whether anything was made to go wrong."""
    failures = [str(violation) for violation in violations]
    if end in (End.LIVELOCK, End.MODEL_ERROR):
        failures.append(_described(end, records))
    elif end is not End.REACHED and not _disturbed(case, reactions):
        failures.append(f"the goal was not reached ({end.replace('_', ' ')}), and nothing was made to go wrong")
    return Verdict(end, tuple(failures))


def _disturbed(case: Case, reactions: Sequence[Reaction]) -> bool:
    """Whether anything was made to go wrong: a failure, a missing reply, an injection."""
    return bool(case.injections) or any(reaction.outcome is not Outcome.SUCCEED for reaction in reactions)


def _described(end: End, records: Sequence[Record]) -> str:
    detail = next((record.detail for record in reversed(records) if isinstance(record, RunEnded)), ())
    if end is End.LIVELOCK:
        return describe_cycle(detail)
    return f"the model is wrong: {', '.join(detail)}"
