"""Output of lines and JSON: with colours on a terminal, without them in a pipe; and what a command does now.

Control characters are escaped.
"""

from __future__ import annotations

import json
import os
import re
import sys
from contextlib import contextmanager
from typing import IO, TYPE_CHECKING, Any

from rich.cells import cell_len
from rich.console import Console
from rich.text import Text

from scbm.cli.output.progress import LineClock, RemainingTime
from scbm.model import Severity
from scbm.model.visible_text import ACTING, counted, escaped, in_one_line
from scbm.reports.terminal.visible_lines import visible_line

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from scbm.model import Diagnostic

_BEFORE_COMMENT = "   "
"""The blanks between a command and its comment."""

_DEFAULT_COLUMNS, _MIN_COLUMNS, _MAX_COLUMNS = 80, 40, 120
"""The default width of a report in columns, and the bounds of the width of a terminal."""

_STYLES = {Severity.ERROR: "bold red", Severity.WARNING: "bold yellow", Severity.NOTE: "bold cyan"}


class _PlainConsole(Console):
    """A console that ignores a closed pipe, so that the exit code still says what the command found."""

    def on_broken_pipe(self) -> None:
        """Do nothing: Rich would exit with 1, the exit code of failed tests."""
        redirect_to_null(self.file)


def redirect_to_null(stream: IO[str]) -> None:
    """Redirect a stream to the null device: the reader of a pipe has closed it."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def report_columns() -> int:
    """Return the width of reports: that of `COLUMNS` or of the terminal, else 80 columns."""
    columns = _columns_of_environment()
    if columns is None:
        columns = os.get_terminal_size(sys.stdout.fileno()).columns if sys.stdout.isatty() else _DEFAULT_COLUMNS
    return min(max(columns, _MIN_COLUMNS), _MAX_COLUMNS)


def _columns_of_environment() -> int | None:
    """Return the width in the variable `COLUMNS`; `None` if it is not a number below 10000."""
    value = os.environ.get("COLUMNS", "")
    return int(value) if value.isascii() and value.isdigit() and len(value) < len("10000") else None


def _fold_columns(stream: IO[str]) -> int | None:
    """Return the width at which long lines are broken; `None` for a pipe or a file, if `COLUMNS` is not set."""
    return report_columns() if stream.isatty() or _columns_of_environment() is not None else None


def folded(text: Text, columns: int) -> Iterator[Text]:
    """Break a line between its words; what follows is indented as the last column of the line that begins early.

    A line that is marked with `no_wrap` is a picture, or a command, maybe with a comment behind three blanks: only the
    comment gets a line of its own, above the command.
    """
    plain = text.plain
    indent = len(plain) - len(plain.lstrip())
    if text.no_wrap:
        end = plain.find(_BEFORE_COMMENT, indent)
        if cell_len(plain) <= columns or end < 0 or not plain.startswith("scbm ", indent):
            yield text
            return
        comment = Text(" " * indent + "# ").append_text(text[end + len(_BEFORE_COMMENT) :])
        yield from folded(comment, columns)
        yield text[:end]
        return
    gaps = [gap.end() for gap in re.finditer(r"(?<=\S) {2,}(?=\S)", plain[: columns // 2])]
    indent = gaps[-1] if gaps else indent + 2
    begin = 0
    while cell_len(plain[begin:]) + (indent if begin else 0) > columns:
        limit = begin + columns - (indent if begin else 0)
        cut = plain.rfind(" ", begin + (0 if begin else indent) + 1, limit + 1)
        cut = cut if cut > 0 else plain.find(" ", limit)
        if cut < 0:
            break
        yield _indented(text[begin:cut], indent if begin else 0)
        begin = cut + 1
    yield _indented(text[begin:], indent if begin else 0)


def _indented(text: Text, columns: int) -> Text:
    text.rstrip()
    return Text(" " * columns).append_text(text) if columns else text


class TerminalOutput:
    """Writes lines to one stream.

    Long lines of reports are broken for a terminal, or where `COLUMNS` is set. In a pipe or a file, lines are as long
    as they are.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._columns = _fold_columns(console.file)

    def fits(self, line: str) -> bool:
        """Return whether a line need not be broken."""
        return self._columns is None or cell_len(line) <= self._columns

    def line(self, text: Text | str = "") -> None:
        """Print one line of text, or several."""
        shown = Text(escaped(text)) if isinstance(text, str) else visible_line(text, ACTING)
        self._console.print(shown, soft_wrap=True, highlight=False, markup=False)

    def lines(self, texts: Iterable[Text]) -> None:
        """Print lines; a line feed within one of them comes from a file or a peer, and is escaped."""
        for text in texts:
            shown = visible_line(text)
            for line in [shown] if self._columns is None else folded(shown, self._columns):
                self.line(line)

    def prose(self, words: str) -> None:
        """Print a sentence; it is broken between words where lines of reports are."""
        self.lines([Text(words)])

    def diagnostics(self, diagnostics: Sequence[Diagnostic]) -> None:
        """Print each diagnostic with its place, its line and its remedy; then the number of diagnostics."""
        for diagnostic in diagnostics:
            self.line(_coloured(diagnostic))
        if len(diagnostics) > 1:
            self.line(count_of(diagnostics))


def results() -> TerminalOutput:
    """Return the output for results: the standard output."""
    return TerminalOutput(_PlainConsole(file=sys.stdout))


def errors() -> TerminalOutput:
    """Return the output for errors and progress: the standard error output."""
    return TerminalOutput(_PlainConsole(file=sys.stderr))


def write_json(data: dict[str, Any]) -> None:
    """Print data as JSON to the standard output."""
    try:
        text = json.dumps(data, indent=2, ensure_ascii=False)
        sys.stdout.write(ACTING.sub(lambda match: f"\\u{ord(match[0]):04x}", text) + "\n")
        sys.stdout.flush()
    except BrokenPipeError:
        redirect_to_null(sys.stdout)


def count_of(diagnostics: Sequence[Diagnostic]) -> str:
    """Return the numbers of errors, warnings and notes in words."""
    numbers = ((sum(each.severity is severity for each in diagnostics), severity) for severity in Severity)
    return ", ".join(counted(number, severity.value) for number, severity in numbers if number)


def _coloured(diagnostic: Diagnostic) -> Text:
    head, *rest = escaped(str(diagnostic)).split("\n")
    text = Text(head)
    label = f"{diagnostic.severity}[{diagnostic.slug}]:"
    begin = head.find(label)
    text.stylize(_STYLES[diagnostic.severity], begin, begin + len(label))
    text.stylize("bold", 0, begin)
    for line in rest:
        stripped = line.strip()
        style = "green" if stripped.startswith("^") else "cyan" if stripped.startswith("= ") else ""
        text.append("\n").append(line, style=style)
    return text


_PROGRESS_COLUMNS = 120
"""The width of lines about progress where no terminal says how wide it is."""


def print_progress(text: str, elapsed: str = "") -> None:
    """Print a line of at most 120 columns about an activity, and its time so far."""
    begin, end = "scbm: ", f" ({elapsed})" if elapsed else ""
    words = Text(in_one_line(text))
    words.truncate(_PROGRESS_COLUMNS - len(begin) - len(end), overflow="ellipsis")
    errors().line(f"{begin}{words.plain}{end}")


@contextmanager
def activity_display(
    words: str, clock: LineClock | None = None, remaining: RemainingTime | None = None
) -> Iterator[Callable[[str], None]]:
    """Show the current activity: on a terminal, or every ten seconds elsewhere; yield a callback that changes it."""
    remaining = remaining or RemainingTime()
    if not sys.stderr.isatty():
        clock = clock or LineClock()

        def show(text: str) -> None:
            more = remaining.of(text)
            if elapsed := clock.due():
                print_progress(text, f"{elapsed}, {more}" if more else elapsed)

        yield show
        return
    from rich.console import Console  # noqa: PLC0415 - only where there is something to show

    console = Console(file=sys.stderr)
    with console.status(_status(words)) as status:

        def update(text: str) -> None:
            more = remaining.of(text)
            status.update(_status(f"{text}, {more}" if more else text))

        yield update


def _status(text: str) -> Text:
    """Return an activity as one line beside the spinner."""
    return Text(in_one_line(text), no_wrap=True, overflow="ellipsis")
