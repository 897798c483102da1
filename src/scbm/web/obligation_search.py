"""*Show me*: `scbm explain` for one obligation in a process of its own, which can be cancelled."""

from __future__ import annotations

import subprocess
import sys
from tempfile import TemporaryFile
from threading import Lock
from typing import IO, TYPE_CHECKING, Any

from msgspec.json import decode

if TYPE_CHECKING:
    from pathlib import Path


MOST_SEARCHES = 4
"""How many searches a console does at once, one for each page: each needs a core."""


class _Search:
    """A process that looks for one case."""

    def __init__(self, model: Path, obligation: str) -> None:
        self.obligation = obligation
        self._out: IO[bytes] = TemporaryFile()  # noqa: SIM115 - closed in `end`; a pipe would fill up
        self._err: IO[bytes] = TemporaryFile()  # noqa: SIM115 - the same
        command = [sys.executable, "-m", "scbm", "explain", "--json", "--", str(model), obligation]
        self._process = subprocess.Popen(command, stdout=self._out, stderr=self._err, stdin=subprocess.DEVNULL)  # noqa: S603 - our own program, without a shell

    def state(self) -> dict[str, Any]:
        """Return how far it is, and what it has found."""
        code, lines = self._process.poll(), _text(self._err).strip().splitlines()
        if code is None:
            return {"state": "running", "obligation": self.obligation, "progress": lines[-1] if lines else ""}
        ended, out = {"state": "ended", "obligation": self.obligation}, _text(self._out)
        if not out:
            return {**ended, "reason": lines[0] if lines else "the search was ended"}
        found = decode(out)
        (decided, *_), cases = found["obligations"], found["cases"]
        reason = "; ".join([decided["reason"], *(each["text"] for each in decided["suggestions"])])
        case = {"text": cases[0]["text"], "record": decided["visit"]["record"]} if cases else {}
        return {**ended, "decision": decided["decision"], "reason": reason, **case}

    def end(self) -> None:
        """End the process, and wait for it."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
        self._out.close()
        self._err.close()


def _text(stream: IO[bytes]) -> str:
    stream.seek(0)
    return stream.read().decode("utf-8", errors="replace")


class ObligationSearches:
    """The present searches of a console: at most one for each page, and `MOST_SEARCHES`; one more ends the oldest."""

    def __init__(self, model: Path) -> None:
        self._model = model
        self._searches: dict[str, _Search] = {}
        self._turn = Lock()

    def begin(self, obligation: str, page: str) -> dict[str, Any]:
        """Look for a case that visits an obligation, instead of what the page looked for before."""
        self.end(page)
        with self._turn:
            if len(self._searches) == MOST_SEARCHES:
                self._searches.pop(next(iter(self._searches))).end()
            self._searches[page] = _Search(self._model, obligation)
            return self._searches[page].state()

    def state(self, page: str) -> dict[str, Any]:
        """Return how far the search of a page is."""
        with self._turn:
            return self._searches[page].state() if page in self._searches else {"state": "none"}

    def end(self, *pages: str) -> dict[str, Any]:
        """End the searches of pages; without pages those of all."""
        with self._turn:
            for page in pages or tuple(self._searches):
                if page in self._searches:
                    self._searches.pop(page).end()
        return {"state": "none"}
