"""The exit codes of commands; `docs/reference/command-line.md` says what each means."""

from __future__ import annotations

GOOD, FAILED, WRONG_INPUT, OWN_FAULT = 0, 1, 2, 3

INTERRUPTED = 130
"""The exit code that shells use for Ctrl-C."""
