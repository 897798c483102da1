"""The entry point `scbm`: it imports little, so that `--version` is fast and Ctrl-C is handled from the beginning."""

from __future__ import annotations

import atexit
import codecs
import gc
import os
import signal
import sys
from contextlib import contextmanager
from functools import cache
from io import TextIOWrapper
from typing import TYPE_CHECKING, NoReturn, TextIO

import scbm
from scbm.cli.exit_codes import GOOD, INTERRUPTED, OWN_FAULT, WRONG_INPUT

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


ASCII_FORMS = {
    "●": "*", "○": "o", "█": "#", "▓": "+", "░": ".", "■": "=", "⚡": "!", "✗": "x", "✓": "v",
    "│": "|", "┆": ":", "┌": "+", "└": "+", "┘": "+", "─": "-", "→": "->", "←": "<-", "…": "...",
    "≥": ">=", "≤": "<=", "≠": "!=", "∧": "&&", "\u2228": "||", "¬": "!", "µ": "u", "—": "-",
    "\u00d7": "x", "⊘": "/", "▒": ":", "·": ".", "▲": "^", "±": "+/-", "↻": "@",
}  # fmt: skip
"""ASCII forms of the marks of reports, for outputs whose encoding lacks them, such as a redirected console.

Marks of one legend have different forms, and no mark has `?`, which stands for characters without a form. No escape has
the name of its character: to compile such a name imports a module, and Ctrl-C during that is a `SyntaxError`.
"""

_ASCII_HANDLER = "scbm-ascii-forms"
"""The name of the error handler of such outputs."""


def main() -> None:
    """Run `scbm`; exit with 0 good, 1 the tests failed, 2 the input is wrong, 3 a fault of scbm itself."""
    _suspend_garbage_collection()
    restore = _leave_on_interrupt()

    def begin() -> None:
        _resume_garbage_collection()
        restore()
        _interrupt_on_sigterm()

    try:
        with _leaving_on_sigterm(sys.argv[1:]):
            code = _run(sys.argv[1:], begin)
    except KeyboardInterrupt:
        code = INTERRUPTED
    finally:
        gc.enable()
        restore()
    sys.exit(code)


def _suspend_garbage_collection() -> None:
    """Search for no cycles of unused objects while modules are imported, nor at the end of the process.

    Modules make many objects and drop no cycles. At the end the operating system takes back all memory at once.
    """
    gc.disable()
    atexit.unregister(gc.freeze)
    atexit.register(gc.freeze)


def _resume_garbage_collection() -> None:
    """Search for cycles of unused objects again, except among the objects of the imported modules."""
    _freeze_modules()
    gc.enable()


@cache
def _freeze_modules() -> None:
    """Leave the present objects out of later searches, once for each process. `gc.get_freeze_count` counts them all."""
    gc.freeze()


def _run(arguments: list[str], begin: Callable[[], None]) -> int:
    """Run a command line and return its exit code; `begin` is called before the work of the verb."""
    codecs.register_error(_ASCII_HANDLER, _ascii_forms)
    _replace_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors=_ASCII_HANDLER)
    try:
        return _flushed(_done(arguments, begin))
    except OSError as error:
        what = "cannot write the output" if error.filename is None else f"cannot use {error.filename}"
        _last_words(f"scbm: {what}: {(error.strerror or str(error)).lower()}\n")
        _discard(sys.stdout)
        return WRONG_INPUT
    except Exception as error:  # noqa: BLE001 - the last handler: it separates defects of scbm from interruptions
        return INTERRUPTED if _is_interruption(error) else _own_fault()


def _last_words(text: str) -> None:
    """Write to the error stream, unless it cannot be written either."""
    try:
        sys.stderr.write(text)
        sys.stderr.flush()
    except OSError:
        _discard(sys.stderr)


def _discard(stream: TextIO) -> None:
    """Leave unwritten what a stream still holds."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _replace_closed_streams() -> None:
    """Write to the null device what would go to a stream that is closed, as by `scbm check >&-`: it is `None`."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: PTH123, SIM115 - until the end


def _done(arguments: list[str], begin: Callable[[], None]) -> int:
    if arguments == ["--version"]:
        sys.stdout.write(f"scbm {scbm.__version__}\n")
        return GOOD
    from scbm.cli.application import run_verb  # noqa: PLC0415 - typer and the model, which the version does not need

    return run_verb(arguments, begin)


def _ascii_forms(error: UnicodeError) -> tuple[str, int]:
    """Replace the characters that an output encoding lacks by their ASCII forms, others by `?`."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(ASCII_FORMS.get(character, "?") for character in error.object[error.start : error.end]), error.end


def _leave_on_interrupt() -> Callable[[], None]:
    """Let Ctrl-C end the process at once, without a traceback, while it starts; return what ends that.

    Nothing is open yet that has to be closed. Modules that are being imported could turn a `KeyboardInterrupt` into
    another error. When the process ends, Ctrl-C works in this way again.
    """
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        return lambda: None  # a shell that starts a job in the background ignores Ctrl-C for it
    try:
        signal.signal(signal.SIGINT, _leave)
    except ValueError:  # in a thread, which gets no signals
        return lambda: None
    atexit.unregister(_leave_when_interrupted)
    atexit.register(_leave_when_interrupted)

    def restore() -> None:
        if signal.getsignal(signal.SIGINT) is _leave:
            signal.signal(signal.SIGINT, signal.default_int_handler)

    return restore


@contextmanager
def _leaving_on_sigterm(arguments: list[str]) -> Iterator[None]:
    """Let SIGTERM end the process at once while it starts, as Ctrl-C does; a node ends with the code of its end.

    A node that serves handles SIGTERM itself, and so does a tester. It stays ignored where it is.
    """
    serves = arguments[:1] == ["node"] and arguments[1:2] != ["tester"]
    before = signal.getsignal(signal.SIGTERM)
    try:
        if before is not signal.SIG_IGN:
            signal.signal(signal.SIGTERM, _leave_well if serves else _leave)
    except ValueError:  # in a thread, which gets no signals
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _interrupt_on_sigterm() -> None:
    """Let SIGTERM interrupt the work of a verb as Ctrl-C does."""
    if signal.getsignal(signal.SIGTERM) is _leave:
        signal.signal(signal.SIGTERM, signal.default_int_handler)


def _leave_when_interrupted() -> None:
    signal.signal(signal.SIGINT, _leave)


def _leave(*_: object) -> NoReturn:
    os._exit(INTERRUPTED)


def _leave_well(*_: object) -> NoReturn:
    os._exit(GOOD)


def _is_interruption(error: BaseException | None) -> bool:
    """Return whether an error came of Ctrl-C: a module that is interrupted while it is imported may raise another."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__cause__ or error.__context__
    return False


def _own_fault() -> int:
    import traceback  # noqa: PLC0415 - only where something is wrong with scbm itself

    report = "Please report it with the lines above."
    _last_words(f"{traceback.format_exc()}scbm: this is a fault of scbm, not of your input. {report}\n")
    return OWN_FAULT


def _flushed(code: int) -> int:
    """Flush the streams and return the exit code, also when the readers have closed them."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except BrokenPipeError:
            _discard(stream)
    return code
