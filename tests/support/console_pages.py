"""A console that is served at a port of this computer, in a thread of this process."""

from __future__ import annotations

import socket
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

import uvicorn
from msgspec.json import decode

from scbm.web.case_saver import CaseSaver
from scbm.web.console_runs import ConsoleRequest
from scbm.web.console_server import Console, console_app
from scbm.web.model_worker import ModelWorker
from scbm.web.obligation_search import ObligationSearches

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path


class HeardSearches(ObligationSearches):
    """Searches that can be waited for: `was_ended` is set as soon as a page has ended its own."""

    def __init__(self, model: Path) -> None:
        super().__init__(model)
        self.was_ended = threading.Event()

    def end(self, *pages: str) -> dict[str, Any]:
        ended = super().end(*pages)
        self.was_ended.set()
        return ended


class ServedConsole(NamedTuple):
    """A console, its address, and the text that it begins with."""

    worker: ModelWorker
    searches: HeardSearches
    address: str
    text: str

    def ask(self, name: str, text: str) -> dict[str, Any]:
        """Return what the server answers about a text."""
        answer: dict[str, Any] = decode(self.worker.ask(name, ConsoleRequest(text=text)))
        return answer


@contextmanager
def served(
    model: Path, text: str, folder: Path | None = None, stored: Sequence[str] | None = None
) -> Iterator[ServedConsole]:
    """Serve a console for a model.

    Args:
        model: the model.
        text: the text of the case that the page begins with.
        folder: where it saves: by default `cases` beside the model.
        stored: the obligations that a store has; `None` without a store.
    """
    listener = socket.create_server(("127.0.0.1", 0))
    port = listener.getsockname()[1]
    worker, saver = ModelWorker(model), CaseSaver(folder or model.parent / "cases", model)
    searches = HeardSearches(model)
    beginning = {"text": text, "stored": stored or (), "has_store": stored is not None, "folder": ""}
    app = console_app(Console(worker, saver, searches, "token", beginning), port)
    server = uvicorn.Server(uvicorn.Config(app, log_level="critical", ws="none", timeout_graceful_shutdown=1))
    thread = threading.Thread(target=server.run, args=([listener],))
    thread.start()
    try:
        yield ServedConsole(worker, searches, f"http://127.0.0.1:{port}/#token", text)
    finally:
        server.should_exit = True
        thread.join()
        listener.close()
