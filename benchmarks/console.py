"""What a click in `scbm console` costs: the CPU time of editing, reading, running and packing, and of the request.

It is compared with that of reading and running the new text, and writing the JSON of `scbm replay --json`.
"""

from __future__ import annotations

import json
import time
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from msgspec.json import decode, encode
from starlette.testclient import TestClient

from scbm.cli.output.shown_run import run_json
from scbm.files import read_case
from scbm.testing import Tester
from scbm.web.case_saver import CaseSaver
from scbm.web.console_runs import ConsoleRequest, ConsoleRuns
from scbm.web.console_server import Console, console_app
from scbm.web.model_worker import ModelWorker
from scbm.web.obligation_search import ObligationSearches

if TYPE_CHECKING:
    from collections.abc import Callable

EXAMPLES = Path(__file__).parents[1] / "examples"
MODELS = {"robot_in_the_air/after.yaml": "item_a_delivered", "dual_cnc/cell.yaml": "pallet_finished"}
ROUNDS = 40


class _Near(ModelWorker):
    """Answers in this process, so that one clock sees all of the work."""

    def __init__(self, model: Path) -> None:
        super().__init__(model)
        self.runs = ConsoleRuns(model)

    def ask(self, name: str, request: ConsoleRequest) -> bytes:
        """Return the answer as JSON."""
        return encode(self.runs.answer(name, request))


def cpu_ms(work: Callable[[int], object]) -> float:
    """Return the median CPU time of a piece of work in milliseconds."""
    times = []
    for number in range(ROUNDS):
        begin = time.process_time()
        work(number)
        times.append((time.process_time() - begin) * 1_000)
    return median(times)


def compare(model: Path, goal: str) -> None:
    """Print what clicks on a model cost."""
    worker = _Near(model)
    console = Console(worker, CaseSaver(model.parent, model), ObligationSearches(model), "t", {})
    text = f"case: a\ngoal: {goal}\n"
    clicks = [{"edit": "late", "target": "2", "values": {"by": f"{number + 1} ms"}} for number in range(2 * ROUNDS)]
    texts = [text]
    with TestClient(console_app(console, 1), base_url="http://127.0.0.1:1") as client:

        def click(number: int) -> None:
            body = encode({"text": texts[-1], "record": 5, **clicks[number]})
            texts.append(client.post("/edit", content=body, headers={"X-Scbm-Token": "t"}).json()["text"])

        def asked(number: int) -> None:
            request = ConsoleRequest(texts[-1], 5, **clicks[ROUNDS + number])  # type: ignore[arg-type]
            texts.append(decode(worker.ask("edit", request))["text"])

        whole, served = cpu_ms(click), cpu_ms(asked)
    tester = Tester(worker.runs.model)

    def plain(number: int) -> bytes:
        execution = tester.execute(read_case(texts[number + 1], tester.model))
        return json.dumps(run_json(tester.model, execution)).encode()

    base, records = cpu_ms(plain), len(tester.execute(read_case(texts[1], tester.model)).trace.records)
    print(f"{model.relative_to(EXAMPLES)}, {records} records: read, run and JSON {base:.2f} ms")
    print(f"  a click {served:.2f} ms, {served / base:.2f} times")
    print(f"  with a client and HTTP {whole:.2f} ms, {whole / base:.2f} times")


if __name__ == "__main__":
    for name, wanted in MODELS.items():
        compare(EXAMPLES / name, wanted)
