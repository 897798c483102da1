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
        out = _text(self._out)
        if not out:
            return {
                "state": "ended",
                "obligation": self.obligation,
                "reason": lines[0] if lines else "the search was ended",
            }
        found = decode(out)
        (decided, *_), cases = found["obligations"], found["cases"]
        reasons = [decided["reason"], *(each["text"] for each in decided["suggestions"])]
        case = {"text": cases[0]["text"], "record": decided["visit"]["record"]} if cases else {}
        reason = "; ".join(reasons)
        return {
            "state": "ended",
            "obligation": self.obligation,
            "decision": decided["decision"],
            "reason": reason,
            **case,
        }

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
    """The present search of a console, if there is one."""

    def __init__(self, model: Path) -> None:
        self._model = model
        self._search: _Search | None = None
        self._turn = Lock()

    def begin(self, obligation: str) -> dict[str, Any]:
        """Look for a case that visits an obligation, instead of what was looked for before."""
        with self._turn:
            self._end()
            self._search = _Search(self._model, obligation)
            return self._search.state()

    def state(self) -> dict[str, Any]:
        """Return how far the search is."""
        with self._turn:
            return {"state": "none"} if self._search is None else self._search.state()

    def end(self) -> dict[str, Any]:
        """End the search."""
        with self._turn:
            self._end()
            return {"state": "none"}

    def _end(self) -> None:
        if self._search is not None:
            self._search.end()
            self._search = None
