"""Consoles for tests: the server with a worker in this process, and a client that sends what the page sends."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from msgspec.json import decode, encode
from starlette.testclient import TestClient

from scbm.web.case_saver import CaseSaver
from scbm.web.console_runs import ConsoleRequest, ConsoleRuns
from scbm.web.console_server import Console, console_app
from scbm.web.model_worker import ModelWorker
from scbm.web.obligation_search import ObligationSearches

PORT = 8_917
TOKEN = "token"  # noqa: S105 - of a test


class NearWorker(ModelWorker):
    """Answers in this process, from one model that stays loaded."""

    def __init__(self, model: Path) -> None:
        super().__init__(model)
        self.runs = ConsoleRuns(model)

    def ask(self, name: str, request: ConsoleRequest) -> bytes:
        """Return the answer as JSON."""
        return encode(self.runs.answer(name, request))


class ConsoleClient:
    """What the page asks a console."""

    def __init__(self, worker: ModelWorker, model: Path, folder: Path) -> None:
        beginning = {"text": "", "stored": [], "has_store": False, "folder": str(folder)}
        console = Console(worker, CaseSaver(folder, model), ObligationSearches(model), TOKEN, beginning)
        self.http = TestClient(console_app(console, PORT), base_url=f"http://127.0.0.1:{PORT}")
        self.worker = worker

    def post(self, name: str, body: bytes | dict[str, Any] = b"{}", **headers: str) -> Any:  # noqa: ANN401 - an HTTP response
        """Return the response to a request with the token."""
        content = body if isinstance(body, bytes) else encode(body)
        return self.http.post(f"/{name}", content=content, headers={"X-Scbm-Token": TOKEN, **headers})

    def ask(self, name: str, /, **fields: Any) -> dict[str, Any]:  # noqa: ANN401 - any field
        """Return the answer to a request."""
        answer: dict[str, Any] = decode(self.post(name, fields).content)
        return answer


def near_console(model: Path, folder: Path) -> ConsoleClient:
    """Return a client of a console for a model, which saves into a folder."""
    return ConsoleClient(NearWorker(model), model, folder)


CELL = """\
behavior_model: console_cell
variables:
  door: {domain: [open, closed], initial: closed, source: input}
  belt: {domain: [empty, part], initial: empty}
  gripped: {domain: bool, initial: false}
resources:
  gripper: {shared: true, simulation: {latency: 1 s, outcomes: {succeed: 0.8, fail: 0.1, timeout: 0.1}}}
operations:
  grip: {request: gripper, deadline: 5 s, guard: door == closed && gripped == false, effects: [gripped <- true]}
  release: {request: gripper, deadline: 5 s, guard: gripped == true, effects: [gripped <- false]}
environment:
  arrive: {guard: belt == empty, actions: [belt <- part], after: 3 s}
goals:
  gripped: gripped == true
  released: gripped == false && belt == part
requirements:
  door_is_closed: never grip.state == executing && door == open
"""
"""A cell with requests, an input and an environment transition."""

COMMENTED = """\
# What the operator saw
case: seen   # on Monday
goal: gripped
limits: {time: 2 min, plans: 20}   # short
expect: {verdict: reached}
requirements:
  # his own rule
  quick: never gripped == true && belt == part
outcomes:
  # the second try
  grip: [fail, succeed]   # then it works
injections:
  - name: opened   # by hand
    at: 20 s
    set: {door: open}
"""
"""A case of the cell with comments, and with keys that no button changes."""
