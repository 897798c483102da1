"""A simulated resource: its jobs, its waiting requests, and its condition (semantics 7.8)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct, field

from scbm.cases import Condition, Intake
from scbm.model import Outcome
from scbm.running.simulation.default_reactions import plainly_measured

if TYPE_CHECKING:
    from scbm.cases import Reaction
    from scbm.cases.trace import Changes
    from scbm.model import Resource

_WELL = Condition()


class Job(Struct):
    """One copy of a request that arrived.

    Attributes:
        request: the number of the request.
        reaction: the reaction to it.
        succeeds: the kind of the reply.
        measured: the values in the reply.
        takes_ns: how long the resource works at it; `None` if it works until the request is cancelled.
    """

    request: int
    reaction: Reaction
    succeeds: bool = True
    measured: Changes = ()
    takes_ns: int | None = None


class SimulatedResource(Struct):
    """The state of one resource in a run.

    Attributes:
        name: its name.
        condition: its condition.
        downs: how many restarts have begun and not ended.
        fails_with: the values that the reply carries if the condition makes a request fail.
    """

    name: str
    condition: Condition = _WELL
    downs: int = 0
    fails_with: Changes = ()
    _jobs: list[Job] = field(default_factory=list)
    _waiting: list[Job] = field(default_factory=list)

    @staticmethod
    def of(resource: Resource) -> SimulatedResource:
        """Return a resource without jobs."""
        return SimulatedResource(resource.name, fails_with=plainly_measured(resource, Outcome.FAIL) or ())

    @property
    def jobs(self) -> tuple[Job, ...]:
        """The jobs at which the resource works."""
        return tuple(self._jobs)

    @property
    def is_down(self) -> bool:
        """Whether the resource is restarting; restarts may overlap."""
        return self.downs > 0

    def receive(self, request: int, reaction: Reaction) -> tuple[Job, int] | None:
        """Receive a request, and return the job and its time in ns; `None` if it is lost, waits or gets no reply."""
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
        self._jobs.append(job)
        if outcome is Outcome.TIMEOUT:
            return None
        job.succeeds = outcome is Outcome.SUCCEED
        fails_with = self.fails_with if outcome is Outcome.FAIL else ()
        job.measured = (reaction.measured or ()) if outcome is reaction.outcome else fails_with
        job.takes_ns = kind.time(reaction.latency_ns, self.condition.factor)
        return job, job.takes_ns

    def finish(self, job: Job) -> bool:
        """Finish a job whose time is over; return whether it is answered: it may have been cancelled or forgotten."""
        for index, other in enumerate(self._jobs):
            if other is job:
                del self._jobs[index]
                return True
        return False

    def cancel(self, request: int) -> None:
        """Drop the jobs of a request."""
        self._jobs = [job for job in self._jobs if job.request != request]
        self._waiting = [job for job in self._waiting if job.request != request]

    def forget(self) -> None:
        """Drop all jobs."""
        self._jobs.clear()
        self._waiting.clear()

    def become(self, condition: Condition) -> list[tuple[Job, int]]:
        """Change the condition; return the jobs that waited and begin now, as `receive` does."""
        self.condition = condition
        if condition.kind.intake is Intake.DROP:
            self.forget()
        if condition.kind.intake is Intake.WAIT:
            return []
        waiting, self._waiting = self._waiting, []
        return [begun for job in waiting if (begun := self._begin(job)) is not None]
