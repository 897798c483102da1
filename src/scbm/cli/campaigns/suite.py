"""The suite of a command line: case files and random cases, and the commands that repeat them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from functools import cached_property
from shlex import quote
from typing import TYPE_CHECKING

from scbm.cases import Network
from scbm.cli.options.arguments import complete
from scbm.files import FileWriter, read_file
from scbm.model import Diagnostic, InputError, Place, Slug, format_duration
from scbm.reports import counted
from scbm.reports.figure_table import shown_path
from scbm.testing import Campaign, RandomCases, Tester, WrittenCase, load_suite

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from pathlib import Path

    from scbm.cases import Case
    from scbm.model import BehaviorModel, Requirement


@dataclass(frozen=True)
class Suite:
    """Cases from files, then random ones.

    Attributes:
        model: what is tested.
        file: the model file.
        paths: the case files and directories of the command line.
        written: the cases in them.
        random: how many random cases the command line asks for.
        seed: what these are drawn from.
        network_text: the faults of their network, as the command line has them.
        network: the same; `None` draws another network for each.
        requirements: what every case must meet beside the requirements of the model.
        time_limit_ns: for cases that have no limit of their own.
        numbers: the random cases to run, from 1; all of them without a selection.
    """

    model: BehaviorModel
    file: Path
    paths: Sequence[Path]
    written: Sequence[WrittenCase]
    random: int = 0
    seed: int = 0
    network_text: str | None = None
    network: Network | None = field(default_factory=Network)
    requirements: tuple[Requirement, ...] = ()
    time_limit_ns: int | None = None
    numbers: Sequence[int] = ()

    @staticmethod
    def load(model: BehaviorModel, file: Path, paths: Sequence[Path], random: int = 0, seed: int = 0) -> Suite:
        """Read the case files. Raise `InputError` with all that is wrong with them."""
        suite = Suite(model, file, paths, load_suite(paths, model), random, seed, numbers=range(1, random + 1))
        suite.refuse_equal_names()
        return suite

    def selected(self, takes: Callable[[str], bool]) -> Suite:
        """Return the suite with those cases alone whose names are taken."""
        written = [case for case in self.written if takes(case.case.name)]
        return replace(self, written=written, numbers=[n for n in self.numbers if takes(self._drawn_name(n))])

    # the cases

    @property
    def count(self) -> int:
        """The number of cases to run."""
        return len(self.written) + len(self.numbers)

    @property
    def names(self) -> Iterator[str]:
        """The names of the cases to run, in their order."""
        yield from (written.case.name for written in self.written)
        yield from map(self._drawn_name, self.numbers)

    def cases(self) -> Iterator[Case]:
        """Yield all cases, with what the command line adds to them."""
        for written in self.written:
            yield self._completed(written.case)
        for case in self.drawn():
            yield self._completed(case)

    def completed_drawn(self) -> Iterator[Case]:
        """Yield the random cases, with what the command line adds to them."""
        return map(self._completed, self.drawn())

    def drawn(self) -> Iterable[Case]:
        """Yield the random cases, without what the command line adds."""
        if not self.numbers:
            return ()
        cases = RandomCases(self.model, str(self.file), self.network)
        return (cases.case(self.seed, number) for number in self.numbers)

    def run(self) -> Campaign:
        """Run all cases in simulation."""
        return Campaign.of(self.model, Tester(self.model).results(self.cases()))

    @cached_property
    def by_name(self) -> dict[str, WrittenCase]:
        """The written cases by their names."""
        return {written.case.name: written for written in self.written}

    @property
    def files(self) -> dict[str, str]:
        """The file of each written case, by the name of the case."""
        return {written.case.name: str(written.path) for written in self.written}

    def text(self, name: str) -> str | None:
        """Return the text of the file of a written case; `None` if there is no such case."""
        written = self.by_name.get(name)
        return None if written is None else read_file(written.path)

    @property
    def loses_messages(self) -> bool:
        """Whether the network of random cases may lose messages."""
        network = self.network
        return network is None or bool(network.loss or network.partitions or network.restarts)

    def _completed(self, case: Case) -> Case:
        return complete(case, self.requirements, self.time_limit_ns, self.model)

    def _drawn_name(self, number: int) -> str:
        return f"seed-{self.seed}-case-{number}"

    # what is refused

    def refuse_equal_names(self) -> None:
        """Raise `InputError` if a written case has the name of a random one."""
        drawn = re.compile(rf"seed-{self.seed}-case-([1-9]\d*)", re.ASCII)
        for written in self.written:
            match = drawn.fullmatch(written.case.name)
            if match is not None and int(match[1]) <= self.random:
                message = f"`{written.case.name}` is drawn, and also in {written.path}"
                remedy = "choose another seed, or leave out one of them"
                raise InputError([Diagnostic(Slug.DUPLICATE_NAME, message, Place("--cases"), remedy)])

    @cached_property
    def writer(self) -> FileWriter:
        """What writes the files of the command, and refuses to replace the model and the case files."""
        return FileWriter([(self.file, "the model"), *((written.path, "a case file") for written in self.written)])

    # the suite in words and as commands

    @property
    def words(self) -> str:
        """How many cases of each sort there are; nothing if there are none."""
        parts = [counted(len(self.written), "written case")] if self.written else []
        parts += [f"{counted(self.random, 'random case')} of seed {self.seed}"] if self.random else []
        return " and ".join(parts)

    @property
    def activity(self) -> str:
        """What running the suite is called on a progress display."""
        return f"running {self.words}" if self.words else f"exploring {self.model.name}"

    @property
    def arguments(self) -> str:
        """The case files as arguments of `scbm test MODEL`, with a blank before each."""
        return "".join(f" {shown_path(str(path))}" for path in self.paths)

    @property
    def drawing(self) -> str:
        """The options that draw the random cases, with a blank before each."""
        return f" --cases {self.random} --seed {self.seed}" if self.random else ""

    @property
    def network_option(self) -> str:
        """The option for the network of the random cases, with a blank before it."""
        return f" --network {quote(self.network_text)}" if self.network_text else ""

    @property
    def test_options(self) -> str:
        """All of it as arguments and options of `scbm test MODEL`."""
        return f"{self.arguments}{self.drawing}{self.network_option}{self._judging}"

    @property
    def close_options(self) -> str:
        """All of it as options of `scbm close MODEL`."""
        return "".join(f" --suite {quote(str(path))}" for path in self.paths) + self.drawing

    def again(self, name: str) -> str | None:
        """Return the command that shows a case again; `None` if the suite has none of that name."""
        if name in self.by_name:
            written = self.by_name[name]
            return f"scbm replay {shown_path(str(written.path))}{self._model_of(written)}{self._judging}"
        drawn = re.fullmatch(rf"seed-{self.seed}-case-(\d+)", name, re.ASCII)
        if drawn is None or not self.random:
            return None
        options = f" --seed {self.seed} --case {drawn[1]}{self.network_option}{self._judging}"
        return f"scbm run {shown_path(str(self.file))}{options}"

    def _model_of(self, written: WrittenCase) -> str:
        """Return the option for the model, if the case does not name this model itself."""
        named = written.model_path
        is_this = named is not None and named.resolve() == self.file.resolve()
        return "" if is_this else f" --model {quote(str(self.file))}"

    @property
    def _judging(self) -> str:
        """The options that decide how long cases run and what they must meet."""
        limit = [] if self.time_limit_ns is None else [("--time-limit", format_duration(self.time_limit_ns))]
        options = [*limit, *(("--require", str(requirement.sentence)) for requirement in self.requirements)]
        return "".join(f" {option} {quote(value)}" for option, value in options)
