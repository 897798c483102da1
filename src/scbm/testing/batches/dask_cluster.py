"""Run batches on a Dask cluster (`--cluster`, extra `cluster`): Dask distributes, moves and repeats them.

The campaign travels to each worker once, as a plugin that workers get when they join. Batches of case positions go out,
and summaries come back. If a worker ends, its batches run on another one. Dask gives a task up after some such losses
(`distributed.scheduler.allowed-failures`, by default 3), as if the task were to blame; such a batch is sent again,
`_MAX_GIVEN_UP` times.
"""

from __future__ import annotations

import logging
import pickle
import threading
from collections import deque
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from distributed import Client, Future, KilledWorker, WorkerPlugin
from distributed.comm.core import CommClosedError
from msgspec import Struct, field

import scbm
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.testing.batches.campaign_runs import BatchSizes, run_batch, tester_of

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator

    from distributed import Worker

    from scbm.testing.batches.campaign_runs import BatchPlan, BatchRequest, BatchResult
    from scbm.testing.batches.campaign_work import CampaignWork
    from scbm.testing.tester import Tester

_BATCH_S = 0.5
"""The wall time that a batch should take; it pays for its way to the worker and back."""

_WINDOW = 4
"""Maximum number of unfinished batches for each thread of a worker, so that memory is flat everywhere."""

_COUNT_EVERY = 16
"""The number of batches after which the threads of the cluster are counted again, as workers join and leave."""

_MAX_GIVEN_UP = 25
"""Number of times that Dask may give one batch up before the campaign ends with an error."""

_CONNECT_S = 10
"""Timeout for reaching the scheduler, at the beginning and after it was lost."""

_CLOSE_S = 2
"""Timeout for the end of a connection, whose scheduler may be gone."""

_WORKER_S = 60
"""Timeout for the first worker."""

_LOGGERS = (
    "distributed",
    "distributed.client",
    "distributed.core",
    "distributed.comm",
    "tornado.application",
    "asyncio",
)


class DaskCluster:
    """Runs batches on the workers of a Dask cluster, which may join, leave and be killed meanwhile."""

    def __init__(self, address: str) -> None:
        """Take the address of the scheduler: `tcp://host:8786`, or `host:8786`."""
        self._address = address

    def results(self, plan: BatchPlan) -> Generator[BatchResult, None, None]:
        """Yield the results of the batches.

        Raises:
            InputError: the scheduler cannot be reached or vanished, a worker cannot run the
                campaign, or a batch ended its workers again and again.
        """
        with _connected(self._address) as client, _errors_of(self._address):
            yield from _ClusterCampaign(client, self._address, plan).results()


@contextmanager
def _connected(address: str) -> Iterator[Any]:
    """Connect to a scheduler; log nothing of Dask's own, as errors are reported in one line."""
    levels = [(logger, logger.level) for logger in map(logging.getLogger, _LOGGERS)]
    for logger, _ in levels:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        client = _client(address)
        try:
            yield client
        finally:
            with suppress(Exception):  # the scheduler may be gone
                client.close(timeout=_CLOSE_S)
    finally:
        for logger, level in levels:
            logger.setLevel(level)


def _client(address: str) -> Any:  # noqa: ANN401 - the methods of clients have no types
    try:
        return _QuietClient(address, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise _unusable(address, f"the scheduler cannot be reached: {_first_line(error)}", _HOW_TO_START) from None


class _QuietClient(Client):
    """A client that is closed once: Dask closes it again when it is deleted, and prints what fails then."""

    def __init__(self, address: str, **options: Any) -> None:  # noqa: ANN401 - as above
        super().__init__(address, **options)  # type: ignore[no-untyped-call] # of Dask

    def __del__(self) -> None:
        """Do nothing."""


_HOW_TO_START = "start `dask scheduler`, and `dask worker ADDRESS` for each worker"


@contextmanager
def _errors_of(address: str) -> Iterator[None]:
    """Turn errors of Dask into `InputError`."""
    try:
        yield
    except (CancelledError, CommClosedError, OSError) as error:
        if isinstance(error, TimeoutError) and "worker" in str(error):
            raise _unusable(address, f"no worker joined within {_WORKER_S} s", _HOW_TO_START) from None
        raise _unusable(address, "the scheduler vanished", "the report has the cases before; run it again") from None


def _unusable(address: str, message: str, remedy: str) -> InputError:
    return InputError([Diagnostic(Slug.CLUSTER_UNUSABLE, message, Place("--cluster"), remedy, address)])


def _first_line(error: BaseException) -> str:
    return str(error).strip().partition("\n")[0] or type(error).__name__


class _Sent(Struct):
    """A batch that was sent to the cluster.

    Attributes:
        request: the batch.
        future: its result.
        given_up: how often Dask has given it up.
    """

    request: BatchRequest
    future: Future[BatchResult]
    given_up: int = 0


class _ClusterCampaign(Struct):
    """One campaign on a cluster."""

    _client: Any
    _address: str
    _plan: BatchPlan
    _token: str = field(default_factory=lambda: uuid4().hex)

    def results(self) -> Iterator[BatchResult]:
        """Yield the results in the order of the cases; a bounded number of batches is under way."""
        self._client.wait_for_workers(1, timeout=_WORKER_S)
        self._send_campaign()
        try:
            yield from self._in_order()
        finally:
            with suppress(Exception):  # the scheduler may be gone
                self._client.unregister_worker_plugin(self._token)

    def _send_campaign(self) -> None:
        """Send the campaign to all workers, and to those that join later."""
        plugin = CampaignPlugin(self._token, pickle.dumps(self._plan.work))
        try:
            self._client.register_plugin(plugin, name=self._token)
        except Exception as error:
            is_of_worker = type(error) is Exception  # Dask's, with the text of what failed before `scbm` began
            if not is_of_worker and not isinstance(error, (ImportError, VersionsDifferError)):
                raise
            message = f"a worker cannot run the campaign: {_first_line(error)}"
            raise _unusable(self._address, message, "install this version of scbm on every worker") from None

    def _in_order(self) -> Iterator[BatchResult]:
        sent: deque[_Sent] = deque()
        sizes, first, count, window = BatchSizes(_BATCH_S), self._plan.start, 0, 0
        try:
            while sent or first <= self._plan.work.count:
                if not count % _COUNT_EVERY:
                    window = _WINDOW * max(1, sum(self._client.nthreads().values()))
                while len(sent) < window and first <= self._plan.work.count:
                    request = self._plan.request(first, sizes.next())
                    sent.append(_Sent(request, self._submit(request, 0)))
                    first = request.last + 1
                result = self._result(sent[0])
                sent.popleft().future.release()  # type: ignore[no-untyped-call] # of Dask
                count += 1
                sizes.observe(result.summary.count, result.seconds)
                yield result
        finally:
            with suppress(Exception):  # the scheduler may be gone
                self._client.cancel([each.future for each in sent])

    def _submit(self, request: BatchRequest, attempt: int) -> Future[BatchResult]:
        """Queue a batch; those that come first have priority."""
        key = f"scbm-{self._token}-{request.first}-{request.last}-{attempt}"
        future: Future[BatchResult] = self._client.submit(
            run_on_worker, self._token, request, key=key, pure=False, priority=-request.first
        )
        return future

    def _result(self, sent: _Sent) -> BatchResult:
        while True:
            try:
                result: BatchResult = sent.future.result()
            except KilledWorker:
                sent.given_up += 1
                if sent.given_up == _MAX_GIVEN_UP:
                    raise self._killed(sent.request) from None
                sent.future = self._submit(sent.request, sent.given_up)
            else:
                return result

    def _killed(self, request: BatchRequest) -> InputError:
        message = f"workers ended again and again while they ran cases {request.first} to {request.last}"
        return _unusable(self._address, message, "was the memory used up? run with `-j 1` to see the case")


# on a worker


class VersionsDifferError(Exception):
    """The worker has another version of scbm than the command."""


class _WorkerCampaign(Struct):
    """A campaign on a worker.

    Attributes:
        work: the campaign.
        testers: one for each thread, which keeps plans for later cases.
    """

    work: CampaignWork
    testers: dict[int, Tester] = field(default_factory=dict)


_received: dict[str, _WorkerCampaign] = {}
"""The campaigns that this process has received, by their tokens.

Dask calls `run_on_worker` with pickled arguments alone, and a campaign as an argument would travel with each batch. So
`CampaignPlugin` keeps the campaign here, once for each process, where the batches of all its threads find it.
"""


class CampaignPlugin(WorkerPlugin):
    """Brings a campaign to a worker."""

    def __init__(self, token: str, sent: bytes) -> None:
        """Take the name of the campaign, and the campaign."""
        self._token = token
        self._version = scbm.__version__
        self._sent = sent

    def setup(self, worker: Worker) -> None:
        """Receive the campaign."""
        del worker
        if self._version != scbm.__version__:
            raise VersionsDifferError(f"it has scbm {scbm.__version__}, and the command is of scbm {self._version}")
        _received[self._token] = _WorkerCampaign(pickle.loads(self._sent))  # noqa: S301 - from our own command

    def teardown(self, worker: Worker) -> None:
        """Forget the campaign."""
        del worker
        _received.pop(self._token, None)


def run_on_worker(token: str, request: BatchRequest) -> BatchResult:
    """Run a batch of a campaign that this worker has received."""
    received = _received[token]
    thread = threading.get_ident()
    if thread not in received.testers:
        received.testers[thread] = tester_of(received.work)
    return run_batch(received.work, received.testers[thread], request)
