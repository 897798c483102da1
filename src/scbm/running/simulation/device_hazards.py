"""Hazards at simulated devices: what a device does and its controller does not know (semantics 7.14)."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING

from msgspec import Struct, field

from scbm.cases.trace import ReplyReceived, RequestCancelled
from scbm.model.durations import format_moment

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from scbm.cases.trace import Record
    from scbm.model import Resource
    from scbm.running.simulation.simulated_resources import Job, SimulatedResource

_NEVER_NS = 1 << 80
"""A time after the end of all runs."""


class HazardKind(StrEnum):
    """The kinds of hazards."""

    OVERLAP = "overlap"
    """A request starts while another one is carried out."""
    UNAWAITED = "unawaited"
    """A request is carried out that the runner no longer waits for, and no cancellation is on its way."""


class Hazard(Struct, frozen=True):
    """Something that a device does, and its controller does not know.

    Attributes:
        kind: the kind.
        resource: the device.
        request: the number of the request that starts, or that the runner no longer waits for.
        begin_ns: when it begins.
        end_ns: when it ends, perhaps after the end of the run; `None` if it would never end by itself.
        other: of an overlap the number of the request that is carried out already.
    """

    kind: HazardKind
    resource: str
    request: int
    begin_ns: int
    end_ns: int | None = None
    other: int | None = None

    def __str__(self) -> str:
        end = " on, without end" if self.end_ns is None else f" to {format_moment(self.end_ns)}"
        when = f"from {format_moment(self.begin_ns)}{end}"
        if self.kind is HazardKind.OVERLAP:
            return (
                f"{self.resource} carries out request {self.request} while it carries out request {self.other}, {when}"
            )
        return f"{self.resource} carries out request {self.request} {when}, and the runner no longer waits for it"


class WorkSpan(Struct):
    """The time for which a device works at one copy of a request, or at several that follow each other.

    Attributes:
        request: the number of the request.
        begin_ns: when the work begins.
        end_ns: when it ends.
        ends_by_itself: whether nothing else ends it.
    """

    request: int
    begin_ns: int
    end_ns: int = _NEVER_NS
    ends_by_itself: bool = False


class DeviceWatch(Struct):
    """Notes in a run at which requests each resource works.

    Attributes:
        resources: the resources by name.
    """

    resources: Mapping[str, SimulatedResource]
    _spans: dict[str, list[tuple[Job, WorkSpan]]] = field(default_factory=dict)
    _cancelled_ns: dict[int, int] = field(default_factory=dict)

    def cancel(self, request: int, arrives_ns: int) -> None:
        """Note when a copy of a cancellation arrives."""
        self._cancelled_ns[request] = max(arrives_ns, self._cancelled_ns.get(request, 0))

    def observe(self, name: str, now_ns: int, finished: Job | None = None) -> None:
        """Note which jobs of a resource have begun or ended now; the time of `finished` is over."""
        spans, jobs = self._spans.setdefault(name, []), self.resources[name].jobs
        for job, span in spans:
            if span.end_ns == _NEVER_NS and not _has(jobs, job):
                span.end_ns, span.ends_by_itself = now_ns, job is finished
        known = [job for job, _ in spans]
        spans += [(job, WorkSpan(job.request, now_ns)) for job in jobs if not _has(known, job)]

    def hazards(self, resources: Mapping[str, Resource], records: Sequence[Record]) -> tuple[Hazard, ...]:
        """Return the hazards of the run with a trace, in the order in which they begin."""
        freed_ns = {each.request: each.at_ns for each in records if isinstance(each, (RequestCancelled, ReplyReceived))}
        free_ns = {request: max(at_ns, self._cancelled_ns.get(request, 0)) for request, at_ns in freed_ns.items()}
        found: list[Hazard] = []
        for name, spans in self._spans.items():
            works = _joined(self._with_end(job, span) for job, span in spans)
            found += _unawaited(name, works, free_ns)
            found += [] if resources[name].parallel else _overlaps(name, works)
        return tuple(sorted(found, key=lambda each: (each.begin_ns, each.request)))

    def _with_end(self, job: Job, span: WorkSpan) -> WorkSpan:
        """Return a span that may last beyond the end of the run with its end there."""
        if span.end_ns != _NEVER_NS or job.takes_ns is None:
            return span
        end_ns = span.begin_ns + job.takes_ns
        cancelled_ns = self._cancelled_ns.get(span.request, -1)
        is_cancelled = span.begin_ns <= cancelled_ns < end_ns
        return WorkSpan(span.request, span.begin_ns, cancelled_ns if is_cancelled else end_ns, not is_cancelled)


def _has(jobs: Iterable[Job], job: Job) -> bool:
    """Return whether a job itself is among others; copies of one request are equal."""
    return any(each is job for each in jobs)


def _joined(spans: Iterable[WorkSpan]) -> list[WorkSpan]:
    """Return spans in the order of their begins; copies of one request that overlap are one piece of work."""
    works: list[WorkSpan] = []
    for span in sorted(spans, key=lambda each: each.begin_ns):
        last = next((each for each in reversed(works) if each.request == span.request), None)
        if last is None or last.end_ns < span.begin_ns:
            works.append(span)
        elif last.end_ns < span.end_ns:
            last.end_ns, last.ends_by_itself = span.end_ns, span.ends_by_itself
    return works


def _unawaited(resource: str, works: Sequence[WorkSpan], free_ns: Mapping[int, int]) -> Iterator[Hazard]:
    """Yield work that the runner no longer waits for and that ends by itself, or is overtaken; each request once."""
    found: dict[int, Hazard] = {}
    for work in works:
        begin_ns = max(work.begin_ns, free_ns.get(work.request, _NEVER_NS))
        is_overtaken = any(begin_ns <= each.begin_ns < work.end_ns for each in works if each.request != work.request)
        if work.request not in found and begin_ns < work.end_ns and (work.ends_by_itself or is_overtaken):
            end_ns = None if work.end_ns == _NEVER_NS else work.end_ns
            found[work.request] = Hazard(HazardKind.UNAWAITED, resource, work.request, begin_ns, end_ns)
    yield from found.values()


def _overlaps(resource: str, works: Sequence[WorkSpan]) -> Iterator[Hazard]:
    """Yield where a request starts while another one is carried out; each request once."""
    found: dict[int, Hazard] = {}
    for index, work in enumerate(works):
        others = (each for each in works[:index] if each.request != work.request)
        other = next((each for each in others if work.begin_ns < min(each.end_ns, work.end_ns)), None)
        if other is not None and work.request not in found:
            ends_ns = min(other.end_ns, work.end_ns)
            end_ns = None if ends_ns == _NEVER_NS else ends_ns
            found[work.request] = Hazard(
                HazardKind.OVERLAP, resource, work.request, work.begin_ns, end_ns, other.request
            )
    yield from found.values()
