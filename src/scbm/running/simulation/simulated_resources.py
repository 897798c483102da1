"""A simulated resource: what it works on, what waits, and its condition (semantics 7.2)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from scbm.cases import Condition, Intake
from scbm.model import Outcome

if TYPE_CHECKING:
    from scbm.cases import Reaction

_WELL = Condition()


@dataclass(slots=True)
class Job:
    """One copy of a request that arrived: what will be answered, and when if it is being worked on."""

    request: int
    reaction: Reaction
    succeeds: bool = True


@dataclass(slots=True)
class SimulatedResource:
    """What is true of one resource at one moment of a run."""

    name: str
    condition: Condition = _WELL
    downs: int = 0
    _jobs: list[Job] = field(default_factory=list)
    _waiting: list[Job] = field(default_factory=list)

    @property
    def is_down(self) -> bool:
        """Whether it is restarting; restarts may overlap."""
        return self.downs > 0

    def receive(self, request: int, reaction: Reaction) -> tuple[Job, int] | None:
        """A request arrives. The job and how long it will take; `None` if no answer is to come of it by now."""
        if self.is_down or self.condition.kind.intake is Intake.DROP:
            return None
        job = Job(request, reaction)
        if self.condition.kind.intake is Intake.WAIT:
            self._waiting.append(job)
            return None
        return self._begin(job)

    def _begin(self, job: Job) -> tuple[Job, int] | None:
        reaction, kind = job.reaction, self.condition.kind
        outcome = kind.outcome(reaction.outcome)
        if outcome is Outcome.TIMEOUT:
            return None
        job.succeeds = outcome is Outcome.SUCCEED
        self._jobs.append(job)
        return job, kind.time(reaction.latency_ns, self.condition.factor)

    def finish(self, job: Job) -> bool:
        """The time of a job is over: whether it is answered, which it is unless it was cancelled or forgotten."""
        for index, other in enumerate(self._jobs):
            if other is job:
                del self._jobs[index]
                return True
        return False

    def cancel(self, request: int) -> None:
        """Nobody waits for this request any more."""
        self._jobs = [job for job in self._jobs if job.request != request]
        self._waiting = [job for job in self._waiting if job.request != request]

    def forget(self) -> None:
        """All jobs are lost."""
        self._jobs.clear()
        self._waiting.clear()

    def become(self, condition: Condition) -> list[tuple[Job, int]]:
        """Changes the condition; what waited and can be begun now comes back as from `receive`."""
        self.condition = condition
        if condition.kind.intake is Intake.DROP:
            self.forget()
        if condition.kind.intake is Intake.WAIT:
            return []
        waiting, self._waiting = self._waiting, []
        return [begun for job in waiting if (begun := self._begin(job)) is not None]
