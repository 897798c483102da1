"""The suite of a command line: case files and random cases, and the commands that repeat them."""

from __future__ import annotations

import re
from contextlib import closing, contextmanager
from functools import cached_property
from typing import TYPE_CHECKING

from msgspec import Struct, field
from msgspec.structs import replace

from scbm.cases import Network
from scbm.files import FileWriter, load_located, read_file, real_path
from scbm.model import Diagnostic, InputError, Place, Slug, format_duration
from scbm.model.predicates import TRUE
from scbm.model.visible_text import counted, shell_word, shown_path
from scbm.testing.batches.batch_summary import BatchSummary
from scbm.testing.batches.campaign_runs import run_steps
from scbm.testing.batches.campaign_work import CampaignWork, drawn_name
from scbm.testing.campaign import Campaign
from scbm.testing.planner_override import planner_of_replay
from scbm.testing.random_cases import RandomCases, most_goals

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from pathlib import Path

    from scbm.cases import Case
    from scbm.model import BehaviorModel, Requirement
    from scbm.testing.batches.campaign_runs import Executor
    from scbm.testing.written_cases import WrittenCase


class Suite(Struct, frozen=True, dict=True):
    """Cases from files, then random cases.

    Attributes:
        model: the model under test.
        file: the model file.
        paths: the case files and directories of the command line.
        written: the cases in them.
        random: the number of random cases.
        seed: the seed of the random cases.
        network_text: the network of the random cases, as on the command line.
        network: the same network, parsed; `None` draws another network for each case.
        requirements: additional requirements for each case.
        time_limit_ns: the time limit for cases without their own.
        numbers: the numbers of the random cases to run, from 1; all of them without a selection.
        planner_option: the options for the planner as the command line has them, with a blank before each; `model` has
            the planner itself.
        moves_inputs: whether random cases move inputs and published values without environment transitions, too.
        given_goals: the largest number of goals of a random case as on the command line; `None` for that of the model.
    """

    model: BehaviorModel
    file: Path
    paths: Sequence[Path] = ()
    written: Sequence[WrittenCase] = ()
    random: int = 0
    seed: int = 0
    network_text: str | None = None
    network: Network | None = field(default_factory=Network)
    requirements: tuple[Requirement, ...] = ()
    time_limit_ns: int | None = None
    numbers: Sequence[int] = ()
    planner_option: str = ""
    moves_inputs: bool = False
    given_goals: int | None = None

    @property
    def goals(self) -> int:
        """The largest number of goals of a random case."""
        return self.given_goals or most_goals(self.model)

    def loaded(self) -> Suite:
        """Return the suite with the cases of its files, and with all its random cases.

        Raises:
            InputError: with all errors of the case files, or a written case has the name of a random one.
        """
        suite = replace(self, written=_read_cases(self.paths, self.model), numbers=range(1, self.random + 1))
        suite.refuse_equal_names()
        return suite

    def selected(self, takes: Callable[[str], bool]) -> Suite:
        """Return the suite with only those cases whose names `takes` accepts."""
        written = [case for case in self.written if takes(case.case.name)]
        return replace(self, written=written, numbers=[n for n in self.numbers if takes(self._drawn_name(n))])

    def first_drawn(self, count: int) -> Suite:
        """Return the suite with the first random cases alone, as if the command line had asked for so many."""
        return replace(self, random=count, numbers=self.numbers[:count])

    # the cases

    @property
    def count(self) -> int:
        """The number of cases to run."""
        return len(self.written) + len(self.numbers)

    @property
    def names(self) -> Iterator[str]:
        """The names of the cases to run, in their order."""
        yield from (written.case.name for written in self.written)
        yield from self.drawn_names

    @property
    def drawn_names(self) -> Iterator[str]:
        """The names of the random cases to run, in their order."""
        return map(self._drawn_name, self.numbers)

    @cached_property
    def work(self) -> CampaignWork:
        """The cases, with what the command line adds to them, as a campaign that any process can run."""
        written = tuple(written.case for written in self.written)
        added = (self.requirements, self.time_limit_ns)
        return CampaignWork(
            self.model,
            written,
            self.numbers,
            self.seed,
            self.network,
            *added,
            str(self.file),
            self.moves_inputs,
            self.goals,
        )

    def drawn(self) -> Iterable[Case]:
        """Yield the random cases, without additions of the command line."""
        if not self.numbers:
            return ()
        file, moves_inputs = str(self.file), self.moves_inputs
        cases = RandomCases(self.model, file, self.network, moves_inputs=moves_inputs, goals=self.goals)
        return (cases.case(self.seed, number) for number in self.numbers)

    def run(self, show: Callable[[str], None], executor: Executor | None = None) -> Campaign:
        """Run all cases in simulation, by default in this process; `show` is called with the progress."""
        total = BatchSummary(written=len(self.written))
        with self.locating(), closing(run_steps(self.work, executor)) as steps:
            for step in steps:
                total = step.total
                show(f"running {total.count} of {counted(self.count, 'case')}")
        return Campaign(self.model, self.work, total)

    @contextmanager
    def locating(self) -> Iterator[None]:
        """Give errors about `initial_states` their place in the model file."""
        try:
            yield
        except InputError as error:
            slugs = (Slug.NO_INITIAL_STATE, Slug.INITIAL_STATE_NOT_FOUND)
            if self.model.initial_states == TRUE or any(each.slug not in slugs for each in error.diagnostics):
                raise
            place, line = load_located(self.file)[1].find(("initial_states",))
            found = [replace(each, place=place, source_line=line) for each in error.diagnostics]
            raise InputError(found) from error

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
        return self.network is None or self.network.may_lose_messages

    def _drawn_name(self, number: int) -> str:
        return drawn_name(self.seed, number)

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
        """A writer for the files of the command; it refuses to replace what the command reads."""
        return FileWriter([(written.path, "a case file") for written in self.written], self.file)

    # the suite in words and as commands

    @property
    def words(self) -> str:
        """The number of written and of random cases in words; empty if there are none."""
        parts = [counted(len(self.written), "written case")] if self.written else []
        parts += [f"{counted(self.random, 'random case')} of seed {self.seed}"] if self.random else []
        return " and ".join(parts)

    @property
    def activity(self) -> str:
        """The text of the progress display while the suite runs."""
        return f"running {self.words}" if self.words else f"exploring {self.model.name}"

    @property
    def arguments(self) -> str:
        """The case files as arguments of `scbm test MODEL`, each with a leading blank."""
        return "".join(f" {shown_path(str(path))}" for path in self.paths)

    @property
    def drawing(self) -> str:
        """The options for the random cases, each with a leading blank."""
        return f" --cases {self.random} --seed {self.seed}" if self.random else ""

    def origin_words(self, number: int) -> str:
        """Return what a random case was drawn from, with the planner of the command line."""
        planned = f", with{self.planner_option}" if self.planner_option else ""
        return f"case {number} of seed {self.seed}{planned}"

    @property
    def network_option(self) -> str:
        """The options for network, inputs and goals of the random cases, each with a leading blank."""
        network = f" --network {shell_word(self.network_text)}" if self.network_text else ""
        goals = "" if self.given_goals is None else f" --goals {self.given_goals}"
        return network + (" --inputs drawn" if self.moves_inputs else "") + goals

    @property
    def test_options(self) -> str:
        """The suite as arguments and options of `scbm test MODEL`."""
        return f"{self.arguments}{self.drawing}{self.network_option}{self.planner_option}{self._judging}"

    @property
    def close_options(self) -> str:
        """The suite as options of `scbm close MODEL`."""
        return "".join(f" --suite {shell_word(str(path))}" for path in self.paths) + self.drawing + self.planner_option

    def again(self, name: str) -> str | None:
        """Return the command that reproduces a case; `None` if the suite has no case with that name."""
        if name in self.by_name:
            written = self.by_name[name]
            planner = planner_of_replay(written.case, self.model, self.planner_option)
            return f"scbm replay {shown_path(str(written.path))}{self._model_of(written)}{planner}{self._judging}"
        drawn = re.fullmatch(rf"seed-{self.seed}-case-(\d+)", name, re.ASCII)
        if drawn is None or not self.random:
            return None
        options = f" --seed {self.seed} --case {drawn[1]}{self.network_option}{self.planner_option}{self._judging}"
        return f"scbm run {shown_path(str(self.file))}{options}"

    def _model_of(self, written: WrittenCase) -> str:
        """Return the option for the model; empty if the case names this model itself."""
        named = written.model_path
        is_this = named is not None and real_path(named) == real_path(self.file)
        return "" if is_this else f" --model {shell_word(str(self.file))}"

    @property
    def _judging(self) -> str:
        """The options that decide how long cases run and what they must meet."""
        limit = [] if self.time_limit_ns is None else [("--time-limit", format_duration(self.time_limit_ns))]
        options = [*limit, *(("--require", str(requirement.sentence)) for requirement in self.requirements)]
        return "".join(f" {option} {shell_word(value)}" for option, value in options)


def _read_cases(paths: Sequence[Path], model: BehaviorModel) -> tuple[WrittenCase, ...]:
    if not paths:
        return ()
    from scbm.testing.written_cases import load_suite  # noqa: PLC0415 - the keys of case files, which many suites do not need

    return load_suite(paths, model)
