"""The worker process of a console: it has the model loaded, and ends for a run that is too long, or a newer text."""

from __future__ import annotations

import threading
from concurrent.futures import TimeoutError as FutureTimeoutError
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec.json import encode

from scbm.files.codec.model_files import files_used_by
from scbm.model import InputError
from scbm.testing.batches.worker_processes import WorkerPool
from scbm.web.console_runs import LIMIT, MAX_SECONDS, ConsoleRuns, errors_json

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.web.console_runs import ConsoleRequest

_PATIENCE_S = 0.2
"""How long a run waits for the one before, in seconds: most take milliseconds, and to start a worker takes a second."""

_GRACE_S = 2
"""How long a worker has beyond the limit of a run to judge and pack what happened before, in seconds."""

_RUNS = ("run", "edit")
"""The requests that run a text."""

_LOADING_S = 60
"""The time that a new worker has to load the model, in seconds."""


class ModelWorker:
    """Answers requests about one model in another process, one at a time."""

    def __init__(self, model: Path, seconds: float = MAX_SECONDS + _GRACE_S) -> None:
        """Take the model file, and the time of a request in seconds. The process starts with the first request."""
        self._model, self._seconds = model, seconds
        self._turn, self._ending = threading.Lock(), threading.Lock()
        self._pool: WorkerPool | None = None
        self._run: tuple[str, WorkerPool] | None = None  # the page whose text is run now, and by what
        self._is_closed = False
        self._files: tuple[Path, ...] = (model, *files_used_by(model))
        self._digest = self._content()

    def ask(self, name: str, request: ConsoleRequest) -> bytes:
        """Return the answer as JSON. A run that takes longer than a moment is ended by the next text of its page."""
        if name not in _RUNS or not self._turn.acquire(timeout=_PATIENCE_S):
            page, pool = self._run or ("", None)
            if name in _RUNS and pool is not None and page == request.page:
                self._kill(pool)
            self._turn.acquire()
        try:
            return self._answer(name, request)
        except FutureTimeoutError:
            self._end()
            return encode({"text": request.text, "ended": LIMIT})
        except BrokenProcessPool:
            self._end()
            return encode({"text": request.text, "ended": "a newer text, or the end of its process"})
        finally:
            self._run = None
            self._turn.release()

    def _answer(self, name: str, request: ConsoleRequest) -> bytes:
        if self._is_closed:
            raise BrokenProcessPool
        if self._pool is None:
            self._pool = WorkerPool(_begin, str(self._model).encode(), 1)
            self._pool.submit(_wait, None).result(_LOADING_S)
        self._run = (request.page, self._pool) if name in _RUNS else None
        return self._pool.submit(_answer, (name, request)).result(self._seconds)

    def digest(self) -> str:
        """Return the digest of all files of the model. If it has changed, the next request loads the model again."""
        digest = self._content()
        if digest != self._digest:
            with self._turn:
                self._files = (self._model, *files_used_by(self._model))
                self._digest = digest = self._content()
                self._end()
        return digest

    def close(self) -> None:
        """End the process, for good."""
        self._is_closed = True
        self._end()

    def _end(self) -> None:
        pool, self._pool = self._pool, None
        if pool is not None:
            self._kill(pool)

    def _kill(self, pool: WorkerPool) -> None:
        with self._ending:  # a pool must not be ended by two threads at once
            pool.kill()

    def _content(self) -> str:
        content = sha256()
        for path in self._files:
            with suppress(OSError):
                content.update(path.read_bytes())
            content.update(b"\0")
        return content.hexdigest()


# in the worker

_models: list[Callable[[str, ConsoleRequest], object]] = []
"""What answers the requests of this process."""


def _begin(sent: bytes) -> None:
    _models[:] = [_loaded(Path(sent.decode()))]


def _loaded(model: Path) -> Callable[[str, ConsoleRequest], object]:
    """Return what answers about a model; the errors of the model, if it has some."""
    try:
        return ConsoleRuns(model).answer
    except InputError as error:
        errors = errors_json(error.diagnostics)
        return lambda _, request: {"text": request.text, "model_errors": errors}


def _wait(_: None) -> None:
    """Do nothing, once the model is loaded."""


def _answer(asked: tuple[str, ConsoleRequest]) -> bytes:
    return encode(_models[0](*asked))
