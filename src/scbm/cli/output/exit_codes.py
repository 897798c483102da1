"""How commands end; `docs/reference/command-line.md` says what each code means."""

GOOD, FAILED, WRONG_INPUT, OWN_FAULT = 0, 1, 2, 3

INTERRUPTED = 130
"""As shells have it for Ctrl-C."""
