"""The suite that closing begins with: case files and random cases, run, and how commands name them."""

from __future__ import annotations

import re
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from shlex import quote
from typing import TYPE_CHECKING

from scbm.files import read_file
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.reports import counted
from scbm.testing import Campaign, RandomCases, Tester, WrittenCase, load_suite

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from scbm.cases import Case
    from scbm.model import BehaviorModel


@dataclass(frozen=True)
class ClosingSuite:
    """Written cases, then random ones.

    Attributes:
        file: the model file.
        paths: the case files and directories of the command line.
        written: the cases in them.
        random: how many random cases there are.
        seed: what these are drawn from.
    """

    model: BehaviorModel
    file: Path
    paths: Sequence[Path]
    written: Sequence[WrittenCase]
    random: int = 0
    seed: int = 0

    @staticmethod
    def load(model: BehaviorModel, file: Path, paths: Sequence[Path], random: int = 0, seed: int = 0) -> ClosingSuite:
        """Reads the case files. Raises `InputError` with all that is wrong with them."""
        suite = ClosingSuite(model, file, paths, load_suite(paths, model), random, seed)
        suite._refuse_equal_names()
        return suite

    def run(self) -> Campaign:
        """Runs all of them."""
        return Campaign.of(self.model, Tester(self.model).results(self._cases()))

    def _cases(self) -> Iterator[Case]:
        yield from (written.case for written in self.written)
        if self.random:
            yield from RandomCases(self.model, str(self.file)).first(self.random, self.seed)

    def _refuse_equal_names(self) -> None:
        drawn = re.compile(rf"seed-{self.seed}-case-([1-9]\d*)", re.ASCII)
        for written in self.written:
            match = drawn.fullmatch(written.case.name)
            if match is not None and int(match[1]) <= self.random:
                message = f"`{written.case.name}` is drawn, and also in {written.path}"
                remedy = "choose another seed, or leave out one of them"
                raise InputError([Diagnostic(Slug.DUPLICATE_NAME, message, Place("--cases"), remedy)])

    @property
    def words(self) -> str:
        """How many cases of each sort there are; nothing if there are none."""
        parts = [counted(len(self.written), "written case")] if self.written else []
        parts += [f"{counted(self.random, 'random case')} of seed {self.seed}"] if self.random else []
        return " and ".join(parts)

    @property
    def first_words(self) -> str:
        """What is done first, for a progress display."""
        return f"running {self.words}" if self.words else f"looking at {self.model.name}"

    @property
    def arguments(self) -> str:
        """The case files as `scbm test MODEL` takes them, with a blank before each."""
        return "".join(f" {quote(str(path))}" for path in self.paths)

    @property
    def drawing(self) -> str:
        """The options that draw the random cases, with a blank before each."""
        return f" --cases {self.random} --seed {self.seed}" if self.random else ""

    @property
    def options(self) -> str:
        """All of it as `scbm close MODEL` takes it."""
        return "".join(f" --suite {quote(str(path))}" for path in self.paths) + self.drawing

    @property
    def files(self) -> dict[str, str]:
        """The file of each written case, by the name of the case."""
        return {written.case.name: str(written.path) for written in self.written}

    def text(self, name: str) -> str | None:
        """What the file of a written case says; `None` if there is no such case."""
        paths = [written.path for written in self.written if written.case.name == name]
        return read_file(paths[0]) if paths else None

    def again(self, name: str) -> str | None:
        """The command that shows a case of the suite; `None` if it has none of that name."""
        drawn = re.fullmatch(r"seed-(-?\d+)-case-(\d+)", name)
        for written in self.written:
            if written.case.name == name:
                return f"scbm replay {quote(str(written.path))}{self._model_of(written)}"
        if drawn is not None and self.random:
            return f"scbm run {quote(str(self.file))} --seed {drawn[1]} --case {drawn[2]}"
        return None

    def _model_of(self, written: WrittenCase) -> str:
        """The option that says the model, if the case does not name this one itself."""
        is_this = written.model_path is not None and written.model_path.resolve() == self.file.resolve()
        return "" if is_this else f" --model {quote(str(self.file))}"


@contextmanager
def progress(words: str) -> Iterator[Callable[[str], None]]:
    """Something that shows on a terminal what is done now; nothing elsewhere."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.console import Console  # noqa: PLC0415 - only where there is something to show
    from rich.markup import escape  # noqa: PLC0415

    with Console(file=sys.stderr).status(escape(words)) as status:
        yield lambda text: status.update(escape(text))
